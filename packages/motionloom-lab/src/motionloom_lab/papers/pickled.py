"""Arrays in dictionaries out of .npz files that keep them as pickled objects.

The usual files of Human3.6M and HumanEva-I hold one object: a dictionary of dictionaries of arrays. A pickle is a
program, and nothing of it is run: `lab.papers.plain_pickle` reads what plain values and arrays it writes down.
"""

from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.io import text
from motionloom.io.npz import opened, read_header
from motionloom_lab.papers.plain_pickle import read_plain

MAX_ARRAYS = 20_000
Tables = dict[str, dict[str, np.ndarray]]


def read_tables(path: Path | str, name: str) -> Tables:
    """The dictionary of dictionaries of number arrays that an .npz file keeps under ``name``.

    Raises MotionloomError, naming the file, for a file that is missing, damaged, too large or holds anything else.
    """
    with opened(path) as (archive, members, most):
        if name not in members:
            listed = ", ".join(text.shown(n) for n in list(members)[:8]) or "nothing"
            raise MotionloomError(f"{path} is not read (it has no {name}, but {listed}); fetch it again")
        with archive.open(members[name]) as stream:
            shape, _, dtype = read_header(cast(BinaryIO, stream))
            if dtype.kind != "O" or shape != ():
                raise MotionloomError(
                    f"{path} is not read ({name} is an array of {dtype} of the shape {shape} and no dictionary); "
                    "fetch it again"
                )
            if members[name].file_size > 8 * most:
                raise MotionloomError(f"{path} is not read (it unfolds far beyond its size); fetch it again")
            data = stream.read(members[name].file_size)
    value = read_plain(data, limit=text.MAX_BYTES, name=str(path))
    try:
        return _tables(value)
    except ValueError as error:
        raise MotionloomError(f"{path} is not read ({error}); fetch it again") from None


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
