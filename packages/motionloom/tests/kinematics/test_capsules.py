"""Bodies as capsules: how near two come and how deep they are in each other."""

import numpy as np
import pytest

from motionloom.kinematics.capsules import RADII, overlap, trunk_distance
from motionloom.skeleton import SMPL22


def standing(x: float) -> np.ndarray:
    """Two frames of somebody in the rest pose, arms to the sides, ``x`` metres in front of the origin."""
    return np.repeat(SMPL22.rest_positions()[None] + [0.0, 0.0, x], 2, axis=0)


def test_bodies_in_one_place_are_as_deep_as_the_thickest_part() -> None:
    np.testing.assert_allclose(overlap(standing(0), standing(0)), 2 * RADII.max(), atol=1e-9)
    np.testing.assert_allclose(trunk_distance(standing(0), standing(0)), 0, atol=1e-9)


def test_the_deeper_the_nearer_and_nothing_where_they_are_apart() -> None:
    depths = [float(overlap(standing(0), standing(x))[0]) for x in (0.0, 0.06, 0.12, 1.0)]
    assert depths[0] > depths[1] > depths[2] > 0
    assert depths[3] == 0
    assert trunk_distance(standing(0), standing(1.0)) == pytest.approx([1.0, 1.0], abs=0.01)  # trunks lean a little
