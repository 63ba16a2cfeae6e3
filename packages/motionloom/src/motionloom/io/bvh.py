"""Biovision hierarchy files (BVH), in and out.

A BVH file is a tree of joints with offsets, then one row of channels per frame. It says neither its unit nor
which way is up; see `guess_unit`. Position channels *replace* the OFFSET of their joint, but for those of a joint below
the root that are zero throughout, since bones have a length. End Sites become joints named ``"<parent> End Site"`` and
are listed in ``Skeleton.ends``.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files import text
from motionloom.core.files.bvh_writer import SAME_PLACE, is_tip, moving_offsets, save_bvh
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Poses, Skeleton

__all__ = ["Bvh", "guess_unit", "load_bvh", "read_bvh", "save_bvh"]

Array = NDArray[np.float64]
MAX_JOINTS = 10_000
_POSES = 64
"""How many poses of the clip its skeleton keeps at most (`Skeleton.poses`)."""
_STRETCH = 2
"""A joint ends a bone where it is so many times farther from its parent as from its usual place there."""
_CHANNELS = {f"{axis}{kind}": (axis, kind) for axis in "XYZ" for kind in ("position", "rotation")}


@dataclass(frozen=True)
class Bvh:
    """A BVH file: the motion, and what is needed to write it back the way it came."""

    motion: Motion
    unit: float
    """Metres per unit of length in the file."""
    orders: Mapping[str, str]
    """Order of the rotation channels by joint name, such as ``"ZXY"``."""


@dataclass
class _Joint:
    name: str
    parent: int
    line: int
    end: bool = False
    offset: tuple[float, ...] | None = None
    channels: tuple[str, ...] = ()


def load_bvh(path: Path | str, *, fps: float | None = None, unit: float | None = None) -> Motion:
    """Read a BVH file as a `Motion` in metres.

    ``unit`` is metres per unit of the file (None: `guess_unit`); ``fps`` replaces the rate the file states.
    Raises `MotionloomError` with file and line for whatever is wrong with the file.
    """
    return read_bvh(path, fps=fps, unit=unit).motion


def read_bvh(path: Path | str, *, fps: float | None = None, unit: float | None = None) -> Bvh:
    """Like `load_bvh`, with the unit and the channel orders."""
    data = text.read_text(path)
    split = re.search(rb"(?:^|(?<=\}))[ \t]*+MOTION\b", data, re.MULTILINE | re.IGNORECASE)
    if not re.match(rb"\s*HIERARCHY\b", data, re.IGNORECASE):
        raise MotionloomError(f"{path} is not a BVH file: it does not begin with HIERARCHY")
    if split is None:
        raise MotionloomError(f"{path} has no MOTION part; the file is cut off or not a BVH file")
    joints = _hierarchy(data[: split.start()], path)
    rate, frames = _frames(data, split.end(), joints, path)
    del data, split  # a long file's text and its numbers are not both held from here on
    return _assemble(frames, rate if fps is None else fps, unit)


# Hierarchy -----------------------------------------------------------------------------------------------------------


class _Words:
    """The words of the hierarchy with their lines; braces are words of their own."""

    def __init__(self, data: bytes, path: Path | str) -> None:
        self.path = path
        self.words = [
            (word, number)
            for number, line in enumerate(data.split(b"\n"), start=1)
            for word in text.word(line).replace("{", " { ").replace("}", " } ").split()
        ]
        self.at = 0

    def next(self, what: str) -> str:
        if self.at >= len(self.words):
            raise MotionloomError(f"{self.path}: the hierarchy ends where {what} should follow")
        self.at += 1
        return self.words[self.at - 1][0]

    @property
    def line(self) -> int:
        return self.words[max(self.at - 1, 0)][1]

    def fail(self, message: str) -> MotionloomError:
        return MotionloomError(f"{self.path}, line {self.line}: {message}")

    def name(self) -> str:
        """Everything up to the opening brace: names may hold spaces and colons."""
        parts: list[str] = []
        while (part := self.next("'{'")) != "{":
            parts.append(part)
            if part == "}" or len(parts) > 50:
                raise self.fail("a joint's name must be followed by '{'")
        return " ".join(parts)

    def numbers(self, count: int, what: str) -> tuple[float, ...]:
        values = []
        for _ in range(count):
            word = self.next(f"{count} numbers of {what}")
            value = text.number(word)
            if value is None:
                raise self.fail(f"{what} needs {count} finite numbers below 1e9; {text.shown(word)} is none")
            values.append(value)
        return tuple(values)


def _hierarchy(data: bytes, path: Path | str) -> list[_Joint]:
    """The joints in file order; a loop with a stack, so that depth costs nothing."""
    words = _Words(data, path)
    words.next("HIERARCHY")
    joints: list[_Joint] = []
    open_joints: list[int] = []
    while words.at < len(words.words):
        word = words.next("a joint")
        key = word.upper()
        if key in ("ROOT", "JOINT", "END"):
            _open_joint(words, key, joints, open_joints)
        elif word == "}":
            if not open_joints:
                raise words.fail("'}' without a '{' before it")
            open_joints.pop()
        elif key in ("OFFSET", "CHANNELS") and open_joints:
            _describe(words, key, joints[open_joints[-1]])
        else:
            raise words.fail(f"{text.shown(word)} is not expected here; a joint, OFFSET, CHANNELS or a brace is")
    if not joints:
        raise MotionloomError(f"{path}: the hierarchy has no ROOT")
    if open_joints:
        raise words.fail(f"the joint {text.shown(joints[open_joints[-1]].name)} is never closed with '}}'")
    _check_joints(joints, path)
    return _without_empty_ends(joints)


def _open_joint(words: _Words, key: str, joints: list[_Joint], open_joints: list[int]) -> None:
    line, name = words.line, words.name()
    if (key == "ROOT") != (not open_joints):
        raise words.fail("ROOT must stand outside of braces and JOINT or End Site inside")
    if key == "ROOT" and joints:
        raise words.fail(
            "a second ROOT; files with several skeletons are not read, so save each person to a file of its own"
        )
    if open_joints and joints[open_joints[-1]].end:
        raise words.fail("an End Site cannot hold joints")
    if len(joints) >= MAX_JOINTS:
        raise words.fail(f"more than {MAX_JOINTS} joints")
    if key != "END" and not name:
        raise words.fail(f"{key} without a name")
    joints.append(_Joint(name, open_joints[-1] if open_joints else -1, line, end=key == "END"))
    open_joints.append(len(joints) - 1)


def _check_joints(joints: list[_Joint], path: Path | str) -> None:
    """Unique names, an OFFSET each; End Sites get their names here, when all others are known."""
    names: set[str] = set()
    for joint in joints:
        if not joint.end and joint.name in names:
            raise MotionloomError(
                f"{path}, line {joint.line}: a second joint is called {text.shown(joint.name)}; rename one"
            )
        if joint.offset is None and not joint.end:
            raise MotionloomError(f"{path}, line {joint.line}: the joint {text.shown(joint.name)} has no OFFSET")
        names |= set() if joint.end else {joint.name}
    copies: dict[str, int] = {}
    for joint in joints:
        if joint.end:
            base = joint.name = f"{joints[joint.parent].name} End Site"
            while joint.name in names:
                copies[base] = copies.get(base, 1) + 1
                joint.name = f"{base} {copies[base]}"
            names.add(joint.name)


def _without_empty_ends(joints: list[_Joint]) -> list[_Joint]:
    """The joints without End Sites at no distance, and without those that `is_tip` knows."""
    alone = Counter(j.parent for j in joints)
    numbers = []
    for i, joint in enumerate(joints):
        end, offset = joint.offset or (), joints[joint.parent].offset or (0.0, 0.0, 0.0)
        empty = not any(end) or (alone[joint.parent] == 1 and is_tip(offset, end))
        numbers += [] if joint.end and empty else [i]
    place = {old: new for new, old in enumerate(numbers)} | {-1: -1}
    for i in numbers:
        joints[i].parent = place[joints[i].parent]
    return [joints[i] for i in numbers]


def _describe(words: _Words, key: str, joint: _Joint) -> None:
    if key == "OFFSET":
        joint.offset = words.numbers(3, "OFFSET")
        return
    count = words.next("the number of channels")
    if not re.fullmatch(r"[0-6]", count):
        raise words.fail(f"CHANNELS needs a count from 0 to 6; got {text.shown(count)}")
    if joint.channels or joint.end:
        raise words.fail(
            f"{text.shown(joint.name)} cannot have these CHANNELS: it is an End Site or has channels already"
        )
    channels = tuple(words.next("a channel").capitalize() for _ in range(int(count)))
    for name in channels:
        if name not in _CHANNELS:
            raise words.fail(f"{text.shown(name)} is not a channel; Xposition ... Zrotation are")
    if len(set(channels)) != len(channels):
        raise words.fail(f"{text.shown(joint.name)} has the same channel twice: {' '.join(channels)}")
    joint.channels = channels


# Frames --------------------------------------------------------------------------------------------------------------

_HEAD = re.compile(  # possessive, so that a long run of blanks costs no time
    rb"\s*+Frames?[ \t]*+:?[ \t]*+(\S*+)[ \t]*+\n\s*+Frame[ \t_]*+Time[ \t]*+:?[ \t]*+(\S*+)[ \t]*+(?:\n|\Z)",
    re.IGNORECASE,
)
_RATES = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 90, 100, 120, 200, 240)
_BROADCAST = (12.5, 24000 / 1001, 30000 / 1001, 60000 / 1001)


def _frames(data: bytes, start: int, joints: list[_Joint], path: Path | str) -> "tuple[float, _Reader]":
    """Frames per second, and the frames, read some at a time: neither text nor numbers are kept twice."""
    line = data.count(b"\n", 0, start) + 1
    columns = sum(len(j.channels) for j in joints)
    head = _HEAD.match(data, start)
    if head is None:
        raise MotionloomError(f"{path}, line {line}: MOTION must be followed by 'Frames: N' and 'Frame Time: SECONDS'")
    count, rate = head[1], frame_rate(text.word(head[2]))
    if not re.fullmatch(rb"[0-9]{1,12}", count) or int(count) == 0:
        raise MotionloomError(
            f"{path}, line {line + 1}: Frames must be a whole number above 0; got {text.shown(count)}"
        )
    if rate is None:
        raise MotionloomError(f"{path}: Frame Time must be a number of seconds above 0; got {text.shown(head[2])}")
    if columns == 0:
        raise MotionloomError(f"{path} has no channels, so nothing moves in it")
    first = line + data.count(b"\n", start, head.end())
    total, most = int(count) * columns, (len(data) - head.end() + 1) // 2  # a number takes two characters
    if total <= most:
        text.check_poses(int(count), len(joints), path, numbers=total)
    reader = _Reader(joints, int(count) if total <= most else 0)
    for block in text.number_blocks(data, head.end(), path=path, first_line=first):
        reader.take(block)
    if reader.numbers != total:
        _complain(data, head.end(), int(count), columns, path=path, first=first)
    return rate, reader


class _Reader:
    """Turns rows of numbers into arrays for so many frames; more are only counted.

    ``rotations`` are (frames, joints, 4); of joints with position channels ``moved`` has the columns in ``places``
    (frames, such joints, 3), in the file's unit.
    """

    def __init__(self, joints: list[_Joint], frames: int) -> None:
        self.joints, self.frames, self.numbers = joints, frames, 0
        self.columns = _columns(joints)
        self.width = sum(len(joint.channels) for joint in joints)
        placed = [j for j, joint in enumerate(joints) if any(c.endswith("position") for c in joint.channels)]
        self.moved = {j: k for k, j in enumerate(placed)}
        self.places = np.empty((frames, len(placed), 3))
        self.rotations = np.empty((frames, len(joints), 4))
        self.orders = _orders(joints)
        self._rest = np.empty(0)

    def take(self, numbers: Array) -> None:
        """Add what comes next, which need not end with a row."""
        row, self.numbers = self.numbers // self.width, self.numbers + len(numbers)
        numbers = np.concatenate([self._rest, numbers])
        rows = len(numbers) // self.width
        self._rest = numbers[rows * self.width :].copy()
        values = numbers[: rows * self.width].reshape(rows, self.width)[: max(self.frames - row, 0)]
        here = slice(row, row + len(values))
        for j, k in self.moved.items():
            self.places[here, k] = self.joints[j].offset
            for at, channel in enumerate(self.joints[j].channels):
                axis, kind = _CHANNELS[channel]
                if kind == "position":
                    self.places[here, k, "XYZ".index(axis)] = values[:, self.columns[j] + at]
        self.rotations[here] = rot.IDENTITY
        for order, (members, columns) in self.orders.items():
            self.rotations[here, members] = rot.euler_to_quat(order, np.radians(values[:, columns]))


def frame_rate(seconds: str) -> float | None:
    """Frames per second for a frame time as printed: ``0.033`` and ``0.0333333`` are both 30.

    A usual rate is taken if its frame time, cut or rounded to the printed digits, is what the file says and differs
    by at most 1.2 %; otherwise the exact reciprocal. None if it is not a positive number.
    """
    value = text.number(seconds)
    if value is None or not 1e-6 <= value <= 1e4:
        return None
    digit = 10.0 ** max(int(Decimal(seconds).as_tuple().exponent), -300)  # of an exponent of any number of digits
    for rates, off in ((_RATES, 0.012), (_BROADCAST, 0.012), ((max(round(1 / value), 1),), 1e-4)):
        near = [r for r in rates if abs(1 / r - value) < digit and abs(r * value - 1) < off]
        if near:
            return float(min(near, key=lambda r: abs(r * value - 1)))
    return 1 / value


def _complain(data: bytes, start: int, count: int, columns: int, *, path: Path | str, first: int) -> None:
    rows, line = 0, first
    while start < len(data):
        stop = data.find(b"\n", start)
        stop = len(data) if stop < 0 else stop
        width = len(data[start:stop].split())
        rows += width > 0
        if width not in (0, columns):
            raise MotionloomError(f"{path}, line {line}: {width} numbers where the hierarchy has {columns} channels")
        start, line = stop + 1, line + 1
    raise MotionloomError(f"{path} says {count} frames but holds {rows}; it was cut off or its Frames line is wrong")


# Assembly ------------------------------------------------------------------------------------------------------------


def _assemble(frames: _Reader, fps: float, unit: float | None) -> Bvh:
    joints = frames.joints
    parents = tuple(j.parent for j in joints)
    places = {j: frames.places[:, k] for j, k in frames.moved.items() if j == 0 or frames.places[:, k].any()}
    count = len(frames.rotations)
    offsets = np.array([j.offset or (0.0, 0.0, 0.0) for j in joints])
    root = places.pop(0, np.broadcast_to(offsets[0], (count, 3)))
    offsets, travels = _bones(parents, offsets, places)
    scale = guess_unit(parents, np.where(travels[:, None], 0.0, offsets)) if unit is None else unit
    still = {j for j, place in places.items() if np.ptp(place, axis=0).max() * scale <= SAME_PLACE}
    for j in still:
        offsets[j] = places[j][0]
    root, offsets = root * scale, offsets * scale
    translations = None
    if len(still) < len(places):
        translations = np.empty((count, *offsets.shape))
        translations[:] = offsets
        for j, place in places.items():
            np.multiply(place, scale, out=translations[:, j])
    some = slice(None, None, -(-len(root) // _POSES))
    moved = None if translations is None else translations[some].copy()
    poses = Poses(root[some].copy(), frames.rotations[some].copy(), moved)
    names = tuple(joint.name for joint in joints)
    ends = frozenset(i for i, joint in enumerate(joints) if joint.end)
    skeleton = Skeleton(names, parents, offsets, ends, poses=poses)
    orders = {joints[j].name: order for order, (members, _) in frames.orders.items() for j in members}
    motion = Motion(skeleton, fps, root, frames.rotations, translations)
    return Bvh(motion, scale, orders)


def _bones(parents: tuple[int, ...], offsets: Array, places: Mapping[int, Array]) -> tuple[Array, NDArray[np.bool_]]:
    """(joints, 3) offsets as the frames have them, and (joints,) which joints travel, so that they end no bone.

    places: (frames, 3) of joints with position channels, below joint 0. Where a joint stays, its place is its offset,
    whatever the file says as OFFSET. Where it stays but for noise or stretching, in the body, its usual place is,
    unless the OFFSET is near that.
    """
    offsets, travels = offsets.copy(), np.zeros(len(parents), dtype=bool)
    body = _first_branch(parents)
    for j, place in places.items():
        middle = np.median(place, axis=0)
        length = float(np.linalg.norm(middle))
        away = float(np.percentile(np.linalg.norm(place - middle, axis=-1), 90))
        if not np.ptp(place, axis=0).any():
            offsets[j] = place[0]
        elif j <= body or _STRETCH * away > length:
            travels[j] = True
        elif np.linalg.norm(offsets[j] - middle) > length / 2:
            offsets[j] = middle
    return offsets, travels


def _columns(joints: list[_Joint]) -> list[int]:
    """First column of each joint."""
    return list(np.cumsum([0, *(len(j.channels) for j in joints[:-1])]))


def _orders(joints: list[_Joint]) -> dict[str, tuple[list[int], list[list[int]]]]:
    """For each order of rotation channels the joints that have it, and the columns of their angles."""
    groups: dict[str, tuple[list[int], list[list[int]]]] = {}
    for j, (joint, column) in enumerate(zip(joints, _columns(joints))):
        turns = [(c[0], column + at) for at, c in enumerate(joint.channels) if c.endswith("rotation")]
        if turns:
            order = "".join(axis for axis, _ in turns)
            members, columns = groups.setdefault(order, ([], []))
            members.append(j)
            columns.append([at for _, at in turns])
    return groups


def unit_that_reads_back(motion: Motion, unit: float) -> float:
    """The unit to write a motion in, so that `guess_unit` finds its size again: ``unit``, else metres or another.

    Where no unit does, as for a giant, ``unit`` itself: the reader of the file has to be given it.
    """
    offsets, moving = moving_offsets(motion)
    parents, moved = motion.skeleton.parents, motion.translations
    places = {} if moved is None else {j: moved[:, j] for j in moving}
    offsets, travels = _bones(parents, offsets, places)
    lengths = np.where(travels[:, None], 0.0, offsets)
    tries = (unit, 1.0, 0.01, 0.0254, 0.0254 / 0.45, 0.001)
    for one in tries:
        if abs(guess_unit(parents, lengths / one) / one - 1) < 1e-9:
            return one
    return unit


def _first_branch(parents: tuple[int, ...]) -> int:
    """The first joint with several children, where the body begins; 0 where joint 0 is it."""
    only_child = np.bincount(np.array(parents[1:], int), minlength=len(parents)) == 1
    first = int(np.argmin(only_child)) if only_child[0] else 0  # children follow at once as long as nothing branches
    return first if first in parents else 0


def guess_unit(parents: tuple[int, ...], offsets: Array) -> float:
    """Metres per unit for a skeleton of unknown unit, from the longest way along its bones, tip to tip.

    On an adult that way (toe to fingertip or skull) is 1.6 to 2.6 m in any pose. Below 4.2 units it is taken
    for metres, 25 to 55 for the unit of the CMU skeleton files (0.0564 m), 55 to 110 for inches, 450 and
    more for millimetres, and anything else for centimetres. Wrong for a doll, a giant or a lone hand: say the unit.
    Bones above the first joint that branches (a reference joint, metres from the body) do not count.
    """
    reach = np.zeros(len(parents))
    longest = 0.0
    for j in range(len(parents) - 1, _first_branch(parents), -1):
        way = reach[j] + float(np.linalg.norm(offsets[j]))
        longest = max(longest, reach[parents[j]] + way)
        reach[parents[j]] = max(reach[parents[j]], way)
    table = ((0.2, 0.01), (4.2, 1.0), (25.0, 0.01), (55.0, 0.0254 / 0.45), (110.0, 0.0254), (450.0, 0.01))
    return next((unit for below, unit in table if longest < below), 0.001)
