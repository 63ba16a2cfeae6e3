"""What somebody does next: many futures of a clip, on its own skeleton and at its own rate.

The clip becomes the uniform person, a predictor completes window after window (`tasks.completion`), and each future is
appended to the clip, which stays bit for bit (`tasks.splice`). Some parts can be held to another motion's, and a future
can arrive at one.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Literal, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.errors import MotionloomError
from motionloom.core.features.humanml import positions_at
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.goals.mask_file import fixes_everything
from motionloom.goals.schemas import MASK_JOINTS
from motionloom.requests.sampling import PredictionSampling, PredictionSettings
from motionloom.requests.tasks import DAY
from motionloom.retarget import to_smpl22
from motionloom.tasks.completion import CONTEXT, FUTURES, Known, Past, WindowSampler, window_count
from motionloom.tasks.other_joints import arrive, future_pieces, on_joints_of, sees_person
from motionloom.tasks.sampling import Progress
from motionloom.tasks.splice import (
    apply_positions,
    check_like,
    concatenate,
    continue_motion,
    ground_pose_at,
    kept_parts,
    move_on_floor,
    overlay,
    splice,
)

__all__ = ["FixedJoints", "FixedPart", "predict", "predict_pieces", "switch"]

Array = NDArray[np.float64]

WHOLE = 600.0
"""Seconds above which motions come in pieces only (`predict_pieces`)."""
MOST = 6000.0
"""Seconds of all futures of one call together, at most."""
CHUNK = 8.0
"""Seconds that become a body at once."""
ARRIVAL = 0.75
"""Share of a window that is sampled with the target of a switch in view; a longer one begins as a free future."""
TARGET = 1.0
"""Seconds of the target that are shown to the network, at most."""


def predict(
    predictor: Predictor,
    past: Motion,
    *,
    seconds: float = 2.0,
    hold: FixedJoints | None = None,
    root: bool = True,
    foot_lock: bool = True,
    sampling: PredictionSampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[PredictionSettings],
) -> list[Motion]:
    """Motions that begin with the past, bit for bit, and go on for ``seconds``: futures, 10 without a ``count``.

    A predictor of other joints than the 22, such as a published one of Human3.6M, gives motions of those joints at its
    own rate: they begin with the past as it is on them, and the person stays where the past ends (`other_joints`).

    Args:
        predictor: from `Predictor.load`.
        past: of one person, two frames or more, on any humanoid skeleton (`motionloom.retarget`) and at any rate; the
            last ``predictor.observed`` / ``predictor.fps`` seconds are seen.
        seconds: how far to predict; longer than a window the future goes on from itself.
        hold: parts whose future is given.
        root: predict the way through the world too; False: the person stays in place, as published (Chen et al. 2023).
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords. Future i is sampled from (``seed``, i). A guidance of 1 heeds
            the past as learned; a temperature above 1 gives livelier and more various futures.
        progress: called after each window with the windows done and the windows in all.

    Raises:
        MotionloomError: for an impossible request.
    """
    chosen = PredictionSampling.of(sampling, settings)
    count = chosen.number(FUTURES)
    _check(predictor, past.fps, seconds, count=count, sampling=chosen, longest=WHOLE)
    if not sees_person(predictor):
        how = _OtherJoints(predictor, past, seconds, hold, chosen)
        return how.futures(chosen.numbers(FUTURES), progress)
    history = Past.of(predictor, past)
    total = max(round(seconds * past.fps), 1)
    parts = prepare_hold(history, hold, seconds) if hold else None
    [seed], count_of = replace(chosen, first=0).seeds(1), window_count(predictor, total / past.fps)
    sampler = WindowSampler(predictor, chosen, root)
    person = np.broadcast_to(history.person, (count, *history.person.shape))
    windows_sampled = sampler.windows(
        person, [(seed, i) for i in chosen.numbers(FUTURES)], parts and parts.known, count_of
    )
    windows = []
    for window in windows_sampled:
        windows.append(window)
        if progress:
            progress(len(windows), count_of)
    return [
        concatenate(
            past, *_continue_past(history, (one[row] for one in windows), total, hold=parts, foot_lock=foot_lock)
        )
        for row in range(count)
    ]


def predict_pieces(
    predictor: Predictor,
    past: Motion,
    *,
    seconds: float,
    number: int = 0,
    hold: FixedJoints | None = None,
    root: bool = True,
    foot_lock: bool = True,
    sampling: PredictionSampling | None = None,
    **settings: Unpack[PredictionSettings],
) -> Iterator[Motion]:
    """Future ``number`` of `predict`, any length in constant memory: the past, then consecutive pieces behind it.

    The arguments and errors are those of `predict`; a day is the longest.
    """
    chosen = PredictionSampling.of(sampling, settings).alone()
    _check(predictor, past.fps, seconds, count=1, sampling=chosen, longest=DAY)
    if not sees_person(predictor):
        how = _OtherJoints(predictor, past, seconds, hold, chosen)
        yield from chain([how.past], (one for [one] in how.pieces([number])))
        return
    history = Past.of(predictor, past)
    total = max(round(seconds * past.fps), 1)
    parts = prepare_hold(history, hold, seconds) if hold else None
    windows = WindowSampler(predictor, chosen, root).windows(
        history.person[None],
        [(chosen.seeds(1)[0], number)],
        parts and parts.known,
        window_count(predictor, total / past.fps),
    )
    yield from chain(
        [past], _continue_past(history, (window[0] for window in windows), total, hold=parts, foot_lock=foot_lock)
    )


def switch(
    predictor: Predictor,
    past: Motion,
    target: Motion,
    *,
    seconds: float = 1.0,
    facing: Literal["turned", "kept"] = "turned",
    foot_lock: bool = True,
    sampling: PredictionSampling | None = None,
    **settings: Unpack[PredictionSettings],
) -> list[Motion]:
    """Motions of the past, ``seconds`` in between, and the target from its first frame on.

    The past stays bit for bit; the target is moved along the ground to where the sampled person arrives.

    Args:
        past, target: of one skeleton and rate.
        seconds: between the two.
        facing: "turned" lets the target face as the past does where it ends; "kept" leaves it as it is.
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords; one motion without a ``count``.

    Raises:
        MotionloomError: for an impossible request.

    ("Motion switch", Chen et al. 2023, section 4.5; there the target is approached only.)
    """
    chosen = PredictionSampling.of(sampling, settings)
    chosen = replace(chosen, count=chosen.number())
    _check(predictor, past.fps, seconds, count=chosen.number(), sampling=chosen, longest=WHOLE)
    if sees_person(predictor):
        check_like(past, target, "target")
    if facing not in ("turned", "kept"):
        raise MotionloomError(f"facing is 'turned' or 'kept'; got {facing!r}")
    if len(target) < 2:
        raise MotionloomError(f"the target has {len(target)} frame; at least 2 are needed to arrive at it")
    if not sees_person(predictor):
        return _switch_other_joints(predictor, past, target, seconds=seconds, turn=facing == "turned", sampling=chosen)
    gap = max(round(seconds * past.fps), 1)
    near = int(ARRIVAL * (predictor.frames - predictor.observed) / predictor.fps * past.fps)
    free = max(gap - max(near, 1), 0)
    motions = [past]
    if free:
        motions = predict(predictor, past, seconds=free / past.fps, sampling=chosen, foot_lock=foot_lock)
    pasts = [Past.of(predictor, one) for one in motions]
    pasts = pasts if free else pasts * chosen.number()
    sampler = WindowSampler(predictor, replace(chosen, first=0))
    return [
        _arrive(sampler, one, target, gap - free, number=i, facing=facing, foot_lock=foot_lock)
        for i, one in enumerate(pasts, start=chosen.first)
    ]


@dataclass(frozen=True, eq=False)
class _OtherJoints:
    """A request of a predictor of other joints than the 22, its past on those joints and at its rate."""

    predictor: Predictor
    clip: Motion
    seconds: float
    hold: FixedJoints | None
    sampling: PredictionSampling

    @cached_property
    def past(self) -> Motion:
        return on_joints_of(self.predictor, self.clip)

    def pieces(self, numbers: Sequence[int]) -> Iterator[list[Motion]]:
        past, hold = self.past, self.hold
        if hold:
            source = on_joints_of(self.predictor, hold.source, skeleton=past.skeleton)
            hold = replace(hold, source=source)
            _check_parts(hold, self.seconds)
        total = max(round(self.seconds * past.fps), 1)
        yield from future_pieces(self.predictor, past, total=total, numbers=numbers, hold=hold, sampling=self.sampling)

    def futures(self, numbers: Sequence[int], progress: Progress | None) -> list[Motion]:
        motions, count = [[self.past] for _ in numbers], window_count(self.predictor, self.seconds)
        for done, pieces in enumerate(self.pieces(numbers), start=1):
            for motion, piece in zip(motions, pieces, strict=True):
                motion.append(piece)
            if progress:
                progress(done, count)
        return [concatenate(*parts) for parts in motions]


def _switch_other_joints(
    predictor: Predictor, past: Motion, target: Motion, *, seconds: float, turn: bool, sampling: PredictionSampling
) -> list[Motion]:
    past = on_joints_of(predictor, past)
    target = on_joints_of(predictor, target, skeleton=past.skeleton)
    gap = max(round(seconds * past.fps), 1)
    room = predictor.frames - predictor.observed
    free = max(gap - max(int(ARRIVAL * room), 1), 0)
    numbers = range(sampling.first, sampling.first + sampling.number())
    motions = [past for _ in numbers]
    if free:
        motions = predict(predictor, past, seconds=free / past.fps, sampling=sampling)
    sampler, shown = WindowSampler(predictor, replace(sampling, first=0)), max(round(TARGET * predictor.fps), 2)
    return [
        arrive(sampler, one, target, gap=gap - free, number=i, turn=turn, shown=shown)
        for i, one in zip(numbers, motions, strict=True)
    ]


def _arrive(
    sampler: WindowSampler, history: Past, target: Motion, gap: int, *, number: int, facing: str, foot_lock: bool
) -> Motion:
    predictor, past, person, rate, tail = sampler.predictor, history.motion, history.person, history.rate, history.tail
    arrival = (gap + 1) * rate
    room = predictor.frames - len(person)
    span = max(min(TARGET * predictor.fps, (len(target) - 1) * rate), 2.0)  # two places of the grid give a velocity
    last = min(room, int(arrival + span))
    at = np.arange(1, last + 1)
    goal = to_smpl22(target.frames(0, min(len(target), round(CONTEXT * past.fps) + 2))).positions()
    turn = 0.0
    if facing == "turned":
        turn = float(SMPL_LAYOUT.place(person[-1]).facing - SMPL_LAYOUT.place(goal[0]).facing)
    goal = rot.rotate(rot.rotvec_to_quat(np.array([0.0, turn, 0.0])), positions_at(goal, (at - arrival) / rate))
    mask = np.repeat((at >= arrival)[:, None], predictor.layout.parts, axis=1).astype(np.float32)
    mask[:, 0] = 0  # where it arrives is free
    seeds = [(sampler.sampling.seeds(1)[0], number)]
    places = sampler.window(person[None], seeds, 2**20, Known(goal, mask), frames=last)[0]
    behind = min(len(target), int((last - arrival) / rate) + 1)
    pads = concatenate(tail, *[tail.frames(len(tail) - 1, len(tail))] * (gap + behind))
    times = (np.arange(len(pads)) - (len(tail) - 1)) * rate + len(person) - 1
    grid = positions_at(np.concatenate([person, places]), times)
    sampled = apply_positions(grid, pads, foot_lock=foot_lock, known=len(tail))
    first = len(tail) + gap
    begin = ground_pose_at(target, 0)
    moved = move_on_floor(target, begin, replace(ground_pose_at(sampled, first), facing=begin.facing + turn))
    window = concatenate(tail, pads.frames(len(tail), first), moved.frames(0, behind))
    spliced = splice(window, sampled, len(tail), last=first)
    return concatenate(past, spliced.frames(len(tail), first), moved)


# Onto the past's skeleton


def _continue_past(
    past: Past, windows: Iterable[Array], total: int, *, hold: "HeldParts | None", foot_lock: bool
) -> Iterator[Motion]:
    """``total`` frames behind the past, in pieces of about `CHUNK` seconds; ``windows`` (frames, 22, 3) are read as
    needed."""
    fps, rate, tail, grid = past.motion.fps, past.rate, past.tail, past.person
    tail_length, longest_grid, begin = len(tail), 2 * past.predictor.observed, 0
    zero = len(grid) - 1  # the grid's index of the past's last frame
    for places in windows:
        grid = np.concatenate([grid, places])
        ready = min(int((len(grid) - 1 - zero) / rate + 1e-6), total)
        if ready < total and ready - begin < CHUNK * fps:
            continue
        at = (begin + np.arange(len(tail) + ready - begin) - (len(tail) - 1)) * rate + zero
        new = continue_motion(tail, positions_at(grid, at), foot_lock=foot_lock)
        new = hold.overlay_on(new, begin) if hold else new
        yield new
        begin = ready
        tail = concatenate(tail, new)
        tail = tail.frames(max(len(tail) - tail_length, 0), len(tail))
        drop = max(int(begin * rate + zero) - longest_grid, 0)
        grid, zero = grid[drop:], zero - drop
        if begin == total:
            return


# Errors of requests


def _check(
    predictor: Predictor, fps: float, seconds: float, *, count: int, sampling: PredictionSampling, longest: float
) -> None:
    if not isinstance(predictor, Predictor):
        raise MotionloomError(f"motion is predicted by a Predictor; got a {type(predictor).__name__}: load one")
    if not (np.isfinite(seconds) and 0 < seconds <= longest) or round(seconds * fps) < 1:
        raise MotionloomError(
            f"cannot predict {seconds:g} s; ask for at least a frame ({1 / fps:.3g} s) and at most {longest:g} s"
        )
    if count * seconds > MOST:
        raise MotionloomError(
            f"{count} futures of {seconds:g} s are too much at once; ask for at most {MOST:g} s together"
        )
    sampling.levels(predictor.schedule)


# Parts that are held to another motion


RAMP = 0.2
"""Seconds over which a part that is held for a while fades in and out."""
NEAR = (0.3, np.radians(20))
"""Metres and radians within which a source already goes on from the clip and is not moved there."""


@dataclass(frozen=True, eq=False)
class HeldParts:
    """A `FixedJoints`, ready: on the grid of the predictor for the network, on the past's skeleton for the result."""

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
        """What the network knows of the frames ``first`` to before ``last`` behind the past (1 is the first)."""
        frames = slice(first - 1, min(last - 1, len(self.places)))
        if first - 1 >= len(self.places) or not self.mask[frames].any():
            return None
        return Known(self.places[frames], self.mask[frames])

    def overlay_on(self, new: Motion, begin: int) -> Motion:
        """A piece that begins ``begin`` frames behind the past, with the held parts there."""
        count = min(len(new), len(self.source) - begin)
        if count <= 0:
            return new
        here = slice(begin, begin + count)
        held = overlay(new.frames(0, count), self.source.frames(begin, here.stop), self.joints[here], self.way[here])
        return concatenate(held, new.frames(count, len(new))) if count < len(new) else held


def prepare_hold(history: Past, hold: FixedJoints, seconds: float) -> HeldParts:
    """The held parts for a past and a horizon; raises MotionloomError for parts that cannot be held."""
    past, predictor = history.motion, history.predictor
    check_like(past, hold.source, "motion that parts are held to")
    _check_parts(hold, seconds)
    rate, total = history.rate, max(round(seconds * past.fps), 1)
    source = _moved_to_past(past, hold.source) if hold.align else hold.source
    source = source.frames(0, total + int(np.ceil(predictor.frames / rate)))  # the last window looks further
    end = len(source) / past.fps
    tail = past.frames(max(len(past) - round(CONTEXT * past.fps) - 2, 0), len(past))
    together = to_smpl22(concatenate(tail, source)).positions()
    together = together + (history.person[-1, 0] - together[len(tail) - 1, 0])
    count = int(len(source) * rate + 1e-6)
    places = positions_at(together, len(tail) - 1 + np.arange(1, count + 1) / rate)
    source = concatenate(source, *[source.frames(len(source) - 1, len(source))] * round(RAMP * past.fps))
    mask = np.zeros((count, predictor.layout.parts), dtype=np.float32)
    joints, way = np.zeros((len(source), len(past.skeleton))), np.zeros(len(source))
    for part in hold.parts:
        chosen = set(SMPL22.resolve(name for name in part.joints if name != "root"))
        root = "root" in part.joints or 0 in chosen
        spans = [(begin, min(until, end)) for begin, until in part.spans if begin < end]
        inside = _weights(spans, np.arange(1, count + 1) / predictor.fps, 0.0) >= 1
        for joint in chosen | ({0} if root else set()):
            mask[inside, predictor.layout.part(joint)] = 1
        weight = _weights(spans, np.arange(1, len(source) + 1) / past.fps, RAMP)
        flags = _joint_flags(past, chosen)
        joints = np.maximum(joints, weight[:, None] * flags)
        way = np.maximum(way, weight * root)
    return HeldParts(places, mask, source, joints, way)


def _joint_flags(past: Motion, chosen: frozenset[int] | set[int]) -> Array:
    """(joints,) 1 for the past's joints that correspond to some of the 22, and for what hangs on them."""
    always = kept_parts(past.skeleton).joints
    flags = kept_parts(past.skeleton, frozenset(chosen)).joints & ~always
    for joint, parent in enumerate(past.skeleton.parents):
        flags[joint] |= always[joint] and parent >= 0 and flags[parent]
    return flags.astype(np.float64)


def _weights(spans: Sequence[tuple[float, float]], times: Array, ramp: float) -> Array:
    """1 within spans of seconds, falling to 0 within ``ramp`` seconds around them."""
    weight = np.zeros(len(times))
    for begin, end in spans:
        outside = (np.maximum(begin - times, times - end) - 1e-6).clip(0)
        weight = np.maximum(weight, smoothstep(1 - outside / ramp) if ramp else outside == 0)
    return weight


def _moved_to_past(past: Motion, source: Motion) -> Motion:
    """The source where the past ends, if it is not there."""
    end, begin = ground_pose_at(past, len(past) - 1), ground_pose_at(source, 0)
    before = ground_pose_at(past, max(len(past) - 2, 0))
    metres, radians = end.apart(begin)
    if radians < NEAR[1] and metres < NEAR[0]:
        return source
    return move_on_floor(source, begin, replace(end, x=2 * end.x - before.x, z=2 * end.z - before.z))


def _check_parts(hold: FixedJoints, seconds: float) -> None:
    names = [name for part in hold.parts for name in part.joints]
    unknown = [name for name in names if name not in MASK_JOINTS]
    if unknown:
        raise MotionloomError(f"no part called {unknown[0]!r} to hold; the parts are {', '.join(MASK_JOINTS)}")
    if not names or not any(part.spans for part in hold.parts):
        raise MotionloomError(f"nothing to hold: no joint is named; the parts are {', '.join(MASK_JOINTS)}")
    for begin, end in (span for part in hold.parts for span in part.spans):
        _check_span(begin, end, hold.source, seconds)
    if fixes_everything(hold.parts, seconds):
        raise MotionloomError("nothing to predict: all joints are held; hold fewer")


def _check_span(begin: float, end: float, source: Motion, seconds: float) -> None:
    long = len(source) / source.fps
    if not 0 <= begin < end:
        raise MotionloomError(
            f"no stretch from {begin:g} to {end:g} s to hold; give a start of 0 or more below the end"
        )
    if begin >= min(seconds, long):
        raise MotionloomError(
            f"nothing to hold from {begin:g} s on: {seconds:g} s are predicted, and the motion that parts are held "
            f"to is {long:g} s long"
        )
    if np.isfinite(end) and min(end, seconds) > long + 0.5 / source.fps:
        raise MotionloomError(
            f"parts are held until {end:g} s and the motion they come from is {long:g} s long; hold them for less or "
            "give a longer one"
        )
