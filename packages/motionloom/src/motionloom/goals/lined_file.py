"""A YAML file from an untrusted source, taken apart so that every mistake is reported with the file and the line."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from motionloom.errors import MotionloomError, listed, meant
from motionloom.io.lined_yaml import MAX_ITEMS, Lined, fail
from motionloom.io.text import shown
from motionloom.requests.fields import Spec


@dataclass(frozen=True)
class LinedFile:
    """A file being read; whoever reads a kind of file builds on it."""

    path: Path
    places: tuple[str, ...] = field(default=(), kw_only=True)
    """Of values that come from no file: what leads to each, by its number (`lined_of`)."""

    def mapping(self, found: Lined, keys: Sequence[str], what: str) -> dict[str, Lined]:
        """The values by key; no key but ``keys``. what: the mapping, in words."""
        if not isinstance(found.value, dict):
            self.fail(found.line, f"{what} must be a mapping with {listed(keys)}; got {self.got(found)}")
        for key, value in found.value.items():
            if key not in keys:
                self.fail(value.key_line, f"unknown key {shown(key)}{meant(key, keys)}; {what} has {listed(keys)}")
        return found.value

    def items(self, found: Lined, name: str, *, of: str = "entry", most: int = MAX_ITEMS) -> list[Lined]:
        """The entries of a list, at least one. of: what one is, in a word."""
        if not isinstance(found.value, list) or not found.value:
            got = "an empty list" if found.value == [] else found.kind
            self.fail(found.line, f"'{name}' must be a list with at least one {of}; got {got}")
        if len(found.value) > most:
            self.fail(found.line, f"'{name}' has {len(found.value):,} entries; at most {most:,} are read")
        return found.value

    def field(self, given: Mapping[str, Lined], keys: Mapping[str, Spec], name: str) -> Any:
        """The value of one of the keys, as its field holds it; None where nothing is written."""
        if (found := given.get(name)) is None:
            return None
        try:
            return keys[name].check(found.plain(), repr(name))
        except MotionloomError as error:
            self.fail(found.line, str(error))

    def got(self, found: Lined) -> str:
        """What is there, for messages."""
        return found.kind

    def fail(self, line: int, message: str) -> NoReturn:
        """Raise a `MotionloomError` that names file and line, or the keys that lead there."""
        if not self.places:
            fail(self.path, line, message)
        raise MotionloomError(f"{self.path.name}, {self.at(line)}: {message}", where=self.places[line])

    def at(self, line: int) -> str:
        """A place in words."""
        return (self.places[line] or "as a whole") if self.places else f"line {line}"
