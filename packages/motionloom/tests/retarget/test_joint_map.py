"""The 22 SMPL joints are found on every rig we know by name, and on unknown ones by shape."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import joint_map, joints22
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.named import named_skeleton
from tests.shared import shared
from tests.work import work

# Pelvis, spine, neck, head; then collar, shoulder, elbow, wrist; then hip, knee, ankle, toe.
RIGS: dict[str, tuple[str, str, str]] = {
    "mixamo": (
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head",
        "mixamorig:{Left}Shoulder mixamorig:{Left}Arm mixamorig:{Left}ForeArm mixamorig:{Left}Hand",
        "mixamorig:{Left}UpLeg mixamorig:{Left}Leg mixamorig:{Left}Foot mixamorig:{Left}ToeBase",
    ),
    "biped": (
        "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Spine2 Bip01_Neck Bip01_Head",
        "Bip01_{L}_Clavicle Bip01_{L}_UpperArm Bip01_{L}_Forearm Bip01_{L}_Hand",
        "Bip01_{L}_Thigh Bip01_{L}_Calf Bip01_{L}_Foot Bip01_{L}_Toe0",
    ),
    "unreal": (
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "clavicle_{l} upperarm_{l} lowerarm_{l} hand_{l}",
        "thigh_{l} calf_{l} foot_{l} ball_{l}",
    ),
    "smpl": (
        "Pelvis Spine1 Spine2 Spine3 Neck Head",
        "{L}_Collar {L}_Shoulder {L}_Elbow {L}_Wrist",
        "{L}_Hip {L}_Knee {L}_Ankle {L}_Foot",
    ),
    "xsens": (
        "Hips Chest Chest2 Chest3 Neck Head",
        "{Left}Collar {Left}Shoulder {Left}Elbow {Left}Wrist",
        "{Left}Hip {Left}Knee {Left}Ankle {Left}Toe",
    ),
    "rokoko": (
        "Hips Spine1 Spine2 Spine3 Neck Head",
        "{Left}Shoulder {Left}Arm {Left}ForeArm {Left}Hand",
        "{Left}Thigh {Left}Shin {Left}Foot {Left}Toe",
    ),
    "perception neuron": (
        "Robot_Hips Robot_Spine Robot_Spine1 Robot_Spine2 Robot_Neck Robot_Head",
        "Robot_{Left}Shoulder Robot_{Left}Arm Robot_{Left}ForeArm Robot_{Left}Hand",
        "Robot_{Left}UpLeg Robot_{Left}Leg Robot_{Left}Foot Robot_{Left}Foot_End",
    ),
    "vrm": (
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
        "J_Bip_{L}_Shoulder J_Bip_{L}_UpperArm J_Bip_{L}_LowerArm J_Bip_{L}_Hand",
        "J_Bip_{L}_UpperLeg J_Bip_{L}_LowerLeg J_Bip_{L}_Foot J_Bip_{L}_ToeBase",
    ),
    "run together": (
        "hips spine spine1 spine2 neck head",
        "{left}shoulder {left}arm {left}forearm {left}hand",
        "{left}upleg {left}leg {left}foot {left}toebase",
    ),
    "numbers only": ("a b c d e f", "g{1} h{1} i{1} k{1}", "m{1} n{1} o{1} p{1}"),
}
_OTHER = {"Left": "Right", "L": "R", "l": "r", "left": "right", "1": "2"}


def rig(middle: str, arm: str, leg: str) -> tuple[str, ...]:
    """The 22 names in SMPL's order."""
    pelvis, spine1, spine2, spine3, neck, head = middle.split()
    both = []
    for side in (0, 1):
        swap = {"{" + a + "}": (a, b)[side] for a, b in _OTHER.items()}
        names = f"{arm} {leg}"
        for old, new in swap.items():
            names = names.replace(old, new)
        both.append(names.split())
    (lc, ls, le, lw, lh, lk, la, lf), (rc, rs, re, rw, rh, rk, ra, rf) = both
    return (pelvis, lh, rh, spine1, lk, rk, spine2, la, ra, spine3, lf, rf, neck, lc, rc, head, ls, rs, le, re, lw, rw)


def renamed(names: tuple[str, ...]) -> Skeleton:
    return Skeleton(names, SMPL22.parents, SMPL22.offsets)


@pytest.mark.parametrize("name", RIGS)
def test_every_known_rig_is_mapped_joint_by_joint(name: str) -> None:
    skeleton = renamed(rig(*RIGS[name]))
    assert np.array_equal(joint_map(skeleton).matrix(skeleton), np.eye(22))


def test_fingers_twist_bones_and_a_root_above_the_hips_do_not_confuse_it() -> None:
    base = renamed(rig(*RIGS["unreal"]))
    extra = {
        "upperarm_twist_01_l": "upperarm_l",
        "thigh_twist_01_l": "thigh_l",
        "ik_foot_l": "root",
        "index_01_l": "hand_l",
        "thumb_01_r": "hand_r",
    }
    names = ("root", *base.names, *extra)
    parents = (-1, 0, *(p + 1 for p in base.parents[1:]), *(names.index(p) for p in extra.values()))
    offsets = np.concatenate([np.zeros((1, 3)), base.offsets, np.full((len(extra), 3), 0.03)])
    skeleton = Skeleton(names, parents, offsets)
    matrix = joint_map(skeleton).matrix(skeleton)
    assert np.array_equal(matrix[:, 1:23], np.eye(22))


def test_the_shape_of_the_tree_tells_left_from_right_by_the_toes() -> None:
    turned = SMPL22.offsets * np.array([-1.0, 1.0, -1.0])  # the same person facing -Z
    skeleton = Skeleton(rig(*RIGS["numbers only"]), SMPL22.parents, turned)
    assert np.array_equal(joint_map(skeleton).matrix(skeleton), np.eye(22))


def test_a_toe_without_a_name_is_the_end_site_of_the_foot() -> None:
    names = list(rig(*RIGS["mixamo"]))
    names[10], names[11] = "mixamorig:LeftFoot End Site", "mixamorig:RightFoot End Site"
    skeleton = Skeleton(tuple(names), SMPL22.parents, SMPL22.offsets, ends=frozenset({10, 11}))
    assert joint_map(skeleton).names()["left_foot"] == {"mixamorig:LeftFoot End Site": 1.0}


@pytest.mark.parametrize("limb", [("left", "knee"), ("right", "elbow")])
def test_a_body_without_a_limb_names_what_is_missing(limb: tuple[str, str]) -> None:
    side, joint = limb
    lost = [j for j, n in enumerate(SMPL22.names) if n.startswith(side) and ("_leg" if joint == "knee" else "_arm")]
    group = SMPL22.groups[f"{side}_{'leg' if joint == 'knee' else 'arm'}"]
    kept = [j for j in range(22) if j not in group]
    assert lost
    parents = tuple(-1 if j == 0 else kept.index(SMPL22.parents[j]) for j in kept)
    skeleton = Skeleton(tuple(SMPL22.names[j] for j in kept), parents, SMPL22.offsets[kept])
    with pytest.raises(MotionloomError, match=f"{side}_{joint}"):
        joint_map(skeleton)


def test_a_chain_is_no_humanoid() -> None:
    skeleton = Skeleton(("a", "b", "c"), (-1, 0, 1), np.ones((3, 3)))
    with pytest.raises(MotionloomError, match="not a humanoid"):
        joint_map(skeleton)


def test_an_override_wins_and_may_come_from_a_file(tmp_path: Path) -> None:
    wanted = {"pelvis": {"pelvis": 0.25, "spine1": 0.75}, "head": "neck"}
    path = tmp_path / "map.json"
    path.write_text(json.dumps(wanted))
    for override in (wanted, path):
        names = joint_map(SMPL22, override).names()
        assert names["pelvis"] == {"pelvis": 0.25, "spine1": 0.75}
        assert names["head"] == {"neck": 1.0}
        assert names["left_knee"] == {"left_knee": 1.0}


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ({"left_kneee": "left_knee"}, "left_kneee"),
        ({"left_knee": "patella"}, "patella"),
        ({"left_knee": {"left_knee": 0.5}}, "add up to 0.5"),
        ({"left_knee": {"left_knee": "much"}}, "weight"),
        ({"left_knee": []}, "left_knee"),
    ],
)
def test_a_wrong_override_is_refused_in_one_sentence(override: dict, said: str) -> None:
    with pytest.raises(MotionloomError, match=said):
        joint_map(SMPL22, override)


@pytest.mark.parametrize("text", ["{", "[1, 2]", "[" * 100_000, "\x00"])
def test_a_file_that_is_no_map_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "map.json"
    path.write_text(text)
    with pytest.raises(MotionloomError, match="joint map"):
        joint_map(SMPL22, path)


@pytest.mark.parametrize(
    ("part", "other"), [("left_knee", "left_hip"), ("right_wrist", "left_wrist"), ("pelvis", "head")]
)
def test_one_bone_for_two_parts_is_said(part: str, other: str) -> None:
    joints = {name: name for name in SMPL22.names} | {part: other}
    with pytest.raises(MotionloomError, match=f"both .* as '{other}'; name another joint"):
        joint_map(SMPL22, joints)


def test_the_map_as_data_is_its_own_override() -> None:
    skeleton = renamed(rig(*RIGS["mixamo"]))
    once = joint_map(skeleton)
    assert joint_map(skeleton, once.names()) == once


def test_joints22_of_the_uniform_person_are_its_own_positions() -> None:
    rotations = np.zeros((3, 22, 4))
    rotations[..., 0] = 1.0
    motion = Motion(SMPL22, 30.0, np.arange(9.0).reshape(3, 3), rotations)
    assert np.allclose(joints22(motion), motion.positions(), atol=1e-12)


def test_the_tables_put_points_on_the_lines_the_data_says() -> None:
    """Points of the pack's own table, by family: part, first joint, second joint, how far along."""
    for table, wanted in (
        (
            joint_map_of(
                "hip abdomen chest neck head",
                "{l}Collar {l}Shldr {l}ForeArm {l}Hand",
                "{l}Thigh {l}Shin {l}Foot {l}Foot~End~Site",
            ),
            {
                "pelvis": {"hip": 0.5, "abdomen": 0.5},
                "spine3": {"chest": 0.8, "neck": 0.2},
                "left_collar": {"lCollar": 0.6, "lShldr": 0.4},
                "right_foot": {"rFoot End Site": 1.0},
            },
        ),
        (
            joint_map_of(
                "Hips Spine Chest Neck Head",
                "Shoulder_{L} UpperArm_{L} LowerArm_{L} Hand_{L}",
                "UpperLeg_{L} LowerLeg_{L} Foot_{L} Toes_{L}",
            ),
            {
                "pelvis": {"Hips": 0.75, "Spine": 0.25},
                "spine3": {"Chest": 0.8, "Neck": 0.2},
                "left_collar": {"Shoulder_L": 1.0},
            },
        ),
    ):
        for part, point in wanted.items():
            assert table[part] == pytest.approx(point), part


def joint_map_of(middle: str, arm: str, leg: str) -> dict[str, dict[str, float]]:
    """The map of a skeleton with these names: four bones in the trunk, the uniform person otherwise."""
    pelvis, *trunk = middle.split()
    names = [n.replace("~", " ") for n in rig(f"{pelvis} {trunk[0]} {trunk[1]} unused {trunk[2]} {trunk[3]}", arm, leg)]
    names.pop(9)
    kept = [j for j in range(22) if j != 9]
    parents = tuple(-1 if j == 0 else kept.index(6 if SMPL22.parents[j] == 9 else SMPL22.parents[j]) for j in kept)
    offsets = SMPL22.offsets.copy()
    offsets[[12, 13, 14]] += offsets[9]
    ends = frozenset(j for j, name in enumerate(names) if name.endswith("End Site"))
    return joint_map(Skeleton(tuple(names), parents, offsets[kept], ends)).names()


@pytest.mark.parametrize(
    "path", ["cmu/asf_amc/07/07_01.amc", "cmu/bvh/07_04.bvh", "bandai/dataset-1/dataset-1_walk_normal_001.bvh"]
)
def test_joints22_agree_with_the_floor_heights_recorded_for_the_real_clips(path: str) -> None:
    from motionloom.io.asf import load_asf_amc  # late: this test alone needs the readers
    from motionloom.io.bvh import load_bvh

    place = shared(f"data/{path}")
    if place.suffix == ".amc":
        motion = load_asf_amc(place.with_name("07.asf"), place, fps=30)
    else:
        motion = load_bvh(place, unit=0.01)
    with shared("data/manifest.csv").open() as file:
        recorded = next(float(row["floor_y_m"]) for row in csv.DictReader(file) if row["path"] == path)
    lowest = joints22(motion)[:, [7, 8, 10, 11], 1].min(axis=1)
    assert np.percentile(lowest, 2) == pytest.approx(recorded, abs=2e-3)


def test_a_generated_rigify_rig_in_pieces_is_refused_with_the_way_to_join_it() -> None:
    """Blender exports its limbs beside its spine, each on the armature."""
    names = ("rig", *named_skeleton("rigify").names)
    parents = [
        0 if p < 0 or p == 0 or name.startswith("DEF-shoulder") else p + 1
        for name, p in zip(names[1:], named_skeleton("rigify").parents)
    ]
    rest = np.vstack([np.zeros(3), named_skeleton("rigify").rest_positions()])
    parents[names.index("DEF-spine.001") - 1] = names.index("DEF-spine")
    offsets = rest - np.vstack([np.zeros(3), rest[parents]])
    with pytest.raises(MotionloomError, match="extension for Blender"):
        joint_map(Skeleton(names, (-1, *parents), offsets))


def _with_tail(joints: int) -> Skeleton:
    """The uniform person without names, a chain of so many joints on its head."""
    names = tuple(f"b{k}" for k in range(22 + joints))
    parents = (*SMPL22.parents, 15, *range(22, 21 + joints))
    offsets = np.concatenate([SMPL22.offsets, np.tile([0.0, 1e-4, 0.0], (joints, 1))])
    return Skeleton(names, parents, offsets)


def test_deep_skeletons_cost_no_more_than_their_joints() -> None:
    """Read by shape, and refused by shape."""
    few, many = (work(lambda n=n: read_body(_with_tail(n))) for n in (100, 800))
    assert many < 9 * few

    def refused(joints: int) -> None:
        line = Skeleton(
            tuple(map(str, range(joints))), tuple(range(-1, joints - 1)), np.tile([0, 0.01, 0], (joints, 1))
        )
        with pytest.raises(MotionloomError, match="not a humanoid"):
            joint_map(line)

    few, many = (work(lambda n=n: refused(n)) for n in (100, 800))
    assert many < 9 * few
