"""VRM animations (`.vrma`, VRMC_vrm_animation 1.0), out: any humanoid's motion for every VRM avatar.

Such a file is a glTF file that holds bones in a T-pose, one animation of their rotations and of the hips' place, and
which bone is which. In, it is read as any glTF file with a humanoid map (`gltf_rig.humanoid_nodes`).
"""

import json
from pathlib import Path

from motionloom.io.atomic import atomic_path
from motionloom.io.glb import pack_glb
from motionloom.io.gltf import glb_bytes
from motionloom.io.gltf_rig import VRM_BONES
from motionloom.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22


def save_vrma(motion: Motion, path: str | Path) -> Path:
    """Write a humanoid's motion as a VRM animation of the uniform person, who is in a T-pose at rest.

    Raises `MotionloomError` if the motion's skeleton is no humanoid, or the path cannot be written.
    """
    person = motion if motion.skeleton is SMPL22 else to_smpl22(motion)
    data = glb_bytes([person], body=False)
    length = int.from_bytes(data[12:16], "little")
    content, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    first = next(i for i, node in enumerate(content["nodes"]) if node["name"] == SMPL22.names[0])
    bones = {bone: {"node": first + SMPL22.index(joint)} for bone, joint in VRM_BONES.items()}
    content["extensionsUsed"] = ["VRMC_vrm_animation"]
    content["extensions"] = {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}}
    with atomic_path(path) as temporary:
        temporary.write_bytes(pack_glb(content, binary))
    return Path(path)
