"""Plain YAML from untrusted sources, with the line of every value: mappings, lists, words and numbers, nothing clever.

Anchors, aliases and tags are refused, so that a small file cannot become a large one or make objects; so are several
documents, duplicate keys, NaN and infinity. Built from the parser's events in one pass and without recursion.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from motionloom.core.errors import MotionloomError, kind_of
from motionloom.core.files.text import read_text, shown
from motionloom.core.reading import check_text

MAX_DEPTH = 32
MAX_ITEMS = 200_000
"""Of one list or mapping."""
MAX_VALUES = 4_000_000
"""Of the whole file; some 1 GB."""
MAX_DIGITS = 100
_NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_WHOLE = re.compile(r"[-+]?[0-9]+")
_NOT_FINITE = re.compile(r"[-+]?\.?(?:inf|nan|infinity)", re.IGNORECASE)
_WORDS = {"": None, "~": None, "null": None, "Null": None, "NULL": None} | {
    word: value for value, name in ((True, "true"), (False, "false")) for word in (name, name.title(), name.upper())
}


@dataclass(frozen=True, slots=True)
class Lined:
    """A value and the line on which it begins, counted from 1."""

    line: int
    value: "bool | int | float | str | list[Lined] | dict[str, Lined] | None"
    key_line: int = 0
    """Where the key is that names it; 0 in a list."""

    def plain(self) -> Any:
        """The value without lines: what `yaml.safe_load` would give."""
        if isinstance(self.value, dict):
            return {key: inner.plain() for key, inner in self.value.items()}
        if isinstance(self.value, list):
            return [inner.plain() for inner in self.value]
        return self.value

    @property
    def kind(self) -> str:
        """The value's type in words for messages."""
        if self.value is None:
            return "nothing"
        if isinstance(self.value, bool):
            return "true or false"
        if isinstance(self.value, list):
            return "a list"
        if isinstance(self.value, dict):
            return "a mapping"
        if isinstance(self.value, str):
            return shown(self.value)
        kind = kind_of(self.value)
        return kind if kind.startswith("a ") else f"the number {kind}"


def lined_of(value: Any) -> tuple[Lined, tuple[str, ...]]:
    """Plain values as `read_lined` gives those of a file; each ``line`` is the number of the value's path of keys."""
    places: list[str] = []

    def lined(inner: Any, name: str) -> Lined:
        number = len(places)
        places.append(name)
        if isinstance(inner, dict):
            inner = {key: lined(one, f"{name}.{key}".removeprefix(".")) for key, one in inner.items()}
        elif isinstance(inner, list):
            inner = [lined(one, f"{name}[{index}]") for index, one in enumerate(inner)]
        return Lined(number, inner, number)

    return lined(value, ""), tuple(places)


def fail(path: Path | str, line: int, message: str) -> NoReturn:
    """Raise a `MotionloomError` that names file and line."""
    raise MotionloomError(f"{path}, line {line}: {message}")


def read_lined(path: Path | str, *, max_bytes: int = 32_000_000) -> Lined:
    """The one document of a YAML file; `MotionloomError` with the line for whatever is wrong with it."""
    return parse_lined(read_text(path, max_bytes=max_bytes), path)


def parse_lined(data: bytes, path: Path | str) -> Lined:
    """The one document of YAML in plain text (`core.files.text.plain_text`); ``path``: its file, or what it is."""
    import yaml  # here, since commands that read no such file need not wait for it

    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        fail(path, data.count(b"\n", 0, error.start) + 1, "this is not UTF-8 text; save the file as UTF-8")
    try:
        return _build(yaml.parse(data, Loader=_loader()), path)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        fail(path, mark.line + 1 if mark else 1, f"this is not YAML: {' '.join(str(error.problem).split())[:200]}")
    except yaml.YAMLError as error:
        at = getattr(error, "position", 0)
        reason = " ".join(str(getattr(error, "reason", "it cannot be read")).split())
        fail(path, data.count(b"\n", 0, at if isinstance(at, int) else 0) + 1, f"this is not YAML: {reason[:200]}")


def _loader() -> Any:
    import yaml

    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Open:
    """A list or mapping that is being filled."""

    def __init__(self, line: int, values: list[Lined] | dict[str, Lined]) -> None:
        self.line, self.values = line, values
        self.key: str | None = None
        self.key_line = 0

    @property
    def needs_key(self) -> bool:
        return isinstance(self.values, dict) and self.key is None


def _build(events: Iterator[Any], path: Path | str) -> Lined:
    import yaml

    top: Lined | None = None
    stack: list[_Open] = []
    values = 0
    for event in events:
        kind, line = type(event), event.start_mark.line + 1
        if kind in (yaml.StreamStartEvent, yaml.StreamEndEvent, yaml.DocumentEndEvent):
            continue
        if kind is yaml.DocumentStartEvent:
            if top is not None:
                fail(path, line, "a second document begins here ('---'); write one document in a file")
            continue
        if kind in (yaml.MappingEndEvent, yaml.SequenceEndEvent):
            opened = stack.pop()
            item = Lined(opened.line, opened.values)
        else:
            _refuse_clever(event, kind, path, line)
            values += 1
            if kind is not yaml.ScalarEvent:
                if len(stack) >= MAX_DEPTH:
                    fail(path, line, f"values lie in each other more than {MAX_DEPTH} deep")
                if stack and stack[-1].needs_key:
                    fail(path, line, "a key must be one word, not a list or mapping")
                stack.append(_Open(line, {} if kind is yaml.MappingStartEvent else []))
                continue
            check_text(event.value, f"{path}, line {line}: this")
            if values > MAX_VALUES:
                fail(path, line, f"the file holds more than {MAX_VALUES:,} values")
            if stack and stack[-1].needs_key:
                if event.value in stack[-1].values:
                    fail(path, line, f"the key {shown(event.value)} stands here a second time; drop one of them")
                stack[-1].key, stack[-1].key_line = event.value, line
                continue
            item = Lined(line, _scalar(event, path, line))
        if stack:
            _add(stack[-1], item, path)
        else:
            top = item
    if top is None:
        raise MotionloomError(f"{path} holds nothing but comments")
    return top


def _refuse_clever(event: Any, kind: type, path: Path | str, line: int) -> None:
    import yaml

    if kind is yaml.AliasEvent or event.anchor is not None:
        fail(path, line, f"anchors and aliases ({shown('&' + str(event.anchor))}) are not read; write the value out")
    if event.tag is not None:
        fail(path, line, f"tags ({shown(str(event.tag))}) are not read; write the value without it")


def _add(opened: _Open, item: Lined, path: Path | str) -> None:
    if len(opened.values) >= MAX_ITEMS:
        fail(path, item.line, f"more than {MAX_ITEMS:,} in one list are not read; split the file")
    if isinstance(opened.values, list):
        opened.values.append(item)
        return
    assert opened.key is not None
    opened.values[opened.key] = Lined(item.line, item.value, opened.key_line)
    opened.key = None


def _scalar(event: Any, path: Path | str, line: int) -> bool | int | float | str | None:
    """Quoted words are words; plain ones may be numbers, true, false or nothing."""
    text: str = event.value
    if not event.implicit[0]:
        return text
    if text in _WORDS:
        return _WORDS[text]
    if _NOT_FINITE.fullmatch(text):
        fail(path, line, f"{shown(text)} is not a finite number")
    if not _NUMBER.fullmatch(text):
        return text
    if len(text) > MAX_DIGITS:
        fail(path, line, f"a number of {len(text)} digits is not read")
    value = int(text) if _WHOLE.fullmatch(text) else float(text)
    if abs(value) > 1e300:
        fail(path, line, f"{shown(text)} is too large a number")
    return value


def line_of(node: Lined, message: str) -> int:
    """The line of what a message names as ``'joints[1].points[3].time'``; that of the whole where it names none."""
    named = re.match(r"'([\w.\[\]]+)' ", message)
    line = node.key_line or node.line
    for step in re.findall(r"\w+", named[1]) if named else ():
        inner = node.value
        if isinstance(inner, dict) and step in inner:
            node = inner[step]
        elif isinstance(inner, list) and step.isdecimal() and int(step) < len(inner):
            node = inner[int(step)]
        else:
            return line
        line = node.key_line or node.line
    return line
