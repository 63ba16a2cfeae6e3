"""Whole sentences for what a stretch of motion shows: fragments, commands and remarks in many forms, from a table.

The phrases of ``actions.toml`` and ``phrases.toml`` are verb phrases behind a subject. People also type "lifting one
arm to ask a question" or "stoop and grab it", and a network that never read such sentences does not obey them.
"""

import functools
import re

from motionloom.reading import read_table
from motionloom_train.data.actions import ACTIONS, PREFIX, side_of
from motionloom_train.data.clips import MADE, Note


@functools.cache
def table() -> dict[str, dict[str, list[str]]]:
    """``action:NAME``, ``gesture:NAME`` or ``label:NAME`` to ``says``, and ``sided`` with ``{side}``."""
    return read_table("motionloom_train.data", "sayings.toml")


def sayings(note: Note) -> tuple[str, ...]:
    """The table's sentences for what a note says; none for captions, and for gestures of people who walk or sit."""
    name = note.kind.removeprefix(PREFIX)
    if not note.kind.startswith(PREFIX):
        return tuple(table().get(f"label:{name}", {}).get("says", ()))
    made = name.startswith(MADE)
    if made and any(re.search(r"\b(walk|sit)\w* and ", text) for text in note.texts):
        return ()
    entry = table().get(f"gesture:{name.removeprefix(MADE)}" if made else f"action:{name}", {})
    side = side_of(note.texts)
    turns_right = name in ACTIONS and ACTIONS[name].turns and side == "right"
    plain = [] if turns_right else entry.get("says", [])
    return (*plain, *(text.replace("{side}", side) for text in entry.get("sided", ()) if side))
