"""`motionloom evaluate control`: does a motion go where it is asked to, and does it still look real."""

import argparse
from pathlib import Path

from motionloom.cli.evaluate_text import say, selected, words


def add(commands) -> None:
    """Register `evaluate control`."""
    control = commands.add_parser(
        "control", help="goals out of real motions: error, skate and jerk beside published ways of control"
    )
    control.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    control.add_argument(
        "--data", type=Path, metavar="SET",
        help="built set, recordings or HumanML3D folder; goals are taken out of its held-out motions",
    )  # fmt: skip
    control.add_argument("--evaluator", default="own", metavar="own|FILE", help="who judges (default: the shipped one)")
    control.add_argument(
        "--kinds", type=words, metavar="trajectory,left_wrist,...",
        help="goals: trajectory, left_wrist, right_wrist, left_foot, right_foot, head, several with + between them, "
        "keyframes, in_between (default: the paper's and more, 14)",
    )  # fmt: skip
    control.add_argument("--method", action="append", metavar="ROW", help="only this row, such as 'ours' (repeatable)")
    control.add_argument("--count", type=int, help="real motions, spread evenly (default 32)")
    control.add_argument("--replications", type=int, help="(default 3)")
    control.add_argument("--steps", type=int, help="sampler steps (default: as generate)")
    control.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    control.add_argument("--seed", type=int, help="first seed (default 0)")
    control.add_argument("--split", type=words, metavar="val,test", help="splits of --data (default val,test)")
    control.add_argument("--sources", type=words, metavar="cmu", help="sources of --data (default cmu; all: every one)")
    control.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    control.add_argument(
        "--out", type=Path, help="folder for report.md, report.json and plots; a run that was stopped goes on"
    )
    control.add_argument("--quick", action="store_true", help="eight motions, one replication, few kinds")
    control.add_argument("--json", action="store_true", help="print JSON instead of a table")
    control.set_defaults(run=_control)


def _control(arguments: argparse.Namespace) -> None:
    import json
    from dataclasses import replace

    from motionloom.evaluation import control, control_kinds, obey, report

    if arguments.out:
        obey.check_report(arguments.out / "report.json")
    usual = control_kinds.QUICK if arguments.quick else control_kinds.DEFAULT
    found = control.run(
        arguments.weights, data=arguments.data, evaluator=arguments.evaluator,
        kinds=usual if arguments.kinds is None else arguments.kinds,
        methods=arguments.method or control.METHODS, selection=selected(arguments), protocol=_protocol(arguments),
        folder=arguments.out, device=arguments.device, command=_command(arguments), progress=say,
    )  # fmt: skip
    if arguments.out:
        report.write(found, arguments.out)
    if arguments.json:
        print(json.dumps(report.encode(found), indent=1))
    else:  # the published rows are of other data: they stand in the files
        here = tuple(row for row in found.rows if not row.measured_on)
        print(report.plain(replace(found, rows=here)))


def _protocol(arguments: argparse.Namespace):
    """The defaults, of a quick run or a full one, with what was said."""
    from motionloom.evaluation.control import quick, settings

    names = ("count", "replications", "steps", "guidance", "seed")
    said = {name: value for name in names if (value := getattr(arguments, name)) is not None}
    if arguments.quick:
        said = {"count": quick().count, "replications": quick().replications, **said}
    return settings(**said)


def _command(arguments: argparse.Namespace) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called SET."""
    import shlex

    words = ["motionloom", "evaluate", "control", "--weights", arguments.weights, "--data", "SET"]
    words += ["--evaluator", Path(arguments.evaluator).name] if arguments.evaluator != "own" else []
    said = {
        "--kinds": arguments.kinds and ",".join(arguments.kinds),
        "--count": arguments.count,
        "--replications": arguments.replications,
        "--steps": arguments.steps,
        "--guidance": arguments.guidance,
        "--seed": arguments.seed,
        "--split": arguments.split and ",".join(arguments.split),
        "--sources": arguments.sources and ",".join(arguments.sources),
    }
    for name, value in said.items():
        words += [name, str(value)] if value is not None else []
    for name in arguments.method or []:
        words += ["--method", name]
    return shlex.join([*words, *(["--quick"] if arguments.quick else [])])
