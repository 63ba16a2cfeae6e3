"""What "the same seed, the same motion" means, on the shipped weights: docs/trust.md."""

import numpy as np
import pytest

from motionloom.core.models.prior import Prior
from motionloom.tasks.text import generate

FEW = {"seconds": 2.0, "steps": 6}
PROMPT = "a person walks forward and waves"


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior.load()


def test_alone_a_seed_makes_the_same_motion_bit_for_bit(prior: Prior) -> None:
    first, again = (generate(prior, PROMPT, seed=4, **FEW)[0] for _ in range(2))
    assert np.array_equal(first.root, again.root)
    assert np.array_equal(first.rotations, again.rotations)
    assert not np.array_equal(first.rotations, generate(prior, PROMPT, seed=5, **FEW)[0].rotations)


@pytest.mark.parametrize("count", [2, 3, 8])
def test_in_any_company_it_is_equal_to_three_micrometres(prior: Prior, count: int) -> None:
    """The last of `count` motions that are made together against the same seed alone."""
    alone = generate(prior, PROMPT, seed=4, **FEW)[0].positions()
    together = generate(prior, PROMPT, seed=4 - (count - 1) if count <= 5 else 4, count=count, **FEW)
    same = together[count - 1 if count <= 5 else 0].positions()
    assert np.abs(same - alone).max() <= 3e-6
