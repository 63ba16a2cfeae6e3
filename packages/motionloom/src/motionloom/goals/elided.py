"""Parts of a sentence that say what is done only together with the part before: "comes back up", "the left arm".

A part is drawn by itself, so it must be a sentence that says all. What only ends the action before ("bows and
straightens up") stays with it; what leaves out words that were just said ("raises the right arm, then the left") gets
them back; what comes back to where it began is said as what people then do ("turns around and walks back": forward).
"""

import re
from collections.abc import Sequence

from motionloom.goals.verbs import MOODS, NOUNS_AFTER, base_of, mood_of, subject_of, verb_of

_SIDE_ALONE = re.compile(
    r"(?:(?:with|to) )?(?:(?:the|his|her|their|its|your|my) )?(left|right)"
    r"(?: (?:one|arm|hand|leg|foot|knee|fist|side|elbow|shoulder))?(?: goes up)?(?: too| as well)?",
    re.IGNORECASE,
)
_THING_ALONE = re.compile(r"(?:a|an|one|another|two|three) (?:[a-z-]+ ){0,2}[a-z-]+", re.IGNORECASE)
_ENDS = re.compile(
    r"straighten(?:s|ed|ing)?(?: (?:back )?up)?(?: again)?"
    r"|(?=.*\b(?:back|again|right|straight)\b)"
    r"(?:come|go|pop)(?:es|s)? (?:right |straight |quickly |slowly )?(?:back )?up(?: again)?",
    re.IGNORECASE,
)
"""The end of bowing, bending, ducking."""
_SQUATS = re.compile(r"\b(?:squat|lunge)", re.IGNORECASE)
_STANDS_AGAIN = re.compile(r"(?:stand|get|push|rise)s? (?:right |straight )?(?:back )?up(?: again)?", re.IGNORECASE)
"""The end of a squat, which is no squat without."""
_STAYS = re.compile(
    r"(?:stay|remain)s? (?:there|low|down|still|put|like (?:that|this)|that way|in (?:that|this|the) po(?:se|sition))"
    r"|holds? (?:it|that|this|still|(?:the|this|that) po(?:se|sition))",
    re.IGNORECASE,
)
_WALKS = {"walk", "run", "jog", "go", "come", "step", "stroll", "march", "move", "take"}
"""Who stays somewhere after these stands still, which is an action of its own."""
_UP_AGAIN = re.compile(
    r"(?:get|come|go|rise)(?:es|s)? (?:right |straight )?(?:back )?(?:up|to (?:his|her|their|your) feet)(?: again)?",
    re.IGNORECASE,
)
_BACK_AGAIN = re.compile(r"(walk|run|jog|come|go)(?:es|s)? back\b.*|returns?\b.*", re.IGNORECASE)
_TURNED = re.compile(r"\bturn(?:s|ed)? (?:around|round|about|back)\b", re.IGNORECASE)
_SEATED = re.compile(r"\b(?:sits?|seat)\b", re.IGNORECASE)
_ON_THE_FLOOR = re.compile(r"\b(?:floor|ground)\b", re.IGNORECASE)


def completed(parts: Sequence[str]) -> list[str]:
    """The parts of a sentence as sentences that can be drawn by themselves; fewer where one only ends the one before.

    parts: what is done one after the other, each with its subject if it has one.
    """
    result: list[str] = []
    for part in parts:
        if not result:
            result.append(part)
            continue
        before = result[-1]
        named = subject_of(part)
        done = part.removeprefix(named).strip()
        if _ends(before, done):
            result[-1] = f"{before} and {done}"
        else:
            result.append(_repeated(before, part) or f"{named} {_said_anew(before, done)}".strip())
    return result


def _ends(before: str, done: str) -> bool:
    """Whether something only ends, or keeps, what was done before."""
    if _ENDS.fullmatch(done):
        return not _SEATED.search(before)
    if _SQUATS.search(before) and _STANDS_AGAIN.fullmatch(done):
        return True
    first = verb_of(before.removeprefix(subject_of(before)).strip(), mood_of(before))
    return bool(_STAYS.fullmatch(done)) and first not in _WALKS


def _repeated(before: str, part: str) -> str:
    """The sentence before with the other side, or the other thing, that the part names alone; empty if it does not."""
    alone = part.removeprefix(subject_of(before)).strip()
    side = _SIDE_ALONE.fullmatch(alone)
    if side:
        other = {"left": "right", "right": "left"}[side[1].lower()]
        return re.sub(rf"\b{other}\b", side[1].lower(), before) if re.search(rf"\b{other}\b", before) else ""
    if _THING_ALONE.fullmatch(alone) and not any(base_of(word) in NOUNS_AFTER for word in alone.split(" ")):
        ends = [found.end() for found in re.finditer(r"[a-z]+", before) if base_of(found[0]) in NOUNS_AFTER]
        return f"{before[: ends[0]]} {alone}" if ends else ""
    return ""


def _said_anew(before: str, done: str) -> str:
    """What is done, as people say it who do not know what was done before."""
    mood = mood_of(done) or "third"
    back = _BACK_AGAIN.fullmatch(done)
    if back and _TURNED.search(before):
        moves = (back[1] or "walk").lower()
        return f"{_form('walk' if moves in ('come', 'go') else moves, mood)} forward"
    if (_UP_AGAIN.fullmatch(done) or _ENDS.fullmatch(done)) and _SEATED.search(before):
        return f"{_form('stand', mood)} up{' from the floor' if _ON_THE_FLOOR.search(before) else ' again'}"
    return done


def _form(base: str, mood: str) -> str:
    return next(form for form, of in MOODS[mood].items() if of == base)
