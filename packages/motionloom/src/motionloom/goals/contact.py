"""Words that bring two people's hands together: "shake hands", "high five", "hold hands", "hug", "push".

Plain text work by a table. What is read says which joints meet, how near and how turned the two are then, and how high
and for how long; when, and where in the world, is found in what is sampled (`motionloom.edits.meeting`).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from motionloom.core.skeleton import SMPL22

Turn = Literal["facing", "beside", "any"]
LEFT, RIGHT, CHEST, HEAD = (SMPL22.index(name) for name in ("left_wrist", "right_wrist", "spine3", "head"))


@dataclass(frozen=True)
class Touch:
    """A joint of one person that comes to something of the other's."""

    person: int
    """Whose joint it is, 0 or 1."""
    joint: int
    other: int
    """The other person's joint."""
    beside: tuple[float, float, float] | None = None
    """Metres from it, as the other is turned (+X left, +Z ahead), where the joint comes to, and the other stays; None:
    the two joints come to one place between the people."""


@dataclass(frozen=True)
class Contact:
    """How two people touch."""

    name: str
    ways: tuple[tuple[Touch, ...], ...]
    """Sets of touches; of several the nearest is taken."""
    apart: tuple[float, float]
    """Metres between the pelvises then: at least, at most."""
    turn: Turn = "facing"
    height: tuple[float, float] = (0.9, 1.2)
    """Metres above the floor between which hands meet."""
    seconds: float = 0.4
    """How long."""
    close: bool = False
    """Whether they stand in each other's arms."""

    def __str__(self) -> str:
        """What was read, in words."""
        how = {"facing": "facing each other", "beside": "side by side", "any": "as they are"}[self.turn]
        return f"the two {self.name}, {how}" + (f", for {self.seconds:g} s" if self.seconds else "")


def _hands(*pairs: tuple[int, int]) -> tuple[Touch, ...]:
    return tuple(Touch(0, first, second) for first, second in pairs)


_ANY = tuple(_hands(pair) for pair in ((LEFT, RIGHT), (RIGHT, LEFT), (RIGHT, RIGHT), (LEFT, LEFT)))
_ARMS_AROUND = tuple(
    Touch(person, joint, CHEST, place)
    for person in (0, 1)
    for joint, place in ((LEFT, (-0.12, 0.04, -0.06)), (RIGHT, (0.12, -0.12, -0.06)), (HEAD, (-0.14, 0.26, 0.27)))
)
"""One arm above the other's, one below, and the head to the left: so nothing crosses."""
_AGAINST = tuple(
    Touch(0, joint, CHEST, place) for joint, place in ((LEFT, (-0.13, 0.06, 0.1)), (RIGHT, (0.13, 0.06, 0.1)))
)
_EACH_OTHER = (
    r"(?:each other|one another|the (?:other|second|first)|another|a second|(?:the|his|her|their) partner|him|her)"
)
_CONTACTS: tuple[tuple[str, Contact], ...] = (
    (
        r"shak(?:e|es|ing) (?:each other'?s |right )?hands?|hand ?shakes?",
        Contact("shake hands", (_hands((RIGHT, RIGHT)),), (0.62, 0.78), height=(0.98, 1.12), seconds=1.2),
    ),
    (
        r"high[- ]tens?|double high[- ]fives?",
        Contact(
            "give a high ten", (_hands((RIGHT, LEFT), (LEFT, RIGHT)),), (0.5, 0.7), height=(1.48, 1.58), seconds=0.2
        ),
    ),
    (
        r"high[- ]?fiv(?:e|es|ing)(?! times)",
        Contact("give a high five", (_hands((RIGHT, RIGHT)),), (0.5, 0.7), height=(1.48, 1.58), seconds=0.2),
    ),
    (
        r"fist[- ]?bump(?:s|ing)?|bump(?:s|ing)? fists",
        Contact("bump fists", (_hands((RIGHT, RIGHT)),), (0.65, 0.85), height=(1.1, 1.25), seconds=0.2),
    ),
    (
        r"hugs?|hugging|embrac(?:e|es|ing)",
        Contact("hug", (_ARMS_AROUND,), (0.38, 0.42), seconds=1.6, close=True),
    ),
    (
        rf"(?:push|shov)(?:es|e|ing)? {_EACH_OTHER}",
        Contact("touch as the first pushes", (_AGAINST,), (0.5, 0.6), seconds=0.3),
    ),
    (
        r"(?:hold|tak|join)(?:s|ing|es|e)? (?:each other'?s )?hands|hand in hand",
        Contact("hold hands", _ANY, (0.5, 0.7), "any", (0.75, 1.0), seconds=3.0),
    ),
    (
        r"danc(?:e|es|ing) (?:\w+ )?(?:together|with each other|with one another)",
        Contact("hold hands", _ANY, (0.4, 0.85), "any", (0.95, 1.25), seconds=1.0),
    ),
)
_FACING = (
    (r"fight(?:s|ing)?|box(?:es|ing)?|spar(?:s|ring)?|wrestl(?:e|es|ing)|duel(?:s|ling)?", (0.7, 1.1)),
    (
        r"(?:talk|speak|chat|bow|wave|fac|greet)\w* (?:to |with |at )?(?:each other|one another)|argu(?:e|es|ing)",
        (0.8, 1.6),
    ),
)
"""Words of people who face each other, and metres between them."""
_CONTACTS += tuple((pattern, Contact("are near", ((),), apart, seconds=0.0)) for pattern, apart in _FACING)
_NOT = re.compile(r"(?:without|not|never|n't|refus\w+ to|before|instead of)(?: \w+)? $")
_BESIDE = re.compile(r"\b(?:side by side|beside|walk|walks|walking|stroll|strolls|strolling)\b")


def read_contact(prompts: Sequence[str]) -> Contact | None:
    """How two people touch, by the prompt of each (two texts, which may be one); None where nothing is
    said of it."""
    for person, prompt in enumerate(prompts):
        words = " ".join(prompt.lower().replace(",", " ").split())
        for pattern, contact in _CONTACTS:
            match = re.search(rf"\b(?:{pattern})\b", words)
            if match is None or _NOT.search(words[: match.start()]):
                continue
            if contact.turn == "any" and _BESIDE.search(words):
                contact = replace(contact, turn="beside")
            return _exchanged(contact) if person else contact
    return None


def _exchanged(contact: Contact) -> Contact:
    """The same with the two people exchanged, where one alone reaches for the other."""
    if any(touch.beside is None or touch.person for way in contact.ways for touch in way):
        return contact
    ways = tuple(tuple(replace(touch, person=1) for touch in way) for way in contact.ways)
    return replace(contact, ways=ways, name=contact.name.replace("first", "second"))
