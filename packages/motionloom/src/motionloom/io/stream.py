"""Files that are written while the motion is being generated, so that an hour needs no more memory than a minute.

A BVH file grows on the disk. The other formats need the whole motion: their pieces are kept and saved at the end.
Either way the file appears whole, at its place, when the stream is closed, also after an interruption.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from io import FileIO
from pathlib import Path
from types import TracebackType

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.files.bvh_writer import GrowingBvh
from motionloom.core.interruption import held_back
from motionloom.core.motion import MAX_POSES, Motion
from motionloom.io import check_output, save

MAX_BVH_FRAMES = 2_500_000
"""Of a person of 22 joints: a file of 1.8 GB, 34 hours; larger ones are read by nobody, not by this project either."""
MAX_GIF_SECONDS = 60.0
PERSON = 22
"""Joints of the person that is meant where nobody says how many there are."""


class Stream(ABC):
    """A motion file to which pieces are added; all of one skeleton and rate, and of bones of constant lengths.

    As a context manager it is closed at the end of the block. If the block ends with an error or an interruption,
    what was written so far becomes a valid file; if that is nothing, nothing is left and an older file stays.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames = 0
        """Frames that are safe: they will be in the file."""
        self._like: Motion | None = None
        self.saved = False
        """Whether the file is in its place."""
        self._closed = False

    @property
    def seconds(self) -> float:
        """Length of what is safe."""
        return self.frames / self._like.fps if self._like else 0.0

    def write(self, piece: Motion) -> None:
        """Add frames; raises `MotionloomError` if they do not go on from those before, or cannot be written."""
        if self._closed:
            raise MotionloomError(f"{self.path} is closed; nothing can be added to it")
        if piece.translations is not None:
            raise MotionloomError(f"{self.path}: a motion whose bones change length cannot be written piece by piece")
        if self._like is None:
            self._like = piece.frames(0, 1)
        elif piece.skeleton != self._like.skeleton or piece.fps != self._like.fps:
            raise MotionloomError(f"{self.path}: a piece has another skeleton or frame rate than those before it")
        self._write(piece)

    def close(self) -> Path | None:
        """Put the file in its place and give its path; None, and no file, if nothing was written."""
        if self._closed:
            return self.path if self.saved else None
        with held_back():
            self._closed = True
            if not self.frames:
                self._drop()
                return None
            self._finish()
            self.saved = True
        return self.path

    def __enter__(self) -> "Stream":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    @abstractmethod
    def _write(self, piece: Motion) -> None: ...

    @abstractmethod
    def _finish(self) -> None: ...

    @abstractmethod
    def _drop(self) -> None: ...


def open_stream(
    path: Path | str,
    *,
    total: int | None,
    fps: float = 20.0,
    caption: str = "",
    joints: int = PERSON,
    order: str | Mapping[str, str] = "ZXY",
    unit: float = 1.0,
) -> Stream:
    """A file to be written piece by piece; the suffix picks the format as in `save`, and nothing is written yet.

    ``total`` is the number of frames to come if that is known; with it what the format cannot hold is refused now
    and not after hours of work. ``caption`` labels pictures and films; ``order`` and ``unit`` are those of a BVH, as
    in `save_bvh`. Raises `MotionloomError` like `check_output`.
    """
    path = check_output(path)
    if total is not None:
        check_length(path, total=total, fps=fps, joints=joints)
    if path.suffix.lower() == ".bvh":
        return _Growing(path, partial(GrowingBvh, order=order, unit=unit, frames=total))
    return Kept(path, lambda whole: save(whole, path, captions=[caption]))


def check_length(path: Path, *, total: int, fps: float, joints: int = PERSON) -> None:
    """Refuse more frames of so many joints than the format, or this machine's memory, can hold."""
    suffix = path.suffix.lower()
    poses = MAX_BVH_FRAMES * PERSON if suffix == ".bvh" else MAX_POSES
    most = poses // max(joints, PERSON)
    most = min(most, int(MAX_GIF_SECONDS * fps)) if suffix == ".gif" else most
    if total > most:
        better = "write an .mp4 or .bvh, or" if suffix == ".gif" else "split it, or"
        raise MotionloomError(
            f"{path} would have {total:,} frames ({total / fps / 3600:.3g} h) and at most {most:,} fit into such a "
            f"file; {better} make it shorter"
        )


class _Growing(Stream):
    """BVH: on the disk, in a file beside the target, until it is closed."""

    def __init__(self, path: Path, begin: Callable[[FileIO, Motion], GrowingBvh]) -> None:
        super().__init__(path)
        self._begin = begin
        self._stack = ExitStack()
        self._bvh: GrowingBvh | None = None

    def _write(self, piece: Motion) -> None:
        try:
            if self._bvh is None:
                temporary = self._stack.enter_context(atomic_path(self.path))
                file = self._stack.enter_context(temporary.open("wb", buffering=0))
                self._bvh = self._begin(file, piece)
            self._bvh.write(piece)
        except OSError as error:
            raise MotionloomError(f"cannot write {self.path}: {error.strerror or error}") from error
        finally:
            self.frames = self._bvh.frames if self._bvh else 0

    def _finish(self) -> None:
        with self._stack:  # moves the file into place, or removes it if that fails
            if self._bvh:
                self._bvh.finish()

    def _drop(self) -> None:
        with suppress(_Dropped), self._stack:
            raise _Dropped  # an error is what makes `atomic_path` remove its file


class _Dropped(Exception):
    """Nothing was written."""


class Kept(Stream):
    """A file that needs the whole motion: ``write`` is called with it at the end."""

    def __init__(self, path: Path, write: Callable[[Motion], object]) -> None:
        super().__init__(path)
        self._save = write
        self._pieces: list[Motion] = []

    def _write(self, piece: Motion) -> None:
        self._pieces.append(piece)
        self.frames += len(piece)

    def _finish(self) -> None:
        whole, self._pieces = joined(self._pieces), []
        self._save(whole)

    def _drop(self) -> None:
        self._pieces = []


def joined(motions: Sequence[Motion]) -> Motion:
    """Motions of one skeleton and rate, one after the other, as one motion."""
    moved = None
    if any(motion.translations is not None for motion in motions):
        rest = motions[0].skeleton.offsets[None]
        pieces = [m.translations if m.translations is not None else rest.repeat(len(m), axis=0) for m in motions]
        moved = np.concatenate(pieces)
    root = np.concatenate([motion.root for motion in motions])
    rotations = np.concatenate([motion.rotations for motion in motions])
    return replace(motions[0], root=root, rotations=rotations, translations=moved)


def resampled(pieces: Iterable[Motion], fps: float) -> Iterator[Motion]:
    """Pieces at another frame rate, without seams: together they are the joined motion's `Motion.resample`.

    Each piece is held back by its last frame, between which and the next piece new frames may lie.
    """
    carried: Motion | None = None
    first = total = 0  # the frame of the whole motion that ``part`` begins with; frames yielded so far
    for piece in pieces:
        if piece.fps == fps and carried is None:
            yield piece
            continue
        part = piece if carried is None else joined([carried, piece])
        last = first + len(part) - 1
        count = int(np.floor(last / part.fps * fps + 1e-6)) + 1
        if count > total:
            yield part.at(np.arange(total, count) * (part.fps / fps) - first, fps)
        carried, first, total = part.frames(len(part) - 1, len(part)), last, count
