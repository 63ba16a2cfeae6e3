"""Adapters trained on clips, merged into a prior by file and factor, for the whole or segment by segment."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.goals.adapters import MOST_ADAPTERS, Applied
from motionloom.weights.adapter import Adapter
from motionloom.weights.prior import Prior

CACHE_SIZE = 4
"""Sets of adapters whose merged networks are cached; each is as large as the prior's network."""


def adapt(prior: Prior, adapters: Sequence[Applied]) -> Prior:
    """The prior with adapters merged into its weights, each times its factor; the prior itself for none.

    Raises `MotionloomError` for files that are missing, damaged or of another prior, and for adapters for control.
    """
    if len(adapters) > MOST_ADAPTERS:
        raise MotionloomError(f"{len(adapters)} adapters at once are too many; at most {MOST_ADAPTERS}")
    return prior.with_adapters(load_adapters(prior, adapters))


def load_adapters(prior: Prior, adapters: Sequence[Applied]) -> tuple[tuple[Adapter, float], ...]:
    """The same with every file read; errors as of `adapt`."""
    return tuple((Adapter.load(one, prior) if isinstance(one, Path) else one, factor) for one, factor in adapters)


@dataclass(eq=False)
class AdaptedPriors:
    """A prior with different adapters at different times; the last `CACHE_SIZE` merged ones are cached."""

    prior: Prior
    cache: OrderedDict[tuple[Applied, ...], Prior] = field(default_factory=OrderedDict)

    def of(self, adapters: tuple[Applied, ...]) -> Prior:
        """The prior with these adapters besides those it has; errors as of `adapt`."""
        if not adapters:
            return self.prior
        if adapters not in self.cache:
            self.cache[adapters] = adapt(self.prior, adapters)
            while len(self.cache) > CACHE_SIZE:
                self.cache.popitem(last=False)
        self.cache.move_to_end(adapters)
        return self.cache[adapters]
