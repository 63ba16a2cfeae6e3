"""Adapters trained on clips, merged into a prior by file and factor, for the whole or segment by segment."""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.prior import Prior
from motionloom.goals.adapters import MOST_ADAPTERS, Applied

CACHE_SIZE = 4
"""Sets of adapters whose merged networks are cached; each is as large as the prior's network."""


def adapt(prior: Prior, adapters: Sequence[Applied]) -> Prior:
    """The prior with adapters merged into its weights, each times its factor; the prior itself for none.

    Those without a factor change only sentences that are like what they were taught (`Prior.for_words`).

    Raises `MotionloomError` for files that are missing, damaged or of another prior, and for adapters for control.
    """
    if len(adapters) > MOST_ADAPTERS:
        raise MotionloomError(f"{len(adapters)} adapters at once are too many; at most {MOST_ADAPTERS}")
    return prior.with_adapters(load_adapters(prior, adapters))


def load_adapters(prior: Prior, adapters: Sequence[Applied]) -> tuple[tuple[Adapter, float | None], ...]:
    """The same with every file read; errors as of `adapt`."""
    return tuple((Adapter.load(one, prior) if isinstance(one, Path) else one, factor) for one, factor in adapters)


def adapted_priors(prior: Prior) -> Callable[[tuple[Applied, ...]], Prior]:
    """From adapters to the prior with them besides those it has, errors as of `adapt`; the last `CACHE_SIZE` merged
    ones are cached."""
    merged = lru_cache(CACHE_SIZE)(partial(adapt, prior))
    return lambda adapters: merged(adapters) if adapters else prior
