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

    def mapping(self, node: Lined, keys: Sequence[str], what: str) -> dict[str, Lined]:
        """The values by key; no key but ``keys``. what: the mapping, in words."""
        if not isinstance(node.value, dict):
            self.fail(node.line, f"{what} must be a mapping with {listed(keys)}; got {self.kind(node)}")
        for key, value in node.value.items():
            if key not in keys:
                self.fail(value.key_line, f"unknown key {shown(key)}{meant(key, keys)}; {what} has {listed(keys)}")
        return node.value

    def items(self, node: Lined, name: str, *, of: str = "entry", most: int = MAX_ITEMS) -> list[Lined]:
        """The entries of a list, at least one. of: what one is, in a word."""
        if not isinstance(node.value, list) or not node.value:
            got = "an empty list" if node.value == [] else node.kind
            self.fail(node.line, f"'{name}' must be a list with at least one {of}; got {got}")
        if len(node.value) > most:
            self.fail(node.line, f"'{name}' has {len(node.value):,} entries; at most {most:,} are read")
        return node.value

    def field(self, entries: Mapping[str, Lined], keys: Mapping[str, Spec], name: str) -> Any:
        """The value of one of the keys, as its field holds it; None where nothing is written."""
        if (node := entries.get(name)) is None:
            return None
        try:
            return keys[name].check(node.plain(), repr(name))
        except MotionloomError as error:
            self.fail(node.line, str(error))

    def kind(self, node: Lined) -> str:
        """The kind of a value, for messages."""
        return node.kind

    def fail(self, line: int, message: str) -> NoReturn:
        """Raise a `MotionloomError` that names file and line, or the keys that lead there."""
        if not self.places:
            fail(self.path, line, message)
        raise MotionloomError(f"{self.path.name}, {self.at(line)}: {message}", where=self.places[line])

    def at(self, line: int) -> str:
        """A place in words."""
        return (self.places[line] or "as a whole") if self.places else f"line {line}"
