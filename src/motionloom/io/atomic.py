"""Writing files so that nobody ever sees half of one."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motionloom.errors import MotionloomError


def check_place(path: Path | str) -> Path:
    """The path (where a link leads, the place it leads to), if a file could be made there.

    Raises `MotionloomError` if it is a folder, its name is impossible, or its folder is missing or not writable.
    """
    path = Path(path)
    try:
        path.lstat()
        target = path.resolve()
    except FileNotFoundError:
        target = path
    except (OSError, ValueError) as error:
        raise MotionloomError(f"cannot write {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    folder = target.parent
    if target.is_dir():
        raise MotionloomError(f"cannot write {path}: it is a folder; add a file name")
    if not folder.is_dir():
        raise MotionloomError(f"cannot write {path}: the folder {folder.absolute()} does not exist; make it first")
    if not os.access(folder, os.W_OK):
        raise MotionloomError(f"cannot write {path}: the folder {folder.absolute()} may not be written to")
    return target


@contextmanager
def atomic_path(path: Path | str) -> Iterator[Path]:
    """Give a fresh path beside ``path`` to write to, and move it into place when the block ends well.

    The temporary name keeps the suffix. On any error the temporary file goes and what stood at ``path`` stays.
    Raises `MotionloomError` if ``path`` is a folder, or lies in a folder that is missing or cannot be written.
    """
    target = check_place(path)
    temporary = target.parent / f".{secrets.token_hex(6)}.part{target.suffix}"
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except OSError as error:
        raise MotionloomError(f"cannot write {path}: {error.strerror or error}") from None
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        if error.filename in (str(temporary), None):  # such as a full disk: name the file the user asked for
            raise MotionloomError(f"cannot write {path}: {error.strerror or error}") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)
