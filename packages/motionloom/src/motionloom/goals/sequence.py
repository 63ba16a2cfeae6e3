"""One sentence of several actions as segments, one after the other: "walks, turns around and sits down".

Plain text work by written rules; docs/words.md explains them with examples. In short:

- "then", "and then", "afterwards", "after that", ";" and full stops part what follows each other;
- "A before B" is A, then B; "before B, A" as well; "A after B" and "after B, A" are B, then A;
- of verbs in a list, three or more follow each other, and so do two with nothing but a comma between them;
- of two verbs joined by "and" the kinds decide (`_follows`): a change of posture follows or is followed by what stands
  beside it, a gesture goes along with walking. Where nothing says otherwise the sentence stays whole.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from motionloom.goals.amounts import read_amount, read_seconds
from motionloom.goals.ellipsis import SQUATS, STAYS, WALKS, form_of, in_base, repeat_cycles, resolve_ellipsis
from motionloom.goals.seconds import LONGEST, MOST_AT_ONCE, SHORTEST, natural_seconds, seconds_alone
from motionloom.goals.verbs import (
    MOODS,
    NOUNS_AFTER,
    PRONOUN,
    TABLES,
    finite,
    kind_of,
    mood_of,
    subject_of,
    verb_of,
    word_patterns,
)

_WORDS = word_patterns("sequence")

MOST_PARTS = 20
MOST_WORDS = 400
"""Words of a text up to which it is parted."""
_AGAIN = 0.5
"""Share of its time that a gesture takes which is repeated with its reverse."""


@dataclass(frozen=True)
class Part:
    """An action and how long it takes."""

    text: str
    seconds: float


_SHORTENED = re.compile(
    r"\b(Mr|Mrs|Ms|Dr|Prof|St|Sgt|Capt|Lt|Col|Gen|Jr|Sr|vs|etc|approx|ca|resp|fig|[A-Z]|[eE]\.g|[iI]\.e|[ap]\.m)\.(?= )"
)
"""Words that end in a dot where no sentence ends."""
_POSTURES = {"sit": "sit", "lie": "lie", "lay": "lie", "kneel": "kneel", "crouch": "crouch", "squat": "crouch"}
"""Verbs of who ends up low, and of who is: the weights know nobody who stays in a squat."""


def split_actions(text: str) -> tuple[Part, ...]:
    """The actions of a sentence that follow each other, each a sentence of its own with the seconds it takes.

    One part, the text as it is, where the sentence says one thing or things at once; at most `MOST_PARTS`, else it is
    left whole too.
    """
    if text.count(" ") > MOST_WORDS:
        return (Part(text, natural_seconds(text)),)
    whole = _prepared(" ".join(text.split()).rstrip(" .;,"))
    clauses = [clause for sentence in _split_by_time(whole) for clause in _split_by_then(sentence)]
    if len(clauses) > 1:
        clauses[0] = re.sub(r"^first,? (?=\w+ \w)|,? first$", "", clauses[0], flags=re.IGNORECASE)
    subject = subject_of(clauses[0]) if clauses else ""
    parts: list[str] = []
    for number, clause in enumerate(clauses):
        own = subject_of(clause)
        words = clause if not own or number == 0 else PRONOUN.sub("", clause)
        if own.lower() == "they" and words != clause and mood_of(clauses[0]) == "third":
            words = finite(words, of="base")  # "a person walks. Then they kick."
        own = own if words == clause else ""
        named = own or subject
        rest = words[len(own) :].strip()
        lasting = re.sub(r"^(?:is|are|was|were) (?=\w+ing\b)", "", rest)
        if verb_of(lasting, "gerund"):
            rest = lasting if lasting != rest or not own else finite(rest)
        if not named and mood_of(rest) == "gerund":
            named = "a person"
        # "a guard who walks and stops is bored"; a run-up belongs to what it is for
        whole_clause = _WORDS["subordinate"].search(named) or re.search(r"\brun-?up\b", rest, re.IGNORECASE)
        items = [rest] if whole_clause else _split_list(rest)
        parts += [_sentence(named, finite(item)) for item in items]
    if len(parts) > 2 * MOST_PARTS:
        return (Part(text, natural_seconds(text)),)
    cycles = repeat_cycles(parts, MOST_PARTS)
    parts = cycles or resolve_ellipsis(parts)
    if not 1 < len(parts) <= MOST_PARTS:
        return (Part(text, natural_seconds(text)),)
    last = len(parts) - 1
    seconds = [_part_seconds(part) if i < last else natural_seconds(part) for i, part in enumerate(parts)]
    for i, part in enumerate(parts):  # who does so again and again holds nothing
        if (cycles or parts.count(part) > 2) and kind_of(part, mood_of(part)) == "gesture":
            seconds[i] *= _AGAIN
    rested = _merge_rests([Part(*both) for both in zip(_keep_postures(parts), seconds, strict=True)])
    return tuple(rested) if len(rested) > 1 else (Part(text, rested[0].seconds),)


def _prepared(text: str) -> str:
    """The text without a label before it ("victory emote: ..."), and with verbs for what only sounds like nouns."""
    text = _WORDS["sidesteps"].sub(r"\1 sidesteps", _WORDS["label"].sub("", _SHORTENED.sub(r"\1", text)))
    return _WORDS["stops_to"].sub(lambda match: f"{match[1]}, {_form_as(match[1], match[2])}", text)


def _form_as(stops: str, base: str) -> str:
    """The verb in the form of "stops", "stop" or "stopped"."""
    return form_of(base, mood_of(stops) or "third")


def _merge_rests(parts: Sequence[Part]) -> list[Part]:
    """Parts in which a posture lasts as long as the rest that follows it: "sits down and waits"."""
    result: list[Part] = []
    for part in parts:
        rest = part.text.removeprefix(subject_of(part.text)).strip()
        before = _first_verb(result[-1].text) if result else ""
        moves = before in WALKS and not SQUATS.search(result[-1].text) if result else True
        if (_WORDS["lasts"].match(rest) and before in _POSTURES) or (STAYS.match(in_base(rest)) and not moves):
            both = result[-1].seconds + part.seconds
            result[-1] = Part(result[-1].text, both if read_seconds(part.text) else min(both, LONGEST))
        else:
            result.append(part)
    return result


def _first_verb(part: str) -> str:
    rest = part.removeprefix(subject_of(part)).strip()
    return verb_of(rest, mood_of(rest))


def _keep_postures(parts: Sequence[str]) -> list[str]:
    """Parts in which who sat, lay or knelt down does so while gesturing: "sits down, waves" as "... sits and waves"."""
    result, posture, place = [], "", ""
    for part in parts:
        named = subject_of(part)
        rest = part.removeprefix(named).strip()
        mood, verb = mood_of(rest), _first_verb(part)
        if STAYS.match(in_base(rest)):
            pass
        elif verb in _POSTURES or _WORDS["down"].fullmatch(in_base(rest)):
            posture = _POSTURES.get(verb, "kneel" if "knee" in rest else "sit")
            where = _WORDS["where_low"].search(rest)
            place = f" {where[0]}" if where and posture in ("sit", "lie") else ""
        elif posture and (kind_of(part, mood) == "gesture" or verb == "lean" or _WORDS["head_or_hands"].match(rest)):
            part = f"{named} {form_of(posture, mood)}{place} and {rest}".strip()
        elif not _WORDS["waits"].match(rest):
            posture = ""
        result.append(part)
    return result


def lengths(parts: Sequence[Part], seconds: float | None = None, *, fps: float = 20.0) -> list[float]:
    """Seconds of each part, in whole frames; together ``seconds`` where that is given, shared as their own lengths are.

    No part gets less than `SHORTEST`, unless all of them do.
    """
    natural = [part.seconds for part in parts]
    if seconds is None:
        return [max(1, round(length * fps)) / fps for length in natural]
    least = min(SHORTEST, seconds / len(parts))
    free = seconds - least * len(parts)
    room = [max(length - least, 1e-9) for length in natural]
    ends, total = [], 0.0
    for extra in room:
        total += least + free * extra / sum(room)
        ends.append(round(total * fps))
    return [(end - begin) / fps for begin, end in zip([0, *ends], ends, strict=False)]


def usual_seconds(text: str) -> float:
    """Seconds of a whole sentence without a length: what all of its actions take, `MOST_AT_ONCE` at most.

    What can go on or is repeated goes on for longer where it is all there is (`seconds.seconds_alone`).
    """
    parts = split_actions(text)
    return seconds_alone(text) if len(parts) == 1 else min(sum(part.seconds for part in parts), MOST_AT_ONCE)


def _part_seconds(part: str) -> float:
    """How long a part takes behind which another comes: who stops to do something stops briefly."""
    rest = part.removeprefix(subject_of(part)).strip()
    stops = verb_of(rest, mood_of(rest)) in ("stop", "halt", "pause", "freeze") and " for " not in rest
    return 1.5 if stops else natural_seconds(part)


# Clauses


def _split_by_time(text: str) -> list[str]:
    """Clauses joined by "before" and "after", in the order in which they happen."""
    if match := re.match(r"(before|after)\s+([^,]+?)\s*,\s*(.+)$", text, re.IGNORECASE):
        inner, main = match[2], match[3]
        if _is_clause(inner):
            order = [main, inner] if match[1].lower() == "before" else [inner, main]
            return [clause for one in _with_subject(order, main) for clause in _split_by_time(one)]
    for match in re.finditer(r"\s*,?\s+(before|after)\s+", text, re.IGNORECASE):
        main, inner = text[: match.start()], text[match.end() :]
        if _is_clause(inner) and main.strip() and not main.endswith(" and"):
            inner = _with_subject([inner], main)[0]
            order = [main, inner] if match[1].lower() == "before" else [inner, main]
            return [order[0], *_split_by_time(order[1])] if match[1].lower() == "before" else order
    return [text]


def _with_subject(clauses: list[str], main: str) -> list[str]:
    """Clauses with the subject of ``main`` where they have none or a pronoun, their verbs finite as there."""
    subject, mood = subject_of(main), mood_of(main)
    result = []
    for clause in clauses:
        rest = PRONOUN.sub("", clause)
        result.append(
            clause if clause == main else _sentence(subject, finite(rest, mood)) if subject else finite(rest, mood)
        )
    return result


def _split_by_then(text: str) -> list[str]:
    """Clauses parted by "then" and its like."""
    exempt = [(match.start(), match.end()) for match in _WORDS["no_separator"].finditer(text)]
    cuts = [
        match
        for match in _WORDS["then"].finditer(text)
        if not any(begin < match.end() and match.start() < end for begin, end in exempt)
    ]
    pieces, at = [], 0
    for cut in cuts:
        pieces.append(text[at : cut.start()])
        at = cut.end()
    pieces.append(text[at:])
    clauses = [re.sub(r"^(?:and|then)\s+", "", piece.strip(" ,.;"), flags=re.I).strip() for piece in pieces]
    return [clause for clause in clauses if clause]


def _split_list(clause: str) -> list[str]:
    """The items of a list of verbs, if they follow each other; else the clause alone."""
    if _WORDS["at_once"].search(clause) or not clause:
        return [clause] if clause else []
    tokens = _WORDS["join"].split(clause)
    items, joins = [tokens[0]], []
    mood = mood_of(tokens[0])
    for join, piece in zip(tokens[1::2], tokens[2::2], strict=True):
        piece = PRONOUN.sub("", piece)
        thing = mood != "base" and _is_thing(items[-1], join)  # "do squats and lunges" has no second verb
        if mood and verb_of(piece, mood) and not thing and not _is_subordinate(items[-1], join, piece):
            items.append(piece)
            joins.append(join)
        else:
            items[-1] += join + piece
    if len(items) < 2 or (len(items) == 2 and _WORDS["comes_up"].match(in_base(items[1])) and read_amount(clause)):
        return [clause]
    if len(items) > 2:
        return items
    comma = mood != "gerund" and not re.search(r"\band\b", joins[0], re.IGNORECASE)
    kinds = kind_of(items[0], mood), kind_of(items[1], mood)
    amounts = [read_amount(item) for item in items]
    counted = any(one and (one.kind == "turn" or "gesture" not in kinds) for one in amounts)
    waits = kinds[0] == "state" and bool(_WORDS["waits"].match(items[1]))  # "stands there and waits"
    verbs = verb_of(items[0], mood), verb_of(items[1], mood)
    together = not comma and any(verbs[0] in one["first"] and verbs[1] in one["second"] for one in TABLES["together"])
    return items if comma or counted or (_follows(*kinds) and not waits and not together) else [clause]


def _follows(first: str, second: str) -> bool:
    """Whether of two verbs joined by "and" the second happens after the first, by their kinds."""
    if "change" in (first, second) or second == "state":
        return True
    if {"dance", "other"} & {first, second}:
        return False
    both = {first, second}
    if "gesture" in both:
        return "event" in both
    if first == "turn" or second == "turn":
        return first == "turn"
    return both != {"fight"}


# Words


def _sentence(subject: str, action: str) -> str:
    return f"{subject} {action}".strip()


def _is_clause(phrase: str) -> bool:
    """Whether the person does something in a phrase: it begins with a gerund, or with a pronoun and a verb."""
    if verb_of(phrase, "gerund"):
        return True
    subject = subject_of(phrase)
    if mood_of(phrase) == "base" and not re.match(r"(?:they|we|you|i)\b", phrase, re.IGNORECASE):
        return False  # "after a long march", "before the big jump"
    if not PRONOUN.match(phrase) or re.match(r"(?:it|this|that)\b", phrase, re.IGNORECASE):
        return False  # "after the music stops", "before it gets dark", "after that"
    return bool(subject) and bool(mood_of(phrase)) and bool(verb_of(phrase[len(subject) :].strip(), mood_of(phrase)))


def _is_thing(item: str, join: str) -> bool:
    """Whether what follows is one more thing that somebody does, throws ...: "does squats and lunges"."""
    rest = item[len(subject_of(item)) :].strip()
    base = next((verb_of(rest, mood) for mood in MOODS if verb_of(rest, mood)), "")
    return base in NOUNS_AFTER and "," not in join and bool(re.search(r"\w+s$", item)) and len(rest.split(" ")) <= 4


def _is_subordinate(item: str, join: str, piece: str) -> bool:
    """Whether what follows is of the clause of time, place or reason before, or the end of counted steps."""
    if _WORDS["counted"].search(item) and _WORDS["stops"].fullmatch(piece.strip()):
        return True
    return "," not in join and bool(_WORDS["subordinate"].search(item))
