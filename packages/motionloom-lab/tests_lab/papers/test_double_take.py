"""DoubleTake against a loop over frames, its own arithmetic, and bad requests; the networks are formulas."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.diffusion import DDPM, cosine, levels, row_noise, run
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.methods.double_take import (
    MODES,
    Keep,
    Mode,
    Plan,
    Takes,
    adjusted,
    double_take,
    double_take_features,
    first_take,
    flags,
    keep_weights,
    restarted,
    sandwiches,
    unfold,
)
from motionloom.core.models.networks.prior import PriorSession
from motionloom.tasks.text import sample_features
from tests.recorded import tiny

SCHEDULE, CHANNELS = cosine(20), 3
WAY = range(20, -1, -1)


def first_net(x: np.ndarray, level: int) -> np.ndarray:
    """Looks at both neighbours in time, so that padding is seen."""
    row = np.arange(len(x))[:, None, None]
    return np.tanh(x) + 0.1 * np.sin(np.roll(x, 1, 1) + level) + 0.05 * row


def second_net(x: np.ndarray, level: int) -> np.ndarray:
    return 0.7 * np.tanh(x) + 0.1 * np.sin(np.roll(x, -1, 1) + level)


def noise(plan: Plan, seed: int):
    rows = plan.repetitions * len(plan.lengths)
    draws = row_noise(range(seed, seed + rows)), row_noise(range(seed + 100, seed + 100 + rows - plan.repetitions))
    return draws[0](np.empty((rows, max(plan.lengths), CHANNELS), np.float32)), draws


def both(plan: Plan, mode: Mode, seed: int = 0, **how) -> Takes:
    x, draws = noise(plan, seed)
    return double_take(first_net, second_net, x, plan, mode=mode, way=WAY, schedule=SCHEDULE, noise=draws, **how)


# ---- the naive version: one frame at a time, everything by its definition ---


def naive_weight(mode: str, side: str, d: int, b: int) -> float:
    """The table of the paper and of the released code, by distance d to the handshake (0: inside)."""
    if d == 0:
        return 0.1 if mode == "paper" else 1.0
    if d > b or (mode == "published" and b < 2):
        return 1.0
    if mode == "paper":
        return 0.1 + 0.75 * d / b
    return 0.85 * (d if side == "left" else d - 1) / b


def naive(plan: Plan, mode: str, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Rows of the first take and the long motion."""
    x, draws = noise(plan, seed)
    lengths, hands, ramps = plan.lengths, plan.handshakes, plan.ramps
    step = DDPM.start(SCHEDULE)
    for t in range(20, 0, -1):
        x = step(x, first_net(x, t), t, t - 1, draws[0])
        for i, h in enumerate(hands):
            for j in range(h):
                old, new = x[i, lengths[i] - h + j].copy(), x[i + 1, j].copy()
                x[i, lengths[i] - h + j] = x[i + 1, j] = (h - j) / h * old + j / h * new
    frames: list[list[int]] = []  # of each transition: which frame of which row, -1 for padding
    weights: list[list[float]] = []
    rows: list[list[int]] = []
    width = plan.width
    for i, (h, b) in enumerate(zip(hands, ramps, strict=True)):
        before, after = hands[max(i - 1, 0)], hands[min(i + 1, len(hands) - 1)]
        left = range(before, lengths[i] - h)
        shared = range(lengths[i] - h, lengths[i])
        right = range(h, lengths[i + 1] - after)
        padding = width - len(left) - h - len(right)
        frames.append([*left, *shared, *right, *[-1] * padding])
        rows.append([i] * (len(left) + h) + [i + 1] * len(right) + [-1] * padding)
        weights.append(
            [naive_weight(mode, "left", len(left) - k, b) for k in range(len(left))]
            + [naive_weight(mode, "", 0, b)] * h
            + [naive_weight(mode, "right", k + 1, b) for k in range(len(right))]
            + [1.0] * padding
        )
    clean = np.stack(
        [
            np.stack([x[r, f] if r >= 0 else np.zeros((CHANNELS,), np.float32) for r, f in zip(rr, ff, strict=True)])
            for rr, ff in zip(rows, frames, strict=True)
        ]
    )
    keep = np.array(weights)[..., None]
    start = round({"paper": 0.7, "published": 0.9}[mode] * 20)
    signal, spread = SCHEDULE.at(start)
    y = signal * clean + spread * draws[1](clean)
    for t in range(start, 0, -1):
        y = step(y, (1 - keep) * second_net(y, t) + keep * clean, t, t - 1, draws[1])
    long = [x[i, : lengths[i]].copy() for i in range(len(lengths))]
    for i, (h, b) in enumerate(zip(hands, ramps, strict=True)):
        middle = lengths[i] - h - hands[max(i - 1, 0)]
        for d in range(-b, h):
            long[i][lengths[i] - h + d] = y[i, middle + d]
        for d in range(h + b):
            long[i + 1][d] = y[i, middle + d]
    pieces = [long[0], *(long[i + 1][h:] for i, h in enumerate(hands))]
    return list(x), np.concatenate(pieces)


PLANS = {
    "one handshake": Plan.of([70, 90, 77], 20, 10),
    "a handshake each": Plan.of([70, 95, 80, 66], (5, 20, 12), (3, 10, 0)),
    "one frame shared, no ramp": Plan.of([14, 30], 1, 0),
    "a ramp of one frame": Plan.of([40, 60], 8, 1),
    "27, which crashed": Plan.of([110, 120], 20, 27),
}


@pytest.mark.parametrize("mode", ["published", "paper"])
@pytest.mark.parametrize("name", PLANS)
def test_both_takes_equal_a_loop_over_frames(name: str, mode: str) -> None:
    plan = PLANS[name]
    takes = both(plan, MODES[mode], seed=7)
    rows, long = naive(plan, mode, seed=7)
    assert np.abs(takes.first - np.stack(rows)).max() < 1e-5
    assert takes.unfolded.shape == (1, len(long), CHANNELS)
    assert np.abs(takes.unfolded[0] - long).max() < 1e-5


def test_both_copies_of_a_handshake_are_equal_after_the_first_take() -> None:
    plan = PLANS["a handshake each"]
    takes = both(plan, MODES["paper"])  # which changes handshakes, in both rows
    for i, h in enumerate(plan.handshakes):
        end = plan.lengths[i]
        assert np.array_equal(takes.first[i, end - h : end], takes.first[i + 1, :h])
        assert np.array_equal(takes.rebuilt[i, end - h : end], takes.rebuilt[i + 1, :h])
        assert not np.array_equal(takes.rebuilt[i + 1, :h], takes.first[i + 1, :h])


def test_one_interval_is_plain_sampling_with_the_same_noise() -> None:
    plan = Plan.of([30])
    x, draws = noise(plan, 3)
    plain = run(first_net, x, levels=WAY, solver=DDPM, schedule=SCHEDULE, noise=draws[0])
    assert np.array_equal(both(plan, MODES["paper"], seed=3).unfolded, plain)


def test_the_first_handshake_frame_is_the_previous_rows_and_the_last_nearly_the_next_ones() -> None:
    """Weights 0 and (h - 1)/h, seen on a state of zeros and ones."""
    from motionloom.core.methods.double_take import handshakes

    plan = Plan.of([70, 70], 20, 10)
    x = np.stack([np.zeros((70, 1), np.float32), np.ones((70, 1), np.float32)])
    shared = handshakes(plan)(x, 5)[1, :20, 0]
    assert shared[0] == 0
    assert shared[-1] == pytest.approx(19 / 20)


def test_the_published_mode_changes_just_the_ramps() -> None:
    """Handshakes come back bit for bit; b frames to the left and b to the right of each change."""
    plan = Plan.of([90, 80, 100], 20, 10)
    takes = both(plan, MODES["published"])
    before = unfold(takes.first, plan)[0]
    changed = (takes.unfolded[0] != before).any(axis=-1).nonzero()[0].tolist()
    wanted = []
    for end in plan.ends[:-1]:
        wanted += [*range(end - 30, end - 20), *range(end, end + 10)]
    assert changed == wanted


def test_the_paper_mode_changes_ramps_and_handshakes() -> None:
    plan = Plan.of([90, 80, 100], 20, 10)
    takes = both(plan, MODES["paper"])
    changed = (takes.unfolded[0] != unfold(takes.first, plan)[0]).any(axis=-1).nonzero()[0].tolist()
    assert changed == [frame for end in plan.ends[:-1] for frame in range(end - 30, end + 10)]


@pytest.mark.parametrize("b", [*range(0, 61, 3), 27, 54, 1, 2])
def test_paper_weights_are_symmetric_for_every_ramp(b: int) -> None:
    """Read backwards they are the same, rise from 0.1 to 0.85, and the handshake keeps 0.1."""
    plan = Plan.of([200, 200], 20, b)
    weights = keep_weights(plan, MODES["paper"].keep)[0]
    assert np.array_equal(weights, np.flip(weights, 0))
    assert weights[160:180].tolist() == pytest.approx([0.1] * 20)
    assert (weights == 1).sum() == len(weights) - 20 - 2 * b
    if b:
        assert weights[160 - b] == pytest.approx(0.85)
        assert weights[159] == pytest.approx(0.1 + 0.75 / b)


def test_published_weights_are_those_of_the_released_code() -> None:
    weights = keep_weights(Plan.of([100, 100], 20, 10), MODES["published"].keep)[0].tolist()
    left = [0.85, 0.765, 0.68, 0.595, 0.51, 0.425, 0.34, 0.255, 0.17, 0.085]
    right = [0, 0.085, 0.17, 0.255, 0.34, 0.425, 0.51, 0.595, 0.68, 0.765]
    assert weights[50:90] == pytest.approx([*left, *[1.0] * 20, *right], abs=1e-6)
    assert set(weights[:50] + weights[90:]) == {1.0}


def test_soft_and_hard_are_the_ends_of_the_ramp_and_the_modes_keep_the_rest() -> None:
    """b = 2: half way and all the way from one to the other; only the paper's handshake is soft."""
    plan = Plan.of([40, 40], 4, 2)
    paper = keep_weights(plan, adjusted("paper", soft=0.2, hard=0.6).keep)[0]
    assert paper[29:39] == pytest.approx([1, 0.6, 0.4, *[0.2] * 4, 0.4, 0.6, 1])
    published = keep_weights(plan, adjusted("published", soft=0.2, hard=0.6).keep)[0]
    assert published[30:38] == pytest.approx([0.6, 0.4, *[1] * 4, 0.2, 0.4])
    assert adjusted("paper", restart=0.25).restart == 0.25
    assert adjusted("paper") == MODES["paper"]


@pytest.mark.parametrize(
    "change", [{"soft": -0.1}, {"soft": 1.1}, {"hard": float("nan")}, {"restart": 0.0}, {"restart": 2.0}]
)
def test_shares_that_are_none_are_refused(change: dict) -> None:
    with pytest.raises(MotionloomError, match=r"share from 0 to 1|without noise"):
        double_take_features(tiny.prior(), ["walk", "jump"], [80, 80], steps=2, **change)


def test_the_ablation_row_between_the_modes_is_a_preset_too() -> None:
    """The soft value as the low end of the ramp while the handshake is kept."""
    weights = keep_weights(Plan.of([100, 100], 20, 10), Keep(1.0, 0.85, 0.1, 1.0))[0]
    assert weights[59] == pytest.approx(0.1 + 0.75 / 10)
    assert set(weights[60:80].tolist()) == {1.0}


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_the_long_motion_has_every_frame_once(data: st.DataObject) -> None:
    """Frame numbers written into rows come out of unfolding one after the other, whatever the lengths."""
    count = data.draw(st.integers(1, 5))
    hands = data.draw(st.lists(st.integers(1, 30), min_size=count - 1, max_size=count - 1))
    ramps = data.draw(st.lists(st.integers(0, 60), min_size=count - 1, max_size=count - 1))
    least = Plan.of([1000] * count, hands, ramps)
    lengths = [least.least(i) + data.draw(st.integers(0, 40)) for i in range(count)]
    plan = Plan.of(lengths, hands, ramps, repetitions=data.draw(st.integers(1, 2)))
    starts = [0, *(end - h for end, h in zip(plan.ends, hands, strict=False))]
    rows = np.full((count, max(lengths), 1), -1.0)
    for row, (start, length) in enumerate(zip(starts, lengths, strict=True)):
        rows[row, :length, 0] = np.arange(start, start + length)
    x = np.tile(rows, (plan.repetitions, 1, 1))
    total = sum(lengths) - sum(hands)
    assert plan.ends[-1] == total
    assert np.array_equal(unfold(x, plan)[..., 0], np.broadcast_to(np.arange(total), (plan.repetitions, total)))
    for row, valid in zip(sandwiches(x, plan), plan.sandwiches * plan.repetitions, strict=True):
        assert np.array_equal(np.diff(row[:valid, 0]), np.ones((valid - 1,), np.float32))
        assert not row[valid:].any()
    weights = keep_weights(plan, MODES["paper"].keep)
    assert weights.shape == (count - 1, plan.width)


def test_repetitions_are_rows_of_their_own() -> None:
    """Two repetitions in one batch give what each gives alone with its noise."""
    lengths, hands, ramps = [50, 60, 45], (10, 8), (5, 3)
    plan, one = Plan.of(lengths, hands, ramps, repetitions=2), Plan.of(lengths, hands, ramps)

    def net(x: np.ndarray, level: int) -> np.ndarray:
        return np.tanh(x) + 0.01 * level

    def taken(plan: Plan, seeds: list[int], later: list[int]) -> np.ndarray:
        draws = row_noise(seeds), row_noise(later)
        x = draws[0](np.empty((len(seeds), 60, CHANNELS), np.float32))
        return double_take(net, net, x, plan, mode=MODES["paper"], way=WAY, schedule=SCHEDULE, noise=draws).unfolded

    together = taken(plan, [1, 2, 3, 4, 5, 6], [7, 8, 9, 10])
    alone = np.concatenate([taken(one, [1, 2, 3], [7, 8]), taken(one, [4, 5, 6], [9, 10])])
    assert np.allclose(together, alone, atol=1e-6)
    assert np.array_equal(flags(plan), np.concatenate([flags(one), flags(one)]))


def test_flags_mark_what_rows_share() -> None:
    marks = flags(Plan.of([70, 80, 75], (20, 10), 5)).tolist()
    assert marks[0] == [0] * 50 + [1] * 20 + [0] * 10
    assert marks[1] == [1] * 20 + [0] * 50 + [1] * 10
    assert marks[2] == [1] * 10 + [0] * 70


@pytest.mark.parametrize(
    ("steps", "share", "first"), [(1000, 0.7, 700), (1000, 0.9, 900), (50, 0.9, 45), (24, 0.7, None)]
)
def test_the_second_take_restarts_at_the_nearest_level_at_or_below(steps: int, share: float, first: int | None) -> None:
    """All 1000 levels: 700 (paper) and 900 (published); 50 trained levels: scaled; 24 early steps: the next below."""
    schedule = cosine(1000 if steps == 24 else steps)
    way = levels(schedule, steps, spacing="early")
    found = restarted(way, schedule, share)
    assert found[-1] == 0
    assert found[0] == (first if first is not None else max(level for level in way if level <= 700))


@pytest.mark.parametrize(
    ("lengths", "handshake", "ramp", "said"),
    [
        ([70, 69], 20, 10, "interval 2 has 69 frames and needs 70"),
        ([70, 70], 20, 20, "interval 1 has 70 frames and needs 90"),
        ([70, 70], (20, 20), 10, "2 intervals have 1 transitions"),
        ([70, 70], 0, 10, "at least one frame"),
        ([70, 70], 20, -1, "at least one frame"),
        ([], 20, 10, "nothing to make"),
        ([70, 5000], 20, 10, "at most 2000"),
        ([2000] * 101, 20, 10, "at most 200000"),
    ],
)
def test_what_does_not_fit_is_refused(lengths: list[int], handshake, ramp, said: str) -> None:
    with pytest.raises(MotionloomError, match=said):
        Plan.of(lengths, handshake, ramp)


# ---- with a prior ---

PROMPTS = ["a person walks", "a person jumps", "a person waves"]


@pytest.mark.parametrize("mode", ["published", "paper"])
@pytest.mark.parametrize("config", [tiny.MODULATED, tiny.PUBLISHED], ids=["patched", "flagless"])
def test_features_of_many_prompts_decode_to_one_continuous_motion(config, mode) -> None:
    """Lengths, ends, finiteness, the same seed the same motion, and no step of the root beyond what a frame says."""
    prior = tiny.prior(config)
    motion, ends = double_take_features(prior, PROMPTS, [70, 83, 75], mode=mode, ramp=10, steps=6, seed=4)
    again, _ = double_take_features(prior, PROMPTS, [70, 83, 75], mode=mode, ramp=10, steps=6, seed=4)
    other, _ = double_take_features(prior, PROMPTS, [70, 83, 75], mode=mode, ramp=10, steps=6, seed=5)
    assert motion.shape == (188, 263)
    assert ends == [70, 133, 188]
    assert np.isfinite(motion).all()
    assert np.array_equal(motion, again)
    assert not np.array_equal(motion, other)
    positions = humanml.decode_positions(motion.astype(np.float64))
    speed = np.linalg.norm(np.diff(positions[:, 0, [0, 2]], axis=0), axis=-1)
    assert speed == pytest.approx(np.linalg.norm(motion[:-1, 1:3], axis=-1), abs=1e-5)


def test_paper_rows_do_not_see_the_padding_and_published_rows_do() -> None:
    """One row's length changes another row's motion only where padding is attended (first take without handshakes)."""
    prior = tiny.prior(tiny.PUBLISHED)

    def first_rows(mode, longest: int) -> np.ndarray:
        motion, _ = double_take_features(
            prior, PROMPTS[:2], [70, longest], mode=mode, ramp=10, steps=4, second_take_only=True
        )
        return motion[:30]

    assert np.allclose(first_rows("paper", 75), first_rows("paper", 90), atol=1e-5)
    assert not np.allclose(first_rows("published", 75), first_rows("published", 90), atol=1e-3)


def test_a_network_with_flags_sees_what_is_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Handshake frames are flagged in the first take, so that another handshake changes frames far from it."""
    from dataclasses import replace

    prior = tiny.prior(replace(tiny.PUBLISHED, flags=True))
    motion, _ = double_take_features(prior, PROMPTS[:2], [70, 75], ramp=10, steps=4, first_take_only=True)
    states: list[np.ndarray] = []
    bind = PriorSession.bind
    monkeypatch.setattr(PriorSession, "bind", lambda net, cond: states.append(cond.flags) or bind(net, cond))
    double_take_features(prior, PROMPTS[:2], [70, 75], ramp=10, steps=4)
    assert motion.shape == (125, 263)
    assert states[0].tolist() == flags(Plan.of([70, 75], 20, 10)).tolist()
    assert not states[-1].any()


def test_one_prompt_is_a_motion_of_its_own() -> None:
    motion, ends = double_take_features(tiny.prior(), PROMPTS[:1], [30], steps=5)
    assert motion.shape == (30, 263)
    assert ends == [30]
    assert len(sample_features(tiny.prior(), PROMPTS[:1], [30], seeds=[0], steps=5)[0]) == 30


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mode": "third"}, "no mode 'third'"),
        ({"steps": 0}, "0 steps"),
        ({"steps": 51}, "51 steps"),
        ({"solver": "magic"}, "magic"),
        ({"seed": -1}, "seed"),
        ({"guidance": float("nan")}, "guidance"),
        ({"prompts": ["a", " "]}, "prompt is empty"),
        ({"prompts": ["a"]}, "2 lengths for 1 prompts"),
        ({"frames": [70, 60]}, "interval 2 has 60 frames"),
        ({"first_take_only": True, "second_take_only": True}, "exclude"),
    ],
)
def test_bad_requests_get_one_sentence(change: dict, said: str) -> None:
    how = {"prompts": ["a", "b"], "frames": [70, 70], "ramp": 10, "steps": 4} | change
    with pytest.raises(MotionloomError, match=said):
        double_take_features(tiny.prior(), how.pop("prompts"), how.pop("frames"), **how)


def test_an_interval_longer_than_the_data_is_made_and_told() -> None:
    with pytest.warns(UserWarning, match="at most 196"):
        motion, _ = double_take_features(tiny.prior(), PROMPTS[:2], [70, 200], ramp=10, steps=2)
    assert len(motion) == 250


def test_first_take_leaves_rows_alone_where_nothing_joins_them() -> None:
    """Second take only: rows are sampled as if they were alone."""
    plan = Plan.of([40, 40], 10, 2)
    x, draws = noise(plan, 0)
    rows = first_take(first_net, x, plan, way=WAY, schedule=SCHEDULE, noise=draws[0], join=False)
    x, draws = noise(plan, 0)
    assert np.array_equal(rows, run(first_net, x, levels=WAY, solver=DDPM, schedule=SCHEDULE, noise=draws[0]))
