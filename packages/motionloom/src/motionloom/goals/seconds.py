"""How long an action takes people, by its kind, its numbers and how quickly it is done (docs/decisions/0036)."""

import math
import re

from motionloom.goals.amounts import read_seconds
from motionloom.goals.numerals import NUMBER, in_digits
from motionloom.goals.verbs import TABLES, base_of, kind_of_verb, word_patterns

_WORDS = word_patterns("seconds")

SHORTEST = 1.2
"""Seconds of the shortest part."""
LONGEST = 12.0
"""Seconds of the longest part by nature; a longer one is requested in numbers."""

_GOES_ON, WHOLE = ("locomotion", "state", "dance"), 5.0
"""What can go on, and what is repeated, does so for `WHOLE` seconds where it is the whole sentence."""
_ON_STAIRS = 4.0
"""People were recorded there for no longer: who goes up for longer in the data climbs a ladder."""
_ONE_FLIGHT = 3.0
WORDS = 5.0
"""Words per second of a long text at most: each tells something."""
_LONGER = (
    (re.compile(r"\b(?:lies?|lay|lying)\b"), 6.0),
    (_FALLS := re.compile(r"\b(?:falls?|fell|falling|trips?|tripping)\b"), 3.5),
    (re.compile(r"\bturn(?:s|ed|ing)? (?:\w+ )?(?:around|round|about|back)\b"), 3.0),
)
"""What takes longer than others of its kind."""
MOST_AT_ONCE = 9.8
"""The longest motion of the recordings that the weights were trained on."""


def natural_seconds(text: str) -> float:
    """How long an action takes people, by its kind, its numbers and how quickly it is done; 1.2 to 12 s."""
    words = re.sub(r"\bseveral\b|\b(?:a )?few\b", "3", in_digits(text))
    if (explicit := read_seconds(text)) is not None:
        return max(explicit, SHORTEST)
    kind = _kind(words)
    seconds = float(TABLES["seconds"][kind])
    if kind in ("change", "event") or _FALLS.search(words):  # "stumbles and falls"
        seconds = next((longer for pattern, longer in _LONGER if pattern.search(words)), seconds)
    if match := re.search(rf"\b(?:{NUMBER}|\w+) (?:small |large |big |slow |quick )?steps\b", words):
        seconds = 1.0 + 0.6 * _count(match[1] or "3")
    elif match := re.search(rf"\b(?:{NUMBER}|[a-z]+) (?:times|reps|repetitions)\b", words):
        number = _count(match[1] or "2")
        quick = kind == "gesture" and _WORDS["quick"].search(words)
        seconds = 2.0 + 0.8 * number if quick else seconds * (0.4 + 0.6 * number)
    elif re.search(r"\b(twice|thrice)\b", words):
        seconds *= 1.6 if "twice" in words else 2.2
    elif match := _WORDS["repeated"].search(words):
        seconds *= 0.4 + 0.6 * _count(match[1])
    if re.search(r"\bin (?:a )?(?:full |big |large |small )?circles?\b", words):
        seconds = max(seconds, 8.0 if kind == "locomotion" else 6.0)
    if re.search(r"\b(slowly|slow|carefully|gently)\b", words):
        seconds *= 1.3
    elif re.search(r"\b(quickly|quick|fast|rapidly|hastily)\b", words):
        seconds *= 0.8
    if match := _WORDS["while"].search(words):
        seconds = max(seconds, 6.0) if match[1] in (None, "long", "good") or match[2] == "time" else seconds
    return round(min(max(seconds, SHORTEST, len(words.split(" ")) / WORDS), LONGEST), 2)


def seconds_alone(text: str) -> float:
    """Seconds of an action that is a whole sentence: `natural_seconds`, but that what can go on does so for 5 s.

    That is walking, dancing, standing and what is repeated, such as jumping jacks; on stairs 4 s.
    """
    goes_on = _kind(text.lower()) in _GOES_ON and not _FALLS.search(text.lower())
    if read_seconds(text) is None and (goes_on or _WORDS["repeats"].search(text)):
        return (
            _ON_STAIRS
            if _WORDS["stairs"].search(text) or _WORDS["on_the_spot"].search(text)
            else max(natural_seconds(text), WHOLE)
        )
    return natural_seconds(text)


def flights(text: str, seconds: float) -> int:
    """In how many parts somebody goes up stairs, or walks in place, for so many seconds; 1 for other words.

    People were recorded there for `_ON_STAIRS` seconds at most, and what is longer hardly rises (docs/decisions/0036).
    """
    up = _WORDS["stairs"].search(text) and not re.search(r"\bdown(?:stairs)?\b|\bdescend", text, re.IGNORECASE)
    return (
        math.ceil(seconds / _ONE_FLIGHT) if (up or _WORDS["on_the_spot"].search(text)) and seconds > _ON_STAIRS else 1
    )


def _kind(words: str) -> str:
    """The kind of the first verb in words of small letters."""
    return next((kind_of_verb(word, words) for word in re.findall(r"[a-z]+", words) if base_of(word)), "other")


def _count(number: str) -> int:
    return int(min(float(number), 1000))
