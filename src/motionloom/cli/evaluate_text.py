"""`motionloom evaluate text`: the field's text-to-motion metrics beside real motion, baselines and published rows."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import add_judged, add_selection, given, prepared, say, selected, show, typed

PROMPT = "a person walks forward and waves"


def add(commands) -> None:
    """Register `evaluate text`."""
    text = commands.add_parser("text", help="R-precision, FID, MM-Dist, Diversity, MultiModality, realism, speed")
    add_judged(text, data=" (default: the shipped numbers of held-out CMU recordings)")
    text.add_argument("--steps", type=_steps, metavar="5,24,50", help="sampler steps, one row each (default 5,12,24)")
    text.add_argument("--replications", type=int, help="(default 5)")
    text.add_argument("--count", type=int, help="real items, spread evenly (default: all)")
    text.add_argument("--batch", type=_batch, metavar="32|all", help="motions a caption is matched with (default 32)")
    text.add_argument("--lengths", choices=("exact", "padded"), help="generate the real lengths (default), or 196 cut")
    text.add_argument(
        "--cap-len", choices=("true", "published"), help="captions as long as they are (default), or read as 22 tokens"
    )
    text.add_argument("--multimodality", type=_times, metavar="10x10", help="captions x motions of each; 0: none")
    text.add_argument("--guidance", type=float, help="strength of the text (default: as generate)")
    text.add_argument("--solver", help="solver name (default: as generate)")
    add_selection(text)
    text.add_argument(
        "--out", type=Path, help="folder for report.md, report.json and plots; a run that stopped goes on"
    )
    text.add_argument("--quick", action="store_true", help="one batch, two replications, few steps: about a minute")
    text.add_argument("--json", action="store_true", help="print JSON instead of a table")
    text.add_argument(
        "--make-reference", type=Path, metavar="FILE", help="only write what runs without --data compare with"
    )
    text.set_defaults(run=_text)


def _steps(said: str) -> tuple[int, ...]:
    try:
        return tuple(int(word) for word in said.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{said!r} are not whole numbers with commas, such as 5,20,50") from None


def _batch(said: str) -> int | str:
    try:
        return said if said == "all" else int(said)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{said!r} is no number of motions and not all") from None


def _times(said: str) -> tuple[int, int]:
    try:
        captions, motions = (int(word) for word in ("0x0" if said == "0" else said).split("x"))
        return captions, motions
    except ValueError:
        raise argparse.ArgumentTypeError(f"{said!r} is not captions x motions of each, such as 10x10, or 0") from None


def _text(arguments: argparse.Namespace) -> None:
    from motionloom.lab.suites import text

    if arguments.make_reference:
        return _make_reference(arguments)
    protocol, selection = _protocol(arguments), selected(arguments)
    run = prepared(arguments, _command(arguments), arguments.out)
    show(text.run(run, selection=selection, protocol=protocol, memory=lambda n: _memory(arguments, n)), arguments)


def _make_reference(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError
    from motionloom.lab.evaluator.evaluators import load_evaluator
    from motionloom.lab.suites import text_reference
    from motionloom.lab.suites.text import reference

    if arguments.data is None:
        raise MotionloomError("a reference is made of real motions; name them with --data")
    text_reference.check_reference(arguments.make_reference)
    found = reference(load_evaluator(arguments.evaluator), arguments.data, selected(arguments), say)
    path = text_reference.save(found, arguments.make_reference)
    print(f"{path}: {len(found.names)} items, {path.stat().st_size / 1e6:.2f} MB")


def _protocol(arguments: argparse.Namespace):
    """The defaults with what was said."""
    from motionloom.lab.suites.protocol import Protocol, quick

    names = ("steps", "replications", "count", "lengths", "multimodality", "guidance", "solver", "seed")
    how = given(arguments, names)
    if arguments.cap_len is not None:
        how["caption_length"] = arguments.cap_len
    if arguments.batch is not None:
        how["batch"] = None if arguments.batch == "all" else arguments.batch
    protocol = Protocol(**how)
    return quick(protocol) if arguments.quick else protocol


def _memory(arguments: argparse.Namespace, steps: int) -> float:
    """Peak MB of a fresh process that generates eight motions of 9.8 s, as files."""
    import tempfile

    from motionloom.lab.bench import process

    with tempfile.TemporaryDirectory() as folder:
        return process(
            [
                "generate",
                PROMPT,
                "--weights",
                arguments.weights,
                "--steps",
                str(steps),
                "--seconds",
                "9.8",
                "--count",
                "8",
                "--device",
                arguments.device,
                "--out",
                str(Path(folder) / "motion.npz"),
            ]
        ).peak_mb


def _command(arguments: argparse.Namespace) -> str:
    names = ("steps", "replications", "count", "batch", "lengths", "cap_len", "multimodality")
    names += ("guidance", "solver", "seed", "split", "sources")
    said = given(arguments, names)
    if arguments.multimodality:
        said["multimodality"] = "x".join(map(str, arguments.multimodality))
    return typed("text", arguments, said)
