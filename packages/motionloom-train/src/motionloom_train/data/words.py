"""Captions: mirrored, in everyday words, from index descriptions and from what a window measurably shows."""

import re
from collections.abc import Callable, Sequence

import numpy as np

from motionloom.core.reading import read_table

_SWAPS = {
    "left": "right",
    "right": "left",
    "clockwise": "counterclockwise",
    "counterclockwise": "clockwise",
    "anticlockwise": "clockwise",
}
_SIDE = re.compile(
    r"\b(?:(?:left|right)(?=(?:wards?|most|y|ies)?\b)|counter[- ]?clockwise\b|anti[- ]?clockwise\b|clockwise\b)",
    re.IGNORECASE,
)

MAX_CAPTION = 2_000
"""Characters of a caption; the longest of HumanML3D has 897."""


def check_caption(text: str) -> None:
    """Raises ValueError for a text that is too long for a caption."""
    if len(text) > MAX_CAPTION:
        raise ValueError(f"a caption has {len(text):,} characters; at most {MAX_CAPTION:,} are read")


def mirror_text(text: str) -> str:
    """Left and right, clockwise and counterclockwise exchanged: the caption of the mirrored motion."""

    def swap(match: re.Match[str]) -> str:
        word = match.group(0).lower().replace("-", "").replace(" ", "")
        other = _SWAPS[word]
        return other.capitalize() if match.group(0)[0].isupper() else other

    return _SIDE.sub(swap, text)


_WORDS = read_table("motionloom_train.data", "phrases.toml")
LABELS: dict[str, tuple[str, ...]] = {label: tuple(verbs) for label, verbs in _WORDS["labels"].items()}
"""Verb phrases for what a window measurably shows; see `data.windows`."""
PEOPLE: list[str] = _WORDS["people"]
"""Who does it; each as often as it is drawn."""
STATES, POSTURES = tuple(_WORDS["states"]), tuple(_WORDS["postures"])
"""Labels that stay true however long a window is; actions that end in a posture which people keep."""
EVENTS: dict[str, str] = _WORDS["events"]
"""Labels of what happens at one moment, and patterns of how captions speak of it."""


def sentence(verb_phrase: str, rng: np.random.Generator) -> str:
    """Put a subject before a verb phrase in the third person, or make a command, a gerund or "who is ...ing" of it."""
    form, who = rng.random(), PEOPLE[rng.integers(len(PEOPLE))]
    if form < 0.12 and not verb_phrase.startswith("is "):
        return imperative(verb_phrase)
    if form < 0.28:
        return gerund(verb_phrase)
    return f"{who} is {gerund(verb_phrase)}" if form < 0.4 else f"{who} {verb_phrase}"


def imperative(verb_phrase: str) -> str:
    """'walks forward' to 'walk forward'; verbs after 'and' or 'then' follow."""
    return _with_verbs(_base, verb_phrase)


def gerund(verb_phrase: str) -> str:
    """'sits down and waves' to 'sitting down and waving'; 'is walking' to 'walking'."""
    return _with_verbs(_ing, verb_phrase.removeprefix("is ") if re.match(r"is \w+ing\b", verb_phrase) else verb_phrase)


def _with_verbs(form: Callable[[str], str], verb_phrase: str) -> str:
    words = verb_phrase.split(" ")
    opens = [True, *(w in ("and", "then") or w.endswith(",") for w in words[:-1])]
    ends = [len(w.rstrip(",")) > 1 and w.rstrip(",").endswith("s") for w in words]  # a lone s is no verb
    verbs = [first and end and w not in _NO_VERBS for w, first, end in zip(words, opens, ends)]
    return " ".join(form(w.rstrip(",")) + "," * w.endswith(",") if verb else w for w, verb in zip(words, verbs))


def _base(word: str) -> str:
    if word in _WORDS["irregular"]:
        return _WORDS["irregular"][word]
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-2] if re.search(r"(ch|sh|ss|x)es$", word) else word[:-1]


def _ing(word: str) -> str:
    base = _base(word)
    if base.endswith("ie"):
        return base[:-2] + "ying"
    if base.endswith("e") and not base.endswith(("ee", "oe")) and base != "be":
        return base[:-1] + "ing"
    return base + base[-1] * (base in _DOUBLED) + "ing"


_DOUBLED = frozenset(_WORDS["doubled"])
_NO_VERBS = {"arms", "forwards", "hands", "knees", "legs", "sideways"}
"""What ends with s behind "and" and is no verb."""


def describe_index(description: str) -> tuple[str, ...]:
    """Verb phrases in everyday words for a description of the pack's index; empty where none is known."""
    lowered = description.lower()
    verbs = next((tuple(row) for key, row in _WORDS["index"].items() if key in lowered), ())
    styles = _WORDS["styles"].items()
    style = next((word for key, word in styles if f"{key} style" in lowered or f"({key})" in lowered), None)
    return verbs if style is None else (*verbs, *(f"{phrase} {style}" for phrase in verbs))


def phrases(label: str) -> Sequence[str]:
    """The wordings of a measured label; two labels joined by '+' happen at once."""
    if "+" not in label:
        return LABELS[label]
    first, second = label.split("+", 1)
    return [f"{a} and {b}" for a in LABELS[first][:4] for b in LABELS[second][:5]]
