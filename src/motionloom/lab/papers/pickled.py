"""Arrays in dictionaries out of .npz files that keep them as pickled objects, without unpickling anything.

The usual files of Human3.6M and HumanEva-I hold one object: a dictionary of dictionaries of arrays. A pickle is a
program, so it is not run: `lab.papers.plain_pickle` reads what plain values and arrays it writes down.
"""

import io
import struct
import tokenize
import warnings
import zipfile
import zlib
from pathlib import Path

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.io import text
from motionloom.lab.papers.plain_pickle import read_plain

MAX_ARRAYS = 20_000
Tables = dict[str, dict[str, np.ndarray]]
_BROKEN = (
    zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, SyntaxError, ValueError, TypeError, LookupError,
    OSError, EOFError, NotImplementedError, RuntimeError, OverflowError, MemoryError, AttributeError,
)  # fmt: skip


def read_tables(path: Path | str, name: str) -> Tables:
    """The dictionary of dictionaries of number arrays that an .npz file keeps under ``name``.

    Raises MotionloomError, naming the file, for a file that is missing, damaged, too large or holds anything else.
    """
    try:
        with warnings.catch_warnings(), zipfile.ZipFile(io.BytesIO(_zip_bytes(path))) as archive:
            warnings.simplefilter("ignore")
            members = archive.infolist()
            if len(members) > 1000 or sum(m.file_size for m in members) > text.MAX_BYTES:
                raise ValueError("it unpacks to more than 1000 arrays or 2 GB")
            found = {m.filename.removesuffix(".npy"): m for m in members}
            if name not in found:
                listed = ", ".join(text.shown(n) for n in list(found)[:8]) or "nothing"
                raise ValueError(f"it has no {name}, but {listed}")
            with archive.open(found[name]) as stream:
                file = io.BytesIO(stream.read(found[name].file_size))
        version = np.lib.format.read_magic(file)
        readers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, _, dtype = readers[version](file)
        if dtype.kind != "O" or shape != ():
            raise ValueError(f"{name} is an array of {dtype} of the shape {shape} and no dictionary")
        return _tables(read_plain(file.read(), limit=text.MAX_BYTES, name=str(path)))
    except MotionloomError:
        raise
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:160]
        raise MotionloomError(f"{path} is not read ({reason or type(error).__name__}); fetch it again") from None


def _zip_bytes(path: Path | str) -> bytes:
    data = text.read_bytes(path)
    if not data.startswith(b"PK"):
        raise ValueError("it is not an NPZ archive")
    return data


def _tables(value: object) -> Tables:
    """What the pickle held, if it is a dictionary, by names, of dictionaries of arrays of numbers."""
    if isinstance(value, np.ndarray) and value.dtype == object and value.shape == ():
        value = value.item()
    if not isinstance(value, dict) or not all(isinstance(inner, dict) for inner in value.values()):
        raise ValueError("it holds no dictionary of dictionaries")
    if not all(isinstance(key, str) for table in (value, *value.values()) for key in table):
        raise ValueError("its dictionaries have keys that are not text")
    arrays = [array for inner in value.values() for array in inner.values()]
    if not all(isinstance(array, np.ndarray) and array.dtype.kind in "fiu" for array in arrays):
        raise ValueError("its dictionaries hold something else than arrays of numbers")
    if len(arrays) > MAX_ARRAYS or sum(array.nbytes for array in arrays) > text.MAX_BYTES:
        raise ValueError(f"it holds more than {MAX_ARRAYS} arrays or 2 GB of numbers")
    return value
