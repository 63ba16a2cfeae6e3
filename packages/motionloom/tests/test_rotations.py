"""Quaternions, matrices and angles agree with scipy and with each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from motionloom.core import rotations as rot

vectors = arrays(np.float64, (5, 3), elements=st.floats(-3.0, 3.0))
RANDOM = rot.normalize(np.random.default_rng(0).normal(size=(4, 6, 4)))


def scipy_of(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.roll(q.reshape(-1, 4), -1, axis=-1))


def same(a: np.ndarray, b: np.ndarray) -> None:
    """The same rotations, whatever the sign."""
    assert np.allclose(np.abs((a * b).sum(-1)), 1.0, atol=1e-9)


def test_a_product_turns_by_the_second_first() -> None:
    a, b = RANDOM[0], RANDOM[1]
    expected = (scipy_of(a) * scipy_of(b)).as_matrix()
    assert np.allclose(rot.quat_to_matrix(rot.multiply(a, b)), expected)


def test_products_broadcast() -> None:
    one = RANDOM[0, 0]
    assert np.allclose(rot.multiply(RANDOM, one)[2, 3], rot.multiply(RANDOM[2, 3], one))


def test_turning_a_vector_is_the_matrix_product() -> None:
    v = np.random.default_rng(1).normal(size=(4, 6, 3))
    assert np.allclose(rot.rotate(RANDOM, v), np.einsum("...ij,...j->...i", rot.quat_to_matrix(RANDOM), v))


def test_the_inverse_undoes() -> None:
    same(rot.multiply(RANDOM, rot.inverse(RANDOM)), np.broadcast_to(rot.IDENTITY, RANDOM.shape))


def test_a_quarter_turn_about_y_takes_z_to_x() -> None:
    q = rot.rotvec_to_quat(np.array([0.0, np.pi / 2, 0.0]))
    assert np.allclose(q, [np.sqrt(0.5), 0, np.sqrt(0.5), 0])
    assert np.allclose(rot.rotate(q, np.array([0.0, 0.0, 1.0])), [1.0, 0.0, 0.0])


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_euler_angles_are_intrinsic_in_every_order_and_come_back(order: str) -> None:
    angles = np.random.default_rng(2).uniform(-1.4, 1.4, size=(50, 3))
    q = rot.euler_to_quat(order, angles)
    assert np.allclose(rot.quat_to_matrix(q), Rotation.from_euler(order, angles).as_matrix())
    assert np.allclose(rot.quat_to_euler(order, q), angles, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(vectors)
def test_rotation_vectors_there_and_back_are_the_same_turn(v: np.ndarray) -> None:
    q = rot.rotvec_to_quat(v)
    assert np.allclose(rot.quat_to_matrix(q), Rotation.from_rotvec(v).as_matrix(), atol=1e-9)
    back = rot.quat_to_rotvec(q)
    assert (np.linalg.norm(back, axis=-1) <= np.pi + 1e-9).all()
    same(rot.rotvec_to_quat(back), q)


def test_matrices_there_and_back() -> None:
    same(rot.matrix_to_quat(rot.quat_to_matrix(RANDOM)), RANDOM)


@settings(max_examples=50, deadline=None)
@given(vectors, vectors)
def test_the_shortest_arc_reaches_its_goal_without_twist(a: np.ndarray, b: np.ndarray) -> None:
    good = (np.linalg.norm(a, axis=-1) > 1e-3) & (np.linalg.norm(b, axis=-1) > 1e-3)
    a, b = a[good], b[good]
    q = rot.shortest_arc(a, b)
    u, v = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (a, b))
    assert np.allclose(rot.rotate(q, u), v, atol=1e-4)
    assert np.allclose((q[..., 1:] * u).sum(-1), 0.0, atol=1e-6)


def test_the_shortest_arc_between_opposites_is_half_a_turn() -> None:
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    assert np.allclose(rot.rotate(rot.shortest_arc(axes, -axes), axes), -axes)


def test_slerp_moves_at_constant_speed_the_short_way() -> None:
    a, b = rot.IDENTITY, -rot.rotvec_to_quat(np.array([0.0, 1.0, 0.0]))
    for amount in (0.0, 0.25, 1.0):
        same(rot.slerp(a, b, np.array(amount)), rot.rotvec_to_quat(np.array([0.0, amount, 0.0])))


def test_unroll_changes_signs_only_and_leaves_no_flips() -> None:
    time = np.linspace(0, 20, 200)[:, None]
    smooth = rot.rotvec_to_quat(time * np.array([0.0, 1.0, 0.0]))
    signs = np.random.default_rng(3).choice([-1.0, 1.0], size=(200, 1))
    out = rot.unroll(smooth * signs)
    same(out, smooth)
    assert ((out[1:] * out[:-1]).sum(-1) > 0).all()


def test_zero_quaternions_normalise_to_the_identity() -> None:
    assert np.array_equal(rot.normalize(np.zeros((2, 4))), np.tile(rot.IDENTITY, (2, 1)))


def test_a_quaternion_from_axes_sends_the_axes_there() -> None:
    m = rot.quat_to_matrix(RANDOM)
    same(rot.from_axes([m[..., 0], m[..., 1], m[..., 2]]), RANDOM)
