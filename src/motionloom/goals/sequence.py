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

MOST_PARTS = 20
SHORTEST = 1.2
"""Seconds of the shortest part."""
LONGEST = 12.0
"""Seconds of the longest part by nature; more is asked for in numbers."""


@dataclass(frozen=True)
class Part:
    """An action and how long it takes."""

    text: str
    seconds: float


_SECONDS = {
    "locomotion": 4.0, "gesture": 3.0, "state": 3.0, "change": 3.0, "event": 2.5, "jump": 2.5, "turn": 2.5,
    "fight": 3.0, "dance": 5.0, "other": 4.0,
}  # fmt: skip
"""Kinds of verbs, and the seconds such an action takes."""

_VERBS = {
    "locomotion": "walk run jog sprint march stroll step stride skip tiptoe sneak crawl climb go come move "
    "pace shuffle sidestep strafe limp stagger rush race swim back return enter leave approach wander hop gallop creep "
    "stumble",
    "gesture": "wave clap point nod shake salute raise lift swing stretch reach scratch rub hold carry drag push pull "
    "bounce dribble look talk shout sing drink eat cheer flap cross fold shrug gesture touch wipe wash stir play "
    "juggle smile laugh cry yawn beckon lower",
    "state": "sit stand lie lay rest wait pause balance pose remain stay sleep lean",
    "change": "kneel crouch bend fall stop rise collapse duck freeze halt",
    "event": "throw catch pick put place bow roll grab drop take toss pitch stoop cartwheel flip dive trip squat "
    "lunge curtsy sneeze open close shoot",
    "jump": "jump leap bound",
    "turn": "turn spin twist rotate pivot circle twirl",
    "fight": "kick punch box strike hit block dodge slash fight swipe chop jab",
    "dance": "dance waltz salsa",
    "other": "do make perform start begin continue keep try practice give get exercise act pretend",
}
_PAST = {
    "sit": "sat", "stand": "stood", "lie": "lay", "run": "ran", "go": "went", "come": "came", "get": "got",
    "kneel": "knelt", "bend": "bent", "throw": "threw", "catch": "caught", "swing": "swung", "fall": "fell",
    "take": "took", "do": "did", "make": "made", "give": "gave", "begin": "began", "keep": "kept", "put": "put",
    "rise": "rose", "creep": "crept", "swim": "swam", "hold": "held", "drink": "drank", "eat": "ate", "sing": "sang",
    "shake": "shook", "leap": "leapt", "spin": "spun", "fight": "fought", "hit": "hit", "strike": "struck",
    "leave": "left", "sleep": "slept", "shoot": "shot",
}  # fmt: skip
_DOUBLED = {"run", "sit", "jog", "step", "skip", "hop", "clap", "nod", "stop", "get", "spin", "trip", "drag", "flap",
            "shrug", "put", "swim", "drop", "flip", "grab", "rub", "hit", "chop", "jab", "begin", "bet"}  # fmt: skip
_CHANGED_BY = {
    "sit": ("change", r"\b(down|up)\b"), "stand": ("change", r"\bup\b"), "lie": ("change", r"\bdown\b"),
    "lay": ("change", r"\bdown\b"), "get": ("change", r"\b(up|down|onto|off)\b"), "lean": ("change", r"\bdown\b"),
    "turn": ("event", r"\b(around|round|about|back|180)\b"), "climb": ("event", r"\b(onto|over)\b"),
    "come": ("change", r"\bto a (stop|halt)\b"), "look": ("event", r"\baround\b"),
}  # fmt: skip
"""What a word behind the verb makes of it."""

_NOUNS_AFTER = {"do", "make", "perform", "throw", "take", "give", "practice", "play"}
"""Verbs behind which "kicks and punches" are things."""
_SUBJECT_WORDS = (
    r"(?:a|an|the|this|that|one|another|some|somebody|someone|he|she|they|it|i|you|we|person|man|woman|figure)"
)
_PRONOUN = re.compile(
    r"^(?:he|she|they|it|(?:the|this|that) (?:person|man|woman|figure|guy|boy|girl|character|human))\s+", re.IGNORECASE
)
_ADVERB = r"(?:(?:\w+ly|then|again|suddenly|once|twice|just|also|first|finally|soon)\s+)*"
_THEN = re.compile(
    r"(?:\s*[.;]\s*|\s*,\s*|\s+)(?:and\s+|but\s+)?(?:then|afterwards?|after\s+(?:that|this|which)|next|subsequently"
    r"|finally|lastly|followed\s+by)\b\s*,?\s*(?:and\s+)?(?:also\s+)?|\s*[.;]\s+(?=\S)",
    re.IGNORECASE,
)
_KEPT = re.compile(
    r"\b(?:now|every now|first|only|just|since|until|till|by|back|next to|right|what) (?:and )?then\b", re.I
)
_JOIN = re.compile(r"(\s*,\s*and\s+|\s*,\s*|\s+and\s+)", re.IGNORECASE)
_AT_ONCE = re.compile(r"\b(?:while|whilst|as (?:he|she|they|it|if)|at the same time|simultaneously)\b", re.IGNORECASE)
_NUMBER = {"once": 1, "twice": 2, "thrice": 3, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
           "eight": 8, "nine": 9, "ten": 10, "several": 4, "few": 3}  # fmt: skip


def _forms() -> dict[str, dict[str, str]]:
    """Of each mood ("third", "base", "past", "gerund") the forms with their base."""
    moods: dict[str, dict[str, str]] = {"third": {}, "base": {}, "past": {}, "gerund": {}}
    for words in _VERBS.values():
        for base in words.split():
            moods["third"][_third(base)] = base
            moods["base"][base] = base
            stem = base + base[-1] if base in _DOUBLED else base
            past = f"{stem[:-1]}ied" if stem.endswith("y") and stem[-2] not in "aeo" else f"{stem.removesuffix('e')}ed"
            moods["past"][_PAST.get(base, past)] = base
            moods["gerund"]["lying" if base == "lie" else _gerund(stem)] = base
    return moods


def _third(base: str) -> str:
    if base.endswith("y") and base[-2] not in "aeo":
        return base[:-1] + "ies"
    return base + ("es" if re.search(r"(s|sh|ch|x|o|z)$", base) else "s")


def _gerund(stem: str) -> str:
    return (stem[:-1] if stem.endswith("e") and not stem.endswith("ee") else stem) + "ing"


_MOODS = _forms()
_KINDS = {base: kind for kind, words in reversed(_VERBS.items()) for base in words.split()}


def split_actions(text: str) -> tuple[Part, ...]:
    """The actions of a sentence that follow each other, each a sentence of its own with the seconds it takes.

    One part, the text as it is, where the sentence says one thing or things at once; at most `MOST_PARTS`, else it is
    left whole too.
    """
    whole = " ".join(text.split()).rstrip(" .;,")
    clauses = [clause for found in _by_time(whole) for clause in _by_then(found)]
    subject = _subject(clauses[0]) if clauses else ""
    parts: list[str] = []
    for number, clause in enumerate(clauses):
        own = _subject(clause)
        said = clause if not own or number == 0 else _PRONOUN.sub("", clause)
        own = own if said == clause else ""
        named = own or subject
        rest = said[len(own) :].strip() if own else said
        parts += [_sentence(named, item) for item in _list(_finite(rest))]
    if not 1 < len(parts) <= MOST_PARTS:
        return (Part(text, natural_seconds(text)),)
    return tuple(Part(part, natural_seconds(part)) for part in parts)


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


def natural_seconds(text: str) -> float:
    """How long an action takes people, by its kind, its numbers and how quickly it is done; 1.2 to 12 s."""
    said = text.lower()
    if found := re.search(r"\bfor (\d+(?:\.\d+)?|\w+) (?:seconds?|s)\b", said):
        number = _count(found[1])
        if number:
            return float(min(max(number, SHORTEST), 60.0))
    kind = next((_kind(word, said) for word in re.findall(r"[a-z]+", said) if _base(word)), "other")
    seconds = _SECONDS[kind]
    if found := re.search(r"\b(\w+) (?:small |large |big |slow |quick )?steps\b", said):
        seconds = 1.0 + 0.6 * (_count(found[1]) or 3)
    elif found := re.search(r"\b(\d+|[a-z]+) times\b", said):
        seconds *= 0.4 + 0.6 * (_count(found[1]) or 2)
    elif re.search(r"\b(twice|thrice)\b", said):
        seconds *= 1.6 if "twice" in said else 2.2
    elif found := re.search(r"\b(two|three|four|five|six|seven|eight|nine|ten|\d+) \w+s\b", said):
        seconds *= 0.4 + 0.6 * (_count(found[1]) or 2)
    if re.search(r"\bin (?:a )?(?:full |big |large |small )?circles?\b", said):
        seconds = max(seconds, 6.0)
    if re.search(r"\b(slowly|slow|carefully|gently)\b", said):
        seconds *= 1.3
    elif re.search(r"\b(quickly|quick|fast|rapidly|hastily)\b", said):
        seconds *= 0.8
    return float(min(max(seconds, SHORTEST), LONGEST))


# Clauses


def _by_time(text: str) -> list[str]:
    """Clauses joined by "before" and "after", in the order in which they happen."""
    if found := re.match(r"(before|after)\s+([^,]+?)\s*,\s*(.+)$", text, re.IGNORECASE):
        inner, main = found[2], found[3]
        if _is_clause(inner):
            order = [main, inner] if found[1].lower() == "before" else [inner, main]
            return [clause for one in _named_alike(order, main) for clause in _by_time(one)]
    for found in re.finditer(r"\s*,?\s+(before|after)\s+", text, re.IGNORECASE):
        main, inner = text[: found.start()], text[found.end() :]
        if _is_clause(inner) and main.strip():
            inner = _named_alike([inner], main)[0]
            order = [main, inner] if found[1].lower() == "before" else [inner, main]
            return [order[0], *_by_time(order[1])] if found[1].lower() == "before" else order
    return [text]


def _named_alike(clauses: list[str], main: str) -> list[str]:
    """Clauses with the subject of ``main`` where they have none or a pronoun, their verbs finite as there."""
    subject, mood = _subject(main), _mood(main)
    result = []
    for clause in clauses:
        rest = _PRONOUN.sub("", clause)
        result.append(clause if clause == main else _sentence(subject, _finite(rest, mood)) if subject else
                      _finite(rest, mood))  # fmt: skip
    return result


def _by_then(text: str) -> list[str]:
    """Clauses parted by "then" and its like."""
    kept = [(found.start(), found.end()) for found in _KEPT.finditer(text)]
    cuts = [
        found for found in _THEN.finditer(text)
        if not any(begin < found.end() and found.start() < end for begin, end in kept)
    ]  # fmt: skip
    pieces, at = [], 0
    for cut in cuts:
        pieces.append(text[at : cut.start()])
        at = cut.end()
    pieces.append(text[at:])
    found = [re.sub(r"^(?:and|then)\s+", "", piece.strip(" ,.;"), flags=re.I).strip() for piece in pieces]
    return [piece for piece in found if piece]


def _list(clause: str) -> list[str]:
    """The items of a list of verbs, if they follow each other; else the clause alone."""
    if _AT_ONCE.search(clause) or not clause:
        return [clause] if clause else []
    tokens = _JOIN.split(clause)
    items, joins = [tokens[0]], []
    mood = _mood(tokens[0])
    for join, piece in zip(tokens[1::2], tokens[2::2], strict=True):
        piece = _PRONOUN.sub("", piece)
        if mood and _verb(piece, mood) and not _is_thing(items[-1], join):
            items.append(piece)
            joins.append(join)
        else:
            items[-1] += join + piece
    if len(items) < 2:
        return [clause]
    if len(items) > 2:
        return items
    comma = not re.search(r"\band\b", joins[0], re.IGNORECASE)
    return items if comma or _follows(_kind_of(items[0], mood), _kind_of(items[1], mood)) else [clause]


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


def _subject(clause: str) -> str:
    """The words before the first verb: "a tall man" of "a tall man walks"; empty for a bare verb."""
    words = clause.split(" ")
    for count, word in enumerate(words[:7]):
        plain = word.strip(",").lower()
        if count == 0 and not re.fullmatch(_SUBJECT_WORDS, plain):
            return ""
        if count and (plain in ("is", "are", "was", "were") or plain in _MOODS["third"] or plain in _MOODS["past"]):
            before = words[:count]
            while len(before) > 1 and re.fullmatch(r"\w+ly|then", before[-1]):
                before = before[:-1]
            return " ".join(before)
    return words[0] if re.fullmatch(r"someone|somebody|he|she|they", words[0], re.I) else _article(words)


def _article(words: list[str]) -> str:
    """The article and its noun where no verb is known."""
    return " ".join(words[:2]) if len(words) > 2 and re.fullmatch(r"a|an|the", words[0], re.IGNORECASE) else ""


def _sentence(subject: str, action: str) -> str:
    return f"{subject} {action}".strip()


def _mood(clause: str) -> str:
    """The mood of a clause's first verb; empty where none is known."""
    rest = clause[len(_subject(clause)) :].strip()
    return next((mood for mood in ("third", "base", "past", "gerund") if _verb(rest, mood)), "")


def _verb(phrase: str, mood: str) -> str:
    """The verb that a phrase begins with, adverbs aside, as its base; empty if it is none of that mood."""
    found = re.match(rf"\s*{_ADVERB}([A-Za-z]+)", phrase, re.IGNORECASE)
    return _MOODS[mood].get(found[1].lower(), "") if found else ""


def _base(word: str) -> str:
    return next((forms[word] for forms in _MOODS.values() if word in forms), "")


def _is_clause(phrase: str) -> bool:
    """Whether something happens in a phrase: it begins with a gerund, or with a subject and a verb."""
    if re.match(r"(?:that|this|which)\b", phrase, re.IGNORECASE):  # "after that" is a "then"
        return False
    if _verb(phrase, "gerund"):
        return True
    subject = _subject(phrase)
    return bool(subject) and bool(_mood(phrase)) and bool(_verb(phrase[len(subject) :].strip(), _mood(phrase)))


def _finite(phrase: str, mood: str = "third") -> str:
    """A phrase that begins with a gerund, with its verb in the mood: "sitting down" as "sits down"."""
    base = _verb(phrase, "gerund")
    if not base:
        return phrase
    said = next(form for form, of in _MOODS[mood or "third"].items() if of == base)
    return re.sub(rf"^(\s*{_ADVERB})[A-Za-z]+", rf"\g<1>{said}", phrase, count=1, flags=re.IGNORECASE)


def _kind_of(item: str, mood: str) -> str:
    rest = item[len(_subject(item)) :].strip()
    return _kind(_MOODS[mood].get("", "") or _verb(rest, mood), rest.lower())


def _kind(word: str, said: str) -> str:
    base = _base(word) or word
    changed = _CHANGED_BY.get(base)
    if changed and re.search(changed[1], said):
        return changed[0]
    return _KINDS.get(base, "other")


def _is_thing(item: str, join: str) -> bool:
    """Whether what follows is one more thing that somebody does, throws ...: "does squats and lunges"."""
    rest = item[len(_subject(item)) :].strip()
    base = next((_verb(rest, mood) for mood in _MOODS if _verb(rest, mood)), "")
    return base in _NOUNS_AFTER and "," not in join and bool(re.search(r"\w+s$", item)) and len(rest.split(" ")) <= 4


def _count(word: str) -> int:
    return int(float(word)) if re.fullmatch(r"\d+(?:\.\d+)?", word) else _NUMBER.get(word, 0)
