"""`motionloom data`: recordings to training sets."""

import argparse
from importlib import import_module
from pathlib import Path

from motionloom.cli.writing import add_force, check_overwriting

READERS = "motionloom_lab.papers.readers"
"""The module of the laboratory that knows the data sets that others published."""


def add(subparsers) -> None:
    """Register `data build` and `data look`."""
    data = subparsers.add_parser("data", help="turn recordings into a training set")
    commands = data.add_subparsers(metavar="COMMAND", required=True)
    build = commands.add_parser(
        "build", help="features, captions, splits, mirrored copies, mean and std from folders of recordings"
    )
    build.add_argument("folders", nargs="+", type=Path, help="the mocap pack, a CMU download, a HumanML3D folder")
    build.add_argument("--out", type=Path, required=True, help="folder of the built set; a build that stopped goes on")
    build.add_argument("--captions", type=Path, help="humanml3d.jsonl(.gz) with captions for a CMU download")
    build.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    build.add_argument(
        "--mixed",
        type=int,
        default=700,
        help="clips of each kind made from others: arms of one on another's walk, two actions in a row, gestures "
        "(default 700)",
    )
    build.add_argument(
        "--exclude",
        action="append",
        default=[],
        metavar="NAME",
        help="leave out the takes whose names begin so, and all that would be made of them; may be given again",
    )
    build.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="NAME[=REASON]",
        help="let in the takes whose names begin so though their bodies do not do what was recorded; the reason stands "
        "in set.json; may be given again",
    )
    build.set_defaults(run=_build)
    look = commands.add_parser("look", help="a page of pictures: recordings beside the clips that were made of them")
    look.add_argument("set", type=Path, metavar="SET", help="folder of a built set")
    look.add_argument("folders", nargs="+", type=Path, help="the recordings that it was made of")
    look.add_argument("--out", type=Path, required=True, help="picture to write, .png")
    look.add_argument("--each", type=int, default=2, metavar="N", help="clips of each source (default 2)")
    add_force(look)
    look.set_defaults(run=_look)


def _build(arguments: argparse.Namespace) -> None:
    from motionloom_train.data.build import build

    build(
        arguments.folders,
        arguments.out,
        captions=arguments.captions,
        workers=arguments.workers,
        mixed=arguments.mixed,
        exclude=arguments.exclude,
        allow=_reasons(arguments.allow),
        find=import_module(READERS).find_takes,
    )


def _reasons(said: list[str]) -> dict[str, str]:
    """``NAME=REASON`` by name."""
    return {name: reason for name, _, reason in (text.partition("=") for text in said)}


def _look(arguments: argparse.Namespace) -> None:
    from motionloom_train.data.look import draw_look

    check_overwriting(arguments, [arguments.out])
    print(
        draw_look(
            arguments.set, arguments.folders, arguments.out, each=arguments.each, find=import_module(READERS).find_takes
        )
    )
