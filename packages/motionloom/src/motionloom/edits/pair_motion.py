"""Two people in one world as features and ground poses: what edits of pairs see and change."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.edits.relative_pose import moved_along, on_the_spot
from motionloom.features import pair as two
from motionloom.ground import compose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairMotion:
    """Two people in one world."""

    features: Array
    """(2, frames, 263), not standardised."""
    poses: Array
    """(2, 4) ground poses at frame 0."""

    def places(self) -> Array:
        """(2, frames, 22, 3) metres."""
        return np.asarray(two.decode(self.features, self.poses), dtype=np.float64)

    def ways(self) -> Array:
        """(2, frames, 4) ground poses."""
        return np.asarray(compose(self.poses[:, None], two.along(self.features)), dtype=np.float64)

    def changed(self, change: Array, shares: Array) -> "PairMotion":
        """With the second person's facing, x and z changed (frames, 3) relative to the first: by shares (2,) of it."""
        features, poses, ways = self.features.copy(), self.poses.copy(), self.ways()
        for person, share in ((0, -shares[0]), (1, shares[1])):
            features[person] = moved_along(features[person], ways[person], share * change)
            poses[person] = on_the_spot(poses[person, None], share * change[:1, 0])[0]
            poses[person, 2:] += share * change[0, 1:]
        return PairMotion(features, poses)
