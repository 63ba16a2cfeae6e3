"""NPZ of the SOMA skeleton: places come back, joints get their names, and what is no such motion is refused."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.io import load
from motionloom.io.soma import FPS
from motionloom.retarget import to_smpl22
from tests.shared import shared

SPINE = ["Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2", "Head"]


def arrays(count: int, frames: int = 5) -> dict[str, np.ndarray]:
    """Joints anywhere and any rotations, all bones rigid: each joint hangs on the one before it in the list."""
    rng = np.random.default_rng(count)
    turns = rot.quat_to_matrix(rot.normalize(rng.normal(size=(frames, count, 4))))
    return {"posed_joints": rng.normal(size=(frames, count, 3)), "global_rot_mats": turns}


@pytest.mark.parametrize(("count", "tips"), [(30, 4), (77, 13), (22, 0)])
def test_joints_have_their_names_and_the_root_its_places(tmp_path: Path, count: int, tips: int) -> None:
    made = arrays(count)
    np.savez(tmp_path / "a.npz", posed_joints=made["posed_joints"], global_rot_mats=made["global_rot_mats"])
    motion = load(tmp_path / "a.npz")
    assert (len(motion.skeleton), len(motion.skeleton.ends), motion.fps) == (count, tips, FPS)
    np.testing.assert_allclose(motion.root, made["posed_joints"][:, 0])
    np.testing.assert_allclose(rot.quat_to_matrix(motion.world_rotations()), made["global_rot_mats"], atol=1e-6)
    if count != 22:
        assert list(motion.skeleton.names[:7]) == SPINE
        left, foot = motion.skeleton.index("LeftArm"), motion.skeleton.index("RightToeBase")
        assert [motion.skeleton.names[j] for j in motion.skeleton.ancestors(left)[1:3]] == ["LeftShoulder", "Chest"]
        assert [motion.skeleton.names[j] for j in motion.skeleton.ancestors(foot)[1:]] == [
            "RightFoot",
            "RightShin",
            "RightLeg",
            "Hips",
        ]


@pytest.mark.parametrize("fault", ["a robot", "a stretch", "a mirror", "no frames", "other joints"])
def test_what_is_no_such_motion_is_refused(tmp_path: Path, fault: str) -> None:
    made = arrays(34 if fault == "a robot" else 30, 0 if fault == "no frames" else 5)
    if fault in ("a stretch", "a mirror"):
        made["global_rot_mats"] = made["global_rot_mats"] * (1.2 if fault == "a stretch" else -1.0)
    if fault == "other joints":
        made["global_rot_mats"] = made["global_rot_mats"][:, :20]
    np.savez(tmp_path / "a.npz", posed_joints=made["posed_joints"], global_rot_mats=made["global_rot_mats"])
    with pytest.raises(MotionloomError, match=r"a\.npz"):
        load(tmp_path / "a.npz")


def test_a_file_of_the_generator_is_the_motion_of_its_bvh() -> None:
    """The same motion as the generator wrote it twice; the BVH has 77 joints and centimetres."""
    archive = load(shared("data_fourth/probes/kimodo/soma30_08_stylized_text.npz"))
    other = load(shared("data_fourth/probes/kimodo/08_stylized_text.bvh"))
    np.testing.assert_allclose(to_smpl22(archive).positions(), to_smpl22(other).positions(), atol=1e-3)
