"""What the commands that make motions share: options, the checks of them, a progress bar."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from motionloom.cli.skeletons import Target, own_outs, read_target
from motionloom.cli.terminal import escaping, unescaped
from motionloom.cli.writing import check_rate, check_unit, fail
from motionloom.goals.adapters import parse_adapter
from motionloom.goals.remarks import remarks_on
from motionloom.io import check_output, save
from motionloom.io.bvh_writer import save_bvh
from motionloom.motion import Motion
from motionloom.requests.fields import specs
from motionloom.requests.generate import Generate
from motionloom.requests.reading import build_request
from motionloom.tasks.adapting import adapt
from motionloom.tasks.run import Models, Plan, Result, run
from motionloom.weights.prior import Prior

R = TypeVar("R")


def sampling_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings of `Sampling` that the line says, as keywords of a task; the others are the task's own."""
    names = ("steps", "solver", "guidance", "seed", "count", "temperature", "pair_guidance", "bodies", "best_of")
    found: dict[str, Any] = {name: getattr(arguments, name, None) for name in names}
    return {name: value for name, value in found.items() if value is not None}


def request_of(arguments: argparse.Namespace, request: type[R], own: Mapping[str, Any]) -> R:
    """The request that the line says; own: values of fields that are said otherwise than by an option of their name."""
    said = {name: getattr(arguments, name) for name in specs(request) if hasattr(arguments, name)}
    return build_request(request, said | dict(own))


def results(label: str, plan: Plan, models: Models) -> Iterator[Result]:
    """What a task makes, while a bar shows how far it is."""

    with bar(label) as progress:
        yield from run(plan, models, progress)


def load_prior(arguments: argparse.Namespace) -> Prior:
    """The weights that the line names, with its adapters in them."""

    adapters = [parse_adapter(word) for word in arguments.adapter]
    return adapt(Prior.load(arguments.weights, device=arguments.device), adapters)


def check_outs(arguments: argparse.Namespace) -> tuple[list[Path], Target | None]:
    """The files to write and the skeleton; refuses what cannot be, before any work."""

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

    def whole(out: Path) -> bool:
        own = target is not None and target.one_file and target.writes(out)
        return own or (sheets and out.suffix.lower() in (".png", ".html"))

    several = [[out] if whole(out) else numbered(out, count) for out in outs]
    for place in (place for one in several for place in one):
        check_output(place, own=target and target.suffix)
    return several


def write(
    motions: Sequence[Motion],
    files: Sequence[Path],
    captions: Sequence[str],
    target: Target | None = None,
    *,
    unit: float | None = None,
) -> list[Path]:
    """Motions, on the target's skeleton, into the files of one ``--out``; ``unit`` is a BVH's without a target."""

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


def remark_unknown(prior: Prior, prompts: Sequence[str]) -> list[str]:
    """Say on stderr, a line each, which prompts are not English or like nothing learned; and give the lines."""
    return list(unknown_words(prior, prompts).values())


def unknown_words(prior: Prior, prompts: Sequence[str]) -> dict[str, str]:
    """The prompts that `remark_unknown` has a line for, with the line."""

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
