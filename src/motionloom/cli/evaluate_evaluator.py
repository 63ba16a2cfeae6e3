"""`motionloom evaluate evaluator`: what an evaluator notices, and whether it agrees with physics."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import say


def add(commands) -> None:
    """Register `evaluate evaluator` among the commands of `evaluate`."""
    parser = commands.add_parser(
        "evaluator", help="what the text-motion evaluator notices on held-out real motions, and beside physics"
    )
    parser.add_argument("--data", type=Path, required=True, help="folder made by 'motionloom data build'")
    parser.add_argument("--evaluator", default="own", help="own (shipped) or a file (default: own)")
    parser.add_argument("--weights", default="default", help="prior whose motions are judged (default: default)")
    parser.add_argument(
        "--source", action="append", help="use clips of this source (repeatable; default cmu, accad, ui_prmd)"
    )
    parser.add_argument("--repeats", type=int, default=20, help="reshuffles of the real pairs (default 20)")
    parser.add_argument("--seeds", type=int, default=4, help="motions per prompt and way to sample (default 4)")
    parser.add_argument("--out", type=Path, help="folder for the reports")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.set_defaults(run=_evaluator)


def _evaluator(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.errors import MotionloomError
    from motionloom.lab.evaluator.agreement import agreement
    from motionloom.lab.evaluator.evaluators import load_evaluator
    from motionloom.lab.evaluator.own import validate
    from motionloom.lab.report import report as reports
    from motionloom.lab.report.files import check_report
    from motionloom.lab.suites.protocol import RECORDED
    from motionloom.weights.prior import Prior

    if not 1 <= arguments.repeats <= 10_000 or not 0 <= arguments.seeds <= 1000:
        raise MotionloomError(
            f"repeats go from 1 to 10000 and seeds from 0 to 1000; got {arguments.repeats} and {arguments.seeds}"
        )

    evaluator = load_evaluator(arguments.evaluator)
    prior = Prior.load(arguments.weights) if arguments.seeds else None
    if arguments.out:
        check_report(arguments.out / "report.json")
    sources = arguments.source or [*RECORDED]
    made = [validate(evaluator, arguments.data, sources=sources, repeats=arguments.repeats, progress=say)]
    if prior:
        made.append(agreement(evaluator, prior, seeds=arguments.seeds, progress=say))
    for report in made:
        if arguments.out:
            reports.write(report, arguments.out / report.suite)
        if not arguments.json:
            print(f"{reports.plain(report)}\n")
    if arguments.json:
        print(json.dumps([reports.encode(report) for report in made], indent=1))
