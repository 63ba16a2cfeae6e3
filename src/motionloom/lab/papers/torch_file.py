"""Files of `torch.save`, read without torch's own reader: plain values and tensors, nothing that acts.

The archive is read once and by one reader, so that what was measured is what is used: members must be stored and not
packed, and hold together no more than the file. The pickle inside is read as `lab.papers.plain_pickle` reads all of
them, with the few names that state dicts need; every tensor must lie within the bytes that are there. Files of before
torch 1.6 (a row of pickles, then the numbers) are read too.
"""

import io
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from motionloom.errors import MotionloomError
from motionloom.io.text import read_bytes
from motionloom.lab.papers.plain_pickle import BROKEN, NAMES, Machine, Name

MAX_BYTES = 2 << 30
MAX_MEMBERS = 100_000
_OLD = b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19." + b"\x80\x02M\xe9\x03."
"""How files of before torch 1.6 begin: a magic number, and version 1001."""
_TYPES = {
    "FloatStorage": torch.float32, "DoubleStorage": torch.float64, "HalfStorage": torch.float16,
    "BFloat16Storage": torch.bfloat16, "LongStorage": torch.int64, "IntStorage": torch.int32,
    "ShortStorage": torch.int16, "CharStorage": torch.int8, "ByteStorage": torch.uint8, "BoolStorage": torch.bool,
}  # fmt: skip
_NAMES = {
    **NAMES,
    ("collections", "OrderedDict"): "OrderedDict",
    ("torch._utils", "_rebuild_tensor_v2"): "tensor",
    ("torch._utils", "_rebuild_parameter"): "parameter",
    **{("torch", kind): kind for kind in _TYPES},
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
        return _from_archive(data) if data.startswith(b"PK") else _from_row(data)
    except MotionloomError:
        raise
    except (*BROKEN, zipfile.BadZipFile, struct.error, EOFError, OSError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MotionloomError(f"{path} holds more than tensors or is damaged, and is not opened ({reason})") from None


def is_plain(value: Tensor) -> bool:
    """Whether these are ordinary floating-point numbers, each stored once: nothing that grows when it is touched."""
    usual = value.layout == torch.strided and value.device.type == "cpu" and value.is_floating_point()
    return usual and value.is_contiguous() and value.nbytes <= value.untyped_storage().nbytes()


def _from_archive(data: bytes) -> object:
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
        machine = _TorchMachine(len(data), _NAMES)
        value = machine.run(io.BytesIO(archive.read(pickles[0])))
        for key, storage in machine.storages.items():
            if f"data/{key}" not in known:
                raise ValueError("its archive lacks the numbers of a tensor")
            storage.fill(archive.read(known[f"data/{key}"]))
    return _with_tensors(value)


def _from_row(data: bytes) -> object:
    """A magic number, a version, what machine it was, the value, the names of storages, then each one's numbers."""
    if not data.startswith(_OLD):
        raise ValueError("it is no file of torch.save")
    stream = io.BytesIO(data)
    stream.seek(len(_OLD))
    if Machine(len(data)).run(stream) != {**_ROW_HEAD, "type_sizes": {"short": 2, "int": 4, "long": 4}}:
        raise ValueError("it was written on a machine of another kind")
    machine = _TorchMachine(len(data), _NAMES)
    value = machine.run(stream)
    keys = Machine(len(data)).run(stream)
    if not isinstance(keys, list) or set(keys) != set(machine.storages) or len(set(keys)) != len(keys):
        raise ValueError("it does not hold the numbers of its tensors")
    for key in keys:
        storage = machine.storages[key]
        if stream.read(8) != struct.pack("<q", storage.count):
            raise ValueError("it does not hold the numbers of its tensors")
        storage.fill(stream.read(min(storage.size, len(data))))
    return _with_tensors(value)


_ROW_HEAD = {"protocol_version": 1001, "little_endian": True}


@dataclass(eq=False)
class _Storage:
    """Numbers of one kind, of which tensors are parts."""

    kind: torch.dtype
    count: int
    numbers: Tensor = field(default_factory=lambda: torch.empty(0))

    @property
    def size(self) -> int:
        """Bytes."""
        return self.count * self.kind.itemsize

    def fill(self, data: bytes) -> None:
        """Take the numbers; raises ValueError unless they are as many as was said."""
        if len(data) != self.size:
            raise ValueError(f"{len(data)} bytes are there for {self.count} numbers")
        if data:
            self.numbers = torch.frombuffer(bytearray(data), dtype=self.kind)
        else:
            self.numbers = torch.empty(0, dtype=self.kind)


@dataclass(eq=False)
class _Part:
    """A tensor whose numbers are not read yet."""

    storage: _Storage
    first: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]

    @cached_property
    def tensor(self) -> Tensor:
        """The tensor; raises ValueError where it is not within its storage."""
        if not _whole(self.first, *self.shape, *self.strides) or len(self.shape) != len(self.strides):
            raise ValueError("a tensor has no shape")
        reach = self.first + 1 + sum((n - 1) * step for n, step in zip(self.shape, self.strides, strict=True))
        if all(self.shape) and reach > self.storage.count:
            raise ValueError("a tensor reaches beyond its numbers")
        if not all(self.shape):
            return torch.empty(self.shape, dtype=self.storage.kind)
        return torch.as_strided(self.storage.numbers, self.shape, self.strides, self.first)


def _whole(*numbers: object) -> bool:
    return all(type(n) is int and 0 <= n < 1 << 62 for n in numbers)


@dataclass
class _TorchMachine(Machine):
    """Reads a pickle in which tensors are named by the storages that follow it."""

    storages: dict[str, _Storage] = field(default_factory=dict)

    def _step(self, name: str, value: Any) -> None:
        if name == "BINPERSID":
            (said,) = self._take(1)
            self.stack.append(self._storage(said))
        else:
            super()._step(name, value)

    def _storage(self, said: Any) -> _Storage:
        if (
            not isinstance(said, tuple)
            or len(said) not in (5, 6)
            or said[0] != "storage"
            or said[5:] not in ((), (None,))
        ):
            raise ValueError("it names something outside")
        _, kind, key, _, count = said[:5]
        if not isinstance(kind, Name) or kind.word not in _TYPES or not isinstance(key, str) or not _whole(count):
            raise ValueError("it names numbers of no known kind")
        storage = self.storages.setdefault(key, _Storage(_TYPES[kind.word], count))
        if (storage.kind, storage.count) != (_TYPES[kind.word], count):
            raise ValueError("it names the same numbers as two kinds")
        return storage

    def made_of(self, word: str, arguments: tuple[Any, ...]) -> object:
        """See `Machine.made_of`."""
        if word == "OrderedDict" and not arguments:
            return {}
        if word == "parameter" and len(arguments) == 3 and isinstance(arguments[0], _Part):
            return arguments[0]
        if word == "tensor" and len(arguments) >= 4:
            storage, first, shape, strides = arguments[:4]
            if isinstance(storage, _Storage) and isinstance(shape, tuple) and isinstance(strides, tuple):
                if len(shape) > 16:
                    raise ValueError("a tensor has more than 16 dimensions")
                return _Part(storage, first, shape, strides)
        return super().made_of(word, arguments)

    def build(self, made: object, state: object) -> None:
        """See `Machine.build`; what an ordered dictionary has beside its entries (`_metadata`) is not needed."""
        if not (isinstance(made, dict) and isinstance(state, dict)):
            super().build(made, state)


def _with_tensors(value: object) -> object:
    """The value with its tensors in their places."""
    if isinstance(value, _Part):
        return value.tensor
    if isinstance(value, _Storage):
        raise ValueError("it holds numbers that are no tensor")
    if isinstance(value, Mapping):
        return {key: _with_tensors(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_with_tensors(inner) for inner in value)
    return value
