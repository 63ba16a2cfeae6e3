"""The layout tiles the frame, and masks say what they fix."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import LAYOUT, mask, ric, rot, vel


def test_blocks_tile_the_frame_and_joints_tile_their_blocks() -> None:
    assert np.concatenate([np.arange(263)[where] for where in LAYOUT.values()]).tolist() == list(range(263))
    for block, part, joints in (
        ("ric", ric, range(1, 22)),
        ("rot6d", rot, range(1, 22)),
        ("joint_velocity", vel, range(22)),
    ):
        parts = np.concatenate([np.arange(263)[part(j)] for j in joints])
        assert parts.tolist() == np.arange(263)[LAYOUT[block]].tolist()
    assert ric(20) == slice(61, 64)  # the left wrist, as the paper's control task counts


def test_masks_unite_and_know_groups() -> None:
    assert (mask("left_wrist,root") == (mask("left_wrist") | mask(["root"]))).all()
    assert mask("left_arm").sum() == 12
    assert (mask("lower_body") ^ mask("upper_body")).all()


def test_an_unknown_control_names_those_there_are() -> None:
    with pytest.raises(MotionloomError, match=r"no control called 'tail'; the controls are root, .*left_wrist"):
        mask("tail")
