"""Which keys of a timeline a sentence about it is about, so that a page can say it there."""

import re
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.lined_yaml import Lined, read_lined


def keys_at(place: Path, sentence: str) -> str:
    """The keys of what stands on the line that a sentence about a timeline names."""
    said = re.search(r", line (\d+): ", sentence)
    if said is None:
        return ""
    line = int(said[1])
    try:
        found, names = read_lined(place), ""
    except MotionloomError:  # it is no YAML
        return ""
    while isinstance(found.value, dict | list):
        inner = found.value.items() if isinstance(found.value, dict) else enumerate(found.value)
        above = [(key, one) for key, one in inner if (one.key_line or one.line) <= line]
        if not above:
            break
        key, found = above[-1]
        names += f".{key}" if isinstance(key, str) else f"[{key}]"
        if (found.key_line or found.line) == line and not _begins_inside(found, line):
            break
    return names.removeprefix(".")


def _begins_inside(found: Lined, line: int) -> bool:
    """Whether a list or mapping of several keys begins on the line where its first entry stands."""
    return not found.key_line and isinstance(found.value, dict | list) and found.line == line
