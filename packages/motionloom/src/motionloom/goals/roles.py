"""Who of two people does what: "one person bows and the other waves" is two prompts, one for each."""

import re

from motionloom.core.errors import MotionloomError
from motionloom.goals.verbs import word_patterns

_WORDS = word_patterns("roles")

MARK = "::"
"""Parts what the first person does from what the second does, in one text."""
_NOUN = r"person|man|woman|dancer|figure|boy|girl"
_PARTS = r"hands?|arms?|leg|foot|knee|side|step|hip|shoulder|eye|elbow|time|way|direction|end"
_FIRST = re.compile(
    rf"^(?:(?:one|the first)(?: one)?(?: of (?:them|the two|the people))?(?! (?:{_PARTS})\b)(?: ({_NOUN}))?"
    rf"|an? ({_NOUN})) "
)
_SECOND = re.compile(
    r"(?:\s*[,;.]\s*(?:and |while |but |then )*|\s+(?:and|while|whilst|as|but|whereas) (?:then )?)"
    rf"(?:the other|the second|another)(?: one)?(?! (?:{_PARTS})\b)(?: ({_NOUN}))? "
)


def prompts_of(prompt: str | tuple[str, str]) -> tuple[str, str]:
    """The prompts of the first and of the second person: a text with `MARK` parts them, and so does one that says what
    one does and what the other does; any other is for both. Raises MotionloomError for a part without words."""
    if isinstance(prompt, tuple):
        return prompt
    prompts = [words.strip() for words in prompt.split(MARK)]
    if len(prompts) == 1:
        return read_roles(prompt) or (prompt, prompt)
    if len(prompts) > 2 or not all(prompts):
        raise MotionloomError(f"the prompt {prompt[:60]!r} must have words for each person around one {MARK}")
    return prompts[0], prompts[1]


def read_roles(text: str) -> tuple[str, str] | None:
    """What each of two people does, where one sentence says it of one and of the other; None where it does not."""
    sentence = " ".join(text.split()).rstrip(" .!")
    first = _FIRST.match(sentence.lower())
    second = _SECOND.search(sentence.lower(), first.end()) if first else None
    if first is None or second is None:
        return None
    does = sentence[first.end() : second.start()], sentence[second.end() :]
    if _WORDS["alike"].match(does[1].lower()):
        return None
    return f"a {first[1] or first[2] or 'person'} {does[0]}", f"a {second[1] or 'person'} {does[1]}"


def without_two(text: str) -> str:
    """The sentence without "two people", "a couple" and such at its beginning, which say nothing of what is done."""
    return _WORDS["two"].sub("", text)


SEVERAL = "one person is made here; two are made by: motionloom duet"


def tells_of_several(text: str) -> bool:
    """Whether a sentence tells of two or more people: "two people fight", "they hug each other"."""
    return bool(_WORDS["several"].search(text)) or read_roles(text) is not None
