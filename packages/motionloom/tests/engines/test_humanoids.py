"""The humanoids that engines document, bone by bone: our skeletons are those, and characters with theirs are read.

The tables are Unity's `HumanBodyBones`, Godot's `SkeletonProfileHumanoid`, VRM 1.0's `humanBones`, and the mannequins
of Unreal that its IK Rig recognises by itself. No engine runs here; docs/engines says what that leaves open.
"""

from itertools import pairwise

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import joint_map, retarget
from motionloom.retarget.named import named_skeleton
from tests.io.test_blender import waver

# From the hips up, and the limbs of one side with what they hang on; "@" is the side.
_UNITY = "Hips Spine Chest UpperChest Neck Head"
_UNITY_LIMBS = "UpperChest>@Shoulder>@UpperArm>@LowerArm>@Hand Hips>@UpperLeg>@LowerLeg>@Foot>@Toes"
_EPIC_LIMBS = "{}>clavicle_@>upperarm_@>lowerarm_@>hand_@ pelvis>thigh_@>calf_@>foot_@>ball_@"
_EPIC_HELPERS = (
    "root>ik_foot_root>ik_foot_@ root>ik_hand_root>ik_hand_gun>ik_hand_@ upperarm_@>upperarm_twist_01_@ "
    "lowerarm_@>lowerarm_twist_01_@ thigh_@>thigh_twist_01_@ calf_@>calf_twist_01_@ hand_@>thumb_01_@>thumb_02_@ "
)
HUMANOIDS = {
    "Unity": ("Left Right", _UNITY, _UNITY_LIMBS, "Head>@Eye Head>Jaw @Hand>@ThumbProximal>@ThumbIntermediate"),
    "Godot": ("Left Right", "Root " + _UNITY, _UNITY_LIMBS, "Head>@Eye @Hand>@ThumbMetacarpal>@ThumbProximal"),
    "VRM": (
        "left right",
        "hips spine chest upperChest neck head",
        "upperChest>@Shoulder>@UpperArm>@LowerArm>@Hand hips>@UpperLeg>@LowerLeg>@Foot>@Toes",
        "head>@Eye head>jaw @Hand>@ThumbMetacarpal>@ThumbProximal @Hand>@IndexProximal>@IndexIntermediate",
    ),
    "UE4": (
        "l r",
        "root pelvis spine_01 spine_02 spine_03 neck_01 head",
        _EPIC_LIMBS.format("spine_03"),
        _EPIC_HELPERS + "hand_@>index_01_@>index_02_@",
    ),
    "UE5": (
        "l r",
        "root pelvis spine_01 spine_02 spine_03 spine_04 spine_05 neck_01 neck_02 head",
        _EPIC_LIMBS.format("spine_05"),
        _EPIC_HELPERS + "hand_@>index_metacarpal_@>index_01_@ hand_@>pinky_metacarpal_@>pinky_01_@",
    ),
}
ARM, LEG = ("collar", "shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "foot")


def tree(name: str, *, helpers: bool) -> dict[str, str]:
    """Bones of a documented humanoid, each with what it hangs on."""
    sides, middle, limbs, more = HUMANOIDS[name]
    chain = middle.split()
    bones = dict(zip(chain, ["", *chain]))
    for path in (limbs + " " + more if helpers else limbs).split():
        for side in sides.split():
            words = [word.replace("@", side) for word in path.split(">")]
            bones |= {child: bones.get(child, parent) for parent, child in pairwise(words)}
    return bones


def parts(name: str) -> dict[str, str]:
    """SMPL's joints of the limbs, the pelvis, the neck and the head, and the bones that they are."""
    sides, middle, limbs, _ = HUMANOIDS[name]
    chain = [word for word in middle.split() if word.lower() != "root"]
    found = {"pelvis": chain[0], "neck": next(w for w in chain if "neck" in w.lower()), "head": chain[-1]}
    for path, joints in zip(limbs.split(), (ARM, LEG)):
        for side, mark in zip(("left", "right"), sides.split()):
            words = [word.replace("@", mark) for word in path.split(">")[1:]]
            found |= {f"{side}_{joint}": word for joint, word in zip(joints, words)}
    return found


def skeleton_of(name: str) -> Skeleton:
    """Somebody's character of that kind: the uniform person in an A-pose, with helper bones."""
    bones, known = tree(name, helpers=True), {bone: joint for joint, bone in parts(name).items()}
    rest = SMPL22.rest_positions()
    for side, sign in (("left", 1), ("right", -1)):  # arms hang at 45 degrees, as a mannequin's
        shoulder, *below = (SMPL22.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist"))
        turn = rot.rotvec_to_quat(np.array([0.0, 0.0, -sign * np.pi / 4]))
        rest[below] = rest[shoulder] + rot.rotate(turn, rest[below] - rest[shoulder])
    between = [bone for bone in bones if "spine" in bone.lower() or "chest" in bone.lower()]
    low, high = rest[0], rest[SMPL22.index("neck")]
    places = {bone: low + (high - low) * (k + 1) / (len(between) + 1) for k, bone in enumerate(between)}
    places |= {bone: rest[SMPL22.index(joint)] for bone, joint in known.items()}
    for bone, parent in bones.items():
        if bone not in places:  # a helper, or a root on the ground
            places[bone] = places[parent] + [0.0, 0.01, 0.03] if parent else np.zeros(3)
    names = list(bones)
    above = tuple(names.index(parent) if parent else -1 for parent in bones.values())
    offsets = np.array([places[bone] - (places[parent] if parent else 0.0) for bone, parent in bones.items()])
    return Skeleton(tuple(names), above, offsets)


@pytest.mark.parametrize(("name", "ours"), [("UE4", "unreal"), ("VRM", "vrm")])
def test_a_skeleton_of_ours_has_an_engines_names_and_tree(name: str, ours: str) -> None:
    skeleton = named_skeleton(ours)
    above = {n: skeleton.names[p] if p >= 0 else "" for n, p in zip(skeleton.names, skeleton.parents)}
    assert above == tree(name, helpers=False)


@pytest.mark.parametrize("name", ["mixamo", "unreal", "vrm"])
def test_a_skeleton_of_ours_rests_as_engines_ask(name: str) -> None:
    """A T-pose: both sides alike, soles on the ground, arms level, legs upright, toes along +Z."""
    skeleton = named_skeleton(name)
    rest = {part: skeleton.rest_positions()[skeleton.index(bone)] for part, bone in skeleton.humanoid.items()}
    assert min(place[1] for place in rest.values()) == pytest.approx(0.0, abs=1e-9)
    for part, place in rest.items():
        other = part.replace("left_", "other_").replace("right_", "left_").replace("other_", "right_")
        np.testing.assert_allclose(place * [-1, 1, 1], rest[other], atol=1e-9)
    arm, leg = rest["left_wrist"] - rest["left_shoulder"], rest["left_ankle"] - rest["left_hip"]
    toe = rest["left_foot"] - rest["left_ankle"]
    assert arm[0] > np.cos(np.radians(5)) * np.linalg.norm(arm)
    assert -leg[1] > np.cos(np.radians(5)) * np.linalg.norm(leg)
    assert toe[2] > abs(toe[0])


@pytest.mark.parametrize("name", HUMANOIDS)
def test_a_character_with_an_engines_bones_is_read_bone_by_bone(name: str) -> None:
    skeleton = skeleton_of(name)
    found = joint_map(skeleton).names()
    assert {part: found[part] for part in parts(name)} == {part: {bone: 1.0} for part, bone in parts(name).items()}
    spine = {bone for bone in tree(name, helpers=False) if "spine" in bone.lower() or "chest" in bone.lower()}
    assert set().union(*(found[f"spine{k}"] for k in (1, 2, 3))) <= spine


@pytest.mark.parametrize("name", HUMANOIDS)
def test_limbs_point_where_the_motions_do_on_an_engines_character(name: str) -> None:
    """Although it rests in an A-pose and has bones that nothing moves; legs bend a little where soles need it."""
    motion, skeleton, bones = waver(), skeleton_of(name), parts(name)
    made, joints = retarget(motion, skeleton).positions(), motion.positions()
    for side in ("left", "right"):
        for start, end, degrees in (("shoulder", "elbow", 1), ("elbow", "wrist", 1), ("hip", "knee", 5)):
            first, last = f"{side}_{start}", f"{side}_{end}"
            want = joints[:, SMPL22.index(last)] - joints[:, SMPL22.index(first)]
            seen = made[:, skeleton.index(bones[last])] - made[:, skeleton.index(bones[first])]
            cosine = (want * seen).sum(-1) / np.linalg.norm(want, axis=-1) / np.linalg.norm(seen, axis=-1)
            assert cosine.min() > np.cos(np.radians(degrees)), f"{first}: {np.degrees(np.arccos(cosine.min())):.1f}"
