"""What somebody does next: many futures of a clip, on its own skeleton and at its own rate.

The clip becomes the uniform person, a predictor completes window after window (`tasks.completion`), and each future is
put behind the clip, which stays bit for bit (`tasks.splice`). Some parts can be held to another motion's, and a future
can be made to arrive at one.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Literal, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.features.humanml import positions_at
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.motion import Motion
from motionloom.requests.predict import DAY
from motionloom.requests.sampling import PredictionSampling, PredictionSettings
from motionloom.retarget import to_smpl22
from motionloom.tasks.completion import FUTURES, Known
from motionloom.tasks.held_parts import HeldParts, check_like, prepare_hold
from motionloom.tasks.sampling import Progress
from motionloom.tasks.splice import apply_positions, concatenate, continue_motion, ground_pose_at, move_on_floor, splice
from motionloom.tasks.windows import CONTEXT, Past, WindowSampler, window_count
from motionloom.weights.predictor import Predictor

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
    """Motions that begin with the past, bit for bit, and go on for ``seconds``: futures, 10 unless ``count`` says.

    Args:
        predictor: from `Predictor.load`.
        past: of one person, two frames or more, on any humanoid skeleton (`motionloom.retarget`) and at any rate; the
            last ``predictor.observed`` / ``predictor.fps`` seconds are seen.
        seconds: how far to predict; longer than a window the future goes on from itself.
        hold: parts whose future is given.
        root: predict the way through the world too; False: the person stays in place, as published (Chen et al. 2023).
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords. Future i is sampled from (``seed``, i). A guidance of 1 heeds
            the past as learned; a temperature above 1 makes livelier and more various futures.
        progress: called after each window with the windows done and the windows in all.

    Raises:
        MotionloomError: for an impossible request.
    """
    chosen = PredictionSampling.of(sampling, settings)
    count = chosen.number(FUTURES)
    _check(predictor, past.fps, seconds, count=count, sampling=chosen, longest=WHOLE)
    history = Past.of(predictor, past)
    total = max(round(seconds * past.fps), 1)
    parts = prepare_hold(predictor, history, hold, seconds) if hold else None
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
    history = Past.of(predictor, past)
    total = max(round(seconds * past.fps), 1)
    parts = prepare_hold(predictor, history, hold, seconds) if hold else None
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
        sampling: or single settings of it as keywords; one motion is made unless ``count`` says otherwise.

    Raises:
        MotionloomError: for an impossible request.

    ("Motion switch", Chen et al. 2023, section 4.5; there the target is approached only.)
    """
    chosen = PredictionSampling.of(sampling, settings)
    chosen = replace(chosen, count=chosen.number())
    _check(predictor, past.fps, seconds, count=chosen.number(), sampling=chosen, longest=WHOLE)
    check_like(past, target, "target")
    if facing not in ("turned", "kept"):
        raise MotionloomError(f"facing is 'turned' or 'kept'; got {facing!r}")
    if len(target) < 2:
        raise MotionloomError(f"the target has {len(target)} frame; at least 2 are needed to arrive at it")
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


def _arrive(
    sampler: WindowSampler, history: Past, target: Motion, gap: int, *, number: int, facing: str, foot_lock: bool
) -> Motion:
    predictor, past, person, rate, tail = sampler.predictor, history.motion, history.person, history.rate, history.tail
    arrival = (gap + 1) * rate
    room = predictor.frames - len(person)
    shown = max(min(TARGET * predictor.fps, (len(target) - 1) * rate), 2.0)  # two places of the grid give a velocity
    last = min(room, int(arrival + shown))
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
    past: Past, windows: Iterable[Array], total: int, *, hold: HeldParts | None, foot_lock: bool
) -> Iterator[Motion]:
    """``total`` frames behind the past, in pieces of about `CHUNK` seconds; ``windows`` (frames, 22, 3) are read as
    needed."""
    fps, rate, tail, grid = past.motion.fps, past.rate, past.tail, past.person
    tail_length, longest_grid, done = len(tail), 2 * past.observed, 0
    zero = len(grid) - 1  # the grid's index of the past's last frame
    for places in windows:
        grid = np.concatenate([grid, places])
        ready = min(int((len(grid) - 1 - zero) / rate + 1e-6), total)
        if ready < total and ready - done < CHUNK * fps:
            continue
        at = (done + np.arange(len(tail) + ready - done) - (len(tail) - 1)) * rate + zero
        new = continue_motion(tail, positions_at(grid, at), foot_lock=foot_lock)
        new = hold.overlay_on(new, done) if hold else new
        yield new
        done = ready
        tail = concatenate(tail, new)
        tail = tail.frames(max(len(tail) - tail_length, 0), len(tail))
        drop = max(int(done * rate + zero) - longest_grid, 0)
        grid, zero = grid[drop:], zero - drop
        if done == total:
            return


# Errors of requests


def _check(
    predictor: Predictor, fps: float, seconds: float, *, count: int, sampling: PredictionSampling, longest: float
) -> None:
    if not isinstance(predictor, Predictor):
        raise MotionloomError(f"motion is predicted by a Predictor; got a {type(predictor).__name__}: load one")
    if predictor.layout.names != SMPL_LAYOUT.names or not predictor.layout.root:
        raise MotionloomError(
            f"this predictor sees {predictor.layout.joints} joints of a benchmark's skeleton; motions of users need "
            "one that sees the 22 joints and their way, such as the shipped one"
        )
    if not (np.isfinite(seconds) and 0 < seconds <= longest) or round(seconds * fps) < 1:
        raise MotionloomError(
            f"cannot predict {seconds:g} s; ask for at least a frame ({1 / fps:.3g} s) and at most {longest:g} s"
        )
    if count * seconds > MOST:
        raise MotionloomError(
            f"{count} futures of {seconds:g} s are too much at once; ask for at most {MOST:g} s together"
        )
    sampling.levels(predictor.schedule)
