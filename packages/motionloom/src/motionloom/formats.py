"""File formats of motion, by suffix: what reads and writes each, and what may be said of it.

``formats.toml`` lists ours. Functions are named as ``module:function`` and imported when a file is read or written, so
that all formats can be listed, as ``--help`` does, before any of them is opened. A package of your own adds one with
`register`, or by an entry point of the group `GROUP` that is named as the suffix without its dot and is a `Format`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motionloom.core.reading import read_table

GROUP = "motionloom.formats"


@dataclass(frozen=True)
class Format:
    """One kind of file."""

    suffix: str
    """In small letters, with its dot."""
    reader: str | Callable[..., Any] = ""
    """``(path, **options) -> Motion`` in metres; empty: it is not read."""
    options: tuple[str, ...] = ()
    """Those of ``fps``, ``unit``, ``up``, ``asf`` and ``clip`` that the reader takes; else the first three come after
    it."""
    any_up: bool = False
    """It does not say which way is up, which is found by how the person moves."""
    clips: bool = False
    """It holds several animations, of which ``clip`` picks one."""
    people: str | Callable[..., Any] = ""
    """``(path) -> list[Motion]``: everybody in it, in one world; empty: it holds one person."""
    writer: str | Callable[..., Any] = ""
    """``(motions, path) -> path``; empty: it is not written."""
    single: bool = False
    """It holds one person: the writer takes one motion instead of several."""
    labels: str = ""
    """The keyword by which the writer takes a word for each motion: ``names``, ``captions``, or none."""
    scene: str | Callable[..., Any] = ""
    """``(motions, path, caption) -> path`` for people of one world, where the writer would show them apart."""
    character: str | Callable[..., Any] = ""
    """``(path, joint_map=) -> Character`` of `motionloom.io.character`: a humanoid that is written with its motions."""
    needs: str | Callable[..., Any] = ""
    """Raises `MotionloomError` where a program that the writer needs is missing; called before long work."""


FORMATS = {
    suffix: Format(suffix, **row | {"options": tuple(row.get("options", ()))})
    for suffix, row in read_table("motionloom", "formats.toml").items()
}
"""Every format, by its suffix."""


def register(*formats: Format) -> None:
    """Add formats, or replace those of the same suffixes, for this process."""
    FORMATS.update({one.suffix: one for one in formats})


def find(path: Path | str) -> Format:
    """The format of a path by its suffix; one that neither reads nor writes where nothing knows it."""
    suffix = Path(path).suffix.lower()
    if suffix and suffix not in FORMATS:
        from importlib.metadata import entry_points

        register(*(one.load() for one in entry_points(group=GROUP, name=suffix[1:])))
    return FORMATS.get(suffix, Format(suffix))


def readable() -> tuple[str, ...]:
    """Suffixes of files that are read."""
    return tuple(suffix for suffix, one in FORMATS.items() if one.reader)


def writable(*, single: bool | None = None) -> tuple[str, ...]:
    """Suffixes of files that are written; ``single``: only those that hold one person, or only the others."""
    return tuple(suffix for suffix, one in FORMATS.items() if one.writer and single in (None, one.single))


def characters(*, alone: bool = False) -> tuple[str, ...]:
    """Suffixes of files of characters; ``alone``: only those that need no other program."""
    return tuple(suffix for suffix, one in FORMATS.items() if one.character and not (alone and one.needs))


def with_clips() -> tuple[str, ...]:
    """Suffixes of files that hold several animations."""
    return tuple(suffix for suffix, one in FORMATS.items() if one.clips)
