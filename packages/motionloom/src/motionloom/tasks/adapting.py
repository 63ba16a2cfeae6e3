"""Adapters trained on clips, merged into a prior by file and factor, for the whole or segment by segment."""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.goals.adapters import MOST_ADAPTERS, Applied
from motionloom.goals.remarks import Remark, remarks_on, remarks_on_two
from motionloom.goals.roles import prompts_of
from motionloom.weights.adapter import Adapter
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

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


def remarks_on_words(
    prior: Prior, texts: Sequence[str], *, heads: bool = False, block: PairBlock | None = None
) -> list[Remark]:
    """Remarks on texts (`remarks_on`), and which adapters without a factor do not change them.

    heads: as of `remarks_on`. block: the texts are of two people, each for both or "A :: B" (`remarks_on_two`).
    Raises `MotionloomError` as the encoder does.
    """
    if block is not None:
        remarks = remarks_on_two(texts, block.known, prior.known, prior.text)
    else:
        remarks = remarks_on(texts, prior.known, prior.text, heads=heads)
    return remarks + [
        Remark(
            text,
            f"{text[:60]!r} is generated without the adapter {adapter.name!r}, which was taught "
            f"{adapter.captions[0][:60]!r}; write FILE:1 to use it for all words",
        )
        for text in dict.fromkeys(texts)
        if prior.optional and text.strip()
        for adapter in prior.left_out(*(prompts_of(text) if block is not None else [text]))
    ]


def lines_by_text(remarks: Sequence[Remark]) -> dict[str, str]:
    """The lines of remarks by the text that they are on, those of one text in one line."""
    lines: dict[str, list[str]] = {}
    for one in remarks:
        lines.setdefault(one.text, []).append(one.line)
    return {text: "; ".join(each) for text, each in lines.items()}
