"""The windows that predictions are made of: the uniform person at a predictor's rate, and what samples its future."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.blending import smoothstep
from motionloom.diffusion import row_seed
from motionloom.errors import MotionloomError
from motionloom.kinematics.feet import envelope
from motionloom.motion import Motion
from motionloom.requests.sampling import PredictionSampling
from motionloom.tasks.completion import Known, next_frames
from motionloom.tasks.splice import person_at
from motionloom.weights.predictor import Predictor

Array = NDArray[np.float64]

CONTEXT = 3.0
"""Seconds of a clip that are looked at for where its floor is."""
TEMPERATURE_AFTER_FIRST = 1.08
"""How much livelier the windows behind the first begin: the network goes on from its own calm; docs/decisions/0015."""
MOST_SUNK, EASE = 0.02, 0.2
"""Metres under the floor that are left, and seconds in which people who would sink further are lifted."""
KnownFrames = Callable[[int, int], Known | None]
"""(first, last): what is known of the frames ``first`` to before ``last`` behind the past, 1 being the first."""


@dataclass(frozen=True, eq=False)
class Past:
    """The clip that futures go on from: retargeted to the uniform person once."""

    motion: Motion
    tail: Motion
    """Its last frames that lie within what the predictor sees, at least 2."""
    person: Array
    """(h, 22, 3) metres: the uniform person at the predictor's rate; the last frame is the clip's last frame."""
    rate: float
    """Frames of the predictor in one of the clip."""
    observed: int
    """Frames that the predictor sees at most."""

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
        return Past(motion, tail, person, predictor.fps / motion.fps, predictor.observed)


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
        lowest = np.minimum(person[:, -1, :, 1].min(axis=-1), -MOST_SUNK)  # who is lower already stays there
        under = (lowest[:, None] - positions[..., 1].min(axis=-1)).clip(0)
        ease = max(round(EASE * self.predictor.fps), 1)
        lift = envelope(under, ease // 2) * smoothstep(np.arange(1, positions.shape[1] + 1) / (2 * ease))
        positions = positions + lift[..., None, None] * [0, 1, 0]
        return positions if self.root else positions + (person[:, -1:, :1] - positions[:, :, :1]) * [1, 0, 1]


def window_count(predictor: Predictor, seconds: float) -> int:
    """How many windows it takes."""
    return int(np.ceil(seconds * predictor.fps / (predictor.frames - predictor.observed) - 1e-6))
