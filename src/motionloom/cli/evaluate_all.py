"""`motionloom evaluate all` and `evaluate compare`: every suite in one run; two runs held against each other."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import say


def add(commands) -> None:
    """Register `evaluate all` and `evaluate compare`."""
    every = commands.add_parser("all", help="run every suite; goes on after a kill; fills a page of results")
    every.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    every.add_argument("--data", type=Path, metavar="SET", help="built set whose held-out clips are compared with")
    every.add_argument(
        "--evaluator", default="own", metavar="own|FILE", help="who judges text (default: the shipped one)"
    )
    every.add_argument("--quick", action="store_true", help="few seeds and clips: does everything work?")
    every.add_argument("--only", action="append", metavar="SUITE", help="only this suite (repeatable)")
    every.add_argument("--out", type=Path, help="folder of the reports (default out/results, quick: out/quick)")
    every.add_argument("--results", type=Path, metavar="PAGE", help="fill this page between its marker comments")
    every.add_argument("--keep", type=Path, metavar="DIR", help="also write each report as DIR/SUITE.json: a release")
    every.add_argument("--again", action="store_true", help="measure anew what is finished; let quick replace full")
    every.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    every.set_defaults(run=_all)

    compare = commands.add_parser("compare", help="which differences of two reports exceed their intervals")
    compare.add_argument("before", type=Path, help="report.json, its folder, or a folder of SUITE.json files")
    compare.add_argument("after", type=Path, help="the same of what is judged")
    compare.add_argument("--anyway", action="store_true", help="compare although suite, protocol or evaluator differ")
    compare.add_argument("--every", action="store_true", help="list the numbers that stayed within as well")
    compare.add_argument("--json", action="store_true", help="print JSON instead of a table")
    compare.set_defaults(run=_compare)


def _tools(arguments: argparse.Namespace):
    """Motions and speeds of the weights, which are loaded once, when a suite first asks."""
    from functools import cache

    from motionloom.cli.evaluate_text import _memory
    from motionloom.lab.bench import bench, defaults
    from motionloom.lab.suites.generator import generator
    from motionloom.lab.suites.registry import Tools
    from motionloom.tasks.text import generate
    from motionloom.weights.prior import Prior

    @cache
    def prior() -> Prior:
        return Prior.load(arguments.weights, device=arguments.device)

    return Tools(
        generator=lambda finished: generator(prior(), finished=finished),
        prior=prior,
        memory=lambda steps: _memory(arguments, steps),
        speed=lambda quick: bench(
            prior(), defaults(generate), what="all", quick=quick, weights=arguments.weights, progress=say
        ),
        progress=say,
    )


def _all(arguments: argparse.Namespace) -> int:
    from motionloom.lab.report import report, results
    from motionloom.lab.suites import everything
    from motionloom.lab.suites import registry as suites

    wanted = suites.chosen(arguments.only or ())
    out = arguments.out or Path("out") / ("quick" if arguments.quick else "results")
    if arguments.results:
        results.check_page(arguments.results)
    job = suites.Job(
        arguments.weights,
        _tools(arguments),
        data=arguments.data,
        evaluator=arguments.evaluator,
        quick=arguments.quick,
        device=arguments.device,
    )
    outcomes = everything.run_all(job, out, wanted, keep=arguments.keep, again=arguments.again)
    made = [outcome.report for outcome in outcomes if outcome.report]
    for one in made:
        print(report.plain(one), end="\n\n")
    if arguments.results:
        for suite in results.fill_page(arguments.results, made, again=arguments.again):
            say(f"{arguments.results} keeps the full numbers of {suite}; say --again to replace them by quick ones")
    for outcome in outcomes:
        print(f"{outcome.suite.name}: {outcome.said}")
    return 2 if any(outcome.failed for outcome in outcomes) else 0


def _compare(arguments: argparse.Namespace) -> int:
    import json

    from motionloom.lab.report import compare
    from motionloom.lab.report.files import plain

    found, alone = compare.compare_all(arguments.before, arguments.after, anyway=arguments.anyway)
    shown = found if arguments.every else [one for one in found if one.verdict in ("worse", "better", "other")]
    if arguments.json:
        print(json.dumps(compare.encode(shown), indent=1))
    else:
        if shown:
            print(plain(compare.table(shown)), end="\n\n")
        print(compare.tally(found))
        if alone:
            print(f"only one of the two has {', '.join(alone)}")
    return 1 if any(one.verdict == "worse" for one in found) else 0
