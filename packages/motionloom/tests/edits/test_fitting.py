"""The exact fit on a person who stands, and on one who takes steps of whole half metres."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.edits import fitting
from motionloom.edits.fitting import ROUND, fit
from motionloom.goals.goal import Goal

WRIST = SMPL22.index("right_wrist")
RNG = np.random.default_rng(0)


def standing(frames: int = 100) -> Motion:
    """A person with bent arms and knees who sways a little."""
    bends = np.zeros((22, 3))
    bends[[1, 2], 0], bends[[4, 5], 0] = -0.15, 0.3
    bends[[7, 8], 0] = -0.15
    bends[16, 2], bends[17, 2], bends[18, 1], bends[19, 1] = -0.9, 0.9, -0.8, 0.8
    sway = 0.03 * np.sin(np.arange(frames) / 9)[:, None, None] * RNG.normal(size=(1, 22, 3))
    sway[:, [0, 1, 2, 4, 5, 7, 8, 18, 19]] = 0
    motion = Motion(SMPL22, 20.0, np.zeros((frames, 3)), rot.rotvec_to_quat(bends + sway))
    lowest = motion.positions()[..., 1].min()
    return replace(motion, root=motion.root - [0, lowest, 0])


def goal_for(motion: Motion, joint: int, frames: slice | list[int], places: np.ndarray) -> Goal:
    goal = Goal.nothing(len(motion))
    goal.positions[frames, joint], goal.mask[frames, joint] = places, True
    return goal


def off(motion: Motion, goal: Goal) -> NDArray[np.float64]:
    error = np.where(goal.mask, motion.positions() - goal.positions, 0.0)
    return np.linalg.norm(error, axis=-1)[goal.mask.any(-1)]


def lengths(motion: Motion) -> NDArray[np.float64]:
    places = motion.positions()
    return np.linalg.norm(places[:, 1:] - places[:, list(SMPL22.parents[1:])], axis=-1)


def test_no_target_and_a_target_that_is_met_leave_the_motion_alone() -> None:
    motion = standing()
    assert fit(motion, Goal.nothing(100)) is motion
    goal = replace(Goal.nothing(100), positions=motion.positions(), mask=np.ones((100, 22, 3), bool))
    assert fit(motion, goal) is motion


def test_a_circle_of_the_wrist_is_met_to_a_millimetre_on_constant_bones_and_still_feet() -> None:
    motion = standing()
    time = np.arange(100) / 20
    circle = np.stack([-0.2 + 0.15 * np.cos(2 * time), 1.2 + 0.15 * np.sin(2 * time), 0.35 + 0 * time], axis=-1)
    goal = goal_for(motion, WRIST, slice(None), circle)
    fitted = fit(motion, goal)
    assert off(fitted, goal).max() < 0.001
    np.testing.assert_allclose(lengths(fitted), lengths(motion), atol=1e-9)
    feet = [7, 8, 10, 11]
    np.testing.assert_allclose(fitted.positions()[:, feet], motion.positions()[:, feet], atol=0.003)


def test_keyframes_are_met_smoothly_and_frames_far_away_stay_exactly() -> None:
    """20 cm within a stretch of 60 frames: no frame's acceleration is more than a quarter of what a spike has."""
    motion = standing(200)
    place = motion.positions()[60, WRIST] + [0.1, 0.15, 0.05]
    goal = goal_for(motion, WRIST, [60], place)
    fitted = fit(motion, goal)
    assert off(fitted, goal).max() < 0.001
    change = np.linalg.norm(np.diff((fitted.positions() - motion.positions())[:, WRIST], n=2, axis=0), axis=-1)
    assert change.max() < 0.25 * 0.19
    far = np.r_[0 : 60 - ROUND, 61 + ROUND : 200]
    np.testing.assert_array_equal(fitted.rotations[far], motion.rotations[far])
    np.testing.assert_array_equal(fitted.root[far], motion.root[far])


def test_a_quarter_turned_world_gives_the_quarter_turned_motion() -> None:
    motion = standing(60)
    place = GroundPose(2.0, -1.0, np.pi / 2)
    goal = goal_for(motion, WRIST, [30], motion.positions()[30, WRIST] + [0.1, 0.2, 0.0])
    turn = rot.rotvec_to_quat(np.array([0.0, np.pi / 2, 0.0]))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
    elsewhere = replace(motion, root=place.to_world(motion.root), rotations=rotations)
    turned = fit(elsewhere, replace(goal, positions=place.to_world(goal.positions)))
    np.testing.assert_allclose(turned.positions(), place.to_world(fit(motion, goal).positions()), atol=1e-5)


def test_the_mirror_image_is_fitted_to_the_mirror_image() -> None:
    """To 6 mm: the person's own left and right bones differ by millimetres, and the other hand is asked."""
    motion = standing(60)
    place = motion.positions()[30, WRIST] + [0.1, 0.2, 0.0]
    mirrored = fit(motion, goal_for(motion, WRIST, [30], place)).mirror().positions()
    other = fit(motion.mirror(), goal_for(motion, SMPL22.index("left_wrist"), [30], place * [-1, 1, 1])).positions()
    np.testing.assert_allclose(mirrored, other, atol=0.006)


def test_out_of_reach_the_arm_points_there_and_the_body_stays() -> None:
    motion = standing(60)
    goal = goal_for(motion, WRIST, slice(25, 35), np.array([-0.2, 5.0, 0.0]))
    fitted = fit(motion, goal)
    places = fitted.positions()
    np.testing.assert_allclose(lengths(fitted), lengths(motion), atol=1e-9)
    shoulder, wrist = places[30, SMPL22.index("right_shoulder")], places[30, WRIST]
    assert wrist[1] - shoulder[1] > 0.45
    assert np.abs(places - motion.positions())[:, [0, 7, 8]].max() < 0.06


def test_knees_and_elbows_do_not_turn_over() -> None:
    """A wrist pulled straight and pushed past the shoulder: the elbow's bend keeps its sign."""
    motion = standing(60)
    shoulder = motion.positions()[30, SMPL22.index("right_shoulder")]
    for way in ([-0.6, 0.0, 0.0], [0.0, 0.1, -0.5], [0.1, 0.0, 0.1]):
        fitted = fit(motion, goal_for(motion, WRIST, [30], shoulder + way))
        pose = fitting._Pose(fitted.root, fitted.rotations, np.zeros((60, fitting._COLUMNS)))
        assert fitting._bends(*pose.places_and_world()).min() > -0.01


def walking(frames: int = 100) -> Motion:
    """Legs that swing for 10 frames and stand for 10, the root at 2.5 cm a frame."""
    body = standing(1).positions()[0]
    places = np.tile(body, (frames, 1, 1))
    places[..., 2] += 0.025 * np.arange(frames)[:, None]
    for joints, phase in (((7, 10), 0), ((8, 11), 10)):
        cycle = (np.arange(frames) + phase) % 20
        step = (np.arange(frames) + phase) // 20
        swing = np.clip((cycle - 10) / 10, 0, 1)
        swing = swing * swing * (3 - 2 * swing)
        for joint in joints:
            places[:, joint, 2] = body[joint, 2] + 0.5 * (step + swing) - 0.025 * phase + 0.125
            places[:, joint, 1] = body[joint, 1] + 0.1 * np.sin(np.pi * swing)
    return motion_from_positions(places, 20.0)


def test_a_shifted_path_is_met_and_standing_feet_still_stand() -> None:
    """The path drifts 30 cm to the side: ankles that stood move no more than before, in every frame of a stance."""
    motion = walking()
    goal = Goal.nothing(100)
    goal.positions[:, 0] = motion.root + np.stack([0.3 * np.arange(100) / 99, *np.zeros((2, 100))], axis=-1)
    goal.mask[:, 0, [0, 2]] = True
    fitted = fit(motion, goal)
    assert off(fitted, goal).max() < 0.001
    standing_frames = ((np.arange(99) % 20) > 1) & ((np.arange(99) % 20) < 8)
    slid = np.linalg.norm(np.diff(fitted.positions()[:, 7][:, [0, 2]], axis=0), axis=-1)[standing_frames]
    before = np.linalg.norm(np.diff(motion.positions()[:, 7][:, [0, 2]], axis=0), axis=-1)[standing_frames]
    assert slid.max() < before.max() + 0.003


def test_derivatives_are_those_of_finite_differences() -> None:
    """Places against each number of a change that is far from zero."""
    motion = standing(2)
    change = RNG.normal(size=(2, fitting._COLUMNS))
    pose = fitting._Pose(motion.root, motion.rotations, change)
    places, world = pose.places_and_world()
    joints = tuple(range(22))
    jacobian = pose.jacobian(joints, places, pose.axes(world))
    for column in range(fitting._COLUMNS):
        step = np.zeros_like(change)
        step[:, column] = 1e-5
        ends = [replace(pose, change=change + sign * step).places_and_world()[0] for sign in (1, -1)]
        np.testing.assert_allclose(jacobian[..., column], (ends[0] - ends[1]) / 2e-5, atol=1e-7)


@pytest.mark.parametrize(("frames", "before", "after"), [(7, True, False), (8, False, True), (2, False, False)])
def test_the_banded_solution_is_that_of_the_whole_matrix(frames: int, before: bool, after: bool) -> None:
    """Second differences written out as a matrix, with zeros outside where there are frames."""
    n = 3
    rows = RNG.normal(size=(frames, n, n))
    blocks, right = rows @ rows.swapaxes(-1, -2), RNG.normal(size=(frames, n))
    padded = np.diff(np.eye(frames + 4), n=2, axis=0)
    keep = slice(None if before else 2, None if after else -2)
    second = padded[keep][:, 2:-2]
    whole = np.kron(np.eye(frames) + fitting.SLOW**2 * second.T @ second, np.eye(n))
    for f in range(frames):
        whole[f * n : f * n + n, f * n : f * n + n] += blocks[f]
    solution = fitting._banded(blocks, right, fitting._stiffness(frames, before, after))
    np.testing.assert_allclose(solution.ravel(), np.linalg.solve(whole, right.ravel()), rtol=1e-6)


def test_what_cannot_be_fitted_is_said() -> None:
    with pytest.raises(MotionloomError, match="frames"):
        fit(standing(20), Goal.nothing(10))
