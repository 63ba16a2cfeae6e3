"""Guidance by level, as all tasks of the prior take it."""

import pytest

from motionloom.core.diffusion import cosine
from motionloom.requests.sampling import GUIDANCE, LATE_GUIDANCE, PairSampling, PredictionSampling, Sampling

SCHEDULE = cosine(1000)


def test_with_early_spacing_guidance_rises_towards_the_end() -> None:
    strength = Sampling().strength(SCHEDULE)
    assert strength(999) == strength(500) == GUIDANCE
    assert strength(10) == 1 + LATE_GUIDANCE * (GUIDANCE - 1)
    assert Sampling().strength(SCHEDULE, 4.0)(999) == 4.0


@pytest.mark.parametrize(
    "sampling",
    [
        Sampling(spacing="index"),
        PredictionSampling(guidance=2.5),
        PairSampling(spacing="index"),
        Sampling(guidance=1.0),
        PairSampling(guidance=1.0),
    ],
)
def test_published_spacing_and_no_guidance_stay_the_same_on_all_levels(sampling: Sampling) -> None:
    strength = sampling.strength(SCHEDULE)
    assert {strength(level) for level in (1, 100, 500, 999)} == {sampling.guidance}


def test_two_people_are_guided_less_where_it_is_decided_who_stands_where() -> None:
    strength = PairSampling(guidance=2.5).strength(SCHEDULE)
    assert strength(999) == strength(801) == pytest.approx(1.5)
    assert strength(800) == strength(10) == pytest.approx(3.0)
    assert PairSampling().strength(SCHEDULE, 4.0)(999) == pytest.approx(2.0)
