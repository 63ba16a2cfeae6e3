"""Places as numbers from the last observed pose: there and back, whichever way the person stands."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT, Layout, bone_lengths, with_bones
from tests.recorded.graphs import BARE

LAYOUTS = {"smpl": SMPL_LAYOUT, "bare": BARE}
each = pytest.mark.parametrize("layout", list(LAYOUTS.values()), ids=list(LAYOUTS))


def people(layout: Layout, *batch: int, seed: int = 0) -> np.ndarray:
    """Places of joints (*batch, joints, 3) about 2 m from the origin, the root among them."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(*batch, layout.joints, 3)) * 0.5 + rng.normal(size=(*batch[:-1], 1, 1, 3)) * 2


def turned(positions: np.ndarray, angle: float) -> np.ndarray:
    """To the left about +Y: +Z goes towards +X."""
    c, s = np.cos(angle), np.sin(angle)
    return positions @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T


@each
def test_places_come_back_from_their_numbers(layout: Layout) -> None:
    p = people(layout, 3, 7)
    place = layout.place(p[:, -1])
    numbers = layout.encode(p, place)
    assert numbers.shape == (3, 7, layout.channels)
    back = layout.decode(numbers, place)
    expected = p if layout.root else p - p[..., :1, :] + p[:, -1:, :1]
    np.testing.assert_allclose(back, expected, atol=1e-12)


@each
def test_one_clip_is_as_a_batch_of_one(layout: Layout) -> None:
    p = people(layout, 1, 7)
    alone = layout.encode(p[0], layout.place(p[0, -1]))
    np.testing.assert_array_equal(alone, layout.encode(p, layout.place(p[:, -1]))[0])


def test_a_person_turned_and_moved_over_the_ground_has_the_same_numbers() -> None:
    p = people(SMPL_LAYOUT, 2, 5)
    numbers = SMPL_LAYOUT.encode(p, SMPL_LAYOUT.place(p[:, -1]))
    for angle, move in ((2.0, [3.0, 0.0, -1.0]), (-0.7, [0.0, 0.0, 100.0])):
        other = turned(p, angle) + np.array(move)
        place = SMPL_LAYOUT.place(other[:, -1])
        np.testing.assert_allclose(SMPL_LAYOUT.encode(other, place), numbers, atol=1e-10)
        np.testing.assert_allclose(SMPL_LAYOUT.decode(numbers, place), other, atol=1e-10)


def test_published_numbers_keep_the_worlds_axes_and_lose_the_way() -> None:
    p = people(BARE, 2, 5)
    numbers = BARE.encode(p, BARE.place(p[:, -1]))
    moved = p + np.random.default_rng(1).normal(size=(2, 5, 1, 3))
    np.testing.assert_allclose(BARE.encode(moved, BARE.place(moved[:, -1])), numbers, atol=1e-12)
    spun = turned(p, 1.0)
    assert np.abs(BARE.encode(spun, BARE.place(spun[:, -1])) - numbers).max() > 0.1


def test_with_z_up_height_is_the_third_number_and_nothing_is_mirrored() -> None:
    """A head 0.6 m above the root, and three axes that stay right-handed."""
    p = np.zeros((1, BARE.joints, 3))
    p[0, 3] = [0, 0.6, 0]
    p[0, 1], p[0, 2] = [1, 0, 0], [0, 0, 1]
    numbers = BARE.encode(p, BARE.place(p[-1])).reshape(3, 3)
    assert numbers[2].tolist() == [0, 0, 0.6]
    np.testing.assert_array_equal(np.cross(numbers[0], [0, 0, 1]), numbers[1])  # x cross y is z, wherever they go


def test_a_person_at_the_origin_facing_z_is_encoded_as_they_are() -> None:
    """Left is +X: the left hip and shoulder lie there. The root's height stays, its place becomes the origin."""
    p = np.zeros((2, 22, 3))
    p[:, 0], p[:, 15] = [5.0, 0.9, 7.0], [5.0, 1.6, 7.1]
    for left, right in SMPL_LAYOUT.across:
        p[:, left], p[:, right] = [5.2, 1.0, 7.0], [4.8, 1.0, 7.0]
    place = SMPL_LAYOUT.place(p[-1])
    assert float(place.facing) == 0
    numbers = SMPL_LAYOUT.encode(p, place).reshape(2, 22, 3)
    np.testing.assert_allclose(numbers[0, 0], [0, 0.9, 0], atol=1e-12)
    np.testing.assert_allclose(numbers[0, 15], [0, 0.7, 0.1], atol=1e-12)
    np.testing.assert_allclose(numbers[0, 1], [0.2, 0.1, 0], atol=1e-12)


@given(angle=st.floats(-3.1, 3.1))
def test_facing_is_the_angle_that_the_person_was_turned_by(angle: float) -> None:
    p = np.zeros((22, 3))
    for left, right in SMPL_LAYOUT.across:
        p[left], p[right] = [0.2, 1.0, 0.0], [-0.2, 1.0, 0.0]
    assert float(SMPL_LAYOUT.place(turned(p, angle)).facing) == pytest.approx(angle, abs=1e-9)


@each
def test_mirrored_twice_is_as_before_and_bones_keep_their_sides(layout: Layout) -> None:
    p = people(layout, 2, 5)
    other = layout.mirrored(p)
    np.testing.assert_array_equal(layout.mirrored(other), p)
    own, swapped = bone_lengths(p, layout.parents), bone_lengths(other, layout.parents)
    np.testing.assert_allclose(swapped, own[..., list(layout.pairs)], atol=1e-12)
    assert all(layout.parents[layout.pairs[j]] == layout.pairs[p] for j, p in enumerate(layout.parents) if p >= 0)


def test_a_mirrored_person_has_mirrored_numbers() -> None:
    """Facing turns the other way, so that seen from the person left and right are exchanged and nothing else."""
    p = people(SMPL_LAYOUT, 2, 5)
    numbers = SMPL_LAYOUT.encode(p, SMPL_LAYOUT.place(p[:, -1])).reshape(2, 5, 22, 3)
    other = SMPL_LAYOUT.mirrored(p)
    made = SMPL_LAYOUT.encode(other, SMPL_LAYOUT.place(other[:, -1])).reshape(2, 5, 22, 3)
    np.testing.assert_allclose(made, numbers[..., list(SMPL_LAYOUT.pairs), :] * [-1, 1, 1], atol=1e-10)


@each
def test_bones_are_as_long_as_told_and_point_as_before(layout: Layout) -> None:
    p, like = people(layout, 3, 5), people(layout, 3, 4)
    lengths = bone_lengths(like, layout.parents)
    made = with_bones(p, layout.parents, like=like)
    np.testing.assert_array_equal(made[..., 0, :], p[..., 0, :])
    for j, parent in enumerate(layout.parents[1:], start=1):
        before, after = p[..., j, :] - p[..., parent, :], made[..., j, :] - made[..., parent, :]
        np.testing.assert_allclose(
            np.linalg.norm(after, axis=-1), np.broadcast_to(lengths[:, j : j + 1], (3, 5)), atol=1e-12
        )
        np.testing.assert_allclose(np.cross(before, after), 0, atol=1e-12)
        assert ((before * after).sum(-1) > 0).all()
    np.testing.assert_allclose(bone_lengths(made, layout.parents), lengths, atol=1e-12)


@each
def test_bones_of_their_own_length_stay_and_the_input_is_not_touched(layout: Layout) -> None:
    p = people(layout, 2, 1)
    before = p.copy()
    np.testing.assert_allclose(with_bones(p, layout.parents, like=p), p, atol=1e-12)
    np.testing.assert_array_equal(p, before)


def test_a_bone_of_no_length_makes_no_nan() -> None:
    made = with_bones(np.zeros((1, 3, 3)), (-1, 0, 1), like=np.array([[[0, 0, 0], [0, 0.3, 0], [0, 0.6, 0]]]))
    assert np.isfinite(made).all()


def test_a_root_that_is_not_told_has_no_numbers_to_hold() -> None:
    assert [SMPL_LAYOUT.part(j) for j in (0, 1, 21)] == [0, 1, 21]
    assert [BARE.part(j) for j in (1, 3)] == [0, 2]
    with pytest.raises(MotionloomError, match="root"):
        BARE.part(0)


@each
def test_layouts_come_back_from_plain_data(layout: Layout) -> None:
    assert Layout.parse(layout.plain()) == layout


@pytest.mark.parametrize(
    "change",
    [
        {"names": ()},
        {"names": ("a",)},
        {"parents": (-1, 0, 1)},
        {"parents": (0,) * 4},
        {"parents": (-1, 1, 0, 0)},
        {"parents": (-1, -1, 0, 0)},
        {"pairs": (1,) * 4},
        {"pairs": (*range(3), 4)},
        {"pairs": (-1, *range(1, 4))},
        {"pairs": (*range(1, 4), 0)},
        {"across": ((0, 4),)},
        {"across": ((-1, 2),)},
        {"across": ((1, 2),)},
    ],
    ids=str,
)
def test_layouts_that_do_not_fit_together_are_refused(change: dict) -> None:
    """The last one alone would do, but not together with +Z up."""
    with pytest.raises(MotionloomError):
        replace(BARE, **change)


def test_more_joints_than_anybody_has_are_refused() -> None:
    n = 257
    with pytest.raises(MotionloomError):
        Layout(("a",) * n, (-1, *[0] * (n - 1)), tuple(range(n)))


@pytest.mark.parametrize("key", ["names", "parents", "pairs", "across", "root", "z_up"])
@pytest.mark.parametrize("value", [None, 3, "x", [[]], [float("inf")], [[1, 2, 3]], {"a": 1}], ids=str)
def test_plain_data_that_is_no_layout_is_refused_or_read_as_no(key: str, value: object) -> None:
    if key in ("root", "z_up"):
        assert getattr(Layout.parse(SMPL_LAYOUT.plain() | {key: value}), key) is False
        return
    with pytest.raises(MotionloomError):
        Layout.parse(SMPL_LAYOUT.plain() | {key: value})


def test_plain_data_without_a_key_is_refused() -> None:
    for key in SMPL_LAYOUT.plain():
        with pytest.raises(MotionloomError):
            Layout.parse({k: v for k, v in SMPL_LAYOUT.plain().items() if k != key})
