"""Joins by interpolation, on motions whose joins can be worked out."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.physics import heading
from motionloom_lab.papers.baselines import slerp_joined


def turned(angle: float, place: tuple[float, float, float], frames: int = 5, *, elbow: float = 0.0) -> Motion:
    """Somebody who stands at a place, faces ``angle`` and bends the left elbow."""
    rotations = np.tile(rot.IDENTITY, (frames, 22, 1))
    rotations[:, 0] = rot.rotvec_to_quat(np.array([0.0, angle, 0.0]))
    rotations[:, SMPL22.names.index("left_elbow")] = rot.rotvec_to_quat(np.array([0.0, elbow, 0.0]))
    return Motion(SMPL22, 20.0, np.tile(place, (frames, 1)), rotations)


def test_blank_frames_are_the_interior_points_of_ten() -> None:
    """Eight frames from a straight elbow to one bent by 0.9: 0.1, 0.2 ... 0.8; the root's height goes with it."""
    joined = slerp_joined([turned(0.0, (0, 0.9, 0)), turned(0.0, (0, 1.8, 0), elbow=0.9)])
    assert len(joined) == 5 + 8 + 5
    bent = rot.quat_to_rotvec(joined.rotations[:, SMPL22.names.index("left_elbow")])[:, 1]
    assert bent == pytest.approx([0] * 5 + [0.1 * k for k in range(1, 9)] + [0.9] * 5)
    assert joined.root[5:13, 1] == pytest.approx([0.9 + 0.1 * k for k in range(1, 9)])


def test_a_later_motion_starts_where_the_one_before_ended_and_faces_the_same_way() -> None:
    """Whatever place and direction it was made at; its own height stays; its own movement turns with it."""
    first = turned(0.7, (3, 0.9, -2))
    second = turned(-1.9, (5, 1.0, 5))
    forward = np.arange(5)[:, None] * np.array([np.sin(-1.9), 0, np.cos(-1.9)])
    joined = slerp_joined([first, replace(second, root=second.root + forward)])
    assert joined.root[13] == pytest.approx([3, 1.0, -2])
    assert heading(joined.positions()) == pytest.approx(np.full(18, heading(first.positions())[0]))
    assert joined.root[17] - joined.root[13] == pytest.approx(4 * np.array([np.sin(0.7), 0, np.cos(0.7)]))


def test_three_motions_are_joined_twice_and_no_blank_is_allowed() -> None:
    some = [turned(k, (k, 0.9, 0)) for k in range(3)]
    assert len(slerp_joined(some)) == 3 * 5 + 2 * 8
    assert len(slerp_joined(some, blank=0)) == 15
    assert slerp_joined(some[:1]) is some[0]


def test_what_cannot_be_joined_is_refused() -> None:
    with pytest.raises(MotionloomError, match="nothing to join"):
        slerp_joined([])
    with pytest.raises(MotionloomError, match="one frame rate"):
        slerp_joined([turned(0, (0, 0, 0)), replace(turned(0, (0, 0, 0)), fps=30.0)])
