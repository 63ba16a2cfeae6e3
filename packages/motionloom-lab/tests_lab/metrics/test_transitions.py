"""Jerk of polynomials, of a hand-made curve, and the step across a seam."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics import transitions as tr


def power(n: int, *, frames: int = 12, way: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> np.ndarray:
    """(1, frames, 22, 3) with joint 5 at t^n along ``way`` and everything else still; t in frames."""
    p = np.zeros((1, frames, 22, 3))
    p[0, :, 5] = np.arange(frames)[:, None] ** float(n) * way
    return p


def written_out(p: np.ndarray, lengths: list[int]) -> np.ndarray:
    result = np.zeros((len(p), p.shape[1] - 3))
    for b, length in enumerate(lengths):
        for n in range(length - 3):
            x = p[b]
            third = x[n + 3] - 3 * x[n + 2] + 3 * x[n + 1] - x[n]
            result[b, n] = max(sum(abs(third[j, k]) for k in range(3)) for j in range(22))
    return result


def test_a_cubic_has_jerk_six_per_frame_cubed_and_a_parabola_none() -> None:
    """Third difference of t^3 is 6, of 1 + t + t^2 nothing; no frame rate comes in."""
    assert np.allclose(tr.jerk_curve(power(3)), 6)
    assert np.allclose(tr.jerk_curve(power(2) + power(1) + 1), 0, atol=1e-9)


def test_axes_add_up_and_joints_do_not() -> None:
    """L1 over x, y, z: 6 (1 + 2 + 0.5); of two joints the larger counts, not their sum or mean."""
    p = power(3, way=(1.0, -2.0, 0.5))
    assert np.allclose(tr.sequence_jerk(p), 21)
    p[0, :, 9] = p[0, :, 5] / 2
    assert np.allclose(tr.sequence_jerk(p), 21)


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(4, 11), min_size=1, max_size=3))
def test_any_motion_gives_what_the_definition_written_out_gives(seed: int, lengths: list[int]) -> None:
    p = np.random.default_rng(seed).normal(size=(len(lengths), 11, 22, 3))
    expected = written_out(p, lengths)
    assert np.allclose(tr.sequence_jerk(p, lengths), expected)
    assert np.allclose(tr.jerk_curve(p, lengths), expected.mean(axis=0))
    valid = sum(length - 3 for length in lengths)
    assert tr.mean_jerk(p, lengths) == pytest.approx(expected.sum() / valid)


def test_frames_from_length_minus_three_on_are_zero() -> None:
    """Ten of twelve frames give seven differences, then nothing; four give one."""
    assert np.allclose(tr.sequence_jerk(power(3), [10])[0], [6] * 7 + [0] * 2)
    assert np.allclose(tr.sequence_jerk(power(3), [4])[0], [6] + [0] * 8)


def test_a_short_sequence_pulls_the_curve_down_but_not_the_reference() -> None:
    """The published average counts its zeros; the mean jerk of a data set does not."""
    p = np.concatenate([power(3), power(3)])
    assert np.allclose(tr.jerk_curve(p, [12, 6]), [6] * 3 + [3] * 6)
    assert tr.mean_jerk(p, [12, 6]) == pytest.approx(6)


def test_peak_and_area_of_a_hand_made_curve() -> None:
    """Above and below the reference both count: |0.1-0.3| + |0.5-0.3| + |0.4-0.3| + |0-0.3|."""
    curve = [0.1, 0.5, 0.4, 0.0]
    assert tr.peak_jerk(curve) == 0.5
    assert tr.area_under_jerk(curve, 0.3) == pytest.approx(0.2 + 0.2 + 0.1 + 0.3)
    assert tr.area_under_jerk([0.3, 0.3], 0.3) == 0


def test_the_reference_jerks_are_those_of_the_paper() -> None:
    assert (tr.JERK_HUMANML3D, tr.JERK_BABEL) == (0.033031363, 0.016383045)


def test_the_step_across_a_seam_is_the_mean_over_joints() -> None:
    """Half of the joints jump 0.3, 0.4 at frame 5 (a step of 0.5), all walk 0.02 a frame otherwise."""
    p = np.zeros((10, 22, 3)) + 0.02 * np.arange(10)[:, None, None] * [0.0, 0.0, 1.0]
    p[5:, ::2] += [0.3, 0.4, -0.02]
    assert np.allclose(tr.transition_distance(p, [5, 4, 6]), [(0.5 + 0.02) / 2, 0.02, 0.02])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: tr.jerk_curve(np.zeros((1, 3, 22, 3))), "3 frames where at least 4"),
        (lambda: tr.jerk_curve(np.zeros((5, 22, 3))), "sequences, frames"),
        (lambda: tr.jerk_curve(np.zeros((0, 5, 22, 3))), "sequences, frames"),
        (lambda: tr.jerk_curve(np.zeros((1, 5, 21, 3))), "22"),
        (lambda: tr.jerk_curve(np.full((1, 5, 22, 3), np.nan)), "not finite"),
        (lambda: tr.jerk_curve(np.zeros((2, 5, 22, 3)), [5]), "2 frame counts"),
        (lambda: tr.jerk_curve(np.zeros((1, 5, 22, 3)), [6]), "4 to 5"),
        (lambda: tr.jerk_curve(np.zeros((1, 5, 22, 3)), [3]), "4 to 5"),
        (lambda: tr.peak_jerk([]), "one finite number"),
        (lambda: tr.peak_jerk([np.nan]), "one finite number"),
        (lambda: tr.area_under_jerk([1.0], float("nan")), "reference jerk"),
        (lambda: tr.transition_distance(np.zeros((5, 22, 3)), [0]), "1 to 4"),
        (lambda: tr.transition_distance(np.zeros((5, 22, 3)), [5]), "1 to 4"),
        (lambda: tr.transition_distance(np.zeros((5, 22, 3)), []), "frame numbers"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(call, words: str) -> None:
    with pytest.raises(MotionloomError, match=words):
        call()
