"""How bodies are held: made-up people whose bends are known, beside percentiles that are known too."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.physics import J
from motionloom_lab.metrics import bodies
from motionloom_lab.suites import bodies as suite
from tests.kinematics.people import standing, walking
from tests.kinematics.test_wholeness import DRAWN

PERSON = np.repeat(SMPL22.rest_positions()[None], 40, axis=0)


def with_elbows(degrees: np.ndarray) -> np.ndarray:
    """Somebody who stands with both forearms raised by (frames,) degrees from arms that hang."""
    p = standing(len(degrees) / 20)
    for side in ("left", "right"):
        elbow = p[:, J[f"{side}_elbow"]]
        down, ahead = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        p[:, J[f"{side}_wrist"]] = elbow + 0.26 * np.stack([0 * down, -down, ahead], axis=-1)
    return p


def test_bends_are_degrees_and_percentiles_are_of_all_frames() -> None:
    reach = bodies.reach_of([with_elbows(np.linspace(0, 100, 1001))])
    assert reach["elbows"] == pytest.approx((0.5, 5, 50, 95, 99.5), abs=0.01)
    assert len(reach) == len(bodies.MEANING)


def test_frames_beyond_what_people_do_are_counted_and_too_many_fail() -> None:
    reach = bodies.reach_of([with_elbows(np.linspace(0, 100, 1001))])

    def elbows(share: float) -> bodies.BodyNumber:
        degrees = np.where(np.arange(1000) < 1000 * share, 120.0, 50.0)
        return next(row for row in bodies.compare_bodies([with_elbows(degrees)], reach) if row.name == "elbows")

    assert (elbows(0.02).outside, elbows(0.02).passes) == (0.02, True)
    assert (elbows(0.04).outside, elbows(0.04).passes) == (0.04, False)


def test_a_median_that_few_people_have_fails_though_no_frame_is_impossible() -> None:
    reach = bodies.reach_of([with_elbows(np.linspace(0, 100, 1001))])
    row = next(r for r in bodies.compare_bodies([with_elbows(np.full(100, 97.0))], reach) if r.name == "elbows")
    assert (row.outside, row.passes) == (0.0, False)


def test_the_head_is_as_high_as_the_person_is_tall_whoever_was_recorded() -> None:
    """Also of a small body; somebody who sits or bends the knees does not stand."""
    tall = (PERSON[0, J["head"], 1] - PERSON[0, [7, 8], 1].mean()) * 100
    for size in (1.0, 0.6):
        assert np.median(bodies.signals(PERSON * size, own=True)["head"]) == pytest.approx(tall, abs=0.5)
    assert np.median(bodies.signals(PERSON)["head"]) == pytest.approx(tall)
    seated = PERSON.copy()
    seated[:, [4, 5]] += [0.0, 0.3, 0.4]
    assert len(bodies.signals(seated)["head"]) == 0


def test_a_folded_person_has_a_low_head_and_a_pelvis_that_nobody_has() -> None:
    """Beside percentiles of people who walk, the pose that early weights drew."""
    reach = {
        name: (low, low, 0.0, high, high)
        for name, (low, high) in {
            "pelvis": (0, 35),
            "spine": (0, 40),
            "neck": (0, 60),
            "knees": (-5, 150),
            "elbows": (0, 150),
            "head": (140, 160),
        }.items()
    }
    numbers = suite.judge([np.repeat(DRAWN, 40, axis=0)], reach)["numbers"]
    assert not any(numbers[name]["passes"] for name in ("pelvis", "head", "whole"))
    assert numbers["pelvis"]["outside"] == 1.0
    sound = suite.judge([PERSON], reach)["numbers"]
    assert all(sound[name]["passes"] for name in ("pelvis", "head", "whole", "bones"))


def test_bones_are_measured_against_the_persons() -> None:
    sound = humanml.uniform(walking(1.2))
    assert bodies.stretched([sound]) < 1e-6
    long = sound.copy()
    long[:, 20] = sound[:, 18] + 1.2 * (sound[:, 20] - sound[:, 18])
    assert bodies.stretched([sound, long]) == pytest.approx(0.2)


def test_skeletons_whose_pelvis_joint_is_elsewhere_say_nothing_of_pelves() -> None:
    odd = PERSON.copy()
    odd[:, 0] = odd[:, [1, 2]].mean(axis=1) - [0.0, 0.05, 0.03]
    with pytest.raises(MotionloomError, match="shows pelvis"):
        bodies.reach_of([odd])
    assert bodies.reach_of([odd, PERSON])["pelvis"] == bodies.reach_of([PERSON])["pelvis"]


def test_shipped_percentiles_are_of_all_numbers_and_in_order() -> None:
    known = suite.known()
    assert set(known) == set(bodies.MEANING)
    assert all(list(values) == sorted(values) and len(values) == len(bodies.LEVELS) for values in known.values())
    assert known["pelvis"][-1] < 65
    assert known["knees"][0] > -35


def test_a_table_has_a_row_for_each_number() -> None:
    answer = suite.judge([PERSON], suite.known())
    assert [row[0] for row in suite.table(answer)] == ["body", *answer["numbers"]]
    assert answer["of"] == len(answer["numbers"]) == 8
