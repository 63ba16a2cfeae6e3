"""Reading motions from NumPy archives, never with pickle; `io.npz_writer` has the layout.

An archive without ``rotations`` but with positions (T, 22, 3) of the SMPL joints and an ``fps`` is read too. Such
archives come in other units and with other axes up: what is surely not metres, or not +Y up, has to be told.
One with ``posed_joints`` and ``global_rot_mats`` is read as well (`soma`).
"""

import io
import math
import re
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypedDict, cast

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files import text
from motionloom.core.files.npz_writer import VERSION
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Poses, Skeleton
from motionloom.retarget.anatomy import HUMAN_LEGS
from motionloom.retarget.upright import leg_length, set_upright, upright_places

MAX_JOINTS = 10_000
_POSITIONS = ("positions", "joints", "motion", "arr_0")
SPARE_NUMBERS, NUMBERS_PER_BYTE = 8_000_000, 16
"""What a packed file may unfold to: so many numbers, or so many for each byte of the file, if that is more. Motion that
people make packs to a byte for each number or two; somebody who does not move at all, for forty minutes, is let in."""
LONGEST_HEAD = 10_000
DEEPEST_HEAD = 64
"""Bytes and brackets of what stands before the numbers of an array."""
_HEAD = re.compile(rb"""(?:[\s,:{}()\[\]0-9L]|True|False|'[^'\\\n]*'|"[^"\\\n]*")*""")
BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
    SyntaxError,
    ValueError,
    TypeError,
    KeyError,
    OSError,
    EOFError,
    NotImplementedError,
    RuntimeError,
    OverflowError,
    MemoryError,
    IndexError,
)
"""What damaged archives and arrays raise in zipfile and NumPy."""


def load_npz(path: Path | str, *, fps: float | None = None, unit: float | None = None, up: str | None = None) -> Motion:
    """Read a motion; ``fps`` replaces the stored rate.

    ``unit`` is metres per unit of positions, and ``up`` the axis of `motionloom.retarget.upright.AXES` that is up in
    the file. Raises `MotionloomError` for anything but the layouts above, for a unit of the first of them, which is
    in metres, and for positions that are surely not metres or not +Y up where these are None.
    """
    file = _Archive(path, read_arrays(path))
    rate = fps
    if rate is None and "fps" in file:
        rate = float(file.take("fps", ()))
    if rate is not None and not 1e-4 <= rate <= 1e6:
        raise MotionloomError(f"{path} is said to have {rate:g} frames per second; give the true frame rate")
    if "rotations" in file:
        if rate is None:
            raise MotionloomError(f"{path} has no 'fps'; give the frame rate")
        if unit is not None:
            raise MotionloomError(f"{path} is in metres by its format; a unit is for positions without rotations")
        motion = _motion(file, rate)
        return motion if up is None else set_upright(motion, path, up)
    if "posed_joints" in file:
        motion = _from_soma(file, rate)
        return motion if up is None else set_upright(motion, path, up)
    return _from_positions(file, rate, unit=unit, up=up)


def read_arrays(
    path: Path | str, *, max_bytes: int = text.MAX_BYTES, only: Container[str] | None = None
) -> dict[str, np.ndarray]:
    """All arrays of an archive, with sizes checked before anything is unpacked; objects (pickle) are refused.

    Args:
        path: An .npz file, its members stored or packed with deflate.
        max_bytes: Most bytes of the file, and of its arrays together. A small file may not unfold to very many numbers
            either: at most `SPARE_NUMBERS`, or `NUMBERS_PER_BYTE` for each of its bytes.
        only: Names of the arrays to read; the others are never looked at.

    Raises:
        MotionloomError: It is missing, too large, damaged or no such archive.
    """
    with opened(path, max_bytes=max_bytes) as (archive, members, most):
        members = {n: m for n, m in members.items() if only is None or n in only}
        arrays: dict[str, np.ndarray] = {}
        for name, member in members.items():
            with archive.open(member) as stream:
                what = f"{path}: the array {text.shown(name)}"
                array = _read_array(cast(BinaryIO, stream), member.file_size, most=most, what=what)
            arrays[name] = array
            most -= max(array.size, array.nbytes // 8)
        return arrays


@contextmanager
def opened(
    path: Path | str, *, max_bytes: int = text.MAX_BYTES
) -> Iterator[tuple[zipfile.ZipFile, dict[str, zipfile.ZipInfo], int]]:
    """An .npz archive, its members by the names of their arrays, and how many numbers may be read out of it.

    Raises `MotionloomError`, also for whatever the block meets in damaged members.
    """
    data = text.read_bytes(path, max_bytes=max_bytes)
    if not data.startswith(b"PK"):
        raise MotionloomError(f"{path} is not an NPZ archive")
    try:
        with warnings.catch_warnings(), zipfile.ZipFile(io.BytesIO(data)) as archive:
            warnings.simplefilter("ignore")
            members = archive.infolist()
            if len(members) > 1000 or sum(m.file_size for m in members) > max_bytes:
                raise MotionloomError(
                    f"{path} unpacks to more than 1000 arrays or {max_bytes / 1e9:.1f} GB; it is not read"
                )
            if any(m.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for m in members):
                raise MotionloomError(f"{path} is packed in a way that NumPy does not use; save it with NumPy")
            most = max(SPARE_NUMBERS, NUMBERS_PER_BYTE * len(data))
            yield archive, {m.filename.removesuffix(".npy"): m for m in members}, most
    except MotionloomError:
        raise
    except BROKEN as error:
        raise MotionloomError(f"{path} is a damaged NPZ archive ({type(error).__name__})") from None


def read_array(path: Path | str, *, max_bytes: int = text.MAX_BYTES) -> np.ndarray:
    """The numbers or texts of a .npy file; objects (pickle) are refused.

    Raises `MotionloomError` for a file that is missing, larger than ``max_bytes``, damaged, or of another kind.
    """
    data = text.read_bytes(path, max_bytes=max_bytes)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            size, what = len(data), f"{path}: the array"
            return _read_array(io.BytesIO(data), size, most=size + 1, what=what)
    except MotionloomError:
        raise
    except BROKEN as error:
        raise MotionloomError(f"{path} is a damaged .npy file ({type(error).__name__})") from None


def read_header(stream: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns come first, and type of the .npy that begins where the stream is; raises `BROKEN`."""
    version = np.lib.format.read_magic(stream)
    reader, width = {
        (1, 0): (np.lib.format.read_array_header_1_0, 2),
        (2, 0): (np.lib.format.read_array_header_2_0, 4),
    }[version]
    length = stream.read(width)
    head = stream.read(min(int.from_bytes(length, "little"), LONGEST_HEAD))
    # NumPy parses it as Python: what is deep or full of signs would take the interpreter's stack
    if not _HEAD.fullmatch(head) or sum(map(head.count, (b"(", b"[", b"{"))) > DEEPEST_HEAD:
        raise ValueError("it has no head that NumPy writes")
    shape, fortran, dtype = reader(io.BytesIO(length + head))
    if len(shape) > 32 or not all(type(n) is int and 0 <= n < 1 << 62 for n in shape):
        raise ValueError("it has no shape")
    return shape, fortran, dtype


def _read_array(stream: BinaryIO, size: int, *, most: int, what: str) -> np.ndarray:
    """The array of ``size`` bytes, head and all, of at most so many numbers; nothing is unpacked before it is sized."""
    shape, fortran, dtype = read_header(stream)
    if dtype.kind not in "fiubU":
        raise MotionloomError(f"{what} holds {dtype}, not numbers or text; pickled objects are never read")
    length, left = math.prod(shape) * dtype.itemsize, size - stream.tell()
    if length != left:
        raise MotionloomError(f"{what} says {shape} but holds {left} bytes; it is damaged")
    if max(math.prod(shape), length // 8) > most:
        raise MotionloomError(f"{what} has the shape {shape}, far more numbers than so small a file may hold")
    data = stream.read(length)
    if len(data) != length:
        raise MotionloomError(f"{what} says {shape} but holds {len(data)} bytes; it is damaged")
    flat = np.frombuffer(data, dtype=dtype) if length else np.empty(0, dtype)
    if dtype.kind == "U" and length:
        codes = flat.view(np.dtype(np.uint32).newbyteorder(dtype.byteorder))
        if ((codes > 0x10FFFF) | ((codes >= 0xD800) & (codes < 0xE000))).any():
            raise MotionloomError(f"{what} holds characters that do not exist; it is damaged")
    return flat.reshape(shape[::-1]).T if fortran else flat.reshape(shape)


@dataclass(frozen=True)
class _Archive:
    """Arrays of a file, checked when they are taken."""

    path: Path | str
    arrays: dict[str, np.ndarray]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def take(self, name: str, shape: tuple[int | None, ...], kinds: str = "fiu") -> np.ndarray:
        """The array of that name with this shape (None: any length) and kind of number."""
        if name not in self:
            raise MotionloomError(f"{self.path} has no array '{name}'; it has {self.listed()}")
        array = self.arrays[name]
        same = len(array.shape) == len(shape) and all(w is None or w == n for w, n in zip(shape, array.shape))
        if not same or array.dtype.kind not in kinds:
            sizes = ", ".join("any" if n is None else str(n) for n in shape)
            raise self.bad(f"'{name}' must have the shape ({sizes}); it is {array.shape} of {array.dtype}")
        # without a copy of all numbers; NaN is neither
        small = kinds == "U" or not array.size or (array.min() >= -text.LIMIT and array.max() <= text.LIMIT)
        if not small:
            raise self.bad(f"'{name}' has numbers that are not finite (NaN or infinity) or above 1e9")
        return array

    def bad(self, what: object) -> MotionloomError:
        """The error for this file."""
        return MotionloomError(f"{self.path}: {what}")

    def listed(self) -> str:
        """The names of its arrays for a message."""
        return ", ".join(text.shown(n) for n in list(self.arrays)[:12]) or "none"


def _motion(file: _Archive, fps: float) -> Motion:
    version = int(file.take("version", (), "iu")) if "version" in file else VERSION
    if version != VERSION:
        raise MotionloomError(f"{file.path} has the layout of version {version}; this program reads version {VERSION}")
    names = tuple(str(n) for n in file.take("names", (None,), "U"))
    joints = len(names)
    if joints > MAX_JOINTS:
        raise MotionloomError(f"{file.path} has {joints} joints; at most {MAX_JOINTS} are read")
    parents = tuple(int(p) for p in file.take("parents", (joints,), "iu"))
    offsets = file.take("offsets", (joints, 3))
    ends = {int(e) for e in file.take("ends", (None,))} if "ends" in file else set()
    if any(not 0 <= e < joints for e in ends):
        raise file.bad(f"'ends' names joints that do not exist; there are {joints}")
    root, rotations, moved = _frames(file, joints)
    is_person = (names, parents) == (SMPL22.names, SMPL22.parents)
    groups = SMPL22.groups if is_person else {}
    try:
        body = _body(file, names)
        skeleton = Skeleton(names, parents, offsets.astype(np.float64), frozenset(ends), groups, **body)
        return Motion(skeleton, fps, root, rotations, moved)
    except MotionloomError as error:
        raise file.bad(error) from None


def _frames(file: _Archive, joints: int, prefix: str = "") -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Places of the root, rotations, and translations where there are any."""
    root = file.take(f"{prefix}root", (None, 3))
    turns = file.take(f"{prefix}rotations", (len(root), joints, 4)).astype(np.float64)
    lengths = np.linalg.norm(turns, axis=-1)
    if not (np.abs(lengths - 1) < 1e-3).all():
        odd = lengths.flat[np.abs(lengths - 1).argmax()]
        raise file.bad(f"'{prefix}rotations' must be unit quaternions; one has the length {odd:g}")
    name = f"{prefix}translations"
    moved = file.take(name, (len(root), joints, 3)) if name in file else None
    return root, turns, moved


class _Body(TypedDict, total=False):
    """Arguments of a skeleton that say more of it than its bones."""

    humanoid: dict[str, str]
    on_floor: bool
    soles: dict[int, np.ndarray]
    poses: Poses


def _body(file: _Archive, names: tuple[str, ...]) -> _Body:
    """The opposite of `_body_arrays`."""
    body = _Body()
    if "on_floor" in file:
        body["on_floor"] = bool(file.take("on_floor", (), "b"))
    if "humanoid" in file:
        pairs = file.take("humanoid", (None, 2), "U")
        body["humanoid"] = {str(part): str(name) for part, name in pairs}
        if any(part not in SMPL22.names or name not in names for part, name in body["humanoid"].items()):
            raise file.bad("'humanoid' must pair joints of SMPL with joints of the file")
    if "sole_joints" in file:
        joints = file.take("sole_joints", (None,), "iu")
        points = file.take("sole_points", (len(joints), 3)).astype(np.float64)
        if any(not 0 <= j < len(names) for j in joints):
            raise file.bad(f"'sole_joints' names joints that do not exist; there are {len(names)}")
        body["soles"] = {int(j): points[joints == j] for j in dict.fromkeys(joints.tolist())}
    if "pose_root" in file:
        frames = _frames(file, len(names), "pose_")
        if not len(frames[0]):
            raise file.bad("'pose_root' has no pose; leave it out")
        body["poses"] = Poses(*frames)
    return body


def _from_soma(file: _Archive, fps: float | None) -> Motion:
    from motionloom.io.soma import FPS, soma_motion

    places = file.take("posed_joints", (None, None, 3)).astype(np.float64)
    turns = file.take("global_rot_mats", (*places.shape[:2], 3, 3)).astype(np.float64)
    try:
        return soma_motion(places, turns, FPS if fps is None else fps)
    except MotionloomError as error:
        raise file.bad(error) from None


def _from_positions(file: _Archive, fps: float | None, *, unit: float | None, up: str | None) -> Motion:
    name = next((n for n in _POSITIONS if n in file), None)
    if name is None:
        robot = "joint angles of a robot, which go with its model (docs/robots.md)"
        held = robot if "qpos" in file else file.listed()
        raise MotionloomError(f"{file.path} has neither 'rotations' nor 'positions'; it has {held}")
    places = file.take(name, (None, len(SMPL22), 3)).astype(np.float64)
    if fps is None or not len(places):
        raise MotionloomError(f"{file.path} has positions but no 'fps' or no frames; give the frame rate")
    if np.abs(places).max() > 1e6:
        raise file.bad(f"'{name}' reaches {np.abs(places).max():g}; positions must be in metres")
    from motionloom.core.body.ik import motion_from_positions

    places = places * (unit or 1.0)
    leg = leg_length(places)
    if unit is None and not HUMAN_LEGS[0] <= leg <= HUMAN_LEGS[1]:
        raise file.bad(
            f"the person's legs would be {leg:.3g} m long; say which unit '{name}' are in with --unit, such "
            "as cm (--unit m takes them as they are)"
        )
    return motion_from_positions(upright_places(places, fps, file.path, up), fps)
