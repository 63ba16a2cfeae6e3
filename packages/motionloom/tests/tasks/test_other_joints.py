"""Prediction by networks of other joints than the 22: what they say of their joints and rate is what is used."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT, Layout
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.io.layout_places import read_places
from motionloom.kinematics.layout_body import body_of_places, layout_skeleton, places_on_layout
from motionloom.retarget import joints22
from motionloom.tasks.other_joints import on_joints_of
from motionloom.tasks.predict import predict, predict_pieces, switch
from motionloom.tasks.splice import concatenate, person_at
from tests.recorded import tiny_predictor
from tests.tasks.test_edit import person

NAMES = ("hip", "left_hip", "right_hip", "head")
FOUR = Layout(NAMES, (-1, 0, 0, 0), (0, 2, 1, 3), root=False, z_up=True)
"""Some joints of Human3.6M, by its names and axes."""
FEW = {"count": 2, "steps": 2, "seconds": 0.5}


def predictor(layout: Layout = FOUR) -> Predictor:
    """A published network of these joints: 5 of 20 frames at 20 fps are seen; nothing is learned."""
    return replace(tiny_predictor.predictor("published"), layout=layout)


@pytest.mark.parametrize("fps", [20.0, 30.0, 120.0])
def test_a_clip_of_any_rate_goes_on_as_a_motion_of_the_networks_joints(fps: float) -> None:
    motions = predict(predictor(), person(1.0, fps), **FEW)
    assert len(motions) == 2
    for motion in motions:
        assert (motion.skeleton.names, motion.fps) == (NAMES, 20.0)
        assert len(motion) == 20 + 10
        assert np.isfinite(motion.positions()).all()
    assert np.array_equal(motions[0].root[:20], motions[1].root[:20])
    assert not np.allclose(motions[0].positions()[20:], motions[1].positions()[20:])


def test_left_stays_left_and_places_are_those_of_the_clip() -> None:
    clip = person(1.0, 20.0)
    places = on_joints_of(predictor(), clip).positions()
    real = person_at(clip, np.arange(20))
    for name in ("left_hip", "right_hip", "head"):
        apart = np.linalg.norm(places[:, NAMES.index(name)] - real[:, SMPL22.index(name)], axis=-1)
        assert apart.max() < 1e-6, name


def test_a_past_on_the_networks_joints_comes_back_bit_for_bit_and_the_root_stays() -> None:
    past = on_joints_of(predictor(), person(1.0, 30.0))
    motion = predict(predictor(), past, **FEW)[0]
    assert np.array_equal(motion.rotations[: len(past)], past.rotations)
    np.testing.assert_allclose(motion.root[len(past) :], np.broadcast_to(past.root[-1], (10, 3)), atol=1e-6)


def test_pieces_are_the_future_of_predict() -> None:
    chosen = {"steps": 2, "seconds": 1.7}
    whole = predict(predictor(), person(1.0, 20.0), count=2, **chosen)[1]
    pieces = concatenate(*predict_pieces(predictor(), person(1.0, 20.0), number=1, **chosen))
    np.testing.assert_allclose(pieces.positions(), whole.positions(), atol=1e-5)


@pytest.mark.parametrize("part", ["left_leg", "head"])
def test_held_joints_take_their_places_from_the_root(part: str) -> None:
    past = on_joints_of(predictor(), person(1.0, 20.0))
    source = past.frames(0, 10)
    hold = FixedJoints(source, (FixedPart((part,)),), align=False)
    motion = predict(predictor(), past, hold=hold, **FEW)[0].frames(20, 30)
    free = predict(predictor(), past, **FEW)[0].frames(20, 30)
    joint = NAMES.index("left_hip" if part == "left_leg" else "head")
    held, target, other = (one.positions() - one.root[:, None] for one in (motion, source, free))
    assert np.abs(held[:, joint] - target[:, joint]).max() < 1e-5
    assert np.abs(other[:, joint] - target[:, joint]).max() > 0.05


@pytest.mark.parametrize(
    ("part", "message"), [("root", "does not see the root's way"), ("right_arm", "no joint of right_arm to hold")]
)
def test_parts_that_the_network_does_not_have_are_refused(part: str, message: str) -> None:
    past = on_joints_of(predictor(), person(1.0, 20.0))
    with pytest.raises(MotionloomError, match=message):
        predict(predictor(), past, hold=FixedJoints(past, (FixedPart((part,)),)), **FEW)


@pytest.mark.parametrize("seconds", [0.3, 1.2])
def test_a_switch_arrives_at_the_target(seconds: float) -> None:
    past, target = person(1.0, 30.0), person(0.8, 30.0)
    motion = switch(predictor(), past, target, seconds=seconds, steps=2)[0]
    goal = on_joints_of(predictor(), target)
    assert len(motion) == 20 + round(20 * seconds) + len(goal)
    end = motion.frames(len(motion) - len(goal), len(motion))
    np.testing.assert_array_equal(
        end.rotations[:, 1:], on_joints_of(predictor(), target, skeleton=motion.skeleton).rotations[:, 1:]
    )
    between = motion.root[20 : 20 + round(20 * seconds)]
    np.testing.assert_allclose(end.root[0, [0, 2]], between[-1, [0, 2]], atol=1e-6)


def test_joints_that_correspond_to_none_of_the_22_need_places() -> None:
    strange = replace(FOUR, names=("hip", *(f"marker{k}" for k in range(3))))
    with pytest.raises(MotionloomError, match="'marker0' that corresponds to none of the 22"):
        predict(predictor(strange), person(1.0, 20.0), **FEW)


def test_places_are_read_in_the_axes_of_the_networks_data(tmp_path) -> None:
    real = places_on_layout(FOUR, joints22(person(1.0, 20.0)))
    upright = real[..., [2, 0, 1]]
    np.save(tmp_path / "past.npy", upright)
    np.savez(tmp_path / "past.npz", positions=upright.astype(np.float32), fps=25.0)
    array, archive = (read_places(tmp_path / f"past.{end}", FOUR, 20.0) for end in ("npy", "npz"))
    assert (array.fps, archive.fps) == (20.0, 25.0)
    assert np.abs(array.positions() - real).max() < 0.05
    assert isinstance(predict(predictor(), array, **FEW)[0], Motion)


@pytest.mark.parametrize(
    "array",
    [np.zeros((5, 22, 3)), np.zeros((1, 4, 3)), np.full((5, 4, 3), np.nan), np.zeros((5, 4, 3), int), np.zeros(3)],
    ids=["joints", "short", "nan", "whole", "flat"],
)
def test_arrays_that_are_no_places_of_the_network_are_refused(tmp_path, array: np.ndarray) -> None:
    np.save(tmp_path / "past.npy", array)
    with pytest.raises(MotionloomError, match=r"past\.npy"):
        read_places(tmp_path / "past.npy", FOUR, 20.0)


def test_a_body_of_places_has_those_places_and_turns_with_its_bones() -> None:
    """Forward kinematics of a random motion of a skeleton, and back."""
    rng = np.random.default_rng(0)
    real = joints22(person(1.0, 20.0))
    skeleton = layout_skeleton(SMPL_LAYOUT, real)
    angles = 0.3 * rng.standard_normal((4, 22, 4)) + [1, 0, 0, 0]
    motion = Motion(
        skeleton, 20.0, rng.standard_normal((4, 3)), angles / np.linalg.norm(angles, axis=-1, keepdims=True)
    )
    again = body_of_places(motion.positions(), skeleton, 20.0)
    np.testing.assert_allclose(again.positions(), motion.positions(), atol=1e-9)
    single = [j for j in range(1, 22) if len(SMPL22.children(SMPL22.parents[j])) == 1]
    assert again.translations is not None
    np.testing.assert_allclose(
        again.translations[:, single], np.broadcast_to(skeleton.offsets[single], (4, len(single), 3)), atol=1e-6
    )
