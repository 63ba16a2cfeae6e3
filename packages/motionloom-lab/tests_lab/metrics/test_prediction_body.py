"""Bodies and seams of predicted futures: written-out loops, and motions whose answer is known."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.skeleton import SMPL22
from motionloom_lab.metrics import prediction as pr
from tests_lab.metrics.futures import SIZES, SMALL, pose_distance, random_window


@settings(max_examples=30, deadline=None)
@given(SIZES)
def test_limbs_are_measured_as_written_out(size: tuple[int, ...]) -> None:
    """Stretch, jitter and angles in loops over samples, limbs and frames."""
    samples, truth, _, _ = random_window(*size)
    shares, errors = [], []
    for sample in samples:
        for a, b in SMALL.pairs:
            real = sum(pose_distance(p[a], p[b]) for p in truth) / len(truth)
            long = [pose_distance(p[a], p[b]) for p in sample]
            steps = [abs(y - x) for x, y in pairwise(long)]
            shares.append(
                [
                    abs(sum(long) / len(long) - real) / real,
                    math.sqrt(sum((x - real) ** 2 for x in long) / len(long)) / real,
                    sum(steps) / len(steps) / real,
                    math.sqrt(sum(x * x for x in steps) / len(steps)) / real,
                ]
            )
        off = [abs(bend(p, i, j) - bend(q, i, j)) for p, q in zip(sample, truth) for i, j in ((0, 1), (0, 2))]
        errors.append(sum(off) / len(off))
    assert pr.stretch(samples, truth, SMALL) == pytest.approx(100 * np.mean(shares, axis=0))
    assert pr.angle_error(samples, truth, SMALL) == pytest.approx(min(errors))


def bend(pose: np.ndarray, i: int, j: int) -> float:
    """Degrees between limbs i and j of SMALL, from the sine and the cosine."""
    u, v = (pose[SMALL.pairs[n][1]] - pose[SMALL.pairs[n][0]] for n in (i, j))
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(u, v))), float(u @ v)))


@settings(max_examples=30, deadline=None)
@given(SIZES, st.sampled_from([25.0, 30.0, 60.0]))
def test_jerk_speeds_and_seams_are_the_written_out_ones(size: tuple[int, ...], fps: float) -> None:
    """Differences by their coefficients; a seam takes the largest that has frames on both sides."""
    samples, _, _, past = random_window(*size)
    third = [
        [np.linalg.norm(s[f + 3] - 3 * s[f + 2] + 3 * s[f + 1] - s[f], axis=-1) for f in range(len(s) - 3)]
        for s in samples
    ]
    jerk = pr.jerk(samples, fps)
    assert jerk.mean == pytest.approx(fps**3 * np.mean(third))
    assert jerk.peak == pytest.approx(fps**3 * np.mean([np.max(t) for t in third]))
    steps = [
        np.mean([pose_distance(s[f + 1, j], s[f, j]) for s in samples for j in range(s.shape[1])])
        for f in range(samples.shape[1] - 1)
    ]
    assert pr.speeds(samples) == pytest.approx(steps)
    each = []
    for s in samples:
        a, b, c, x, y = (*past, *s[:2])
        velocity = np.max([np.linalg.norm(v, axis=-1) for v in (x - 2 * c + b, y - 2 * x + c)], axis=0)
        jolts = (x - 3 * c + 3 * b - a, y - 3 * x + 3 * c - b)
        acceleration = np.max([np.linalg.norm(v, axis=-1) for v in jolts], axis=0)
        each.append(
            [velocity.mean() * fps, velocity.max() * fps, acceleration.mean() * fps**2, acceleration.max() * fps**2]
        )
    assert pr.seam(np.concatenate([past[:1], past]), samples, fps) == pytest.approx(np.mean(each, axis=0))


# ---- motions whose answer is known


def rigid(seed: int, *, samples: int, frames: int) -> np.ndarray:
    """(samples, frames, 21, 3): the uniform skeleton with every joint turned at random, the root dropped."""
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(samples, frames, 22, 3, 3)))[0]
    offsets = np.random.default_rng(5).normal(size=(22, 3))
    p = np.zeros((samples, frames, 22, 3))
    for j, parent in enumerate(SMPL22.parents):
        if parent >= 0:
            p[:, :, j] = p[:, :, parent] + turns[:, :, parent] @ offsets[j]
    return p[:, :, 1:]


def test_a_rigid_skeleton_neither_stretches_nor_jitters() -> None:
    """Every limb derived from the parents keeps its length when joints turn, those between the root's children too."""
    limbs = pr.limbs_of(SMPL22.parents)
    samples = rigid(1, samples=3, frames=6)
    assert max(pr.stretch(samples, rigid(2, samples=1, frames=6)[0], limbs)) < 1e-10
    assert pr.angle_error(samples, samples[1], limbs) == 0
    assert pr.angle_error(samples[:1], samples[1], limbs) > 5


def test_a_body_ten_percent_too_large_is_stretched_by_ten_percent_and_bends_alike() -> None:
    """Mean and root mean square agree on a constant error, jitter and angles do not see it."""
    real = rigid(1, samples=1, frames=6)
    limbs = pr.limbs_of(SMPL22.parents)
    assert pr.stretch(1.1 * real, real[0], limbs) == pytest.approx((10.0, 10.0, 0.0, 0.0), abs=1e-9)
    assert pr.angle_error(1.1 * real, real[0], limbs) == pytest.approx(0.0, abs=1e-5)


def test_a_limb_that_pulses_has_no_mean_stretch_but_jitter() -> None:
    """Lengths 0.9, 1.1, 0.9, 1.1 against 1: mean 0, off by 10 %, changing by 20 %."""
    one = np.zeros((4, 2, 3))
    one[:, 1, 0] = 1.0
    pulsing = one * np.array([0.9, 1.1, 0.9, 1.1])[:, None, None]
    lengths = pr.stretch(pulsing[None], one, pr.Limbs(((0, 1),), ()))
    assert lengths == pytest.approx((0.0, 10.0, 20.0, 20.0), abs=1e-9)


def test_a_knee_bent_by_thirty_degrees_more_is_an_error_of_thirty_degrees_and_the_best_sample_counts() -> None:
    """Two limbs in a plane, at 0 degrees in truth, at 30 and at 50 in the samples."""

    def pose(degrees: float) -> np.ndarray:
        turn = math.radians(degrees)
        return np.array([[0, 0, 0], [1, 0, 0], [1 + math.cos(turn), math.sin(turn), 0]])[None]

    limbs = pr.Limbs(((0, 1), (1, 2)), ((0, 1),))
    assert pr.angle_error(np.stack([pose(50), pose(30)]), pose(0), limbs) == pytest.approx(30)


def test_derived_limbs_of_the_uniform_person() -> None:
    """Three lines at the root and a bone for every other joint; each knee, elbow, hip and collar bends once."""
    limbs = pr.limbs_of(SMPL22.parents)
    names = SMPL22.names[1:]
    assert limbs.joints == 21
    assert len(limbs.pairs) == 3 + 18
    assert len(set(limbs.angles)) == len(limbs.angles)
    bends = {tuple(names[j] for j in (*limbs.pairs[a], *limbs.pairs[b])) for a, b in limbs.angles}
    assert ("left_hip", "left_knee", "left_knee", "left_ankle") in bends
    assert ("spine3", "right_collar", "right_collar", "right_shoulder") in bends
    assert ("left_hip", "right_hip", "right_hip", "right_knee") in bends
    assert {b for _, b in limbs.angles} == set(range(3, 21)), "a bone that bends against nothing"


def test_the_seam_of_a_polynomial_that_goes_on() -> None:
    """t: no jump; a t^2 / 2: none of acceleration, a / fps of velocity; a cubic's jump of acceleration is its jerk."""
    t = np.arange(-6, 6) / 25.0
    clip = np.zeros((12, 2, 3))
    clip[:, 0, 1] = 3 * t + 1
    clip[:, 1, 2] = 2.0 * t**2
    jump = pr.seam(clip[:6], clip[None, 6:], 25)
    assert jump == pytest.approx((2 / 25, 4 / 25, 0.0, 0.0), abs=1e-9)
    clip[:, 1, 2] = t**3
    assert pr.seam(clip[:6], clip[None, 6:], 25).acceleration_worst == pytest.approx(6 / 25)
    jerk = pr.jerk(clip[None], 25)
    assert (jerk.mean, jerk.peak) == pytest.approx((3.0, 6.0))


@pytest.mark.parametrize("late", [0, 1])
def test_a_jump_at_the_seam_is_seen_also_one_frame_late(late: int) -> None:
    """10 cm from one frame to the next on one joint of two: 3 m/s at 30 fps, and three-fold in the third difference."""
    future = np.zeros((1, 6, 2, 3))
    future[0, late:, 1, 0] = 0.1
    jump = pr.seam(np.zeros((3, 2, 3)), future, 30)
    assert jump.velocity_worst == pytest.approx(3.0)
    assert jump.velocity == pytest.approx(1.5)
    assert jump.acceleration_worst == pytest.approx(0.1 * 900 * (2 - late))
