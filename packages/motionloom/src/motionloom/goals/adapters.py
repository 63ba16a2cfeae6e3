"""Adapters trained on clips, as a request names them: files, each with a factor."""

from pathlib import Path
from typing import Any, TypeAlias

from motionloom.core.errors import MotionloomError
from motionloom.requests.fields import specs
from motionloom.requests.shared import Adapted

MOST_FACTOR = 4.0
MOST_ADAPTERS = specs(Adapted)["adapter"].many
"""Adapters that are merged at once."""

Applied: TypeAlias = tuple[Any, float | None]
"""An adapter (`core.models.adapter.Adapter`) or its file (`Path`), and its factor; None: 1, for those sentences alone
that are like what it was taught (`core.models.prior.Prior.for_words`)."""


def parse_adapter(word: str) -> tuple[Path, float | None]:
    """``FILE`` or ``FILE:FACTOR``, such as ``zombie.safetensors:0.8``; None for no factor.

    Raises `MotionloomError` for other words.
    """
    name, colon, tail = word.rpartition(":")
    try:
        name, factor = (name, float(tail)) if colon else (word, None)
    except ValueError:
        name, factor = word, None
    if not name.strip() or not abs(factor or 0.0) <= MOST_FACTOR:
        raise MotionloomError(
            f"the adapter {word!r} cannot be used; write FILE or FILE:FACTOR with a factor from -{MOST_FACTOR:g} to "
            f"{MOST_FACTOR:g}, such as zombie.safetensors:0.8"
        )
    return Path(name), factor
