"""The windows behind predictions: the person at the predictor's rate, people who stay in place, above the floor."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.diffusion import row_seed
from motionloom.core.features.positions import bone_lengths
from motionloom.core.skeleton import SMPL22
from motionloom.requests.sampling import PredictionSampling
from motionloom.retarget import to_smpl22
from motionloom.tasks import completion
from motionloom.tasks.completion import TEMPERATURE_AFTER_FIRST, Past, WindowSampler, next_frames, window_count
from tests.tasks.small_predictor import FPS, FRAMES, OBSERVED, small_predictor
from tests.tasks.test_edit import person

PREDICTOR = small_predictor()
SAMPLER = WindowSampler(PREDICTOR, PredictionSampling(steps=2, temperature=1.0))
AHEAD = FRAMES - OBSERVED
PERSON = Past.of(PREDICTOR, person(2.0, 30.0)).person[None]


@pytest.mark.parametrize("fps", [10.0, 24.0, 25.0, 29.97, 30.0, 60.0, 120.0])
def test_a_person_is_seen_at_the_rate_of_the_predictor_and_up_to_the_last_frame(fps: float) -> None:
    """Every seen moment is the smooth clip's own moment, counted back from its end."""
    past, fine = person(1.5, fps), person(1.5, 600.0)
    places = Past.of(PREDICTOR, past).person
    assert places.shape == (OBSERVED, 22, 3)
    back = (len(past) - 1) / fps - np.arange(OBSERVED)[::-1] / FPS
    real = to_smpl22(fine).positions()[(back * 600).round().astype(int)]
    real += (places[-1, 0] - real[-1, 0]) * [0, 1, 0]  # the floor is read from other frames
    assert np.abs(places - real).max() < (0.06 if fps < 20 else 0.012)
    np.testing.assert_allclose(
        places[-1, 4] - places[-1, 0], real[-1, 4] - real[-1, 0], atol=0.02 if fps < 20 else 0.005
    )


SHORT = [(30.0, 9, 9, 9), (30.0, 40, 15, 15), (60.0, 40, 15, 29), (120.0, 2, 2, 2), (120.0, 9, 3, 9), (10.0, 2, 4, 2)]


@pytest.mark.parametrize(("fps", "frames", "places", "count"), SHORT)
def test_short_clips_are_seen_whole_and_by_two_moments_at_least(
    fps: float, frames: int, places: int, count: int
) -> None:
    past = person(2.0, fps).frames(0, frames)
    assert Past.of(PREDICTOR, past).person.shape == (places, 22, 3)
    assert len(Past.of(PREDICTOR, past).tail) == count


def test_a_predictor_that_sees_longer_than_floors_need_sees_all_of_it() -> None:
    long = replace(PREDICTOR, observed=140, basis=replace(PREDICTOR.basis, frames=170))
    past = person(6.0, 30.0)
    places = Past.of(long, past).person
    real = to_smpl22(past).positions()[-140:]
    assert np.abs((places - real)[..., [0, 2]]).max() < 0.02


@pytest.mark.parametrize(("seconds", "count"), [(0.01, 1), (0.999, 1), (1.0 + 1e-9, 1), (1.01, 2), (7.5, 8)])
def test_as_many_windows_as_the_seconds_need(seconds: float, count: int) -> None:
    assert window_count(PREDICTOR, seconds) == count


def test_each_window_sees_the_one_before() -> None:
    """By hand: the next window is what comes behind the last frames, on the bones of the person."""
    windows = list(SAMPLER.windows(PERSON, [(7, 3)], None, 3))
    whole = PERSON
    for number, window in enumerate(windows):
        seeds = [row_seed(7, 3, number)]
        heat = TEMPERATURE_AFTER_FIRST if number else 1.0
        by_hand = next_frames(PREDICTOR, whole[:, -OBSERVED:], seeds=seeds, steps=2, temperature=heat)
        np.testing.assert_allclose(window[..., [0, 2]], by_hand[..., [0, 2]], atol=1e-6)
        whole = np.concatenate([whole, window], axis=1)
    lengths = bone_lengths(PERSON, SMPL22.parents)
    np.testing.assert_allclose(bone_lengths(whole, SMPL22.parents), lengths, atol=1e-9)


def test_what_is_given_is_asked_for_each_window_once_and_as_far_as_it_sees() -> None:
    calls: list[tuple[int, int]] = []
    list(SAMPLER.windows(PERSON, [(0, 0)], lambda first, last: calls.append((first, last)), 3))
    assert calls == [(1, 1 + AHEAD), (1 + AHEAD, 1 + 2 * AHEAD), (1 + 2 * AHEAD, 1 + 3 * AHEAD)]
    calls.clear()
    list(SAMPLER.windows(PERSON[:, -4:], [(0, 0)], lambda first, last: calls.append((first, last)), 2))
    assert calls[0] == (1, 1 + FRAMES - 4)


def test_a_person_in_place_keeps_to_it_but_rises_and_sinks() -> None:
    free = next(SAMPLER.windows(PERSON, [(0, 0)], None, 1))
    bound = next(replace(SAMPLER, root=False).windows(PERSON, [(0, 0)], None, 1))
    assert (bound[:, :, 0, [0, 2]] == PERSON[:, -1:, 0, [0, 2]]).all()
    np.testing.assert_allclose(bound - bound[:, :, :1], free - free[:, :, :1], atol=1e-12)
    np.testing.assert_allclose(bound[..., 1], free[..., 1], atol=1e-12)


def sinking(depth: float):
    def sink(predictor, past, *, frames=None, **_):
        t = np.arange(1, AHEAD + 1)[:, None, None] / AHEAD
        return past[:, -1:] - depth * t * [0, 1, 0]

    return sink


def test_nobody_sinks_under_the_floor_and_the_lift_is_smooth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(completion, "next_frames", sinking(0.5))
    window = next(SAMPLER.windows(PERSON, [(0, 0)], None, 1))[0]
    assert window[..., 1].min() > PERSON[0, -1, :, 1].min().clip(max=0) - 0.05
    whole = np.concatenate([PERSON[0, -3:, :, 1], window[..., 1]])
    assert np.abs(np.diff(whole[2:], 2, axis=0)).max() < 0.012
    moved = window - (PERSON[0, -1] - PERSON[0, -1, 0] + window[:, :1])
    assert np.abs(moved).max() < 1e-9, "the body is moved as a whole"


def test_people_above_the_floor_or_already_under_it_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(completion, "next_frames", sinking(-0.5))
    up = next(SAMPLER.windows(PERSON, [(0, 0)], None, 1))
    assert np.array_equal(up, sinking(-0.5)(PREDICTOR, PERSON))
    monkeypatch.setattr(completion, "next_frames", sinking(0.0))
    cellar = PERSON - np.array([0, 1.0, 0])
    assert np.array_equal(next(SAMPLER.windows(cellar, [(0, 0)], None, 1)), sinking(0.0)(PREDICTOR, cellar))
