"""`FixedJoints`: parts of a prediction that are given, and the motion that gives them."""

from dataclasses import dataclass

import numpy as np

from motionloom.core.motion import Motion


@dataclass(frozen=True)
class FixedPart:
    """Some joints, and when they are held."""

    joints: tuple[str, ...]
    """Joints and groups of the 22-joint skeleton; ``root``: the way through the world (so do pelvis and its groups)."""
    spans: tuple[tuple[float, float], ...] = ((0.0, np.inf),)
    """Seconds (from, to) behind the end of the past."""


@dataclass(frozen=True, eq=False)
class FixedJoints:
    """Parts whose future is given: they take the local rotations of another motion exactly."""

    source: Motion
    """On the past's skeleton and at its rate; its first frame is the first one to predict."""
    parts: tuple[FixedPart, ...]
    align: bool = True
    """Whether a source that starts elsewhere is moved and turned on the ground to where the past ends."""
