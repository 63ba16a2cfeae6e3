"""Closed forms for every measurement, and a fault in the motion that each must notice."""

import numpy as np
import pytest

from motionloom.kinematics import physics
from tests.kinematics.people import FPS, circling, clock, moved, spun, standing, walking


def test_heading_is_zero_facing_z_and_a_quarter_turn_to_the_left_faces_x() -> None:
    p = spun(standing(), np.linspace(0, np.pi / 2, 80))
    assert np.allclose(physics.heading(p)[[0, -1]], [0, np.pi / 2])
    nose = physics.turned(np.array([1.0, 0.0, 0.0]), physics.heading(p)[-1])
    assert np.allclose(nose, [0, 0, 1])  # +X is straight ahead now


def test_heading_counts_whole_turns() -> None:
    assert physics.turn(spun(standing(), np.linspace(0, -6 * np.pi, 80))) == pytest.approx(-6 * np.pi, rel=0.03)


def test_mirroring_negates_every_signed_measure() -> None:
    p = circling(1.0, 1.0)
    m = (p * [-1, 1, 1])[:, [0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20]]
    assert physics.turn(m) == pytest.approx(-physics.turn(p))
    assert physics.winding(m, FPS) == pytest.approx(-physics.winding(p, FPS))
    assert physics.displacement(m, FPS).left == pytest.approx(-physics.displacement(p, FPS).left, abs=1e-9)


@pytest.mark.parametrize("start", [0.0, 1.0, -2.5])
def test_a_walk_covers_its_distance_whatever_way_the_world_is_turned(start: float) -> None:
    p = spun(standing(), np.full(80, start))
    ahead = np.array([np.sin(start), 0.0, np.cos(start)])
    p = moved(p, np.linspace(0, 3, 80)[:, None] * ahead)
    way = physics.displacement(p, FPS)
    assert (way.forward, way.left, way.up) == pytest.approx((3, 0, 0), abs=1e-9)
    assert np.allclose(physics.root_velocity_in_heading(p, FPS), [0, 0, 3 / 79 * FPS])


def test_a_step_to_the_left_is_positive() -> None:
    p = moved(standing(), np.linspace(0, 1, 80)[:, None] * [1.0, 0, 0])
    assert physics.displacement(p, FPS).left == pytest.approx(1)


def test_speed_and_travel_of_a_constant_walk() -> None:
    p = walking(1.3)
    assert np.allclose(physics.speed(p, FPS), 1.3)
    assert physics.travel(p, FPS) == pytest.approx(1.3 * 79 / FPS)


def test_sway_is_not_travel() -> None:
    p = standing()
    sway = moved(p, 0.01 * np.sin(40 * clock(p)[:, 0]) * [1.0, 0, 0])
    assert physics.travel(sway, FPS) < 0.4 * 0.01 * 40 * 2 / np.pi * 4


@pytest.mark.parametrize(("radius", "rounds"), [(1.0, 1.0), (2.0, 0.5), (0.8, -2.0)])
def test_a_circle_has_its_winding(radius: float, rounds: float) -> None:
    p = circling(radius, rounds)
    assert physics.winding(p, FPS) == pytest.approx(2 * np.pi * rounds, rel=0.06)


def test_a_straight_walk_and_standing_do_not_wind() -> None:
    assert physics.winding(walking(1.2), FPS) == pytest.approx(0, abs=1e-6)
    assert physics.winding(standing(), FPS) == 0


def test_spinning_on_the_spot_turns_without_winding() -> None:
    p = spun(standing(), np.linspace(0, 2 * np.pi, 80))
    assert physics.winding(p, FPS) == 0
    assert physics.turn(p) == pytest.approx(2 * np.pi, rel=0.03)


def test_planted_feet_do_not_skate_in_any_definition() -> None:
    skate = physics.foot_skate(walking(1.0), FPS)
    assert skate.ratio == 0
    assert skate.contact_speed == pytest.approx(0, abs=1e-9)
    still = physics.foot_skate(standing(), FPS)
    assert (still.ratio, still.contact_speed, still.weighted) == (0, 0, 0)


def test_a_body_dragged_at_one_metre_per_second_skates_at_that_speed() -> None:
    p = standing()
    skate = physics.foot_skate(moved(p, clock(p)[:, 0] * [1.0, 0, 0]), FPS)
    assert skate.ratio == 1
    assert skate.contact_speed == pytest.approx(100)
    assert skate.weighted == pytest.approx(100)  # height 0 weighs 2 - 2^0 = 1


def test_the_weight_of_a_sliding_toe_falls_with_its_height() -> None:
    p = standing()
    drag = moved(p, clock(p)[:, 0] * [1.0, 0, 0] + [0, 0.0125, 0])
    assert physics.foot_skate(drag, FPS).weighted == pytest.approx(100 * (2 - np.sqrt(2)))
    assert physics.foot_skate(drag, FPS, floor=0.0125).weighted == pytest.approx(100)
    assert physics.foot_skate(moved(drag, np.full((80, 3), [0, 0.1, 0])), FPS).ratio == 0  # in the air


def test_slow_sliding_is_no_skate_by_ratio_but_shows_in_the_speeds() -> None:
    p = standing()
    skate = physics.foot_skate(moved(p, clock(p)[:, 0] * [0.4, 0, 0]), FPS)
    assert skate.ratio == 0
    assert skate.contact_speed == pytest.approx(40)


def test_skate_does_not_depend_on_the_frame_rate() -> None:
    slow, fast = (moved(p, clock(p, f)[:, 0] * [0.7, 0, 0]) for f in (20, 60) for p in [standing(4.0, f)])
    assert physics.foot_skate(slow, 20).contact_speed == pytest.approx(physics.foot_skate(fast, 60).contact_speed)


def test_penetration_and_float_are_the_offset_from_the_floor() -> None:
    p = standing()
    low, high = (moved(p, np.full((80, 3), [0, y, 0])) for y in (-0.03, 0.02))
    assert physics.penetration(low) == pytest.approx(0.03)
    assert physics.float_height(low) == 0
    assert physics.float_height(high) == pytest.approx(0.02)
    assert physics.penetration(high) == 0
    assert physics.penetration(high, floor=0.05) == pytest.approx(0.03)


def test_floor_height_is_where_the_feet_are_most_often_lowest() -> None:
    p = moved(walking(1.0), np.full((80, 3), [0, 0.4, 0]))
    p[10, 10, 1] = -3.0  # one broken frame does not move the floor
    assert physics.floor_height(p) == pytest.approx(0.4, abs=0.01)


def test_jerk_of_a_cubic_path_is_six_and_of_a_parabola_zero() -> None:
    p = standing()
    t = clock(p)[:, 0]
    cubic = physics.jerk(moved(p, t**3 * [1.0, 0, 0]), FPS)
    assert (cubic.mean, cubic.peak) == pytest.approx((6, 6))
    assert physics.jerk(moved(p, t**2 * [1.0, 0, 0]), FPS).peak == pytest.approx(0, abs=1e-6)


def test_jerk_peaks_where_one_joint_jumps() -> None:
    p = standing()
    p[40, 21, 0] += 0.01
    assert physics.jerk(p, FPS).peak == pytest.approx(3 * 0.01 * FPS**3)  # weights 1 -3 3 -1
    assert physics.jerk(p[:3], FPS).mean == 0


def test_bone_length_error_is_the_mean_over_bones_and_frames() -> None:
    p = standing()
    p[::2, 15, 1] += 0.21  # the head bone, half of the frames, one bone of 21 (a median sees either half)
    grown = physics.bone_length_error(p, lengths=physics.bone_lengths(standing())[0])
    stretched = np.linalg.norm(p[0, 15] - p[0, 12]) - np.linalg.norm(p[1, 15] - p[1, 12])
    assert grown == pytest.approx(stretched / 21 / 2)
    assert physics.bone_length_error(walking(1.0)[:, :1].repeat(22, 1)) == 0


def test_rigid_motion_has_no_bone_length_error() -> None:
    assert physics.bone_length_error(circling(1.0, 1.0)) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_very_short_clips_give_numbers(frames: int) -> None:
    p = standing()[:frames]
    values = [physics.travel(p, FPS), physics.turn(p), physics.winding(p, FPS), physics.jerk(p, FPS).mean]
    assert values == [0, 0, 0, 0]
    assert physics.foot_skate(p, FPS).ratio == 0
    assert np.isfinite(physics.speed(p, FPS)).all()


def test_a_toe_that_stops_for_a_frame_does_not_skate_in_that_frame() -> None:
    p = standing()
    way = np.cumsum(np.where(np.arange(80) % 5, 1.5 / FPS, 0.0))  # four frames of five at 1.5 m/s
    assert physics.foot_skate(moved(p, way[:, None] * [1.0, 0, 0]), FPS).ratio == pytest.approx(0.8, abs=0.02)


TOES = list(physics.TOES)


def sliding(*steps: float, height: float = 0.0) -> np.ndarray:
    """Standing on toes at ``height`` that go along +Z by ``steps`` in m/s, one frame each, then stand still."""
    p = standing(1.0 + (len(steps) + 1) / FPS)
    p[1 : len(steps) + 1, TOES, 2] += (np.cumsum(steps) / FPS)[:, None]
    p[len(steps) + 1 :, TOES, 2] += sum(steps) / FPS
    p[:, TOES, 1] = height
    return p


def test_one_toe_that_slides_is_a_skating_frame() -> None:
    """Left slides, right stands: every frame skates, at half the speed on average; in the air the right is no toe."""
    p = standing()
    p[:, TOES[0], 2] += clock(p)[:, 0, 0]
    skate = physics.foot_skate(p, FPS)
    assert (skate.ratio, skate.contact_speed, skate.weighted) == pytest.approx((1, 50, 50))
    p[:, TOES[1], 1] = 0.3
    skate = physics.foot_skate(p, FPS)
    assert (skate.ratio, skate.contact_speed, skate.weighted) == pytest.approx((1, 100, 50))


@pytest.mark.parametrize(("quick", "frames"), [(1, 0), (2, 0), (3, 3), (4, 4)])
def test_a_slide_must_last_for_the_five_frame_average(quick: int, frames: int) -> None:
    """Steps of 1 m/s: two of five average 0.4 m/s, three of five 0.6."""
    p = sliding(*[0.0] * 5, *[1.0] * quick, *[0.0] * 5)
    assert physics.foot_skate(p, FPS).ratio == pytest.approx(frames / (len(p) - 1))


def test_the_step_itself_must_be_quick_too() -> None:
    """A still frame between quick ones has a quick average and does not skate."""
    p = sliding(*[0.0] * 5, 1.5, 1.5, 0.0, 1.5, 1.5, *[0.0] * 5)
    assert physics.foot_skate(p, FPS).ratio == pytest.approx(4 / (len(p) - 1))


@pytest.mark.parametrize(("height", "weight"), [(0.0, 1.0), (0.0125, 2 - 2**0.5), (0.04, 0.0), (-0.025, 1.0)])
def test_the_weight_is_one_on_and_under_the_floor_and_nothing_above_its_height(height: float, weight: float) -> None:
    p = sliding(*[1.0] * 10, height=height)
    assert physics.foot_skate(p, FPS).weighted == pytest.approx(100 * weight * 10 / (len(p) - 1))


def test_a_step_weighs_by_the_height_it_starts_from() -> None:
    p = standing()[:2]
    p[1, TOES] += [0.0, 0.02, 0.05]
    assert physics.foot_skate(p, FPS).weighted == pytest.approx(100)
    p[1, TOES, 1] = 0.06  # lifted: a contact needs both of its frames
    assert physics.foot_skate(p, FPS).contact_speed == 0
    assert physics.foot_skate(p[::-1], FPS).contact_speed == 0


def test_penetration_and_float_do_not_make_up_for_one_another() -> None:
    """3 cm under in a quarter of the frames, 2 cm over in the rest; only the lowest joint counts."""
    p = moved(standing(), np.where(np.arange(80) % 4, 0.02, -0.03)[:, None] * [0, 1.0, 0])
    assert physics.penetration(p) == pytest.approx(0.03 / 4)
    assert physics.float_height(p) == pytest.approx(0.02 * 3 / 4)
    assert physics.penetration(p, floor=0.02) == pytest.approx(0.05 / 4)
    assert physics.float_height(p, floor=-0.03) == pytest.approx(0.05 * 3 / 4)


def test_jerk_is_a_length_averaged_over_joints() -> None:
    """One wrist of 22 joints on t^3 (1, 2, 2): length 18 at its peak, 18 / 22 on average."""
    p = standing()
    p[:, 21] += clock(p)[:, 0] ** 3 * [1.0, 2.0, 2.0]
    found = physics.jerk(p, FPS)
    assert (found.mean, found.peak) == pytest.approx((18 / 22, 18))
    p[:40, 21] = p[40, 21]
    assert physics.jerk(p, FPS).mean == pytest.approx(np.linalg.norm(np.diff(p, n=3, axis=0), axis=2).mean() * FPS**3)


def test_bones_go_from_each_joint_to_its_parent() -> None:
    """All joints in one point but one: a wrist stretches its own bone, the pelvis the three that leave it."""
    p = np.zeros((2, 22, 3))
    p[1, 21] = [0.0, 3.0, 4.0]
    assert np.array_equal(physics.bone_lengths(p), [[0] * 21, [0] * 20 + [5]])
    p[1, 21], p[1, 0] = 0, [4.0, 0.0, 3.0]
    assert np.array_equal(physics.bone_lengths(p)[1], [5, 5, 5] + [0] * 18)


def test_bone_length_error_is_absolute_and_from_the_median() -> None:
    """One bone longer by 4 cm in the first frame and shorter by 4 in another of ten: 8 / 10 / 21 cm."""
    p = np.zeros((10, 22, 3))
    p[:, 21, 0] = 0.25
    p[0, 21, 0], p[5, 21, 0] = 0.29, 0.21
    assert physics.bone_length_error(p) == pytest.approx(0.08 / 10 / 21)
    p[5, 21, 0] = 0.29
    assert physics.bone_length_error(p) == pytest.approx(0.08 / 10 / 21)
    assert physics.bone_length_error(p, lengths=np.zeros(21)) == pytest.approx((0.25 * 8 + 0.58) / 10 / 21)


def test_speed_is_that_of_the_pelvis_across_the_floor() -> None:
    """0.6 and 0.8 m/s across are 1 m/s, whatever it climbs and wherever the legs go."""
    p = moved(standing(), clock(standing())[:, 0] * [0.6, 5.0, 0.8])
    p[:, 1:] += np.random.default_rng(0).normal(size=(80, 21, 3))
    assert np.allclose(physics.speed(p, FPS), 1)


def test_speed_looks_an_eighth_of_a_second_around() -> None:
    """A start from rest at frame 40 is seen from two frames of average and one of difference away."""
    z = np.maximum(np.arange(80) - 40, 0) / FPS
    pace = physics.speed(moved(standing(), z[:, None] * [0, 0, 1.0]), FPS)
    assert np.allclose(pace[:38], 0)
    assert np.allclose(pace[43:], 1)
    assert np.allclose(pace[38:43], [0.1, 0.3, 0.5, 0.7, 0.9])


def test_steps_to_and_fro_cancel_in_the_speed() -> None:
    """1 cm right, back, left, back: velocities of 0.2 and -0.2 m/s with rests between leave a fifth on average."""
    x = 0.01 * np.array([0, 1, 0, -1] * 20)
    pace = physics.speed(moved(standing(), x[:, None] * [1.0, 0, 0]), FPS)
    assert pace[4:-4].max() == pytest.approx(0.2 / 5)


def test_velocity_of_a_parabola_is_central() -> None:
    t = np.arange(9) / FPS
    assert np.allclose(physics.velocity(t**2, FPS)[1:-1], 2 * t[1:-1])


def test_smoothing_averages_what_is_there() -> None:
    assert np.allclose(physics.smooth(np.array([0.0, 0, 3, 0, 0]), 3), [0, 1, 1, 1, 0])
    assert np.allclose(physics.smooth(np.array([3.0, 0, 0]), 3), [1.5, 1, 0])
    assert np.allclose(physics.smooth(np.array([[1.0, 10], [3, 30]]), 3), [[2, 20], [2, 20]])


@pytest.mark.parametrize(("frames", "found"), [(0.2, 1), (1, 1), (3.9, 3), (4.2, 5), (5, 5), (10.5, 11)])
def test_windows_have_the_nearest_odd_length(frames: float, found: int) -> None:
    assert physics.odd(frames) == found


def test_who_stands_in_a_tenth_of_the_frames_stands_on_the_floor() -> None:
    p = moved(standing(), np.where(np.arange(80) % 10, 0.5, 0.1)[:, None] * [0, 1.0, 0])
    assert physics.floor_height(p) == pytest.approx(0.1)
