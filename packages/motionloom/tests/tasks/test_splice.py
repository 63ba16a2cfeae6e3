"""Drawn stretches in a motion: differences fade as they should, what is outside or kept stays bit for bit."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.tasks.splice import KeptParts, splice
from tests.tasks.test_edit import person

OLD = person(2.0, 30.0)


@pytest.mark.parametrize(("first", "last"), [(20, 40), (20, 60), (0, 40), (59, 60), (30, 31)])
def test_outside_of_a_stretch_and_in_kept_parts_nothing_changes(first: int, last: int) -> None:
    turn = rot.rotvec_to_quat(np.array([0.2, 0.1, -0.3]))
    new = Motion(SMPL22, 30.0, OLD.root + np.array([0.3, 0.1, -0.2]), rot.multiply(OLD.rotations, turn))
    joints, place = np.arange(22) % 3 == 1, np.array([True, False, True])
    result = splice(OLD, new, first, last=last, keep=KeptParts(joints, place))
    inside = (np.arange(60) >= first) & (np.arange(60) < last)
    assert np.array_equal(result.rotations[~inside], OLD.rotations[~inside])
    assert np.array_equal(result.root[~inside], OLD.root[~inside])
    same = np.abs((result.rotations * OLD.rotations).sum(-1))[inside]
    np.testing.assert_allclose(same[:, joints], 1, atol=1e-12)
    if last - first > 10:  # in a frame between two borders there is no room for what was drawn
        assert same[:, ~joints].min() < 1 - 1e-4
    assert np.array_equal(result.root[inside][:, place], OLD.root[inside][:, place])


def test_a_constant_difference_fades_from_the_border_and_is_gone_behind_it() -> None:
    """The person turns at one joint: as drawn once the ease of 0.3 s is over, and as it was next to the border."""
    angle = 0.5
    turns = OLD.rotations.copy()
    turns[:, 15] = rot.multiply(turns[:, 15], rot.rotvec_to_quat(np.array([0, angle, 0])))
    new = Motion(SMPL22, 30.0, OLD.root, turns)
    result = splice(OLD, new, 20, last=60, keep=KeptParts(np.zeros(22, dtype=bool), np.zeros(3, dtype=bool)))
    apart = rot.multiply(rot.inverse(OLD.rotations[20:, 15]), result.rotations[20:, 15])
    away = np.linalg.norm(rot.quat_to_rotvec(apart), axis=-1)
    ease = 9
    lead = BPoly.from_derivatives([0, ease + 1], [[angle, 0], [0, 0]])(np.arange(1, ease + 1))
    np.testing.assert_allclose(away[:ease], angle - lead, atol=0.02)  # the head's own turning adds a little slope
    np.testing.assert_allclose(away[ease:], angle, atol=1e-9)
