"""What the commands that make motions share: options, the checks of them, a progress bar."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from motionloom.cli.newcomers import one_sentence, suggestion, with_options
from motionloom.cli.options import add_options
from motionloom.cli.skeletons import Target, add_skeleton, own_outs, read_target
from motionloom.cli.terminal import escaping, unescaped
from motionloom.cli.writing import add_writing, check_rate, check_unit
from motionloom.errors import MotionloomError
from motionloom.formats import writable
from motionloom.requests.fields import specs
from motionloom.requests.generate import Generate
from motionloom.requests.reading import make
from motionloom.requests.shared import Adapted

if TYPE_CHECKING:
    from motionloom.motion import Motion
    from motionloom.tasks.run import Models, Plan, Result
    from motionloom.weights.prior import Prior

R = TypeVar("R")


def add_sampling(
    parser: argparse.ArgumentParser,
    *,
    own_rate: str = "the model's 20",
    own_skeleton: str = "the uniform person's",
    own_unit: str = "m",
    out: str | None = "",
    weights: str = "default",
) -> None:
    """``--out``, what motions are sampled with and where, and ``--skeleton``.

    ``own_rate``, ``own_skeleton`` and ``own_unit`` are those of the files without ``--fps``, ``--skeleton`` and
    ``--out-unit``, in words. out: what ``--out`` may be, in words; None: the command has its own. weights: a shipped
    name; adapters are of the prior alone.
    """
    if out is not None:
        meaning = out or f"{' '.join(writable())} (default motion.bvh; motion.glb for a character)"
        add_out(parser, meaning)
    parser.add_argument(
        "--weights", default=weights, metavar="NAME|PATH", help=f"shipped name or file (default: {weights})"
    )
    if weights == "default":
        add_adapters(parser)
    parser.add_argument("--fps", type=float, help=f"frame rate of the files (default: {own_rate})")
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    parser.add_argument("--json", action="store_true", help="print what was made as JSON")
    add_skeleton(parser, own=own_skeleton)
    add_writing(parser, unit=own_unit)


def add_out(parser: argparse.ArgumentParser, meaning: str) -> None:
    """``--out``; ``meaning``: what it may be, in words."""
    parser.add_argument(
        "--out", type=Path, action="append", metavar="NAME", help=f"file to write, repeatable; {meaning}"
    )


def sampling_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings of `Sampling` that the line says, as keywords of a task; the others are the task's own."""
    names = ("steps", "solver", "guidance", "seed", "count", "temperature", "pair_guidance", "bodies", "best_of")
    found: dict[str, Any] = {name: getattr(arguments, name, None) for name in names}
    return {name: value for name, value in found.items() if value is not None}


def request_of(arguments: argparse.Namespace, request: type[R], own: Mapping[str, Any]) -> R:
    """The request that the line says; own: values of fields that are said otherwise than by an option of their name."""
    said = {name: getattr(arguments, name) for name in specs(request) if hasattr(arguments, name)}
    return make(request, said | dict(own))


def results(label: str, plan: "Plan", models: "Models") -> "Iterator[Result]":
    """What a task makes, while a bar shows how far it is."""
    from motionloom.tasks.run import run

    with bar(label) as progress:
        yield from run(plan, models, progress)


def add_adapters(parser: argparse.ArgumentParser) -> None:
    """``--adapter``, once: what was taught from clips."""
    if "--adapter" not in parser._option_string_actions:
        add_options(parser, Adapted)


def load_prior(arguments: argparse.Namespace) -> "Prior":
    """The weights that the line names, with its adapters in them."""
    from motionloom.goals.adapters import parse_adapter
    from motionloom.tasks.adapting import adapt
    from motionloom.weights.prior import Prior

    adapters = [parse_adapter(word) for word in arguments.adapter]
    return adapt(Prior.load(arguments.weights, device=arguments.device), adapters)


def take_text_anywhere(parser: argparse.ArgumentParser) -> None:
    """Let TEXT stand behind options too: argparse gives up on an optional word once it has passed its place."""

    def parse(args=None, namespace=None):
        given = None if args is None else with_options(parser, args)
        found, unknown = argparse.ArgumentParser.parse_known_args(parser, given, namespace)
        words = [*([] if found.text is None else [found.text]), *unknown]
        if not any(word.startswith("-") for word in unknown) and len(one_sentence(words)) == 1:
            found.text, unknown = one_sentence(words)[0], []
        if unknown:
            parser.error(f"unrecognized arguments: {' '.join(unknown)}{suggestion(parser, unknown)}")
        return found, unknown

    parser.parse_known_args = parse  # type: ignore[method-assign]


def fail(message: str) -> NoReturn:
    """Raise a `MotionloomError`."""

    raise MotionloomError(message)


def check_outs(arguments: argparse.Namespace) -> tuple[list[Path], Target | None]:
    """The files to write and the skeleton; refuses what cannot be, before any work."""
    from motionloom.io import check_output

    outs = arguments.out or own_outs(arguments, "motion")
    target = read_target(arguments, outs)
    for out in outs:
        check_output(out, own=target and target.suffix)
    if len({out.resolve() for out in outs}) != len(outs):
        fail("the same --out is given twice; give each file its own name")
    check_rate(arguments)
    check_unit(arguments, outs)
    return outs, target


def numbered(out: Path, count: int) -> list[Path]:
    """The file of one motion, or numbered files of several."""
    if count == 1:
        return [out]
    width = len(str(count - 1))
    return [out.with_name(f"{out.stem}_{i:0{width}d}{out.suffix}") for i in range(count)]


def places(outs: Sequence[Path], count: int, *, sheets: bool = True, target: Target | None = None) -> list[list[Path]]:
    """The files of ``count`` motions for each ``--out``, refused where nothing can be written.

    sheets: a picture or a page shows all motions, and so is one file; so is a character's own file with ``--one-file``.
    """
    from motionloom.io import check_output

    def whole(out: Path) -> bool:
        own = target is not None and target.one_file and target.writes(out)
        return own or (sheets and out.suffix.lower() in (".png", ".html"))

    several = [[out] if whole(out) else numbered(out, count) for out in outs]
    for place in (place for one in several for place in one):
        check_output(place, own=target and target.suffix)
    return several


def write(
    motions: "Sequence[Motion]",
    files: Sequence[Path],
    captions: Sequence[str],
    target: Target | None = None,
    *,
    unit: float | None = None,
) -> list[Path]:
    """Motions, on the target's skeleton, into the files of one ``--out``; ``unit`` is a BVH's without a target."""
    from motionloom.io import save
    from motionloom.io.bvh_writer import save_bvh

    if target is not None and target.one_file and target.writes(files[0]):
        return [target.save_clips(motions, files[0], target.names(captions))]
    if target is not None and len(files) == len(motions):
        return [target.save(one, file, caption=said) for one, file, said in zip(motions, files, captions, strict=True)]
    if unit is not None and files[0].suffix.lower() == ".bvh":
        return [save_bvh(one, file, unit=unit) for one, file in zip(motions, files, strict=True)]
    if target is not None and target.plays_in(files[0]):
        return [target.save_page([(said, [one]) for said, one in zip(captions, motions, strict=True)], files[0])]
    if len(files) == 1:
        return [save(list(motions), files[0], captions=captions)]
    return [save(one, file, captions=[said]) for one, file, said in zip(motions, files, captions, strict=True)]


def report(arguments: argparse.Namespace, about: dict[str, Any], written: Sequence[Path], seconds: float) -> None:
    """Say what was written in ``seconds`` of drawing: a line each, or as JSON behind ``about``."""
    if arguments.json:
        files = [str(path) for path in written]
        print(json.dumps(about | {"files": files, "sampling_seconds": round(seconds, 3)}, indent=1))
        return
    for path in written:
        print(f"wrote {path}")


def check_prompt(prompt: str) -> None:
    """Refuse a prompt without words, and one that is a book."""
    specs(Generate)["prompt"].check(prompt, "prompt")


def remark_unknown(prior: "Prior", prompts: Sequence[str]) -> list[str]:
    """Say on stderr, a line each, which prompts are not English or like nothing learned; and give the lines."""
    return list(unknown_words(prior, prompts).values())


def unknown_words(prior: "Prior", prompts: Sequence[str]) -> dict[str, str]:
    """The prompts that `remark_unknown` has a line for, with the line."""
    from motionloom.goals.remarks import remarks_on

    remarks = {one.text: one.line for one in remarks_on(prompts, prior.known, prior.text)}
    for line in remarks.values():
        print(f"motionloom: {line}", file=sys.stderr)
    return remarks


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal's stderr, and a function that moves it: (done, of how many)."""
    if not sys.stderr.isatty():  # the bar would leave an empty line, and rich costs a tenth of a second
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(file=unescaped(sys.stderr)), transient=True) as progress, escaping():
        task = progress.add_task(label, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
