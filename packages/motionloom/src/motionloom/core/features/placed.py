"""One person in the world, as a network sees motion: features, and where the first of them begins."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT, WIDTH
from motionloom.core.ground import GroundPose
from motionloom.core.motion import ground_pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlacedMotion:
    """Features say how somebody moves, relative to the first of their frames; this says where that frame is."""

    features: np.ndarray
    """(frames, 263), not standardised; there may be no frames."""
    begin: GroundPose

    @staticmethod
    def of(positions: Array) -> "PlacedMotion":
        """Of places (frames + 1, 22, 3) metres of the uniform person at 20 fps, +Y up."""
        begin = ground_pose(positions[0])
        return PlacedMotion(humanml.encode(begin.from_world(positions)), begin)

    @staticmethod
    def nothing() -> "PlacedMotion":
        """No frames, at the origin facing +Z."""
        return PlacedMotion(np.zeros((0, WIDTH), np.float32), GroundPose())

    def __len__(self) -> int:
        return len(self.features)

    @cached_property
    def _world(self) -> tuple[Array, Array]:
        """Places (frames + 1, 22, 3) and facing (frames + 1,); the root of the last one is where the features end."""
        features = self.features.astype(np.float64)
        places = humanml.decode_positions(np.concatenate([features, features[-1:]]))
        turns = np.concatenate([[0.0], np.cumsum(features[:, 0])])
        return self.begin.to_world(places), self.begin.facing - 2 * turns

    @property
    def positions(self) -> Array:
        """(frames, 22, 3) metres in the world."""
        return self._world[0][:-1]

    @property
    def contacts(self) -> Array:
        """(frames, 4) as in the features."""
        return self.features[:, LAYOUT["contacts"]].astype(np.float64)

    def at(self, frame: int) -> GroundPose:
        """Where the person is in a frame, or one frame behind the last."""
        if not len(self):
            return self.begin
        places, facing = self._world
        return GroundPose.of(places[frame, 0], facing[frame])

    @property
    def end(self) -> GroundPose:
        """Where the person is one frame behind the last."""
        return self.at(len(self))

    def moved_to(self, pose: GroundPose, frame: int) -> "PlacedMotion":
        """The same moved on the ground so that the person is at ``pose`` in a frame."""
        return PlacedMotion(self.features, self.begin.seen_from(self.at(frame)).seen_from(pose.inverse()))

    def crop(self, first: int, last: int) -> "PlacedMotion":
        """The frames from ``first`` to before ``last``, in their place."""
        return PlacedMotion(self.features[first:last], self.at(first))
