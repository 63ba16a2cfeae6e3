"""Realism numbers of made-up people, and what passes for real."""

import numpy as np
import pytest

from motionloom_lab.metrics import realism
from tests.kinematics.people import FPS, clock, moved, standing, walking


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


def test_depth_and_height_are_centimetres_each_on_its_own_side() -> None:
    """A quarter of the frames 3 cm under the floor, the others 2 cm over."""
    p = moved(standing(), np.where(np.arange(80) % 4, 0.02, -0.03)[:, None] * [0, 1.0, 0])
    row = realism.realism(p, FPS)
    assert (row["penetration"], row["float"]) == pytest.approx((3 / 4, 2 * 3 / 4))


def test_skate_is_a_share_and_two_speeds() -> None:
    """0.7 m/s on toes 1.25 cm up: all frames, 70 cm/s, weighted by 2 - sqrt(2)."""
    p = moved(standing(), clock(standing())[:, 0] * [0, 0, 0.7] + [0, 0.0125, 0])
    row = realism.realism(p, FPS)
    numbers = row["skate_ratio"], row["skate_speed"], row["skate_weighted"]
    assert numbers == pytest.approx((1, 70, 70 * (2 - np.sqrt(2))))


def test_jerk_is_the_mean_and_its_peak_the_largest() -> None:
    p = standing()
    p[:, 15] += clock(p)[:, 0] ** 3 * [0, 0, 1.0]
    row = realism.realism(p, FPS)
    assert (row["jerk"], row["jerk_peak"]) == pytest.approx((6 / 22, 6))


def test_bone_error_is_millimetres() -> None:
    """A wrist bone 1 cm longer in a quarter of the frames: 10 / 4 / 21 mm."""
    p = standing()
    arm = p[0, 21] - p[0, 19]
    p[::4, 21] += 0.01 * arm / np.linalg.norm(arm)
    assert realism.realism(p, FPS)["bone_error"] == pytest.approx(10 / 4 / 21)


def test_limb_speed_is_of_wrists_and_ankles_against_the_body() -> None:
    """Carried along nothing moves; one wrist at 0.8 m/s and one ankle at 0.4 are 1.2 over four limbs."""
    p = moved(standing(), clock(standing())[:, 0] * [0.3, 0, 1.0])
    assert realism.realism(p, FPS)["limb_speed"] == pytest.approx(0, abs=1e-9)
    p[:, 20] += clock(p)[:, 0] * [0.0, 0.8, 0]
    p[:, 8] += clock(p)[:, 0] * [0.0, 0.24, 0.32]
    p[:, 4] += clock(p)[:, 0] * [0.0, 9.0, 0]  # knees are not asked
    assert realism.realism(p, FPS)["limb_speed"] == pytest.approx(1.2 / 4)


def test_median_and_fast_speed_of_one_who_stands_walks_and_runs() -> None:
    """60 % standing, 35 % at 1 m/s, 5 % at 3 m/s: median 0, the 90th percentile 1, the mean and the largest neither."""
    z = np.cumsum(np.repeat([0.0, 1.0, 3.0], [240, 140, 20])) / FPS
    p = moved(standing(20.0), z[:, None] * [0, 0, 1.0])
    row = realism.realism(p, FPS)
    assert (row["speed_median"], row["speed_fast"]) == pytest.approx((0, 1), abs=1e-9)


@pytest.mark.parametrize(
    ("name", "generated", "real", "passes"),
    [
        ("jerk", 4.0, 100.0, False),  # small, yet far from real where too little is wrong as well
        ("jerk", 96.0, 100.0, True),
        ("jerk_peak", 140.0, 91.0, False),  # near enough, yet neither small nor within the limit
        ("jerk_peak", 40.0, 1.0, True),
        ("bone_error", 0.0, 5.0, True),
    ],
)
def test_unseen_is_small_or_for_two_sided_numbers_near(name: str, generated: float, real: float, passes: bool) -> None:
    number = next(n for n in realism.NUMBERS if n.name == name)
    assert realism.Comparison(number, generated, real).passes is passes


def test_ratios_are_generated_over_real_and_of_nothing_one_or_infinite() -> None:
    number = realism.NUMBERS[0]
    ratios = [realism.Comparison(number, g, r).ratio for g, r in ((3.0, 2.0), (0.0, 0.0), (0.1, 0.0))]
    assert ratios == [1.5, 1.0, float("inf")]
    rows = realism.compare({n.name: 3.0 for n in realism.NUMBERS}, {n.name: 2.0 for n in realism.NUMBERS})
    assert [(row.generated, row.real) for row in rows] == [(3.0, 2.0)] * len(realism.NUMBERS)


def test_speed_distance_moves_mass_and_does_not_cancel() -> None:
    """Half at 0.5 and half at 1.5 are 0.5 away from 1.0; a quarter of the frames at 0.5, not 2.0, are 1.5 / 4 away."""
    assert realism.speed_distance([walking(0.5), walking(1.5)], [walking(1.0)], FPS) == pytest.approx(0.5, rel=0.02)
    mixed = [walking(0.5, 2.0), walking(2.0, 6.0)]
    assert realism.speed_distance(mixed, [walking(2.0)], FPS) == pytest.approx(1.5 / 4, rel=0.02)


def test_speed_distance_of_a_steady_start_from_rest_is_its_mean_speed() -> None:
    """Speeds spread evenly from 0 to 2 m/s against standing: 1 m/s."""
    p = standing(20.0)
    start = moved(p, (np.arange(400)[:, None] / FPS) ** 2 / 20 * [0, 0, 1.0])
    assert realism.speed_distance([start], [p], FPS) == pytest.approx(399 / 400, abs=0.002)
