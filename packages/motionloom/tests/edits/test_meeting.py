"""Hands that should meet do, between two people who face each other; arms come out of the other's body."""

import numpy as np
import pytest

from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose, relative
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.edits.meeting import Meeting, arms_out, met
from motionloom.goals.contact import LEFT, RIGHT, read_contact
from motionloom.kinematics.capsules import overlap

HALVES = np.array([0.5, 0.5])


def standing(frames: int = 80) -> Motion:
    """Somebody who stands with the arms down."""
    rotations = np.zeros((frames, 22, 4))
    rotations[..., 0] = 1.0
    for side, name in ((1.0, "right_shoulder"), (-1.0, "left_shoulder")):
        rotations[:, SMPL22.index(name)] = [np.cos(0.65), 0.0, 0.0, side * np.sin(0.65)]
    root = np.tile([0.0, -SMPL22.rest_positions()[:, 1].min() + SMPL22.rest_positions()[0, 1], 0.0], (frames, 1))
    return Motion(SMPL22, 20.0, root, rotations)


def meeting(words: str) -> Meeting:
    contact = read_contact((words, words))
    assert contact is not None
    return Meeting(contact)


def couple(apart: float, turn: float = np.pi) -> list[Motion]:
    return [standing(), standing().placed(GroundPose(0.0, apart, turn))]


def features(people: list[Motion]) -> PairMotion:
    encoded = two.encode(np.stack([person.positions() for person in people]))
    return encoded._replace(features=encoded.features.astype(np.float64))


@pytest.mark.parametrize(("apart", "turn"), [(2.0, 0.3), (0.3, np.pi), (1.0, -2.0)])
def test_two_who_shake_hands_stand_face_to_face_within_reach(apart: float, turn: float) -> None:
    one = meeting("two people shake hands")
    before = features(couple(apart, turn))
    one.look(before.places())
    after = one.near(before, HALVES)
    first, second = after.ways()[:, one.frame]
    c, _, x, z = relative(first, second)
    assert c < -0.999
    assert abs(x) < 1e-6
    assert one.contact.apart[0] - 1e-6 <= z <= one.contact.apart[1] + 1e-6
    np.testing.assert_allclose(after.features[..., 3:], before.features[..., 3:])


def test_whoever_stays_is_gone_to() -> None:
    one = meeting("two people shake hands")
    before = features(couple(2.0, 0.3))
    one.look(before.places())
    after = one.near(before, np.array([0.0, 1.0]))
    np.testing.assert_allclose(after.ways()[0], before.ways()[0], atol=1e-9)
    c, _, x, z = relative(*after.ways()[:, one.frame])
    assert (c < -0.999, abs(x) < 1e-6, z < 0.79) == (True, True, True)


@pytest.mark.parametrize(
    ("words", "joints", "low", "high"),
    [
        ("two people shake hands", (RIGHT, RIGHT), 0.95, 1.15),
        ("two people give each other a high five", (RIGHT, RIGHT), 1.45, 1.6),
    ],
)
def test_hands_meet_where_hands_meet(words: str, joints: tuple[int, int], low: float, high: float) -> None:
    one, people = meeting(words), couple(0.68)
    one.look(np.stack([person.positions() for person in people]))
    assert one.frame is not None
    first, second = (person.positions()[one.frame] for person in met(people, one, (None, None)))
    assert np.linalg.norm(first[joints[0]] - second[joints[1]]) < 0.05
    assert low < first[joints[0], 1] < high
    assert overlap(first[None], second[None])[0] < 0.02


def test_a_hand_that_hangs_down_is_not_reached_for() -> None:
    one, people = meeting("two people shake hands"), couple(0.7)
    places = np.stack([person.positions() for person in people])
    one.free = False, True
    one.look(places)
    assert all(goal.empty for goal in one.goals(places))
    places[0, :, RIGHT] = [0.1, 1.05, 0.3]
    assert one.goals(places)[1].mask[one.frame, RIGHT].all()
    held = one.goals(places)[1].positions[one.frame, RIGHT]
    assert np.linalg.norm(held - places[0, one.frame, RIGHT]) < 0.05


def test_a_hug_has_arms_around_and_no_heads_in_each_other() -> None:
    one, people = meeting("two people hug"), couple(0.6)
    pair = features(people)
    one.look(pair.places())
    near = one.near(pair, HALVES)
    people = [standing().placed(GroundPose.of_numbers(pose)) for pose in near.poses]
    first, second = (person.positions()[one.frame] for person in met(people, one, (None, None)))
    behind = second[[LEFT, RIGHT]] - first[0]
    ahead = np.array(
        [np.sin(GroundPose.of_numbers(near.poses[0]).facing), 0.0, np.cos(GroundPose.of_numbers(near.poses[0]).facing)]
    )
    assert (behind @ ahead).max() < 0.0
    assert overlap(first[None], second[None])[0] < 0.05


def test_the_frame_is_where_hands_are_nearest_and_is_found_once() -> None:
    one, people = meeting("two people hold hands"), couple(0.8, 0.0)
    places = np.stack([person.positions() for person in people])
    places[0, 50, RIGHT] = places[1, 50, LEFT] + 0.01
    one.look(places)
    assert one.frame == 50
    assert (one.way[0].joint, one.way[0].other) == (RIGHT, LEFT)
    one.look(places[:, ::-1])
    assert one.frame == 50


def test_an_arm_in_a_chest_comes_out() -> None:
    first, second = (person.positions() for person in couple(0.45))
    first[:, RIGHT] = second[:, SMPL22.index("spine3")] + [0.02, 0.0, 0.03]
    goal = arms_out(first, second)
    assert goal.mask[:, RIGHT].all()
    moved_out = np.where(goal.mask, goal.positions, first)
    assert overlap(moved_out, second).max() < overlap(first, second).max() / 2
    assert arms_out(*(person.positions() for person in couple(1.5))).empty
