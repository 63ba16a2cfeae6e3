"""A row's motion is the same whatever rows are made beside it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.models.prior import Prior, shipped
from motionloom.tasks.sampling import Rows
from motionloom.tasks.text import generate, sample_features
from tests.recorded import tiny

PROMPTS = (
    "a person walks",
    "a person turns left and then right and waves with the right hand",
    "a person jumps",
    "sit",
)


@given(frames=st.lists(st.integers(4, 400), max_size=40), together=st.integers(1, 8))
def test_every_row_is_in_one_group_of_rows_with_as_many_tokens(frames: list[int], together: int) -> None:
    batches = Rows([""] * len(frames), frames, range(len(frames)), patch=4).batches(together)
    assert sorted(row for group in batches for row in group) == list(range(len(frames)))
    for group in batches:
        assert 1 <= len(group) <= together
        assert len({-(-frames[row] // 4) for row in group}) == 1  # tokens of 4 frames


def sampled(prior: Prior, rows: list[int], lengths: list[int]) -> list[np.ndarray]:
    return sample_features(prior, [PROMPTS[i] for i in rows], lengths, seeds=rows, padded=True, steps=4)


@pytest.mark.parametrize("config", [tiny.MODULATED, tiny.PUBLISHED], ids=["modulated", "published"])
def test_a_row_drawn_with_others_is_the_row_drawn_alone(config) -> None:
    """To the last bit, also where prompts have other numbers of words."""
    prior = tiny.prior(config)
    lengths = [30] * 4 if config is tiny.PUBLISHED else [30, 29, 32, 31]
    together = sampled(prior, [0, 1, 2, 3, 3, 0], [*lengths, 30, 30])
    assert [len(row) for row in together[:4]] == lengths
    for row, length in enumerate(lengths):
        alone = sampled(prior, [row], [length])[0]
        assert np.array_equal(alone, together[row])


def test_the_sampler_of_batches_draws_what_that_of_single_motions_does() -> None:
    prior = tiny.prior()
    here = sampled(prior, [0, 1, 2], [30, 24, 30])
    there = sample_features(prior, PROMPTS[:3], [30, 24, 30], seeds=[0, 1, 2], steps=4)
    assert max(float(np.abs(a - b).max()) for a, b in zip(here, there, strict=True)) < 1e-4


@pytest.mark.slow
@pytest.mark.skipif("default" not in shipped(), reason="no shipped weights")
def test_the_shipped_prior_makes_the_same_positions_in_any_company() -> None:
    """To 3e-6 metres: alone and beside others; and by `generate` nearly."""
    from motionloom.tasks.text import finish

    prior = Prior.load()

    def places(rows: list[int], lengths: list[int]) -> list[np.ndarray]:
        return [finish(prior, features).positions() for features in sampled(prior, rows, lengths)]

    alone = places([1], [100])[0]
    for rows, lengths in (([1, 0], [100, 97]), ([3, 2, 1, 0, 0], [98, 99, 100, 100, 97])):
        assert np.abs(places(rows, lengths)[rows.index(1)] - alone).max() < 3e-6
    by_itself = generate(prior, PROMPTS[1], seconds=5.0, seed=1, steps=4, as_one=True)[0].positions()
    assert np.abs(by_itself - alone).max() < 2e-5
