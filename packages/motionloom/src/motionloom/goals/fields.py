"""Parsed untrusted JSON or YAML, taken apart so that every mistake is reported with the name of its key."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path, PureWindowsPath
from typing import Any, NoReturn

from motionloom.core.errors import MotionloomError, kind_of, listed, meant, quoted
from motionloom.core.files.text import shown
from motionloom.io.lined_yaml import MAX_ITEMS, Lined, fail, read_lined
from motionloom.requests.fields import Spec


@dataclass(frozen=True)
class Field:
    """A value and how its keys name it, such as ``joints[1].points[3].time``; the outermost one's name is empty."""

    value: Any
    name: str = ""
    source: str = ""
    """The file, as messages begin; empty for a mapping from elsewhere."""

    def fail(self, message: str) -> NoReturn:
        """Raise a `MotionloomError` that names the file, the line and the key."""
        problem = f"'{self.name}' {message}" if self.name else f"the goal {message}"
        raise MotionloomError(f"{self.source}{self._line()}: {problem}" if self.source else problem)

    def _line(self) -> str:
        """On which line of the file the value is, in words; empty where it is unknown."""
        with suppress(MotionloomError):
            node: Any = read_lined(self.source)
            for key in re.findall(r"[^.\[\]]+", self.name):
                node = node.value[int(key) if isinstance(node.value, list) else key]
            return f", line {node.key_line or node.line}"
        return ""

    def wrong(self, expected: str) -> NoReturn:
        """Raise a `MotionloomError` with what is expected and what the value is."""
        self.fail(f"must be {expected}; got {kind_of(self.value)}")

    def mapping(self, known: Collection[str], needed: Collection[str] = ()) -> dict[str, "Field"]:
        """The values by key; no key but ``known`` ones, and all that are ``needed`` (fields declare it themselves)."""
        if not isinstance(self.value, Mapping):
            self.wrong(f"a mapping with {listed(known)}")
        for key in self.value:
            if key not in known:
                word = str(key)
                self.fail(f"has the unknown key {quoted(word)}{meant(word, known)}; it may have {listed(known)}")
        if isinstance(known, Mapping):
            needed = [key for key, spec in known.items() if spec.needed]
        for key in needed:
            if key not in self.value:
                self.fail(f"has no '{key}'; it needs {listed(needed)}")
        return {key: self._inner(value, f".{key}") for key, value in self.value.items()}

    def items(self, *, least: int = 1, most: int = 100_000) -> list["Field"]:
        """The entries of a list."""
        if not isinstance(self.value, list | tuple):
            self.wrong("a list")
        if not least <= len(self.value) <= most:
            self.fail(f"has {len(self.value):,} entries; give {least} to {most:,}")
        return [self._inner(value, f"[{number}]") for number, value in enumerate(self.value)]

    def _inner(self, value: Any, name: str) -> "Field":
        return Field(value, f"{self.name}{name}".removeprefix("."), self.source)

    def number(self, low: float, high: float) -> float:
        """A finite number from ``low`` to ``high``."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            self.wrong("a number")
        if not low <= self.value <= high or not math.isfinite(self.value):
            self.fail(f"must be {low:g} to {high:g}; got {kind_of(self.value)}")
        return float(self.value)

    def numbers(self, low: float, high: float, *, least: int = 1, most: int = 100_000) -> list[float]:
        """A list of finite numbers."""
        return [item.number(low, high) for item in self.items(least=least, most=most)]

    def read(self, spec: Spec) -> Any:
        """The value, or the list of values, as a field holds it."""
        if spec.many:
            return [item.read(replace(spec, many=0)) for item in self.items(most=spec.many)]
        if spec.size:
            return tuple(self.numbers(spec.low, spec.high, least=spec.size, most=spec.size))
        if spec.kind == "number":
            return self.number(spec.low, spec.high)
        return self.flag() if spec.kind == "flag" else self.word(spec.words)

    def flag(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            self.wrong("true or false")
        return self.value

    def word(self, known: Collection[str]) -> str:
        """One of the words."""
        if not isinstance(self.value, str):
            self.wrong(f"one of {', '.join(known)}")
        if self.value not in known:
            self.fail(f"is {quoted(self.value)}{meant(self.value, known)}; there are {', '.join(known)}")
        return self.value

    def file(self, folder: Path) -> Path:
        """A file in ``folder`` or below it, named from there; a file from an untrusted source reads nothing else."""
        name = self.value
        if not isinstance(name, str) or not name.strip() or not name.isprintable():
            self.wrong("the name of a file")
        foreign = PureWindowsPath(name)
        if foreign.drive or foreign.root or ".." in foreign.parts:
            self.fail(
                f"is {quoted(name)}, which leads out of the folder {folder}; put the file there and name it without "
                "'..' and without a leading '/'"
            )
        place = folder / name
        try:
            inside, there = place.resolve().is_relative_to(folder.resolve()), place.is_file()
        except (OSError, ValueError, RuntimeError):
            inside, there = True, False
        if not inside:
            self.fail(f"is {quoted(name)}, a link that leads out of the folder {folder}; copy the file there")
        if not there:
            self.fail(f"names {quoted(name, 200)}, and there is no such file in {folder}")
        return place


def value(entries: Mapping[str, Field], keys: Mapping[str, Spec], name: str) -> Any:
    """The value of a key, as its field holds it; the field's default where the key is missing."""
    entry = entries.get(name)
    return keys[name].default if entry is None else entry.read(keys[name])


# A YAML file from an untrusted source


@dataclass(frozen=True)
class LinedFile:
    """A file being read; whoever reads a kind of file builds on it."""

    path: Path
    places: tuple[str, ...] = field(default=(), kw_only=True)
    """Of values that come from no file: the keys of each, by its number (`lined_of`)."""

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
            kind = "an empty list" if node.value == [] else node.kind
            self.fail(node.line, f"'{name}' must be a list with at least one {of}; got {kind}")
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
        """Raise a `MotionloomError` that names file and line, or the keys."""
        if not self.places:
            fail(self.path, line, message)
        raise MotionloomError(f"{self.path.name}, {self.at(line)}: {message}", where=self.places[line])

    def at(self, line: int) -> str:
        """A place in words."""
        return (self.places[line] or "as a whole") if self.places else f"line {line}"
