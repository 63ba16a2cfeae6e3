"""Writing files so that nobody ever sees half of one."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motionloom.errors import MotionloomError


@contextmanager
def atomic_path(path: Path | str) -> Iterator[Path]:
    """Give a fresh path beside ``path`` to write to, and move it into place when the block ends well.

    The temporary name keeps the suffix. On any error the temporary file goes and what stood at ``path`` stays.
    Raises `MotionloomError` if ``path`` is a folder, or lies in a folder that is missing or cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise MotionloomError(f"cannot write {path}: it is a folder; add a file name")
    target = path.resolve() if path.is_symlink() else path  # write through a link, do not replace it
    folder = target.parent
    if not folder.is_dir():
        raise MotionloomError(f"cannot write {path}: the folder {folder} does not exist; make it first")
    temporary = folder / f".{secrets.token_hex(6)}.part{target.suffix}"
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except (OSError, ValueError) as error:
        raise MotionloomError(f"cannot write {path}: {getattr(error, 'strerror', None) or error}") from None
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        if error.filename in (str(temporary), None):  # such as a full disk: name the file the user asked for
            raise MotionloomError(f"cannot write {path}: {error.strerror or error}") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)
