"""Safetensors files, written: whole or not at all, with the rights that other files get, one sentence when it fails."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from safetensors import SafetensorError

from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path

if TYPE_CHECKING:
    from torch import Tensor


def save_tensors(
    tensors: "Mapping[str, np.ndarray] | Mapping[str, Tensor]", path: Path | str, *, metadata: Mapping[str, str]
) -> Path:
    """Write arrays or tensors as a .safetensors file and give the path back.

    Args:
        tensors: By name; either numpy arrays or contiguous torch tensors on the CPU, not both.
        path: The file; what stood there is replaced at the very end.
        metadata: Text by name, kept in the file's head.

    Raises:
        MotionloomError: The place cannot be written to, the disk is full, or the tensors cannot be written down.
    """
    made: dict[str, Any] = dict(tensors)
    try:
        if all(isinstance(value, np.ndarray) for value in made.values()):
            from safetensors.numpy import save
        else:
            from safetensors.torch import save
        data = save(cast(Any, made), dict(metadata))
    except SafetensorError as error:
        raise MotionloomError(f"cannot write {path}: {error}") from error
    with atomic_path(path) as temporary:  # not safetensors' own writer: that makes files which only the owner may read
        temporary.write_bytes(data)
    return Path(path)
