"""Control error against naive loops and answers worked out by hand."""

import math

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics import control
from tests.kinematics.people import standing


def some(seed: int, frames: int = 30) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    places, goal = rng.normal(scale=0.4, size=(2, frames, 22, 3))
    return places, goal, rng.random((frames, 22, 3)) < 0.2


def test_distances_are_those_of_a_loop_over_what_is_asked() -> None:
    places, goal, flags = some(0)
    apart = control.distances(places, goal, flags)
    for t in range(30):
        for j in range(22):
            squares = [(places[t, j, c] - goal[t, j, c]) ** 2 for c in range(3) if flags[t, j, c]]
            assert math.isnan(apart[t, j]) if not squares else apart[t, j] == pytest.approx(math.sqrt(sum(squares)))


def test_errors_are_those_of_a_loop_over_all_pairs_of_all_motions() -> None:
    """Pairs are pooled, so motions of different lengths tell this from a mean of means."""
    several = [some(1, 10), some(2, 50)]
    errors = control.control_error([control.distances(*one) for one in several])
    total, pairs, near, far, failed = 0.0, 0, 0, 0, 0
    for places, goal, flags in several:
        bad = False
        for t, j in np.argwhere(flags.any(-1)):
            apart = math.sqrt(sum((places[t, j, c] - goal[t, j, c]) ** 2 for c in range(3) if flags[t, j, c]))
            total, pairs, near, far = total + apart, pairs + 1, near + (apart > 0.2), far + (apart > 0.5)
            bad = bad or apart > 0.5
        failed += bad
    assert errors
    assert errors.pairs == pairs
    assert errors.error == pytest.approx(100 * total / pairs)
    assert (errors.beyond_20, errors.beyond_50) == pytest.approx((near / pairs, far / pairs))
    assert errors.sequences == failed / 2


def test_a_perfect_motion_fails_nowhere() -> None:
    goal = standing(2.0)
    errors = control.control_error([control.distances(goal, goal, np.ones(goal.shape, bool))])
    assert errors
    assert (errors.error, errors.worst, errors.beyond_20, errors.beyond_50, errors.sequences) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("off", "near", "far"), [(0.1, 0, 0), (0.3, 1, 0), (0.6, 1, 1)], ids=["10 cm", "30 cm", "60 cm"]
)
def test_a_shift_is_its_length_in_cm_and_fails_by_both_bounds(off: float, near: float, far: float) -> None:
    goal = standing(1.0)
    errors = control.control_error([control.distances(goal + np.array([off, 0, 0]), goal, np.ones(goal.shape, bool))])
    assert errors
    assert errors.error == pytest.approx(100 * off)
    assert errors.worst == pytest.approx(100 * off)
    assert (errors.beyond_20, errors.beyond_50, errors.sequences) == (near, far, far)


def test_a_single_bad_frame_fails_its_motion_and_no_other() -> None:
    goal = standing(1.0)
    bad = goal.copy()
    bad[7, 20] += [0, 0, 0.7]
    flags = np.ones(goal.shape, bool)
    errors = control.control_error([control.distances(m, goal, flags) for m in (bad, goal, goal, goal)])
    assert errors
    assert errors.sequences == 1 / 4
    assert errors.beyond_50 == pytest.approx(1 / (4 * 22 * len(goal)))


def test_a_path_on_the_ground_asks_no_height() -> None:
    goal = standing(1.0)
    flags = np.zeros(goal.shape, bool)
    flags[:, 0, [0, 2]] = True
    errors = control.control_error([control.distances(goal + np.array([0, 5.0, 0]), goal, flags)])
    assert errors
    assert errors.error == 0


def test_root_and_joints_are_told_apart() -> None:
    goal = standing(1.0)
    places = goal.copy()
    places[:, 0] += [0.3, 0, 0]
    places[:, 20] += [0, 0.1, 0]
    flags = np.zeros(goal.shape, bool)
    flags[:, [0, 20]] = True
    apart = [control.distances(places, goal, flags)]
    root, joints = control.of_root(apart), control.of_joints(apart)
    assert root
    assert joints
    assert (root.error, joints.error) == pytest.approx((30, 10))
    flags[:, 0] = False
    assert control.of_root([control.distances(places, goal, flags)]) is None


def test_motions_without_targets_are_not_counted_as_good_ones() -> None:
    goal = standing(1.0)
    nothing, everything = np.zeros(goal.shape, bool), np.ones(goal.shape, bool)
    apart = [control.distances(goal + 1, goal, everything), control.distances(goal, goal, nothing)]
    errors = control.control_error(apart)
    assert errors
    assert errors.sequences == 1
    assert control.control_error(apart[1:]) is None


def test_what_nobody_asked_may_be_anything() -> None:
    places, goal, flags = some(3)
    places[~flags] = np.nan
    assert np.isfinite(control.distances(places, goal, flags)[flags.any(-1)]).all()
    places[tuple(np.argwhere(flags)[0])] = np.nan
    with pytest.raises(MotionloomError, match="not finite"):
        control.distances(places, goal, flags)


def test_other_shapes_are_refused() -> None:
    places, goal, flags = some(4)
    with pytest.raises(MotionloomError, match="alike"):
        control.distances(places[:-1], goal, flags)


def test_the_error_of_features_is_a_mean_over_controlled_numbers_only() -> None:
    known = np.zeros((10, 5))
    places = known.copy()
    places[:, 0], places[:, 4] = 0.5, 9.0
    mask = np.zeros((10, 5), bool)
    mask[:, :2] = True
    assert control.feature_error([places], [known], [mask]) == pytest.approx(0.25)
    assert math.isnan(control.feature_error([places], [known], [np.zeros((10, 5), bool)]))


@pytest.mark.parametrize("degrees", [30.0, -170.0, 190.0])
def test_a_turned_body_is_off_by_the_shorter_way_round(degrees: float) -> None:
    goal = standing(1.0)
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    flags = np.arange(len(goal)) < 4
    errors = control.facing_error(goal @ turn.T, goal, flags)
    assert errors == pytest.approx(np.full(4, min(abs(degrees), 360 - abs(degrees))))
