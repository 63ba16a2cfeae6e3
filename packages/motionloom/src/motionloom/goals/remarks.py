"""Remarks on words before anything is generated: how they are read, that they are not English or not known."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from motionloom.goals.contact import read_contact
from motionloom.goals.english import is_english
from motionloom.goals.roles import MARK, prompts_of, without_two
from motionloom.goals.verbs import subject_of
from motionloom.runtime.text.known import Known, Nearest, bare, nearest, stem
from motionloom.runtime.text.protocol import TextEncoder

if TYPE_CHECKING:
    from motionloom.goals.timeline import Timeline


@dataclass(frozen=True)
class Remark:
    """A remark on some words."""

    text: str
    line: str
    instead: tuple[str, ...] = ()
    """The nearest sentences that are known."""


_LIGHT = frozenset(
    map(
        stem,
        re.findall(
            "[a-z]+",
            """do does make take play perform give use put ride go goes get start begin come
    throw have""",
        ),
    )
)
"""Verbs that say what is done only with the word behind them: "plays golf"."""
_SMALL = frozenset(
    re.findall(
        "[a-z]+",
        """a an the his her its their and or of to in on at with from over up down for as
    by into is are was be this that one two three something somebody someone very like out off around through across
    while""",
    )
)


def numbers_read(timeline: "Timeline") -> str:
    """A line with the numbers that were read in the words of a timeline, and the seconds of each; empty for none."""
    readings = [
        f"{one.amount}, {sum(segment.seconds for segment in timeline.segments[one.first : one.end]):g} s"
        for one in timeline.readings
    ]
    return f"read as: {'; '.join(readings)}" if readings else ""


def parts_read(timeline: "Timeline") -> str:
    """A line with the actions that a sentence was parted into; empty for one action, repeated or not."""
    if len(timeline.segments) < 2:
        return ""
    if [(one.first, one.end) for one in timeline.readings] == [(0, len(timeline.segments))]:
        return ""
    listed = ", ".join(f"'{segment.text}' {segment.seconds:.1f} s" for segment in timeline.segments)
    return f"one after the other: {listed}"


def remarks_on_two(
    texts: Sequence[str], block_known: Known | None, known: Known | None, encoder: TextEncoder
) -> list[Remark]:
    """Remarks on the words of two people: who is read to do what, and what neither block nor prior has learned.

    texts: one per segment. block_known: what the block knows; None: no remarks on pairs. known: what
    the prior knows. Raises `MotionloomError` as the encoder does.
    """
    prompts = {text: prompts_of(text) for text in texts if text.strip()}
    remarks = []
    for text, said in prompts.items():
        if MARK not in text and said[0] != said[1]:
            remarks.append(Remark(text, f"read as: '{said[0]} {MARK} {said[1]}'"))
        contact = read_contact(said)
        remarks += [] if contact is None else [Remark(text, f"read as: {contact}")]
    if block_known is not None and prompts:
        matches = nearest(block_known, [without_two(text) for text in prompts], encoder)
        remarks += [
            Remark(text, f"of two people {one.remark()}", one.sentences)
            for text, one in zip(prompts, matches, strict=True)
            if not one.near
        ]
    return remarks + remarks_on([prompt for said in prompts.values() for prompt in said], known, encoder)


def remarks_on(texts: Sequence[str], known: Known | None, encoder: TextEncoder) -> list[Remark]:
    """Remarks on texts that are not English, and on those that are like nothing in the table of what is known.

    known: None where a weight file has no such table. The texts without a remark are left out. Raises `MotionloomError`
    as the encoder does.
    """
    distinct = [text for text in dict.fromkeys(texts) if text.strip()]
    english = [text for text in distinct if is_english(text)]
    remarks = [
        Remark(text, f"{text[:60]!r} does not look like English, and these weights know nothing else")
        for text in distinct
        if text not in english
    ]
    matches = nearest_known(english, known, encoder) if known else []
    return remarks + [Remark(one.prompt, one.remark(), one.sentences) for one in matches if not one.near]


def nearest_known(texts: Sequence[str], known: Known, encoder: TextEncoder) -> list[Nearest]:
    """The nearest known sentences of each text, by its words and its verb; `Nearest.near` says whether it is known."""
    return nearest(known, texts, encoder, verbs=[verb_words(text) for text in texts])


def verb_words(text: str) -> tuple[str, ...]:
    """The word that says what is done in a sentence, as far as its place shows; empty where there is none.

    The first word behind the subject, small words and adverbs aside; of "plays golf" the word behind it.
    """
    sentence = bare(text)
    subject = subject_of(sentence)
    rest = sentence[len(subject) :] if len(sentence) > len(subject) else sentence
    words = [word for word in re.findall(r"[a-z]+(?:-[a-z]+)*", rest) if word not in _SMALL and not word.endswith("ly")]
    first, *more = words or [""]
    if stem(first) in _LIGHT:
        return tuple(re.findall("[a-z]+", more[0])[:1]) if more else ()
    return tuple(re.findall("[a-z]+", first)[:1])
