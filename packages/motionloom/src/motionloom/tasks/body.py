"""Places of joints to a body, while they come in: constant bones, still feet and met goals in a moving window.

`ik`, `feet` and `fitting` look at a stretch of motion at once. Here they look at blocks with a margin on either side,
and where two blocks meet one fades into the other; blocks begin at fixed frames, so nothing depends on how the frames
arrived.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import shares, smoothstep
from motionloom.core.body.feet import clean_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.motion import Motion
from motionloom.edits.fitting import fit
from motionloom.goals.goal import Goal, joined

Array = NDArray[np.float64]

BLOCK = 300
"""Frames handed out at once."""
MARGIN = 60
"""Frames looked at before and behind them: further than a stance or the turn of a straight limb is felt."""
FADE = 20
"""Frames over which one block's body becomes the next one's."""


@dataclass(frozen=True, eq=False)
class Places:
    """Some frames of a motion, as a network predicted them."""

    positions: Array
    """(frames, 22, 3) metres in the world; bones may breathe."""
    contacts: Array
    """(frames, 4) as in the features."""
    goal: Goal
    """Targets of these frames, in the world; empty where there are none."""

    def __len__(self) -> int:
        return len(self.positions)

    def crop(self, first: int, last: int) -> "Places":
        """The frames from ``first`` to before ``last``."""
        return Places(self.positions[first:last], self.contacts[first:last], self.goal.crop(first, last))


def solve_stream(pieces: Iterable[Places], fps: float, *, foot_lock: bool = True) -> Iterator[Motion]:
    """Consecutive blocks of the 22-joint person, as many frames in all as the pieces have; see `solve`."""
    waiting: Places | None = None
    before, tail = 0, None
    for piece in pieces:
        waiting = piece if waiting is None else join_places(waiting, piece)
        while len(waiting) >= before + BLOCK + MARGIN:
            solved = _with_signs_of(
                tail, solve(waiting.crop(0, before + BLOCK + MARGIN), fps, foot_lock=foot_lock), before
            )
            yield _crossfaded(tail, solved.frames(before, before + BLOCK))
            tail = solved.frames(before + BLOCK, before + BLOCK + FADE)
            waiting = waiting.crop(before + BLOCK - MARGIN, len(waiting))
            before = MARGIN
    if waiting is not None and len(waiting) > before:
        solved = _with_signs_of(tail, solve(waiting, fps, foot_lock=foot_lock), before)
        yield _crossfaded(tail, solved.frames(before, len(waiting)))


def solve(places: Places, fps: float, *, foot_lock: bool = True) -> Motion:
    """A person with constant bones who takes these places, planted feet still (``foot_lock``), and meets the goal."""
    motion = motion_from_positions(places.positions, fps)
    if foot_lock:
        motion = clean_feet(motion, contacts=places.contacts)
    return motion if places.goal.empty else fit(motion, places.goal)


def join_places(first: Places, second: Places) -> Places:
    """The second behind the first."""
    return Places(
        np.concatenate([first.positions, second.positions]),
        np.concatenate([first.contacts, second.contacts]),
        joined(first.goal, second.goal),
    )


def _with_signs_of(old: Motion | None, new: Motion, at: int) -> Motion:
    """The new motion with the signs of quaternions that ``old`` begins with at frame ``at``; both signs are one turn.

    Of the whole, not of what is handed out: the next block takes its signs from the frames behind.
    """
    if old is None:
        return new
    other = (new.rotations[at] * old.rotations[0]).sum(-1) < 0
    return replace(new, rotations=np.where(other[:, None], -new.rotations, new.rotations))


def _crossfaded(old: Motion | None, new: Motion) -> Motion:
    """The new block, begun as the frames ``old`` that the block before it saw in its place."""
    if old is None:
        return new
    count = min(len(old), len(new))
    share = smoothstep(shares(count))
    root, turns = new.root.copy(), new.rotations.copy()
    root[:count] = old.root[:count] + share[:, None] * (root[:count] - old.root[:count])
    mixed = old.rotations[:count] + share[:, None, None] * (turns[:count] - old.rotations[:count])
    turns[:count] = rot.normalize(mixed)
    return replace(new, root=root, rotations=turns)
