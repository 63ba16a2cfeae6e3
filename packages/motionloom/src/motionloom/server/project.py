"""The project folder: motions, characters and the project's JSON, the only place that the server reads and writes.

    project.json            what the page saves
    project.DAY-TIME.json   what was there before and was put aside, since the page could not read it
    projects/NAME.json      another project, as it was saved last (`shelf.py`)
    motions/ID.npz          a motion; ID.2.npz, ID.3.npz, ... are the other people in its world
    motions/ID.json         what is known of it; written last, so that a motion without it is not there
    characters/ID.glb       a character (.glb, .gltf, .vrm, .bvh) or the skeleton of AMC files (.asf)
    characters/ID.json      its name, and its joints where somebody named them
    temporary/              files on their way in or out; emptied at the start
    exports/                files for an assistant
    lock                    held by the one server that has the folder open

Names are generated here and are 16 hexadecimal digits: nothing that a client sends becomes part of a path.
"""

import json
import os
import re
import secrets
import shutil
import threading
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.files.npz_writer import save_npz
from motionloom.core.files.text import stored_json
from motionloom.core.motion import Motion
from motionloom.formats import characters
from motionloom.io.npz import load_npz
from motionloom.server.limits import Limits
from motionloom.server.refusal import Refusal
from motionloom.server.shelf import Shelf

try:
    import fcntl
except ImportError:  # no such locks on this system
    fcntl = None

ID = re.compile(r"[0-9a-f]{16}")
CHARACTERS = (*characters(alone=True), ".bvh", ".asf")
CACHED = 24
"""Motions that stay in memory."""
STALE = 3600.0
"""Seconds after which a file on its way is not on its way any more: whoever waited for it is gone."""


@dataclass(frozen=True, eq=False)
class Stored:
    """A motion of the project, of one person or several in one world."""

    id: str
    people: tuple[Motion, ...]
    about: dict[str, Any] = field(default_factory=dict)
    """Task, prompt, seed and what else is known of it; plain JSON."""


def _own(path: Path) -> int | None:
    """Hold a lock on a file as long as the process lives; MotionloomError where another one does."""
    if fcntl is None:
        return None
    file = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(file)
        raise MotionloomError(
            f"another server has the project folder {path.parent} open; end it, or name another folder with --project"
        ) from None
    except OSError:  # a file system without locks
        pass
    return file


class Project:
    """A project folder that one server owns; safe to use from several threads."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.folder, self.limits = folder.resolve(), limits
        self.motions, self.characters = self.folder / "motions", self.folder / "characters"
        self.temporary, self.adapters = self.folder / "temporary", self.folder / "adapters"
        self._lock = threading.RLock()
        self._cache: OrderedDict[str, Stored] = OrderedDict()
        try:
            for place in (self.motions, self.characters, self.temporary, self.adapters):
                place.mkdir(parents=True, exist_ok=True)
            self._owned = _own(self.folder / "lock")
            self.shelf = Shelf(self.folder / "projects")
            for left in self.temporary.iterdir():
                shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()
        except OSError as error:
            raise MotionloomError(
                f"the project folder {folder} cannot be used: {error.strerror or error}; name another with --project"
            ) from None
        self._sizes = {
            p.name: p.stat().st_size
            for p in sorted(self.motions.iterdir(), key=lambda p: (p.stat().st_mtime_ns, p.name))
        }
        self._order = [name[:-5] for name in self._sizes if name.endswith(".json")]

    def part(self, suffix: str = "") -> Path:
        """A fresh name in the folder for what is on its way; what others left there long ago is removed."""
        for left in self.temporary.iterdir():
            with suppress(OSError):
                if time.time() - left.stat().st_mtime > STALE:
                    left.unlink()
        return self.temporary / f"{secrets.token_hex(8)}{suffix}"

    def without_paths(self, sentence: str) -> str:
        """A sentence of the library with the server's folders taken out of it."""
        for place in (self.temporary, self.motions, self.characters, self.folder):
            sentence = sentence.replace(f"{place}{os.sep}", "")
            sentence = re.sub(f"(?:the folder )?{re.escape(str(place))}", "the project folder", sentence)
        return sentence

    # -- motions

    def add(self, people: Sequence[Motion], about: dict[str, Any]) -> Stored:
        """Keep a motion; the oldest ones that the project does not name make room for it."""
        stored = Stored(secrets.token_hex(8), tuple(people), about)
        about = {**about, "people": len(stored.people)}
        places = [self.motions / _file(stored.id, number) for number in range(len(stored.people))]
        try:
            for person, place in zip(stored.people, places, strict=True):
                save_npz(person, place, packed=False)
            self._write(self.motions / f"{stored.id}.json", json.dumps(about).encode())
        except BaseException:
            for place in places:  # all of it or nothing
                place.unlink(missing_ok=True)
            raise
        with self._lock:
            for number in range(len(stored.people)):
                name = _file(stored.id, number)
                self._sizes[name] = (self.motions / name).stat().st_size
            self._sizes[f"{stored.id}.json"] = 0
            self._order.append(stored.id)
            self._remember(stored)
            self._make_room(stored.id)
        return stored

    def motion(self, name: Any) -> Stored:
        """The motion of that id; raises `Refusal` 404 where there is none."""
        if not isinstance(name, str) or not ID.fullmatch(name):
            raise Refusal(404, "there is no such motion: an id is 16 hexadecimal digits, as the server gave it")
        with self._lock:
            if name in self._cache:
                self._cache.move_to_end(name)
                return self._cache[name]
        about, count = self._about(name)
        try:
            people = tuple(load_npz(self.motions / _file(name, number)) for number in range(count))
        except (OSError, ValueError):
            raise Refusal(404, f"the files of motion {name} are damaged; make it anew") from None
        stored = Stored(name, people, about)
        with self._lock:
            self._remember(stored)
        return stored

    def _about(self, name: str) -> tuple[dict[str, Any], int]:
        """What is known of a motion, and how many people are in it."""
        about = _mapping(self.motions / f"{name}.json")
        if about is None:
            raise Refusal(404, f"there is no motion {name}; it was never made, or made room for newer ones")
        count = about.pop("people", None)
        if not isinstance(count, int) or not 1 <= count <= self.limits.people:
            raise Refusal(404, f"what is known of motion {name} is damaged; make it anew")
        return about, count

    def _remember(self, stored: Stored) -> None:
        self._cache[stored.id] = stored
        while len(self._cache) > CACHED:
            self._cache.popitem(last=False)

    def _make_room(self, newest: str) -> None:
        """Remove the oldest motions that no project names while there are too many or too much of them."""
        while len(self._order) > self.limits.motions or sum(self._sizes.values()) > self.limits.stored_bytes:
            named = (self.read_project() or b"") + self.shelf.data()
            old = next((one for one in self._order if one != newest and one.encode() not in named), None)
            if old is None:
                return
            self._order.remove(old)
            self._cache.pop(old, None)
            for name in [name for name in self._sizes if name.startswith(old)][::-1]:
                (self.motions / name).unlink(missing_ok=True)
                del self._sizes[name]

    # -- characters and skeletons

    def add_character(self, part: Path, name: str, suffix: str, joints: Mapping[str, str] | None = None) -> str:
        """Take a file that `part` named into the project, with the joints that somebody named; gives its id."""
        with self._lock:
            if sum(1 for _ in self.characters.glob("*.json")) >= self.limits.uploads:
                raise Refusal(409, f"the project holds {self.limits.uploads} characters already; begin another project")
            identifier = secrets.token_hex(8)
            place = self.characters / f"{identifier}{suffix}"
            os.replace(part, place)
            about = {"name": name, "suffix": suffix, **({"joints": dict(joints)} if joints else {})}
            try:
                self._write(self.characters / f"{identifier}.json", json.dumps(about).encode())
            except BaseException:
                place.unlink(missing_ok=True)
                raise
        return identifier

    def character(self, name: Any) -> tuple[Path, str]:
        """The file of that id and its name; raises `Refusal` 404 where there is none."""
        if isinstance(name, str) and ID.fullmatch(name):
            about = _mapping(self.characters / f"{name}.json") or {}
            if about.get("suffix") in CHARACTERS and isinstance(about.get("name"), str):
                place = self.characters / f"{name}{about['suffix']}"
                if place.is_file():
                    return place, about["name"]
        raise Refusal(404, "there is no such character; send it first with POST /characters?name=hero.glb")

    def named_joints(self, name: str) -> dict[str, str]:
        """The joints of a character that somebody named, of the 22 by name."""
        joints = (_mapping(self.characters / f"{name}.json") or {}).get("joints", {})
        return {str(part): str(joint) for part, joint in joints.items()} if isinstance(joints, dict) else {}

    # -- the project's JSON

    def read_project(self) -> bytes | None:
        """What was saved last, or None."""
        try:
            return (self.folder / "project.json").read_bytes()
        except FileNotFoundError:
            return None

    def saved_version(self) -> object:
        """Something that is another when the saved JSON is; None where nothing was saved."""
        try:
            about = (self.folder / "project.json").stat()
        except FileNotFoundError:
            return None
        return about.st_ino, about.st_size, about.st_mtime_ns

    def put_aside(self, stem: str) -> str | None:
        """Give the saved JSON another name that begins so; returns it, None where nothing was saved."""
        with self._lock:
            for number in range(1, 1000):
                name = f"{stem}.json" if number == 1 else f"{stem}-{number}.json"
                if (self.folder / name).exists():
                    continue
                try:
                    os.rename(self.folder / "project.json", self.folder / name)
                except FileNotFoundError:
                    return None
                return name
        raise Refusal(409, "the folder is full of projects that were put aside; move some away")

    def save_project(self, data: bytes) -> None:
        """Save the JSON: after a crash the folder holds the old or the new one, whole."""
        with self._lock:
            self._write(self.folder / "project.json", data, durable=True)

    def _write(self, path: Path, data: bytes, *, durable: bool = False) -> None:
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            file.write(data)
            if durable:
                file.flush()
                os.fsync(file.fileno())


def _mapping(path: Path) -> dict[str, Any] | None:
    """The JSON object of a file, empty where it is damaged; None where there is no file."""
    try:
        value = stored_json(path.read_bytes(), path.name)
    except OSError:
        return None
    except MotionloomError:
        return {}
    return value if isinstance(value, dict) else {}


def _file(name: str, number: int) -> str:
    return f"{name}.npz" if number == 0 else f"{name}.{number + 1}.npz"
