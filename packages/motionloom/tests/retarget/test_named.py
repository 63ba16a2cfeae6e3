"""The skeletons with a name."""

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import joint_map, retarget
from motionloom.retarget.named import NAMED, named_skeleton


@pytest.mark.parametrize("name", NAMED[1:])
def test_both_sides_are_alike_and_stand_on_the_floor(name: str) -> None:
    skeleton = named_skeleton(name)
    rest = skeleton.rest_positions()
    pairs = list(skeleton.mirror_pairs())
    assert sum(j != p for j, p in enumerate(pairs)) == 16
    np.testing.assert_allclose(rest[pairs] * [-1, 1, 1], rest, atol=1e-9)
    assert rest[:, 1].min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", NAMED[1:])
def test_names_alone_tell_the_joints(name: str) -> None:
    """What other programs make of the names is what they are here: no map is needed."""
    skeleton = named_skeleton(name)
    bare = Skeleton(skeleton.names, skeleton.parents, skeleton.offsets)
    for joint in (
        "left_knee",
        "right_ankle",
        "left_foot",
        "right_shoulder",
        "left_elbow",
        "right_wrist",
        "pelvis",
        "head",
    ):
        assert joint_map(bare).names()[joint] == {skeleton.humanoid[joint]: 1.0}


def test_a_motion_is_carried_over() -> None:
    turns = np.tile(rot.IDENTITY, (10, 22, 1))
    motion = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (10, 1)), turns)
    for name in NAMED:
        places = retarget(motion, named_skeleton(name)).positions()[:, -22:]
        np.testing.assert_allclose(places, motion.positions(), atol=0.03)


def test_other_names_are_refused() -> None:
    with pytest.raises(MotionloomError, match="mixamo, unreal"):
        named_skeleton("biped")
