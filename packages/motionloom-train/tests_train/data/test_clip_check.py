"""What is wrong with a clip: each fault planted, and none found in a good one."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom_train.data.examples import check_clip, check_file
from tests.kinematics import people


def motion(positions: np.ndarray) -> Motion:
    return motion_from_positions(positions, people.FPS)


def findings(motion: Motion) -> list[tuple[str, bool]]:
    return [(finding.sentence, finding.fatal) for finding in check_clip(motion)]


def walk() -> Motion:
    return motion(people.walking(1.2, 3.0))


def test_a_good_clip_has_no_fatal_fault() -> None:
    assert not [sentence for sentence, fatal in findings(walk()) if fatal]
    assert findings(motion(people.jumping(0.3))) == []


def scaled(motion: Motion, factor: float) -> Motion:
    skeleton = motion.skeleton
    larger = Skeleton(skeleton.names, skeleton.parents, np.asarray(skeleton.offsets) * factor)
    return replace(motion, skeleton=larger, root=motion.root * factor)


@pytest.mark.parametrize(("factor", "advice"), [(100.0, "0.01 times"), (1000.0, "0.001 times"), (0.01, "100 times")])
def test_a_wrong_unit_is_found(factor: float, advice: str) -> None:
    (sentence, fatal), *_ = findings(scaled(walk(), factor))
    assert fatal
    assert "unit of length is wrong" in sentence
    assert advice in sentence


def test_a_short_clip_is_found() -> None:
    (sentence, fatal), *_ = findings(motion(people.walking(1.2, 0.6)))
    assert fatal
    assert "s short" in sentence


def test_a_still_clip_is_found() -> None:
    (sentence, fatal), *_ = findings(motion(people.standing(3.0)))
    assert fatal
    assert "nothing moves" in sentence


def test_a_leap_between_two_frames_is_found() -> None:
    positions = people.walking(1.2, 3.0)
    positions[30:, :, 0] += 3.0
    (sentence, fatal), *_ = findings(motion(positions))
    assert fatal
    assert "leaps 3" in sentence
    assert "1.45 s" in sentence


def test_somebody_who_floats_is_found() -> None:
    positions = people.walking(1.2, 4.0)
    positions[20:, :, 1] += 0.5
    assert any("it floats" in sentence and not fatal for sentence, fatal in findings(motion(positions)))


def test_a_floor_elsewhere_is_mentioned() -> None:
    positions = people.walking(1.2, 3.0)
    positions[..., 1] += 0.8
    assert any("0.8" in sentence and "above y = 0" in sentence for sentence, _ in findings(motion(positions)))


def test_feet_that_slide_are_found() -> None:
    positions = people.standing(3.0)
    positions[..., 2] += np.linspace(0, 3, len(positions))[:, None]
    assert any("feet slide" in sentence and not fatal for sentence, fatal in findings(motion(positions)))


def test_what_cannot_be_read_is_a_fault() -> None:
    (finding,) = check_file(MotionloomError("there is no file x.bvh"))
    assert finding.fatal
    assert finding.sentence == "there is no file x.bvh"


def test_a_skeleton_of_nobody_is_a_fault() -> None:
    skeleton = Skeleton(("a", "b"), (-1, 0), np.array([[0.0, 0, 0], [0, 1.0, 0]]))
    box = Motion(skeleton, 20.0, np.zeros((40, 3)), np.tile([1.0, 0, 0, 0], (40, 2, 1)))
    assert check_file(box)[0].fatal
