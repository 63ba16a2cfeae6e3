"""Safetensors files: written whole or not at all; read after a look at what their heads claim."""

import os
import stat
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import save

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path

MAX_HEAD = 32 << 20
"""Bytes of a file's head, which names its tensors and says what it holds."""
MAX_TENSORS = 10_000
"""Tensors of a file. Each costs time, and an empty one takes but 60 bytes."""


def check_head(path: Path | str, *, max_bytes: int) -> None:
    """Look at the size of a safetensors file and at its head before anybody parses it.

    Raises ValueError where it is no file, larger than ``max_bytes``, or its head has more than `MAX_HEAD` bytes or
    `MAX_TENSORS` tensors; OSError where it cannot be read.
    """
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise ValueError("it is no file")
    with open(path, "rb") as file:
        if os.fstat(file.fileno()).st_size > max_bytes:
            raise ValueError(f"it is larger than the {max_bytes >> 20} MiB of such a file")
        length = int.from_bytes(file.read(8), "little")
        if length > MAX_HEAD:
            raise ValueError(f"its head has more than {MAX_HEAD >> 20} MiB")
        if file.read(length).count(b"{") > MAX_TENSORS:  # whatever a name is, each tensor's entry begins with one
            raise ValueError(f"it has more than {MAX_TENSORS:,} tensors")


def save_tensors(tensors: Mapping[str, np.ndarray], path: Path | str, *, metadata: Mapping[str, str]) -> Path:
    """Write arrays as a .safetensors file and give the path back.

    Args:
        tensors: By name.
        path: The file; what stood there is replaced at the very end.
        metadata: Text by name, kept in the file's head.

    Raises:
        MotionloomError: The place cannot be written to, the disk is full, or the tensors cannot be written down.
    """
    try:
        data = save({name: np.asarray(value, order="C") for name, value in tensors.items()}, dict(metadata))
    except SafetensorError as error:
        raise MotionloomError(f"cannot write {path}: {error}") from error
    with atomic_path(path) as temporary:  # not safetensors' own writer: that makes files which only the owner may read
        temporary.write_bytes(data)
    return Path(path)
