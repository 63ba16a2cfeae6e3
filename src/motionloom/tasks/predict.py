"""What somebody does next: many futures of a clip, on its own skeleton and at its own rate.

The clip becomes the uniform person, a predictor completes window after window (`tasks.completion`), and each future is
put behind the clip, which stays bit for bit (`tasks.splice`). Some parts can be held to another motion's, and a future
can be made to arrive at one.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.features.humanml import positions_at
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.motion import Motion
from motionloom.predictor import Predictor
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22
from motionloom.tasks.completion import STEPS, Known, next_frames, row_seed
from motionloom.tasks.splice import carried_level, concatenated, kept_parts, overlaid, splice, standing, worn
from motionloom.tasks.text import LARGEST_SEED, Progress

Array = NDArray[np.float64]

LONGEST = 24 * 3600.0
"""Seconds that are predicted at most."""
WHOLE = 600.0
"""Seconds above which motions come in pieces only (`predict_pieces`)."""
CHUNK = 8.0
"""Seconds that become a body at once."""
CONTEXT = 3.0
"""Seconds of the clip that are looked at for where its floor is."""
RAMP = 0.2
"""Seconds in which a part that is held for a while is led there and back."""
NEAR = (0.3, np.radians(20))
"""Metres and radians within which a source already goes on from the clip and is not moved there."""
ARRIVAL = 1.5
"""Seconds of a switch that are drawn with its target in view; a longer one begins as a free future."""
TARGET = 1.0
"""Seconds of the target that are shown to the network, at most."""


@dataclass(frozen=True)
class HeldPart:
    """Some joints, and when they are held."""

    joints: tuple[str, ...]
    """Joints and groups of the 22-joint skeleton; ``root``: the way through the world (so do pelvis and its groups)."""
    spans: tuple[tuple[float, float], ...] = ((0.0, np.inf),)
    """Seconds (from, to) behind the end of the past."""


@dataclass(frozen=True, eq=False)
class Hold:
    """Parts whose future is given: they take the local rotations of another motion exactly."""

    source: Motion
    """On the past's skeleton and at its rate; its first frame is the first one to predict."""
    parts: tuple[HeldPart, ...]
    align: bool = True
    """Whether a source that starts elsewhere is moved and turned on the ground to where the past ends."""


def predict(
    predictor: Predictor,
    past: Motion,
    *,
    count: int = 10,
    seconds: float = 2.0,
    seed: int = 0,
    hold: Hold | None = None,
    steps: int = STEPS,
    guidance: float = 1.0,
    root: bool = True,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Motion]:
    """``count`` motions that begin with the past, bit for bit, and go on for ``seconds``; future i from (seed, i).

    past: of one person, two frames or more, on any humanoid skeleton (`motionloom.retarget`) and at any rate; the last
    ``predictor.observed`` / ``predictor.fps`` seconds are seen. hold: parts whose future is given. steps: network calls
    per window. guidance: how strictly the past and what is held are heeded, 1 as learned. root: predict the way
    through the world too; False: the person stays in place, as published (Chen et al. 2023). clean: keep planted feet
    still. Longer than a window the future goes on from itself. Raises `MotionloomError` for what cannot be asked.
    """
    _check(predictor, past, seconds, count, seed=seed, steps=steps, guidance=guidance, longest=WHOLE)
    given = _given(predictor, past, hold, seconds)
    windows, made = _windows(predictor, seconds), []
    drawn: list[list[Array]] = [[] for _ in range(count)]
    person = _person(predictor, past)
    seen = np.broadcast_to(person, (count, *person.shape))
    pen = _Pen(predictor, steps, guidance, root)
    for number, window in enumerate(pen.windows(seen, [(seed, i) for i in range(count)], given, windows)):
        for row, places in zip(drawn, window, strict=True):
            row.append(places)
        if progress:
            progress(number + 1, windows)
    for row in drawn:
        made.append(concatenated(past, *_dressed(predictor, past, row, seconds, hold=given, clean=clean)))
    return made


def predict_pieces(
    predictor: Predictor,
    past: Motion,
    *,
    seconds: float,
    number: int = 0,
    seed: int = 0,
    hold: Hold | None = None,
    steps: int = STEPS,
    guidance: float = 1.0,
    root: bool = True,
    clean: bool = True,
) -> Iterator[Motion]:
    """Future ``number`` of `predict`, any length in constant memory: the past, then consecutive pieces behind it."""
    _check(predictor, past, seconds, 1, seed=seed, steps=steps, guidance=guidance, longest=LONGEST)
    given = _given(predictor, past, hold, seconds)
    pen = _Pen(predictor, steps, guidance, root)
    windows = pen.windows(_person(predictor, past)[None], [(seed, number)], given, _windows(predictor, seconds))
    yield past
    yield from _dressed(predictor, past, (window[0] for window in windows), seconds, hold=given, clean=clean)


def switch(
    predictor: Predictor,
    past: Motion,
    target: Motion,
    *,
    count: int = 1,
    seconds: float = 1.0,
    seed: int = 0,
    facing: Literal["turned", "kept"] = "turned",
    steps: int = STEPS,
    guidance: float = 1.0,
    clean: bool = True,
) -> list[Motion]:
    """``count`` motions: the past, ``seconds`` in between, and the target from its first frame on.

    past and target: of one skeleton and rate. The past stays bit for bit; the target is put where the drawn person
    arrives, moved along the ground and, with ``turned``, turned to face where the past ends, and is otherwise as it
    is. Raises `MotionloomError`. ("Motion switch", Chen et al. 2023, section 4.5; there the target is approached only.)
    """
    _check(predictor, past, seconds, count, seed=seed, steps=steps, guidance=guidance, longest=WHOLE)
    _check_like(past, target, "target")
    if facing not in ("turned", "kept"):
        raise MotionloomError(f"facing is 'turned' or 'kept'; got {facing!r}")
    if len(target) < 2:
        raise MotionloomError(f"the target has {len(target)} frame; at least 2 are needed to arrive at it")
    gap = max(round(seconds * past.fps), 1)
    free = max(gap - round(ARRIVAL * past.fps), 0)
    begun = [past] * count
    if free:
        begun = predict(
            predictor,
            past,
            count=count,
            seconds=free / past.fps,
            seed=seed,
            steps=steps,
            guidance=guidance,
            clean=clean,
        )
    return [
        _arriving(
            _Pen(predictor, steps, guidance, True), one, target, gap - free, seed=(seed, i), facing=facing, clean=clean
        )
        for i, one in enumerate(begun)
    ]


def _arriving(
    pen: "_Pen", past: Motion, target: Motion, gap: int, *, seed: tuple[int, int], facing: str, clean: bool
) -> Motion:
    predictor, fps = pen.predictor, past.fps
    rate = predictor.fps / fps
    person, arrival = _person(predictor, past), (gap + 1) * rate
    room = predictor.frames - len(person)
    last = min(room, int(arrival + min(TARGET * predictor.fps, (len(target) - 1) * rate)))
    at = np.arange(1, last + 1)
    goal = to_smpl22(target.frames(0, min(len(target), round(CONTEXT * fps) + 2))).positions()
    turn = 0.0
    if facing == "turned":
        turn = float(SMPL_LAYOUT.place(person[-1]).facing - SMPL_LAYOUT.place(goal[0]).facing)
    goal = rot.rotate(rot.rotvec_to_quat(np.array([0.0, turn, 0.0])), positions_at(goal, (at - arrival) / rate))
    mask = np.repeat((at >= arrival)[:, None], predictor.layout.parts, axis=1).astype(np.float32)
    mask[:, 0] = 0  # where it arrives is free
    places = pen.window(person[None], [seed], 2**20, Known(goal, mask), frames=last)[0]
    tail = past.frames(max(len(past) - _seen_frames(predictor, past), 0), len(past))
    shown = min(len(target), max(2, int((last - arrival) / rate)))
    pads = concatenated(tail, *[tail.frames(len(tail) - 1, len(tail))] * (gap + shown))
    grid = np.concatenate([person, places])
    times = (np.arange(len(pads)) - (len(tail) - 1)) * rate + len(person) - 1
    made = worn(positions_at(grid, times), pads, clean=clean)
    first = len(tail) + gap
    begin, to = standing(target, 0)[0], standing(made, first)[0]
    moved = carried_level(target, rot.rotvec_to_quat(np.array([0.0, turn, 0.0])), begin, to)
    window = concatenated(tail, pads.frames(len(tail), first), moved.frames(0, shown))
    nothing = kept_parts(past.skeleton, frozenset(), np.zeros(3, dtype=bool))
    spliced = splice(window, made, len(tail), last=first, kept=nothing)
    return concatenated(past, spliced.frames(len(tail), first), moved)


# Windows of the uniform person


@dataclass(frozen=True)
class _Pen:
    """What draws, and how."""

    predictor: Predictor
    steps: int
    guidance: float
    root: bool

    def windows(
        self, person: Array, seeds: Sequence[tuple[int, int]], given: "_Given | None", count: int
    ) -> Iterator[Array]:
        """(rows, frames, 22, 3) one after the other behind ``person`` (rows, h, 22, 3)."""
        frames = self.predictor.frames - self.predictor.observed
        for number in range(count):
            first = number * frames + 1
            known = given.known(first, first + self.predictor.frames - person.shape[1]) if given else None
            made = self.window(person, seeds, number, known)
            yield made
            person = np.concatenate([person, made], axis=1)[:, -self.predictor.observed :]

    def window(
        self,
        person: Array,
        seeds: Sequence[tuple[int, int]],
        number: int,
        known: Known | None,
        *,
        frames: int | None = None,
    ) -> Array:
        made = next_frames(
            self.predictor, person, seeds=[row_seed(*seed, number) for seed in seeds], known=known, frames=frames,
            steps=self.steps, guidance=self.guidance,
        )  # fmt: skip
        return made if self.root else made - made[:, :, :1] + person[:, -1:, :1]


def _person(predictor: Predictor, past: Motion) -> Array:
    """(h, 22, 3) metres: the uniform person at the predictor's rate; the last frame is the past's last frame."""
    context = past.frames(max(len(past) - round(CONTEXT * past.fps) - 2, 0), len(past))
    places = to_smpl22(context).positions()
    return positions_at(places, len(context) - 1 - _back(predictor, past))


def _back(predictor: Predictor, past: Motion) -> Array:
    """Frames of the past's rate from its end back to each of those that are seen."""
    whole = int((len(past) - 1) / past.fps * predictor.fps + 1e-6) + 1
    return np.arange(min(max(whole, 2), predictor.observed))[::-1] / predictor.fps * past.fps


def _seen_frames(predictor: Predictor, past: Motion) -> int:
    """Frames of the past that lie within what is seen, at least 2."""
    return max(int(_back(predictor, past)[0] + 1e-6) + 1, 2)


def _windows(predictor: Predictor, seconds: float) -> int:
    return int(np.ceil(seconds * predictor.fps / (predictor.frames - predictor.observed) - 1e-6))


# Onto the past's skeleton


def _dressed(
    predictor: Predictor, past: Motion, windows: Iterable[Array], seconds: float,
    *, hold: "_Given | None", clean: bool,
) -> Iterator[Motion]:  # fmt: skip
    """What follows the past, in pieces of about `CHUNK` seconds; ``windows`` (frames, 22, 3) are read as needed."""
    rate, total = predictor.fps / past.fps, max(round(seconds * past.fps), 1)
    nothing = kept_parts(past.skeleton, frozenset(), np.zeros(3, dtype=bool))
    tail = past.frames(max(len(past) - _seen_frames(predictor, past), 0), len(past))
    grid, zero, done = _person(predictor, past), None, 0
    zero = len(grid) - 1  # the grid's index of the past's last frame
    for places in windows:
        grid = np.concatenate([grid, places])
        ready = min(int((len(grid) - 1 - zero) / rate + 1e-6), total)
        if ready < total and ready - done < CHUNK * past.fps:
            continue
        last = tail.frames(len(tail) - 1, len(tail))
        old = concatenated(tail, *[last] * (ready - done))
        at = (done + np.arange(len(old)) - (len(tail) - 1)) * rate + zero
        made = worn(positions_at(grid, at), old, clean=clean)
        new = splice(old, made, len(tail), last=len(old), kept=nothing).frames(len(tail), len(old))
        new = hold.laid_over(new, done) if hold else new
        yield new
        done = ready
        tail = concatenated(tail, new)
        tail = tail.frames(max(len(tail) - _seen_frames(predictor, past), 0), len(tail))
        drop = max(int(done * rate + zero) - 2 * predictor.observed, 0)
        grid, zero = grid[drop:], zero - drop
        if done == total:
            return


# Parts that are given


@dataclass(frozen=True, eq=False)
class _Given:
    """A `Hold`, ready: on the grid of the predictor for the network, on the past's skeleton for the result."""

    places: Array
    """(frames, 22, 3) the source as the uniform person at the predictor's rate, from the first frame to predict."""
    mask: NDArray[np.float32]
    """(frames, 22)"""
    source: Motion
    joints: Array
    """(frames, joints of the skeleton) weights."""
    way: Array
    """(frames,) weight of the place."""

    def known(self, first: int, last: int) -> Known | None:
        """What the network is told of the frames ``first`` to before ``last`` behind the past (1 is the first)."""
        frames = slice(first - 1, min(last - 1, len(self.places)))
        if first - 1 >= len(self.places) or not self.mask[frames].any():
            return None
        return Known(self.places[frames], self.mask[frames])

    def laid_over(self, new: Motion, done: int) -> Motion:
        """A piece that begins ``done`` frames behind the past, with the parts that are given there."""
        count = min(len(new), len(self.source) - done)
        if count <= 0:
            return new
        here = slice(done, done + count)
        held = overlaid(new.frames(0, count), self.source.frames(done, done + count), self.joints[here], self.way[here])
        return concatenated(held, new.frames(count, len(new))) if count < len(new) else held


def _given(predictor: Predictor, past: Motion, hold: Hold | None, seconds: float) -> _Given | None:
    if hold is None:
        return None
    _check_like(past, hold.source, "motion that parts are held to")
    _check_parts(hold, seconds)
    source = _placed(past, hold.source) if hold.align else hold.source
    tail = past.frames(max(len(past) - round(CONTEXT * past.fps) - 2, 0), len(past))
    together = to_smpl22(concatenated(tail, source)).positions()
    together = together + (_person(predictor, past)[-1, 0] - together[len(tail) - 1, 0])
    rate = predictor.fps / past.fps
    count = int(len(source) * rate + 1e-6)
    places = positions_at(together, len(tail) - 1 + np.arange(1, count + 1) / rate)
    mask = np.zeros((count, predictor.layout.parts), dtype=np.float32)
    joints, way = np.zeros((len(source), len(past.skeleton))), np.zeros(len(source))
    for part in hold.parts:
        chosen, root = _resolved(part)
        inside = _weights(part.spans, np.arange(1, count + 1) / predictor.fps, 0.0) >= 1
        for joint in chosen | ({0} if root else set()):
            mask[inside, predictor.layout.part(joint)] = 1
        weight = _weights(part.spans, np.arange(1, len(source) + 1) / past.fps, RAMP)
        flags = _own_joints(past, chosen)
        joints = np.maximum(joints, weight[:, None] * flags)
        way = np.maximum(way, weight * root)
    return _Given(places, mask, source, joints, way)


def _own_joints(past: Motion, chosen: frozenset[int] | set[int]) -> Array:
    """(joints,) 1 for the joints of the past's skeleton that some of the 22 stand for, and for what hangs on them."""
    none = np.zeros(3, dtype=bool)
    always = kept_parts(past.skeleton, frozenset(), none).joints
    flags = kept_parts(past.skeleton, frozenset(chosen), none).joints & ~always
    for joint, parent in enumerate(past.skeleton.parents):
        flags[joint] |= always[joint] and parent >= 0 and flags[parent]
    return flags.astype(np.float64)


def _weights(spans: Sequence[tuple[float, float]], times: Array, ramp: float) -> Array:
    """1 within spans of seconds, falling to 0 within ``ramp`` seconds around them."""
    weight = np.zeros(len(times))
    for begin, end in spans:
        outside = np.maximum(begin - times, times - end).clip(0)
        u = (1 - outside / ramp).clip(0, 1) if ramp else (outside <= 1e-9).astype(float)
        weight = np.maximum(weight, u * u * (3 - 2 * u))
    return weight


def _resolved(part: HeldPart) -> tuple[set[int], bool]:
    joints = set(SMPL22.resolve(name for name in part.joints if name != "root"))
    return joints, "root" in part.joints or 0 in joints


def _placed(past: Motion, source: Motion) -> Motion:
    """The source where the past ends, if it is not there."""
    (end, facing), (begin, faced) = standing(past, len(past) - 1), standing(source, 0)
    step = end - standing(past, max(len(past) - 2, 0))[0]
    turn = rot.multiply(facing, rot.inverse(faced))
    apart = 2 * np.arccos(min(abs(float(turn[0])), 1.0))
    if apart < NEAR[1] and float(np.linalg.norm((end - begin)[[0, 2]])) < NEAR[0]:
        return source
    return carried_level(source, turn, begin, end + step)


# What cannot be asked


def _check(
    predictor: Predictor,
    past: Motion,
    seconds: float,
    count: int,
    *,
    seed: int,
    steps: int,
    guidance: float,
    longest: float,
) -> None:
    if not isinstance(predictor, Predictor):
        raise MotionloomError(f"motion is predicted by a Predictor; got a {type(predictor).__name__}: load one")
    if predictor.layout.names != SMPL_LAYOUT.names or not predictor.layout.root:
        raise MotionloomError(
            f"this predictor sees {predictor.layout.joints} joints of a benchmark's skeleton; motions of users need "
            "one that sees the 22 joints and their way, such as the shipped one"
        )
    if len(past) < 2:
        raise MotionloomError(f"the past has {len(past)} frame; at least 2 are needed to see how it moves")
    if not (np.isfinite(seconds) and 0 < seconds <= longest) or round(seconds * past.fps) < 1:
        raise MotionloomError(
            f"cannot predict {seconds:g} s; ask for at least a frame ({1 / past.fps:.3g} s) and at most {longest:g} s"
        )
    if not 1 <= count <= 1000 or not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"the count must be 1 to 1000 and the seed 0 to below 2**62; got {count} and {seed}")
    if not isinstance(steps, int) or not 1 <= steps <= predictor.schedule.steps:
        raise MotionloomError(f"{steps} steps cannot be taken; these weights take 1 to {predictor.schedule.steps}")
    if not np.isfinite(guidance) or abs(guidance) > 100:
        raise MotionloomError(f"a guidance of {guidance:g} makes no motion; usual values are 1 to 3")


def _check_like(past: Motion, other: Motion, what: str) -> None:
    if other.skeleton != past.skeleton:
        raise MotionloomError(
            f"the {what} has another skeleton ({len(other.skeleton)} joints, the past {len(past.skeleton)}); "
            "retarget it to the past's first"
        )
    if (other.translations is None) != (past.translations is None):
        raise MotionloomError(
            f"the {what} and the past must both have bones of constant length, or both have moving ones"
        )
    if abs(other.fps - past.fps) > 1e-3 * past.fps:
        raise MotionloomError(f"the {what} has {other.fps:g} fps and the past {past.fps:g}; resample it first")


def _check_parts(hold: Hold, seconds: float) -> None:
    known = ("root", *SMPL22.groups, *SMPL22.names)
    names = [name for part in hold.parts for name in part.joints]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise MotionloomError(f"no part called {unknown[0]!r} to hold; the parts are {', '.join(known)}")
    if not names:
        raise MotionloomError(f"nothing to hold: no joint is named; the parts are {', '.join(known)}")
    for begin, end in (span for part in hold.parts for span in part.spans):
        if not 0 <= begin < end:
            raise MotionloomError(
                f"no stretch from {begin:g} to {end:g} s to hold; give a start of 0 or more below the end"
            )
        if np.isfinite(end) and min(end, seconds) > len(hold.source) / hold.source.fps + 0.5 / hold.source.fps:
            raise MotionloomError(
                f"parts are held until {end:g} s and the motion they come from is "
                f"{len(hold.source) / hold.source.fps:g} s long; hold them for less or give a longer one"
            )
    everywhere = [p for p in hold.parts if any(a <= 0 and b >= seconds for a, b in p.spans)]
    joints = set().union(*(_resolved(part)[0] for part in everywhere)) if everywhere else set()
    if len(joints) == len(SMPL22):
        raise MotionloomError("nothing to predict: all joints are held; hold fewer")
