"""Finished pieces of a long run, each in a small file of its own, so that a run that was stopped goes on.

``FOLDER/parts/NAME.json`` holds a piece's numbers and the fingerprint of the settings that gave them.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motionloom.errors import MotionloomError
from motionloom.io.text import plain_json
from motionloom.reading import read_bytes
from motionloom_lab.report.files import write_json

LARGEST = 1 << 20


def fingerprint(settings: Mapping[str, Any]) -> str:
    """Changes whenever a setting does; settings are plain JSON data."""
    said = json.dumps(settings, sort_keys=True, allow_nan=False)
    return hashlib.sha256(said.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Parts:
    """The pieces of one run. Without a folder nothing is kept and nothing found."""

    folder: Path | None
    settings: str
    """`fingerprint` of everything that changes a piece's numbers."""

    def path(self, name: str) -> Path | None:
        """Where the piece lies; the name is made safe for a file."""
        return self.folder / "parts" / f"{re.sub(r'[^a-z0-9]+', '-', name.lower())}.json" if self.folder else None

    def find(self, name: str) -> dict[str, float] | None:
        """The numbers of a piece that is finished, None otherwise; MotionloomError for one of another run."""
        path = self.path(name)
        if path is None or not path.is_file():
            return None
        try:
            found = plain_json(read_bytes(path, max_bytes=LARGEST))
            settings, numbers = str(found["settings"]), {str(k): float(v) for k, v in found["numbers"].items()}
            if not all(map(math.isfinite, numbers.values())):
                raise ValueError("it holds numbers that are not finite")
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            raise MotionloomError(f"{path} is not a part of this run ({error}); delete it to go on") from None
        if settings != self.settings:
            raise MotionloomError(
                f"{path} was made with other settings; name another --out folder or delete {path.parent}"
            )
        return numbers

    def keep(self, name: str, numbers: Mapping[str, float]) -> None:
        """Write a finished piece, whole or not at all."""
        path = self.path(name)
        if path is not None:
            write_json(path, {"settings": self.settings, "numbers": dict(numbers)})

    def once(
        self,
        name: str,
        make: Callable[[], Mapping[str, float]],
        line: Callable[[Mapping[str, float]], str] | None = None,
        progress: Callable[[str], None] = lambda line: None,
    ) -> dict[str, float]:
        """The numbers of a piece: kept ones, or made and kept now, which ``line`` says in a line for ``progress``."""
        found = self.find(name)
        if found is None:
            found = dict(make())
            self.keep(name, found)
            if line is not None:
                progress(line(found))
        return found
