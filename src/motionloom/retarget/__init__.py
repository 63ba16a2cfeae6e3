"""Putting a motion on another body."""

from motionloom.retarget.joint_map import JointMap, joint_map
from motionloom.retarget.transfer import joints22

__all__ = ["JointMap", "joint_map", "joints22"]
