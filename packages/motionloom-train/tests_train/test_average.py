"""The mean of two stages of one prior: half of the weights of each, and what the later one says of itself."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom_train.average import averaged
from tests.recorded import tiny


def stages() -> tuple[Prior, Prior]:
    """Two of one network and one standardisation."""
    before, after = tiny.prior(seed=1), tiny.prior(seed=2)
    return before, replace(after, mean=before.mean, std=before.std)


def test_every_weight_is_the_mean_and_the_later_ones_card_says_so() -> None:
    before, after = stages()
    old, new = ({name: value.copy() for name, value in one.net.weights.items()} for one in (before, after))
    mean = averaged(before, after, 0.25)
    for name, value in mean.net.weights.items():
        np.testing.assert_allclose(value, 0.75 * old[name] + 0.25 * new[name], rtol=1e-4, atol=1e-6)
    assert "0.25" in mean.card.notes["average"]


def test_priors_that_do_not_belong_together_and_shares_that_are_none_are_refused() -> None:
    before, after = stages()
    with pytest.raises(MotionloomError, match="standardisations"):
        averaged(replace(before, mean=before.mean + 1), after, 0.5)
    with pytest.raises(MotionloomError, match="share"):
        averaged(before, after, 1.5)
