"""Writing BVH files; `motionloom.io.bvh` reads them and says what the format is.

A hand, a head or a toe joint has no length of its own, and programs that draw bones from joint to joint want one. So
a joint at the tip of its branch is written with an End Site at `SHARE` of its own bone's length. The share is no round
number and is how a reader knows these End Sites again: they are no joints, and reading leaves them out.
"""

from collections.abc import Mapping, Sequence
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton

Array = NDArray[np.float64]
SAME_PLACE = 2e-5
"""Metres: a joint that moves less than this in its parent's frame stands still there."""
SHARE = 0.41421356
SHORTEST = 1e-4
"""Bones below this, in the file's unit, give their ends no length."""
_SAME = 3e-6
"""What rounding to six digits, here and in the bone's own OFFSET, changes at most."""
_ROWS = 4096  # rows formatted at once
_INDENT = 40  # deeper levels are not indented further: the file would grow with the square of the depth


def save_bvh(motion: Motion, path: Path | str, *, order: str | Mapping[str, str] = "ZXY", unit: float = 1.0) -> Path:
    """Write a motion as BVH and give the path back.

    ``order`` is the order of the rotation channels, for all joints or by joint name (others ``"ZXY"``); ``unit`` is
    metres per unit of length in the file: 1 for Blender, which takes the numbers for metres, 0.01 for programs that
    take them for centimetres (MotionBuilder, Maya, Unreal). Joints whose bones change length get position channels.
    A joint at the tip of its branch that is no End Site itself gets one that gives it a length.
    """
    with atomic_path(path) as temporary, temporary.open("wb", buffering=0) as file:
        growing = GrowingBvh(file, motion, order=order, unit=unit, frames=len(motion))
        growing.write(motion)
        growing.finish()
    return Path(path)


class GrowingBvh:
    """A BVH file that is written as the motion is generated, in memory that does not grow with its length.

    The hierarchy is written at once, frames as they come, and their number at the end, in the place kept for it.
    Angles go on without jumps from one piece to the next. After an error or an interruption `finish` still leaves a
    valid file with all pieces that were written whole.
    """

    def __init__(
        self,
        file: FileIO,
        first: Motion,
        *,
        order: str | Mapping[str, str] = "ZXY",
        unit: float = 1.0,
        frames: int | None = None,
    ) -> None:
        """``file`` is open for writing without a buffer and empty; ``first`` is a motion whose skeleton, rate and
        changing bones all pieces share; ``frames`` is how many are expected. ``order``, ``unit``: `save_bvh`."""
        skeleton = first.skeleton
        self.orders = [(order if isinstance(order, str) else order.get(n, "ZXY")).upper() for n in skeleton.names]
        for word in self.orders:
            if sorted(word) != ["X", "Y", "Z"]:
                raise MotionloomError(f"an order of rotations is made of X, Y and Z, such as ZXY; got {word!r}")
        if not 1e-9 < unit < 1e9:
            raise MotionloomError(f"the unit must be a positive number of metres; got {unit}")
        offsets, self.moving = moving_offsets(first)
        # position channels say where the root is; some programs (three.js) add its OFFSET, others (Blender) do not
        offsets = np.concatenate([np.zeros((1, 3)), offsets[1:]]) / unit
        sequence = _depth_first(skeleton)
        self.tips = set(skeleton.ends) - set(skeleton.parents) - self.moving - {0}
        self.turning = [j for j in sequence if j not in self.tips]
        self.angles = {
            name: _Angles([j for j in self.turning if self.orders[j] == name], name) for name in set(self.orders)
        }
        self.file, self.unit, self.frames = file, unit, 0
        self.row = ("%.6f " * sum(6 if j == 0 or j in self.moving else 3 for j in self.turning))[:-1] + "\n"
        self.places = len(str(frames)) if frames else 12
        lines = self._hierarchy(skeleton, sequence, offsets)
        seconds = format(1 / first.fps, ".8f" if 0.01 < first.fps < 1000 else ".12g")
        self.count_at = _write(file, "\n".join([*lines, "MOTION", "Frames: "]).encode())
        self.end = self.count_at + _write(file, f"{0:>{self.places}}\nFrame Time: {seconds}\n".encode())

    def write(self, piece: Motion) -> None:
        """Add frames; each `_ROWS` of them count once they are on the disk."""
        if len(str(self.frames + len(piece))) > self.places:
            raise MotionloomError(f"more frames came than were announced; no number above {'9' * self.places} fits")
        self.file.seek(self.end)  # over what an earlier failure left half written
        for start in range(0, len(piece), _ROWS):
            block = self._block(piece.frames(start, start + _ROWS))
            self.end += _write(self.file, "".join(self.row % tuple(values) for values in block.tolist()).encode())
            self.frames += len(block)

    def finish(self) -> None:
        """Drop what was not written whole, and say how many frames there are."""
        self.file.truncate(self.end)
        self.file.seek(self.count_at)
        _write(self.file, f"{self.frames:>{self.places}}".encode())

    def _block(self, motion: Motion) -> Array:
        """(rows, channels): the numbers of some frames as they are in the file."""
        degrees = {name: angles.degrees(motion.rotations) for name, angles in self.angles.items()}
        columns: list[Array] = []
        for joint in self.turning:
            if joint == 0:
                columns.append(motion.root / self.unit)
            elif joint in self.moving and motion.translations is not None:
                columns.append(motion.translations[:, joint] / self.unit)
            name = self.orders[joint]
            columns.append(degrees[name][:, self.angles[name].at[joint]])
        return np.round(np.concatenate(columns, axis=1), 6) + 0.0  # no minus zero

    def _hierarchy(self, skeleton: Skeleton, sequence: list[int], offsets: Array) -> list[str]:
        names, parents = _names(skeleton), skeleton.parents
        with_children, low = set(parents), low_joints(parents, offsets)
        lines, depth, open_joints = ["HIERARCHY"], 0, []
        for joint in sequence:
            while open_joints and open_joints[-1] != parents[joint]:
                open_joints.pop()
                depth -= 1
                lines.append(_tab(depth) + "}")
            head = "ROOT " if joint == 0 else "JOINT "
            lines.append(_tab(depth) + ("End Site" if joint in self.tips else head + names[joint]))
            offset = " ".join(f"{v:.6f}" for v in offsets[joint])
            lines += [_tab(depth) + "{", _tab(depth + 1) + "OFFSET " + offset]
            if joint not in self.tips:
                turns = [f"{axis}rotation" for axis in self.orders[joint]]
                placed = joint == 0 or joint in self.moving
                places = [f"{axis}position" for axis in "XYZ"] if placed else []
                lines.append(_tab(depth + 1) + " ".join(["CHANNELS", str(len(places + turns)), *places, *turns]))
                if joint not in with_children:
                    tab = _tab(depth + 1)
                    end = " ".join(f"{v:.6f}" for v in tip(offsets[joint], level=bool(low[joint])) + 0.0)
                    lines += [tab + line for line in ("End Site", "{", f"\tOFFSET {end}", "}")]
            open_joints.append(joint)
            depth += 1
        lines += [_tab(d) + "}" for d in range(depth - 1, -1, -1)]
        return lines


def _write(file: FileIO, data: bytes) -> int:
    """Write all of it, however little the system takes at once; gives how much that was."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) :]
    return len(data)


def moving_offsets(motion: Motion) -> tuple[Array, set[int]]:
    """(joints, 3) rest offsets in metres and the joints, root aside, whose place in their parent changes."""
    offsets = motion.skeleton.offsets.copy()
    moving: set[int] = set()
    if motion.translations is not None:
        still = np.ptp(motion.translations, axis=0).max(-1) <= SAME_PLACE
        still[0] = True
        moving = set(np.flatnonzero(~still).tolist())
        offsets[1:] = np.where(still[1:, None], motion.translations[0, 1:], offsets[1:])
    return offsets, moving


def _depth_first(skeleton: Skeleton) -> list[int]:
    order, stack = [], [0]
    while stack:
        order.append(stack.pop())
        stack += reversed(skeleton.children(order[-1]))
    return order


def _names(skeleton: Skeleton) -> list[str]:
    """Joint names that survive the format: no braces, no line ends, unique."""
    names: list[str] = []
    used: set[str] = set()
    for joint, raw in enumerate(skeleton.names):
        name = " ".join(raw.replace("{", "(").replace("}", ")").split()) or f"joint_{joint}"
        name = "".join(c if c.isprintable() else "?" for c in name)
        while name in used:
            name = f"{name}_{joint}"
        used.add(name)
        names.append(name)
    return names


def _tab(depth: int) -> str:
    return "\t" * min(depth, _INDENT)


class _Angles:
    """Angles of some joints that do not jump by 180 or 360 degrees, neither in a piece nor from one to the next."""

    def __init__(self, joints: list[int], order: str) -> None:
        self.joints, self.order = joints, order
        self.at = {joint: column for column, joint in enumerate(joints)}
        self.last = np.empty((0, len(joints), 3))  # the last frame's radians: as they come from its rotation,
        self.written = self.last  # and as they were written
        self.flipped = np.zeros(len(joints), bool)  # whether the other triple of angles was taken

    def degrees(self, rotations: Array) -> Array:
        """(frames, joints, 3) of the next piece, whose ``rotations`` are (frames, all joints, 4)."""
        if not self.joints:
            return np.empty((len(rotations), 0, 3))
        fresh = rot.quat_to_euler(self.order, rotations[:, self.joints])
        first = np.concatenate([self.last, fresh])
        second = first + np.pi
        second[..., 1] = np.pi - first[..., 1]  # the other triple of angles of the same rotation
        stay = _distance(first[1:], first[:-1])
        change = _distance(first[1:], second[:-1])
        flips = np.concatenate([self.flipped[None], change < stay - 1e-9])
        turns = np.cumsum(flips, axis=0) % 2 == 1
        known = len(self.last)
        flipped = turns[known:] if known else turns
        chosen = np.where(flipped[..., None], second[known:], fresh)
        radians = np.unwrap(np.concatenate([self.written, chosen]), axis=0)[known:]
        self.last, self.written, self.flipped = fresh[-1:], radians[-1:], flipped[-1]
        return np.degrees(radians)


def _distance(a: Array, b: Array) -> Array:
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).sum(-1)


# --- End Sites that say where a last bone ends --------------------------------------------------------------------


def tip(offset: Array, *, level: bool) -> Array:
    """(3,) the End Site of a joint with this offset: straight on, or ``level`` with the ground for a toe."""
    length = float(np.linalg.norm(offset))
    if length < SHORTEST:
        return np.zeros(3)
    ahead = offset * np.array([1.0, 0.0, 1.0]) if level else offset
    if float(np.linalg.norm(ahead)) < 0.1 * length:
        ahead = offset
    return SHARE * length * ahead / float(np.linalg.norm(ahead))


def is_tip(offset: Sequence[float], end: Sequence[float]) -> bool:
    """Whether the End Site ``end`` of a joint with this offset is that of `tip`."""
    bone, there = np.array(offset, dtype=np.float64), np.array(end, dtype=np.float64)
    return float(np.linalg.norm(bone)) >= SHORTEST and any(
        float(np.abs(tip(bone, level=level) - there).max()) < _SAME for level in (False, True)
    )


def low_joints(parents: Sequence[int], offsets: Array) -> NDArray[np.bool_]:
    """(joints,) which joints are near the ground at rest: toes, whose tips must not point into it."""
    heights = np.array(offsets[:, 1])
    for j, parent in enumerate(parents[1:], start=1):
        heights[j] += heights[parent]
    low, high = float(heights.min()), float(heights.max())
    return np.asarray(heights < low + 0.1 * (high - low))
