"""Several files that appear together in a folder: all of them or none."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import check_place, new_part
from motionloom.core.interruption import held_back


def check_folder(path: Path | str) -> Path:
    """The folder (of a link, what it points to), if files could be written there or it could be created.

    Raises `MotionloomError` if it is a file, may not be written to, or is to lie in a folder that is missing.
    """
    path = Path(path)
    try:
        if not path.is_dir():
            if path.exists():
                raise MotionloomError(f"cannot write to {path}: it is a file; name a folder")
            return check_place(path)
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: links that point to each other
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"cannot write to {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise MotionloomError(f"cannot write to {path}: the folder may not be written to")
    return path.resolve()


@contextmanager
def atomic_folder(path: Path | str) -> Iterator[Path]:
    """Give a fresh, hidden folder to write files to, and move them into the folder ``path`` when the block ends well.

    A folder that is missing is created, and appears with all of its files at once. In one that is there, files of the
    same names are replaced, and others stay. On any error nothing is left of what was written. Raises `MotionloomError`
    like `check_folder`, and where the system refuses.
    """
    target = check_folder(path)
    there = target.is_dir()
    temporary: Path | None = None
    try:
        with new_part(target if there else target.parent, is_folder=True) as temporary:
            yield temporary
            with held_back():  # all of them or none
                _move(temporary, target, there=there)
    except MotionloomError as error:  # of a file in the hidden folder: name the one of the call
        if temporary is None or str(temporary) not in str(error):
            raise
        raise MotionloomError(str(error).replace(str(temporary), str(path))) from error
    except OSError as error:
        if temporary is None or _within(error.filename, temporary):
            raise MotionloomError(f"cannot write to {path}: {error.strerror or error}") from error
        raise


def _within(name: object, folder: Path) -> bool:
    """Whether a system's error is about the hidden folder (or names nothing): its message must not name that one."""
    return name is None or (isinstance(name, str | Path) and Path(name).is_relative_to(folder))


def _move(temporary: Path, target: Path, *, there: bool) -> None:
    if not there:
        temporary.rename(target)
        return
    for file in sorted(temporary.iterdir()):
        file.replace(target / file.name)
