"""The folder's other projects: each as it was saved last in a file of `projects`, ready to be opened again.

A file's name is a digest of the project's id: nothing that a client sends becomes part of a path.
"""

import hashlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.files.text import stored_json
from motionloom.server.refusal import Refusal

MOST = 500
"""Projects of one folder that are not open."""
LONGEST = 1e6
"""Seconds of one block; what is said to be longer is not counted."""
WORDS = 3
"""Blocks whose words a list of projects shows."""


class Shelf:
    """Projects that are not open, by their ids; the caller holds a lock."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def keep(self, name: str, data: bytes) -> None:
        """Keep a project; raises `Refusal` 507 where there are too many of them."""
        place = self._place(name)
        if not place.exists() and sum(1 for _ in self.folder.glob("*.json")) >= MOST:
            raise Refusal(507, f"the folder holds {MOST} projects already; move some out of its 'projects'")
        with atomic_path(place) as part, part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())

    def read(self, name: str) -> bytes | None:
        """The project with that id; None where there is none."""
        try:
            return self._place(name).read_bytes()
        except FileNotFoundError:
            return None

    def drop(self, name: str) -> None:
        """Forget the project with that id, which is open now."""
        self._place(name).unlink(missing_ok=True)

    def data(self) -> bytes:
        """All projects one after the other, to look for what they name."""
        return b"".join(place.read_bytes() for place in self.folder.glob("*.json"))

    def rows(self) -> Iterator[dict[str, Any]]:
        """What a list shows of each project, the one that was saved last first; what cannot be read is left out."""
        for place in sorted(self.folder.glob("*.json"), key=lambda place: -place.stat().st_mtime_ns):
            try:
                project = stored_json(place.read_bytes(), place.name)
            except (OSError, MotionloomError):
                continue
            if isinstance(project, dict) and isinstance(project.get("id"), str) and self._place(project["id"]) == place:
                yield row(project, place.stat().st_mtime)

    def _place(self, name: str) -> Path:
        return self.folder / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.json"


def row(project: dict[str, Any], saved: float) -> dict[str, Any]:
    """What a list shows of a project: its id and name, when it was saved, its first words and its kept motion."""
    segments = [one for one in _list(project.get("segments")) if isinstance(one, dict)]
    takes, index = _list(project.get("takes")), project.get("kept", 0)
    take = takes[index] if isinstance(index, int) and 0 <= index < len(takes) else None
    motion = take.get("motion") if isinstance(take, dict) else None
    seconds = [one.get("seconds") for one in segments]
    return {
        "id": project["id"],
        "name": str(project.get("name", ""))[:80],
        "saved": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(saved)),
        "words": [str(one.get("text", ""))[:120] for one in segments[:WORDS]],
        "blocks": len(segments),
        "seconds": round(sum(one for one in seconds if isinstance(one, int | float) and 0 <= one < LONGEST), 3),
        "motion": motion if isinstance(motion, str) else None,
    }


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
