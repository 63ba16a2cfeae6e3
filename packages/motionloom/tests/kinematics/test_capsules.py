"""Bodies as capsules: how near two come and how deep they are in each other."""

import numpy as np
import pytest

from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.capsules import DEEP, RADII, overlap, overlaps, trunk_distance


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


def test_the_stretches_in_which_one_is_in_the_other_have_times_and_depths() -> None:
    first = np.concatenate([standing(0)] * 5)
    second = np.concatenate([standing(x) for x in (1.0, 0.0, 0.1, 1.0, 0.0)])
    depth = overlap(first, second)
    found = overlaps(first, second, 20.0)
    assert [(one["begin"], one["end"]) for one in found] == [(0.1, 0.3), (0.4, 0.5)]
    assert found[0]["depth"] == pytest.approx(depth.max(), abs=1e-3)
    assert (depth[[2, 8]] > DEEP).all()
    assert overlaps(standing(0), standing(1.0), 20.0) == []
