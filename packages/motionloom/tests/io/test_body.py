"""The body that a GLB shows is a closed one of human size."""

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.body import body
from motionloom.viz.figure import figure
from tests.io.gltf_files import person


def test_the_body_is_closed_faces_outward_and_has_human_size() -> None:
    pieces = body(person())
    rest = SMPL22.rest_positions()
    for piece in pieces:
        a, b, c = (piece.points[piece.triangles[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a) * (a - piece.points.mean(axis=0))).sum() > 0  # six times the volume
        edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in piece.triangles for k in range(3)}
        assert {(b, a) for a, b in edges} == edges  # every edge is shared by two faces that turn alike
    points = np.concatenate([p.points + rest[p.joint] for p in pieces])
    tall, wide = np.ptp(points[:, 1]), np.ptp(points[:, 0])
    assert 1.5 < tall < 1.9
    assert 1.2 < wide < 2.0
    assert points[:, 1].min() > -0.03
    assert {p.side for p in pieces} == {-1, 0, 1, 2}


def test_soles_stand_on_the_floor_and_not_in_it() -> None:
    still = Motion(SMPL22, 30.0, SMPL22.offsets[:1], np.tile(rot.IDENTITY, (1, 22, 1)))
    rest = SMPL22.rest_positions()
    for piece in body(still):
        if SMPL22.names[piece.joint].endswith("ankle"):
            heights = (piece.points + rest[piece.joint])[:, 1]
            assert abs(heights.min()) < 1e-3
            assert (heights < 1e-3).sum() > 8  # a sole, and no ridge


def test_a_leg_that_is_held_up_is_a_leg() -> None:
    """Which limbs are legs is said by where they leave the trunk, not by where they are."""
    motion = Motion(SMPL22, 20.0, np.zeros((12, 3)), np.tile(rot.IDENTITY, (12, 22, 1)))
    turns = {
        "right_hip": (-2.6, 1.9, 1.1),
        "left_hip": (0.0, 0.6, -1.1),
        "right_shoulder": (0.6, 1.9, -1.4),
        "left_shoulder": (3.2, -0.5, 1.0),
        "spine1": (-1.0, 0.5, -1.5),
    }
    for joint, turn in turns.items():
        motion.rotations[:, SMPL22.index(joint)] = rot.rotvec_to_quat(np.array(turn))
    shape = figure(motion)
    assert {SMPL22.names[joint] for joint in shape.hips} == {"left_hip", "right_hip", "pelvis"}
    assert all(np.isfinite(piece.points).all() for piece in body(motion))
