"""Writing files so that nobody ever sees half of one, and listing those of a folder that are whole.

While a file is being written it has a hidden name beside its place, and its writer holds a lock on it. A process that
is killed leaves such a part behind, unlocked: `finished` never lists it, and the next writer in that folder removes it.
"""

import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.core.interruption import held_back

try:
    import fcntl
except ImportError:  # no such locks on this system: parts are never listed there, and never swept either
    fcntl = None

_PART = re.compile(r"\.[0-9a-f]{12}\.part(\..+)?")
_swept: set[Path] = set()
"""Folders in which this process has looked for parts that others left."""


def finished(folder: Path | str, *patterns: str) -> list[Path]:
    """The files of a folder that match a pattern as of `Path.glob`, by name, without hidden ones.

    What is hidden, or lies in a hidden folder below, is a part that some process is writing or was killed over.
    """
    folder = Path(folder)
    paths = {path for pattern in patterns for path in folder.glob(pattern)}
    return sorted(p for p in paths if not any(part.startswith(".") for part in p.relative_to(folder).parts))


def sweep(folder: Path) -> None:
    """Remove the parts in a folder whose writers are gone. Parts that somebody is writing are locked, and stay."""
    if fcntl is None:
        return
    for name in os.listdir(folder):
        if _PART.fullmatch(name):
            _remove_unlocked(folder / name)


def _lock(file: int) -> None:
    """Lock an open file; raises BlockingIOError where somebody else has, OSError where there are no locks."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _remove_unlocked(part: Path) -> None:
    try:
        file = os.open(part, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return  # gone already, or not ours to open
    try:
        _lock(file)
        if stat.S_ISDIR(os.fstat(file).st_mode):
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.unlink(missing_ok=True)
    except OSError:
        pass  # locked: somebody is writing it
    finally:
        os.close(file)


@contextmanager
def new_part(folder: Path, suffix: str = "", *, is_folder: bool = False) -> Iterator[Path]:
    """A fresh, hidden and locked file or folder to write to; it is removed at the end unless it was moved away.

    Raises OSError where the system refuses. Writers must write to the file that is there and not put another one in
    its place: that one would have no lock.
    """
    key = folder.resolve()
    if key not in _swept:
        _swept.add(key)
        sweep(folder)
    with ExitStack() as stack:
        with held_back():
            part, file = _new_part(folder, suffix, is_folder=is_folder)
            stack.callback(_remove, part, file, is_folder=is_folder)
        yield part


def _remove(part: Path, file: int, *, is_folder: bool) -> None:
    with held_back():
        if is_folder:
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.unlink(missing_ok=True)
        os.close(file)


def _new_part(folder: Path, suffix: str, *, is_folder: bool) -> tuple[Path, int]:
    while True:
        part = folder / f".{os.urandom(6).hex()}.part{suffix}"
        if is_folder:
            part.mkdir()
            file = os.open(part, os.O_RDONLY)
        else:
            file = os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
        try:
            _lock(file)
            if part.exists():  # nobody took it for a stale one between the two steps
                return part, file
        except BlockingIOError:
            pass
        except OSError:  # a file system without locks
            return part, file
        os.close(file)


def check_place(path: Path | str, *, folders: bool = False) -> Path:
    """The path (of a link, what it points to), if a file could be created there.

    folders: its folder and those above it may be missing, if they could be created. Nothing is created.
    Raises `MotionloomError` if it is a folder or another thing that is no file, its name is impossible, or its folder
    is missing or not writable.
    """
    path = Path(path)
    try:
        path.lstat()
        target = path.resolve()
        if target.exists() and not target.is_file() and not target.is_dir():
            raise MotionloomError(f"cannot write {path}: a pipe, socket or device is there; name a file")
    except FileNotFoundError:
        target = path
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: links that point to each other
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"cannot write {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    folder = _nearest(target) if folders else target.parent
    if target.is_dir():
        raise MotionloomError(f"cannot write {path}: it is a folder; add a file name")
    if not folder.is_dir():
        raise MotionloomError(f"cannot write {path}: the folder {folder.absolute()} does not exist; make it first")
    if not os.access(folder, os.W_OK):
        raise MotionloomError(f"cannot write {path}: the folder {folder.absolute()} may not be written to")
    return target


def _nearest(path: Path) -> Path:
    """The nearest folder above the path that is there, if the names between the two are possible ones."""
    folder, names = path.absolute().parent, [path.name]
    while not os.path.lexists(folder):
        names.append(folder.name)
        folder = folder.parent
    if not folder.is_dir():
        raise MotionloomError(f"cannot write {path}: {folder} is not a folder; name another place")
    for name in names:
        try:
            os.lstat(folder / name)
        except FileNotFoundError:
            continue
        except OSError as error:  # such as a name that is too long
            raise MotionloomError(f"cannot write {path}: {error.strerror or error}") from None
    return folder


@contextmanager
def with_folders(folder: Path) -> Iterator[None]:
    """The folder and those above it are there in the block; where it fails, empty ones created for it are removed.

    Raises OSError where one cannot be created.
    """
    folders: list[Path] = []
    try:
        for one in (*reversed(folder.parents), folder):
            with held_back():
                if not one.is_dir():
                    one.mkdir(exist_ok=True)
                    folders.append(one)
        yield
    except BaseException:
        with held_back(), suppress(OSError):
            for one in reversed(folders):
                one.rmdir()
        raise


@contextmanager
def atomic_path(path: Path | str, *, folders: bool = False) -> Iterator[Path]:
    """Give a fresh path beside ``path`` to write to, and move it into place when the block ends well.

    The temporary name keeps the suffix. On any error the temporary file goes and what was at ``path`` stays.
    folders: folders that are missing are created, and removed again on any error.
    Raises `MotionloomError` if ``path`` is a folder, or lies in a folder that is missing or cannot be written.
    """
    target = check_place(path, folders=folders)
    temporary: Path | None = None
    try:
        with with_folders(target.parent), new_part(target.parent, target.suffix) as temporary:
            yield temporary
            os.replace(temporary, target)
    except OSError as error:
        if (
            error.filename in (str(temporary), None) or temporary is None
        ):  # such as a full disk: name the path of the call
            raise MotionloomError(f"cannot write {path}: {error.strerror or error}") from error
        raise
