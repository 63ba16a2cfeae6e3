"""Remarks on words before anything is generated: how they are read, that they are not English or not known."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from motionloom.core.models.networks.text.known import Known, Nearest, bare, nearest, stem
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.goals.contact import read_contact
from motionloom.goals.heads import is_of_head
from motionloom.goals.roles import MARK, SEVERAL, prompts_of, tells_of_several, without_two
from motionloom.goals.timeline import Timeline
from motionloom.goals.verbs import TABLES, in_plainer_words, rare_verb, subject_of, word_patterns


@dataclass(frozen=True)
class Remark:
    """A remark on some words."""

    text: str
    line: str
    instead: tuple[str, ...] = ()
    """Sentences to say instead: the same with common verbs for rare ones, and the nearest that are known."""


_LIGHT_WORDS = "do does make take play perform give use put ride go goes get start begin come throw have"
"""Verbs that say what is done only with the word behind them: "plays golf"."""
_FUNCTION_WORDS = """a an the his her its their and or of to in on at with from over up down for as by into is are was
be this that one two three something somebody someone very like out off around through across while"""
_LIGHT, _FUNCTION = frozenset(map(stem, _LIGHT_WORDS.split())), frozenset(_FUNCTION_WORDS.split())


_DENIED = word_patterns("remarks")["denied"]
LINE = 100
"""Characters of a line at most."""


def numbers_read(timeline: Timeline) -> str:
    """A line with the numbers that were read in the words of a timeline, the seconds of each, and those that are not
    kept; empty for none."""
    readings = [
        f"{one.amount}, {sum(segment.seconds for segment in timeline.segments[one.first : one.end]):g} s"
        for one in timeline.readings
    ]
    kept = [f"read as: {'; '.join(readings)}"] if readings else []
    return clipped("; ".join(kept + [f"not kept: {', '.join(timeline.unread)}"] * bool(timeline.unread)), LINE - 24)


def parts_read(timeline: Timeline) -> str:
    """A line with the actions that a sentence was parted into; empty for one action, repeated or not."""
    if len({segment.text for segment in timeline.segments}) < 2:
        return ""
    if [(one.first, one.end) for one in timeline.readings] == [(0, len(timeline.segments))]:
        return ""
    subject = subject_of(timeline.segments[0].text)
    listed = ", ".join(f"{one.text.removeprefix(subject).strip()} {one.seconds:.1f} s" for one in timeline.segments)
    return clipped(f"one after the other: {listed}", LINE - 24)


def clipped(line: str, most: int = LINE) -> str:
    """The line, or as much of it as that many characters hold."""
    return line if len(line) <= most else f"{line[: most - 4].rsplit(' ', 1)[0]} ..."


def replacement_line(texts: Iterable[tuple[str, str]]) -> str:
    """A sentence with verbs whose manner is lost, or what texts are generated as; empty where none is."""
    changed = dict.fromkeys((one, other) for one, other in texts if one != other)
    lost = [f"'{verb}'" for one, _ in changed if (verb := rare_verb(one))]
    if lost:
        return clipped(f"the manner of {', '.join(lost)} is not shown")
    return clipped(", ".join(f"sampled in other words: '{other}'" for _, other in changed))


def remarks_on_two(
    texts: Sequence[str], block_known: Known | None, known: Known | None, encoder: TextEncoder
) -> list[Remark]:
    """Remarks on the words of two people: who is read to do what, and what neither block nor prior has learned.

    texts: one per segment. block_known: what the block knows; None: no remarks on pairs. known: what
    the prior knows. Raises `MotionloomError` as the encoder does.
    """
    prompts = {text: prompts_of(text) for text in texts if text.strip()}
    alike = [text for text, pair in prompts.items() if pair[0] == pair[1]]
    remarks = []
    for text, pair in prompts.items():
        if MARK not in text and pair[0] != pair[1]:
            remarks.append(Remark(text, clipped(f"read as: '{pair[0]} {MARK} {pair[1]}'")))
        contact = read_contact(pair)
        remarks += [] if contact is None else [Remark(text, f"read as: {contact}")]
    if block_known is not None and alike:
        matches = nearest(block_known, [without_two(text) for text in alike], encoder)
        remarks += [
            Remark(text, f"of two people {one.remark()}", one.sentences)
            for text, one in zip(alike, matches, strict=True)
            if not one.near
        ]
    alone = remarks_on([without_two(one) for pair in prompts.values() for one in pair], known, encoder)
    return remarks + [one for one in alone if one.line != SEVERAL]


def remarks_on(texts: Sequence[str], known: Known | None, encoder: TextEncoder, *, heads: bool = False) -> list[Remark]:
    """Remarks on texts that are not English, and on those that are like nothing in the table of what is known.

    known: None where a weight file has no such table. heads: whether heads are turned as the words say, whatever is
    known. The texts without a remark are left out. Raises `MotionloomError` as the encoder does.
    """
    distinct = [
        text for text in dict.fromkeys(texts) if text.strip() and not (heads and is_of_head(text, *verb_words(text)))
    ]
    english = [text for text in distinct if is_english(text)]
    remarks = [
        Remark(text, f"{text[:50]!r} does not look like English, the one language of these weights")
        for text in distinct
        if text not in english
    ]
    remarks += [
        Remark(text, f"'{match[1]}' is not understood: what it denies may be shown")
        for text in english
        if (match := _DENIED.search(text))
    ]
    remarks += [Remark(text, SEVERAL, ()) for text in [one for one in english if tells_of_several(one)][:1]]
    matches = nearest_known(english, known, encoder) if known else []
    return remarks + [Remark(one.prompt, line, _instead(one)) for one in matches if (line := _unknown(one))]


def _unknown(match: Nearest) -> str:
    rare = rare_verb(match.prompt)
    return match.remark() if not match.near else f"these weights hardly know '{rare}'" if rare else ""


def _instead(match: Nearest) -> tuple[str, ...]:
    plainer = in_plainer_words(match.prompt)
    return match.sentences if plainer == match.prompt else (plainer, *match.sentences)


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
    words = [
        word for word in re.findall(r"[a-z]+(?:-[a-z]+)*", rest) if word not in _FUNCTION and not word.endswith("ly")
    ]
    first, *more = words or [""]
    if stem(first) in _LIGHT:
        return tuple(re.findall("[a-z]+", more[0])[:1]) if more else ()
    return tuple(re.findall("[a-z]+", first)[:1])


# Whether a prompt is English: the weights have read nothing else. By letters (another alphabet), and by the small words
# that every sentence of a language has; where there is nothing to go by a prompt counts as English.

_ENGLISH, _OTHERS, _SMALL = (frozenset(TABLES["languages"][name].split()) for name in ("english", "others", "small"))


def is_english(text: str) -> bool:
    """Whether a prompt can be English; False where its letters or its small words are those of another language."""
    letters = [letter for letter in text if letter.isalpha()]
    latin = sum(unicodedata.name(letter, "").startswith("LATIN") for letter in letters)
    if len(letters) >= 2 and latin < 0.7 * len(letters):
        return False
    words = re.findall(r"[^\W\d_]+", text.lower())
    other = sum(word in _OTHERS for word in words)
    small = sum(word in _SMALL for word in words)
    return not (other and other + small >= 2 and other + small > sum(word in _ENGLISH for word in words))
