"""Paths that a data set's own files name."""

from pathlib import Path

from motionloom.errors import MotionloomError


def inside(folder: Path, relative: str) -> Path:
    """``folder/relative``; raises MotionloomError where that leads out of the folder."""
    path = (folder / relative).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise MotionloomError(f"{relative!r} leads out of {folder}; paths must stay inside the data folder")
    return path
