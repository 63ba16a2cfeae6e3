"""What a prior has learned, in words: a table of training sentences with their text vectors, and seconds per action.

The table answers one question: is anything that was learned near to a prompt? Sentences are compared without their
subject ("a person", "someone is"), because the subject is most of a short sentence and says nothing of the action.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.arrays import unit
from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.core.models.networks.text.quantise import dequantise, quantise

SAME, NEAR, AROUND = 0.75, 0.45, 8
"""A prompt is near to what was learned where the cosine to one sentence is at least `SAME`, or the mean over its
nearest `AROUND` sentences at least `NEAR`: one alone may share no more than a noun with it (figures: docs/words.md)."""
UNKNOWN_VERB = 0.08
"""How much nearer a prompt must be whose verb is in no sentence: "vacuuming" is no cartwheel for the room it is in."""
MOST_SENTENCES = 1500
MAX_SENTENCES, MAX_CHARACTERS, MAX_ACTIONS = 8192, 1000, 8192
"""What is read from a file at most."""

_SUBJECT = re.compile(
    r"^\W*(?:(?:(?:a|an|the|this|one|another|some|two|both)\s+)?"
    r"(?:(?:young|old|tall|small|little|single)\s+)?"
    r"(?:person|persons|man|woman|human|figure|guy|boy|girl|individual|character|stick figure|somebody|someone"
    r"|he|she|they|it|people|men|women|couple|dancers|you|i)\s+)"
    r"(?:(?:is|are|was|were|am|appears to be|seems to be)\s+)?",
    re.IGNORECASE,
)


@dataclass(frozen=True, eq=False)
class Known:
    """Training sentences, what they mean to the text encoder, and how long each action was seen."""

    sentences: tuple[str, ...]
    """As training had them, without subject."""
    vectors: NDArray[np.float32]
    """(sentences, width) of unit length, float32."""
    seconds: Mapping[str, float]
    """Seconds of training motion per action."""

    @cached_property
    def words(self) -> frozenset[str]:
        """The stems of all words in the sentences."""
        return frozenset(stem(word) for sentence in self.sentences for word in re.findall(r"[a-z]+", sentence.lower()))


@dataclass(frozen=True)
class Nearest:
    """A prompt's nearest known sentences, the nearest first."""

    prompt: str
    sentences: tuple[str, ...]
    similarity: float
    """Cosine of the first of them."""
    around: float
    """Mean cosine of the nearest `AROUND` sentences, or of all where there are fewer."""
    verb_known: bool = True
    """Whether the prompt's verb is in any of the sentences."""

    @property
    def near(self) -> bool:
        """Whether anything like the prompt was learned."""
        return self.similarity >= SAME or self.around >= NEAR + (0.0 if self.verb_known else UNKNOWN_VERB)

    def remark(self) -> str:
        """One line for somebody whose prompt is not near to anything."""
        prompt = _short(bare(self.prompt) or self.prompt.strip())
        return one_line(f"these weights have seen nothing like '{prompt}'; nearest: '{_short(self.sentences[0])}'")


def stem(word: str) -> str:
    """A word without the ending that its forms differ in: "walking", "walks" and "walked" are "walk"."""
    endings = ("ing", "ed", "es", "s", "ly", "er")
    ending = next((end for end in endings if word.endswith(end) and len(word) > 2 + len(end)), "")
    short = word.removesuffix(ending)
    return short.rstrip("e") if len(short) > 3 else short


def bare(sentence: str) -> str:
    """A sentence in lower case without its subject: "A person is walking." becomes "walking"."""
    plain = " ".join(sentence.lower().split()).strip(" .!?")
    return _SUBJECT.sub("", plain) or plain


def known_sentences(
    sentences: Sequence[str],
    seconds: Mapping[str, float],
    encoder: TextEncoder,
    *,
    first: Sequence[str] = (),
    most: int = MOST_SENTENCES,
) -> Known:
    """A table of at most ``most`` of the training sentences, chosen so that every other one is near to a chosen one.

    sentences: of training, with or without subjects. seconds: of motion per action. first: sentences that are in the
    table in any case, such as one per action. Then come, one after the other, those that are furthest from all chosen
    ones (farthest-first traversal, Gonzalez 1985). Raises `MotionloomError` where there is no sentence.
    """
    sure = list(dict.fromkeys(bare(sentence)[:MAX_CHARACTERS] for sentence in first if sentence.strip()))[:most]
    plain = list(dict.fromkeys([*sure, *(bare(s)[:MAX_CHARACTERS] for s in sentences if s.strip())]))
    if not plain:
        raise MotionloomError("there is no training sentence; a table of what is known needs at least one")
    vectors = np.concatenate([encoder.encode(plain[i : i + 256]).pooled for i in range(0, len(plain), 256)])
    vectors = unit(vectors)
    chosen = sorted(_farthest_first(vectors, max(len(sure), 1), most))
    return Known(tuple(plain[i] for i in chosen), vectors[chosen], dict(seconds))


def nearest(
    known: Known, prompts: Sequence[str], encoder: TextEncoder, *, verbs: Sequence[Sequence[str]] = (), count: int = 3
) -> list[Nearest]:
    """For each prompt its ``count`` nearest known sentences.

    verbs: of each prompt the words that say what is done, all of which should be known; left out: not looked at. Raises
    `MotionloomError` as the encoder does.
    """
    if not prompts:
        return []
    vectors = unit(encoder.encode([bare(p) for p in prompts]).pooled)
    similar = vectors @ known.vectors.T
    places = np.argsort(-similar, axis=1, kind="stable")
    similar = np.take_along_axis(similar, places, axis=1)
    verbs_known = [all(stem(word) in known.words for word in words) for words in verbs] or [True] * len(prompts)
    return [
        Nearest(prompt, tuple(known.sentences[i] for i in row), float(values[0]), float(values[:AROUND].mean()), one)
        for prompt, row, values, one in zip(prompts, places[:, :count].tolist(), similar, verbs_known, strict=True)
    ]


def add_sentences(known: Known, sentences: Sequence[str], encoder: TextEncoder) -> Known:
    """The table with some more sentences, such as those of an adapter."""
    more = known_sentences(sentences, {}, encoder)
    return Known((*known.sentences, *more.sentences), np.concatenate([known.vectors, more.vectors]), known.seconds)


def _farthest_first(vectors: NDArray[np.float32], sure: int, most: int) -> list[int]:
    """Places of at most ``most`` vectors, the first ``sure`` of them in any case."""
    chosen = list(range(sure))
    distance = 1 - (vectors @ vectors[:sure].T).max(axis=1)
    while len(chosen) < min(most, len(vectors)):
        place = int(distance.argmax())
        if distance[place] < 1e-6:  # the rest means the same
            break
        chosen.append(place)
        distance = np.minimum(distance, 1 - vectors @ vectors[place])
    return chosen


def _short(text: str) -> str:
    return text if len(text) <= 24 else text[:21] + "..."


# In a weight file: int8 vectors with a scale each, and plain data


def pack_known(known: Known) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Tensors ``known.vectors`` (int8) and ``known.scale`` (float16), and what goes into the file's description."""
    values, scale = quantise(known.vectors)
    seconds = {name: round(float(count), 1) for name, count in known.seconds.items()}
    return {"known.vectors": values, "known.scale": scale}, {"sentences": list(known.sentences), "seconds": seconds}


def unpack_known(tensors: Mapping[str, np.ndarray], about: Any, *, width: int) -> Known:
    """The inverse of `pack_known`. Raises ValueError for what is damaged, too large or of another text encoder."""
    if not isinstance(about, dict) or not isinstance(about.get("sentences"), list):
        raise ValueError("its table of known sentences has no sentences")
    sentences, seconds = about["sentences"], _durations(about.get("seconds", {}))
    if not 0 < len(sentences) <= MAX_SENTENCES or not all(
        isinstance(text, str) and len(text) <= MAX_CHARACTERS for text in sentences
    ):
        raise ValueError(f"its table of known sentences holds something else, or more than {MAX_SENTENCES}")
    values, scale = tensors.get("known.vectors"), tensors.get("known.scale")
    if values is None or scale is None or values.dtype != np.int8 or scale.dtype != np.float16:
        raise ValueError("its table of known sentences lacks its vectors")
    if values.shape != (len(sentences), width) or scale.shape != (len(sentences),) or not np.isfinite(scale).all():
        raise ValueError(f"its table of known sentences has vectors of shape {tuple(values.shape)}")
    vectors = unit(dequantise(values, scale))
    return Known(tuple(sentences), vectors, seconds)


def _durations(seconds: Any) -> dict[str, float]:
    """Seconds of each action, checked; raises ValueError."""
    if (
        not isinstance(seconds, dict)
        or len(seconds) > MAX_ACTIONS
        or not all(isinstance(count, int | float) and 0 <= count < 1e9 for count in seconds.values())
        or not all(len(action) <= MAX_CHARACTERS for action in seconds)
    ):
        raise ValueError("its table of known actions does not hold seconds")
    return {str(action): float(count) for action, count in seconds.items()}
