"""`motionloom evaluate duet`: two people, going on, from words, answering to one and for long, beside real pairs."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import prepared, say, set_threads

PARTS = ("completion", "text", "answers", "long")


def add(commands) -> None:
    """Register `evaluate duet`."""
    duet = commands.add_parser(
        "duet",
        help="two people: errors of completions beside baselines; duets, answers and long duets beside real pairs",
    )
    duet.add_argument(
        "--data", type=Path, required=True, metavar="PACK", help="pairs: mocap pack, NAME_a.bvh and NAME_b.bvh, 3DPW"
    )
    duet.add_argument("--weights", default="default", help="the prior: shipped name or file (default: default)")
    duet.add_argument("--block", metavar="NAME|PATH", help="the two-person block (default: the shipped one)")
    duet.add_argument("--only", choices=PARTS, help="only completions, duets from words, answers to one, or long duets")
    duet.add_argument("--crops", type=int, metavar="N", help="random crops that are completed (default 200)")
    duet.add_argument("--samples", type=int, metavar="N", help="completions of each crop (default 5)")
    duet.add_argument("--duets", type=int, metavar="N", help="duets of each other part (default 24)")
    duet.add_argument("--steps", type=int, help="sampler steps (default: as duet)")
    duet.add_argument(
        "--given",
        choices=("past", "tool", "published"),
        default="past",
        help="what completions know: 20 frames (default); 20 with the true velocity into the next, as the published "
        "tool; 19, as the published evaluation",
    )
    duet.add_argument("--communication-only", type=Path, metavar="FILE", help="block trained over --write-bare's prior")
    duet.add_argument(
        "--mrt", type=Path, metavar="FILE", help="multi-range transformer (default: OUT/mrt/mrt.safetensors, if there)"
    )
    duet.add_argument(
        "--train-mrt", type=int, metavar="STEPS", help="first train one on the train pairs, where OUT/mrt has none"
    )
    duet.add_argument(
        "--beside",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="other blocks for the same prior, each a row of the completions",
    )
    duet.add_argument("--rows-without-published", action="store_true", help="leave out what others published")
    duet.add_argument("--seed", type=int, default=0, help="first seed (default 0)")
    duet.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    duet.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: all)")
    duet.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="folder for the reports, one of each part; a stopped run of completions goes on",
    )
    duet.add_argument("--quick", action="store_true", help="six crops, two samples, two or four duets, few steps")
    duet.add_argument("--json", action="store_true", help="print JSON instead of tables")
    duet.add_argument(
        "--write-bare",
        type=Path,
        metavar="FILE",
        help="only write the prior with layers that do nothing; `train duet` over it gives communication only",
    )
    duet.set_defaults(run=_duet)


def _duet(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.lab.report import files, report

    set_threads(arguments)
    if arguments.write_bare:
        return _write_bare(arguments)
    asked = [part for part in PARTS if arguments.only in (None, part)]
    for part in asked:
        if arguments.out:
            files.check_report(arguments.out / part / "report.json")
    found = {}
    for part in asked:
        found[part] = _completion(arguments) if part == "completion" else _judged(arguments, part)
        if arguments.out:
            report.write(found[part], arguments.out / part)
        if not arguments.json:
            print(_printed(found[part]), end="\n\n")
    if arguments.json:
        print(json.dumps({part: report.encode(one) for part, one in found.items()}, indent=1))


def _write_bare(arguments: argparse.Namespace) -> None:
    from motionloom.lab.suites.duet_ways import write_bare
    from motionloom.weights.prior import Prior

    print(write_bare(Prior.load(arguments.weights), arguments.write_bare))


def _printed(found) -> str:
    from motionloom.lab.suites.prediction import printed

    return printed(found)


def _completion(arguments: argparse.Namespace):
    from dataclasses import replace

    from motionloom.lab.suites import duet

    said = {name: value for name in ("crops", "samples", "steps") if (value := getattr(arguments, name)) is not None}
    how = replace(duet.QUICK if arguments.quick else duet.How(), given=arguments.given, seed=arguments.seed, **said)
    return duet.run(
        _run(arguments, "completion"),
        block=arguments.block,
        communication=arguments.communication_only,
        mrt=_mrt(arguments),
        beside=arguments.beside,
        how=how,
        with_published=not arguments.rows_without_published,
    )


def _run(arguments: argparse.Namespace, part: str):
    return prepared(arguments, _command(arguments, part), arguments.out / part if arguments.out else None)


def _mrt(arguments: argparse.Namespace) -> Path | None:
    """The transformer's file, trained now if that was asked for; None where there is none."""
    from motionloom.errors import MotionloomError

    own = arguments.out / "mrt" / "mrt.safetensors" if arguments.out else None
    if arguments.mrt or arguments.train_mrt is None:
        return arguments.mrt or (own if own and own.is_file() else None)
    if own is None or arguments.train_mrt < 1:
        raise MotionloomError("--train-mrt needs one step or more, and --out FOLDER for its weights")
    if not own.is_file():
        from motionloom.lab.papers.mrt_training import train_mrt
        from motionloom.lab.papers.readers import find_pairs

        pairs = find_pairs(arguments.data, captions=False, say=say)
        train_mrt(pairs, own.parent, steps=arguments.train_mrt, seed=arguments.seed, device=arguments.device, say=say)
    return own


def _judged(arguments: argparse.Namespace, part: str):
    """Duets that are held against real ones."""
    from dataclasses import replace

    from motionloom.lab.suites import duet_answers, duet_long, duet_text

    module = {"text": duet_text, "answers": duet_answers, "long": duet_long}[part]
    said = {name: value for name in ("duets", "steps") if (value := getattr(arguments, name)) is not None}
    how = replace(module.QUICK if arguments.quick else module.How(), seed=arguments.seed, **said)
    return module.run(_run(arguments, part), block=arguments.block, how=how)


def _command(arguments: argparse.Namespace, part: str) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called PACK."""
    import shlex

    words = ["motionloom", "evaluate", "duet", "--data", "PACK", "--only", part]
    for name in ("weights", "block", "communication_only", "mrt"):
        value = getattr(arguments, name)
        if value is not None and str(value) != "default" and (part == "completion" or name in ("weights", "block")):
            words += [f"--{name.replace('_', '-')}", Path(value).name]
    names = ("crops", "samples", "steps", "train_mrt") if part == "completion" else ("duets", "steps")
    for name in names:
        value = getattr(arguments, name)
        words += [f"--{name.replace('_', '-')}", str(value)] if value is not None else []
    if part == "completion" and arguments.beside:
        words += ["--beside", *(path.name for path in arguments.beside)]
    words += ["--given", arguments.given] if part == "completion" and arguments.given != "past" else []
    words += ["--seed", str(arguments.seed)] if arguments.seed else []
    return shlex.join([*words, *(["--quick"] if arguments.quick else [])])
