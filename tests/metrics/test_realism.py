"""Realism numbers of made-up people, and what passes for real."""

import numpy as np
import pytest

from motionloom.metrics import realism
from tests.metrics.people import FPS, clock, moved, standing, walking


def test_every_number_is_measured() -> None:
    assert set(realism.realism(walking(1.0), FPS)) == {n.name for n in realism.NUMBERS}


def test_centimetres_millimetres_and_metres_per_second() -> None:
    p = moved(standing(), np.full((80, 3), [0, 0.02, 0]) + clock(standing())[:, 0] * [0, 0, 1.0])
    row = realism.realism(p, FPS)
    assert row["float"] == pytest.approx(2)
    assert (row["speed_median"], row["speed_fast"]) == pytest.approx((1, 1))
    assert row["skate_speed"] == pytest.approx(100)
    stretched = standing()
    stretched[::2, 15, 1] += 0.042
    assert realism.realism(stretched, FPS)["bone_error"] > 0.5


def test_long_clips_weigh_more_and_one_ladder_does_not_lift_everybody() -> None:
    slow, fast = walking(0.5, 2.0), walking(2.0, 6.0)
    mean = realism.average([slow, fast], FPS)["speed_median"]
    assert mean == pytest.approx((0.5 * len(slow) + 2.0 * len(fast)) / (len(slow) + len(fast)))
    ladder = moved(standing(), np.full((80, 3), [0, 2.0, 0]))
    assert realism.average([standing(), standing(), ladder], FPS)["float"] == 0


@pytest.mark.parametrize(
    ("name", "generated", "real", "passes"),
    [
        ("jerk", 149.0, 100.0, True),
        ("jerk", 151.0, 100.0, False),
        ("jerk", 60.0, 100.0, False),  # too smooth is not real either
        ("jerk_peak", 10.0, 1000.0, True),
        ("skate_ratio", 0.009, 0.0, True),  # nobody sees it
        ("skate_ratio", 0.011, 0.0, False),
        ("speed_median", 0.04, 0.0, True),
        ("speed_median", 0.5, 1.0, False),
    ],
)
def test_half_as_much_again_passes_and_more_does_not(name: str, generated: float, real: float, passes: bool) -> None:
    number = next(n for n in realism.NUMBERS if n.name == name)
    assert realism.Comparison(number, generated, real).passes is passes


def test_real_clips_compared_with_themselves_pass_everywhere() -> None:
    own = realism.average([walking(1.0), standing()], FPS)
    assert all(row.passes and row.ratio in (1.0,) for row in realism.compare(own, own))


def test_speed_distance_of_two_steady_walks_is_the_difference_of_their_speeds() -> None:
    assert realism.speed_distance([walking(1.0)], [walking(1.5)], FPS) == pytest.approx(0.5, rel=0.01)
