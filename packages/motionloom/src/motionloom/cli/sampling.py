"""What the commands that generate motions share: options, the checks of them, a progress bar, and files.

Motions are written as they are finished, so that an interruption keeps those: one by one for every ``--count``, or
piece by piece.
"""

import json
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from motionloom.cli.skeletons import Target, own_outs, read_target
from motionloom.cli.terminal import escaping, note, say, unescaped
from motionloom.cli.writing import at_rate, check_rate, check_unit, fail
from motionloom.core.interruption import held_back
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.adapters import parse_adapter
from motionloom.goals.timeline import Timeline
from motionloom.io import check_output
from motionloom.io.stream import Stream
from motionloom.requests.fields import specs
from motionloom.requests.reading import build_request
from motionloom.requests.tasks import Generate
from motionloom.tasks.adapting import adapt
from motionloom.tasks.edit import Loop, edit
from motionloom.tasks.remarks import lines_by_text, remarks_on_words
from motionloom.tasks.run import Models, Plan, Result, run

R = TypeVar("R")


def sampling_of(arguments: Namespace) -> dict[str, Any]:
    """The settings of `Sampling` on the line, as keywords of a task; the others are the task's own."""
    names = ("steps", "solver", "guidance", "seed", "count", "temperature", "pair_guidance", "bodies", "best_of")
    settings: dict[str, Any] = {name: getattr(arguments, name, None) for name in names}
    return {name: value for name, value in settings.items() if value is not None}


def request_of(arguments: Namespace, request: type[R], own: Mapping[str, Any]) -> R:
    """The request of the line; own: values of fields that have no option of their name."""
    options = {name: getattr(arguments, name) for name in specs(request) if hasattr(arguments, name)}
    return build_request(request, options | dict(own))


def results(label: str, plan: Plan, models: Models) -> Iterator[Result]:
    """The results of a task, while a bar shows how far it is."""
    with bar(label) as progress:
        for result in run(plan, models, progress):
            for line in () if plan.task == "compose" else result.aloft:  # which says all its remarks at the end
                say(line)
            yield result


def load_prior(arguments: Namespace) -> Prior:
    """The weights that the line names, with its adapters in them."""
    adapters = [parse_adapter(word) for word in arguments.adapter]
    return adapt(Prior.load(arguments.weights, device=arguments.device), adapters)


def check_outs(arguments: Namespace) -> tuple[list[Path], Target]:
    """The files to write, and what motions become; refuses what cannot be, before any work."""
    outs = arguments.out or own_outs(arguments, "motion")
    target = read_target(arguments, outs)
    for out in outs:
        check_output(out, own=target.suffix)
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


def places(outs: Sequence[Path], count: int, target: Target, *, sheets: bool = True) -> list[list[Path]]:
    """The files of ``count`` motions for each ``--out``, refused where nothing can be written.

    sheets: a picture or a page shows all motions, and so is one file; so is a character's own file with ``--one-file``.
    """

    def whole(out: Path) -> bool:
        return target.holds_all(out) or (sheets and out.suffix.lower() in (".png", ".html"))

    several = [[out] if whole(out) else numbered(out, count) for out in outs]
    for place in (place for one in several for place in one):
        check_output(place, own=target.suffix)
    return several


def report(arguments: Namespace, about: dict[str, Any], paths: Sequence[Path], seconds: float) -> None:
    """Print what was written in ``seconds`` of sampling: a line each, or as JSON behind ``about``."""
    if arguments.json:
        files = [str(path) for path in paths]
        print(json.dumps(about | {"files": files, "sampling_seconds": round(seconds, 3)}, indent=1))
        return
    for path in paths:
        print(f"wrote {path}")


def segment_rows(timeline: Timeline) -> list[dict[str, Any]]:
    """Where each segment of a timeline is, in seconds, and its text."""
    begins = [frame / 20 for frame in timeline.begins]
    return [
        {"begin": begin, "end": end, "text": segment.text}
        for begin, end, segment in zip(begins, begins[1:], timeline.segments, strict=False)
    ]


def check_prompt(prompt: str) -> None:
    """Refuse a prompt without words, and one that is a book."""
    specs(Generate)["prompt"].check(prompt, "prompt")


def remark_unknown(prior: Prior, prompts: Sequence[str]) -> list[str]:
    """Print on stderr, a line each, which prompts are not English or like nothing learned; and return the lines."""
    return list(unknown_words(prior, prompts).values())


def unknown_words(prior: Prior, prompts: Sequence[str], *, heads: bool = False) -> dict[str, str]:
    """The prompts that `remark_unknown` has a line for, with the line; heads: as of `remarks_on_words`."""
    remarks = lines_by_text(remarks_on_words(prior, prompts, heads=heads))
    for line in remarks.values():
        say(line)
    return remarks


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal's stderr, and a function that moves it: (done, of how many)."""
    if not sys.stderr.isatty():  # the bar would leave an empty line, and rich costs a tenth of a second
        yield lambda calls, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(file=unescaped(sys.stderr)), transient=True) as progress, escaping():
        task = progress.add_task(label, total=None)
        yield lambda calls, total: progress.update(task, completed=calls, total=total)


# The end of a motion generated again, so that its beginning can follow it: ``--loop``


def check_loop(arguments: Namespace, seconds: float) -> None:
    """Refuse a ``--loop`` of motions that are too short for it."""
    if arguments.loop:
        Loop(arguments.blend).check(seconds, 0.0)


def check_loop_behind(arguments: Namespace, past: float, added: float, lost: str) -> None:
    """Refuse a ``--loop`` for which the ``added`` seconds behind a past are too short; else note what it changes.

    past: seconds. lost: what is not as requested where the end is generated anew, in words; empty where nothing is.
    """
    if not arguments.loop:
        return
    if arguments.blend > added:
        fail(
            f"--loop generates the last {arguments.blend:g} s again, but only {added:g} s come after {arguments.past}, "
            f"which does not change; give --blend {added:g} or less"
        )
    check_loop(arguments, past + added)
    note_loop(arguments, lost)


def note_loop(arguments: Namespace, lost: str) -> None:
    """Note what is ``lost`` where the end is generated anew, if anything is."""
    if arguments.loop and lost:
        note(f"the last {arguments.blend:g} s are generated again for --loop; {lost}")


def looped(arguments: Namespace, prior: Prior, motion: Motion, text: str, *, seed: int) -> Motion:
    """The motion with its end generated anew so that the beginning can follow it, where the line says ``--loop``.

    text: what the person does there; without it ``--guidance`` is of no use to the prior.
    """
    if not arguments.loop:
        return motion

    names = ("steps", "guidance") if text else ("steps",)
    settings = {name: value for name, value in sampling_of(arguments).items() if name in names}
    settings |= {"foot_lock": getattr(arguments, "foot_lock", True), "seed": seed}
    [closed] = edit(prior, motion, text, Loop(arguments.blend), **settings)
    return closed


# Files that are written as their motions are finished


Item = TypeVar("Item")
"""One of ``--count``: a motion, or the motions of two people."""
Write = Callable[[Sequence[Item], list[list[Path]], int], object]
"""(what comes next, its files for each ``--out``, the number of its first): write it."""


@dataclass(eq=False)
class Finished(Generic[Item]):
    """What is finished, and the files that are in their places; a picture of several is drawn at the end."""

    files: Sequence[Sequence[Path]]
    """For each ``--out`` a file each, or one that shows them all."""
    total: int
    """``--count``."""
    write: Write[Item]
    convert: Callable[[Sequence[Item]], Sequence[Item]] = lambda items: items
    """Applied to them before they are written, such as putting them on a skeleton."""
    what: str = "motions"
    """What they are called in a message."""
    count: int = 0
    """How many are finished."""
    sampling: float = 0.0
    """Seconds of sampling."""
    happened: list[list[dict[str, Any] | None]] = field(default_factory=list)
    """What each person of each one did (`motionloom.kinematics.deeds`), where that is printed."""
    _files: dict[Path, None] = field(default_factory=dict)
    _items: list[Item] = field(default_factory=list)

    @property
    def paths(self) -> list[Path]:
        """Files that are in their places, by ``--out``."""
        return [file for several in self.files for file in several if file in self._files]

    def take(self, makers: Iterable[Sequence[Item]], *, measured: bool = False) -> bool:
        """Write what ``makers`` yield, in order, as it comes; true if that was interrupted after some was finished.

        measured: measure what happened.
        """
        from motionloom.kinematics.deeds import happened

        try:
            began = time.perf_counter()
            for some in makers:
                self.sampling += time.perf_counter() - began
                self._add(some)
                people: list[Any] = [one if isinstance(one, list) else [one] for one in some]
                self.happened += map(happened, people) if measured else ()
                began = time.perf_counter()
        except KeyboardInterrupt:
            if not self.count:
                raise
            self._finish()
            return True
        self._finish()
        return False

    def ended(self, interrupted: bool) -> int:
        """The exit code; reports what was finished if it was interrupted."""
        if not interrupted:
            return 0
        say(f"interrupted; {self.count} of {self.total} {self.what} were finished")
        return 130

    def _shows_all(self, several: Sequence[Path]) -> bool:
        return len(several) < self.total

    def _add(self, some: Sequence[Item]) -> None:
        """Write what comes next, all of it, before an interruption takes effect."""
        with held_back():
            some = self.convert(some)
            first, self.count = self.count, self.count + len(some)
            self._items += some if any(map(self._shows_all, self.files)) else ()
            places = [list(several[first : self.count]) for several in self.files if not self._shows_all(several)]
            if places:
                self.write(some, places, first)
            self._files |= dict.fromkeys(file for several in places for file in several)

    def _finish(self) -> None:
        """Write what shows several, those that are finished."""
        with held_back():
            places = [list(several) for several in self.files if self._shows_all(several)]
            if self.count and places:
                self.write(self._items, places, 0)
                self._files |= dict.fromkeys(file for several in places for file in several)


def finished_motions(
    files: Sequence[Sequence[Path]], captions: Sequence[str], target: Target, rate: float | None, *, first: bool = False
) -> Finished[Motion]:
    """Motions of these captions that are to be finished, retargeted, and written to these files.

    rate: frames per second, None: as they are sampled; first: they get it before they are retargeted.
    """
    names = target.names(captions)

    def write(motions: Sequence[Motion], places: list[list[Path]], first: int) -> None:
        for several in places:
            target.save_all(motions, several, names[first : first + len(motions)])

    def convert(motions: Sequence[Motion]) -> list[Motion]:
        moved = map(target.retarget, at_rate(motions, rate) if first else motions)
        return list(moved) if first else at_rate(moved, rate)

    return Finished(files, len(names), write, convert)


def write_pieces(pieces: Iterable[Motion], streams: Sequence[Stream]) -> None:
    """Write the pieces of one motion into files that all end with the same piece, also after an interruption."""
    try:
        with ExitStack() as stack:
            for stream in streams:
                stack.enter_context(stream)
            for piece in pieces:
                with held_back():
                    for stream in streams:
                        stream.write(piece)
    except KeyboardInterrupt:
        with held_back():  # it may have come just before they were closed
            for stream in streams:
                stream.close()
        raise
