"""Skeletons that programs know by their names: ours in names, hierarchy and a symmetric T-pose of our making."""

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22, Skeleton

# The names of pelvis, hip, spine1, knee, spine2, ankle, spine3, toe, neck, collar, head, shoulder, elbow, wrist; "{0}"
# is the side as the pair behind "@" says it.
_TABLES = {
    "mixamo": "@Left Right|mixamorig:Hips mixamorig:{0}UpLeg mixamorig:Spine mixamorig:{0}Leg mixamorig:Spine1 "
    "mixamorig:{0}Foot mixamorig:Spine2 mixamorig:{0}ToeBase mixamorig:Neck mixamorig:{0}Shoulder mixamorig:Head "
    "mixamorig:{0}Arm mixamorig:{0}ForeArm mixamorig:{0}Hand",
    "unreal": "@l r|pelvis thigh_{0} spine_01 calf_{0} spine_02 foot_{0} spine_03 ball_{0} neck_01 clavicle_{0} head "
    "upperarm_{0} lowerarm_{0} hand_{0}",
    "vrm": "@left right|hips {0}UpperLeg spine {0}LowerLeg chest {0}Foot upperChest {0}Toes neck {0}Shoulder head "
    "{0}UpperArm {0}LowerArm {0}Hand",
    "rigify": "@L R|DEF-spine DEF-thigh.{0} DEF-spine.001 DEF-shin.{0} DEF-spine.002 DEF-foot.{0} DEF-spine.003 "
    "DEF-toe.{0} DEF-spine.004 DEF-shoulder.{0} DEF-spine.006 DEF-upper_arm.{0} DEF-forearm.{0} DEF-hand.{0}",
}
NAMED = ("smpl22", *_TABLES)


def joint_names(name: str) -> list[str]:
    """What a named skeleton other than ``smpl22`` calls the joints of SMPL, in their order."""
    head, _, table = _TABLES[name].partition("|")
    sides, words = head[1:].split(), iter(table.split())
    names: list[str] = []
    word = ""
    for joint in SMPL22.names:
        if not joint.startswith("right_"):
            word = next(words)
        names.append(word.format(sides[joint.startswith("right_")]))
    return names


def named_skeleton(name: str) -> Skeleton:
    """``smpl22``, ``mixamo``, ``unreal`` (with its root bone on the ground), ``vrm`` or ``rigify``.

    All but the first are the uniform person with both sides alike. Raises `MotionloomError` for another name.
    """
    if name == "smpl22":
        return SMPL22
    if name not in _TABLES:
        raise MotionloomError(f"the skeletons with a name are {', '.join(NAMED)}; got {name!r}")
    names = joint_names(name)
    pairs = list(SMPL22.mirror_pairs())
    offsets = (SMPL22.offsets + SMPL22.offsets[pairs] * [-1.0, 1.0, 1.0]) / 2
    offsets[0, 1] = -sum(offsets[j, 1] for j in (1, 4, 7, 10))
    parents = SMPL22.parents
    if name == "unreal":
        offsets = np.vstack([np.zeros(3), offsets])
        names, parents = ["root", *names], (-1, *(p + 1 for p in parents))
    humanoid = dict(zip(SMPL22.names, names[-22:]))
    return Skeleton(tuple(names), parents, offsets, humanoid=humanoid, on_floor=True)
