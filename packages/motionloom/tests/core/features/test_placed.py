"""One person in the world: parts of a motion lie where the whole has them, and the whole can be moved by any frame."""

import numpy as np
import pytest

from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.motion import ground_pose
from tests.core.features.people import wander


def places() -> np.ndarray:
    """(61, 22, 3) metres of somebody who turns, away from the origin."""
    return wander(3, frames=61).positions() + np.array([2.0, 0.0, -1.0])


def test_places_come_back_and_the_next_frame_is_known() -> None:
    whole = PlacedMotion.of(places())
    np.testing.assert_allclose(whole.positions, places()[:-1], atol=1e-4)
    np.testing.assert_allclose([whole.end.x, whole.end.z], places()[-1, 0, ::2], atol=1e-4)
    assert whole.contacts.shape == (60, 4)


@pytest.mark.parametrize("frame", [1, 33, 59])
def test_parts_strung_together_are_the_motion(frame: int) -> None:
    whole = PlacedMotion.of(places())
    first, second = whole.crop(0, frame), whole.crop(frame, 60)
    np.testing.assert_allclose(np.concatenate([first.positions, second.positions]), whole.positions, atol=1e-9)
    np.testing.assert_allclose(PlacedMotion(second.features, first.end).positions, second.positions, atol=1e-9)


@pytest.mark.parametrize("frame", [0, 20, 60])
def test_a_motion_is_moved_so_that_one_of_its_frames_is_somewhere(frame: int) -> None:
    whole, there = PlacedMotion.of(places()), GroundPose(-3.0, 0.5, 2.0)
    made = whole.moved_to(there, frame)
    found = made.at(frame)
    np.testing.assert_allclose([found.x, found.z, found.facing], [there.x, there.z, there.facing], atol=1e-9)
    seen = [ground_pose(one.positions[0]).from_world(one.positions) for one in (whole, made)]
    np.testing.assert_allclose(seen[0], seen[1], atol=1e-9)


def test_no_frames_are_at_the_origin() -> None:
    nothing = PlacedMotion.nothing()
    assert (len(nothing), nothing.end) == (0, GroundPose())
