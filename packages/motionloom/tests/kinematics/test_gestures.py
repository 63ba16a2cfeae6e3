"""Each gesture measured on a made-up person who does it, and on one who does something like it."""

import numpy as np
import pytest

from motionloom.kinematics import gestures, physics
from motionloom.kinematics.physics import J
from tests.kinematics.people import FPS, jumping, moved, spun, standing, walking


def test_oscillations_counts_the_swings_of_a_sine_and_passes_over_small_wiggles() -> None:
    t = np.arange(200) / 50
    assert gestures.oscillations(np.cos(2 * np.pi * t), 0.5) == 8  # four waves of two swings
    assert gestures.oscillations(0.1 * np.cos(2 * np.pi * t), 0.5) == 0
    assert gestures.oscillations(np.cos(2 * np.pi * t) + 0.05 * np.cos(70 * t), 0.5) == 8
    assert gestures.oscillations(t, 0.5) == 1


def test_a_parabola_jump_is_one_flight_of_its_height_and_duration() -> None:
    p = jumping(0.3)
    (flight,) = gestures.airborne(p, clearance=0.01)
    assert flight.clearance == pytest.approx(0.3)
    assert flight.rise == pytest.approx(0.3)
    assert (flight.stop - flight.start) / FPS == pytest.approx(2 * np.sqrt(2 * 0.3 / 9.81), abs=2 / FPS)


def test_walking_never_leaves_the_floor_and_a_floating_body_is_no_flight() -> None:
    assert gestures.airborne(walking(1.2)) == []
    assert gestures.airborne(moved(standing(), np.full((80, 3), [0, 0.5, 0]))) == []


def test_one_foot_up_is_not_airborne() -> None:
    p = standing()
    p[20:40, [7, 10], 1] += 0.4
    assert gestures.airborne(p) == []


def test_hops_count_for_the_foot_that_lands() -> None:
    p = np.concatenate([jumping(0.15, 1.0)] * 3)
    assert gestures.single_foot_hops(p) == (0, 0)
    up = p.copy()
    up[:, [5, 8, 11], 1] += 0.3  # the right foot is held up
    p = np.concatenate([standing(0.5), up, standing(0.5)])
    assert gestures.single_foot_hops(p) == (3, 0)
    assert gestures.single_foot_hops(p[:, [0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, *range(12, 22)]]) == (0, 3)


def test_a_leap_from_one_foot_to_the_other_is_no_hop() -> None:
    p = np.concatenate([standing(0.5), jumping(0.2, 2.0), standing(0.5)])
    p[:30, [5, 8, 11], 1] += 0.3  # the right foot is up until the top of the flight, then the left one
    p[30:, [4, 7, 10], 1] += 0.3
    assert len(gestures.airborne(p, clearance=0.04)) == 1
    assert gestures.single_foot_hops(p) == (0, 0)


def test_a_walk_of_four_seconds_lifts_each_foot_four_times() -> None:
    left, right = gestures.foot_height_peaks(walking(1.0))
    assert abs(left - 4) <= 1
    assert abs(right - 4) <= 1
    assert gestures.foot_height_peaks(standing()) == (0, 0)


def test_leg_length_and_standing_height() -> None:
    p = standing()
    thigh_and_shin = np.linalg.norm(p[0, 1] - p[0, 4]) + np.linalg.norm(p[0, 4] - p[0, 7])
    assert gestures.leg_length(p) == pytest.approx(thigh_and_shin)
    assert gestures.pelvis_height(p) == pytest.approx((p[:, 0, 1] - p[:, 7, 1]) / thigh_and_shin)


@pytest.mark.parametrize(("sign", "start"), [(1, 0.0), (-1, 0.0), (1, 2.0)])
def test_bending_is_signed_by_where_the_person_faces(sign: int, start: float) -> None:
    p = standing()
    p[:, J["neck"]] = p[:, 0] + [0, 0.3, sign * 0.3]
    p = spun(p, np.full(80, start))
    assert gestures.torso_inclination(p) == pytest.approx(np.pi / 4)
    assert gestures.forward_bend(p) == pytest.approx(sign * np.pi / 4)


def test_a_right_angle_at_the_knee_and_a_straight_leg() -> None:
    p = standing()
    p[:, 7] = p[:, 4] + [0, 0, -0.4]
    p[:, 4] = p[:, 1] + [0, -0.4, 0]
    p[:, 7] = p[:, 4] + [0, 0, -0.4]
    assert gestures.knee_bend(p)[:, 0] == pytest.approx(np.pi / 2)
    assert gestures.knee_bend(standing()).max() < 0.1


def test_hands_height_is_measured_from_the_joint_asked_for() -> None:
    p = standing()
    p[:, 20, 1] = p[:, 15, 1] + 0.25
    assert gestures.hands_height(p)[:, 0] == pytest.approx(0.25)
    assert (gestures.hands_height(p)[:, 1] < 0).all()
    assert gestures.hands_height(p, over="pelvis")[:, 0] == pytest.approx(0.25 + p[0, 15, 1] - p[0, 0, 1])


def test_a_wave_counts_swings_of_the_raised_hand_only() -> None:
    p = standing()
    t = np.arange(80) / FPS
    p[:, 21] = p[:, J["head"]] + np.stack([-0.3 + 0.15 * np.cos(2 * np.pi * t), 0 * t + 0.1, 0 * t], axis=-1)
    left, right = gestures.wrist_swings(p, FPS)
    assert left == 0
    assert right == 8
    p[:, 21, 1] -= 1.0  # the same swing below the belt is no wave
    assert gestures.wrist_swings(p, FPS) == (0, 0)


def test_turning_round_with_a_raised_hand_is_no_wave() -> None:
    p = standing()
    p[:, 21] = p[:, J["head"]] + [-0.3, 0.1, 0]
    assert gestures.wrist_swings(spun(p, np.linspace(0, 12, 80)), FPS) == (0, 0)


def test_extension_speed_is_the_rate_at_which_the_limb_lengthens() -> None:
    p = standing()
    reach = np.linspace(0.2, 1.0, 80)
    p[:, 8] = p[:, J["right_hip"]] + reach[::-1, None] * [0, 0, 1]
    rate = 0.8 / 79 * FPS
    assert gestures.foot_extension_speed(p, FPS)[:, 1] == pytest.approx(-rate)
    assert gestures.foot_extension_speed(p, FPS)[:, 0] == pytest.approx(0)


def test_limb_speed_leaves_out_travel_and_turning() -> None:
    p = moved(spun(standing(), np.linspace(0, 3, 80)), np.linspace(0, 4, 80)[:, None] * [1.0, 0, 1.0])
    assert gestures.limb_speed(p, FPS, physics.WRISTS).max() == pytest.approx(0, abs=1e-9)
    p[:, 20, 1] += np.linspace(0, 1, 80)
    assert gestures.limb_speed(p, FPS, (20, 21))[:, 0] == pytest.approx(FPS / 79)


def test_a_kick_is_the_height_of_a_foot_in_front_and_heels_behind_do_not_count() -> None:
    p = standing()
    p[40, 8] += [0, 0.5, 0.6]
    height, pace = gestures.kick_reach(p, FPS)
    assert height == pytest.approx(0.5 / gestures.leg_length(standing()))
    assert pace > 1
    p = standing()
    p[40, 8] += [0, 0.5, -0.6]
    assert gestures.kick_reach(p, FPS)[0] == 0


def test_a_thrust_goes_out_in_front_at_chest_height_and_raising_a_hand_is_none() -> None:
    p = standing()
    chest = p[:, J["right_shoulder"]]
    out = np.clip(np.linspace(0, 1.2, 80), 0.3, 0.6)
    p[:, 21] = chest + out[:, None] * [0, 0, 1.0]
    assert gestures.wrist_thrust(p, FPS)[:, 1].max() == pytest.approx(1.2 / 79 * FPS, rel=0.1)
    p[:, 21] = chest - out[:, None] * [0, 0, 1.0]  # backwards
    assert gestures.wrist_thrust(p, FPS).max() == 0
    p[:, 21] = chest + [0, -0.4, 0.4] + out[:, None] * [0, 1.0, 0.1]
    assert gestures.wrist_thrust(p, FPS).max() == 0


def test_climbing_stays_up_and_jumping_comes_down() -> None:
    up = np.repeat(np.clip(np.linspace(-0.5, 1.5, 80), 0, 1)[:, None], 3, axis=1) * [0, 1.0, 0]
    p = moved(standing(), up)
    assert gestures.stance_rise(p, FPS) == pytest.approx(1, abs=0.1)
    assert gestures.stance_rise(p[::-1], FPS) < 0.01
    assert gestures.stance_rise(jumping(0.4), FPS) < 0.1
    assert gestures.stance_rise(standing()[:3], FPS) == 0


def sitting(high: float, *, ahead: float = 0.4, seconds: float = 3.0) -> np.ndarray:
    """Standing for a second, then the hips at ``high`` metres with the feet on the floor ``ahead`` of them."""
    p = standing(seconds + 1.0)
    still = round(FPS)
    drop = np.where(np.arange(len(p)) < still, 0.0, p[0, J["left_hip"], 1] - high)
    feet = [J[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "foot")]
    rest = [j for j in range(22) if j not in feet]
    p[:, rest, 1] -= drop[:, None]
    p[still:, feet, 2] += ahead
    for side in ("left", "right"):  # knees above the feet, legs as long as they are
        p[still:, J[f"{side}_knee"]] = p[still:, J[f"{side}_ankle"]] + [0.0, 0.42, 0.0]
    return moved(p, np.full((len(p), 3), [1.0, 0.0, 2.0]))


def test_a_seat_belongs_where_somebody_sits() -> None:
    (seat,) = gestures.seats(sitting(0.54), FPS)
    assert seat.height == pytest.approx(0.54 - gestures.FLESH, abs=0.01)
    assert (seat.begin, seat.end) == (pytest.approx(1.0, abs=0.2), pytest.approx(4.0, abs=0.1))
    p = sitting(0.54)
    assert (seat.x, seat.z) == (pytest.approx(p[-1, 0, 0]), pytest.approx(p[-1, 0, 2]))


def test_who_stands_walks_squats_or_sits_on_the_floor_needs_no_seat() -> None:
    for p in (
        standing(),
        walking(1.2),
        sitting(0.5, ahead=0.0),
        sitting(0.12),
        sitting(0.33),
        sitting(0.54, seconds=0.8),
    ):
        assert gestures.seats(p, FPS) == []


def test_from_when_on_somebody_stands_still() -> None:
    body = walking(1.2, 2.0)
    assert gestures.still_from(body, FPS) is None
    rest = np.concatenate([body, np.repeat(body[-1:], 40, axis=0)])
    assert gestures.still_from(rest, FPS) == pytest.approx(2.0, abs=0.15)
    assert gestures.still_from(standing(2.0), FPS) == 0
