"""VRM animations (`.vrma`, VRMC_vrm_animation 1.0), out: any humanoid's motion for every VRM avatar.

Such a file is a glTF file that holds bones in a T-pose, one animation of their rotations and of the hips' place, and
which bone is which. In, it is read as any glTF file with a humanoid map (`gltf_rig.humanoid_nodes`).

An avatar moves its hips by the file's way times the ratio of the two hips' heights at rest. Retargeting goes by the
lengths of the legs, and avatars have their hips elsewhere over them; so an avatar's motion is written with its bones.
"""

import json
from pathlib import Path

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.glb import pack_glb
from motionloom.io.gltf import glb_bytes
from motionloom.io.gltf_rig import VRM_BONES
from motionloom.retarget import to_smpl22

_NEEDED = {"pelvis", "spine1", "head"} | {
    f"{side}_{part}" for side in ("left", "right") for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
}
_LEVEL = np.cos(np.radians(15))


def save_vrma(motion: Motion, path: str | Path) -> Path:
    """Write a humanoid's motion as a VRM animation.

    It has its own bones where it is a VRM avatar that rests in a T-pose facing +Z, else those of the uniform person.
    Raises `MotionloomError` if the motion's skeleton is no humanoid, or the path cannot be written.
    """
    bones = _bones(motion.skeleton)
    if bones is None:
        person = motion if motion.skeleton is SMPL22 else to_smpl22(motion)
        bones = {part: SMPL22.index(part) for part in VRM_BONES.values()}
    else:
        person, bones = _of_bones(motion, bones)
    data = glb_bytes([person], body=False)
    length = int.from_bytes(data[12:16], "little")
    content, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    first = 1  # after the node over the person's tree
    named = {bone: {"node": first + bones[part]} for bone, part in VRM_BONES.items() if part in bones}
    content["extensionsUsed"] = ["VRMC_vrm_animation"]
    content["extensions"] = {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": named}}}
    with atomic_path(path) as temporary:
        temporary.write_bytes(pack_glb(content, binary))
    return Path(path)


def _bones(skeleton: Skeleton) -> dict[str, int] | None:
    """The joints of an avatar's body parts; None for what is none, or does not rest as such files have to."""
    stated = skeleton.humanoid.items()
    bones = {part: skeleton.index(n) for part, n in stated if n in skeleton.names}
    if not bones.keys() >= _NEEDED or any(bones["pelvis"] not in skeleton.ancestors(j) for j in bones.values()):
        return None
    rest = skeleton.rest_positions()
    body = np.zeros((22, 3))
    for part, joint in bones.items():
        body[SMPL22.index(part)] = rest[joint]
    arms = [rest[bones[f"{side}_wrist"]] - rest[bones[f"{side}_shoulder"]] for side in ("left", "right")]
    level = all(sign * arm[0] > _LEVEL * np.linalg.norm(arm) for sign, arm in zip((1, -1), arms))
    return bones if level and abs(ground_pose(body).facing) < 0.1 else None


def _of_bones(motion: Motion, bones: dict[str, int]) -> tuple[Motion, dict[str, int]]:
    """The motion with nothing but these bones, the hips on top, and their numbers in it."""
    order = sorted(set(bones.values()), key=lambda j: (j != bones["pelvis"], j))
    slots = {j: k for k, j in enumerate(order)}
    skeleton = motion.skeleton
    above = [next((slots[a] for a in skeleton.ancestors(j)[1:] if a in slots), -1) for j in order]
    rest, world = skeleton.rest_positions()[order], motion.world_rotations()[:, order]
    offsets, rotations = rest.copy(), world.copy()
    offsets[1:] -= rest[above[1:]]
    rotations[:, 1:] = rot.multiply(rot.inverse(world[:, above[1:]]), world[:, 1:])
    plain = Skeleton(tuple(skeleton.names[j] for j in order), tuple(above), offsets)
    root = motion.positions()[:, bones["pelvis"]]
    return Motion(plain, motion.fps, root, rotations), {part: slots[j] for part, j in bones.items()}
