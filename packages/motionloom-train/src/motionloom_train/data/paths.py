"""Paths that a data set's own files name, and what damaged files raise."""

import csv
from contextlib import suppress
from pathlib import Path

from safetensors import SafetensorError

from motionloom.core.errors import MotionloomError

DAMAGED = (
    *(OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError),
    *(csv.Error, SafetensorError),
)
"""What is raised where values are taken out of a file that is damaged or of another kind."""


def inside(folder: Path, relative: str) -> Path:
    """``folder/relative``; raises MotionloomError where that is outside of the folder, or is no path at all."""
    try:
        path, base = (folder / relative).resolve(), folder.resolve()
        with suppress(FileNotFoundError, NotADirectoryError):
            path.lstat()
    except (OSError, ValueError, RuntimeError) as error:  # NUL, a name too long, links that lead to each other
        raise MotionloomError(f"{relative[:80]!r} is no path of a file in {folder} ({error})") from None
    if not path.is_relative_to(base):
        raise MotionloomError(f"{relative[:80]!r} leads out of {folder}; paths must stay inside the data folder")
    return path
