"""What a reader of files from outside is to the fuzzer, and the list of them all."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Reader:
    """Somebody who reads files."""

    name: str
    make: Callable[[Path], object]
    """Write good files into a folder."""
    kinds: dict[str, str]
    """The files that are damaged, by path in the folder, and what they are made of (`mutations.KINDS`)."""
    read: Callable[[Path], object]
    """Read the folder, all of it that is ever read, so that what is lazy is read too."""
    weight: int = 20
    """How often it is its turn."""


READERS: list[Reader] = []


def reader(
    name: str, make: Callable[[Path], object], kinds: dict[str, str], read: Callable[[Path], Any], *, weight: int = 20
) -> None:
    READERS.append(Reader(name, make, kinds, read, weight))


def say(line: str) -> None:
    """What is told of recordings that are left out must be one line too."""
    assert "\n" not in line, line
