"""Two people measured: closed forms, naive versions, and the figure that the capsules stand for."""

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import capsules
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import J
from motionloom.viz.figure import figure
from motionloom_lab.metrics import pair as mp
from motionloom_lab.metrics import pair_groups as groups
from motionloom_lab.metrics.skate import skate
from tests.kinematics import people

RNG = np.random.default_rng(5)


def couple(apart: float = 1.0, *, seconds: float = 4.0, turn: float = np.pi) -> np.ndarray:
    """(2, frames, 22, 3): one at the origin facing +Z, the other ``apart`` metres ahead, turned by ``turn``."""
    a = people.standing(seconds)
    b = people.spun(people.standing(seconds), np.full(len(a), turn))
    return np.stack([a, b + np.array([0.0, 0.0, apart]) + (a[0, 0] - b[0, 0]) * [1.0, 0.0, 1.0]])


def rigid(positions: np.ndarray, angle: float, place: tuple[float, float, float]) -> np.ndarray:
    return ph.turned(positions, angle) + np.array(place)


# Errors --------------------------------------------------------------------------------------------------------------


def naive_errors(real, predicted, k, prefix=20, fps=20):
    root, joint, whole = [], [], []
    for r, p in zip(real, predicted, strict=True):
        for person in range(2):
            for frame in range(prefix, prefix + k * fps):
                a, b = r[person, frame], p[person, frame]
                root.append(np.linalg.norm(a[0] - b[0]))
                joint.append(np.mean([np.linalg.norm((a[j] - a[0]) - (b[j] - b[0])) for j in range(1, 22)]))
                whole.append(np.mean([np.linalg.norm(a[j] - b[j]) for j in range(22)]))
    return np.mean(root), np.mean(joint), np.mean(whole)


def test_completion_errors_equal_a_loop_over_people_and_frames():
    real = np.stack([couple(1.0), couple(1.4)]) + 0.02 * RNG.standard_normal((2, 2, 80, 22, 3)).cumsum(axis=2)
    predicted = real + np.linspace(0, 0.5, 80)[:, None, None] * RNG.standard_normal((2, 2, 80, 22, 3))
    predicted[:, :, :20] = real[:, :, :20]
    for error, k in zip(mp.completion_errors(real, predicted), (1, 2, 3), strict=True):
        np.testing.assert_allclose((error.root, error.joint, error.absolute), naive_errors(real, predicted, k))
        assert error.seconds == k


def test_a_partner_who_walks_away_gives_horizons_in_closed_form():
    real, predicted = couple(), couple()
    predicted[1, :, :, 0] += np.maximum(np.arange(80) - 19, 0)[:, None] * 0.01  # 1 cm per frame from frame 20 on
    horizons = mp.completion_errors(real, predicted)
    expected = [0.01 * (20 * k + 1) / 2 / 2 for k in (1, 2, 3)]  # mean of 1..20k cm, over two people
    np.testing.assert_allclose([e.root for e in horizons], expected)
    np.testing.assert_allclose([e.absolute for e in horizons], expected)
    np.testing.assert_allclose([e.joint for e in horizons], 0, atol=1e-12)


def test_errors_in_the_prefix_and_beyond_the_horizon_do_not_count():
    real = couple(seconds=5.0)
    predicted = real.copy()
    predicted[0, 1:20, 5] += 1.0
    predicted[0, 80:] += 1.0
    assert mp.completion_errors(real, predicted)[-1].absolute == 0
    predicted[0, 40, 5, 1] += 21.0
    assert [e.joint for e in mp.completion_errors(real, predicted)] == pytest.approx([0, 1 / 2 / 40, 1 / 2 / 60])


def test_a_prediction_elsewhere_in_the_world_is_no_error():
    real = couple() + 0.02 * RNG.standard_normal((2, 80, 22, 3)).cumsum(axis=1)
    elsewhere = rigid(real, 2.2, (5.0, 0.0, -3.0))
    assert all(e.absolute < 1e-12 for e in mp.completion_errors(real, elsewhere))


def test_completions_of_another_shape_or_too_short_are_refused():
    with pytest.raises(MotionloomError, match="80 or more"):
        mp.completion_errors(couple()[:, :79], couple()[:, :79])
    with pytest.raises(MotionloomError, match="crops"):
        mp.completion_errors(couple()[0], couple()[0])


# Where they are ------------------------------------------------------------------------------------------------------


def test_distance_ignores_height():
    pair = couple(1.7)
    pair[1, :, :, 1] += 0.3
    np.testing.assert_allclose(mp.distance(pair), 1.7)


@pytest.mark.parametrize("turn", [0.0, 0.5, np.pi / 2, np.pi, -np.pi / 2, 3 * np.pi])
def test_facing_is_the_angle_between_headings_however_often_they_turned(turn):
    expected = abs((turn + np.pi) % (2 * np.pi) - np.pi)
    np.testing.assert_allclose(mp.facing_angle(rigid(couple(turn=turn), 0.7, (1, 0, 2))), expected, atol=1e-9)


def test_people_face_to_face_look_at_each_other_and_back_to_back_away():
    np.testing.assert_allclose(mp.looking_away(couple()), 0, atol=1e-9)
    assert mp.mutual(couple()) == 1
    np.testing.assert_allclose(mp.looking_away(couple(-1.0)), np.pi)
    assert mp.mutual(couple(turn=0.0)) == 0  # one behind the other
    np.testing.assert_allclose(mp.looking_away(couple(turn=0.0))[:, 0], [0, np.pi], atol=1e-9)


def test_all_numbers_are_the_same_anywhere_and_with_the_people_swapped_or_mirrored():
    pair = np.stack([people.circling(1.0, 1.0), people.walking(0.3, 8.0) + np.array([1.5, 0, 0.5])])
    flip = pair[:, :, list(SMPL22.mirror_pairs())] * [-1.0, 1.0, 1.0]
    expected = mp.pair_stats(pair)
    for same in (pair[::-1], rigid(pair, 1.3, (4.0, 0.0, -2.0)), flip):
        assert mp.pair_stats(same) == pytest.approx(expected, abs=2e-3)


# Touch ---------------------------------------------------------------------------------------------------------------


def test_the_nearest_of_four_wrist_distances_counts():
    pair = couple(3.0)
    target = pair[0, :, J["right_wrist"]] + [0.0, 0.15, 0.0]
    pair[1, :40, J["left_wrist"]] = target[:40]
    near = mp.hand_distance(pair)
    np.testing.assert_allclose(near[:40], 0.15)
    assert (near[40:] > 2.5).all()
    assert mp.hand_contact(pair) == 0.5


def test_a_hand_on_the_others_shin_is_a_touch_at_the_surface():
    pair = couple(3.0)
    knee, ankle = pair[1, :, J["left_knee"]], pair[1, :, J["left_ankle"]]
    pair[0, :20, J["right_wrist"]] = ((knee + ankle) / 2 - [0.0, 0.0, 0.1])[:20]
    gap = 0.1 - 0.0561 * (1 + 0.74) / 2
    np.testing.assert_allclose(mp.hand_to_body(pair)[:20], gap, atol=2e-3)  # the shin is not quite upright
    assert mp.touch(pair) == 0.25


def test_shins_that_cross_penetrate_by_their_radii_less_the_gap():
    pair = couple(50.0)
    for person, points in ((0, [[-0.2, 0.3, 0.0], [0.2, 0.3, 0.0]]), (1, [[0.0, 0.34, -0.2], [0.0, 0.34, 0.2]])):
        pair[person, :8, [J["left_elbow"], J["left_wrist"]]] = np.array(points)[:, None]
    radius = 0.0366 * 0.87
    depth = mp.penetration_depth(pair)
    np.testing.assert_allclose(depth[:8], 2 * radius - 0.04, atol=0.02)
    forearm = [number for number, c in enumerate(capsules.CAPSULES) if c[0][0][0] == J["left_elbow"]]
    ends = [capsules.capsule_ends(person)[:8, forearm] for person in pair]
    s, t, apart = capsules.closest(ends[0], ends[1])
    np.testing.assert_allclose((s, t, apart), [np.full((8, 1), v) for v in (0.5, 0.5, 0.04)])
    assert (depth[8:] == 0).all()
    assert mp.penetration(pair) == pytest.approx(depth[:8].mean() / 10)


def test_two_people_in_one_place_are_as_deep_as_their_thickest_part():
    pair = couple(0.0, turn=0.0)
    np.testing.assert_allclose(mp.penetration_depth(pair), 2 * capsules.RADII.max(), atol=1e-9)
    assert mp.penetration(couple(0.6)) == 0
    assert mp.penetration(couple(0.15)) > 0.02


def test_the_nearest_points_of_segments_equal_a_fine_search():
    a, b = RNG.standard_normal((2, 60, 2, 3))
    a[::7, 1], b[::5, 1] = a[::7, 0], b[::5, 0]  # points
    b[3] = a[3] + [0.3, 0.1, 0.0]  # parallel
    share = np.linspace(0, 1, 201)
    on = [e[:, None, 0] + share[:, None] * (e[:, None, 1] - e[:, None, 0]) for e in (a, b)]
    searched = np.linalg.norm(on[0][:, :, None] - on[1][:, None], axis=-1).min(axis=(1, 2))
    distance = capsules.closest(a, b)[2]
    assert (distance <= searched + 1e-9).all()
    np.testing.assert_allclose(distance, searched, atol=0.02)


def test_the_capsules_of_limbs_have_the_radii_of_the_drawn_figure():
    still = Motion(SMPL22, 20.0, SMPL22.offsets[:1].repeat(2, 0), np.tile(rot.IDENTITY, (2, 22, 1)))
    shape = figure(still)
    radii = {bone: r for bone, r in zip(shape.bones, shape.radii, strict=True) if bone[1] not in shape.trunk}
    numbers = {(c[0][0][0], c[1][0][0]): c[2:] for c in capsules.CAPSULES if len(c[0]) == 1 and len(c[1]) == 1}
    assert set(radii) <= set(numbers)
    for bone, expected in radii.items():
        np.testing.assert_allclose(numbers[bone], expected, atol=1e-3)


def test_every_capsule_end_is_a_place_of_the_body():
    np.testing.assert_allclose(capsules._WEIGHTS.sum(axis=-1), 1)


# Together ------------------------------------------------------------------------------------------------------------


def test_partners_who_move_alike_correlate_and_mirror_images_against_each_other():
    path = 0.05 * RNG.standard_normal((160, 3)).cumsum(axis=0) * [1, 0, 1]
    stand = people.standing(8.0)
    alike = np.stack([people.moved(stand, path), people.moved(stand, 2 * path + [1.0, 0, 0])])
    against = np.stack([people.moved(stand, path), people.moved(stand, [1.0, 0, 0] - path)])
    assert mp.synchrony(alike) == pytest.approx(1)
    assert mp.synchrony(against) == pytest.approx(-1)
    assert mp.speed_synchrony(alike) == pytest.approx(1)
    assert mp.speed_synchrony(against) == pytest.approx(1)
    assert mp.synchrony(np.stack([alike[0], stand])) == 0


def test_a_constant_drift_of_both_is_no_synchrony():
    stand = people.standing(8.0)
    drift = np.arange(160)[:, None] * np.array([0.02, 0, 0])
    noise = 0.05 * RNG.standard_normal((2, 160, 3)).cumsum(axis=1) * [1, 0, 1]
    pair = np.stack([people.moved(stand, drift + n) for n in noise])
    assert abs(mp.synchrony(pair)) < 0.5


def test_what_shakes_faster_than_a_quarter_second_is_no_part_of_synchrony():
    """Five frames are a quarter second: an oscillation of that period has mean 0 over them."""
    t = np.arange(160)[:, None]
    slow, quick = (np.sin(2 * np.pi * t / frames) * [1.0, 0, 0] for frames in (80, 5))
    stand = people.standing(8.0)
    pair = np.stack([people.moved(stand, slow + 0.3 * quick), people.moved(stand, slow - 0.3 * quick + [1.0, 0, 0])])
    assert mp.synchrony(pair) > 0.7  # it would be below 0 with them
    assert mp.synchrony(pair, fps=2.0) < 0


# All numbers ---------------------------------------------------------------------------------------------------------


def quarters() -> np.ndarray:
    """(2, 80, 22, 3): the second stands 1, 1, 2 and 2 m ahead of the first, and turns away from him by 0, 45, 90, 90
    degrees; a wrist of each is at 5 cm, then 20 cm, then far from the other's."""
    parts = []
    for apart, away, hands in ((1.0, 0.0, 0.05), (1.0, np.pi / 4, 0.2), (2.0, np.pi / 2, 0), (2.0, np.pi / 2, 0)):
        part = couple(apart, seconds=1.0, turn=np.pi + away)
        if hands:
            part[0, :, J["left_wrist"]], part[1, :, J["right_wrist"]] = [0.9, 1.0, 0.5], [0.9 + hands, 1.0, 0.5]
            part[0, :, J["left_elbow"]], part[1, :, J["right_elbow"]] = [0.6, 1.0, 0.5], [1.2 + hands, 1.0, 0.5]
        parts.append(part)
    return np.concatenate(parts, axis=1)


def test_the_numbers_of_a_duet_are_means_over_its_frames_and_people():
    numbers, far = mp.pair_stats(quarters()), mp.hand_distance(quarters())[40:]
    expected = {
        "distance": 1.5,
        "distance_range": 0.5,
        "facing": np.pi - np.radians(56.25),
        "looking_away": np.radians(56.25) / 2,
        "mutual": 0.5,
        "hand_contact": 0.5,
        "touch": 0.25,
        "hand_distance": (0.05 + 0.2) / 4 + far.mean() / 2,
    }
    assert {name: numbers[name] for name in expected} == pytest.approx(expected, abs=1e-9)


def test_what_groups_compare_are_the_same_numbers_frame_by_frame():
    pair = quarters()
    pair[1, :, :, 0] += np.linspace(0, 0.04, 80)[:, None]
    pair[:, 60:] = couple(0.1)[:, 60:]
    numbers = mp.pair_stats(pair)
    assert numbers["penetration"] > 0
    assert numbers["hand_contact"] == 0.75
    means = {name: series(pair).mean() for name, series in groups.SERIES.items()}
    assert means == pytest.approx({name: numbers[name] for name in groups.SERIES})


def test_speeds_and_skate_are_measured_at_the_rate_of_the_frames_and_of_both_people():
    rng = np.random.default_rng(1)
    first, second = people.walking(0.7, 3.0, fps=30.0), people.standing(3.0, fps=30.0)
    ways = np.cumsum(rng.normal(0, 0.03, (2, 90, 3)) * [1, 0, 1], axis=1)
    pair = np.stack([people.moved(first, ways[0]), people.moved(second, ways[1])])
    numbers, feet = mp.pair_stats(pair, fps=30.0), [skate(person, 30.0) for person in pair]
    for name in ("share", "speed", "slide"):
        a, b = (getattr(one, name) for one in feet)
        assert abs(a - b) > 1e-3
        assert numbers[f"skate_{name}"] == pytest.approx((a + b) / 2)
    assert numbers["synchrony"] == pytest.approx(mp.synchrony(pair, 30.0))
    assert numbers["speed_synchrony"] == pytest.approx(mp.speed_synchrony(pair, 30.0))
    assert len({round(f(pair, fps), 6) for f in (mp.synchrony, mp.speed_synchrony) for fps in (20.0, 30.0)}) == 4


def test_a_capsule_is_as_thick_as_told_at_either_end():
    points = np.array([[0.3, 0.0, 0.0], [0.3, 0.5, 0.0], [0.3, 1.0, 0.0]])
    limb = np.array([[[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]])
    gaps = capsules.gaps(np.stack([points, points], axis=1)[None], np.zeros((3, 2)), limb, np.array([[0.1, 0.05]]))
    np.testing.assert_allclose(gaps[0, :, 0], [0.2, 0.225, 0.25])


def test_the_frame_of_the_first_person_is_where_he_begins_and_faces():
    places = mp.in_first_frame(rigid(couple(1.5, turn=1.0), 2.2, (5.0, 0.3, -3.0)))
    height = couple()[0, 0, 0, 1] + 0.3
    np.testing.assert_allclose(places[:, 0, 0], [[0, height, 0], [0, height, 1.5]], atol=1e-9)
    np.testing.assert_allclose([ph.heading(person)[0] for person in places], [0.0, 1.0], atol=1e-9)


# Groups --------------------------------------------------------------------------------------------------------------


def test_the_wasserstein_distance_is_a_shift_and_of_shares_their_difference():
    values = RNG.standard_normal(5000)
    assert groups.wasserstein(values, values + 0.3) == pytest.approx(0.3)
    assert groups.wasserstein(np.array([0.0, 0, 0, 1]), np.array([1.0, 0])) == 0.25
    a, b = RNG.random(400), RNG.random(400)
    assert groups.wasserstein(a, b) == pytest.approx(np.abs(np.sort(a) - np.sort(b)).mean(), abs=1e-3)


def test_the_ratio_is_the_shift_of_a_group_over_that_of_real_recordings():
    real = [[couple(d, seconds=1.0)] for d in (0.9, 1.0, 1.1)]
    # of the rest of 0.9, 1.0, 1.1: 0.15 = mean(0.1, 0.2), 0.1, 0.15
    spread = (0.15 + 0.1 + 0.15) / 3
    for apart, away in ((1.0, 0.2 / 3), (1.3, 0.3), (0.7, 0.3)):
        ratio = groups.compare([couple(apart, seconds=1.0)], real, names=("distance",))["distance"]
        assert (ratio.spread, ratio.away) == pytest.approx((spread, away), rel=0.02)
        assert (ratio.group, ratio.real) == pytest.approx((apart, 1.0))
        assert ratio.within() == (apart == 1.0)
        assert ratio.within(2.5)


def test_a_group_of_no_spread_is_equal_or_infinitely_far():
    real = [[couple(1.0, seconds=1.0)]] * 2
    assert groups.compare(real[0], real, names=("hand_contact",))["hand_contact"].ratio == 0
    close = couple(1.0, seconds=1.0)
    close[1, :, J["left_wrist"]] = close[0, :, J["left_wrist"]]
    assert groups.compare([close], real, names=("hand_contact",))["hand_contact"].ratio == np.inf
    with pytest.raises(MotionloomError, match="2 real recordings"):
        groups.compare([close], real[:1])
    with pytest.raises(MotionloomError, match="0 duets"):
        groups.compare([], real)


def test_shuffling_gives_everybody_a_stranger_who_begins_where_the_partner_did():
    pairs = [rigid(couple(1.0 + n, seconds=1.0 + n, turn=n), 2.5 * n, (n, 0, 2 * n)) for n in range(3)]
    for n, (mixed, pair) in enumerate(zip(groups.shuffled(pairs), pairs, strict=True)):
        stranger = pairs[(n + 1) % 3][1]
        frames = mixed.shape[1]
        assert frames == min(pair.shape[1], len(stranger))
        np.testing.assert_array_equal(mixed[0], pair[0, :frames])
        np.testing.assert_allclose(mixed[1, 0, 0], pair[1, 0, 0], atol=1e-9)
        np.testing.assert_allclose(mp.facing_angle(mixed)[0], mp.facing_angle(pair)[0], atol=1e-9)
        apart = np.linalg.norm(stranger[:frames, None] - stranger[:frames, :, None], axis=-1)
        np.testing.assert_allclose(np.linalg.norm(mixed[1][:, None] - mixed[1][:, :, None], axis=-1), apart, atol=1e-9)
    np.testing.assert_array_equal(groups.shuffled(pairs, placed=False)[0][1], pairs[1][1][:20])
    for few, shift in ((pairs[:1], 1), (pairs, 3)):
        with pytest.raises(MotionloomError, match="shuffled"):
            groups.shuffled(few, shift=shift)


def test_true_partners_of_a_common_path_are_told_from_shuffled_ones():
    stand = people.standing(6.0)
    paths = [0.05 * np.random.default_rng(n).standard_normal((120, 3)).cumsum(axis=0) * [1, 0, 1] for n in range(5)]
    pairs = [np.stack([people.moved(stand, p), people.moved(stand, p + np.array([1.0, 0, 0]))]) for p in paths]
    numbers = groups.synchrony_against_shuffled(pairs)
    assert numbers.partners == pytest.approx(1)
    assert abs(numbers.strangers) < 0.3
    assert numbers.size > 3


def test_strangers_are_everybody_with_everybody_else_where_they_were_recorded():
    """Of a made-up measure of places and the rate."""
    pairs = [rigid(couple(), 0.0, (float(place), 0.0, 0.0)) for place in (0.0, 1.0, 3.0)]

    def of(pair: np.ndarray, fps: float) -> float:
        return measure(pair[0, 0, 0, 0], pair[1, 0, 0, 0]) + fps

    def measure(a: float, b: float) -> float:
        return float(a + 10 * a * b + b**2)

    numbers = groups.synchrony_against_shuffled(pairs, of=of, fps=7.0)
    origin = couple()[:, 0, 0, 0]
    places = [(origin[0] + p, origin[1] + p) for p in (0.0, 1.0, 3.0)]
    own = [measure(a, b) + 7 for a, b in places]
    others = [measure(a, b) + 7 for n, (a, _) in enumerate(places) for m, (_, b) in enumerate(places) if m != n]
    assert numbers.partners == pytest.approx(np.mean(own))
    assert numbers.strangers == pytest.approx(np.mean(others))
    assert numbers.size == pytest.approx((np.mean(own) - np.mean(others)) / np.std(others))


def test_quantiles_are_read_evenly_and_within_is_at_most_one_and_a_half_times():
    assert groups.wasserstein(np.linspace(0, 1, 5), np.zeros(3)) == pytest.approx(0.5, abs=1e-9)
    for away, within in ((1.49, True), (1.51, False)):
        assert groups.SpreadRatio("distance", 1.0, 1.0, 1.0, away).within() is within


@pytest.mark.parametrize("damage", ["one-person", "joints", "nan", "empty"])
def test_what_is_no_pair_is_refused(damage):
    pair = couple()
    wrong = {"one-person": pair[0], "joints": pair[:, :, :21], "empty": pair[:, :0]}.get(damage, pair * np.nan)
    for function in (mp.pair_stats, mp.distance, mp.penetration_depth, mp.in_first_frame):
        with pytest.raises(MotionloomError):
            function(wrong)
