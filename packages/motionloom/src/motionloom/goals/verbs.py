"""Verbs in the words of prompts: their forms, what kind of action each names, who does it, and what they deny."""

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from motionloom.core.reading import read_table

TABLES: dict[str, Any] = read_table("motionloom.goals", "verbs.toml")
"""What is known of words, by kind."""

NOUNS_AFTER = {"do", "make", "perform", "throw", "take", "give", "practice", "play"}
"""Verbs behind which "kicks and punches" are things."""
_SUBJECT_WORDS = (
    r"(?:a|an|the|this|that|one|another|some|somebody|someone|he|she|they|it|i|you|we|person|man|woman|figure)"
)
PRONOUN = re.compile(
    r"^(?:he|she|they|it|(?:the|this|that) (?:person|man|woman|figure|guy|boy|girl|character|human))\s+", re.IGNORECASE
)
_ADVERB = r"(?:(?:\w+ly|then|again|suddenly|once|twice|just|also|first|finally|soon)\s+)*"


def _forms(*bases: str) -> dict[str, dict[str, str]]:
    """Of each mood ("third", "base", "past", "gerund") the forms with their base."""
    moods: dict[str, dict[str, str]] = {"third": {}, "base": {}, "past": {}, "gerund": {}}
    for base in bases:
        moods["third"][_third(base)] = base
        moods["base"][base] = base
        stem = base + base[-1] if base in TABLES["doubled"] else base
        past = f"{stem[:-1]}ied" if stem.endswith("y") and stem[-2] not in "aeo" else f"{stem.removesuffix('e')}ed"
        moods["past"][TABLES["past"].get(base, past)] = base
        moods["gerund"]["lying" if base == "lie" else _gerund(stem)] = base
    return moods


def _third(base: str) -> str:
    if base.endswith("y") and base[-2] not in "aeo":
        return base[:-1] + "ies"
    return base + ("es" if re.search(r"(s|sh|ch|x|o|z)$", base) else "s")


def _gerund(stem: str) -> str:
    return (stem[:-1] if stem.endswith("e") and not stem.endswith("ee") else stem) + "ing"


PLAINER: dict[str, str] = TABLES["plainer"]
"""Bases of rare verbs, each with the base of a common one and what belongs to it: "walk slowly"."""
MOODS = _forms(*(base for words in TABLES["kinds"].values() for base in words), *PLAINER)
_FORMS = {form for forms in MOODS.values() for form in forms}
_ADVERBS = {"then", "again", "once", "twice", "just", "also", "first", "finally", "soon", "next", "and", "but", "now"}
_KINDS = {base: kind for kind, words in reversed(TABLES["kinds"].items()) for base in words}
_KINDS |= {base: _KINDS[plain.split(" ")[0]] for base, plain in PLAINER.items() if base not in _KINDS}


def subject_of(clause: str) -> str:
    """The words before the first verb: "a tall man" of "a tall man walks"; empty for a bare verb."""
    words = clause.split(" ", 8)
    if len(words) > 1 and re.fullmatch(r"(?:Mr|Mrs|Ms|Dr|Prof|Sir|Lady)\.?", words[0]):
        return " ".join(words[:2])
    if is_name(words):  # "Chuck waves"
        return words[0]
    for count, word in enumerate(words[:7]):
        plain = word.strip(",").lower()
        if count == 0 and not re.fullmatch(_SUBJECT_WORDS, plain):
            named = len(words) > 1 and words[1] in MOODS["third"] and plain not in _FORMS and not plain.endswith("ly")
            return word if named and plain not in _ADVERBS else ""  # "grandpa walks"
        if count and (plain in ("is", "are", "was", "were") or plain in MOODS["third"] or plain in MOODS["past"]):
            before = words[:count]
            while len(before) > 1 and re.fullmatch(r"\w+ly|then", before[-1]):
                before = before[:-1]
            return " ".join(before)
    if re.fullmatch(r"someone|somebody|he|she|they", words[0], re.IGNORECASE):
        return words[0]
    return " ".join(words[:2]) if len(words) > 2 and re.fullmatch(r"a|an|the", words[0], re.IGNORECASE) else ""


def is_name(words: list[str]) -> bool:
    """Whether the first of some words, a verb in small letters, is a name here: "Pat claps"."""
    return (
        len(words) > 1
        and words[0][:1].isupper()
        and words[0].lower() in MOODS["base"]
        and (words[1] in MOODS["third"] and words[1] not in MOODS["base"])
    )


def mood_of(clause: str) -> str:
    """The mood of a clause's first verb; empty where none is known."""
    rest = clause[len(subject_of(clause)) :].strip()
    return next((mood for mood in ("third", "base", "past", "gerund") if verb_of(rest, mood)), "")


def verb_of(phrase: str, mood: str) -> str:
    """The verb that a phrase begins with, adverbs aside, as its base; empty if it is none of that mood."""
    match = re.match(rf"\s*{_ADVERB}([A-Za-z]+)", phrase, re.IGNORECASE)
    return MOODS[mood].get(match[1].lower(), "") if match and mood else ""


def base_of(word: str) -> str:
    """The base of a form of any mood; empty for a word that is none."""
    return next((forms[word] for forms in MOODS.values() if word in forms), "")


def finite(phrase: str, mood: str = "third", *, of: str = "gerund") -> str:
    """A phrase that begins with a gerund, or a verb of another mood, in the mood: "sitting down" as "sits down"."""
    base = verb_of(phrase, of)
    if not base:
        return phrase
    form = next(inflected for inflected, stem in MOODS[mood or "third"].items() if stem == base)
    return re.sub(rf"^(\s*{_ADVERB})[A-Za-z]+", rf"\g<1>{form}", phrase, count=1, flags=re.IGNORECASE)


def kind_of(item: str, mood: str) -> str:
    """The kind of the verb in the mood that an item begins with behind its subject."""
    rest = item[len(subject_of(item)) :].strip()
    return kind_of_verb(verb_of(rest, mood), rest.lower())


def kind_of_verb(word: str, phrase: str) -> str:
    """The kind of action that a verb names in a ``phrase``: sitting down is a change, sitting a state."""
    base = base_of(word) or word
    changed = TABLES["changed_by"].get(base)
    if changed and re.search(changed[1], phrase):
        return changed[0]
    return _KINDS.get(base, "other")


_DETERMINERS, _SIZES = TABLES["places"]["<det>"], TABLES["places"]["<size>"]


def words_pattern(pattern: str) -> re.Pattern[str]:
    """A pattern of ``verbs.toml`` with what stands for words in it, in any case of letters."""
    gerunds = "|".join(sorted(MOODS["gerund"], key=len, reverse=True))
    for name, words in (TABLES["places"] | {"<gerund>": f"(?:{gerunds})"}).items():
        pattern = pattern.replace(name, words)
    return re.compile(pattern, re.IGNORECASE)


def word_patterns(part: str) -> dict[str, re.Pattern[str]]:
    """The patterns of one module in ``verbs.toml``, by name."""
    return {name: words_pattern(pattern) for name, pattern in TABLES["patterns"][part].items()}


_BARRED = tuple(words_pattern(pattern) for group in TABLES["barred"].values() for pattern in group)
_CLAUSES = [words_pattern(pattern) for pattern in TABLES["barred"]["clauses"]]
FALL_WAYS = {name: (words_pattern(way[0]), (way[1], way[2])) for name, way in TABLES["fall_ways"].items()}
"""Ways of falling, each with its words, and how far ahead and to the left the neck goes."""


@lru_cache(4096)
def asserted(text: str) -> str:
    """The words of one action, in small letters, of which something may be expected: "stands and does not turn" as
    "stands and".

    Left out is what is denied or only intended, what somebody else does, clauses of time and reason, and what is done
    to a thing; patterns in ``verbs.toml``.
    """
    plain = " ".join(text.lower().split())
    subject = subject_of(" ".join(text.split())).lower()
    before, rest = plain[: len(subject)], plain[len(subject) :]
    if any(pattern.search(before + " ") for pattern in _BARRED[:4]) or re.search(rf"\w {_DETERMINERS}", before + " "):
        before, rest = "", plain
    for pattern in _BARRED:
        rest = pattern.sub(lambda match: f" {match[1]}" if match.re.groups else " ", rest)
    return " ".join(f"{before}{rest}".split())


_NAMED = re.compile(r"\b(?:an?|the|this|that|one|his|her|its|their|my|your|of|on|in|at|with) $", re.IGNORECASE)
_OF_THE_BODY = re.compile(r"\b(?:arm|leg|shoulder|hand|back|head|body|knee|spine|chest|torso)s? $", re.IGNORECASE)


def _is_verb(mood: str, before: str) -> bool:
    """Whether a form of that mood is a verb behind those words, rather than a noun."""
    if mood == "base" and not re.search(r"(?:^|[.,;]|\bto|\bthen|\band)\s*$", before, re.IGNORECASE):
        return False
    if mood == "past" and _OF_THE_BODY.search(before):  # "shoulders slumped"
        return False
    return not _NAMED.search(before)


def _has_object(phrase: str, behind: str) -> bool:
    """Whether something is done to a thing: a determiner is behind a phrase that ends in no preposition."""
    ends_open = re.search(r"\b(?:to|into|inside|over|through|along|towards?|for|of|on|off|out)$", phrase)
    return not ends_open and bool(re.match(rf" {_DETERMINERS} (?!{_SIZES})|[ -]?,? \w+'s\b", behind, re.IGNORECASE))


@dataclass(frozen=True)
class _Phrase:
    """A phrase with a verb in any form, and what stands for it."""

    pattern: re.Pattern[str]
    better: str
    moods: dict[str, str]
    """Forms of the verb, each with its mood; empty: there is no verb."""
    plain: dict[str, str]
    """Moods, each with the form of the verb that replaces it."""

    @staticmethod
    def of(pattern: str, better: str) -> "_Phrase":
        """From a line of the table."""
        verb, plain = re.match(r"\{(\w+)\}", pattern), re.match(r"\{(\w+)\}", better)
        if not verb or not plain:
            return _Phrase(re.compile(pattern, re.IGNORECASE), better, {}, {})
        moods = {form: mood for mood, forms in _forms(verb[1]).items() for form in forms}
        forms = {mood: next(iter(forms)) for mood, forms in _forms(plain[1]).items()}
        pattern = rf"\b({'|'.join(moods)}){pattern[verb.end() :]}"
        return _Phrase(re.compile(pattern, re.IGNORECASE), better[plain.end() :], moods, forms)

    def replaced(self, text: str) -> str:
        """The text with what stands for the phrase."""

        def better(match: re.Match[str]) -> str:
            if not self.moods:
                return match.expand(self.better)
            mood = self.moods[match[1].lower()]
            if not _is_verb(mood, text[: match.start()]) or _has_object(match[0], text[match.end() :]):
                return match[0]
            form = self.plain[mood]
            return (form.capitalize() if match[1][0].isupper() else form) + match.expand(self.better)

        return self.pattern.sub(better, text)


PHRASES = tuple(_Phrase.of(*line) for line in TABLES["phrases"].items())


def rare_verb(text: str) -> str:
    """The first verb in a text that is in `PLAINER`, in its form there; empty without."""
    return next((word for word in re.findall("[A-Za-z]+", text) if base_of(word.lower()) in PLAINER), "")


def in_plainer_words(text: str) -> str:
    """A sentence with the nearest common verb for each rare one, "a soldier trudges home" as "a soldier walks home",
    and with phrases that are read well for some that are not: "pulls the knee up" as "lifts the knee up".

    A form that can be a noun ("on patrol") counts as a verb unless a determiner or preposition is before it; a base
    form only where a sentence begins with it or behind "to". Words of which a part is not `asserted`, and verbs with an
    object, stay as they are.
    """
    end = min((match.start() for one in _CLAUSES if (match := one.search(text))), default=len(text))
    text, behind = text[:end], text[end:]
    if asserted(text) != " ".join(text.lower().split()):
        return text + behind

    def common(match: re.Match[str]) -> str:
        word = match[0]
        mood = next((mood for mood, forms in MOODS.items() if forms.get(word.lower()) in PLAINER), "")
        before = text[: match.start()]
        if (
            not mood
            or not _is_verb(mood, before)
            or _has_object(word, text[match.end() :])
            or word[1:] != word[1:].lower()
        ):
            return word
        verb, _, rest = PLAINER[MOODS[mood][word.lower()]].partition(" ")
        form = next(inflected for inflected, base in MOODS[mood].items() if base == verb)
        form = form.capitalize() if word[0].isupper() else form
        if rest and re.match(rf"\W*{rest}\b", text[match.end() :], re.IGNORECASE):
            return form
        return f"{form} {rest}" if rest else form

    for phrase in PHRASES:
        text = phrase.replaced(text)
    return re.sub(r"[A-Za-z]+", common, text) + behind
