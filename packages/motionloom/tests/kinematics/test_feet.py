"""Planted feet stay put, nothing else is disturbed, and what is already clean stays as it is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core import rotations as rot
from motionloom.core.body.feet import clean_feet, planted_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FEET, LAYOUT
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from tests.core.features.clips import real
from tests.core.features.people import wander

FPS = 20.0


def skate(motion: Motion, planted: np.ndarray) -> float:
    """Mean horizontal speed in m/s of feet that are planted in a frame and in the next one."""
    speed = np.linalg.norm(np.diff(motion.positions()[:, FEET], axis=0)[..., [0, 2]], axis=-1) * motion.fps
    return float(speed[planted[1:] & planted[:-1]].mean())


def depth(motion: Motion) -> float:
    """Mean depth of the lowest foot joint under the floor, metres."""
    return float((-motion.positions()[:, FEET, 1].min(-1)).clip(0).mean())


def jerk(motion: Motion) -> float:
    return float(np.linalg.norm(np.diff(motion.positions(), n=3, axis=0), axis=-1).mean())


def knee_speed(motion: Motion) -> float:
    """Largest change of a knee's bend, radians per second."""
    bend = np.linalg.norm(rot.quat_to_rotvec(motion.rotations[:, [4, 5]]), axis=-1)
    return float(np.abs(np.diff(bend, axis=0)).max() * motion.fps)


def slider(speed: float = 0.2, sink: float = 0.0, frames: int = 60) -> Motion:
    """Somebody who marches with bent knees while the whole body slides over the floor."""
    t = np.arange(frames) / FPS
    turns = np.tile(rot.IDENTITY, (frames, 22, 1))
    for hip, knee, ankle, phase in ((1, 4, 7, 0.0), (2, 5, 8, np.pi)):
        lift = 0.35 + 0.8 * np.sin(2 * np.pi * 0.8 * t + phase).clip(0) ** 2
        for joint, angle in ((hip, -lift), (knee, 2 * lift), (ankle, -lift)):
            turns[:, joint] = rot.rotvec_to_quat(angle[:, None] * [1, 0, 0])
    motion = Motion(SMPL22, FPS, np.zeros((frames, 3)), turns)
    root = -motion.positions()[:, [10, 11], 1].min(-1)[:, None] * [0, 1, 0] + speed * t[:, None] * [0.6, 0, 0.8]
    return replace(motion, root=root - [0, sink, 0])


def test_a_sliding_march_stands_on_its_feet() -> None:
    motion = slider()
    planted = planted_feet(motion.positions(), FPS)
    assert planted.mean() > 0.3
    clean = clean_feet(motion)
    assert skate(motion, planted) > 0.15
    assert skate(clean, planted) < 0.01
    assert np.abs(clean.root[:, [0, 2]] - motion.root[:, [0, 2]]).max() == 0
    upper = [j for j in range(22) if j not in (1, 2, 4, 5, 7, 8)]
    np.testing.assert_allclose(np.abs((clean.rotations * motion.rotations).sum(-1))[:, upper], 1, atol=1e-9)


@pytest.mark.parametrize("shown", [8, 15, 23, 30])
def test_what_was_shown_stays_and_a_foot_that_stands_stands_on_there(shown: int) -> None:
    motion = slider()
    places = motion.positions()
    clean = clean_feet(motion, shown=shown)
    now = clean.positions()
    np.testing.assert_allclose(now[:shown], places[:shown], atol=1e-6)
    planted = planted_feet(places, FPS)
    for k, joint in enumerate(FEET):
        stop = shown
        while planted[stop, k] and stop - shown < 10:
            stop += 1
        if planted[shown - 1, k] and k % 2:  # toes: the heel may rise over them
            away = np.linalg.norm((now[shown:stop, joint] - places[shown - 1, joint])[:, [0, 2]], axis=-1)
            assert (away < 0.01).all()
    steps = np.linalg.norm(np.diff(now[:, FEET], axis=0), axis=-1)
    before = np.linalg.norm(np.diff(places[:, FEET], axis=0), axis=-1)
    assert steps[shown - 1].max() < before[shown - 2 : shown + 1].max() + 0.02, "no jump where the shown frames end"


def test_a_foot_that_comes_down_with_the_first_new_frame_stands_from_there() -> None:
    motion = slider()
    planted = planted_feet(motion.positions(), FPS)
    begins = np.flatnonzero(planted[1:, 1] & ~planted[:-1, 1]) + 1
    assert len(begins)
    for shown in begins[begins > 3]:
        stop = shown
        while stop < len(planted) and planted[stop, 1] and stop - shown < 12:
            stop += 1
        places = clean_feet(motion, shown=int(shown)).positions()[shown:stop, FEET[1]]
        assert np.ptp(places[:, [0, 2]], axis=0).max() < 0.01


@pytest.mark.parametrize("degrees", [90, -90, 180, 30])
def test_who_turns_like_a_figure_on_a_turntable_steps_around(degrees: float) -> None:
    """The feet turn with the body, one after the other, and stand still on the floor in between."""
    turn = np.radians(degrees) * np.clip((np.arange(80) - 15) / 50, 0, 1)
    rotations = np.tile(rot.IDENTITY, (80, 22, 1))
    rotations[:, 0] = rot.rotvec_to_quat(turn[:, None] * [0.0, 1.0, 0.0])
    turning = Motion(SMPL22, FPS, np.zeros((80, 3)), rotations)
    turning = replace(turning, root=-turning.positions()[:, [10, 11], 1].min() * np.array([[0.0, 1.0, 0.0]] * 80))
    cleaned = clean_feet(turning).positions()
    directions = cleaned[:, FEET[1::2]] - cleaned[:, FEET[::2]]
    ways = np.degrees(np.unwrap(np.arctan2(directions[..., 0], directions[..., 2]), axis=0))
    stepping = cleaned[:, FEET[1::2], 1] > 0.02
    if abs(degrees) == 30:
        assert not stepping.any(), "so far a body turns over feet that stand"
        return
    assert ways[-1] - ways[0] == pytest.approx([degrees, degrees], abs=15)
    assert np.abs(ways - ways[0] - np.degrees(turn)[:, None]).max() < 40
    assert stepping.any(axis=0).all()
    assert not stepping.all(axis=1).any(), "one foot stands at any time"
    first, second = (int(np.flatnonzero(one)[0]) for one in stepping.T)
    assert (first < second) == (degrees > 0), "the foot of the side that is turned to goes first"
    resting = cleaned[:, FEET[1::2], 1] < 0.001
    steps = np.linalg.norm(np.diff(cleaned[:, FEET[1::2]], axis=0)[..., [0, 2]], axis=-1)
    assert steps[resting[1:] & resting[:-1]].max() < 0.005


def test_feet_come_out_of_the_floor() -> None:
    motion = slider(sink=0.04)
    assert depth(motion) > 0.03
    assert depth(clean_feet(motion)) < 0.0021  # 2 mm are left, as in recordings
    assert depth(clean_feet(motion, floor=-0.5)) == pytest.approx(depth(motion), abs=1e-3)


def test_whoever_stands_still_is_left_alone_but_for_toes_off_the_floor() -> None:
    motion = slider(speed=0.0).frames(0, 1)
    still = replace(motion, root=motion.root.repeat(30, 0), rotations=motion.rotations.repeat(30, 0))
    toes = [FEET[1], FEET[3]]
    np.testing.assert_allclose(still.positions()[0, toes, 1], [0, 0.0016], atol=1e-4)  # one leg is shorter
    clean = clean_feet(still).positions()
    np.testing.assert_allclose(clean[:, toes, 1], 0, atol=1e-4)
    np.testing.assert_allclose(clean, still.positions(), atol=0.0025)


@pytest.mark.parametrize(("height", "left"), [(0.008, 0.0), (-0.02, 0.0), (0.045, 0.045)])
def test_toes_near_the_floor_rest_on_it(height: float, left: float) -> None:
    """Of somebody who marches over or under the floor; who is higher may stand on something."""
    motion = slider(sink=-height)
    planted = planted_feet(motion.positions(), FPS)
    places = clean_feet(motion).positions()
    toes = [np.median(places[planted[:, foot], FEET[foot], 1]) for foot in (1, 3)]
    np.testing.assert_allclose(toes, left, atol=0.003)


def test_feet_in_the_air_are_left_alone() -> None:
    motion = wander(3)
    high = replace(motion, root=motion.root + np.array([0, 2, 0]))
    told = clean_feet(high, contacts=np.zeros((len(high), 4)))
    np.testing.assert_allclose(told.positions(), high.positions(), atol=1e-6)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([10.0, 20.0, 60.0]))
def test_any_motion_comes_out_whole(seed: int, fps: float) -> None:
    motion = wander(seed, frames=50, fps=fps)
    clean = clean_feet(motion)
    assert np.isfinite(clean.rotations).all()
    assert depth(clean) <= depth(motion) + 1e-4
    assert jerk(clean) < 1.2 * jerk(motion)
    assert ((clean.rotations[1:] * clean.rotations[:-1]).sum(-1) > 0).all()


@pytest.mark.parametrize("clip", ["07_01", "16_18", "39_01"])
def test_real_walks_slide_less_and_move_as_smoothly(clip: str) -> None:
    motion = motion_from_positions(real(clip), FPS)
    clean, planted = clean_feet(motion), planted_feet(motion.positions(), FPS)
    assert skate(clean, planted) < 0.2 * skate(motion, planted)
    assert depth(clean) <= max(depth(motion), 0.002)
    assert jerk(clean) < 1.1 * jerk(motion)
    assert knee_speed(clean) < 1.3 * knee_speed(motion)
    assert np.linalg.norm(clean.positions() - motion.positions(), axis=-1).mean() < 0.02


@pytest.mark.parametrize("clip", ["07_01", "35_01"])
def test_noisy_features_are_cleaned_by_their_own_contacts(clip: str) -> None:
    features = humanml.encode(real(clip))
    rng = np.random.default_rng(0)
    features[:, LAYOUT["root_velocity"]] *= 1.15  # the body outruns its feet
    features[:, LAYOUT["ric"]] += rng.normal(size=(len(features), 63)) * 0.005
    motion = motion_from_positions(humanml.decode_positions(features), FPS)
    contacts = features[:, LAYOUT["contacts"]]
    clean = clean_feet(motion, contacts=contacts)
    planted = planted_feet(motion.positions(), FPS, contacts=contacts)
    assert skate(clean, planted) < 0.2 * skate(motion, planted)
    assert jerk(clean) < 1.1 * jerk(motion)
    assert depth(clean) < 1e-4


def test_mistakes_are_reported() -> None:
    with pytest.raises(MotionloomError, match="retarget it first"):
        clean_feet(Motion(Skeleton(("a",), (-1,), np.zeros((1, 3))), FPS, np.zeros((4, 3)), np.eye(4)[:, None]))
    with pytest.raises(MotionloomError, match=r"contacts must be \(60, 4\) or \(59, 4\); got \(3, 4\)"):
        clean_feet(slider(), contacts=np.zeros((3, 4)))
