"""`motionloom data`: recordings to training sets."""

import argparse
from importlib import import_module

from motionloom.cli.tables import add_family
from motionloom.cli.writing import check_overwriting

READERS = "motionloom_lab.papers.readers"
BABEL = "motionloom_lab.papers.babel"
"""The modules of the laboratory that know the data sets that others published."""


def add(subparsers) -> None:
    """Register `data build` and `data look`."""
    add_family(subparsers, __name__)


def run_build(arguments: argparse.Namespace) -> None:
    """``motionloom data build``."""
    from motionloom_train.data.build import build

    if arguments.features == "babel":
        import_module(BABEL).build_set(arguments.folders, arguments.out)
        return
    build(
        arguments.folders,
        arguments.out,
        captions=arguments.captions,
        workers=arguments.workers,
        mixed=arguments.mixed,
        exclude=arguments.exclude,
        allow=_reasons(arguments.allow),
        corrections=arguments.corrections,
        find=import_module(READERS).find_takes,
    )


def _reasons(words: list[str]) -> dict[str, str]:
    """``NAME=REASON`` by name."""
    return {name: reason for name, _, reason in (text.partition("=") for text in words)}


def run_look(arguments: argparse.Namespace) -> None:
    """``motionloom data look``."""
    from motionloom_train.data.look import draw_look

    check_overwriting(arguments, [arguments.out])
    print(
        draw_look(
            arguments.set, arguments.folders, arguments.out, each=arguments.each, find=import_module(READERS).find_takes
        )
    )
