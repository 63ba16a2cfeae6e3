"""Where the 22 SMPL joints lie on somebody else's skeleton.

A `JointMap` is data: for each SMPL joint the weights of source joints whose places are averaged, so that "20 % of
the way from chest to neck" is ``{"chest": 0.8, "neck": 0.2}``. Three families (CMU's ASF, its Daz-friendly BVH,
Bandai Namco's BVH) have tables; everything else is found by names (`names`), and where those say nothing by the
shape of the tree (`topology`). A user may override any joint.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_json
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget.names import Parts, parts_by_name, read_word
from motionloom.retarget.topology import common_ancestor, is_above, parts_by_shape, path_down

Array = NDArray[np.float64]
Override = Mapping[str, str | Mapping[str, float]] | Path | str
"""SMPL joint name to a joint name or to weights of joint names; or the path of a JSON file with that."""


@dataclass(frozen=True)
class JointMap:
    """Weights of a skeleton's joints for each of the 22 SMPL joints."""

    points: tuple[tuple[tuple[str, float], ...], ...]
    """Per SMPL joint (joint name, weight); the weights add up to 1."""

    def matrix(self, skeleton: Skeleton) -> Array:
        """(22, joints): SMPL positions = matrix @ joint positions."""
        result = np.zeros((len(SMPL22), len(skeleton)))
        for row, point in zip(result, self.points):
            for name, weight in point:
                row[skeleton.index(name)] += weight
        return result

    def drivers(self, skeleton: Skeleton) -> tuple[int | None, ...]:
        """Per SMPL joint the joint whose rotation turns what hangs on it; None where nothing on the skeleton does.

        A point on the line between two joints is turned by the parent of the lower one.
        """
        return tuple(_driver(skeleton, [skeleton.index(name) for name, w in point if w]) for point in self.points)

    def names(self) -> dict[str, dict[str, float]]:
        """The map as plain data, ready for JSON and for `joint_map`'s ``override``."""
        return {name: dict(point) for name, point in zip(SMPL22.names, self.points)}


def _driver(skeleton: Skeleton, joints: list[int]) -> int | None:
    if len(joints) == 1:
        return None if joints[0] in skeleton.ends else joints[0]
    lowest = max(joints)
    others = [j for j in joints if j != lowest]
    if all(is_above(skeleton, j, lowest) for j in others):
        return skeleton.parents[lowest]
    return None


def joint_map(skeleton: Skeleton, override: Override | None = None) -> JointMap:
    """Find the 22 SMPL joints on a humanoid skeleton.

    ``override`` replaces single joints or all of them. Raises `MotionloomError` naming the joints that could not
    be found or that the override names wrongly.
    """
    stated = skeleton.humanoid.items()
    named = {part: {joint: 1.0} for part, joint in stated if joint in skeleton.names}
    overrides = named | _read_override(skeleton, override)
    points = overrides
    if not overrides.keys() >= set(SMPL22.names):
        points = (_family(skeleton) or _humanoid(skeleton, overrides)) | overrides
    if overrides:
        _check_apart(points)
    return JointMap(tuple(tuple(points[name].items()) for name in SMPL22.names))


# Families ------------------------------------------------------------------------------------------------------------

# "{s}" is the side. A pair with a number is a point that far along the line
# from the first to the second; "~" is a space.
_ASF = """pelvis root | hip {s}hipjoint | spine1 lowerback | knee {s}femur | spine2 upperback | ankle {s}tibia
| spine3 upperback thorax 0.5 | foot {s}foot | neck lowerneck | collar thorax {s}clavicle 0.4 | head upperneck
| shoulder {s}clavicle | elbow {s}humerus | wrist {s}radius {s}wrist 0.5"""
_DAZ = """pelvis hip abdomen 0.5 | hip {s}Thigh | spine1 abdomen | knee {s}Shin | spine2 chest | ankle {s}Foot
| spine3 chest neck 0.2 | foot {s}Foot~End~Site | neck neck | collar {s}Collar {s}Shldr 0.4 | head head
| shoulder {s}Shldr | elbow {s}ForeArm | wrist {s}Hand"""
_BANDAI = """pelvis Hips Spine 0.25 | hip UpperLeg_{s} | spine1 Spine | knee LowerLeg_{s} | spine2 Chest
| ankle Foot_{s} | spine3 Chest Neck 0.2 | foot Toes_{s} | neck Neck | collar Shoulder_{s} | head Head
| shoulder UpperArm_{s} | elbow LowerArm_{s} | wrist Hand_{s}"""
_FAMILIES = ((_ASF, "l", "r"), (_DAZ, "l", "r"), (_BANDAI, "L", "R"))
_MIDDLE = ("pelvis", "spine1", "spine2", "spine3", "neck", "head")


def _family(skeleton: Skeleton) -> dict[str, dict[str, float]] | None:
    """The table whose joints the skeleton has, or None."""
    for table, left, right in _FAMILIES:
        points: dict[str, dict[str, float]] = {}
        for entry in table.split("|"):
            part, *joints = entry.split()
            sides = [("", "")] if part in _MIDDLE else [("left_", left), ("right_", right)]
            for prefix, side in sides:
                points[prefix + part] = _point([j.format(s=side).replace("~", " ") for j in joints])
        if all(name in skeleton.names for point in points.values() for name in point):
            return points
    return None


def _point(words: list[str]) -> dict[str, float]:
    if len(words) == 1:
        return {words[0]: 1.0}
    first, second, amount = words
    return {first: 1.0 - float(amount), second: float(amount)}


# Everybody else ------------------------------------------------------------------------------------------------------

_LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
_NEEDED = tuple(f"{side}_{part}" for part in _LIMBS for side in ("left", "right"))


def _humanoid(skeleton: Skeleton, overrides: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """The 22 points by names, else by the shape of the tree."""
    hints: Parts = {part: skeleton.index(next(iter(point))) for part, point in overrides.items() if len(point) == 1}
    named = parts_by_name(skeleton) | hints
    missing = _missing(skeleton, named)
    parts = (parts_by_shape(skeleton) or {}) | hints if missing else named
    if missing and _missing(skeleton, parts):
        raise MotionloomError(
            f"the skeleton is not a humanoid that can be read: no joint was found for {', '.join(missing)} among "
            f"{_joint_list(skeleton)}; name the missing ones in a joint map (SMPL joint: joint of the file)"
        )
    return _points(skeleton, parts)


def _joint_list(skeleton: Skeleton) -> str:
    names = [n for j, n in enumerate(skeleton.names) if j not in skeleton.ends]
    return ", ".join(names[:30]) + (f" and {len(names) - 30} more" if len(names) > 30 else "")


def _missing(skeleton: Skeleton, parts: Parts) -> list[str]:
    """Needed parts that are absent, doubled or not in one line down a limb."""
    lost = [part for part in _NEEDED if part not in parts and not _palm(skeleton, parts, part)]
    for side in ("left", "right"):
        for limb in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
            for upper, lower in pairwise(limb):
                a, b = parts.get(f"{side}_{upper}"), parts.get(f"{side}_{lower}")
                if a is not None and b is not None and not is_above(skeleton, a, b):
                    lost.append(f"{side}_{lower}")
    return lost


def _points(skeleton: Skeleton, parts: Parts) -> dict[str, dict[str, float]]:
    name = skeleton.names
    points = {part: {name[parts[part]]: 1.0} for part in _NEEDED if part in parts}
    for part in (part for part in _NEEDED if part not in parts):  # no joint is the hand: the middle of its bones
        palm = _palm(skeleton, parts, part)
        points[part] = {name[j]: 1.0 / len(palm) for j in palm}
    pelvis, chest, spine, neck, head = _trunk(skeleton, parts)
    points["pelvis"] = {name[pelvis]: 1.0}
    points |= _spine_points(skeleton, pelvis, spine, neck)
    points["neck"] = {name[neck]: 1.0} if neck != head else {name[chest]: 0.5, name[head]: 0.5}
    points["head"] = {name[head]: 1.0}
    for side in ("left", "right"):
        points[f"{side}_foot"] = {name[_toe(skeleton, parts, side)]: 1.0}
        points[f"{side}_collar"] = _collar_point(skeleton, parts, side, neck=neck, chest=chest)
    return points


def _trunk(skeleton: Skeleton, parts: Parts) -> tuple[int, int, list[int], int, int]:
    """Pelvis, chest (where the arms branch off), the spine's joints above the pelvis up to the chest, neck, head."""
    legs = [parts["left_hip"], parts["right_hip"]]
    arms = [parts.get(f"{s}_collar", parts[f"{s}_shoulder"]) for s in ("left", "right")]
    chest = common_ancestor(skeleton, arms)
    top = common_ancestor(skeleton, [*legs, *arms])
    pelvis = parts.get("pelvis", top)
    if not all(is_above(skeleton, pelvis, j) for j in [*legs, *arms]):
        pelvis = top
    head = parts.get("head", parts.get("neck", chest))
    if not is_above(skeleton, chest, head) or head == chest:
        head = _spine_top(skeleton, chest)
    if head == chest and "DEF-spine" in skeleton.names:
        raise MotionloomError(
            "the skeleton is a generated Rigify rig in pieces: its limbs do not hang on DEF-spine; move it with "
            "the extension for Blender, which knows its controls (docs/blender.md)"
        )
    if head == chest:
        raise MotionloomError(
            f"the skeleton is not a humanoid that can be read: no head above {skeleton.names[chest]}, where the arms "
            "begin; name it in a joint map as 'head'"
        )
    neck = parts.get("neck", -1)
    if neck < 0 or not is_above(skeleton, chest, neck) or not is_above(skeleton, neck, head):
        neck = path_down(skeleton, chest, head)[1]
    return pelvis, chest, path_down(skeleton, pelvis, chest)[1:], neck, head


def _spine_top(skeleton: Skeleton, chest: int) -> int:
    """The last joint above the chest that is called as it is, such as ``DEF-spine.006`` over ``DEF-spine.003``."""
    word, top = read_word(skeleton.names[chest]), chest
    while on := [j for j in skeleton.children(top) if word and read_word(skeleton.names[j]) == word]:
        top = on[0]
    return top


def _palm(skeleton: Skeleton, parts: Parts, part: str) -> tuple[int, ...]:
    """What hangs on the forearm where no joint is the hand."""
    side, _, kind = part.partition("_")
    elbow = parts.get(f"{side}_elbow")
    return skeleton.children(elbow) if kind == "wrist" and elbow is not None else ()


def _spine_points(skeleton: Skeleton, pelvis: int, spine: list[int], neck: int) -> dict[str, dict[str, float]]:
    """spine1 to spine3 from as many joints as there are; missing ones lie on the line to the neck."""
    name = skeleton.names
    apart = [j for j in spine if np.linalg.norm(skeleton.offsets[j]) > 1e-4]
    if len(apart) >= 3:
        chosen = [apart[0], apart[len(apart) // 2], apart[-1]]
        return {f"spine{i}": {name[j]: 1.0} for i, j in enumerate(chosen, start=1)}
    if len(apart) == 2:
        low, high = name[apart[0]], name[apart[1]]
        return {"spine1": {low: 1.0}, "spine2": {high: 1.0}, "spine3": {high: 0.8, name[neck]: 0.2}}
    amounts = (0.0, 0.34, 0.48) if apart else (0.24, 0.5, 0.62)
    base = name[apart[0] if apart else pelvis]
    return {f"spine{i}": {base: 1 - a, name[neck]: a} if a else {base: 1.0} for i, a in enumerate(amounts, start=1)}


def _toe(skeleton: Skeleton, parts: Parts, side: str) -> int:
    """The named toe, else the child of the ankle that lies farthest out, else the ankle itself: a foot without toes."""
    ankle = parts[f"{side}_ankle"]
    toe = parts.get(f"{side}_foot")
    if toe is not None and is_above(skeleton, ankle, toe):
        return toe
    return max(skeleton.children(ankle), default=ankle, key=lambda j: float(np.linalg.norm(skeleton.offsets[j])))


def _collar_point(skeleton: Skeleton, parts: Parts, side: str, *, neck: int, chest: int) -> dict[str, float]:
    """A collar joint well out to the side as it is; one at the middle line is moved 40 % towards the shoulder."""
    shoulder = parts[f"{side}_shoulder"]
    collar = parts.get(f"{side}_collar", skeleton.parents[shoulder])
    name = skeleton.names
    if collar == chest or not is_above(skeleton, chest, collar):
        return {name[neck]: 0.6, name[shoulder]: 0.4}
    rest = skeleton.rest_positions()
    across = rest[parts["left_shoulder"]] - rest[parts["right_shoulder"]]
    middle = (rest[parts["left_shoulder"]] + rest[parts["right_shoulder"]]) / 2
    half = float(across @ across) / 2
    out = abs(float((rest[collar] - middle) @ across)) / max(half, 1e-12)
    return {name[collar]: 1.0} if out > 0.3 else {name[collar]: 0.6, name[shoulder]: 0.4}


# Overrides -----------------------------------------------------------------------------------------------------------


def _read_override(skeleton: Skeleton, override: Override | None) -> dict[str, dict[str, float]]:
    if override is None:
        return {}
    data = read_json(override, "a joint map") if isinstance(override, str | Path) else override
    if not isinstance(data, Mapping):
        raise MotionloomError(f'a joint map is an object such as {{"left_knee": "Shin"}}; got {type(data).__name__}')
    return {str(part): _check_point(skeleton, str(part), value) for part, value in data.items()}


def _check_apart(points: Mapping[str, Mapping[str, float]]) -> None:
    """Refuse one joint for two parts that have a bone between them."""
    parts: dict[str, str] = {}
    for part in ("pelvis", *_NEEDED, "head"):
        if len(points[part]) == 1:
            name = next(iter(points[part]))
            if name in parts:
                raise MotionloomError(
                    f"the joint map gives both {parts[name]} and {part} as {name!r}; name another joint for one of them"
                )
            parts[name] = part


def _check_point(skeleton: Skeleton, part: str, value: object) -> dict[str, float]:
    if part not in SMPL22.names:
        raise MotionloomError(f"the joint map speaks of {part!r}; the joints are {', '.join(SMPL22.names)}")
    point = {value: 1.0} if isinstance(value, str) else value
    if not isinstance(point, Mapping) or not point:
        raise MotionloomError(f"the joint map gives {part} as {value!r}; a name or weights of names are needed")
    for name, weight in point.items():
        if name not in skeleton.names:
            raise MotionloomError(f"the joint map gives {part} as {name!r}; the joints are {_joint_list(skeleton)}")
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not abs(weight) <= 1e9:
            raise MotionloomError(
                f"the joint map gives {part} the weight {str(weight)[:40]}; numbers adding up to 1 are needed"
            )
    total = sum(float(w) for w in point.values())
    if abs(total - 1.0) > 1e-6:
        raise MotionloomError(f"the joint map's weights for {part} add up to {total:g}; they must add up to 1")
    return {str(name): float(weight) for name, weight in point.items()}
