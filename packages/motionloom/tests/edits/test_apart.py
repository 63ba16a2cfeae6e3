"""Two bodies in one place come apart, slowly, and no further than they must."""

import numpy as np
import pytest

from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.edits.apart import kept_apart, shift_apart
from motionloom.edits.meeting import Bodies
from motionloom.io import load
from motionloom.kinematics.capsules import ARMS, CAPSULES, RADII, capsule_ends, gaps
from motionloom.retarget import to_smpl22
from tests.tasks.two_people import CLIP

CORE = [number for number in range(len(CAPSULES)) if number not in ARMS]
HALVES = np.array([0.5, 0.5])


def beside(x: float, z: float) -> PairMotion:
    """Somebody who walks, and the same again at a distance (metres)."""
    own = to_smpl22(load(CLIP)).at(np.linspace(0, len(load(CLIP)) - 1, 101), 20.0).positions()  # slowly
    encoded = two.encode(np.stack([own, own + np.array([x, 0.0, z])]))
    return encoded._replace(features=encoded.features.astype(np.float64))


def inside(pair: PairMotion) -> np.ndarray:
    """(frames,) metres of overlap of everything but arms."""
    ends = [capsule_ends(person)[:, CORE] for person in pair.places()]
    return -gaps(ends[0], RADII[CORE], ends[1], RADII[CORE]).min(axis=(1, 2))


@pytest.mark.parametrize(("x", "z"), [(0.0, 0.0), (0.1, 0.0), (0.05, 0.1)])
def test_who_walks_in_somebody_walks_beside_him(x: float, z: float) -> None:
    before = beside(x, z)
    assert inside(before).min() > 0.05
    after = kept_apart(before, HALVES)
    assert inside(after).max() < 0.02
    ways = [pair.ways()[..., 2:] for pair in (before, after)]
    moved = ways[1] - ways[0]
    assert np.linalg.norm(moved, axis=-1).max() < 0.5
    assert np.linalg.norm(np.diff(moved, axis=1), axis=-1).max() < 0.02
    np.testing.assert_allclose(moved[0], -moved[1], atol=1e-6)


def test_who_does_not_touch_is_left_alone() -> None:
    pair = beside(1.0, 0.0)
    assert kept_apart(pair, HALVES) is pair
    assert not shift_apart(beside(5.0, 0.0).places()).any()


@pytest.mark.parametrize("person", [0, 1])
def test_whoever_may_not_be_moved_is_not(person: int) -> None:
    before = beside(0.1, 0.0)
    shares = np.eye(2)[1 - person]
    after = kept_apart(before, shares)
    np.testing.assert_array_equal(after.features[person], before.features[person])
    np.testing.assert_array_equal(after.poses[person], before.poses[person])
    assert inside(after).max() < 0.02
    assert kept_apart(before, np.zeros(2)) is before


def test_what_is_known_stays_and_is_left_without_a_jump() -> None:
    places = beside(0.1, 0.0).places()
    shift = shift_apart(places, still=20)
    assert not shift[:20].any()
    assert np.linalg.norm(np.diff(shift, axis=0), axis=-1).max() < 0.03
    assert np.linalg.norm(shift[60:], axis=-1).min() > 0.1


def test_people_in_each_others_arms_are_not_pushed_out_of_them() -> None:
    shift = shift_apart(beside(0.1, 0.0).places(), close=(30, 50))
    assert np.abs(shift[30:50]).max() < 0.03 < np.abs(shift[[5, 75]]).max()


def test_who_is_known_or_frozen_is_read_from_the_mask() -> None:
    def read(frozen: list[bool]) -> tuple[tuple[bool, bool], tuple[bool, bool], int]:
        bodies = Bodies.of(mask, frozen)
        return bodies.free, bodies.bends, bodies.still

    mask = np.zeros((2, 11, 263), np.bool_)
    assert read([False, False]) == ((True, True), (True, True), 0)
    mask[0, 1:] = True  # the first is given
    assert read([False, False]) == ((False, True), (False, True), 0)
    mask[1, :5] = True  # and what both did
    assert read([False, True]) == ((False, False), (False, True), 4)
    mask[:] = False
    mask[:, 0] = True  # both start at places
    assert read([True, True]) == ((False, False), (True, True), 1)
