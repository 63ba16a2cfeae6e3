"""A motion keeps its meaning on another body: directions, planted feet, sides, and the target's own bones."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import from_smpl22, joints22, retarget, to_smpl22
from motionloom.retarget.axes import CHILD
from tests.shared import shared

BONES = [(j, c) for j, c in enumerate(CHILD) if c is not None]
ARMS = [(j, c) for j, c in BONES if j in (16, 17, 18, 19)]
COLLARS = [(13, 16), (14, 17)]
LEGS = [(j, c) for j, c in BONES if j in (1, 2, 4, 5)]


def stroll(frames: int = 60) -> Motion:
    """The uniform person walks and waves: pelvis on a path, knees bent, every joint moving smoothly."""
    time = np.linspace(0, 4 * np.pi, frames)
    turns = np.zeros((frames, 22, 3))
    for side, leg, sign in ((0, (1, 4, 7), 1.0), (1, (2, 5, 8), -1.0)):
        swing = 0.4 * np.sin(time) * sign
        turns[:, leg[0], 0] = -swing - 0.25
        turns[:, leg[1], 0] = 0.5 + 0.3 * np.cos(time) * sign
        turns[:, leg[2], 0] = -0.2
        turns[:, 16 + side, 2] = -sign * (0.9 + 0.3 * np.sin(time))
        turns[:, 18 + side, 1] = -sign * (0.6 + 0.3 * np.cos(time))
    turns[:, 3] = 0.1 * np.sin(time)[:, None] * [1.0, 0.5, 0.2]
    turns[:, 15, 1] = 0.4 * np.sin(time / 2)
    turns[:, 0, 1] = 0.3 * np.sin(time / 3)
    root = np.stack([0.1 * np.sin(time / 2), 0.86 + 0.01 * np.cos(2 * time), 0.15 * time], axis=-1)
    return Motion(SMPL22, 30.0, root, rot.rotvec_to_quat(turns))


def refitted(motion: Motion, frames: np.ndarray) -> Motion:
    """The same places on a skeleton whose joint axes are turned by constants (joints, 4): another zero pose."""
    parents = list(motion.skeleton.parents[1:])
    offsets = motion.skeleton.offsets.copy()
    offsets[1:] = rot.rotate(rot.inverse(frames[parents]), offsets[1:])
    world = rot.multiply(motion.world_rotations(), frames)
    local = world.copy()
    local[:, 1:] = rot.multiply(rot.inverse(world[:, parents]), world[:, 1:])
    skeleton = Skeleton(motion.skeleton.names, motion.skeleton.parents, offsets, motion.skeleton.ends)
    return replace(motion, skeleton=skeleton, rotations=local)


def errors(a: np.ndarray, b: np.ndarray, bones: list[tuple[int, int]]) -> np.ndarray:
    """Degrees between bone directions, (frames, bones)."""
    result = []
    for j, c in bones:
        u, v = a[:, c] - a[:, j], b[:, c] - b[:, j]
        sine, cosine = np.linalg.norm(np.cross(u, v), axis=-1), (u * v).sum(-1)
        result.append(np.degrees(np.arctan2(sine, cosine)))
    return np.stack(result, axis=1)


def centred(places: np.ndarray) -> np.ndarray:
    return places - places[:, :1]


def bone_error(motion: Motion) -> float:
    places, parents = motion.positions(), list(motion.skeleton.parents[1:])
    lengths = np.linalg.norm(places[:, 1:] - places[:, parents], axis=-1)
    return float(np.abs(lengths - motion.skeleton.bone_lengths()[1:]).max())


def test_the_uniform_person_on_itself_is_unchanged_but_for_the_floor() -> None:
    motion = stroll()
    again = to_smpl22(motion)
    assert np.allclose(centred(again.positions()), centred(motion.positions()), atol=1e-6)
    assert np.abs((again.rotations * motion.rotations).sum(-1)).min() > 1 - 1e-9
    path, path_again = motion.root - motion.root[0], again.root - again.root[0]
    assert np.allclose(path_again, path, atol=0.04)


def test_a_bigger_body_strikes_the_same_poses_and_walks_further() -> None:
    motion = stroll()
    giant = Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets * 1.5)
    grown = from_smpl22(motion, giant)
    assert np.allclose(centred(grown.positions()), 1.5 * centred(motion.positions()), atol=1e-6)
    assert np.linalg.norm(grown.root[-1] - grown.root[0]) == pytest.approx(
        1.5 * np.linalg.norm(motion.root[-1] - motion.root[0]), rel=0.02
    )
    back = to_smpl22(grown)
    assert np.allclose(centred(back.positions()), centred(motion.positions()), atol=1e-6)


def a_pose() -> np.ndarray:
    """Joint frames that put the arms 45 degrees down at rest."""
    frames = np.tile(rot.IDENTITY, (22, 1))
    for side, sign in ((0, 1.0), (1, -1.0)):
        for j in (16 + side, 18 + side, 20 + side):
            frames[j] = rot.rotvec_to_quat(np.array([0.0, 0.0, sign * np.pi / 4]))
    return frames


def test_an_a_pose_rig_gets_the_same_pose() -> None:
    motion = stroll()
    target = refitted(motion, a_pose()).skeleton
    rest = target.rest_positions()
    assert rest[20, 1] < rest[16, 1] - 0.3
    assert np.allclose(centred(from_smpl22(motion, target).positions()), centred(motion.positions()), atol=1e-6)


def test_an_a_pose_source_gives_back_the_t_pose_rotations() -> None:
    motion = stroll()
    again = to_smpl22(refitted(motion, a_pose()))
    assert np.degrees(2 * np.arccos(np.abs((again.rotations * motion.rotations).sum(-1)).clip(0, 1))).max() < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_a_rig_whose_zero_pose_is_nonsense_gets_the_same_places(seed: int) -> None:
    motion = stroll()
    frames = rot.normalize(np.random.default_rng(seed).normal(size=(22, 4)))
    target = refitted(motion, frames).skeleton
    out = from_smpl22(motion, target)
    assert np.percentile(errors(out.positions(), motion.positions(), BONES), 99) < 3.0
    assert bone_error(out) < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_a_source_whose_zero_pose_is_nonsense_gives_the_same_places(seed: int) -> None:
    motion = stroll()
    frames = rot.normalize(np.random.default_rng(seed).normal(size=(22, 4)))
    out = to_smpl22(refitted(motion, frames))
    limbs = [(j, c) for j, c in BONES if j in (1, 2, 4, 5, 16, 17, 18, 19)]
    assert errors(out.positions(), motion.positions(), limbs).mean() < 3.0


def test_extra_joints_stay_at_rest_and_a_root_above_the_hips_is_kept() -> None:
    names = ("world", *SMPL22.names, "finger", "tail")
    parents = (-1, 0, *(p + 1 for p in SMPL22.parents[1:]), 21, 1)
    offsets = np.concatenate([[[0.3, 0.2, -5.0]], SMPL22.offsets, [[0.1, 0.0, 0.0], [0.0, 0.0, -0.2]]])
    target = Skeleton(names, parents, offsets)
    motion = stroll()
    out = from_smpl22(motion, target)
    assert out.skeleton == target
    assert np.allclose(out.rotations[:, [0, 23, 24]], rot.IDENTITY)
    assert np.allclose(centred(out.positions()[:, 1:23]), centred(motion.positions()), atol=1e-6)


def test_left_stays_left() -> None:
    motion = stroll()
    wave = motion.rotations.copy()
    wave[:, 16] = rot.rotvec_to_quat(np.array([0.0, 0.0, 1.2]))  # left arm up
    motion = replace(motion, rotations=wave)
    mirrored = to_smpl22(motion.mirror()).positions()
    assert (to_smpl22(motion).positions()[:, 20, 1] > mirrored[:, 20, 1] + 0.5).all()


def test_a_z_up_recording_is_stood_up() -> None:
    motion = stroll()
    fall = rot.rotvec_to_quat(np.array([np.pi / 2, 0.0, 0.0]))  # +Y to +Z
    offsets = rot.rotate(fall, SMPL22.offsets)
    skeleton = Skeleton(SMPL22.names, SMPL22.parents, offsets)
    local = rot.multiply(rot.multiply(fall, motion.rotations), rot.inverse(fall))
    fallen = Motion(skeleton, 30.0, rot.rotate(fall, motion.root), local)
    assert np.allclose(fallen.positions(), rot.rotate(fall, motion.positions()))
    assert np.allclose(to_smpl22(fallen).positions(), to_smpl22(motion).positions(), atol=1e-6)


def test_a_foot_whose_end_site_points_straight_down_still_faces_forward() -> None:
    offsets = SMPL22.offsets.copy()
    offsets[[10, 11]] = [0.0, -0.07, 0.0]
    target = Skeleton(SMPL22.names, SMPL22.parents, offsets)
    motion = stroll()
    out = from_smpl22(motion, target)
    assert errors(out.positions(), motion.positions(), LEGS).mean() < 10.0
    turned = rot.multiply(out.world_rotations(), rot.inverse(motion.world_rotations()))[:, [7, 8]]
    assert np.degrees(np.linalg.norm(rot.quat_to_rotvec(turned), axis=-1)).max() < 10.0


def test_a_map_that_leaves_a_leg_without_a_knee_is_refused() -> None:
    with pytest.raises(MotionloomError, match="left_knee"):
        to_smpl22(stroll(), {"left_knee": "left_ankle"})


def straight_legs() -> Motion:
    """Standing with straight knees, swaying over planted feet."""
    motion = stroll()
    rotations = np.tile(rot.IDENTITY, (60, 22, 1))
    sway = 0.03 * np.sin(np.linspace(0, 6, 60))
    lean = rot.rotvec_to_quat(sway[:, None] * np.array([0.0, 0.0, 1.0]))
    rotations[:, 0] = lean
    rotations[:, [1, 2]] = rot.inverse(lean)[:, None]
    root = np.tile(SMPL22.offsets[0], (60, 1))
    return Motion(SMPL22, motion.fps, root, rotations)


def test_straight_knees_stay_nearly_straight_and_never_bend_backwards() -> None:
    offsets = SMPL22.offsets.copy()
    offsets[[10, 11]] *= 1.4
    offsets[[1, 2], 0] *= 1.5
    out = from_smpl22(straight_legs(), Skeleton(SMPL22.names, SMPL22.parents, offsets)).positions()
    for hip, knee, ankle in ((1, 4, 7), (2, 5, 8)):
        between = (out[:, hip] + out[:, ankle]) / 2
        ahead = (out[:, knee] - between)[:, 2]
        assert ahead.min() > -0.005
        assert np.linalg.norm(out[:, hip] - out[:, ankle], axis=-1).min() > 0.97 * (0.3936 + 0.4256)


def test_feet_out_of_reach_bring_the_hips_down_instead_of_leaving_their_place() -> None:
    offsets = SMPL22.offsets.copy()
    offsets[[1, 2], 0] *= 1.7  # hips so wide that straight legs cannot reach the narrow stance from full height
    motion = straight_legs()
    out = from_smpl22(motion, Skeleton(SMPL22.names, SMPL22.parents, offsets)).positions()
    toes, wanted = out[:, [10, 11]], motion.positions()[:, [10, 11]]
    assert np.abs(toes - wanted)[..., [0, 2]].max() < 0.01
    assert np.abs(toes[..., 1]).max() < 0.01


def test_feet_of_a_body_that_is_broader_than_people_move_apart() -> None:
    """A toy's legs hang on hips as wide as they are long: its feet are under them, and its knees stay straight."""
    offsets = SMPL22.offsets.copy()
    offsets[[1, 2], 0] *= 6.0
    motion = straight_legs()
    out = from_smpl22(motion, Skeleton(SMPL22.names, SMPL22.parents, offsets)).positions()
    broad = 0.28 * (0.3936 + 0.4256)
    apart = (out[:, 10] - out[:, 11])[:, 0] - (motion.positions()[:, 10] - motion.positions()[:, 11])[:, 0]
    np.testing.assert_allclose(apart, 12 * SMPL22.offsets[1, 0] - broad, atol=0.03)
    for hip, ankle in ((1, 7), (2, 8)):
        assert np.linalg.norm(out[:, hip] - out[:, ankle], axis=-1).min() > 0.97 * (0.3936 + 0.4256)


def test_one_frame_is_enough() -> None:
    assert len(to_smpl22(stroll().frames(7, 8))) == 1


def test_a_skeleton_that_is_no_person_is_refused() -> None:
    rope = Skeleton(("a", "b", "c"), (-1, 0, 1), np.ones((3, 3)))
    with pytest.raises(MotionloomError, match="not a humanoid"):
        from_smpl22(stroll(), rope)


# Real clips ----------------------------------------------------------------------------------------------------------

WALKS = (
    "cmu/asf_amc/02/02_01.amc",
    "cmu/asf_amc/07/07_01.amc",
    "cmu/asf_amc/16/16_15.amc",
    "cmu/asf_amc/35/35_01.amc",
    "cmu/bvh/07_04.bvh",
    "cmu/bvh/10_04.bvh",
    "cmu/bvh/12_01.bvh",
    "bandai/dataset-1/dataset-1_walk_normal_001.bvh",
)


def clip(path: str) -> Motion:
    from motionloom.io.asf import load_asf_amc  # late: only these tests need the readers
    from motionloom.io.bvh import load_bvh

    place: Path = shared(f"data/{path}")
    if place.suffix == ".amc":
        return load_asf_amc(next(place.parent.glob("*.asf")), place, fps=30)
    return load_bvh(place, unit=0.01)


def skate(places: np.ndarray, fps: float, planted: np.ndarray) -> float:
    """Mean horizontal speed of toes over the given (frames, 2) planted moments, metres per second."""
    speed = np.linalg.norm(np.diff(places[:, [10, 11]][..., [0, 2]], axis=0), axis=-1) * fps
    return float(speed[planted[1:] & planted[:-1]].mean())


@pytest.mark.parametrize("path", WALKS)
def test_feet_of_real_walks_stay_on_the_floor_and_do_not_slide(path: str) -> None:
    motion = clip(path)
    source, out = joints22(motion), to_smpl22(motion)
    places = out.positions()
    lowest = places[:, [7, 8, 10, 11], 1].min(axis=1)
    assert np.maximum(-lowest, 0).mean() < 0.008
    assert np.maximum(lowest, 0).mean() < 0.008
    toes = source[:, [10, 11]]
    speed = np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * motion.fps
    planted = (speed < 0.4) & (toes[..., 1] < np.percentile(toes[..., 1], 10) + 0.06)
    assert skate(places, 30.0, planted) <= 1.1 * skate(source, 30.0, planted)
    assert bone_error(out) < 1e-9


@pytest.mark.parametrize("path", [*WALKS, "cmu/asf_amc/49/49_07.amc"])
def test_real_clips_keep_directions_there_and_back(path: str) -> None:
    motion = clip(path)
    source, person = joints22(motion), to_smpl22(motion)
    assert errors(source, person.positions(), ARMS).mean() < 1.0
    assert errors(source, person.positions(), LEGS).mean() < 6.5
    back = from_smpl22(person, motion.skeleton)
    assert errors(source, joints22(back), ARMS).mean() < 1.0
    assert errors(source, joints22(back), COLLARS).mean() < 4.0  # bones of other lengths
    assert errors(source, joints22(back), LEGS).mean() < 5.0
    assert bone_error(back) < 1e-9


def test_any_family_goes_onto_any_other() -> None:
    clips = [clip(path) for path in (WALKS[1], WALKS[4], WALKS[7])]
    for motion in clips:
        for target in clips:
            out = retarget(motion, target.skeleton)
            assert errors(joints22(motion), joints22(out), ARMS).mean() < 2.0
            assert bone_error(out) < 1e-9


def test_a_sample_of_the_whole_pack_goes_through_without_pops() -> None:
    with shared("data/manifest.csv").open() as file:
        paths = [row["path"] for row in csv.DictReader(file) if not row["notes"]][::131]
    for path in paths:
        person = to_smpl22(clip(path))
        turn = np.abs((person.rotations[1:] * person.rotations[:-1]).sum(-1)).clip(0, 1)
        assert np.degrees(2 * np.arccos(turn)).max() < 75.0, path


# Rigs of other shapes ------------------------------------------------------------------------------------------------

# Name, parent, offset in metres (left side; the right is its mirror image): the tree of CMU's MotionBuilder-friendly
# BVH (hip and shoulder joints on the middle line, two neck joints) and a small rig without collar bones.
CGSPEED = """Hips - 0 0.93 0 | LHipJoint Hips 0 0 0 | LeftUpLeg LHipJoint .1 -.1 .05 | LeftLeg LeftUpLeg .14 -.37 0
| LeftFoot LeftLeg .14 -.4 0 | LeftToeBase LeftFoot .01 -.03 .13 | LowerBack Hips 0 0 0 | Spine LowerBack 0 .12 -.01
| Spine1 Spine 0 .12 0 | Neck Spine1 0 0 0 | Neck1 Neck 0 .1 .02 | Head Neck1 0 .08 0 | LeftShoulder Spine1 0 0 0
| LeftArm LeftShoulder .18 .09 0 | LeftForeArm LeftArm .28 0 0 | LeftHand LeftForeArm .19 0 0
| LeftThumb LeftHand 0 0 .05"""
SMALL = """Root - 0 0 0 | Hip Root 0 .95 0 | LThigh Hip .09 -.03 0 | LShin LThigh 0 -.43 .01 | LFoot LShin 0 -.42 -.02
| LFootEnd LFoot 0 -.06 .14 | Torso Hip 0 .2 0 | Head Torso 0 .4 .02 | LUpperArm Torso .19 .28 0
| LForearm LUpperArm .18 -.2 0 | LHand LForearm .17 -.19 .02"""


def built(text: str) -> Skeleton:
    """A skeleton from one side's joints."""
    rows: list[tuple[str, str, np.ndarray]] = []
    for entry in text.split("|"):
        name, parent, *offset = entry.split()
        rows.append((name, parent, np.array([float(x) for x in offset])))
        if name.startswith("L") and name != "LowerBack":
            word = "Left" if name.startswith("Left") else "L"
            other = parent.replace(word, "Right" if word == "Left" else "R", 1) if parent.startswith("L") else parent
            other = other.replace("LHip", "RHip")
            mirrored = name.replace(word, "Right" if word == "Left" else "R", 1)
            rows.append((mirrored, other, rows[-1][2] * [-1, 1, 1]))
    names = [name for name, _, _ in rows]
    parents = tuple(-1 if parent == "-" else names.index(parent) for _, parent, _ in rows)
    return Skeleton(tuple(names), parents, np.stack([offset for _, _, offset in rows]))


@pytest.mark.parametrize("rig", [CGSPEED, SMALL], ids=["cgspeed", "no collars"])
def test_rigs_of_other_trees_take_the_pose_and_give_it_back(rig: str) -> None:
    target, motion = built(rig), stroll()
    out = from_smpl22(motion, target)
    limbs = [(j, c) for j, c in BONES if j in (4, 5, 16, 17, 18, 19)]
    assert errors(joints22(out), motion.positions(), limbs).mean() < 5.0
    assert errors(joints22(out), motion.positions(), [(16, 18), (17, 19), (18, 20), (19, 21)]).max() < 1e-3
    assert bone_error(out) < 1e-9
    back = to_smpl22(out)
    assert errors(back.positions(), motion.positions(), limbs).mean() < 3.0
    turn = np.degrees(2 * np.arccos(np.abs((back.rotations * motion.rotations).sum(-1)).clip(0, 1)))
    assert turn[:, [0, 16, 17, 18, 19]].max() < 12.0


def test_a_rest_pose_with_one_foot_in_the_air_still_walks_on_both() -> None:
    """A file without a mesh may hold a step of its clip as its rest: the lifted foot is no flat one."""
    turns = np.zeros((22, 3))
    turns[2, 0], turns[5, 0], turns[8, 0] = -0.2, 1.2, 0.3
    step = Motion(SMPL22, 30.0, SMPL22.offsets[:1], rot.rotvec_to_quat(turns)[None])
    world = step.world_rotations()[0]
    rest = step.positions()[0]
    offsets = rest - np.vstack([np.zeros(3), rest[list(SMPL22.parents[1:])]])
    lifted = Skeleton(SMPL22.names, SMPL22.parents, offsets, on_floor=True)
    plain = Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets, on_floor=True)
    walk = stroll()
    made, wanted = from_smpl22(walk, lifted), from_smpl22(walk, plain)
    assert np.allclose(made.positions(), wanted.positions(), atol=0.02)
    sole, flat = rot.multiply(made.world_rotations(), world), wanted.world_rotations()
    assert np.degrees(2 * np.arccos(np.abs((sole * flat).sum(-1)[:, [7, 8]]).min())) < 6
