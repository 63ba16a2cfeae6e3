"""`motionloom evaluate transitions`: long motion, how good its segments are and how smooth what joins them."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import add_judged, add_selection, given, prepared, selected, show, typed, words

SETTINGS = ("intervals", "unfoldings", "replications", "steps", "guidance", "seed")


def add(commands) -> None:
    """Register `evaluate transitions`."""
    seams = commands.add_parser(
        "transitions", help="long motion: segments, jerk and skate at the seams, beside DoubleTake and cheap baselines"
    )
    add_judged(seams, data=" (default: the shipped numbers of held-out CMU recordings)")
    seams.add_argument(
        "--methods",
        type=words,
        metavar="ours,ours-exported,published,paper,first-take,concatenation,slerp",
        help="rows (default: these); also second-take, published-1000, paper-1000: the last two take hours",
    )
    seams.add_argument("--intervals", type=int, help="captions of one long motion (default 32)")
    seams.add_argument("--unfoldings", type=int, help="long motions of a replication (default 2)")
    seams.add_argument("--replications", type=int, help="(default 3)")
    seams.add_argument("--steps", type=int, help="sampler steps (default 24)")
    seams.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    add_selection(seams)
    seams.add_argument("--out", type=Path, help="folder for the report and plots; a run that stopped goes on")
    seams.add_argument("--quick", action="store_true", help="one unfolding of 8 captions, two replications")
    seams.add_argument("--json", action="store_true", help="print JSON instead of a table")
    seams.add_argument(
        "--make-reference", type=Path, metavar="FILE", help="only write the real numbers that runs without --data show"
    )
    seams.set_defaults(run=_transitions)


def _transitions(arguments: argparse.Namespace) -> None:
    from motionloom.lab.suites import transitions

    if arguments.make_reference:
        return _make_reference(arguments)
    how, selection = _protocol(arguments), selected(arguments)
    run = prepared(arguments, _command(arguments), arguments.out)
    show(transitions.run(run, selection=selection, how=how, names=arguments.methods), arguments)


def _make_reference(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.lab.report import files
    from motionloom.lab.suites import real_seams
    from motionloom.lab.suites.items import fitting, read_items

    if arguments.data is None:
        raise MotionloomError("a reference is made of real motions; name them with --data")
    files.check_report(arguments.make_reference)
    how, chosen = _protocol(arguments), fitting(arguments.data, selected(arguments))
    items = read_items(arguments.data, chosen)
    crops = real_seams.Crops.of([item.features for item in items], how.window, None, seed=how.seed)
    said = f"{' + '.join(chosen.splits)} of {', '.join(chosen.sources) or 'all sources'}"
    files.write_json(arguments.make_reference, real_seams.measure_shipped(crops, source=said, seed=how.seed))
    print(f"{arguments.make_reference}: {len(crops.motions)} windows, mean jerk {crops.mean_jerk:.6f} m/frame³")


def _protocol(arguments: argparse.Namespace):
    """The defaults with what was said."""
    from motionloom.lab.suites.protocol import Transitions, quick_transitions

    how = Transitions(**given(arguments, SETTINGS))
    return quick_transitions(how) if arguments.quick else how


def _command(arguments: argparse.Namespace) -> str:
    return typed("transitions", arguments, given(arguments, ("methods", *SETTINGS, "split", "sources")))
