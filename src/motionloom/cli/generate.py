"""`motionloom generate`: words to motion files."""

import argparse
import sys
from pathlib import Path

from motionloom.cli.newcomers import check_overwriting, one_sentence
from motionloom.cli.sampling import (
    add_sampling,
    bar,
    check_count,
    check_outs,
    check_prompt,
    fail,
    places,
    report,
    write,
)
from motionloom.cli.skeletons import put_all

MAX_PROMPTS = 1000
MAX_MOTIONS = 10_000


def add(subparsers) -> None:
    """Register `generate`."""
    parser = subparsers.add_parser("generate", help="make motions from words")
    parser.add_argument("prompts", nargs="*", metavar="PROMPT", help="what the person does, such as 'a person walks'")
    parser.add_argument(
        "--from", dest="file", type=Path, metavar="FILE", help="a text file with one prompt per line, - for stdin"
    )
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each motion (default 5)")
    parser.add_argument(
        "--seed", type=int, default=0, help="the first motion's seed, the next have the next (default 0)"
    )
    parser.add_argument("--count", type=int, default=1, help="motions per prompt (default 1)")
    parser.add_argument("--guidance", type=float, default=2.5, help="strength of the text (default 2.5)")
    parser.add_argument("--solver", help="ddim, ddpm (the default), dpm2m or dpm2m-sde")
    add_sampling(parser)
    parser.set_defaults(run=_generate)


def _generate(arguments: argparse.Namespace) -> None:
    prompts = _prompts(arguments)
    outs, target = check_outs(arguments)
    check_count(arguments, most=MAX_MOTIONS)
    if len(prompts) * arguments.count > MAX_MOTIONS:
        fail(f"{len(prompts)} prompts, {arguments.count} of each, are too many; at most {MAX_MOTIONS:,} in one call")
    captions = [prompt for prompt in prompts for _ in range(arguments.count)]
    files = places(outs, len(captions), target=target)
    check_overwriting(arguments, [file for several in files for file in several])
    motions, seconds = _make(arguments, prompts)
    motions = put_all(target, motions)
    written = [path for several in files for path in write(motions, several, captions, target)]
    made = [{"prompt": caption, "seed": arguments.seed + i} for i, caption in enumerate(captions)]
    about = {"motions": made, "seconds": arguments.seconds, "weights": str(arguments.weights)}
    report(arguments, about, written, seconds)


LONGEST = 30.0
"""Seconds of one sentence above which a long motion is meant."""


def _prompts(arguments: argparse.Namespace) -> list[str]:
    prompts = [*one_sentence(arguments.prompts), *(_lines(arguments.file) if arguments.file else ())]
    if not prompts:
        fail("no prompt; say what the person does, such as: motionloom generate 'a person walks forward'")
    if len(prompts) > MAX_PROMPTS:
        fail(f"{len(prompts)} prompts are too many for one call; give at most {MAX_PROMPTS}")
    for prompt in prompts:
        check_prompt(prompt)
    if arguments.seconds > LONGEST:
        print(
            f"note: {arguments.seconds:g} s are long for one sentence; several that follow each other are made with: "
            "motionloom compose 'a person walks' 'a person sits down'",
            file=sys.stderr,
        )
    return prompts


def _lines(file: Path) -> list[str]:
    from motionloom.io.text import read_text

    try:
        read = sys.stdin.buffer.read(16_000_000) if str(file) == "-" else read_text(file, max_bytes=16_000_000)
        text = read.decode("utf-8")
    except UnicodeDecodeError:
        fail(f"{file} is not UTF-8 text; save it as UTF-8 with one prompt per line")
    return [line.strip() for line in text.splitlines() if line.strip()]


def _make(arguments: argparse.Namespace, prompts: list[str]):
    import time

    from motionloom.tasks.text import generate
    from motionloom.weights.prior import Prior

    prior = Prior.load(arguments.weights, device=arguments.device)
    given = {"steps": arguments.steps, "solver": arguments.solver}
    options = {name: value for name, value in given.items() if value is not None}
    began = time.perf_counter()
    with bar("generating") as progress:
        motions = generate(
            prior, prompts, seconds=arguments.seconds, count=arguments.count, seed=arguments.seed,
            guidance=arguments.guidance, clean=not arguments.raw, progress=progress, **options,
        )  # fmt: skip
    if arguments.fps is not None:
        motions = [motion.resample(arguments.fps) for motion in motions]
    return motions, time.perf_counter() - began
