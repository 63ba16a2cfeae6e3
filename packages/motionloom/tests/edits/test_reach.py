"""Reach of somebody who stands at rest, with straight legs."""

import numpy as np

from motionloom.core.skeleton import SMPL22
from motionloom.edits.steering import lowered, out_of_reach, room_above
from motionloom.goals.goal import Goal

WRIST, SHOULDER, FRAMES = SMPL22.index("right_wrist"), SMPL22.index("right_shoulder"), 40


def standing() -> np.ndarray:
    places = SMPL22.rest_positions()
    return np.tile(places - [0, places[:, 1].min(), 0], (FRAMES, 1, 1))


def asking(height: float, joint: int = WRIST) -> Goal:
    """The joint straight above its shoulder in frame 20."""
    goal = Goal.nothing(FRAMES)
    goal.positions[20, joint], goal.mask[20, joint] = standing()[20, SHOULDER] * [1, 0, 1] + [0, height, 0], True
    return goal


def test_who_stands_goes_up_to_the_toes_and_who_bends_the_knees_by_so_much_more() -> None:
    bent = standing()
    bent[:, [0, *range(1, 4)]] -= [0, 0.2, 0]
    assert 0 < room_above(standing()).max() < 0.12
    np.testing.assert_allclose(room_above(bent) - room_above(standing()), 0.2, atol=0.06)


def test_who_flies_somewhere_may_go_up_further_but_not_in_the_air() -> None:
    jumping = standing()
    jumping[15:22] += [0, 0.5, 0]
    room = room_above(jumping)
    assert room[5] > 0.4
    assert room[18] < room[5] - 0.35


def test_only_what_is_too_high_is_asked_lower() -> None:
    places, room = standing(), room_above(standing())
    shoulder = places[20, SHOULDER, 1]
    near, far = asking(shoulder + 0.5), asking(2.9)
    assert lowered(near, places, room) is near
    height = lowered(far, places, room).positions[20, WRIST, 1]
    assert shoulder + 0.5 < height < shoulder + 0.75
    assert lowered(asking(2.9, SMPL22.index("head")), places, room).positions[20, SMPL22.index("head"), 1] < 2.0
    far.mask[20, 0, 1] = True
    assert lowered(far, places, room) is far


def test_the_body_goes_up_and_down_by_what_the_arm_lacks() -> None:
    places = standing()
    shoulder = places[20, SHOULDER, 1]
    need = [out_of_reach(places, asking(height))[20] for height in (shoulder + 0.3, shoulder + 0.68, shoulder - 0.68)]
    np.testing.assert_allclose(need, [0, 0.2, -0.2], atol=1e-9)
