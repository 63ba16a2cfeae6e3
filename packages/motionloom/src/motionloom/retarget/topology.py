"""Finding a body in a tree of joints by its shape: two legs go down, a spine goes up, arms branch off."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from motionloom.core.skeleton import Skeleton
from motionloom.retarget.names import Parts

Array = NDArray[np.float64]
_Pair = tuple[list[int], list[int]]
_MOST_LIMBS = 32
"""On one joint; of more the longest are looked at."""


def is_above(skeleton: Skeleton, upper: int, lower: int) -> bool:
    """Whether ``upper`` is ``lower`` or one of its ancestors."""
    return upper in skeleton.ancestors(lower)


def common_ancestor(skeleton: Skeleton, joints: list[int]) -> int:
    """The lowest joint that is above all the given ones."""
    return max(set.intersection(*(set(skeleton.ancestors(j)) for j in joints)))


def path_down(skeleton: Skeleton, upper: int, lower: int) -> list[int]:
    """Joints from ``upper`` to ``lower``, both included."""
    line = skeleton.ancestors(lower)
    return line[: line.index(upper) + 1][::-1]


def parts_by_shape(skeleton: Skeleton) -> Parts | None:
    """Body parts of a skeleton in an upright rest pose with the left side at +X (or where the toes say), else None."""
    shape = _Shape(skeleton)
    branching = [j for j in range(len(skeleton)) if len(skeleton.children(j)) >= 3]
    arms = {j: limbs for j in branching if (limbs := shape.pair(j, down=False))}
    for pelvis in branching:
        legs = shape.pair(pelvis, down=True)
        if legs is None or not arms:
            continue
        inside = set(skeleton.below(pelvis)).difference(skeleton.below(*(leg[0] for leg in legs)))
        for chest in sorted(inside & arms.keys()):
            if not set(arms[chest][0]) & {*legs[0], *legs[1]}:
                return _name_parts(shape, pelvis, legs, chest, arms[chest])
    return None


class _Shape:
    """A skeleton at rest, and the way down from each joint to the tip that lies farthest along the bones."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton, self.rest = skeleton, skeleton.rest_positions()
        self.next = [-1] * len(skeleton)
        """The joint below; -1 at a tip."""
        self.length: list[float] = np.linalg.norm(skeleton.offsets, axis=-1).tolist()
        """Metres from the joint above down to that tip."""
        reach = [0.0] * len(skeleton)
        for j in range(len(skeleton) - 1, 0, -1):
            parent, self.length[j] = skeleton.parents[j], self.length[j] + reach[j]
            if self.length[j] > reach[parent] or self.next[parent] < 0:
                reach[parent], self.next[parent] = self.length[j], j

    def down(self, joint: int) -> list[int]:
        """The joints of the way, the given one first."""
        line = [joint]
        while self.next[line[-1]] >= 0:
            line.append(self.next[line[-1]])
        return line

    def pair(self, joint: int, *, down: bool) -> _Pair | None:
        """Two mirror-like limbs that hang on a joint beside a third branch: legs reach far below it, arms do not."""
        rest, length, height = self.rest, self.length, float(np.ptp(self.rest[:, 1]))
        long = sorted((j for j in self.skeleton.children(joint) if length[j] > 0.2 * height), key=lambda j: -length[j])
        limbs = [line for j in sorted(long[:_MOST_LIMBS]) if len(line := self.down(j)) >= 3]
        best: tuple[float, _Pair] | None = None
        for pair in combinations(limbs, 2):
            lengths = [length[limb[0]] for limb in pair]
            drops = [float(rest[joint, 1] - rest[limb[-1], 1]) for limb in pair]
            apart = float(np.linalg.norm(rest[pair[0][-1]] - rest[pair[1][-1]]))
            alike = abs(lengths[0] - lengths[1]) < 0.25 * max(lengths) and abs(drops[0] - drops[1]) < 0.15 * height
            if alike and apart > 0.05 * height and (min(drops) > 0.3 * height) == down:
                best = max(best or (0.0, pair), (sum(lengths), pair), key=lambda x: x[0])
        return best[1] if best else None


def _name_parts(shape: _Shape, pelvis: int, legs: _Pair, chest: int, arms: _Pair) -> Parts | None:
    skeleton = shape.skeleton
    leg_joints = [_limb(skeleton, leg) for leg in legs]
    arm_joints = [_limb(skeleton, arm) for arm in arms]
    tops = [j for j in skeleton.children(chest) if j not in (arms[0][0], arms[1][0])]
    if None in leg_joints or None in arm_joints or not tops:
        return None
    limbs = [chain for chain in leg_joints if chain], [chain for chain in arm_joints if chain]
    parts: Parts = {"pelvis": pelvis} | _sides(shape.rest, *limbs)
    for side in ("left", "right"):
        above = skeleton.parents[parts[f"{side}_shoulder"]]
        if above != chest:
            parts[f"{side}_collar"] = above
    top = max(tops, key=lambda j: float(shape.rest[shape.down(j)[-1], 1]))
    line = [j for j in shape.down(top) if j not in skeleton.ends]
    if not line:
        return None
    return parts | {"neck": line[0], "head": line[min(1, len(line) - 1)]}


def _sides(rest: Array, legs: list[list[int]], arms: list[list[int]]) -> Parts:
    """Joints of the limbs, by their names on the left and on the right."""
    left, parts = _left(rest, legs), {}
    for chains, names in ((legs, ("hip", "knee", "ankle", "foot")), (arms, ("shoulder", "elbow", "wrist"))):
        ordered = sorted(chains, key=lambda chain: -float(rest[chain[0]] @ left))
        for side, chain in zip(("left", "right"), ordered):
            parts |= {f"{side}_{name}": joint for name, joint in zip(names, chain)}
    return parts


def _limb(skeleton: Skeleton, chain: list[int]) -> list[int] | None:
    """The joint above the two longest bones in a row, the two below it, and what follows."""
    if len(chain) < 3:
        return None
    lengths = np.linalg.norm(skeleton.offsets[chain], axis=-1)
    at = int(np.argmax(np.minimum(lengths[1:-1], lengths[2:])))
    return chain[at : at + 4]


def _left(rest: Array, legs: list[list[int]]) -> Array:
    """Unit vector to the person's left: +X, or what the toes in front of the ankles say."""
    across = rest[legs[0][0]] - rest[legs[1][0]]
    across = across * np.array([1.0, 0.0, 1.0])
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    toes = [rest[leg[3]] - rest[leg[2]] for leg in legs if len(leg) > 3]
    forward = np.sum(toes, axis=0) * np.array([1.0, 0.0, 1.0]) if toes else np.zeros(3)
    forward = forward - across * float(forward @ across)
    if np.linalg.norm(forward) < 0.02:
        forward = np.array([0.0, 0.0, 1.0])
    return np.cross([0.0, 1.0, 0.0], forward / np.linalg.norm(forward))
