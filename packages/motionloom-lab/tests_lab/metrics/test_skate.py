"""Feet that slide at a known speed at a known height."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.kinematics.physics import J
from motionloom_lab.metrics.skate import Skate, skate, slide
from tests.kinematics.people import FPS, clock, moved, standing, walking

LEFT, RIGHT = J["left_foot"], J["right_foot"]


def feet(height: float, speed: float, *, side: float = 0.0, frames: int = 40) -> np.ndarray:
    """(frames, 22, 3): everything 1 m up except the toes, at ``height``, going along +Z (and ``side``, +X) in m/s."""
    p = np.ones((frames, 22, 3)) * [0.0, 1.0, 0.0]
    p[:, [LEFT, RIGHT], 1] = height
    p[:, [LEFT, RIGHT]] += (np.arange(frames) / FPS)[:, None, None] * [side, 0.0, speed]
    return p


def test_a_body_dragged_along_the_floor() -> None:
    """1 m/s at 20 fps: every frame skates, 100 cm/s, 50 mm per frame."""
    p = standing()
    feet = skate(moved(p, clock(p)[:, 0] * [0.0, 0.0, 1.0]), FPS)
    assert (feet.share, feet.speed, feet.slide) == pytest.approx((1, 100, 50))


def test_both_horizontal_axes_count_and_the_height_does_not() -> None:
    """0.6 and 0.8 m/s are 1 m/s; the toes rise by 0.01 m/s besides."""
    p = feet(0.0, 0.8, side=0.6)
    p[:, [LEFT, RIGHT], 1] += 0.01 * np.arange(40)[:, None] / FPS
    found = skate(p, FPS)
    assert (found.share, found.speed, found.slide) == pytest.approx((1, 100, 50))


@pytest.mark.parametrize(
    ("height", "speed", "expected"),
    [
        (0.01, 0.6, (1, 60, 30)),
        (0.01, 0.4, (0, 40, 20)),  # 2 cm a frame is no skate by share
        (0.049, 0.6, (1, 60, 0)),  # over 2 cm and over 1 cm a frame: no contact by slide
        (0.049, 0.19, (0, 19, 9.5)),  # slow toes are in contact by slide at any height
        (0.051, 0.6, (0, 0, 0)),
        (0.3, 0.0, (0, 0, 0)),
    ],
)
def test_thresholds_of_height_and_speed(height: float, speed: float, expected: tuple[float, float, float]) -> None:
    """Left and right alike; the floor of the third is 0 here as for the others, where one toe touches it at once."""
    p = feet(height, speed)
    found = skate(p, FPS)
    assert (found.share, found.speed) == pytest.approx(expected[:2])
    assert slide(p, floor=0.0) == pytest.approx(expected[2])


def test_the_floor_of_the_slide_is_the_lowest_toe() -> None:
    """A clip that floats 1 m up slides as it does on the floor, by this definition only."""
    high = feet(1.0, 0.6)
    found = skate(high, FPS)
    assert (found.share, found.speed, found.slide) == pytest.approx((0, 0, 30))
    assert skate(high, FPS, floor=1.0).share == 1


def test_left_and_right_count_alike_however_long_they_touch() -> None:
    """Left at 30 mm per frame in all frames, right at 4 mm in the first ten and high up, fast, after: (30 + 4) / 2."""
    p = feet(0.0, 0.6)
    across = np.concatenate([0.004 * np.arange(11), 0.04 + 0.1 * np.arange(1, 30)])
    p[:, RIGHT, 2] = across
    p[10:, RIGHT, 1] = 0.5
    assert slide(p) == pytest.approx((30 + 4) / 2)
    p[:, RIGHT, 1] = 0.5
    p[:, RIGHT, 2] = 0.1 * np.arange(40)  # never in contact: 0, as published
    assert slide(p) == pytest.approx(15)


def test_contact_asks_for_the_step_in_space() -> None:
    """A toe that goes straight up by 2 cm a frame is not in contact, though it does not move across."""
    p = feet(0.0, 0.0)
    p[:, LEFT, 2] = 0.005 * np.arange(40)  # in contact throughout: 5 mm
    p[:, RIGHT, 1] = 0.021 + 0.02 * np.arange(40)
    p[:, RIGHT, 2] = 0.009 * np.arange(40)
    assert slide(p) == pytest.approx(5 / 2)


def test_the_last_frame_has_the_step_before_it() -> None:
    """Three frames, steps of 4 and 8 mm: (4 + 8 + 8) / 3."""
    p = feet(0.0, 0.0, frames=3)
    p[:, [LEFT, RIGHT], 0] = np.array([0.0, 0.004, 0.012])[:, None]
    assert slide(p) == pytest.approx(20 / 3)


def test_planted_feet_do_not_skate() -> None:
    assert skate(standing(), FPS) == Skate(0, 0, 0)
    feet = skate(walking(1.0), FPS)
    assert (feet.share, feet.speed) == pytest.approx((0, 0), abs=1e-9)


def test_other_joints_do_not_matter() -> None:
    p = feet(0.0, 0.4)
    q = p.copy()
    q[:, [j for j in range(22) if j not in (LEFT, RIGHT)]] = np.random.default_rng(0).normal(size=(40, 20, 3))
    assert skate(p, FPS) == skate(q, FPS)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: skate(standing(), 0.0), "frames per second"),
        (lambda: skate(standing(), float("nan")), "frames per second"),
        (lambda: skate(standing()[:1], FPS), "1 frames where at least 2"),
        (lambda: slide(np.full((5, 22, 3), np.nan)), "not finite"),
        (lambda: slide(np.zeros((5, 21, 3))), "22"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(call, words: str) -> None:
    with pytest.raises(MotionloomError, match=words):
        call()
