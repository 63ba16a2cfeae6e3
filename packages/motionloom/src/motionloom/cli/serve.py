"""`motionloom serve` and `motionloom studio`: motion over HTTP, and the page that draws it."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.cli.sampling import add_adapters, fail

if TYPE_CHECKING:
    from motionloom.goals.adapters import Applied

PROJECT = Path("motionloom-project")


def add(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Register `serve` and `studio`."""
    about = {
        "serve": ("answer over HTTP, with the weights loaded once", "A server for pages and programs: docs/server.md."),
        "studio": ("write, draw and watch motion in the browser", "Start the server and open the studio's page."),
    }
    for name, (short, long) in about.items():
        parser = subparsers.add_parser(name, help=short, description=long)
        _options(parser)
        parser.set_defaults(run=run_serve, show=name == "studio")

    assistant = subparsers.add_parser(
        "mcp",
        help="let an assistant make motion (MCP)",
        description="Serve generate_motion, compose and export over standard input and output: docs/server.md.",
    )
    _project(assistant)
    _threads(assistant, "as many as cores")
    _model(assistant)
    assistant.set_defaults(run=run_mcp)


def _options(parser: argparse.ArgumentParser) -> None:
    _project(parser)
    _threads(parser, "one less than there are cores, for the page")
    parser.add_argument("--host", default="127.0.0.1", help="address to bind to (default 127.0.0.1: this machine only)")
    parser.add_argument("--port", type=int, default=8020, help="port, 0 for any that is free (default 8020)")
    parser.add_argument("--token", help="what clients must send; made and printed where --host is not this machine")
    parser.add_argument(
        "--allow-host", action="append", default=[], metavar="NAME", help="a further name of this server, repeatable"
    )
    parser.add_argument(
        "--allow-origin",
        action="append",
        default=[],
        metavar="URL",
        help="a page's origin, such as http://localhost:5173, that may ask too, repeatable",
    )
    parser.add_argument(
        "--robot",
        type=Path,
        action="append",
        default=[],
        metavar="MODEL",
        help="a humanoid robot's model whose joint angles live sessions may ask for by the file's name, repeatable",
    )
    _model(parser)


def _project(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--project",
        type=Path,
        default=PROJECT,
        metavar="FOLDER",
        help="the only folder that is read and written, made if missing (default motionloom-project)",
    )


def _model(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--weights", default="default", metavar="NAME|PATH", help="the prior (default: default)")
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    add_adapters(parser)


def _threads(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument("--threads", type=int, metavar="N", help=f"CPU threads (default: {default})")


def run_serve(arguments: argparse.Namespace) -> None:
    """``motionloom serve``."""
    if not 0 <= arguments.port <= 65535:
        fail(f"--port must be 0 to 65535; got {arguments.port}")
    _check_threads(arguments)
    adapters = _adapters(arguments)
    try:
        from motionloom.server.serving import Options, serve
    except ModuleNotFoundError as error:
        fail(f"the server needs {error.name}: install it with pip install 'motionloom[studio]'")
    _set_threads(arguments)
    if arguments.threads is None:
        _leave_a_core()
    serve(
        Options(
            arguments.project,
            arguments.host,
            arguments.port,
            arguments.token,
            tuple(arguments.allow_host),
            tuple(arguments.allow_origin),
            arguments.weights,
            arguments.device,
            adapters,
            tuple(arguments.robot),
            arguments.show,
        )
    )


def run_mcp(arguments: argparse.Namespace) -> None:
    """``motionloom mcp``."""
    _check_threads(arguments)
    adapters = _adapters(arguments)
    from motionloom.server.assistant import run

    _set_threads(arguments)
    run(arguments.project, weights=arguments.weights, device=arguments.device, adapters=adapters)


def _adapters(arguments: argparse.Namespace) -> "tuple[Applied, ...]":
    """Those of the command line; a file that does not exist is reported before anything is started."""
    from motionloom.goals.adapters import parse_adapter

    adapters = tuple(parse_adapter(word) for word in arguments.adapter)
    for path, _ in adapters:
        if not path.is_file():
            fail(f"there is no adapter {path}; 'motionloom teach ... --out FILE' makes one")
    return adapters


def _check_threads(arguments: argparse.Namespace) -> None:
    if arguments.threads is not None and not 1 <= arguments.threads <= 1024:
        fail(f"--threads must be 1 to 1024; got {arguments.threads}")


def _set_threads(arguments: argparse.Namespace) -> None:
    if arguments.threads is not None:
        from motionloom.runtime import set_threads

        set_threads(arguments.threads)


def _leave_a_core() -> None:
    """The networks get one thread less than there are cores, unless the user has said how many.

    With a thread on every core each layer waits for the one whose core draws the page's pictures: on two cores a draw
    of 10 s took 8.8 s beside a browser without a GPU, and 1.7 s so (docs/decisions/0023).
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    os.environ.setdefault("MOTIONLOOM_THREADS", str(max(cores - 1, 1)))
