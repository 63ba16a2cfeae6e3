"""`GroundPose` and its four numbers: a group of rigid motions of the ground, one value told twice."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core import ground
from motionloom.core.ground import GroundPose

metres, radians = st.floats(-10, 10), st.floats(-3, 3)
poses = st.builds(GroundPose, metres, metres, radians)


@given(poses, st.tuples(metres, metres, metres))
def test_there_and_back(pose: GroundPose, point: tuple[float, float, float]) -> None:
    assert pose.from_world(pose.to_world(np.array(point))) == pytest.approx(np.array(point), abs=1e-9)


def test_a_quarter_turn_to_the_left_faces_plus_x() -> None:
    assert GroundPose(1, 2, np.pi / 2).to_world(np.array([0.0, 5, 1])) == pytest.approx([2, 5, 2])


@given(poses, poses)
def test_the_four_numbers_say_the_same(first: GroundPose, second: GroundPose) -> None:
    seen = ground.relative(first.numbers(), second.numbers())
    assert seen == pytest.approx(second.seen_from(first).numbers(), abs=1e-9)
    assert ground.compose(first.numbers(), seen) == pytest.approx(second.numbers(), abs=1e-9)
    assert GroundPose.of_numbers(second.numbers()).numbers() == pytest.approx(second.numbers())


@given(poses)
def test_the_inverse_leads_back(pose: GroundPose) -> None:
    both = ground.compose(pose.numbers(), pose.inverse().numbers())
    assert both == pytest.approx([1, 0, 0, 0], abs=1e-9)
