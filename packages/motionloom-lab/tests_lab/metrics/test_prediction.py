"""Metrics of stochastic prediction: written-out loops, and motions whose answer is known."""

import math
import tracemalloc
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics import prediction as pr
from tests_lab.metrics.futures import SIZES, SMALL, pose_distance, random_window

# ---- written out


def naive(samples: np.ndarray, truth: np.ndarray, futures: np.ndarray) -> dict[str, float | None]:
    def apd(x: np.ndarray) -> float:
        pairs = [pose_distance(a, b) for a, b in combinations(x, 2)]
        return sum(pairs) / len(pairs) if pairs else 0.0

    def ades(y: np.ndarray) -> list[float]:
        return [sum(pose_distance(a, b) for a, b in zip(s, y)) / len(y) for s in samples]

    def fde(y: np.ndarray) -> float:
        return min(pose_distance(s[-1], y[-1]) for s in samples)

    ranked = sorted(ades(truth))
    half = len(ranked) // 2
    return {
        "apd": apd(samples),
        "ade": ranked[0],
        "fde": fde(truth),
        "ade_worst": ranked[-1],
        "ade_median": ranked[half] if len(ranked) % 2 else (ranked[half - 1] + ranked[half]) / 2,
        "mmade": sum(min(ades(y)) for y in futures) / len(futures),
        "mmfde": sum(fde(y) for y in futures) / len(futures),
        "apde": abs(apd(samples) - apd(futures)) if len(futures) > 1 else None,
    }


@settings(max_examples=30, deadline=None)
@given(SIZES)
def test_distances_are_the_written_out_ones(size: tuple[int, ...]) -> None:
    """Loops over samples, futures, frames and numbers."""
    samples, truth, futures, _ = random_window(*size)
    scores = pr.score_window(samples, truth, futures, fps=30)
    assert pr.apd(samples) == scores.numbers["apd"]
    assert pr.ade(samples, truth) == scores.numbers["ade"]
    for name, value in naive(samples, truth, futures).items():
        assert scores.numbers.get(name) == pytest.approx(value, abs=1e-9), name


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 40), st.integers(1, 7), st.sampled_from([0.25, 0.5, 1.0]))
def test_similar_windows_are_all_nearer_ones_whatever_the_chunk(seed: int, n: int, chunk: int, limit: float) -> None:
    """Poses on a grid, so that many lie exactly at the threshold, which is not nearer; far from the origin."""
    poses = np.random.default_rng(seed).integers(0, 4, (n, 3)) * 0.25 + 100.0
    near = pr.similar_windows(poses, limit, chunk=chunk)
    for i, numbers in enumerate(near):
        assert numbers.tolist() == [j for j in range(n) if j == i or pose_distance(poses[i], poses[j]) < limit]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31), st.integers(2, 5))
def test_cmd_is_the_written_out_sum(seed: int, frames: int) -> None:
    """Means by class over windows, samples and joints; step t weighs F - t; classes weigh as they have windows."""
    rng = np.random.default_rng(seed)
    windows = [("walk", 2), ("sit", 3), ("walk", 1), ("walk", 2)]
    windows = [(name, rng.normal(size=(2, frames, j + 1, 3))) for name, j in windows]
    reference, tally = {"walk": 1.5, "sit": 0.5, "never seen": 9.0}, pr.CmdTally()
    for name, samples in windows:
        tally.add(name, samples)
    total = 0.0
    for name, count in (("walk", 3), ("sit", 1)):
        own = [x for n, x in windows if n == name]
        for t in range(1, frames):
            mean = np.mean([np.linalg.norm(x[:, t] - x[:, t - 1], axis=-1).mean() for x in own])
            total += count / 4 * (frames - t) * abs(mean - reference[name])
    assert tally.result(reference) == pytest.approx(total)


# ---- motions whose answer is known


def test_standing_still_and_going_on_straight_are_what_they_say() -> None:
    """The anchors: no variety, no speed, no jerk; constant velocity has no jump at the seam."""
    past = np.random.default_rng(3).normal(size=(5, 4, 3))
    still, on = pr.zero_velocity(past, 8), pr.constant_velocity(past, 8)
    assert still.shape == on.shape == (1, 8, 4, 3)
    assert (still == past[-1]).all()
    assert pr.apd(np.repeat(still, 50, axis=0)) == 0
    assert (pr.speeds(still) == 0).all()
    assert pr.jerk(still, 30).peak == 0
    assert pr.jerk(on, 30).peak < 1e-9
    straight = np.concatenate([past[-2:-1] - (past[-1] - past[-2]), past[-2:]])
    assert max(pr.seam(straight, on, 30)) < 1e-9
    assert on[0, :, 2] - past[-1, 2] == pytest.approx(np.arange(1, 9)[:, None] * (past[-1, 2] - past[-2, 2]))


def test_a_future_that_was_foretold_has_no_error_and_the_others_their_distance() -> None:
    """Every joint 3 m off is 3 sqrt(J) off as a pose: the norm is over the whole pose, not a mean over joints."""
    truth = np.random.default_rng(0).normal(size=(6, 16, 3))
    samples = truth + np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, -6.0, 0.0]])[:, None, None]
    s = pr.score_window(samples, truth, fps=50).numbers
    assert [s[name] for name in ("ade", "fde", "ade_median", "ade_worst")] == pytest.approx([0, 0, 12, 24])
    assert s["mmade"] == pytest.approx(0, abs=1e-6)
    assert s["apd"] == pytest.approx((12 + 24 + math.hypot(12, 24)) / 3 * math.sqrt(6))


def test_the_last_frame_and_the_mean_have_minima_of_their_own() -> None:
    """A sample near in the end and one near on the whole: each metric takes its own."""
    truth = np.zeros((4, 1, 3))
    samples = np.zeros((2, 4, 1, 3))
    samples[0, :, 0, 0] = [9, 9, 9, 1]
    samples[1, :, 0, 0] = [1, 1, 1, 5]
    assert pr.ade(samples, truth) == 2
    assert pr.score_window(samples, truth, fps=30).numbers["fde"] == 1


@settings(max_examples=15, deadline=None)
@given(SIZES)
def test_the_order_of_samples_futures_and_joints_does_not_matter(size: tuple[int, ...]) -> None:
    """All but the limbs, which name their joints, and for samples those too."""
    samples, truth, futures, past = random_window(*size)
    rng = np.random.default_rng(size[0])
    p, q, j = (rng.permutation(n) for n in (len(samples), len(futures), samples.shape[2]))
    one = pr.score_window(samples, truth, futures, fps=30, past=past, limbs=SMALL)
    two = pr.score_window(samples[p], truth, futures[q], fps=30, past=past, limbs=SMALL)
    assert_same(one, two)
    plain = pr.score_window(samples, truth, futures, fps=30, past=past)
    assert_same(plain, pr.score_window(*(x[..., j, :] for x in (samples, truth, futures)), fps=30, past=past[:, j]))


def assert_same(one: pr.WindowScores, two: pr.WindowScores) -> None:
    assert one.numbers == pytest.approx(two.numbers, abs=1e-9)
    assert one.speeds == pytest.approx(two.speeds)


def test_chunks_do_not_change_the_answer_and_single_precision_hardly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of futures and samples one at a time; nothing handed in is written to."""
    samples, truth, futures, past = (x.astype(np.float32) for x in random_window(3, 7, 6, 5, 9))
    copies = [x.copy() for x in (samples, truth, futures, past)]
    whole = pr.score_window(samples, truth, futures, fps=30, past=past, limbs=SMALL)
    assert all((a == b).all() for a, b in zip(copies, (samples, truth, futures, past)))
    monkeypatch.setattr(pr, "_CELLS", 20)
    assert_same(
        whole,
        pr.score_window(
            *(x.astype(float) for x in (samples, truth, futures)), fps=30, past=past.astype(float), limbs=SMALL
        ),
    )


def test_similar_windows_of_six_thousand_poses_take_little_memory() -> None:
    """The square of distances would be 288 MB; a tenth of that is room enough."""
    poses = np.random.default_rng(0).normal(size=(6000, 48)).astype(np.float32)
    tracemalloc.start()
    near = pr.similar_windows(poses, 0.5, chunk=64)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(near) == 6000
    assert peak < 30e6


def test_a_window_takes_the_memory_of_its_samples_a_few_times() -> None:
    """A thousand futures of four joints: all distances at once would be 40 MB, and three such tables are needed."""
    rng = np.random.default_rng(0)
    samples, futures = (rng.normal(size=(n, 100, 4, 3)).astype(np.float32) for n in (50, 1000))
    tracemalloc.start()
    pr.score_window(samples, futures[0], futures, fps=50, limbs=SMALL)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 60e6


# ---- means over windows


def scored(seed: int, futures: int) -> pr.WindowScores:
    samples, truth, y, past = random_window(seed, 3, 5, 4, futures)
    return pr.score_window(samples, truth, y, fps=30, past=past if seed else None, limbs=SMALL)


def cmd_of(scores: list[pr.WindowScores]) -> pr.CmdTally:
    tally = pr.CmdTally()
    for one in scores:
        tally.add_speeds("walk", one.speeds)
    return tally


@pytest.mark.parametrize(
    ("singles", "all_of", "multimodal"), [("all", 3, 3), ("skip", 2, 2), ("skip_multimodal", 3, 2)]
)
def test_windows_of_one_future_count_as_the_option_says(singles: pr.Singles, all_of: int, multimodal: int) -> None:
    """One of three windows is alone; numbers of windows are told per metric, and means are over just these."""
    scores = [scored(0, 1), scored(1, 2), scored(2, 4)]
    tally = pr.Tally(singles)
    for one in scores:
        tally.add(one, "walk")
    averages = tally.averages()
    assert list(averages) == list(pr.METRICS)
    for name, n in {
        "ade": all_of,
        "apd": all_of,
        "jerk": all_of,
        "mae": all_of,
        "mmade": multimodal,
        "mmfde": multimodal,
        "apde": 2,
        "seam_velocity": 2,
    }.items():
        measured = [s.numbers[name] for s in scores[3 - n :]]
        assert averages[name] == (pytest.approx(np.mean(measured)), n), name
    real = {"walk": 0.0}
    assert tally.cmd.result(real) == pytest.approx(cmd_of(scores[3 - all_of :]).result(real))


def test_what_cannot_be_told_is_absent() -> None:
    """No past, no limbs, no other futures: no seam, no body, no APDE, and the table has no such rows."""
    samples, truth, _, _ = random_window(0, 3, 5, 4, 1)
    tally = pr.Tally()
    assert tally.averages() == {}
    tally.add(pr.score_window(samples, truth, fps=30))
    averages = tally.averages()
    assert "apde" not in averages
    assert not any(name.startswith(("seam", "stretch", "jitter", "mae")) for name in averages)
    assert averages["mmade"] == (pytest.approx(averages["ade"].value), 1)


def test_speeds_of_real_futures_are_references() -> None:
    """At 5 cm a frame: CMD 0 by the measured reference, by another one (5+4+3+2+1) times its error."""
    clip = np.arange(6)[:, None, None] * np.array([0.03, 0.0, 0.04]) * np.ones((6, 2, 1))
    tally = pr.CmdTally()
    tally.add("walk", clip[None])
    assert tally.speeds() == {"walk": pytest.approx(0.05)}
    assert tally.result(tally.speeds()) == pytest.approx(0, abs=1e-12)
    assert tally.result(0.04) == pytest.approx(0.01 * 15)


# ---- what is refused


OK = np.zeros((2, 5, 4, 3))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: pr.apd(OK[0]), "places"),
        (lambda: pr.apd(OK[:0]), "places"),
        (lambda: pr.apd(OK.astype(int)), "places"),
        (lambda: pr.apd(OK.astype(object)), "places"),
        (lambda: pr.apd(OK + np.nan), "finite"),
        (lambda: pr.ade(OK, OK[0, :4]), "real motion"),
        (lambda: pr.score_window(OK, OK[0], OK[:, :, :3], fps=30), "real motion"),
        (lambda: pr.score_window(OK[:, :3], OK[0, :3], fps=30), "4 frames"),
        (lambda: pr.score_window(OK, OK[0], OK[0], fps=30), "places"),
        (lambda: pr.score_window(OK, OK[0], fps=0), "fps"),
        (lambda: pr.score_window(OK, OK[0], fps=30, limbs=pr.H36M_LIMBS), "16 joints"),
        (lambda: pr.score_window(OK, OK[0], fps=30, limbs=SMALL), "no length"),
        (lambda: pr.seam(OK[0, :2], OK, 30), "3 frames"),
        (lambda: pr.seam(OK[0, :, :3], OK, 30), "joints"),
        (lambda: pr.seam(OK[0], OK, float("nan")), "fps"),
        (lambda: pr.zero_velocity(OK[0], 0), "one frame"),
        (lambda: pr.constant_velocity(OK[0, :1], 5), "2 frames"),
        (lambda: pr.similar_windows(OK[0, 0], 0.0), "threshold"),
        (lambda: pr.similar_windows(OK[0], 0.5), "last poses"),
        (lambda: pr.similar_windows(OK[0, 0] + np.inf, 0.5), "last poses"),
        (lambda: pr.Tally("some"), "skip_multimodal"),  # type: ignore[arg-type]
        (lambda: pr.CmdTally().result(0.1), "no windows"),
        (lambda: pr.Limbs(((0, 0),), ()), "limbs"),
        (lambda: pr.Limbs(((0, 1),), ((0, 1),)), "limbs"),
        (lambda: pr.limbs_of((-1, 0)), "parents"),
        (lambda: pr.limbs_of((-1, 2, 1)), "parents"),
        (lambda: pr.angle_error(OK, OK[0], pr.Limbs(((0, 1),), ())), "chains"),
    ],
    ids=range(27),
)
def test_what_cannot_be_measured_is_said_in_a_sentence(call, says: str) -> None:
    """Shapes, kinds, lengths, rates and names, each by what was there."""
    with pytest.raises(MotionloomError, match=says):
        call()


def test_cmd_refuses_unknown_classes_and_mixed_lengths() -> None:
    """Names the class that has no reference, and the one of another length."""
    tally = pr.CmdTally()
    tally.add("walk", OK)
    with pytest.raises(MotionloomError, match="walk"):
        tally.result({"sit": 0.1})
    with pytest.raises(MotionloomError, match="'sit'"):
        tally.add("sit", OK[:, :4])
