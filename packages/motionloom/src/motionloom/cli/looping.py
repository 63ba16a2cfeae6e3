"""``--loop``: the end of a motion drawn anew, so that its beginning can follow it."""

import argparse
import sys

from motionloom.cli.sampling import fail, sampling_of
from motionloom.motion import Motion
from motionloom.tasks.edit import Loop, edit
from motionloom.weights.prior import Prior


def check_loop(arguments: argparse.Namespace, seconds: float) -> None:
    """Refuse a ``--loop`` of motions that are too short for it."""
    if arguments.loop:
        Loop(arguments.blend).check(seconds, 0.0)


def check_loop_behind(arguments: argparse.Namespace, past: float, added: float, lost: str) -> None:
    """Refuse a ``--loop`` for which the ``added`` seconds behind a past are too short; else note what it changes.

    past: seconds. lost: what is not as it was asked where the end is drawn anew, in words; empty where nothing is.
    """
    if not arguments.loop:
        return
    if arguments.blend > added:
        fail(
            f"--loop generates the last {arguments.blend:g} s again, but only {added:g} s come after {arguments.past}, "
            f"which does not change; give --blend {added:g} or less"
        )
    check_loop(arguments, past + added)
    note_loop(arguments, lost)


def note_loop(arguments: argparse.Namespace, lost: str) -> None:
    """Say on stderr what is ``lost`` where the end is drawn anew, if anything is."""
    if arguments.loop and lost:
        print(f"note: the last {arguments.blend:g} s are generated again for --loop; {lost}", file=sys.stderr)


def looped(arguments: argparse.Namespace, prior: Prior, motion: Motion, text: str, *, seed: int) -> Motion:
    """The motion with its end drawn anew so that the beginning can follow it, where the line says ``--loop``.

    text: what the person does there; without it ``--guidance`` is of no use to the prior.
    """
    if not arguments.loop:
        return motion

    names = ("steps", "guidance") if text else ("steps",)
    settings = {name: value for name, value in sampling_of(arguments).items() if name in names}
    settings |= {"foot_lock": getattr(arguments, "foot_lock", True), "seed": seed}
    [closed] = edit(prior, motion, text, Loop(arguments.blend), **settings)
    return closed
