"""HumanMAC as published (Chen et al. 2023, algorithm 2; LinghaoChan/HumanMAC): DCT-Completion, its masks, its coins.

What we do better is in `tasks.completion`; this is the yardstick, faults of the published sampler included:

* It stops where the published count of levels has its 0, which is level 1 here: some noise is left.
* Observed frames are mixed in after every step, low-passed, and not restored at the end.
* The known part gets new noise in every step; with part control all samples share that noise.

Windows are (rows, frames, channels) metres, states (rows, kept, channels) coefficients of `diffusion.Dct`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion import (
    Basis,
    Constraint,
    Ddim,
    Denoiser,
    NoiseSource,
    Schedule,
    State,
    mix,
    row_noise,
    row_seed,
    run,
)
from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import Predictor

Padding = Literal["last", "zero", "repeat"]
Way = Callable[[np.ndarray], np.ndarray]

PARTS = {
    "right_leg": (0, 3),
    "left_leg": (3, 6),
    "torso": (6, 10),
    "left_arm": (10, 13),
    "right_arm": (13, 16),
    "lower": (0, 6),
    "upper": (6, 16),
}
"""Joints [first, end) of the 16 predicted joints of Human3.6M, for part control (`fix_0` to `fix_6` in this order)."""


def published_levels(schedule: Schedule, steps: int) -> list[int]:
    """The walk of the published sampler in this project's levels: times 1 + i T / steps, after them 0, each one higher.

    1, 11, ... 991 -> 0, 1, ... 981 for 100 steps of 1000. Published code needs T divisible by the steps; here times
    are rounded down. Raises MotionloomError unless 1 <= steps < T.
    """
    if not 1 <= steps < schedule.steps:
        raise MotionloomError(f"of {schedule.steps} levels 1 to {schedule.steps - 1} steps can be made, not {steps}")
    return [2 + i * schedule.steps // steps for i in reversed(range(steps))] + [1]


def padded(observed: np.ndarray, frames: int, padding: Padding = "last") -> np.ndarray:
    """Observed frames (rows, h, channels) and what replaces the others, (rows, ``frames``, channels).

    "last": the last observed frame (the paper's). "zero": zeros; published code also destroyed the last observed frame
    in the caller's tensor, which this does not. "repeat": the observation again and again.
    """
    rows, h, channels = observed.shape
    if not 1 <= h <= frames or (padding == "repeat" and frames % h):
        raise MotionloomError(f"{h} observed frames cannot be padded to {frames} with {padding!r}")
    if padding == "repeat":
        return np.tile(observed, (1, frames // h, 1))
    tail = observed[:, -1:] if padding == "last" else np.zeros((rows, 1, channels), observed.dtype)
    return np.concatenate([observed, np.repeat(tail, frames - h, axis=1)], axis=1)


@dataclass(frozen=True, eq=False)
class Fixed:
    """Part control: joints that are known in all frames, a contiguous range of the predicted ones as published."""

    signal: np.ndarray
    """(1, frames, channels)."""
    joints: tuple[int, int]
    """[first, end), such as one of `PARTS`."""


@dataclass(frozen=True, eq=False)
class SwitchTarget:
    """Motion switch: the end of the window is to approach this motion (rows or 1, m, channels)."""

    motion: np.ndarray
    relax: float | int = 0.2
    """The share of the steps, at the end, in which it is not imposed; an int counts steps (20 as published)."""


class Options(TypedDict, total=False):
    """Options of `published_completion`."""

    steps: int
    """Of the sampler; 100 as published."""
    padding: Padding
    """What replaces frames that were not observed; "last" as published."""
    fixed: Fixed | None
    target: SwitchTarget | None
    complete: bool
    """False leaves the observation to the condition alone."""


def published_completion(
    denoise: Denoiser,
    observed: np.ndarray,
    rows: int,
    *,
    basis: Basis,
    schedule: Schedule,
    noise: NoiseSource,
    **options: Unpack[Options],
) -> tuple[State, np.ndarray]:
    """DCT-Completion.

    Args:
        denoise: bound to its condition, the spectrum of `padded`.
        observed: (rows or 1, h, channels) metres; with 1 (part control as published) all rows share known signal and
            noise.
        rows: how many are sampled.
        basis: the cosines.
        schedule: of the noise.
        noise: for the start, then in every step for the observation and for the target.
        options: see `Options`.

    Returns:
        States (rows, kept, channels) and their windows (rows, frames, channels).
    """
    steps, padding = options.get("steps", 100), options.get("padding", "last")
    fixed, target = options.get("fixed"), options.get("target")
    walk = published_levels(schedule, steps)
    known = padded(observed, basis.frames, padding)
    mask = np.zeros(known.shape[1:], np.bool_)
    mask[: observed.shape[1]] = True
    if fixed is not None:
        own = np.zeros_like(mask)
        own[:, 3 * fixed.joints[0] : 3 * fixed.joints[1]] = True
        known, mask = np.where(own, fixed.signal, known), mask | own
    held = [Held(basis.to_spectrum(known), mask)] if options.get("complete", True) else []
    if target is not None:
        held.append(_approached(target, rows, walk, basis))
    start = noise(np.empty((rows, basis.kept, observed.shape[2]), observed.dtype))
    constrain = mixed_in_time(held, basis.to_time, basis.to_spectrum, schedule, noise)
    state = run(denoise, start, levels=walk, solver=Ddim(), schedule=schedule, noise=noise, constrain=constrain)
    return state, basis.to_time(state)


@dataclass(frozen=True, eq=False)
class Held:
    """Something known: a state, where in time it is (mask over (..., frames, channels)), and down to which level."""

    known: State
    mask: np.ndarray
    last: float = 0


def mixed_in_time(
    held: Sequence[Held], to_time: Way, to_state: Way, schedule: Schedule, noise: NoiseSource
) -> Constraint:
    """Everything known, noised, mixed into the state in time one after the other; then back into coefficients, once.

    With one thing known it is `observe(..., basis=)`. Two of those would drop frequencies in between, which the
    published switch does not.
    """

    def constrain(x: State, level: int) -> State:
        now = [one for one in held if level >= one.last]
        motion = to_time(x)
        for one in now:
            noised = schedule.noised(one.known, level, noise(one.known))
            motion = mix(motion, to_time(noised), one.mask)
        return to_state(motion) if now else x

    return constrain


def _approached(target: SwitchTarget, rows: int, walk: Sequence[int], basis: Basis) -> Held:
    """The target at the end of the window, imposed until the walk's last steps."""
    m, steps = target.motion.shape[1], len(walk) - 1
    if not 1 <= m <= basis.frames:
        raise MotionloomError(f"a target of {m} frames does not fit into a window of {basis.frames}")
    relaxed = target.relax if isinstance(target.relax, int) else round(target.relax * steps)
    before = np.repeat(target.motion[:, :1], basis.frames - m, axis=1)
    signal = np.concatenate([before, target.motion], axis=1)
    signal = np.broadcast_to(signal, (rows, *signal.shape[1:]))
    mask = np.arange(basis.frames)[:, None] >= basis.frames - m
    return Held(basis.to_spectrum(signal), mask, walk[steps - relaxed] if relaxed < steps else math.inf)


def conditioned_samples(count: int, share: float, *, coin: int | None = None) -> list[bool]:
    """Which of ``count`` samples know the observation: the first round(share * count).

    With ``coin`` (a seed) one coin per sample, as published, where a sample is one call for all windows.
    """
    if coin is None:
        return [i < round(share * count) for i in range(count)]
    return [bool(x <= share) for x in np.random.default_rng(coin).random(count)]


def published_futures(
    predictor: Predictor,
    past: np.ndarray,
    *,
    count: int,
    seed: int = 0,
    steps: int = 100,
    told_share: float = 1.0,
    coin: int | None = None,
    rows: int = 512,
) -> NDArray[np.float64]:
    """``count`` futures of every past (windows, observed, joints, 3), metres in the world, +Y up, by the recipe above.

    (windows, count, frames - observed, joints, 3). Any predictor; one of the variant `masked` takes the same walk with
    the same mixing, in its own coefficients. ``rows`` rows at a time; a row's noise comes from (seed, window, sample)
    and depends on no other row. Raises MotionloomError where the past is not as long as the predictor observes.
    """
    past = np.asarray(past, dtype=np.float64)
    shape = (predictor.observed, predictor.layout.joints, 3)
    if past.ndim != 4 or past.shape[1:] != shape or not np.isfinite(past).all():
        raise MotionloomError(f"pasts must be finite (windows, {', '.join(map(str, shape))}); got {past.shape}")
    if min(count, rows) < 1:
        raise MotionloomError(f"there must be at least one future and one row at a time, not {count} and {rows}")
    place = predictor.layout.place(past[:, -1])
    conditioned = np.array(conditioned_samples(count, told_share, coin=coin))
    observed = predictor.layout.encode(past, place).astype(np.float32)
    windows: list[np.ndarray] = []
    for first in range(0, len(past) * count, rows):
        index = np.arange(first, min(first + rows, len(past) * count))
        window, sample = index // count, index % count
        seeds = [row_seed(seed, w, i) for w, i in zip(window.tolist(), sample.tolist())]
        windows.append(_complete(predictor, observed[window], conditioned[sample], noise=row_noise(seeds), steps=steps))
    future = np.concatenate(windows)[:, predictor.observed :].astype(np.float64)
    future = future.reshape(len(past), count, *future.shape[1:])
    return np.stack([predictor.layout.decode(future[:, i], place) for i in range(count)], axis=1)


def _complete(
    predictor: Predictor, observed: np.ndarray, keep: np.ndarray, *, noise: NoiseSource, steps: int
) -> np.ndarray:
    """Windows (rows, frames, channels) after observed ones (rows, h, channels); ``keep`` (rows,): which see it."""
    rows, h, channels = observed.shape
    pose, schedule = observed[:, -1], predictor.schedule
    window = padded(observed, predictor.frames)
    mask = np.zeros((rows, predictor.frames, channels), np.float32)
    mask[:, :h] = 1
    known = predictor.to_state(window, pose)
    condition = predictor.condition(window, mask[..., ::3], pose) if bool(keep.any()) else None
    denoise = predictor.denoiser(condition, None if bool(keep.all()) else keep)
    constrain = mixed_in_time(
        [Held(known, mask > 0)],
        lambda x: predictor.to_features(x, pose),
        lambda x: predictor.to_state(x, pose),
        schedule,
        noise,
    )
    walk, start = published_levels(schedule, steps), noise(known)
    state = run(denoise, start, levels=walk, solver=Ddim(), schedule=schedule, noise=noise, constrain=constrain)
    return predictor.to_features(state, pose)
