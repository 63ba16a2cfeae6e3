"""`motionloom evaluate control`: does a motion go where it is asked to, and does it still look real."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import add_judged, add_selection, given, prepared, selected, show, typed, words

SETTINGS = ("count", "replications", "steps", "guidance", "seed")


def add(commands) -> None:
    """Register `evaluate control`."""
    control = commands.add_parser(
        "control", help="goals out of real motions: error, skate and jerk beside published ways of control"
    )
    add_judged(control, data="; goals are taken out of its held-out motions")
    control.add_argument(
        "--kinds",
        type=words,
        metavar="trajectory,left_wrist,...",
        help="goals: trajectory, left_wrist, right_wrist, left_foot, right_foot, head, several with + between them, "
        "keyframes, in_between (default: the paper's and more, 14)",
    )
    control.add_argument("--method", action="append", metavar="ROW", help="only this row, such as 'ours' (repeatable)")
    control.add_argument("--count", type=int, help="real motions, spread evenly (default 32)")
    control.add_argument("--replications", type=int, help="(default 3)")
    control.add_argument("--steps", type=int, help="sampler steps (default: as generate)")
    control.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    add_selection(control)
    control.add_argument(
        "--out", type=Path, help="folder for report.md, report.json and plots; a run that was stopped goes on"
    )
    control.add_argument("--quick", action="store_true", help="eight motions, one replication, few kinds")
    control.add_argument("--json", action="store_true", help="print JSON instead of a table")
    control.set_defaults(run=_control)


def _control(arguments: argparse.Namespace) -> None:
    from motionloom.lab.suites import control, control_kinds

    usual = control_kinds.QUICK if arguments.quick else control_kinds.DEFAULT
    kinds = usual if arguments.kinds is None else arguments.kinds
    found = control.run(
        prepared(arguments, _command(arguments), arguments.out),
        kinds=kinds,
        methods=arguments.method or control.METHODS,
        selection=selected(arguments),
        protocol=_protocol(arguments),
    )
    show(found, arguments)


def _protocol(arguments: argparse.Namespace):
    """The defaults, of a quick run or a full one, with what was said."""
    from motionloom.lab.suites.control import quick, settings

    said = given(arguments, SETTINGS)
    if arguments.quick:
        said = {"count": quick().count, "replications": quick().replications, **said}
    return settings(**said)


def _command(arguments: argparse.Namespace) -> str:
    methods = [word for name in arguments.method or [] for word in ("--method", name)]
    return typed("control", arguments, given(arguments, ("kinds", *SETTINGS, "split", "sources")), *methods)
