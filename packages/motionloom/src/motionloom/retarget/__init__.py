"""Putting a motion on another body: any humanoid to any humanoid, and the 22-joint uniform person between."""

from motionloom.retarget.joint_map import JointMap, joint_map
from motionloom.retarget.root import RootMode
from motionloom.retarget.transfer import from_smpl22, joints22, retarget, to_smpl22

__all__ = ["JointMap", "RootMode", "from_smpl22", "joint_map", "joints22", "retarget", "to_smpl22"]
