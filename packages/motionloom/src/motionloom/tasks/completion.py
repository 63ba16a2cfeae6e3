"""Completing windows of motion of which something is known: the past, an end, some joints (`Predictor`).

The published way (`lab.papers.humanmac`) mixes the known frames into the noisy state and stops one level short of
clean. Here what is known is a condition of the network, sampling ends clean, and what is known is written back exactly;
the rest meets it so that neither place nor velocity jumps, and bones keep the lengths of the past.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.blending import quintic_decay
from motionloom.diffusion import SOLVERS, Denoiser, guide, row_noise, row_seed, sample
from motionloom.diffusion.sampling import Snapshot
from motionloom.edits.boundary import match_boundary
from motionloom.errors import MotionloomError
from motionloom.features.positions import SMPL_LAYOUT, Place, bone_lengths, with_bones
from motionloom.requests.sampling import PredictionSampling, PredictionSettings
from motionloom.tasks.best import candidate_seeds, index_of_smallest, liveliness_ranks
from motionloom.tasks.watching import View
from motionloom.weights.predictor import Predictor

Array = NDArray[np.float64]

STEPS, SOLVER, SPACING = PredictionSampling.steps, PredictionSampling.solver, PredictionSampling.spacing
FUTURES = 10
"""Futures unless ``count`` is set."""
EASE = 0.4
"""Seconds over which unknown frames go over from what is known to the network's own course."""
BATCH = 512
"""Rows in one network call."""


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of the frames to come."""

    positions: Array
    """(frames, joints, 3) or (rows, frames, joints, 3) metres in the world; read where ``mask`` is above 0."""
    mask: NDArray[np.float32]
    """(frames, parts) 1 where a joint is known, see `Layout.part`; numbers between mix."""


def complete(
    predictor: Predictor,
    features: np.ndarray,
    mask: np.ndarray,
    pose: np.ndarray,
    *,
    seeds: Sequence[int],
    sampling: PredictionSampling | None = None,
    poses: Callable[[np.ndarray], Array] | None = None,
    **settings: Unpack[PredictionSettings],
) -> np.ndarray:
    """Windows (rows, frames, channels) with what is not known sampled; row i from ``seeds[i]``, alone or in a batch.

    ``features`` are read where ``mask`` (rows, frames, parts) is above 0; ``pose`` (rows, channels) is the last
    observed one. Known numbers are returned as they are, and the others leave them without a jump. ``sampling``, or
    single settings of it as keywords: a guidance above 1 exaggerates the condition, below 1 heeds it less; it needs a
    second pass. ``poses``: such windows as (rows, people, frames, 22, 3) metres, for who is `watching`; None: nobody
    can.
    """
    chosen = PredictionSampling.of(sampling, settings)
    condition = predictor.condition(features, mask, pose)
    way = chosen.levels(predictor.schedule)
    if chosen.best_of > 1:
        seeds = _best_seeds(predictor, condition, pose, seeds=seeds, sampling=chosen, way=way)
    state, walk = _start_sampling(predictor, condition, seeds, chosen, way)
    if poses is not None:
        view = View(lambda states: poses(predictor.to_features(states, pose)))
        walk = view.report_walk(walk, len(way) - 1, range(len(condition)))
    for snapshot in walk:
        state = snapshot.state
    return join_known(predictor.to_features(state, pose), features, mask, ease=max(round(EASE * predictor.fps), 1))


def _start_sampling(
    predictor: Predictor,
    condition: np.ndarray,
    seeds: Sequence[int],
    sampling: PredictionSampling,
    way: Sequence[int],
) -> tuple[np.ndarray, Iterator[Snapshot]]:
    """The noise that windows begin with, and the walk from there."""
    noise = row_noise(seeds)
    state = sampling.temperature * noise(np.empty((len(condition), *predictor.mean.shape), np.float32))
    how = {"solver": SOLVERS[sampling.solver], "schedule": predictor.schedule, "noise": noise}
    return state, sample(_guided_denoiser(predictor, condition, sampling.guidance), state, levels=way, **how)


def _guided_denoiser(predictor: Predictor, condition: np.ndarray, guidance: float) -> Denoiser:
    yes, no = (np.full(len(condition), flag) for flag in (True, False))

    def net(x: np.ndarray, level: int, cond: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        return predictor.denoiser(*cond)(x, level)

    return guide(net, (condition, yes), (condition, no), guidance)


def _best_seeds(
    predictor: Predictor,
    condition: np.ndarray,
    pose: np.ndarray,
    *,
    seeds: Sequence[int],
    sampling: PredictionSampling,
    way: Sequence[int],
) -> list[int]:
    """For each window the best of several seeds: half way whole, moving, and then nearest to the mean of them all."""
    count = sampling.best_of
    tried = [candidate_seeds(seed, count) for seed in seeds]
    several = [seed for one in tried for seed in one]
    state, walk = _start_sampling(
        predictor, condition.repeat(count, axis=0), several, sampling, way[: len(way) // 2 + 1]
    )
    for snapshot in walk:
        state = snapshot.clean
    features, layout = predictor.to_features(state, pose.repeat(count, axis=0)), predictor.layout
    chosen = []
    for own, candidates in zip(features.reshape(len(seeds), count, *features.shape[1:]), tried, strict=True):
        away = ((own - own.mean(axis=0)) ** 2).mean(axis=(1, 2))
        person = layout.names == SMPL_LAYOUT.names
        before = liveliness_ranks(layout.decode(own, Place(np.zeros(3), np.zeros(())))) if person else [()] * count
        chosen.append(
            candidates[index_of_smallest([(*rank, float(far)) for rank, far in zip(before, away, strict=True)])]
        )
    return chosen


def join_known(sampled: np.ndarray, known: np.ndarray, mask: np.ndarray, *, ease: int) -> np.ndarray:
    """``known`` where ``mask`` is 1, else ``sampled`` matched to it: (rows, frames, channels), mask one per 3 of
    them.

    What ``sampled`` lacks at a border, in value and in change per frame, fades over ``ease`` frames as the quintic that
    leaves their second derivative alone, or over the whole gap between two borders where that is shorter. Rows whose
    masks are equal are done at once.
    """
    each = mask.astype(sampled.dtype).repeat(3, axis=-1)
    result = (1 - each) * sampled + each * known
    sure = mask >= 1
    patterns, rows = np.unique(sure.reshape(len(sure), -1), axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns.reshape(-1, *sure.shape[1:])):
        chosen = np.flatnonzero(rows.reshape(-1) == number)
        result[chosen] += _matching(sampled[chosen], known[chosen], pattern, ease) * (1 - each[chosen])
    return result


def _matching(sampled: np.ndarray, known: np.ndarray, sure: NDArray[np.bool_], ease: int) -> np.ndarray:
    """What to add to ``sampled`` (rows, frames, channels) for one mask (frames, parts)."""
    added, lack = np.zeros_like(sampled), known - sampled
    courses, parts = np.unique(sure.T, axis=0, return_inverse=True)
    for number, course in enumerate(courses):
        joints = np.flatnonzero(parts.reshape(-1) == number)
        channels = (3 * joints[:, None] + np.arange(3)).ravel()
        for border, step, room in _borders(course, ease):
            here = lack[:, border][:, channels]
            behind = border - step
            slope = here - lack[:, behind][:, channels] if 0 <= behind < len(course) and course[behind] else 0 * here
            frames = border + step * np.arange(1, room + 1)
            fading = match_boundary(here, slope, room, decay=quintic_decay).swapaxes(0, 1)
            added[:, frames[:, None], channels] += fading
    return added


def _borders(course: NDArray[np.bool_], ease: int) -> list[tuple[int, int, int]]:
    """Last known frame, direction of the unknown ones, and how many of them have room to be changed."""
    edges = np.flatnonzero(np.diff(course.astype(int))).tolist()
    ends = [-1, *edges, len(course) - 1]
    return [
        (edge, 1, min(ease, behind - edge)) if course[edge] else (edge + 1, -1, min(ease, edge - before))
        for before, edge, behind in zip(ends, edges, ends[2:])
    ]


def next_frames(
    predictor: Predictor,
    past: np.ndarray,
    *,
    seeds: Sequence[int],
    known: Known | None = None,
    frames: int | None = None,
    exact: bool = True,
    sampling: PredictionSampling | None = None,
    **settings: Unpack[PredictionSettings],
) -> Array:
    """(rows, frames, joints, 3) metres: what comes behind pasts (rows, h, joints, 3) in the world, +Y up.

    h is 2 to ``predictor.observed``. ``frames``: how many, at most (and by default) as many as the window has left
    behind the frames it usually sees. ``exact``: bones as long as the past's; else what the network predicts.
    """
    past = np.asarray(past, dtype=np.float64)
    frames = predictor.frames - predictor.observed if frames is None else frames
    _check(predictor, past, frames, known)
    rows, h = past.shape[:2]
    layout, place = predictor.layout, predictor.layout.place(past[:, -1])
    observed = np.zeros((rows, predictor.frames, layout.channels))
    mask = np.zeros((predictor.frames, layout.parts), dtype=np.float32)
    observed[:, :h], mask[:h] = layout.encode(past, place), 1
    if known is not None:
        positions = np.broadcast_to(known.positions, (rows, *known.positions.shape[-3:]))
        count = min(positions.shape[1], predictor.frames - h)
        observed[:, h : h + count], mask[h : h + count] = (
            layout.encode(positions[:, :count], place),
            known.mask[:count],
        )
    features, masks = observed.astype(np.float32), np.broadcast_to(mask, (rows, *mask.shape))

    def placed(windows: np.ndarray) -> Array:
        return layout.decode(windows[:, h : h + frames], place)

    completed = complete(
        predictor,
        features,
        masks,
        features[:, h - 1],
        seeds=seeds,
        sampling=PredictionSampling.of(sampling, settings),
        poses=lambda windows: placed(windows)[:, None],
    )
    places = placed(completed)
    return with_bones(places, layout.parents, bone_lengths(past, layout.parents)) if exact else places


def _check(predictor: Predictor, past: Array, frames: int, known: Known | None) -> None:
    layout = predictor.layout
    if past.ndim != 4 or not len(past) or past.shape[2:] != (layout.joints, 3) or not np.isfinite(past).all():
        raise MotionloomError(
            f"a past for this predictor is finite places (rows, frames, {layout.joints}, 3); got shape {past.shape}"
        )
    h = past.shape[1]
    if not 2 <= h <= predictor.observed or not 1 <= frames <= predictor.frames - h:
        raise MotionloomError(
            f"this predictor sees 2 to {predictor.observed} frames and samples, with them, at most {predictor.frames}; "
            f"got a past of {h} and {frames} frames to sample"
        )
    if known is None:
        return
    shape, mask = known.positions.shape, known.mask.shape
    if (
        mask[1:] != (layout.parts,)
        or shape[-3:] != (*mask[:1], layout.joints, 3)
        or shape[:-3] not in ((), (len(past),))
    ):
        raise MotionloomError(
            f"what is known to this predictor are places (frames, {layout.joints}, 3) and a mask (frames, "
            f"{layout.parts}); got {shape} and {mask}"
        )


def futures(
    predictor: Predictor,
    past: np.ndarray,
    *,
    frames: int | None = None,
    exact: bool = True,
    sampling: PredictionSampling | None = None,
    **settings: Unpack[PredictionSettings],
) -> Array:
    """(windows, count, frames, joints, 3): futures of each past (windows, h, joints, 3); see `next_frames`.

    sampling, or single settings of it as keywords: ``count`` futures of each past; future i is sampled from
    ``row_seed(seed, i)`` whatever the other arguments are.
    """
    chosen, many = PredictionSampling.of(sampling, settings), np.asarray(past)
    count, rows = chosen.number(FUTURES), chosen.batch(BATCH)
    if not len(many):
        raise MotionloomError("at least one past is needed to predict from; got none")
    many = np.repeat(many, count, axis=0)
    [seed] = chosen.seeds(1)
    seeds = [row_seed(seed, i) for _ in range(len(past)) for i in range(count)]
    parts = [
        next_frames(
            predictor,
            many[first : first + rows],
            seeds=seeds[first : first + rows],
            frames=frames,
            exact=exact,
            sampling=chosen,
        )
        for first in range(0, len(many), rows)
    ]
    sampled = np.concatenate(parts)
    return sampled.reshape(len(past), count, *sampled.shape[1:])
