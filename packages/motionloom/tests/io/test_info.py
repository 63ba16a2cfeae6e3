"""What `info` says of a person whose root and controls are no part of the body."""

import numpy as np
import pytest

from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.info import describe, family
from motionloom.retarget.named import named_skeleton
from tests.retarget.test_transfer import stroll


def with_controls(motion: Motion) -> Motion:
    """The same person under a still bone on the ground, from which a control hangs at arm's length."""
    skeleton, frames = motion.skeleton, len(motion)
    names = ("ground", "hand_control", *skeleton.names)
    parents = (-1, 0, *(0 if p < 0 else p + 2 for p in skeleton.parents))
    offsets = np.vstack([[0, 0, 0], [2.5, 1.4, 0], skeleton.offsets])
    rotations = np.zeros((frames, 24, 4))
    rotations[:, :2, 0], rotations[:, 2:] = 1.0, motion.rotations
    places = np.tile(offsets, (frames, 1, 1))
    places[:, 2] = motion.root
    return Motion(Skeleton(names, parents, offsets), motion.fps, np.zeros((frames, 3)), rotations, places)


def test_height_and_way_are_the_persons_under_a_still_root_with_controls() -> None:
    plain, found = describe(stroll()), describe(with_controls(stroll()))
    assert found.height == pytest.approx(plain.height)
    assert found.path == pytest.approx(plain.path)
    assert found.path > 1.0
    assert 1.3 < found.height < 1.7


def test_skeletons_of_programs_are_named() -> None:
    names = {name: family(named_skeleton(name)) for name in ("mixamo", "unreal", "rigify", "smpl22")}
    assert names == {"mixamo": "Mixamo", "unreal": "Unreal", "rigify": "Rigify", "smpl22": "SMPL-22"}
    assert family(SMPL22) == "SMPL-22"


def test_what_is_measured_in_pieces_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    long = with_controls(stroll())
    whole = describe(long)
    monkeypatch.setattr("motionloom.io.info._BLOCK", 7)
    assert describe(long) == whole
