"""Files of `torch.save`, read by `torch.load(weights_only=True)` behind a look at their names and sizes.

Torch's own weights-only reader trusts a file's sizes, and calls a few things besides. So the pickle inside
is read first as `lab.papers.plain_pickle` reads all of them, with the few names that state dicts need: every tensor
must lie within numbers that are there. An archive is then packed anew from the members that were looked at, so that
torch reads the very bytes that were measured. Files of before torch 1.6 (a row of pickles, then the numbers) are read
too.
"""

import io
import struct
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import read_bytes
from motionloom_lab.papers.plain_pickle import BROKEN, NAMES, OPERATIONS, PlainUnpickler

MAX_BYTES = 2 << 30
MAX_MEMBERS = 100_000
_OLD = b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19." + b"\x80\x02M\xe9\x03."
"""How files of before torch 1.6 begin: a magic number, and version 1001."""
_OLD_HEAD = {
    "protocol_version": 1001,
    "little_endian": True,
    "type_sizes": {"short": 2, "int": 4, "long": 4},
}
_TYPES = {
    "FloatStorage": torch.float32,
    "DoubleStorage": torch.float64,
    "HalfStorage": torch.float16,
    "BFloat16Storage": torch.bfloat16,
    "LongStorage": torch.int64,
    "IntStorage": torch.int32,
    "ShortStorage": torch.int16,
    "CharStorage": torch.int8,
    "ByteStorage": torch.uint8,
    "BoolStorage": torch.bool,
}

_NAMES = {
    **NAMES,
    ("collections", "OrderedDict"): "table",
    ("torch._utils", "_rebuild_tensor_v2"): "tensor",
    ("torch._utils", "_rebuild_parameter"): "parameter",
}


def read_torch_file(path: Path | str) -> Any:
    """The value in a file of `torch.save`: dictionaries, lists, tuples, texts, numbers, and tensors on the CPU.

    Args:
        path: A file of at most 2 GiB.

    Raises:
        MotionloomError: It is missing, too large, damaged, packed, or holds anything else.
    """
    try:
        data = read_bytes(path, max_bytes=MAX_BYTES)
        checked = _checked_archive(data) if data.startswith(b"PK") else _checked_row(data)
        return torch.load(checked, map_location="cpu", weights_only=True)
    except MotionloomError:
        raise
    except (*BROKEN, zipfile.BadZipFile, OSError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MotionloomError(f"{path} holds more than tensors or is damaged, and is not opened ({reason})") from None


def is_plain(value: Tensor) -> bool:
    """Whether these are ordinary floating-point numbers, each stored once: nothing that grows when it is touched."""
    usual = value.layout == torch.strided and value.device.type == "cpu" and value.is_floating_point()
    return usual and value.is_contiguous() and value.nbytes <= value.untyped_storage().nbytes()


def _checked_archive(data: bytes) -> io.BytesIO:
    """The archive of the members that were looked at; ValueError where one is not as the pickle describes it."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        if len(members) > MAX_MEMBERS or any(m.compress_type != zipfile.ZIP_STORED for m in members):
            raise ValueError(f"its archive has packed members or more than {MAX_MEMBERS}")
        if sum(m.file_size for m in members) > len(data):
            raise ValueError("its archive claims to hold more than the file")
        pickles = [m.filename for m in members if m.filename.endswith("/data.pkl")]
        if len(pickles) != 1 or len({m.filename for m in members}) != len(members):
            raise ValueError("its archive does not hold one data.pkl")
        top = pickles[0].removesuffix("data.pkl")
        known = {m.filename.removeprefix(top): m for m in members}
        if "byteorder" in known and archive.read(known["byteorder"]) != b"little":
            raise ValueError("its numbers are big-endian")
        pickled = archive.read(known["data.pkl"])
        look = _Look(io.BytesIO(pickled), len(data))
        look.value()
        again = io.BytesIO()
        with zipfile.ZipFile(again, "w", zipfile.ZIP_STORED) as checked:
            checked.writestr("checked/data.pkl", pickled)
            checked.writestr("checked/version", "3\n")
            checked.writestr("checked/byteorder", "little")
            for key, storage in look.storages.items():
                if f"data/{key}" not in known:
                    raise ValueError("its archive lacks the numbers of a tensor")
                numbers = archive.read(known[f"data/{key}"])
                if len(numbers) != storage.size:
                    raise ValueError(f"{len(numbers)} bytes are there for {storage.count} numbers")
                checked.writestr(f"checked/data/{key}", numbers)
    again.seek(0)
    return again


def _checked_row(data: bytes) -> io.BytesIO:
    """A magic number, a version, what machine it was, the value, the names of storages, then each one's numbers."""
    if not data.startswith(_OLD):
        raise ValueError("it is no file of torch.save")
    stream = io.BytesIO(data)
    stream.seek(len(_OLD))
    if PlainUnpickler(stream, len(data)).value() != _OLD_HEAD:
        raise ValueError("it was written on a machine of another kind")
    look = _Look(stream, len(data))
    look.value()
    keys = PlainUnpickler(stream, len(data)).value()
    if not isinstance(keys, list) or set(keys) != set(look.storages) or len(set(keys)) != len(keys):
        raise ValueError("it does not hold the numbers of its tensors")
    for key in keys:
        storage = look.storages[key]
        if stream.read(8) != struct.pack("<q", storage.count):
            raise ValueError("it does not hold the numbers of its tensors")
        if stream.seek(storage.size, io.SEEK_CUR) > len(data):
            raise ValueError(f"fewer bytes are there than {storage.count} numbers have")
    stream.seek(0)
    return stream


@dataclass(frozen=True)
class _Storage:
    """Numbers of one kind, of which tensors are parts."""

    kind: torch.dtype
    count: int

    @property
    def size(self) -> int:
        """Bytes."""
        return self.count * self.kind.itemsize


class _Part:
    """Stands for a tensor that lies within its numbers."""


def _whole(numbers: Iterable[object]) -> bool:
    return all(type(n) is int and 0 <= n < 1 << 62 for n in numbers)


class _Look(PlainUnpickler):
    """Reads a pickle in which tensors are named by the storages that follow it, and measures them."""

    names = _NAMES
    operations = OPERATIONS | {"BINPERSID"}
    leaves = (*PlainUnpickler.leaves, _Part)

    def __init__(self, stream: io.BytesIO, limit: int) -> None:
        super().__init__(stream, limit)
        self.storages: dict[str, _Storage] = {}

    def find_class(self, module: str, name: str) -> Any:
        """See `PlainUnpickler.find_class`; a kind of storage is known by its numbers' type."""
        return _TYPES[name] if module == "torch" and name in _TYPES else super().find_class(module, name)

    def persistent_load(self, pid: Any) -> _Storage:
        """A storage by its name; ValueError where the same name is two kinds, or it names anything else."""
        if not isinstance(pid, tuple) or len(pid) not in (5, 6) or pid[0] != "storage" or pid[5:] not in ((), (None,)):
            raise ValueError("it names something outside")
        _, kind, key, _, count = pid[:5]
        if not isinstance(kind, torch.dtype) or not isinstance(key, str) or not _whole([count]):
            raise ValueError("it names numbers of no known kind")
        if self.storages.setdefault(key, _Storage(kind, count)) != _Storage(kind, count):
            raise ValueError("it names the same numbers as two kinds")
        return self.storages[key]

    def make_table(self) -> dict[Any, Any]:
        """An ordered dictionary, filled later."""
        return {}

    def make_parameter(self, part: Any, *more: Any) -> _Part:
        """A tensor that was trained."""
        if not isinstance(part, _Part):
            raise ValueError("its parameter is no tensor")
        return part

    def make_tensor(self, storage: Any, first: Any, shape: Any, strides: Any, *more: Any) -> _Part:
        """A tensor, if it lies within its numbers."""
        if not isinstance(storage, _Storage) or not isinstance(shape, tuple) or not isinstance(strides, tuple):
            raise ValueError("a tensor is incomplete")
        if len(shape) > 16:
            raise ValueError("a tensor has more than 16 dimensions")
        if not _whole([first, *shape, *strides]) or len(shape) != len(strides):
            raise ValueError("a tensor has no shape")
        reach = first + 1 + sum((n - 1) * step for n, step in zip(shape, strides, strict=True))
        if all(shape) and reach > storage.count:
            raise ValueError("a tensor reaches beyond its numbers")
        return _Part()

    def build(self, target: Any, state: Any) -> None:
        """See `PlainUnpickler.build`; what an ordered dictionary has beside its entries (`_metadata`) is let be."""
        if not (isinstance(target, dict) and isinstance(state, dict)):
            super().build(target, state)
