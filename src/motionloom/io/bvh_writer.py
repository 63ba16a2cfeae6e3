"""Writing BVH files; `motionloom.io.bvh` reads them and says what the format is."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path
from motionloom.motion import Motion
from motionloom.skeleton import Skeleton

Array = NDArray[np.float64]
SAME_PLACE = 2e-5
"""Metres: a joint that moves less than this in its parent's frame stands still there."""
_ROWS = 4096  # rows formatted at once
_INDENT = 40  # deeper levels are not indented further: the file would grow with the square of the depth


def end_name(parent: str) -> str:
    """The name of a joint's End Site."""
    return f"{parent} End Site"


def save_bvh(motion: Motion, path: Path | str, *, order: str | Mapping[str, str] = "ZXY", unit: float = 1.0) -> Path:
    """Write a motion as BVH and give the path back.

    ``order`` is the order of the rotation channels, for all joints or by joint name (others ``"ZXY"``); ``unit`` is
    metres per unit of length in the file: 1 for Blender, which takes the numbers for metres, 0.01 for programs that
    take them for centimetres (MotionBuilder, Maya, Unreal). Joints whose bones change length get position channels.
    A joint at the tip of its branch that is no End Site itself gets one at zero distance, as some readers demand.
    """
    skeleton = motion.skeleton
    orders = [(order if isinstance(order, str) else order.get(n, "ZXY")).upper() for n in skeleton.names]
    for word in orders:
        if sorted(word) != ["X", "Y", "Z"]:
            raise MotionloomError(f"an order of rotations is made of X, Y and Z, such as ZXY; got {word!r}")
    if not 1e-9 < unit < 1e9:
        raise MotionloomError(f"the unit must be a positive number of metres; got {unit}")
    offsets, moving = _offsets(motion)
    sequence = _depth_first(skeleton)
    tips = set(skeleton.ends) - set(skeleton.parents) - moving - {0}
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(
            "\n".join(_hierarchy(skeleton, sequence, tips, orders=orders, moving=moving, offsets=offsets / unit))
        )
        seconds = f"{1 / motion.fps:.8f}" if 0.01 < motion.fps < 1000 else f"{1 / motion.fps:.12g}"
        file.write(f"\nMOTION\nFrames: {len(motion)}\nFrame Time: {seconds}\n")
        turning = [j for j in sequence if j not in tips]
        layout = "%.6f " * sum(6 if j == 0 or j in moving else 3 for j in turning)
        row = layout[:-1] + "\n"
        angles = {name: _angles(motion, [j for j in turning if orders[j] == name], name) for name in set(orders)}
        for start in range(0, len(motion), _ROWS):
            block = _block(motion, start, turning, angles=angles, orders=orders, moving=moving, unit=unit)
            file.writelines(row % tuple(values) for values in block.tolist())
    return Path(path)


def _offsets(motion: Motion) -> tuple[Array, set[int]]:
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
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        children[parent].append(joint)
    order, stack = [], [0]
    while stack:
        order.append(stack.pop())
        stack += reversed(children[order[-1]])
    return order


def _names(skeleton: Skeleton) -> list[str]:
    """Joint names that survive the format: no braces, no line ends, unique."""
    names: list[str] = []
    taken: set[str] = set()
    for joint, raw in enumerate(skeleton.names):
        name = " ".join(raw.replace("{", "(").replace("}", ")").split()) or f"joint_{joint}"
        name = "".join(c if c.isprintable() else "?" for c in name)
        name = name if name not in taken else f"{name}_{joint}"
        taken.add(name)
        names.append(name)
    return names


def _hierarchy(
    skeleton: Skeleton, sequence: list[int], tips: set[int], *, orders: list[str], moving: set[int], offsets: Array
) -> list[str]:
    names, parents = _names(skeleton), skeleton.parents
    with_children = set(parents)
    lines, depth, open_joints = ["HIERARCHY"], 0, []
    for joint in sequence:
        while open_joints and open_joints[-1] != parents[joint]:
            open_joints.pop()
            depth -= 1
            lines.append(_tab(depth) + "}")
        head = "ROOT " if joint == 0 else "JOINT "
        lines.append(_tab(depth) + ("End Site" if joint in tips else head + names[joint]))
        lines += [_tab(depth) + "{", _tab(depth + 1) + "OFFSET " + " ".join(f"{v:.6f}" for v in offsets[joint])]
        if joint not in tips:
            turns = [f"{axis}rotation" for axis in orders[joint]]
            places = [f"{axis}position" for axis in "XYZ"] if joint == 0 or joint in moving else []
            lines.append(_tab(depth + 1) + " ".join(["CHANNELS", str(len(places + turns)), *places, *turns]))
            if joint not in with_children:
                tab = _tab(depth + 1)
                lines += [tab + "End Site", tab + "{", tab + "\tOFFSET 0 0 0", tab + "}"]
        open_joints.append(joint)
        depth += 1
    lines += [_tab(d) + "}" for d in range(depth - 1, -1, -1)]
    return lines


def _tab(depth: int) -> str:
    return "\t" * min(depth, _INDENT)


def _angles(motion: Motion, joints: list[int], order: str) -> tuple[dict[int, int], Array]:
    """Where each joint stands in the (frames, joints, 3) degrees; continuous over time, no jumps by 180 or 360."""
    if not joints:
        return {}, np.empty((len(motion), 0, 3))
    first = rot.quat_to_euler(order, motion.rotations[:, joints])
    second = first + np.pi
    second[..., 1] = np.pi - first[..., 1]  # the other triple of angles of the same rotation
    stay = _distance(first[1:], first[:-1])
    change = _distance(first[1:], second[:-1])
    flipped = np.concatenate([np.zeros((1, len(joints)), bool), np.cumsum(change < stay - 1e-9, axis=0) % 2 == 1])
    chosen = np.where(flipped[..., None], second, first)
    return {j: at for at, j in enumerate(joints)}, np.degrees(np.unwrap(chosen, axis=0))


def _distance(a: Array, b: Array) -> Array:
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).sum(-1)


def _block(
    motion: Motion,
    start: int,
    turning: list[int],
    *,
    angles: Mapping[str, tuple[dict[int, int], Array]],
    orders: list[str],
    moving: set[int],
    unit: float,
) -> Array:
    """(rows, channels): the numbers of some frames as they stand in the file."""
    rows = slice(start, start + _ROWS)
    columns: list[Array] = []
    for joint in turning:
        if joint == 0:
            columns.append(motion.root[rows] / unit)
        elif joint in moving and motion.translations is not None:
            columns.append(motion.translations[rows, joint] / unit)
        at, degrees = angles[orders[joint]]
        columns.append(degrees[rows, at[joint]])
    return np.round(np.concatenate(columns, axis=1), 6) + 0.0  # + 0.0: no minus zero
