"""Completing windows of motion of which something is known: the past, an end, some joints (`Predictor`).

The published way (`core.methods.humanmac`) mixes the known frames into the noisy state and stops one level short of
clean. Here what is known is a condition of the network, sampling ends clean, and what is known is written back exactly;
the rest meets it so that neither place nor velocity jumps, and bones keep the lengths of the past.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import quintic_decay, smoothstep
from motionloom.core.body.feet import envelope
from motionloom.core.diffusion import SOLVERS, Constraint, NoiseSource, guide, observe, row_noise, row_seed, sample
from motionloom.core.diffusion.sampling import Snapshot
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT, Layout, Place, with_bones
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import Motion
from motionloom.edits.boundary import match_boundary
from motionloom.requests.sampling import PredictionSampling, PredictionSettings
from motionloom.tasks.best import Rank, candidate_seeds, index_of_smallest, liveliness_ranks
from motionloom.tasks.splice import person_at
from motionloom.tasks.watching import View

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

    def check(self, layout: Layout, rows: int) -> None:
        """Raise MotionloomError for what is not of this layout, or of another number of rows."""
        shape, mask = self.positions.shape, self.mask.shape
        places = (*mask[:1], layout.joints, 3)
        if mask[1:] != (layout.parts,) or shape not in (places, (rows, *places)):
            raise MotionloomError(
                f"what is known to this predictor are places (frames, {layout.joints}, 3) and a mask (frames, "
                f"{layout.parts}); got {shape} and {mask}"
            )


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
    second pass. The condition of the published variant knows the first frames only: what else is known is mixed into
    the state after every step (DCT-Completion; Chen et al. 2023, section 4.5). ``poses``: such windows as (rows,
    people, frames, 22, 3) metres, for who is `watching`; None: nobody can.
    """
    chosen = PredictionSampling.of(sampling, settings)
    seen = _leading(mask) if predictor.variant == "published" else mask
    each = mask.astype(features.dtype).repeat(3, axis=-1)
    filled = each * features + (1 - each) * pose[:, None]
    held = None if np.array_equal(seen, mask) else (predictor.to_state(filled, pose), mask)
    windows = _Windows(predictor, predictor.condition(features, seen, pose), pose, chosen, held)
    way = chosen.levels(predictor.schedule)
    if chosen.best_of > 1:
        seeds = windows.best_seeds(seeds, way[: len(way) // 2 + 1])
    walk = windows.walk(seeds, way)
    if poses is not None:
        view = View(lambda states: poses(predictor.to_features(states, pose)))
        walk = view.report_walk(walk, len(way) - 1, range(len(pose)))
    [last] = deque(walk, maxlen=1)
    return join_known(predictor.to_features(last.state, pose), features, mask, ease=max(round(EASE * predictor.fps), 1))


@dataclass(frozen=True, eq=False)
class _Windows:
    """Windows of one condition each, and how they are sampled."""

    predictor: Predictor
    condition: np.ndarray
    pose: np.ndarray
    sampling: PredictionSampling
    held: tuple[np.ndarray, np.ndarray] | None = None
    """A state and where in time (rows, frames, parts) it is known, where the condition does not say it."""

    def walk(self, seeds: Sequence[int], levels: Sequence[int]) -> Iterator[Snapshot]:
        """From noise, one seed to a window, through the levels."""
        noise, conditioned = row_noise(seeds), np.ones(len(seeds), np.bool_)
        state = noise(np.empty((len(seeds), *self.predictor.mean.shape), np.float32))

        def net(x: np.ndarray, level: int, cond: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
            return self.predictor.denoiser(*cond)(x, level)

        return sample(
            guide(net, (self.condition, conditioned), (self.condition, ~conditioned), self.sampling.guidance),
            self.sampling.temperature * state,
            levels=levels,
            solver=SOLVERS[self.sampling.solver],
            schedule=self.predictor.schedule,
            noise=noise,
            constrain=self.constraint(noise),
        )

    def constraint(self, noise: NoiseSource) -> Constraint | None:
        """What mixes the known into a state, in time; None where the condition says all of it."""
        if self.held is None:
            return None
        known, mask = self.held
        return observe(known, mask.repeat(3, axis=-1), self.predictor.schedule, noise, basis=self.predictor.basis)

    def best_seeds(self, seeds: Sequence[int], levels: Sequence[int]) -> list[int]:
        """For each window the best of several: after these levels whole, moving, then nearest to the mean of all."""
        count, layout = self.sampling.best_of, self.predictor.layout
        condition, pose = (part.repeat(count, axis=0) for part in (self.condition, self.pose))
        tried = [candidate_seeds(seed, count) for seed in seeds]
        held = None if self.held is None else (self.held[0].repeat(count, axis=0), self.held[1].repeat(count, axis=0))
        several = replace(self, condition=condition, pose=pose, held=held)
        [last] = deque(several.walk([seed for one in tried for seed in one], levels), maxlen=1)
        features = self.predictor.to_features(last.clean, pose)
        chosen = []
        for own, candidates in zip(features.reshape(len(seeds), count, *features.shape[1:]), tried, strict=True):
            away = ((own - own.mean(axis=0)) ** 2).mean(axis=(1, 2)).tolist()
            ranks: Sequence[Rank] = [()] * count
            if layout.names == SMPL_LAYOUT.names:
                ranks = liveliness_ranks(layout.decode(own, Place(np.zeros(3), np.zeros(()))))
            chosen.append(candidates[index_of_smallest([(*rank, far) for rank, far in zip(ranks, away, strict=True)])])
        return chosen


def _leading(mask: np.ndarray) -> np.ndarray:
    """Of masks (rows, frames, parts) the first frames of which everything is known, and nothing behind them."""
    whole = np.cumprod((mask >= 1).all(axis=-1), axis=1)
    return mask * whole[..., None].astype(mask.dtype)


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
    past, layout = np.asarray(past, dtype=np.float64), predictor.layout
    if past.ndim != 4 or not len(past) or past.shape[2:] != (layout.joints, 3) or not np.isfinite(past).all():
        raise MotionloomError(
            f"a past for this predictor is finite places (rows, frames, {layout.joints}, 3); got shape {past.shape}"
        )
    frames = predictor.frames - predictor.observed if frames is None else frames
    rows, h = past.shape[:2]
    if not 2 <= h <= predictor.observed or not 1 <= frames <= predictor.frames - h:
        raise MotionloomError(
            f"this predictor sees 2 to {predictor.observed} frames and samples, with them, at most {predictor.frames}; "
            f"got a past of {h} and {frames} frames to sample"
        )
    place = layout.place(past[:, -1])
    features = np.zeros((rows, predictor.frames, layout.channels), np.float32)
    mask = np.zeros((predictor.frames, layout.parts), np.float32)
    features[:, :h], mask[:h] = layout.encode(past, place), 1
    if known is not None:
        known.check(layout, rows)
        end = h + min(known.positions.shape[-3], predictor.frames - h)
        positions = np.broadcast_to(known.positions, (rows, *known.positions.shape[-3:]))
        features[:, h:end] = layout.encode(positions[:, : end - h], place)
        mask[h:end] = known.mask[: end - h]

    def placed(windows: np.ndarray) -> Array:
        return layout.decode(windows[:, h : h + frames], place)

    completed = complete(
        predictor,
        features,
        np.broadcast_to(mask, (rows, *mask.shape)),
        features[:, h - 1],
        seeds=seeds,
        sampling=PredictionSampling.of(sampling, settings),
        poses=lambda windows: placed(windows)[:, None],
    )
    return with_bones(placed(completed), layout.parents, like=past) if exact else placed(completed)


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


# Window after window behind a past


CONTEXT = 3.0
"""Seconds of a clip that are looked at for where its floor is."""
TEMPERATURE_AFTER_FIRST = 1.08
"""How much livelier the windows behind the first begin: the network goes on from its own calm; docs/decisions/0015."""
MOST_SUNK, RISE = 0.02, 0.2
"""Metres under the floor that are left, and seconds in which people who would sink further are lifted."""
KnownFrames = Callable[[int, int], Known | None]
"""(first, last): what is known of the frames ``first`` to before ``last`` behind the past, 1 being the first."""


@dataclass(frozen=True, eq=False)
class Past:
    """The clip that futures go on from: retargeted to the uniform person once."""

    predictor: Predictor
    motion: Motion
    tail: Motion
    """Its last frames that lie within what the predictor sees, at least 2."""
    person: Array
    """(h, 22, 3) metres: the uniform person at the predictor's rate; the last frame is the clip's last frame."""
    rate: float
    """Frames of the predictor in one of the clip."""

    @staticmethod
    def of(predictor: Predictor, motion: Motion) -> "Past":
        """Raises MotionloomError for a clip of less than two frames."""
        if len(motion) < 2:
            raise MotionloomError(f"the past has {len(motion)} frame; at least 2 are needed to see how it moves")
        seconds = max(CONTEXT, predictor.observed / predictor.fps)
        context = motion.frames(max(len(motion) - round(seconds * motion.fps) - 2, 0), len(motion))
        whole = int((len(motion) - 1) / motion.fps * predictor.fps + 1e-6) + 1
        back = np.arange(min(max(whole, 2), predictor.observed))[::-1] / predictor.fps * motion.fps
        person = person_at(context, len(context) - 1 - back)
        observed = max(int(back[0] + 1e-6) + 1, 2)
        tail = motion.frames(max(len(motion) - observed, 0), len(motion))
        return Past(predictor, motion, tail, person, predictor.fps / motion.fps)


@dataclass(frozen=True)
class WindowSampler:
    """What samples windows, and how."""

    predictor: Predictor
    sampling: PredictionSampling
    root: bool = True
    """False: the person stays in place, but rises and sinks."""

    def windows(
        self, person: Array, seeds: Sequence[tuple[int, int]], known_frames: KnownFrames | None, count: int
    ) -> Iterator[Array]:
        """(rows, frames, 22, 3) one after the other behind ``person`` (rows, h, 22, 3)."""
        frames = self.predictor.frames - self.predictor.observed
        for number in range(count):
            first = number * frames + 1
            known = known_frames(first, first + self.predictor.frames - person.shape[1]) if known_frames else None
            window = self.window(person, seeds, number, known, livelier=TEMPERATURE_AFTER_FIRST if number else 1.0)
            yield window
            person = np.concatenate([person, window], axis=1)[:, -self.predictor.observed :]

    def window(
        self,
        person: Array,
        seeds: Sequence[tuple[int, int]],
        number: int,
        known: Known | None,
        *,
        frames: int | None = None,
        livelier: float = 1.0,
    ) -> Array:
        """(rows, frames, 22, 3): window ``number`` behind ``person`` (rows, h, 22, 3)."""
        positions = next_frames(
            self.predictor,
            person,
            seeds=[row_seed(*seed, number) for seed in seeds],
            known=known,
            frames=frames,
            sampling=replace(self.sampling, temperature=min(self.sampling.temperature * livelier, 2.0)),
        )
        if not self.predictor.layout.root:
            return positions  # the root stays, so that there is no floor to stand on
        lowest = np.minimum(person[:, -1, :, 1].min(axis=-1), -MOST_SUNK)  # who is lower already stays there
        under = (lowest[:, None] - positions[..., 1].min(axis=-1)).clip(0)
        ease = max(round(RISE * self.predictor.fps), 1)
        lift = envelope(under, ease // 2) * _ramp(positions.shape[1], 2 * ease)
        positions = positions + lift[..., None, None] * [0, 1, 0]
        return positions if self.root else positions + (person[:, -1:, :1] - positions[:, :, :1]) * [1, 0, 1]


def _ramp(frames: int, ease: int) -> Array:
    """(frames,) from 0 behind the past to 1 within ``ease`` frames."""
    return smoothstep(np.arange(1, frames + 1) / ease)


def window_count(predictor: Predictor, seconds: float) -> int:
    """How many windows it takes."""
    return int(np.ceil(seconds * predictor.fps / (predictor.frames - predictor.observed) - 1e-6))
