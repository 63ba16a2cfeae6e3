"""Acclaim skeletons and motions (ASF + AMC), in.

Positions belong to the END of a bone, and each bone turns its own end. With C the rotation of the bone's ``axis``
and M that of its angles (XYZ: first x, then y, then z)::

    R(bone) = R(parent) C M C^-1        end(bone) = end(parent) + R(bone) direction * length

The `Skeleton` has the joint ``root`` and one joint per bone, with the bone's name, at the bone's end. A joint turns
what hangs on it, so the joint at an end carries the rotation of the one bone that starts there. Where several
bones start at one point, each that can turn has a joint ``"<bone> start"`` there, at zero distance.
"""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files import text
from motionloom.core.files.atomic import finished
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton

Array = NDArray[np.float64]
AMC_FPS = 120.0
"""The rate of CMU's own AMC files; the format has no field for it."""
MAX_BONES = 10_000
_DOFS = {"tx", "ty", "tz", "rx", "ry", "rz"}


@dataclass(frozen=True)
class Bone:
    """One bone of an ASF file, lengths in its own unit, angles in radians."""

    name: str
    end: tuple[float, float, float]
    """direction * length."""
    axis: tuple[float, float, float]
    axis_order: str
    dofs: tuple[str, ...]


@dataclass(frozen=True)
class Asf:
    """An ASF file. ``bones[0]`` is the root; ``parents[i]`` is the number of bone i's parent."""

    bones: tuple[Bone, ...]
    parents: tuple[int, ...]
    unit: float
    """Metres per unit of length."""
    degrees: bool


def load_asf_amc(asf: Path | str, amc: Path | str, *, fps: float | None = None, unit: float | None = None) -> Motion:
    """Read a skeleton and a motion for it as a `Motion` in metres.

    ``fps`` defaults to 120, the rate of CMU's own files; ``unit`` (metres per unit) to what the ASF file says.
    Raises `MotionloomError` with file and line for whatever is wrong.
    """
    skeleton = read_asf(asf)
    values, degrees = read_amc(amc, skeleton)
    fps = AMC_FPS if fps is None else fps
    return _assemble(skeleton, values, degrees, fps, skeleton.unit if unit is None else unit)


def load_amc(
    path: Path | str, *, asf: Path | str | None = None, fps: float | None = None, unit: float | None = None
) -> Motion:
    """Read a motion as `load_asf_amc` does; ``asf`` None: the skeleton that lies beside it (`find_asf`)."""
    return load_asf_amc(asf or find_asf(path), path, fps=fps, unit=unit)


# ASF -----------------------------------------------------------------------------------------------------------------


def read_asf(path: Path | str) -> Asf:
    """Read a skeleton; joints are not placed yet."""
    sections = _sections(text.read_text(path, max_bytes=64 * 1024**2), path)
    for name in ("root", "bonedata", "hierarchy"):
        if name not in sections:
            raise MotionloomError(f"{path} has no :{name} section; it is cut off or not an ASF file")
    unit, degrees = _units(sections.get("units", []), path)
    scale = np.pi / 180 if degrees else 1.0
    bones = [_root(sections["root"], path, scale), *_bones(sections["bonedata"], path, scale)]
    names = [b.name for b in bones]
    if len(bones) > MAX_BONES:
        raise MotionloomError(f"{path} has {len(bones)} bones; at most {MAX_BONES} are read")
    if len(set(names)) != len(names):
        twice = Counter(names).most_common(1)[0][0]
        raise MotionloomError(f"{path}: the bone {text.shown(twice)} appears twice")
    order, parents = _tree(sections["hierarchy"], names, path)
    return Asf(tuple(bones[i] for i in order), parents, unit, degrees)


Line = tuple[int, list[str]]


def _sections(data: bytes, path: Path | str) -> dict[str, list[Line]]:
    sections: dict[str, list[Line]] = {}
    current: list[Line] = []
    for number, raw in enumerate(data.split(b"\n"), start=1):
        words = text.word(raw.partition(b"#")[0]).split()
        if words and words[0].startswith(":"):
            current = sections.setdefault(words[0][1:].lower(), [])
            words = words[1:]
        if words:
            current.append((number, words))
    if not sections:
        raise MotionloomError(f"{path} is not an ASF file: it has no sections such as :bonedata")
    return sections


def _units(lines: list[Line], path: Path | str) -> tuple[float, bool]:
    fields = {words[0].lower(): (number, words) for number, words in lines}
    length = 1.0
    if "length" in fields:
        number, words = fields["length"]
        length = _numbers(words[1:], 1, (path, number, "length"))[0]
        if not 1e-6 <= length <= 1e6:
            raise MotionloomError(f"{path}, line {number}: the unit of length must be above 0; got {length:g}")
    angle = fields.get("angle", (0, ["angle", "deg"]))[1]
    return 0.0254 / length, not angle[-1].lower().startswith("rad")


def _numbers(words: list[str], count: int, where: tuple[Path | str, int, str]) -> tuple[float, ...]:
    values = [text.number(w) for w in words[:count]]
    if len(values) < count or None in values:
        path, number, what = where
        raise MotionloomError(
            f"{path}, line {number}: {what} needs {count} finite number(s); got {text.shown(' '.join(words))}"
        )
    return tuple(v for v in values if v is not None)


def _root(lines: list[Line], path: Path | str, scale: float) -> Bone:
    fields = {words[0].lower(): (number, words[1:]) for number, words in lines}
    number, dofs = fields.get("order", (0, ["TX", "TY", "TZ", "RX", "RY", "RZ"]))
    dofs = tuple(w.lower() for w in dofs)
    if len(set(dofs)) != len(dofs) or not _DOFS.issuperset(dofs):
        raise MotionloomError(
            f"{path}, line {number}: the root's order must name TX TY TZ RX RY RZ; got {text.shown(' '.join(dofs))}"
        )
    values = []
    for key in ("position", "orientation"):
        number, words = fields.get(key, (0, ["0", "0", "0"]))
        values.append(np.array(_numbers(words, 3, (path, number, key))))
    number, words = fields.get("axis", (0, ["XYZ"]))
    order = _axis_order(words[-1] if words else "", path, number)
    return Bone("root", tuple(values[0]), tuple(values[1] * scale), order, dofs)


def _axis_order(word: str, path: Path | str, number: int) -> str:
    if sorted(word.upper()) != ["X", "Y", "Z"]:
        raise MotionloomError(f"{path}, line {number}: an axis order such as XYZ is needed; got {text.shown(word)}")
    return word.upper()


def _bones(lines: list[Line], path: Path | str, scale: float) -> list[Bone]:
    bones: list[Bone] = []
    block: dict[str, Line] | None = None
    for number, words in lines:
        key = words[0].lower()
        if key == "begin":
            if block is not None:
                raise MotionloomError(f"{path}, line {number}: 'begin' before the bone above has its 'end'")
            block = {}
        elif block is None:
            raise MotionloomError(f"{path}, line {number}: {text.shown(words[0])} stands outside 'begin' and 'end'")
        elif key == "end":
            bones.append(_bone(block, path, number, scale=scale))
            block = None
        else:
            block.setdefault(key, (number, words[1:]))
    if block is not None:
        raise MotionloomError(f"{path}: the last bone has no 'end'; the file is cut off")
    return bones


def _bone(block: dict[str, Line], path: Path | str, line: int, *, scale: float) -> Bone:
    for key in ("name", "direction", "length", "axis"):
        if key not in block or not block[key][1]:
            raise MotionloomError(f"{path}, line {line}: the bone that ends here has no {key}")
    name = " ".join(block["name"][1])
    direction = np.array(_numbers(block["direction"][1], 3, (path, block["direction"][0], "direction")))
    length = _numbers(block["length"][1], 1, (path, block["length"][0], "length"))[0]
    number, words = block["axis"]
    axis = np.array(_numbers(words, 3, (path, number, "axis"))) * scale
    order = _axis_order(words[3] if len(words) > 3 else "XYZ", path, number)
    number, dofs = block.get("dof", (line, []))
    dofs = tuple(d.lower() for d in dofs)
    if len(set(dofs)) != len(dofs) or not set(dofs) <= {"rx", "ry", "rz"}:
        raise MotionloomError(
            f"{path}, line {number}: a bone may turn by rx, ry and rz; got {text.shown(' '.join(dofs))}"
        )
    end = direction * length
    if not np.isfinite(end).all():
        raise MotionloomError(f"{path}, line {line}: the bone {text.shown(name)} is infinitely long")
    return Bone(name, tuple(end), tuple(axis), order, dofs)


def _tree(lines: list[Line], names: list[str], path: Path | str) -> tuple[list[int], tuple[int, ...]]:
    """Bone numbers with parents before children, and each one's parent by its place in that order."""
    number_of = {name: i for i, name in enumerate(names)}
    parent_of: dict[int, int] = {}
    children: dict[int, list[int]] = {}
    for line, words in lines:
        if words[0].lower() in ("begin", "end"):
            continue
        for word in words:
            if word not in number_of:
                raise MotionloomError(f"{path}, line {line}: no bone is called {text.shown(word)}")
        parent, *below = (number_of[w] for w in words)
        for child in below:
            if child == 0 or child in parent_of:
                raise MotionloomError(f"{path}, line {line}: {text.shown(names[child])} cannot hang on a second bone")
            parent_of[child] = parent
            children.setdefault(parent, []).append(child)
    order, stack = [], [0]
    while stack:
        order.append(stack.pop())
        stack += reversed(children.get(order[-1], []))
    if len(order) != len(names):
        there = set(order)
        lost = next(n for i, n in enumerate(names) if i not in there)
        raise MotionloomError(
            f"{path}: the bone {text.shown(lost)} does not hang on the root; the hierarchy is cyclic or incomplete"
        )
    place = {bone: at for at, bone in enumerate(order)}
    return order, tuple(-1 if b == 0 else place[parent_of[b]] for b in order)


# AMC -----------------------------------------------------------------------------------------------------------------


def read_amc(path: Path | str, asf: Asf) -> tuple[dict[str, Array], bool]:
    """(frames, dofs) numbers by bone name as they are in the file, and whether angles are degrees."""
    data = text.read_text(path)
    rows: dict[str, list[bytes]] = {}
    dofs = {b.name.encode(): len(b.dofs) for b in asf.bones if b.dofs}
    degrees, counters, whole = asf.degrees, [], set()
    bones: set[bytes] = set()
    for line, raw in enumerate(data.split(b"\n"), start=1):
        words = raw.split()
        if not words or words[0][:1] in b"#:":
            if words:
                degrees = {b":DEGREES": True, b":RADIANS": False}.get(words[0].upper(), degrees)
        elif len(words) == 1 and words[0].isdigit():
            whole = _close_frame(bones, whole, (path, line, len(counters)))
            counters.append(int(words[0][:18]))
            bones = set()
        else:
            _check_row(words, dofs, bones, where=(path, line, bool(counters)))
            bones.add(words[0])
            rows.setdefault(text.word(words[0]), []).extend(words[1:])
    _close_frame(bones, whole, (path, data.count(b"\n") + 1, len(counters)))
    _check_counters(counters, path)
    return {name: _values(words, len(counters), data, path=path) for name, words in rows.items()}, degrees


def _close_frame(bones: set[bytes], whole: set[bytes], where: tuple[Path | str, int, int]) -> set[bytes]:
    """Every frame must hold the bones of the first."""
    path, line, frame = where
    if frame == 0:
        return whole
    if frame == 1:
        whole = bones
    if not bones:
        raise MotionloomError(f"{path}, line {line}: frame {frame} is empty; the file is cut off or no AMC file")
    if bones != whole:
        odd = min(bones ^ whole)
        change = f"frame {frame} {'lacks' if odd in whole else 'adds'} {text.shown(odd)}, unlike the first"
        raise MotionloomError(f"{path}, line {line}: {change}; the file is cut off or damaged")
    return whole


def _check_row(
    words: list[bytes], dofs: dict[bytes, int], bones: set[bytes], *, where: tuple[Path | str, int, bool]
) -> None:
    path, line, begun = where
    name = words[0]
    if not begun:
        raise MotionloomError(
            f"{path}, line {line}: {text.shown(name)} before the first frame number; is this an AMC file?"
        )
    if dofs.get(name) != len(words) - 1:
        known = (
            f"has {dofs[name]} in the ASF file"
            if name in dofs
            else "is no turning bone of the ASF file; do the two belong together?"
        )
        raise MotionloomError(f"{path}, line {line}: {text.shown(name)} with {len(words) - 1} numbers {known}")
    if name in bones:
        raise MotionloomError(f"{path}, line {line}: {text.shown(name)} appears twice in one frame")


def _check_counters(counters: list[int], path: Path | str) -> None:
    if not counters:
        raise MotionloomError(f"{path} has no frames; it is cut off or not an AMC file")
    steps = np.diff(np.array(counters))
    if len(steps) and (steps[0] < 1 or (steps != steps[0]).any()):
        at = int(np.argmax(steps != steps[0])) if steps[0] >= 1 else 0
        raise MotionloomError(
            f"{path}: frame {counters[at]} is followed by frame {counters[at + 1]}; frames are missing or out of order"
        )


def _values(words: list[bytes], frames: int, data: bytes, *, path: Path | str) -> Array:
    try:
        values = text.numbers(b" ".join(words), path=path, first_line=1)
    except MotionloomError:
        for line, raw in enumerate(data.split(b"\n"), start=1):
            for w in raw.split()[1:]:
                if raw.lstrip()[:1] not in b"#:" and text.number(w) is None:
                    raise MotionloomError(f"{path}, line {line}: {text.shown(w)} is not a finite number") from None
        raise
    return values.reshape(frames, -1)


# Assembly ------------------------------------------------------------------------------------------------------------


def _turn(order: str, angles: Array) -> Array:
    """Quaternions of angles (..., 3) given in the order in which the axes are turned about: XYZ is Rz Ry Rx."""
    return rot.euler_to_quat(order[::-1], angles[..., ::-1])


def _local(bone: Bone, values: Array | None, scale: float, frames: int) -> Array:
    """(frames, 4): C M C^-1."""
    turns = [(d[1].upper(), i) for i, d in enumerate(bone.dofs) if d[0] == "r"]
    if values is None or not turns:
        return np.tile(rot.IDENTITY, (frames, 1))
    order = "".join(axis for axis, _ in turns)
    own = _turn(order, values[:, [i for _, i in turns]] * scale)
    axis = _turn(bone.axis_order, np.array(bone.axis))
    return rot.multiply(rot.multiply(axis, own), rot.inverse(axis))


def _layout(asf: Asf) -> tuple[list[str], list[int], list[int], list[int]]:
    """Joint names, parents, the bone at whose end each is (-1: where its parent is), the bone that turns it."""
    children: list[list[int]] = [[] for _ in asf.bones]
    for bone, parent in enumerate(asf.parents[1:], start=1):
        children[parent].append(bone)
    names, parents, ends, turns = ["root"], [-1], [-1], [0]
    end_joint = {0: 0}
    for b, bone in enumerate(asf.bones[1:], start=1):
        above = end_joint[asf.parents[b]]
        if bone.dofs and turns[above] != b:
            names.append(f"{bone.name} start")
            parents.append(above)
            ends.append(-1)
            turns.append(b)
            above = len(names) - 1
        names.append(bone.name)
        parents.append(above)
        ends.append(b)
        turns.append(children[b][0] if len(children[b]) == 1 else -1)
        end_joint[b] = len(names) - 1
    return names, parents, ends, turns


def load_skeleton(path: Path | str, *, unit: float | None = None) -> Skeleton:
    """The skeleton of an ASF file in metres; its rest pose is the file's."""
    asf = read_asf(path)
    return _skeleton(asf, asf.unit if unit is None else unit)


def _skeleton(asf: Asf, unit: float) -> Skeleton:
    names, parents, ends, _ = _layout(asf)
    if len(set(names)) != len(names):
        raise MotionloomError("a bone of the ASF file is called like the start of another; rename it")
    offsets = np.array([asf.bones[b].end if b > 0 else (0.0, 0.0, 0.0) for b in ends]) * unit
    return Skeleton(tuple(names), tuple(parents), offsets)


def _assemble(asf: Asf, values: dict[str, Array], degrees: bool, fps: float, unit: float) -> Motion:
    skeleton, turns = _skeleton(asf, unit), _layout(asf)[3]
    frames = len(next(iter(values.values())))
    text.check_poses(frames, len(turns), "the motion", numbers=sum(v.size for v in values.values()))
    scale = np.pi / 180 if degrees else 1.0
    rotations = np.tile(rot.IDENTITY, (frames, len(turns), 1))
    for j, b in enumerate(turns):
        if b >= 0:
            rotations[:, j] = _local(asf.bones[b], values.get(asf.bones[b].name), scale, frames)
    bone = asf.bones[0]
    root = np.tile(np.array(bone.end), (frames, 1))
    channels = values.get("root")
    for i, dof in enumerate(bone.dofs):
        if dof[0] == "t" and channels is not None:
            root[:, "xyz".index(dof[1])] += channels[:, i]
    return Motion(skeleton, fps, root * unit, rotations)


def find_asf(amc: Path | str) -> Path:
    """The skeleton beside an AMC file: of the same name, of the subject (``39_01.amc``: ``39.asf``) or the only one."""
    amc = Path(amc)
    stems = (amc.stem, re.split(r"[_-]", amc.stem)[0])
    there = finished(amc.parent, "*") if amc.parent.is_dir() else []
    beside = [path for path in there if path.suffix.lower() == ".asf"]
    for stem in stems:
        for path in beside:
            if path.stem == stem:
                return path
    if len(beside) == 1:
        return beside[0]
    names = ", ".join(p.name for p in beside[:5]) or "none"
    raise MotionloomError(f"no ASF skeleton for {amc} beside it (there: {names}); name it with --asf")
