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
from motionloom.goals.seconds import LONGEST, MOST_AT_ONCE, SHORTEST, natural_seconds, seconds_alone
from motionloom.goals.verbs import (
    MOODS,
    NOUNS_AFTER,
    PRONOUN,
    base_of,
    finite,
    kind_of,
    mood_of,
    subject_of,
    verb_of,
)

MOST_PARTS = 20


@dataclass(frozen=True)
class Part:
    """An action and how long it takes."""

    text: str
    seconds: float


_THEN = re.compile(
    r"(?:\s*[.;]\s*|\s*,\s*|\s+)(?:and\s+|but\s+)?(?:then|afterwards?|after\s+(?:that|this"
    r"|which)|next(?! to\b)|subsequently"
    r"|(?:a|one|some) (?:short |little )?(?:moment|second|instant|while|bit) later|(?:moments|seconds) later"
    r"|finally|lastly|followed\s+by)\b\s*,?\s*(?:and\s+)?(?:also\s+)?"
    r"(?:after (?:a|some|one) (?:short |little |brief )?(?:moment|while|second|pause|bit|time)\b\s*,?\s*)?"
    r"|\s*,?\s+and after,?\s+(?=(?:he|she|they)\b)|\s*[.;]\s+(?=\S)",
    re.IGNORECASE,
)
_NO_SEPARATOR = re.compile(
    r"\b(?:now|every now|first|only|just|since|until|till|by|back|next to|(?<!the )right|what) (?:and )?then\b", re.I
)
_JOIN = re.compile(r"(\s*,\s*and\s+|\s*,\s*|\s+and\s+)", re.IGNORECASE)
_AT_ONCE = re.compile(r"\b(?:while|whilst|as (?:he|she|they|it|if)|at the same time|simultaneously)\b", re.IGNORECASE)
_SUBORDINATE = re.compile(
    r"\b(?:who|that|which|because|until|till|when|where|since|so that|as if|as though|if|unless|although|whenever)\b",
    re.IGNORECASE,
)
"""Words with which a clause of time, place or reason begins: what "and" joins behind one may belong to it."""
_COUNTED = re.compile(
    r"\b(?:a|one|two|three|four|five|six|seven|eight|nine|ten|\d+) (?:\w+ ){0,2}(?:steps?|paces|strides?)\b",
    re.IGNORECASE,
)
_STOPS = re.compile(r"(?:stop|halt|pause)s?(?: (?:there|again|walking|moving))?", re.IGNORECASE)
_WAITS = re.compile(r"\s*(?:wait|rest|remain|stay|pose|sleep)(?:s|ed|ing)?\b", re.IGNORECASE)
_LASTS = re.compile(
    _WAITS.pattern + r"|(?:relax|doze|nap)(?:es|s|ed|ing)?\b|(?:falls?|fell|falling) asleep\b"
    r"|(?:goes?|went|going) to sleep\b|(?:does|do|did)(?:n't| not) move\b|keeps? (?:still|sitting|lying|kneeling)\b",
    re.IGNORECASE,
)
"""Predicates of somebody who goes on being as they are."""
_POSTURES = {"sit": "sit", "lie": "lie", "lay": "lie", "kneel": "kneel", "crouch": "crouch", "squat": "crouch"}
"""Verbs of who ends up low, and of who is: the weights know nobody who stays in a squat."""
_DOWN = re.compile(r"take a seat\b.*|(?:drop|go|get|sink|fall|take) (?:(?!up |off )\w+ ){0,3}knees?\b.*", re.IGNORECASE)
_WHERE_LOW = re.compile(r"\bon (?:the|his|her|their|its) (?:floor|ground|back|side|stomach|belly)\b", re.IGNORECASE)


def split_actions(text: str) -> tuple[Part, ...]:
    """The actions of a sentence that follow each other, each a sentence of its own with the seconds it takes.

    One part, the text as it is, where the sentence says one thing or things at once; at most `MOST_PARTS`, else it is
    left whole too.
    """
    whole = " ".join(text.split()).rstrip(" .;,")
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
        whole_clause = _SUBORDINATE.search(named) or re.search(r"\brun-?up\b", rest, re.IGNORECASE)
        items = [rest] if whole_clause else _split_list(rest)
        parts += [_sentence(named, finite(item)) for item in items]
    parts = resolve_ellipsis(parts)
    if not 1 < len(parts) <= MOST_PARTS:
        return (Part(text, natural_seconds(text)),)
    last = len(parts) - 1
    seconds = [_part_seconds(part) if i < last else natural_seconds(part) for i, part in enumerate(parts)]
    rested = _merge_rests([Part(*both) for both in zip(_keep_postures(parts), seconds, strict=True)])
    return tuple(rested) if len(rested) > 1 else (Part(text, rested[0].seconds),)


def _merge_rests(parts: Sequence[Part]) -> list[Part]:
    """Parts in which a posture lasts as long as the rest that follows it: "sits down and waits"."""
    result: list[Part] = []
    for part in parts:
        rest = part.text.removeprefix(subject_of(part.text)).strip()
        before = _first_verb(result[-1].text) if result else "walk"
        if (_LASTS.match(rest) and before in _POSTURES) or (_STAYS.match(_in_base(rest)) and before not in _WALKS):
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
        if _STAYS.match(_in_base(rest)):
            pass
        elif verb in _POSTURES or _DOWN.fullmatch(_in_base(rest)):
            posture = _POSTURES.get(verb, "kneel" if "knee" in rest else "sit")
            where = _WHERE_LOW.search(rest)
            place = f" {where[0]}" if where and posture in ("sit", "lie") else ""
        elif posture and (kind_of(part, mood) == "gesture" or verb == "lean"):
            part = f"{named} {_form(posture, mood)}{place} and {rest}".strip()
        elif not _WAITS.match(rest):
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
    exempt = [(match.start(), match.end()) for match in _NO_SEPARATOR.finditer(text)]
    cuts = [
        match
        for match in _THEN.finditer(text)
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
    if _AT_ONCE.search(clause) or not clause:
        return [clause] if clause else []
    tokens = _JOIN.split(clause)
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
    if len(items) < 2 or (len(items) == 2 and _COMES_UP.match(_in_base(items[1])) and read_amount(clause)):
        return [clause]
    if len(items) > 2:
        return items
    comma = mood != "gerund" and not re.search(r"\band\b", joins[0], re.IGNORECASE)
    kinds = kind_of(items[0], mood), kind_of(items[1], mood)
    counted = "gesture" not in kinds and any(read_amount(item) for item in items)
    waits = kinds[0] == "state" and bool(_WAITS.match(items[1]))  # "stands there and waits"
    verbs = verb_of(items[0], mood), verb_of(items[1], mood)
    together = not comma and any(verbs[0] in first and verbs[1] in second for first, second in _TOGETHER)
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
    if _COUNTED.search(item) and _STOPS.fullmatch(piece.strip()):
        return True
    return "," not in join and bool(_SUBORDINATE.search(item))


# Parts of a sentence that say what is done only together with the part before. A part is generated by itself, so it
# must be a whole sentence: what only ends the action before ("bows and straightens up") remains part of it, what
# omits words of it ("raises the right arm, then the left") gets them back, what returns to where it began is
# rephrased as what people then do ("turns around and walks back": forward).

_SIDE_ALONE = re.compile(
    r"(?:(?:with|to) )?(?:(?:the|his|her|their|its|your|my) )?(left|right)"
    r"(?: (?:one|arm|hand|leg|foot|knee|fist|side|elbow|shoulder))?(?: goes up)?(?: too| as well)?",
    re.IGNORECASE,
)
_THING_ALONE = re.compile(r"(?:a|an|one|another|two|three) (?:[a-z-]+ ){0,2}[a-z-]+", re.IGNORECASE)
_ENDS = re.compile(
    r"straighten(?: (?:back )?up)?(?: again)?"
    r"|(?=.*\b(?:back|again|right|straight)\b)"
    r"(?:come|go|pop) (?:right |straight |quickly |slowly )?(?:back )?up(?: again)?",
    re.IGNORECASE,
)
"""The end of bowing, bending, ducking."""
_SQUATS = re.compile(r"\b(?:squat|lunge)", re.IGNORECASE)
_RISES_AGAIN = re.compile(r"(?:stand|get|push|rise) (?:right |straight )?(?:back )?up(?: again)?", re.IGNORECASE)
"""The end of a squat, which is no squat without."""
_STAYS = re.compile(
    r"(?:stay|remain) (?:there|low|down|still|put|like (?:that|this)|that way|in (?:that|this|the) po(?:se|sition))"
    r"|hold(?: (?:it|that|this|still|(?:the|this|that) po(?:se|sition)))?(?= *$| for )",
    re.IGNORECASE,
)
_TOGETHER = (
    (
        ("bend", "stoop", "crouch", "lean"),
        ("pick", "grab", "touch", "take", "lift", "reach", "put", "place"),
    ),
    (("stumble", "trip", "slip", "stagger", "lose"), ("fall", "crash", "collapse", "tumble", "land")),
)
"""Somebody bends and grasps, stumbles and falls at once."""
_WALKS = {"walk", "run", "jog", "go", "come", "step", "stroll", "march", "move", "take"}
"""Who stays somewhere after these stands still, which is an action of its own."""
_UP_AGAIN = re.compile(
    r"(?:get|come|go|rise) (?:right |straight )?(?:back )?"
    r"(?:up|(?:on)?to (?:his|her|their|your) feet|on (?:his|her|their|your) feet)(?: again)?",
    re.IGNORECASE,
)
_COMES_UP = re.compile(r"(?:stand|come|get|go|rise|straighten) (?:right |straight )?(?:back )?up\b", re.IGNORECASE)
"""What only ends each of several repetitions: "squats down and comes back up three times"."""
_BACK_AGAIN = re.compile(r"(walk|run|jog|come|go) back\b.*|return\b.*", re.IGNORECASE)
_OBJECT = re.compile(
    r"(?<!with )(?<!\bin )(?<!\bon )(?<!of )(?<!to )(?<!from )(?<!at )(?<!over )(?<!by )(?<=\w )"
    r"((?:an?|the|his|her|their|both|one|some|another) (?:[a-z-]+ ){0,2}?[a-z-]+)"
    r"(?=$|,| (?:from|off|on|onto|with|to|in|into|at|over|under|above|behind|against|out|up|down|as|and|high|again)\b)",
    re.IGNORECASE,
)
"""A thing that something is done with: what "it" and "them" mean behind it."""
_IT = re.compile(
    r"^((?:\w+ly )?\w+(?: (?:from|at|with|on|over|into|to|through|under|for))?) (?:it|them)\b"
    r"(?: back(?= (?:down|on|in|to)\b))?"
)
_NO_OBJECT = re.compile(r"(?:the|his|her|their|an?) (?:floor|ground|left|right|front|back|side|step)$", re.IGNORECASE)
_STAIRS = re.compile(r"\bstairs?\b|\bstaircase\b", re.IGNORECASE)
_TURNED = re.compile(r"\bturn(?:s|ed)? (?:around|round|about|back)\b", re.IGNORECASE)
_SEATED = re.compile(r"\b(?:sits?|sat|seat)\b", re.IGNORECASE)
_ON_THE_FLOOR = re.compile(r"\b(?:floor|ground)\b", re.IGNORECASE)


def resolve_ellipsis(parts: Sequence[str]) -> list[str]:
    """The parts of a sentence as sentences that say all by themselves; fewer where one only ends the one before.

    parts: what is done one after the other, each with its subject if it has one.
    """
    result: list[str] = []
    for part in parts:
        if not result:
            result.append(part)
            continue
        before = result[-1]
        named = subject_of(part)
        rest = part.removeprefix(named).strip()
        if _only_ends(before, rest):
            result[-1] = f"{before} and {rest}"
        else:
            result.append(
                _with_repeated_words(before, part) or f"{named} {_rephrased(result[-MOST_PARTS:], rest)}".strip()
            )
    return result


def _only_ends(before: str, rest: str) -> bool:
    """Whether something only ends, or keeps, what was done before."""
    rest = _in_base(rest)
    if _ENDS.fullmatch(rest):
        return not _SEATED.search(before)
    if _SQUATS.search(before) and _RISES_AGAIN.fullmatch(rest):
        return True
    first = verb_of(before.removeprefix(subject_of(before)).strip(), mood_of(before))
    return bool(_STAYS.fullmatch(rest)) and first not in _WALKS


def _with_repeated_words(before: str, part: str) -> str:
    """The sentence before with the other side, or the other thing, that the part names alone; empty if it does not."""
    alone = part.removeprefix(subject_of(before)).strip()
    side = _SIDE_ALONE.fullmatch(alone)
    if side:
        other = {"left": "right", "right": "left"}[side[1].lower()]
        return re.sub(rf"\b{other}\b", side[1].lower(), before) if re.search(rf"\b{other}\b", before) else ""
    if _THING_ALONE.fullmatch(alone) and not any(base_of(word) in NOUNS_AFTER for word in alone.split(" ")):
        ends = [match.end() for match in re.finditer(r"[a-z]+", before) if base_of(match[0]) in NOUNS_AFTER]
        return f"{before[: ends[0]]} {alone}" if ends else ""
    return ""


def _rephrased(parts: Sequence[str], rest: str) -> str:
    """The action in words that make sense without the parts before."""
    mood, before, plain = mood_of(rest) or "third", parts[-1], _in_base(rest)
    back = _BACK_AGAIN.fullmatch(plain)
    if back and (on := re.fullmatch(r"\w+ back (up|down)", plain)) and any(map(_STAIRS.search, parts)):
        return f"{_form('walk', mood)} {on[1]} the stairs"
    if back and _TURNED.search(before):
        moves = (back[1] or "walk").lower()
        return f"{_form('walk' if moves in ('come', 'go') else moves, mood)} forward"
    if (_UP_AGAIN.fullmatch(plain) or _ENDS.fullmatch(plain)) and _SEATED.search(before):
        return f"{_form('stand', mood)} up{' from the floor' if _ON_THE_FLOOR.search(before) else ' again'}"
    if _STAYS.match(plain):
        return rest
    named = [[one[1] for one in _OBJECT.finditer(part) if not _NO_OBJECT.match(one[1])] for part in reversed(parts)]
    things = next(filter(None, named), [""])
    thing = re.sub(r"^(?:an?|some|another|one)\b", "the", things[0], flags=re.IGNORECASE)
    return _IT.sub(rf"\1 {thing}", rest, count=1) if thing else rest


def _in_base(rest: str) -> str:
    """What is done with its verb as in "to walk": "walked back again" as "walk back again"."""
    return finite(rest, "base", of=mood_of(rest) or "third")


def _form(base: str, mood: str) -> str:
    return next(form for form, of in MOODS[mood].items() if of == base)
