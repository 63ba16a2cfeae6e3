"""Motions as NumPy archives, never with pickle.

Layout (version 1), for a motion of T frames and J joints:

==============  ==================  ===========================================================================
``version``     int                 1
``names``       (J,) text           joint names
``parents``     (J,) int            number of each joint's parent; -1 for joint 0
``offsets``     (J, 3) float        metres, each joint in its parent's frame at rest
``ends``        (E,) int            joints that are mere bone tips
``fps``         float               frames per second
``root``        (T, 3) float        metres, joint 0 in the world
``rotations``   (T, J, 4) float     quaternions (w, x, y, z), each joint in its parent's frame
``translations``  (T, J, 3) float   only where bones change length: metres in the parent's frame
``positions``   (T, J, 3) float32   metres in the world; for your convenience, not read back
==============  ==================  ===========================================================================

An archive without ``rotations`` but with positions (T, 22, 3) of the SMPL joints in metres and an ``fps`` is read too.
"""

import io
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Container
from pathlib import Path

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.io import text
from motionloom.io.atomic import atomic_path
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22, Skeleton

VERSION = 1
MAX_JOINTS = 10_000
_POSITIONS = ("positions", "joints", "motion", "arr_0")
_BROKEN = (
    zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, SyntaxError, ValueError, TypeError, KeyError,
    OSError, EOFError, NotImplementedError, RuntimeError, OverflowError, MemoryError, IndexError,
)  # fmt: skip


def save_npz(motion: Motion, path: Path | str) -> Path:
    """Write a motion in the layout above and give the path back."""
    skeleton = motion.skeleton
    moved = {} if motion.translations is None else {"translations": motion.translations}
    arrays = {
        "version": np.array(VERSION),
        "names": np.array(skeleton.names),
        "parents": np.array(skeleton.parents, dtype=np.int64),
        "offsets": skeleton.offsets,
        "ends": np.array(sorted(skeleton.ends), dtype=np.int64),
        "fps": np.array(float(motion.fps)),
        "root": motion.root,
        "rotations": motion.rotations,
        "positions": motion.positions().astype(np.float32),
        **moved,
    }
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return Path(path)


def load_npz(path: Path | str, *, fps: float | None = None) -> Motion:
    """Read a motion; ``fps`` replaces the stored rate. Raises `MotionloomError` for anything but the layouts above."""
    arrays = read_arrays(path)
    rate = fps
    if rate is None and "fps" in arrays:
        rate = float(_array(arrays, "fps", (), path=path))
    if rate is not None and not 1e-4 <= rate <= 1e6:
        raise MotionloomError(f"{path} is said to have {rate:g} frames per second; give the true frame rate")
    if "rotations" in arrays:
        if rate is None:
            raise MotionloomError(f"{path} has no 'fps'; give the frame rate")
        return _motion(arrays, rate, path)
    return _from_positions(arrays, rate, path)


def read_arrays(
    path: Path | str, *, max_bytes: int = text.MAX_BYTES, only: Container[str] | None = None
) -> dict[str, np.ndarray]:
    """All arrays of an archive, with sizes checked before anything is unpacked; objects (pickle) are refused.

    ``only``: names of the arrays that are wanted; the others are never looked at.
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
            named = {m.filename.removesuffix(".npy"): m for m in members}
            return {n: _unpack(archive, m, path) for n, m in named.items() if only is None or n in only}
    except MotionloomError:
        raise
    except _BROKEN as error:
        raise MotionloomError(f"{path} is a damaged NPZ archive ({type(error).__name__})") from None


def _unpack(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path | str) -> np.ndarray:
    with archive.open(member) as stream:
        file = io.BytesIO(stream.read(member.file_size))
    version = np.lib.format.read_magic(file)
    reader = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
    shape, fortran, dtype = reader(file)
    name = text.shown(member.filename.removesuffix(".npy"))
    if dtype.kind not in "fiubU":
        raise MotionloomError(
            f"{path}: the array {name} holds {dtype}, not numbers or text; pickled objects are never read"
        )
    left = file.getbuffer().nbytes - file.tell()
    if any(n < 0 for n in shape) or math.prod(shape) * dtype.itemsize != left:
        raise MotionloomError(f"{path}: the array {name} says {shape} but holds {left} bytes; the archive is damaged")
    flat = np.frombuffer(file.getbuffer()[file.tell() :], dtype=dtype) if left else np.empty(0, dtype)
    if dtype.kind == "U" and left:
        codes = flat.view(np.dtype(np.uint32).newbyteorder(dtype.byteorder))
        if ((codes > 0x10FFFF) | ((codes >= 0xD800) & (codes < 0xE000))).any():
            raise MotionloomError(
                f"{path}: the array {name} holds characters that do not exist; the archive is damaged"
            )
    return flat.reshape(shape[::-1]).T if fortran else flat.reshape(shape)


def _listed(arrays: dict[str, np.ndarray]) -> str:
    return ", ".join(text.shown(n) for n in list(arrays)[:12]) or "none"


def _array(
    arrays: dict[str, np.ndarray], name: str, shape: tuple[int | None, ...], *, path: Path | str, kinds: str = "fiu"
) -> np.ndarray:
    """The array of that name with the wanted shape (None: any length) and kind of number."""
    if name not in arrays:
        raise MotionloomError(f"{path} has no array '{name}'; it has {_listed(arrays)}")
    found = arrays[name]
    same = len(found.shape) == len(shape) and all(w is None or w == n for w, n in zip(shape, found.shape))
    if not same or found.dtype.kind not in kinds:
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise MotionloomError(f"{path}: '{name}' must have the shape {wanted}; it is {found.shape} of {found.dtype}")
    if kinds != "U" and not (np.abs(found.astype(np.float64)) <= text.LIMIT).all():
        raise MotionloomError(f"{path}: '{name}' has numbers that are not finite (NaN or infinity) or above 1e9")
    return found


def _motion(arrays: dict[str, np.ndarray], fps: float, path: Path | str) -> Motion:
    version = int(_array(arrays, "version", (), path=path, kinds="iu")) if "version" in arrays else VERSION
    if version != VERSION:
        raise MotionloomError(f"{path} has the layout of version {version}; this program reads version {VERSION}")
    names = tuple(str(n) for n in _array(arrays, "names", (None,), path=path, kinds="U"))
    joints = len(names)
    if joints > MAX_JOINTS:
        raise MotionloomError(f"{path} has {joints} joints; at most {MAX_JOINTS} are read")
    parents = tuple(int(p) for p in _array(arrays, "parents", (joints,), path=path, kinds="iu"))
    offsets = _array(arrays, "offsets", (joints, 3), path=path)
    ends = {int(e) for e in _array(arrays, "ends", (None,), path=path)} if "ends" in arrays else set()
    if any(not 0 <= e < joints for e in ends):
        raise MotionloomError(f"{path}: 'ends' names joints that do not exist; there are {joints}")
    root = _array(arrays, "root", (None, 3), path=path)
    rotations = _array(arrays, "rotations", (len(root), joints, 4), path=path).astype(np.float64)
    lengths = np.linalg.norm(rotations, axis=-1)
    if not (np.abs(lengths - 1) < 1e-3).all():
        odd = lengths.flat[np.abs(lengths - 1).argmax()]
        raise MotionloomError(f"{path}: 'rotations' must be unit quaternions; one has the length {odd:g}")
    moved = _array(arrays, "translations", (len(root), joints, 3), path=path) if "translations" in arrays else None
    groups = SMPL22.groups if names == SMPL22.names and parents == SMPL22.parents else {}
    try:
        skeleton = Skeleton(names, parents, offsets.astype(np.float64), frozenset(ends), groups)
        return Motion(skeleton, fps, root, rotations, moved)
    except MotionloomError as error:
        raise MotionloomError(f"{path}: {error}") from None


def _from_positions(arrays: dict[str, np.ndarray], fps: float | None, path: Path | str) -> Motion:
    name = next((n for n in _POSITIONS if n in arrays), None)
    if name is None:
        raise MotionloomError(f"{path} has neither 'rotations' nor 'positions'; it has {_listed(arrays)}")
    places = _array(arrays, name, (None, len(SMPL22), 3), path=path).astype(np.float64)
    if fps is None or not len(places):
        raise MotionloomError(f"{path} has positions but no 'fps' or no frames; give the frame rate")
    if np.abs(places).max() > 1e6:
        raise MotionloomError(f"{path}: '{name}' reaches {np.abs(places).max():g}; positions must be in metres")
    from motionloom.kinematics.ik import motion_from_positions

    return motion_from_positions(places, fps)
