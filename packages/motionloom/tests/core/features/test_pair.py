"""Two people: stands, crops, exchange, mirror and the numbers of a network, against rigid geometry done otherwise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml, pair
from motionloom.core.features.pair import PUBLISHED_CODE, PlaceCode
from motionloom.core.skeleton import SMPL22
from tests.core.features.people import wander

CODES = (PlaceCode(), PlaceCode("mutual", 1.4, 0.7), PUBLISHED_CODE)
angles, metres = st.floats(-3.1, 3.1), st.floats(-20, 20)
stand = st.tuples(angles, metres, metres).map(lambda t: np.array([np.cos(t[0]), np.sin(t[0]), t[1], t[2]]))


def people(seed: int = 0, frames: int = 50) -> np.ndarray:
    """(2, frames, 22, 3): two walkers with the first frame anywhere."""
    walkers = np.stack([wander(seed + k, frames=frames).positions() for k in (1, 2)])
    return walkers + np.array([[0.3, 0.0, -1.0], [1.1, 0.0, 0.4]])[:, None, None]


def by_matrix(stands: np.ndarray) -> np.ndarray:
    """(..., 4) as homogeneous matrices of the plane's rigid motions, written with rotations.py."""
    facing = np.arctan2(stands[..., 1], stands[..., 0])
    result = np.zeros((*facing.shape, 4, 4))
    result[..., :3, :3] = rot.quat_to_matrix(rot.rotvec_to_quat(facing[..., None] * [0.0, 1.0, 0.0]))
    result[..., 0, 3], result[..., 2, 3], result[..., 3, 3] = stands[..., 2], stands[..., 3], 1.0
    return result


@settings(max_examples=30, deadline=None)
@given(stand, stand)
def test_stands_compose_as_rigid_motions_do(a, b):
    np.testing.assert_allclose(by_matrix(pair.compose(a, b)), by_matrix(a) @ by_matrix(b), atol=1e-9)
    np.testing.assert_allclose(by_matrix(pair.relative(a, b)), np.linalg.inv(by_matrix(a)) @ by_matrix(b), atol=1e-9)
    point = np.array([0.4, 1.3, -0.9])
    np.testing.assert_allclose(pair.to_world(point, a), (by_matrix(a) @ [*point, 1.0])[:3], atol=1e-9)
    np.testing.assert_allclose(pair.from_world(pair.to_world(point, a), a), point, atol=1e-9)


def test_a_stand_faces_where_it_says():
    left = np.array([0.0, 1.0, 2.0, 3.0])  # facing +X
    np.testing.assert_allclose(pair.to_world(np.array([0.0, 1.5, 1.0]), left), [3.0, 1.5, 3.0], atol=1e-12)


def test_two_people_come_back_to_a_hundredth_of_a_millimetre():
    world = people()
    made = pair.encode(world)
    back = pair.decode(made.features.astype(np.float64), made.poses)
    back[..., 1] += pair.floors(world)[:, None, None]
    assert np.abs(back - world[:, :-1]).max() < 1e-5
    between = np.linalg.norm(world[0, :-1, :, None] - world[1, :-1, None], axis=-1)
    assert np.abs(np.linalg.norm(back[0, :, :, None] - back[1, :, None], axis=-1) - between).max() < 1e-5


def test_each_person_alone_is_the_canonical_one():
    world = people(3)
    made = pair.encode(world)
    for person, features in zip(world, made.features, strict=True):
        np.testing.assert_allclose(features, humanml.encode(humanml.canonical(person), heading="corrected"), atol=1e-6)


def test_exchanged_people_have_exchanged_features_stands_and_numbers():
    world = people(5)
    made, other = pair.encode(world), pair.encode(world[::-1])
    np.testing.assert_array_equal(other.features, made.features[::-1])
    np.testing.assert_array_equal(other.poses, made.poses[::-1])
    for code in CODES:
        np.testing.assert_array_equal(code.encode(other.poses), code.encode(made.poses)[::-1])


@pytest.mark.parametrize("start", [1, 17, 30])
def test_a_crop_has_the_stands_of_its_own_first_frame(start):
    made = pair.encode(people(7))
    made = made._replace(features=made.features.astype(np.float64))
    features, whole = made.features, made.places()
    np.testing.assert_allclose(made.crop(start, 40).places(), whole[:, start:40], atol=1e-9)
    assert np.abs(pair.decode(features[:, start:], made.poses) - whole[:, start:]).max() > 0.02  # the published bug


def test_the_root_of_a_crop_stands_where_its_features_begin():
    made = pair.encode(people(8))
    cut = made._replace(features=made.features.astype(np.float64)).crop(20, 40).poses
    np.testing.assert_allclose(cut[:, 2:], people(8)[:, 20, 0, [0, 2]], atol=1e-5)


def test_frame_zero_is_later_by_nothing():
    made = pair.encode(people(9))
    np.testing.assert_allclose(made.crop(0, 9).poses, made.poses, atol=1e-12)


def test_mirrored_stands_belong_to_mirrored_features():
    made = pair.encode(people(11))
    features = made.features.astype(np.float64)
    there = pair.decode(humanml.mirror(features).astype(np.float64), pair.mirrored(made.poses))
    plain = pair.decode(features, made.poses)
    expected = plain[..., list(SMPL22.mirror_pairs()), :] * np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(there, expected, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(stand, stand, st.sampled_from(CODES))
def test_numbers_tell_how_two_people_stand_to_each_other(a, b, code):
    stands = np.stack([a, b])
    back = code.decode(code.encode(stands))
    np.testing.assert_allclose(pair.relative(back[0], back[1]), pair.relative(a, b), atol=1e-7)


@settings(max_examples=20, deadline=None)
@given(stand, stand, stand)
def test_mutual_numbers_do_not_depend_on_the_world(a, b, world):
    stands = np.stack([a, b])
    code = PlaceCode()
    np.testing.assert_allclose(code.encode(pair.compose(world[None], stands)), code.encode(stands), atol=1e-7)


def test_guessed_numbers_of_exchanged_people_put_them_to_each_other_as_before():
    rng = np.random.default_rng(0)
    guessed = rng.normal(size=(20, 2, 4))
    code = PlaceCode()
    one, two = code.decode(guessed), code.decode(guessed[:, ::-1])
    there, back = pair.relative(one[:, 0], one[:, 1]), pair.relative(two[:, 1], two[:, 0])
    np.testing.assert_allclose(back, there, atol=1e-9)


def test_published_numbers_are_the_entries_of_the_nine():
    facing, x, z = 0.7, 2.0, -3.0
    to_person = rot.quat_to_matrix(rot.rotvec_to_quat(np.array([0.0, -facing, 0.0])))  # world to canonical
    nine = np.array([*to_person[0], *to_person[1], x, 0.0, z])
    stands = np.tile([np.cos(facing), np.sin(facing), x, z], (2, 1))
    np.testing.assert_allclose(PUBLISHED_CODE.encode(stands)[0], nine[[0, 2, 6, 8]] / 10, atol=1e-12)


def test_the_published_drawing_is_right_where_the_first_person_faces_ahead_and_only_there():
    ahead = np.array([[1.0, 0.0, 1.0, 2.0], [0.0, 1.0, -1.0, 4.0]])
    right = pair.relative(ahead[:1], ahead)
    np.testing.assert_allclose(pair.as_published(ahead), right, atol=1e-12)
    turned = pair.compose(np.array([0.0, 1.0, 0.0, 0.0])[None], ahead)
    assert np.abs(pair.as_published(turned) - right).max() > 1
    r0, r1 = (by_matrix(s)[:3, :3].T for s in turned)  # world to person
    point = np.array([0.3, 1.0, 0.2])
    expected = r0 @ r1.T @ point + [turned[1, 2] - turned[0, 2], 0, turned[1, 3] - turned[0, 3]]
    np.testing.assert_allclose(pair.to_world(point, pair.as_published(turned)[1]), expected, atol=1e-12)


def test_no_direction_at_all_is_ahead():
    nothing = np.array([0.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(pair.normalized(nothing), [1.0, 0.0, 1.0, 2.0])


@pytest.mark.parametrize("shape", [(1, 9, 22, 3), (2, 1, 22, 3), (2, 9, 21, 3), (9, 22, 3)], ids=str)
def test_other_shapes_are_refused(shape):
    with pytest.raises(MotionloomError, match="two people must be"):
        pair.encode(np.zeros(shape))


def test_numbers_that_are_not_finite_and_odd_codes_are_refused():
    with pytest.raises(MotionloomError, match="not finite"):
        pair.encode(np.full((2, 9, 22, 3), np.nan))
    for code in (("mutual", 0.0, 1.0), ("else", 1.0, 1.0), ("world", 1.0, float("nan"))):
        with pytest.raises(MotionloomError, match="coded"):
            PlaceCode(*code)
