"""The body for export stands where the positions are, keeps its bones and never twists without being told."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from motionloom.core import rotations as rot
from motionloom.core.body import ik
from motionloom.core.body.ik import LIMBS, motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from tests.core.features.clips import real
from tests.core.features.people import wander

FPS = 20.0
SEEDS = st.integers(0, 10_000)


def turning_speeds(motion: Motion) -> np.ndarray:
    """(frames - 1, 22) radians per second of each local rotation."""
    q = motion.rotations
    return np.linalg.norm(rot.quat_to_rotvec(rot.multiply(rot.inverse(q[:-1]), q[1:])), axis=-1) * motion.fps


def bone_speeds(positions: np.ndarray, fps: float = FPS) -> np.ndarray:
    """(frames - 1, 21) radians per second of each bone's direction."""
    bones = positions[:, 1:] - positions[:, list(SMPL22.parents[1:])]
    bones /= np.linalg.norm(bones, axis=-1, keepdims=True)
    return np.arccos((bones[1:] * bones[:-1]).sum(-1).clip(-1, 1)) * fps


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.floats(0.1, 0.8))
@example(699, 0.75)
def test_poses_give_back_their_own_positions(seed: int, amplitude: float) -> None:
    """But for frames with a knee that no person bends so, which is mirrored, and those that are smoothed with them."""
    positions = wander(seed, amplitude=amplitude).positions()
    assume((ik._with_knees_ahead(positions) == positions).all())
    np.testing.assert_allclose(motion_from_positions(positions, FPS).positions(), positions, atol=1e-3)


@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_a_single_frame_is_enough(seed: int) -> None:
    positions = wander(seed, frames=1).positions()
    np.testing.assert_allclose(motion_from_positions(positions, FPS).positions(), positions, atol=1e-3)


@settings(max_examples=5, deadline=None)
@given(SEEDS)
def test_hands_and_toes_go_with_what_they_hang_on(seed: int) -> None:
    """Nothing tells how they are bent."""
    ends = motion_from_positions(wander(seed).positions(), FPS).rotations[:, [10, 11, 20, 21]]
    np.testing.assert_allclose(np.abs(ends), np.broadcast_to(rot.IDENTITY, ends.shape), atol=1e-9)


@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_bent_limbs_give_back_their_own_rotations(seed: int) -> None:
    motion = wander(seed, amplitude=0.4)
    again = motion_from_positions(motion.positions(), FPS).world_rotations()
    off = rot.quat_to_rotvec(rot.multiply(rot.inverse(motion.world_rotations()), again))
    bend = np.linalg.norm(rot.quat_to_rotvec(motion.rotations), axis=-1)
    for limb in LIMBS:
        told = bend[:, limb.middle] > np.radians(40)
        assert np.degrees(np.linalg.norm(off[told, limb.start], axis=-1)).max(initial=0) < 8


def straight_arm(noise: float) -> np.ndarray:
    """An arm that swings all but straight, the elbow off the line by noise that knows no side."""
    frames = 60
    turns = np.tile(rot.IDENTITY, (frames, 22, 1))
    swing = 0.8 * np.sin(np.linspace(0, 9, frames))
    turns[:, 16] = rot.multiply(
        rot.rotvec_to_quat(swing[:, None] * [1, 0, 0]), rot.rotvec_to_quat(np.array([0, 0, -1.4]))
    )
    positions = Motion(SMPL22, FPS, np.tile([0, 0.9, 0], (frames, 1)), turns).positions()
    positions[:, 18] += np.random.default_rng(0).normal(size=(frames, 3)) * noise
    return positions


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_a_straight_arm_does_not_twist(noise: float) -> None:
    positions = straight_arm(noise)
    speeds = turning_speeds(motion_from_positions(positions, FPS))
    assert speeds[:, 16].max() < 1.5 * bone_speeds(positions).max()


@pytest.mark.parametrize("degrees", [-30, 0, 40])
def test_a_straight_leg_turns_with_its_foot(degrees: float) -> None:
    turns = np.tile(rot.IDENTITY, (30, 22, 1))
    turns[:, 1] = rot.rotvec_to_quat(np.radians(degrees) * np.array([0, 1.0, 0]))
    positions = Motion(SMPL22, FPS, np.tile([0, 0.9, 0], (30, 1)), turns).positions()
    left = rot.rotate(motion_from_positions(positions, FPS).world_rotations()[:, 4], np.array([1.0, 0, 0]))
    np.testing.assert_allclose(np.degrees(np.arctan2(-left[:, 2], left[:, 0])), degrees, atol=8)


def test_a_knee_that_bends_the_wrong_way_bends_the_right_way() -> None:
    """The left leg swings from 40 degrees forwards to 40 degrees backwards; ankles, other joints and evenness stay."""
    bends = np.radians(np.linspace(40, -40, 40))
    turns = np.tile(rot.IDENTITY, (40, 22, 1))
    for joint, share in ((LIMBS[0].start, -0.5), (LIMBS[0].middle, 1.0)):
        turns[:, joint] = rot.rotvec_to_quat(share * bends[:, None] * [1, 0, 0])
    seen = Motion(SMPL22, FPS, np.zeros((40, 3)), turns).positions()
    hip, knee, ankle = LIMBS[0].start, LIMBS[0].middle, LIMBS[0].end
    made = motion_from_positions(seen, FPS).positions()

    def ahead(places: np.ndarray) -> np.ndarray:
        return places[:, knee, 2] - (places[:, hip, 2] + places[:, ankle, 2]) / 2

    assert ahead(seen)[-1] < -0.05
    np.testing.assert_allclose(ahead(made), np.abs(ahead(seen)), atol=0.02)
    others = [joint for joint in range(22) if joint != knee and joint != LIMBS[0].tip]
    np.testing.assert_allclose(made[:, others], seen[:, others], atol=0.02)
    assert bone_speeds(made).max() < 1.5 * bone_speeds(seen).max()


def test_a_knee_seen_bent_backwards_by_noise_keeps_its_axis() -> None:
    positions = np.tile(SMPL22.rest_positions(), (40, 1, 1))
    positions[:, 4, 2] += 0.01 * np.sin(np.arange(40) * 2.5)
    knees = motion_from_positions(positions, FPS).world_rotations()[:, 4]
    left = rot.rotate(knees, np.array([1.0, 0, 0]))
    assert left[:, 0].min() > 0.99


@settings(max_examples=8, deadline=None)
@given(SEEDS, st.floats(0.002, 0.03))
def test_noise_that_makes_bones_breathe_stays_bounded(seed: int, noise: float) -> None:
    clean = wander(seed).positions()
    positions = clean + np.random.default_rng(seed).normal(size=clean.shape) * noise
    motion = motion_from_positions(positions, FPS)
    error = np.linalg.norm(motion.positions() - positions, axis=-1)
    assert error.mean() < 2.5 * noise + 1e-3  # doubtful limbs are steadied, which costs some of the places
    assert turning_speeds(motion).max() < 1.5 * bone_speeds(positions).max()
    dots = (motion.rotations[1:] * motion.rotations[:-1]).sum(-1)
    assert (dots > 0).all()


def test_coincident_hips_leave_the_pelvis_in_line_with_the_chest() -> None:
    motion = wander(7, amplitude=0.0)
    positions = motion.positions()
    positions[:, [1, 2]] = positions[:, [1, 2]].mean(1, keepdims=True)
    found = motion_from_positions(positions, FPS).world_rotations()[:, 0]
    off = rot.quat_to_rotvec(rot.multiply(rot.inverse(motion.world_rotations()[:, 0]), found))
    assert np.degrees(np.linalg.norm(off, axis=-1)).max() < 15


def test_somebody_drawn_through_a_line_turns_round_evenly() -> None:
    """A network that is not sure draws both sides of a spinning person in one place, then on the other sides."""
    still = Motion(SMPL22, FPS, np.zeros((41, 3)), np.tile(rot.IDENTITY, (41, 22, 1)))
    positions = still.positions()
    side = np.cos(np.pi * np.clip((np.arange(41) - 10) / 20, 0, 1))[:, None]
    positions[..., 0] = positions[:, :1, 0] + side * (positions[..., 0] - positions[:, :1, 0])
    motion = motion_from_positions(positions, FPS)
    forward = rot.rotate(motion.world_rotations()[:, [0, 9]], np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(forward[0, :, 2], 1, atol=0.05)
    np.testing.assert_allclose(forward[-1, :, 2], -1, atol=0.05)
    steps = np.degrees(np.arccos((forward[1:] * forward[:-1]).sum(-1).clip(-1, 1)))
    assert steps.max() < 45


def test_a_shoulder_drawn_onto_its_collar_does_not_spin_it() -> None:
    positions = wander(7, frames=41, amplitude=0.0).positions()
    at = np.arange(41) * 2.0
    circle = 0.02 * np.stack([np.cos(at), np.sin(at), 0 * at], axis=-1)
    shift = positions[:, 13] + circle - positions[:, 16]
    for joint in (16, 18, 20):
        positions[:, joint] += shift
    motion = motion_from_positions(positions, FPS)
    collar = rot.quat_to_rotvec(motion.rotations[:, 13])
    assert np.degrees(np.linalg.norm(collar, axis=-1)).max() < 30
    assert turning_speeds(motion)[:, 13].max() < np.radians(10) * FPS


def spike(joints: tuple[int, ...], shift: np.ndarray) -> np.ndarray:
    """(41, 22) degrees: how far each joint of somebody standing still turns if some are drawn elsewhere in frame 20."""
    positions = np.tile(SMPL22.rest_positions(), (41, 1, 1))
    positions[20, list(joints)] += shift
    return np.degrees(np.linalg.norm(rot.quat_to_rotvec(motion_from_positions(positions, FPS).rotations), axis=-1))


def test_a_forearm_drawn_short_for_a_frame_does_not_fold_its_arm() -> None:
    """It would have to fold by more than 90 degrees at the elbow for the wrist to get there."""
    bone = SMPL22.offsets[20]
    turns = spike((20,), 0.1 * np.linalg.norm(bone) * np.array([0.0, 0.0, 1.0]) - bone)
    assert turns[20, [16, 18]].max() < 12
    assert turns[:, [1, 2, 4, 5, 17, 19]].max() < 1e-3


def test_a_collar_drawn_short_and_aside_for_a_frame_stays() -> None:
    bone = SMPL22.offsets[16]
    aside = 0.5 * np.linalg.norm(bone) * np.array([0.0, 0.0, 1.0])
    assert spike((16, 18, 20), aside - bone)[20, 13] < 8


def waving(forearm: float) -> np.ndarray:
    """A left hand that waves 2.5 times a second beside the head; the forearm is so many times as long as it is."""
    frames = 60
    turns = np.tile(rot.IDENTITY, (frames, 22, 1))
    turns[:, 16] = rot.rotvec_to_quat(np.array([0, 0, -0.3]))
    swing = 0.5 * np.sin(np.arange(frames) / FPS * 2.5 * 2 * np.pi)
    turns[:, 18] = rot.rotvec_to_quat((1.6 + swing)[:, None] * [0, 0, 1])
    positions = Motion(SMPL22, FPS, np.tile([0, 0.9, 0], (frames, 1)), turns).positions()
    positions[:, 20] = positions[:, 18] + forearm * (positions[:, 20] - positions[:, 18])
    return positions


@pytest.mark.parametrize("forearm", [1.0, 1.25, 1.5])
def test_an_arm_that_is_sampled_too_long_waves_as_far_as_it_did(forearm: float) -> None:
    """Networks sample waving forearms up to a half too long."""
    sampled = waving(forearm)
    bone = motion_from_positions(sampled, FPS).positions()[:, 20] - sampled[:, 18]
    sides = np.ptp(bone[10:50, 0]), np.ptp((sampled[:, 20] - sampled[:, 18])[10:50, 0]) / forearm
    assert 0.85 < sides[0] / sides[1] < 1.3


def test_what_is_drawn_wrongly_counts_less_than_how_it_changes() -> None:
    """Against the least squares written out, and whichever sign rotations have."""
    rng = np.random.default_rng(0)
    turns = rot.rotvec_to_quat(rng.normal(size=(12, 3)) * 0.3)
    error = np.array([0.0, 0.02, 0.12, 0.5, 1.0, 0.3] * 2)
    weight = np.sqrt((0.12 / error.clip(1e-6)) ** 2)
    change = np.diff(np.eye(12), axis=0)
    rows, wanted = (
        np.concatenate([np.diag(weight), change]),
        np.concatenate([weight[:, None] * turns, np.zeros((11, 4))]),
    )
    expected = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    flipped = turns * rng.choice([-1.0, 1.0], (12, 1))
    for one in (turns, flipped):
        found = ik._smooth_by_confidence(one, error)
        np.testing.assert_allclose(found * np.sign((found * expected).sum(-1, keepdims=True)), expected, atol=1e-6)
    rest = np.array([0.0, 0.2, 0.0])
    bones = np.outer([0.5, 1.0, 1.5, 0.0], [0.0, 0.0, 0.2])
    np.testing.assert_allclose(ik._length_error(bones, rest), [0.5, 0, 0, 1])  # what is too long shows its direction


def test_everything_in_one_point_is_still_a_motion() -> None:
    motion = motion_from_positions(np.zeros((4, 22, 3)), FPS)
    assert np.isfinite(motion.positions()).all()


@pytest.mark.parametrize("clip", ["07_01", "135_04", "05_02", "49_08"])
def test_real_people_are_followed(clip: str) -> None:
    positions = real(clip)
    motion = motion_from_positions(positions, FPS)
    error = np.linalg.norm(motion.positions() - positions, axis=-1)
    assert error.mean() < 0.02
    assert error[:, [7, 8, 15, 20, 21]].mean() < 0.005
    assert turning_speeds(motion).max() < 1.5 * bone_speeds(positions).max()
    bones = motion.positions()[:, 1:] - motion.positions()[:, list(SMPL22.parents[1:])]
    assert np.abs(np.linalg.norm(bones, axis=-1) - SMPL22.bone_lengths()[1:]).max() < 1e-9


def test_mistakes_are_reported() -> None:
    with pytest.raises(MotionloomError, match="positions must be"):
        motion_from_positions(np.zeros((4, 21, 3)), FPS)
    with pytest.raises(MotionloomError, match="not finite"):
        motion_from_positions(np.full((4, 22, 3), np.inf), FPS)
