"""Completing windows: known numbers stay, the rest leaves them smoothly, seeds belong to rows, bones stay long."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BPoly

from motionloom.core.diffusion import row_noise, row_seed
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT, bone_lengths
from motionloom.tasks.completion import Known, complete, futures, join_known, next_frames
from tests.noise import normal
from tests.tasks.small_predictor import FRAMES, OBSERVED, small_predictor
from tests.tasks.test_edit import person

PREDICTOR = small_predictor()
PAST = np.stack([person(3.0, 30.0).positions()[at : at + OBSERVED] for at in (0, 40)])


def some(*shape: int, seed: int = 0) -> np.ndarray:
    return normal(shape, seed)


# Led from what is known


@pytest.mark.parametrize("known", [(0, 5), (20, 30), (12, 20), (29, 30), (0, 1)])
def test_a_course_leaves_known_frames_in_value_and_slope_and_comes_to_its_own(known: tuple[int, int]) -> None:
    """A known line beside a made line goes on as the quintic of scipy through their difference."""
    first, last = known
    t = np.arange(30.0, dtype=np.float64)[None, :, None]
    sampled, past = np.broadcast_to(2 + 0.5 * t, (1, 30, 3)), np.broadcast_to(1 - 0.25 * t, (1, 30, 3))
    mask = np.zeros((1, 30, 1), dtype=np.float64)
    mask[:, first:last] = 1
    result = join_known(sampled, np.where(mask > 0, past, 99.0), mask, ease=6)[0, :, 0]
    expected = np.where(mask[0, :, 0] > 0, past[0, :, 0], sampled[0, :, 0])
    for border, step, room in ((last - 1, 1, min(6, 30 - last)), (first, -1, min(6, first))):
        slope = -0.75 * step if last - first > 1 else 0.0
        lead = BPoly.from_derivatives([0, room + 1], [[-1 - 0.75 * border, slope, 0], [0, 0, 0]])
        for k in range(1, room + 1):
            expected[border + step * k] += lead(k)
    np.testing.assert_allclose(result, expected, atol=1e-9)


@pytest.mark.parametrize("free", [1, 2, 3, 5, 9, 20])
def test_between_two_known_stretches_there_is_no_jump_at_either_border(free: int) -> None:
    """Second differences stay as small as the difference of both courses spread over the gap asks."""
    frames = 20 + free
    sampled, known = np.zeros((1, frames, 3), np.float32), np.full((1, frames, 3), 1.0)
    mask = np.ones((1, frames, 1), np.float32)
    mask[:, 10 : 10 + free] = 0
    result = join_known(sampled, known, mask, ease=12)[0, :, 0]
    assert (np.delete(result, slice(10, 10 + free)) == 1).all()
    assert abs(np.diff(result)).max() < 1.9 / (min(free, 12) + 1) + 1e-6
    np.testing.assert_allclose(result, result[::-1], atol=1e-6)


def test_known_numbers_come_back_exactly_and_soft_masks_mix() -> None:
    sampled, known, mask = some(4, 30, 12), some(4, 30, 12, seed=1), np.zeros((4, 30, 4), dtype=np.float64)
    mask[:2, :6], mask[2, 3:9, 1], mask[3, 5:, 2], mask[3, 20, 0] = 1, 1, 0.25, 1
    result = join_known(sampled, known, mask, ease=4)
    each = np.repeat(mask, 3, axis=-1)
    assert np.array_equal(result[each == 1], known[each == 1])
    np.testing.assert_allclose(result[3, 5:, 6:9], 0.75 * sampled[3, 5:, 6:9] + 0.25 * known[3, 5:, 6:9], atol=1e-5)
    alone = np.concatenate([join_known(*(x[i : i + 1] for x in (sampled, known, mask)), ease=4) for i in range(4)])
    assert np.array_equal(result, alone)


def test_nothing_known_and_all_known_change_nothing() -> None:
    sampled, known = some(2, 9, 6), some(2, 9, 6, seed=1)
    assert np.array_equal(join_known(sampled, known, np.zeros((2, 9, 2), np.float32), ease=3), sampled)
    assert np.array_equal(join_known(sampled, known, np.ones((2, 9, 2), np.float32), ease=3), known)


# Completing


def passes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    features, mask = some(3, FRAMES, 66).astype(np.float32), np.zeros((3, FRAMES, 22), np.float32)
    mask[:, :OBSERVED], mask[1, 20:30, 16:21], mask[2, -4:, 1:] = 1, 1, 1
    return features, mask, features[:, OBSERVED - 1]


def test_a_row_is_the_same_alone_and_among_others() -> None:
    features, mask, pose = passes()
    together = complete(PREDICTOR, features, mask, pose, seeds=[5, 6, 7])
    alone = complete(PREDICTOR, features[1:2], mask[1:2], pose[1:2], seeds=[6])
    np.testing.assert_allclose(together[1:2], alone, atol=1e-4, rtol=1e-4)
    each = np.repeat(mask, 3, axis=-1)
    assert np.array_equal(together[each == 1], features[each == 1])
    assert not np.allclose(complete(PREDICTOR, features, mask, pose, seeds=[5, 8, 7])[1], together[1], atol=1e-3)


def test_guidance_one_is_the_told_pass_zero_the_untold_and_two_goes_beyond() -> None:
    """With one step the answer is the network's guess from noise of the temperature, linear in the guidance."""
    features, mask, pose = passes()

    def completed(guidance: float, temperature: float = 1.0) -> np.ndarray:
        options = {"steps": 1, "guidance": guidance, "temperature": temperature}
        return complete(PREDICTOR, features, mask, pose, seeds=[1, 2, 3], **options)

    rows = PREDICTOR.condition(features, mask, pose)
    noise = row_noise([1, 2, 3])(np.empty((3, 16, 66), np.float32))
    for guidance, scale in ((1.0, 1.0), (0.0, 1.0), (1.0, 0.5), (1.0, 0.0)):
        guess = PREDICTOR.denoiser(rows, np.full(3, bool(guidance)))(scale * noise, PREDICTOR.schedule.steps)
        plain = join_known(PREDICTOR.to_features(guess, pose), features, mask, ease=12)
        np.testing.assert_allclose(completed(guidance, scale), plain, atol=1e-4, rtol=1e-4)
    assert np.abs(completed(1.0) - completed(1.0, 0.5)).max() > 0.01
    assert np.abs(completed(1.0) - completed(0.0)).max() > 0.01
    np.testing.assert_allclose(completed(2.0), 2 * completed(1.0) - completed(0.0), atol=1e-3, rtol=1e-3)


# Futures


def test_futures_have_the_bones_of_the_past_and_leave_it_smoothly() -> None:
    places = futures(PREDICTOR, PAST, count=3, seed=2)
    assert places.shape == (2, 3, FRAMES - OBSERVED, 22, 3)
    lengths = np.linalg.norm(np.diff(places[..., [[1, 4], [16, 18]], :], axis=-2), axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[:1, :1, :1], lengths.shape), atol=1e-9)
    np.testing.assert_allclose(
        bone_lengths(places, SMPL_LAYOUT.parents)[1, 2], bone_lengths(PAST, SMPL_LAYOUT.parents)[1]
    )
    whole = np.concatenate([np.repeat(PAST[:, None], 3, axis=1), places], axis=2)
    bend = np.linalg.norm(np.diff(whole, 2, axis=2), axis=-1)
    assert bend[:, :, OBSERVED - 2 : OBSERVED].max() <= 1.5 * max(bend[:, :, : OBSERVED - 2].max(), 3e-3)
    jump = np.linalg.norm(np.diff(whole, axis=2), axis=-1)
    assert jump[:, :, OBSERVED - 1].max() <= 1.1 * jump[:, :, : OBSERVED - 1].max()
    loose = futures(PREDICTOR, PAST, count=1, seed=2, exact=False)
    assert np.ptp(np.linalg.norm(loose[..., 4, :] - loose[..., 1, :], axis=-1)) > 1e-4


def test_future_number_i_of_a_past_is_the_same_whatever_else_is_asked() -> None:
    many = futures(PREDICTOR, PAST, count=4, seed=9)
    few, parted = futures(PREDICTOR, PAST, count=2, seed=9), futures(PREDICTOR, PAST, count=4, seed=9, batch_size=3)
    alone, short = futures(PREDICTOR, PAST[1:], count=1, seed=9), futures(PREDICTOR, PAST, count=1, seed=9, frames=7)
    for one, same in ((few, many[:, :2]), (parted, many), (alone[0], many[1, :1]), (short, many[:, :1, :7])):
        np.testing.assert_allclose(one, same, atol=1e-5)
    assert np.abs(many[0, 0] - many[0, 1]).max() > 0.01
    assert np.abs(futures(PREDICTOR, PAST, count=1, seed=10) - many[:, :1]).max() > 0.01


def test_without_a_temperature_there_is_nothing_left_to_draw() -> None:
    calm = futures(PREDICTOR, PAST, count=3, seed=1, temperature=0.0)
    np.testing.assert_allclose(calm, np.repeat(calm[:, :1], 3, axis=1), atol=1e-5)
    apart = [np.ptp(futures(PREDICTOR, PAST, count=3, seed=1, temperature=t), axis=1).max() for t in (0.5, 1.0, 1.5)]
    assert 0.01 < apart[0] < apart[1] < apart[2]


def test_a_past_that_is_turned_and_moved_has_its_future_turned_and_moved() -> None:
    turn, shift = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]), np.array([3.0, 0, -2])
    here, there = (futures(PREDICTOR, past, count=1) for past in (PAST, PAST @ turn.T + shift))
    np.testing.assert_allclose(here @ turn.T + shift, there, atol=1e-5)


@pytest.mark.parametrize("h", [2, 3, OBSERVED])
def test_short_pasts_have_futures_too(h: int) -> None:
    places = futures(PREDICTOR, PAST[:, -h:], count=1)
    assert places.shape == (2, 1, FRAMES - OBSERVED, 22, 3)
    step = np.linalg.norm(places[:, 0, 0] - PAST[:, -1], axis=-1)
    assert step.max() < 1.2 * np.linalg.norm(PAST[:, -1] - PAST[:, -2], axis=-1).max()


def test_known_places_of_joints_come_back() -> None:
    """With the bones of the past, so that keeping them changes nothing; the other joints are led elsewhere by it."""
    mask = np.zeros((30, 22), dtype=np.float32)
    mask[10:] = 1
    aim = np.stack([person(3.0, 30.0).positions()[start + OBSERVED : start + OBSERVED + 30] for start in (0, 40)])
    free, held = (next_frames(PREDICTOR, PAST, seeds=[1, 2], known=k) for k in (None, Known(aim, mask)))
    np.testing.assert_allclose(held[:, 10:], aim[:, 10:], atol=1e-5)
    assert np.abs(free - held)[:, 4].max() > 1e-3
    one = next_frames(PREDICTOR, PAST[:1], seeds=[1], known=Known(aim[0], mask))
    np.testing.assert_allclose(one[0], held[0], atol=1e-5)


def test_seeds_of_futures_and_windows_do_not_repeat() -> None:
    seeds = {row_seed(seed, i, turn) for seed in range(6) for i in range(6) for turn in range(6)}
    assert len(seeds) == 6**3
    assert max(seeds) < 2**63


# What cannot be completed

MISTAKES = {
    "flat": {"past": PAST[0]},
    "numbers": {"past": np.zeros(5)},
    "joints": {"past": PAST[:, :, :21]},
    "nan": {"past": np.where(np.arange(22)[:, None] == 3, np.nan, PAST)},
    "one frame": {"past": PAST[:, :1]},
    "too long": {"past": np.concatenate([PAST, PAST], axis=1)},
    "no rows": {"past": PAST[:0]},
    "no frames": {"frames": 0},
    "too many frames": {"frames": 31},
    "no futures": {"count": 0},
    "no rows at once": {"batch_size": 0},
}


@pytest.mark.parametrize("name", sorted(MISTAKES))
def test_what_cannot_be_completed_is_reported(name: str) -> None:
    with pytest.raises(MotionloomError, match=r"got|a count of 0"):
        futures(PREDICTOR, **{"past": PAST, "count": 1} | MISTAKES[name])


@pytest.mark.parametrize(
    ("shape", "mask"), [((30, 22, 3), (30, 21)), ((29, 22, 3), (30, 22)), ((3, 30, 22, 3), (30, 22))]
)
def test_a_mask_that_does_not_fit_is_reported(shape: tuple[int, ...], mask: tuple[int, ...]) -> None:
    known = Known(np.zeros(shape), np.zeros(mask, dtype=np.float32))
    with pytest.raises(MotionloomError, match="known"):
        next_frames(PREDICTOR, PAST, seeds=[0, 1], known=known)


def test_fast_guesses_of_slow_predictors_have_at_least_a_frame_to_be_led() -> None:
    slow = replace(PREDICTOR, fps=1.0)
    assert np.isfinite(futures(slow, PAST, count=1)).all()
