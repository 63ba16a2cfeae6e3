"""What the commands share that measure motion beside real motion: options, what they choose, and how they end."""

import argparse
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionloom.lab.report.report import Report
    from motionloom.lab.suites.harness import Run
    from motionloom.lab.suites.protocol import Selection


def add_judged(parser: argparse.ArgumentParser, *, data: str) -> None:
    """``--weights``, ``--data`` and ``--evaluator``; ``data`` says what is done with the real motions."""
    parser.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    parser.add_argument("--data", type=Path, metavar="SET", help=f"built set, recordings or HumanML3D folder{data}")
    parser.add_argument("--evaluator", default="own", metavar="own|FILE", help="who judges (default: the shipped one)")


def add_selection(parser: argparse.ArgumentParser) -> None:
    """``--seed``, ``--split``, ``--sources`` and ``--device``."""
    parser.add_argument("--seed", type=int, help="first seed (default 0)")
    parser.add_argument("--split", type=words, metavar="val,test", help="splits of --data (default val,test)")
    parser.add_argument(
        "--sources", type=words, metavar="cmu", help="of --data (default cmu,accad,ui_prmd; all: every one)"
    )
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")


def words(said: str) -> tuple[str, ...]:
    """What is between commas."""
    return tuple(word.strip() for word in said.split(",") if word.strip())


def say(line: str) -> None:
    """Report progress on stderr."""
    print(line, file=sys.stderr, flush=True)


def selected(arguments: argparse.Namespace) -> "Selection | None":
    """None where nothing was said: the defaults, or those of the shipped numbers."""
    from motionloom.lab.suites.protocol import Selection

    if arguments.split is None and arguments.sources is None:
        return None
    sources = arguments.sources if arguments.sources is not None else Selection.sources
    return Selection(arguments.split or Selection.splits, () if sources == ("all",) else sources)


def set_threads(arguments: argparse.Namespace) -> None:
    """Have the networks use ``--threads``."""
    from motionloom.errors import MotionloomError

    if arguments.threads is None:
        return
    if not 1 <= arguments.threads <= 1024:
        raise MotionloomError(f"the number of threads must be from 1 to 1024; got {arguments.threads}")
    from motionloom.train.threads import set_threads

    set_threads(arguments.threads)


def given(arguments: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """The options of those names that were said."""
    return {name: value for name in names if (value := getattr(arguments, name)) is not None}


def typed(suite: str, arguments: argparse.Namespace, said: Mapping[str, Any], *more: str) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called SET."""
    import shlex

    line = ["motionloom", "evaluate", suite, "--weights", arguments.weights]
    line += ["--data", "SET"] if arguments.data else []
    line += ["--evaluator", Path(arguments.evaluator).name] if arguments.evaluator != "own" else []
    for name, value in said.items():
        line += [f"--{name.replace('_', '-')}", ",".join(map(str, value)) if isinstance(value, tuple) else str(value)]
    return shlex.join([*line, *more, *(["--quick"] if arguments.quick else [])])


def prepared(arguments: argparse.Namespace, command: str, folder: Path | None) -> "Run":
    """Where and how a suite measures, as options say; a ``folder`` that cannot be written to is refused now."""
    from motionloom.lab.report.files import check_report
    from motionloom.lab.suites.harness import Run

    if folder:
        check_report(folder / "report.json")
    evaluator = getattr(arguments, "evaluator", "own")
    return Run(arguments.weights, arguments.data, evaluator, folder, arguments.device, command, say)


def show(found: "Report", arguments: argparse.Namespace) -> None:
    """Write a report into ``--out`` and print it; published rows are wide and of other data, and go to files."""
    import json
    from dataclasses import replace

    from motionloom.lab.report import report

    if arguments.out:
        report.write(found, arguments.out)
    if arguments.json:
        print(json.dumps(report.encode(found), indent=1))
    else:
        here = tuple(row for row in found.rows if not row.measured_on)
        print(report.plain(replace(found, rows=here)))
