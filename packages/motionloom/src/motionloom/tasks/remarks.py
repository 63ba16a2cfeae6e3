"""What every door says of words before motion is made of them."""

from collections.abc import Sequence

from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.goals.remarks import Remark, remarks_on, remarks_on_two
from motionloom.goals.roles import prompts_of


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
