"""Motions that are written as they are finished, so that an interruption keeps those: for every ``--count``."""

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from motionloom.cli.sampling import write
from motionloom.cli.skeletons import Target, put_all
from motionloom.cli.writing import at_rate
from motionloom.interruption import held_back
from motionloom.motion import Motion

Made = TypeVar("Made")
"""What is made ``--count`` times: a motion, or the motions of two people."""
Write = Callable[[Sequence[Made], list[list[Path]], int], object]
"""(what comes next, its files for each ``--out``, the number of its first): write it."""


@dataclass(eq=False)
class Finished(Generic[Made]):
    """What is finished, and the files that are in their places; a picture that shows several is drawn at the end."""

    files: Sequence[Sequence[Path]]
    """For each ``--out`` a file each, or one that shows them all."""
    total: int
    """How many were asked for."""
    write: Write[Made]
    put: Callable[[Sequence[Made]], Sequence[Made]] = lambda made: made
    """What is done to them before they are written, such as putting them on a skeleton."""
    what: str = "motions"
    """What they are called in a message."""
    count: int = 0
    """How many are finished."""
    sampling: float = 0.0
    """Seconds of drawing."""
    happened: list[list[dict[str, Any] | None]] = field(default_factory=list)
    """What each person of each one did (`motionloom.kinematics.deeds`), where that is told."""
    _files: dict[Path, None] = field(default_factory=dict)
    _shown: list[Made] = field(default_factory=list)

    @property
    def written(self) -> list[Path]:
        """Files that are in their places, by ``--out``."""
        return [file for several in self.files for file in several if file in self._files]

    def take(self, makers: Iterable[Sequence[Made]], *, measured: bool = False) -> bool:
        """Write what ``makers`` give, in order, as it comes; true if that was interrupted after some was finished.

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
        """The exit code; says what was finished if it was interrupted."""
        if not interrupted:
            return 0
        print(f"motionloom: interrupted; {self.count} of {self.total} {self.what} were finished", file=sys.stderr)
        return 130

    def _shows_all(self, several: Sequence[Path]) -> bool:
        return len(several) < self.total

    def _add(self, some: Sequence[Made]) -> None:
        """Write what comes next, all of it, before an interruption takes effect."""
        with held_back():
            some = self.put(some)
            first, self.count = self.count, self.count + len(some)
            self._shown += some if any(map(self._shows_all, self.files)) else ()
            places = [list(several[first : self.count]) for several in self.files if not self._shows_all(several)]
            if places:
                self.write(some, places, first)
            self._files |= dict.fromkeys(file for several in places for file in several)

    def _finish(self) -> None:
        """Draw what shows several, those that are finished."""
        with held_back():
            places = [list(several) for several in self.files if self._shows_all(several)]
            if self.count and places:
                self.write(self._shown, places, 0)
                self._files |= dict.fromkeys(file for several in places for file in several)


def finished_motions(
    files: Sequence[Sequence[Path]],
    captions: Sequence[str],
    target: Target | None,
    *,
    unit: float | None = None,
    rate: float | None = None,
) -> Finished[Motion]:
    """Motions of these captions that are to be finished, put on the target's skeleton, and written to these files.

    unit: metres that a unit of a BVH is, without a target; rate: frames per second, None: as they are made.
    """

    captions = captions if target is None else target.names(captions)

    def written(motions: Sequence[Motion], places: list[list[Path]], first: int) -> None:
        for several in places:
            write(motions, several, captions[first : first + len(motions)], target, unit=unit)

    return Finished(files, len(captions), written, lambda motions: at_rate(put_all(target, motions), rate))
