"""`motionloom evaluate transitions`: long motion, how good its segments are and how smooth what joins them."""

import argparse
from pathlib import Path

from motionloom.cli.evaluate_text import say, selected, words


def add(commands) -> None:
    """Register `evaluate transitions`."""
    seams = commands.add_parser(
        "transitions", help="long motion: segments, jerk and skate at the seams, beside DoubleTake and cheap baselines"
    )
    seams.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    seams.add_argument(
        "--data", type=Path, metavar="SET",
        help="built set, recordings or HumanML3D folder (default: the shipped numbers of held-out CMU recordings)",
    )  # fmt: skip
    seams.add_argument("--evaluator", default="own", metavar="own|FILE", help="who judges (default: the shipped one)")
    seams.add_argument(
        "--methods", type=words, metavar="ours,ours-exported,published,paper,first-take,concatenation,slerp",
        help="rows (default: these); also second-take, published-1000, paper-1000: the last two take hours",
    )  # fmt: skip
    seams.add_argument("--intervals", type=int, help="captions of one long motion (default 32)")
    seams.add_argument("--unfoldings", type=int, help="long motions of a replication (default 2)")
    seams.add_argument("--replications", type=int, help="(default 3)")
    seams.add_argument("--steps", type=int, help="sampler steps (default 24)")
    seams.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    seams.add_argument("--seed", type=int, help="first seed (default 0)")
    seams.add_argument("--split", type=words, metavar="val,test", help="splits of --data (default val,test)")
    seams.add_argument("--sources", type=words, metavar="cmu", help="sources of --data (default cmu; all: every one)")
    seams.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    seams.add_argument("--out", type=Path, help="folder for the report and plots; a run that stopped goes on")
    seams.add_argument("--quick", action="store_true", help="one unfolding of 8 captions, two replications")
    seams.add_argument("--json", action="store_true", help="print JSON instead of a table")
    seams.add_argument(
        "--make-reference", type=Path, metavar="FILE", help="only write the real numbers that runs without --data show"
    )
    seams.set_defaults(run=_transitions)


def _transitions(arguments: argparse.Namespace) -> None:
    import json
    from dataclasses import replace

    from motionloom.evaluation import obey, report, transitions

    if arguments.make_reference:
        return _make_reference(arguments)
    how, selection = _protocol(arguments), selected(arguments)
    if arguments.out:
        obey.check_report(arguments.out / "report.json")
    found = transitions.run(
        arguments.weights, evaluator=arguments.evaluator, data=arguments.data, selection=selection, how=how,
        names=arguments.methods, folder=arguments.out, device=arguments.device, command=_command(arguments),
        progress=say,
    )  # fmt: skip
    if arguments.out:
        report.write(found, arguments.out)
    if arguments.json:
        print(json.dumps(report.encode(found), indent=1))
    else:  # the published rows are of other data: they stand in the files
        here = tuple(row for row in found.rows if not row.measured_on)
        print(report.plain(replace(found, rows=here)))


def _make_reference(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.evaluation import obey, real_seams
    from motionloom.evaluation.items import fitting, read_items

    if arguments.data is None:
        raise MotionloomError("a reference is made of real motions; name them with --data")
    obey.check_report(arguments.make_reference)
    how, chosen = _protocol(arguments), fitting(arguments.data, selected(arguments))
    items = read_items(arguments.data, chosen)
    crops = real_seams.Crops.of([item.features for item in items], how.window, None, seed=how.seed)
    said = f"{' + '.join(chosen.splits)} of {', '.join(chosen.sources) or 'all sources'}"
    obey.write_json(arguments.make_reference, real_seams.measure_shipped(crops, source=said, seed=how.seed))
    print(f"{arguments.make_reference}: {len(crops.motions)} windows, mean jerk {crops.mean_jerk:.6f} m/frame³")


def _protocol(arguments: argparse.Namespace):
    """The defaults with what was said."""
    from motionloom.evaluation.protocol import Transitions, quick_transitions

    names = ("intervals", "unfoldings", "replications", "steps", "guidance", "seed")
    how = Transitions(**{n: getattr(arguments, n) for n in names if getattr(arguments, n) is not None})
    return quick_transitions(how) if arguments.quick else how


def _command(arguments: argparse.Namespace) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called SET."""
    import shlex

    words = ["motionloom", "evaluate", "transitions", "--weights", arguments.weights]
    words += ["--data", "SET"] if arguments.data else []
    words += ["--evaluator", Path(arguments.evaluator).name] if arguments.evaluator != "own" else []
    for name in ("methods", "intervals", "unfoldings", "replications", "steps", "guidance", "seed", "split", "sources"):
        value = getattr(arguments, name)
        if value is not None:
            words += [f"--{name}", ",".join(value) if isinstance(value, tuple) else str(value)]
    return shlex.join([*words, *(["--quick"] if arguments.quick else [])])
