"""`motionloom serve` and `motionloom studio`: motion over HTTP, and the page that shows it."""

import os
from argparse import Namespace
from typing import TYPE_CHECKING

from motionloom.cli.writing import fail

if TYPE_CHECKING:
    from motionloom.goals.adapters import Applied


def run_serve(arguments: Namespace) -> None:
    """``motionloom serve``."""
    if not 0 <= arguments.port <= 65535:
        fail(f"--port must be 0 to 65535; got {arguments.port}")
    adapters = _checked(arguments)
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


def run_mcp(arguments: Namespace) -> None:
    """``motionloom mcp``."""
    adapters = _checked(arguments)
    from motionloom.server.assistant import run

    _set_threads(arguments)
    run(arguments.project, weights=arguments.weights, device=arguments.device, adapters=adapters)


def _checked(arguments: Namespace) -> "tuple[Applied, ...]":
    """The adapters of the command line, checked before anything is started."""
    from motionloom.goals.adapters import parse_adapter

    if arguments.threads is not None and not 1 <= arguments.threads <= 1024:
        fail(f"--threads must be 1 to 1024; got {arguments.threads}")
    adapters = tuple(parse_adapter(word) for word in arguments.adapter)
    for path, _ in adapters:
        if not path.is_file():
            fail(f"there is no adapter {path}; 'motionloom teach ... --out FILE' makes one")
    return adapters


def _set_threads(arguments: Namespace) -> None:
    if arguments.threads is not None:
        from motionloom.core.models.networks import set_threads

        set_threads(arguments.threads)


def _leave_a_core() -> None:
    """The networks get one thread less than there are cores, unless the user has set how many.

    With a thread on every core each layer waits for the one whose core draws the page's pictures: on two cores a draw
    of 10 s took 8.8 s beside a browser without a GPU, and 1.7 s so (docs/decisions/0023).
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    os.environ.setdefault("MOTIONLOOM_THREADS", str(max(cores - 1, 1)))
