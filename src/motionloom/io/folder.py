"""Several files that appear together in a folder: all of them or none."""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.atomic import check_place


def check_folder(path: Path | str) -> Path:
    """The folder (where a link leads, the place it leads to), if files could be put there or it could be made.

    Raises `MotionloomError` if it is a file, may not be written to, or is to lie in a folder that is missing.
    """
    path = Path(path)
    try:
        if not path.is_dir():
            if path.exists():
                raise MotionloomError(f"cannot write to {path}: it is a file; name a folder")
            return check_place(path)
    except (OSError, ValueError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"cannot write to {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise MotionloomError(f"cannot write to {path}: the folder may not be written to")
    return path.resolve()


@contextmanager
def atomic_folder(path: Path | str) -> Iterator[Path]:
    """Give a fresh, hidden folder to write files to, and put them into the folder ``path`` when the block ends well.

    A folder that is missing is made, and appears with all of its files at once. In one that is there, files of the same
    names are replaced, and others stay. On any error nothing is left of what was written. Raises `MotionloomError` like
    `check_folder`, and where the system refuses.
    """
    target = check_folder(path)
    there = target.is_dir()
    temporary = (target if there else target.parent) / f".{secrets.token_hex(6)}.part"
    try:
        temporary.mkdir()
    except OSError as error:
        raise MotionloomError(f"cannot write to {path}: {error.strerror or error}") from None
    try:
        yield temporary
        try:
            _put(temporary, target, there=there)
        except OSError as error:
            raise MotionloomError(f"cannot write to {path}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _put(temporary: Path, target: Path, *, there: bool) -> None:
    if not there:
        temporary.rename(target)
        return
    for file in sorted(temporary.iterdir()):
        file.replace(target / file.name)
