"""The container of a glTF file: chunks, JSON, buffers and accessors. Whatever it declares is checked before use."""

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import plain_json, read_bytes, shown

Array = NDArray[np.float64]
MAX_NUMBERS = 400_000_000
"""Numbers that one accessor may hold."""
MAX_JSON = 256 * 1024**2
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_SCALES = {5120: 127.0, 5121: 255.0, 5122: 32767.0, 5123: 65535.0}


@dataclass(frozen=True)
class Document:
    """A parsed file: its JSON and the bytes of its buffers."""

    name: str
    """For messages."""
    json: dict[str, Any]
    buffers: tuple[bytes, ...]
    binary: bytes | None = None
    """The binary part of a GLB; None where there is none."""
    others: bytes = b""
    """The other parts of a GLB, whole with their heads."""
    packed: bool = False
    """Whether it is a GLB and no .gltf."""
    _lists: dict[str, list[dict[str, Any]]] = field(default_factory=dict, compare=False)
    """Lists of the JSON that are known to be lists of objects: they are needed again and again."""

    def bad(self, what: str) -> MotionloomError:
        """The error for this file."""
        return MotionloomError(f"{self.name} is not a usable glTF file: {what}")

    def items(self, key: str, owner: dict[str, Any] | None = None) -> list[dict[str, Any]]:
        """A list of objects, such as all nodes; empty where there is none."""
        if owner is None and key in self._lists:
            return self._lists[key]
        items = (self.json if owner is None else owner).get(key, [])
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise self.bad(f"its {key} are not a list of objects")
        if owner is None:
            self._lists[key] = items
        return items

    def item(self, key: str, number: Any, what: str = "") -> dict[str, Any]:
        """One of a list of objects; ``what``: how a message calls them, where not by their key."""
        items = self.items(key)
        return items[self.index(number, len(items), what or key)]

    def index(self, value: Any, count: int, what: str) -> int:
        """A number that names one of ``count`` things."""
        if type(value) is not int or not 0 <= value < count:
            raise self.bad(f"{shown(str(value))} names none of its {count} {what}")
        return value

    def numbers(self, value: Any, count: int, what: str) -> Array:
        """A JSON list of exactly ``count`` finite numbers of sane size."""
        right = isinstance(value, list) and len(value) == count
        if not right or not all(isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9 for v in value):
            raise self.bad(f"{what} must be {count} finite numbers, got {shown(str(value))}")
        return np.array(value, dtype=np.float64)

    def accessor(self, number: Any, kind: str, what: str) -> Array:
        """The values (count, width) of an accessor of the given type, as floating point numbers."""
        accessor = self.item("accessors", number)
        if accessor.get("type") != kind:
            raise self.bad(f"{what} must be {kind}, got {shown(str(accessor.get('type')))}")
        if accessor.get("sparse") is not None:
            raise self.bad(f"{what} is stored sparsely, which is not supported; export it without sparse accessors")
        component = accessor.get("componentType")
        if not isinstance(component, int) or component not in _KINDS:
            raise self.bad(f"{what} has the unknown component type {shown(str(component))}")
        width, dtype = _WIDTHS[kind], np.dtype(_KINDS[component])
        count = self._size(accessor, "count", what)
        if not 1 <= count <= MAX_NUMBERS // width:
            raise self.bad(f"{what} claims {count} entries")
        values = self._view(accessor, dtype, (count, width), what).astype(np.float64)
        if accessor.get("normalized") is True and component in _SCALES:
            values = np.maximum(values / _SCALES[component], -1.0)
        if not np.isfinite(values).all():
            raise self.bad(f"{what} holds numbers that are not finite")
        return values

    def matrices(self, number: Any, what: str) -> Array | None:
        """(count, 4, 4) an accessor of matrices; None where none can be read."""
        if number is None:
            return None
        view = self.item("accessors", number).get("bufferView")
        views = self.items("bufferViews")
        if isinstance(view, int) and 0 <= view < len(views) and compressed(views[view]):
            return None
        return self.accessor(number, "MAT4", what).reshape(-1, 4, 4).transpose(0, 2, 1)

    def _view(self, accessor: dict[str, Any], dtype: np.dtype, shape: tuple[int, int], what: str) -> np.ndarray:
        """The raw entries of an accessor, checked against the bytes that are really there."""
        number = accessor.get("bufferView")
        view = self.item("bufferViews", number, f"buffer views ({what})")
        if compressed(view):
            raise self.bad(
                f"{what} are compressed by meshopt, which is not read; export it without compression "
                "(gltfpack: without -c)"
            )
        data = self.buffers[self.index(view.get("buffer"), len(self.buffers), "buffers")]
        start = self._size(view, "byteOffset", what)
        length = self._size(view, "byteLength", what)
        row = dtype.itemsize * shape[1]
        stride = self._size(view, "byteStride", what) or row
        offset = self._size(accessor, "byteOffset", what)
        if stride < row or (stride > 252 and stride != row):
            raise self.bad(f"{what} has a byte stride of {stride}")
        size = stride * (shape[0] - 1) + row
        if start + length > len(data) or offset + size > length:
            raise self.bad(f"{what} reaches beyond the end of its data")
        flat = np.frombuffer(data, np.uint8, size, start + offset)
        rows = np.lib.stride_tricks.as_strided(flat, (shape[0], row), (stride, 1))
        return np.ascontiguousarray(rows).view(dtype).reshape(shape)

    def _size(self, owner: dict[str, Any], key: str, what: str) -> int:
        value = owner.get(key, 0)
        if type(value) is not int or not 0 <= value < 2**53:
            raise self.bad(f"{what} has the {key} {shown(str(value))}")
        return value


def read_document(path: str | Path) -> Document:
    """Read a .glb, or a .gltf whose buffers are embedded; raises `MotionloomError` for anything else."""
    data, name = read_bytes(path), str(path)
    binary, others, packed = None, b"", data[:4] == b"glTF"
    if packed:
        data, binary, others = _chunks(data, name)
    if len(data) > MAX_JSON:
        raise MotionloomError(f"{name} has {len(data) / 1e6:.0f} MB of JSON; at most {MAX_JSON / 1e6:.0f} MB are read")
    try:
        content = plain_json(data.decode("utf-8-sig"), finite=True)
    except ValueError:  # not UTF-8, not JSON, NaN, endless digits, endless depth
        raise MotionloomError(f"{name} is not a glTF file: its JSON part cannot be read") from None
    if not isinstance(content, dict):
        raise MotionloomError(f"{name} is not a glTF file: its JSON part is not an object")
    document = Document(name, content, ())
    asset = content.get("asset")
    version = asset.get("version") if isinstance(asset, dict) else None
    if not isinstance(version, str) or not version.startswith("2."):
        raise document.bad(f"it declares version {shown(str(version))}; only glTF 2.x is read")
    buffers = [_buffer(document, i, entry, binary) for i, entry in enumerate(document.items("buffers"))]
    return Document(name, content, tuple(buffers), binary, others, packed)


def compressed(owner: dict[str, Any]) -> bool:
    """Whether a buffer view or a buffer holds, or replaces, data that meshopt has compressed."""
    extensions = owner.get("extensions")
    return isinstance(extensions, dict) and bool(
        {"EXT_meshopt_compression", "KHR_meshopt_compression"} & extensions.keys()
    )


def pack_glb(content: dict[str, Any], binary: bytes, others: bytes = b"") -> bytes:
    """A GLB of a JSON part, a binary part and further chunks, whole with their heads."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
    parts = [(b"JSON", text + b" " * (-len(text) % 4))]
    if binary:
        parts.append((b"BIN\0", binary + bytes(-len(binary) % 4)))
    body = b"".join(struct.pack("<I", len(part)) + kind + part for kind, part in parts) + others
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def entry_of(dtype: np.dtype, shape: tuple[int, ...], where: dict[str, int]) -> dict[str, Any]:
    """The JSON of an accessor of numbers of a shape (count, width) that are ``where`` its keys say."""
    component = next(number for number, kind in _KINDS.items() if dtype == kind)
    kind = next(name for name, width in _WIDTHS.items() if width == shape[1])
    return where | {"componentType": component, "count": shape[0], "type": kind}


def new_animation(name: str, fps: float) -> dict[str, Any]:
    """The JSON of an animation without channels, which states its frame rate."""
    return {"name": name, "channels": [], "samplers": [], "extras": {"fps": fps}}


def add_channel(animation: dict[str, Any], node: int, path: str, clock: int, values: int) -> None:
    """Let an animation move a node: ``clock`` and ``values`` are the accessors of its keys."""
    samplers = animation["samplers"]
    samplers.append({"input": clock, "output": values, "interpolation": "LINEAR"})
    animation["channels"].append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})


def _chunks(data: bytes, name: str) -> tuple[bytes, bytes | None, bytes]:
    """The JSON of a GLB, its binary chunk, and all other chunks, whole with their heads."""
    if len(data) < 20:
        raise MotionloomError(f"{name} is cut short: a GLB has at least 20 bytes, it has {len(data)}")
    version, total = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise MotionloomError(f"{name} is GLB version {version}; only version 2 is read")
    if total > len(data):
        raise MotionloomError(f"{name} is cut short: it declares {total} bytes and has {len(data)}")
    main: dict[bytes, bytes] = {}
    others, at = bytearray(), 12
    while at + 8 <= total:
        length, kind = struct.unpack_from("<I4s", data, at)
        end = at + 8 + length
        if end > total:
            raise MotionloomError(f"{name} is damaged: a part of {length} bytes reaches beyond the file's end")
        if kind in (b"JSON", b"BIN\0"):
            main.setdefault(kind, data[at + 8 : end])
        else:
            others += data[at:end]
        at = end
    if b"JSON" not in main:
        raise MotionloomError(f"{name} is damaged: it has no JSON part")
    return main[b"JSON"], main.get(b"BIN\0"), bytes(others)


def _buffer(document: Document, number: int, entry: dict[str, Any], binary: bytes | None) -> bytes:
    uri = entry.get("uri")
    if uri is None and compressed(entry):
        return b""  # it replaces what is decompressed
    if uri is None:
        if number != 0 or binary is None:
            raise document.bad(f"buffer {number} has no data")
        data = binary
    elif isinstance(uri, str) and uri.startswith("data:"):
        head, comma, body = uri.partition(",")
        try:
            data = base64.b64decode(body, validate=True) if comma and head.endswith(";base64") else None
        except (binascii.Error, ValueError):
            data = None
        if data is None:
            raise document.bad(f"buffer {number} is not valid base64")
    else:
        raise document.bad(f"it refers to the outside file {shown(str(uri))}, which is not followed; export a .glb")
    declared = entry.get("byteLength")
    if type(declared) is not int or not 0 <= declared <= len(data):
        raise document.bad(f"buffer {number} declares {shown(str(declared))} bytes and has {len(data)}")
    return data
