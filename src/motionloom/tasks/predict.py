"""What somebody does next: many futures of a clip, on its own skeleton and at its own rate.

The clip becomes the uniform person, a predictor completes window after window (`tasks.completion`), and each future is
put behind the clip, which stays bit for bit (`tasks.splice`). Some parts can be held to another motion's, and a future
can be made to arrive at one.
"""

from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom._moved import renamed
from motionloom.errors import MotionloomError
from motionloom.features.humanml import positions_at
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.goals.hold import HeldPart, Hold
from motionloom.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.tasks.completion import STEPS, TEMPERATURE, Known
from motionloom.tasks.held import Given, check_like, given
from motionloom.tasks.splice import apply_positions, carried_level, concatenated, kept_parts, splice, standing
from motionloom.tasks.text import LARGEST_SEED, Progress
from motionloom.tasks.windows import CONTEXT, Pen, person_of, seen_frames, windows_for
from motionloom.weights.predictor import Predictor

__all__ = ["HeldPart", "Hold", "predict", "predict_pieces", "switch"]

Array = NDArray[np.float64]

LONGEST = 24 * 3600.0
"""Seconds that are predicted at most."""
WHOLE = 600.0
"""Seconds above which motions come in pieces only (`predict_pieces`)."""
MOST = 6000.0
"""Seconds of all futures together that are made at once."""
CHUNK = 8.0
"""Seconds that become a body at once."""
ARRIVAL = 0.75
"""Share of a window that is drawn with the target of a switch in view; a longer one begins as a free future."""
TARGET = 1.0
"""Seconds of the target that are shown to the network, at most."""


@renamed({"clean": "foot_lock"})
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
    temperature: float = TEMPERATURE,
    root: bool = True,
    foot_lock: bool = True,
    progress: Progress | None = None,
) -> list[Motion]:
    """``count`` motions that begin with the past, bit for bit, and go on for ``seconds``; future i from (seed, i).

    past: of one person, two frames or more, on any humanoid skeleton (`motionloom.retarget`) and at any rate; the last
    ``predictor.observed`` / ``predictor.fps`` seconds are seen. hold: parts whose future is given. steps: network calls
    per window. guidance: how strictly the past and what is held are heeded, 1 as learned. temperature: above 1 the
    futures are livelier and more various. root: predict the way through the world too; False: the person stays in
    place, as published (Chen et al. 2023). foot_lock: keep planted feet still. Longer than a window the future
    goes on from itself. Raises `MotionloomError` for what cannot be asked.
    """
    _check(
        predictor, past, seconds, count,
        seed=seed, steps=steps, guidance=guidance, temperature=temperature, longest=WHOLE,
    )  # fmt: skip
    parts = given(predictor, past, hold, seconds)
    windows = windows_for(predictor, _frames(past, seconds) / past.fps)
    drawn: list[list[Array]] = [[] for _ in range(count)]
    person = person_of(predictor, past)
    seen = np.broadcast_to(person, (count, *person.shape))
    pen = Pen(predictor, steps, guidance, temperature, root)
    for number, window in enumerate(
        pen.windows(seen, [(seed, i) for i in range(count)], parts and parts.known, windows)
    ):
        for row, places in zip(drawn, window, strict=True):
            row.append(places)
        if progress:
            progress(number + 1, windows)
    return [
        concatenated(past, *_dressed(predictor, past, row, _frames(past, seconds), hold=parts, foot_lock=foot_lock))
        for row in drawn
    ]


@renamed({"clean": "foot_lock"})
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
    temperature: float = TEMPERATURE,
    root: bool = True,
    foot_lock: bool = True,
) -> Iterator[Motion]:
    """Future ``number`` of `predict`, any length in constant memory: the past, then consecutive pieces behind it."""
    _check(
        predictor, past, seconds, 1,
        seed=seed, steps=steps, guidance=guidance, temperature=temperature, longest=LONGEST,
    )  # fmt: skip
    parts = given(predictor, past, hold, seconds)
    pen = Pen(predictor, steps, guidance, temperature, root)
    total = _frames(past, seconds)
    windows = pen.windows(
        person_of(predictor, past)[None], [(seed, number)], parts and parts.known,
        windows_for(predictor, total / past.fps),
    )  # fmt: skip
    yield past
    yield from _dressed(predictor, past, (window[0] for window in windows), total, hold=parts, foot_lock=foot_lock)


@renamed({"clean": "foot_lock"})
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
    temperature: float = TEMPERATURE,
    foot_lock: bool = True,
) -> list[Motion]:
    """``count`` motions: the past, ``seconds`` in between, and the target from its first frame on.

    past and target: of one skeleton and rate. The past stays bit for bit; the target is put where the drawn person
    arrives, moved along the ground and, with ``turned``, turned to face where the past ends, and is otherwise as it
    is. Raises `MotionloomError`. ("Motion switch", Chen et al. 2023, section 4.5; there the target is approached only.)
    """
    _check(
        predictor, past, seconds, count,
        seed=seed, steps=steps, guidance=guidance, temperature=temperature, longest=WHOLE,
    )  # fmt: skip
    check_like(past, target, "target")
    if facing not in ("turned", "kept"):
        raise MotionloomError(f"facing is 'turned' or 'kept'; got {facing!r}")
    if len(target) < 2:
        raise MotionloomError(f"the target has {len(target)} frame; at least 2 are needed to arrive at it")
    gap = _frames(past, seconds)
    near = int(ARRIVAL * (predictor.frames - predictor.observed) / predictor.fps * past.fps)
    free = max(gap - max(near, 1), 0)
    begun = [past] * count
    if free:
        begun = predict(
            predictor, past, count=count, seconds=free / past.fps, seed=seed,
            steps=steps, guidance=guidance, temperature=temperature, foot_lock=foot_lock,
        )  # fmt: skip
    pen = Pen(predictor, steps, guidance, temperature, True)
    return [
        _arriving(pen, one, target, gap - free, seed=(seed, i), facing=facing, foot_lock=foot_lock)
        for i, one in enumerate(begun)
    ]


def _arriving(
    pen: Pen, past: Motion, target: Motion, gap: int, *, seed: tuple[int, int], facing: str, foot_lock: bool
) -> Motion:
    predictor, fps = pen.predictor, past.fps
    rate = predictor.fps / fps
    person, arrival = person_of(predictor, past), (gap + 1) * rate
    room = predictor.frames - len(person)
    told = max(min(TARGET * predictor.fps, (len(target) - 1) * rate), 2.0)  # two places of the grid tell a velocity
    last = min(room, int(arrival + told))
    at = np.arange(1, last + 1)
    goal = to_smpl22(target.frames(0, min(len(target), round(CONTEXT * fps) + 2))).positions()
    turn = 0.0
    if facing == "turned":
        turn = float(SMPL_LAYOUT.place(person[-1]).facing - SMPL_LAYOUT.place(goal[0]).facing)
    goal = rot.rotate(rot.rotvec_to_quat(np.array([0.0, turn, 0.0])), positions_at(goal, (at - arrival) / rate))
    mask = np.repeat((at >= arrival)[:, None], predictor.layout.parts, axis=1).astype(np.float32)
    mask[:, 0] = 0  # where it arrives is free
    places = pen.window(person[None], [seed], 2**20, Known(goal, mask), frames=last)[0]
    tail = past.frames(max(len(past) - seen_frames(predictor, past), 0), len(past))
    shown = min(len(target), int((last - arrival) / rate) + 1)
    pads = concatenated(tail, *[tail.frames(len(tail) - 1, len(tail))] * (gap + shown))
    grid = np.concatenate([person, places])
    times = (np.arange(len(pads)) - (len(tail) - 1)) * rate + len(person) - 1
    made = apply_positions(positions_at(grid, times), pads, foot_lock=foot_lock, known=len(tail))
    first = len(tail) + gap
    begin, to = standing(target, 0)[0], standing(made, first)[0]
    moved = carried_level(target, rot.rotvec_to_quat(np.array([0.0, turn, 0.0])), begin, to)
    window = concatenated(tail, pads.frames(len(tail), first), moved.frames(0, shown))
    nothing = kept_parts(past.skeleton, frozenset(), np.zeros(3, dtype=bool))
    spliced = splice(window, made, len(tail), last=first, kept=nothing)
    return concatenated(past, spliced.frames(len(tail), first), moved)


# Onto the past's skeleton


def _frames(past: Motion, seconds: float) -> int:
    """Frames that are asked, at the past's rate."""
    return max(round(seconds * past.fps), 1)


def _dressed(
    predictor: Predictor, past: Motion, windows: Iterable[Array], total: int,
    *, hold: Given | None, foot_lock: bool,
) -> Iterator[Motion]:  # fmt: skip
    """``total`` frames behind the past, in pieces of about `CHUNK` seconds; ``windows`` (frames, 22, 3) are read as
    needed."""
    rate = predictor.fps / past.fps
    nothing = kept_parts(past.skeleton, frozenset(), np.zeros(3, dtype=bool))
    tail = past.frames(max(len(past) - seen_frames(predictor, past), 0), len(past))
    grid, done = person_of(predictor, past), 0
    zero = len(grid) - 1  # the grid's index of the past's last frame
    for places in windows:
        grid = np.concatenate([grid, places])
        ready = min(int((len(grid) - 1 - zero) / rate + 1e-6), total)
        if ready < total and ready - done < CHUNK * past.fps:
            continue
        last = tail.frames(len(tail) - 1, len(tail))
        old = concatenated(tail, *[last] * (ready - done))
        at = (done + np.arange(len(old)) - (len(tail) - 1)) * rate + zero
        made = apply_positions(positions_at(grid, at), old, foot_lock=foot_lock, known=len(tail))
        new = splice(old, made, len(tail), last=len(old), kept=nothing).frames(len(tail), len(old))
        new = hold.laid_over(new, done) if hold else new
        yield new
        done = ready
        tail = concatenated(tail, new)
        tail = tail.frames(max(len(tail) - seen_frames(predictor, past), 0), len(tail))
        drop = max(int(done * rate + zero) - 2 * predictor.observed, 0)
        grid, zero = grid[drop:], zero - drop
        if done == total:
            return


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
    temperature: float,
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
    if count * seconds > MOST:
        raise MotionloomError(
            f"{count} futures of {seconds:g} s are too much at once; ask for at most {MOST:g} s together"
        )
    if not 1 <= count <= 1000 or not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"the count must be 1 to 1000 and the seed 0 to below 2**62; got {count} and {seed}")
    if not isinstance(steps, int) or not 1 <= steps <= predictor.schedule.steps:
        raise MotionloomError(f"{steps} steps cannot be taken; these weights take 1 to {predictor.schedule.steps}")
    if not np.isfinite(guidance) or abs(guidance) > 100:
        raise MotionloomError(f"a guidance of {guidance:g} makes no motion; usual values are 1 to 3")
    if not 0 <= temperature <= 2:
        raise MotionloomError(f"the temperature is 0 to 2, usually about 1; got {temperature:g}")
