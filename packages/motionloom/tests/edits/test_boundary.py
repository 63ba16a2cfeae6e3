"""What is sampled leaves what is known without a jump: the curves are scipy's."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import BPoly

from motionloom.core import rotations as rot
from motionloom.core.blending import cubic_decay, quintic_decay
from motionloom.edits.boundary import match_boundary, match_rotations

LACK, SLOPE = np.array([0.3, -1.0, 0.0]), np.array([0.02, 0.1, -0.5])


def curve(over: int, zeros: int) -> np.ndarray:
    """(over + 1, 3): from the difference and its slope to nothing, with so many derivatives at rest."""
    begin = [[lack, slope, 0.0][: zeros + 1] for lack, slope in zip(LACK, SLOPE, strict=True)]
    each = [BPoly.from_derivatives([0, over], [one, [0.0] * len(one)]) for one in begin]
    return np.stack([one(np.arange(over + 1)) for one in each], axis=1)


@pytest.mark.parametrize(("decay", "zeros"), [(cubic_decay, 1), (quintic_decay, 2)])
@pytest.mark.parametrize("frames", [1, 2, 9])
def test_a_difference_fades_as_the_polynomial_with_its_value_and_slope_that_ends_at_rest(
    frames: int, decay: Callable, zeros: int
) -> None:
    """From the last known frame on, and from the first sampled one on."""
    behind = match_boundary(LACK, SLOPE, frames, decay=decay)
    np.testing.assert_allclose(behind, curve(frames + 1, zeros)[1:-1], atol=1e-12)
    at = match_boundary(LACK, SLOPE, frames, first=0, decay=decay)
    np.testing.assert_allclose(at, curve(frames, zeros)[:-1], atol=1e-12)


@pytest.mark.parametrize("step", [1, -1])
def test_rotations_go_on_with_the_angle_and_the_angular_velocity_that_are_known(step: int) -> None:
    """About one axis the angle behind the boundary is the sampled one and the cubic through the difference."""
    angles, known = 0.02 * np.arange(30.0) ** 1.5, 1.0 - 0.03 * np.arange(30.0)
    sampled, past = (rot.rotvec_to_quat(a[:, None, None] * [0.0, 1.0, 0.0]) for a in (angles, known))
    border, frames = 14, 8
    result = match_rotations(sampled, past, border, step, frames)
    angle = np.unwrap(rot.quat_to_rotvec(result)[:, 0, 1])
    lack = known - angles
    slope = lack[border] - lack[border - step]
    added = BPoly.from_derivatives([0, frames + 1], [[lack[border], slope], [0, 0]])(np.arange(1, frames + 1))
    at = border + step * np.arange(1, frames + 1)
    np.testing.assert_allclose(angle[at], angles[at] + added, atol=1e-9)
    others = np.setdiff1d(np.arange(30), at)
    assert np.array_equal(result[others], sampled[others])
