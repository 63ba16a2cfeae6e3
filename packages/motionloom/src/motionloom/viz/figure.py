"""What a drawing must know of a motion beyond its joints: sides, facing, feet on the floor, and body parts.

Everything is found from names and geometry, so that any skeleton can be drawn; metres, +Y up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
CONTACT_HEIGHT = 0.075  # of a body's height: a joint this low and slow is on the floor
CONTACT_SPEED = 0.25  # body heights per second


@dataclass(frozen=True)
class Figure:
    """A motion ready to be drawn."""

    fps: float
    places: Array
    """(frames, joints, 3) metres."""
    forward: Array
    """(frames, 3): the horizontal direction the trunk faces."""
    gaze: Array
    """(frames, 3): the direction the head faces."""
    contacts: NDArray[np.bool_]
    """(frames, joints): low and slow."""
    sides: tuple[int, ...]
    """+1 left, -1 right, 0 middle, by joint."""
    bones: tuple[tuple[int, int], ...]
    """(parent, child) of the bones that belong to the body."""
    radii: Array
    """(bones, 2) metres at both ends."""
    chest: tuple[int, ...]
    """Joints that span the chest; empty where no shoulders were found."""
    hips: tuple[int, ...]
    """Joints that span the pelvis; empty where no hips were found."""
    trunk: frozenset[int]
    """Joints between the pelvis and the limbs, where chest and pelvis are drawn as bodies."""
    head: tuple[int, int] | None
    """(joint below the head, joint of the head)."""
    head_is_tip: bool
    """The head's joint is the crown rather than the base of the skull."""
    centre: int
    """The pelvis, or what takes its place."""
    height: float
    """Metres from floor to crown."""
    floor: float
    """Its height in metres: 0 where the motion plausibly stands on that, else about that of its lowest joints."""

    def __len__(self) -> int:
        return len(self.places)

    @property
    def path(self) -> Array:
        """(frames, 3): the pelvis dropped onto the floor."""
        path = self.places[:, self.centre].copy()
        path[:, 1] = self.floor
        return path

    @property
    def seconds(self) -> float:
        """Length in seconds."""
        return len(self) / self.fps

    def heading(self) -> Array:
        """(frames,) radians turned since the start, counter-clockwise seen from above is positive (to the left)."""
        angle = np.unwrap(np.arctan2(self.forward[:, 0], self.forward[:, 2]))
        return angle - angle[0]


def figure(motion: Motion) -> Figure:
    """Study a motion for drawing."""
    skeleton = motion.skeleton
    places = motion.positions()
    height = body_height(skeleton, places)
    centre = body_start(skeleton, places)
    body = skeleton.below(centre)
    sides = joint_sides(skeleton)
    head = _head(skeleton, places, body, sides)
    # Eyes and jaw would litter the ball that is the head.
    face = () if head is None else head if head[1] in skeleton.ends else head[1:]
    hidden = {below for j in face for below in skeleton.below(j)} - set(face)
    bones = tuple((skeleton.parents[j], j) for j in body if j != centre and j not in hidden)
    limbs = _limbs(skeleton, places, bones, sides)
    lowest = float(np.percentile(places[:, body, 1].min(axis=1), 5))
    floor = 0.0 if -0.06 * height < lowest < 0.12 * height else lowest
    forward = _forward(places, limbs, sides)
    arms = tuple(start for start, _, arm in limbs if arm)
    legs = tuple(start for start, _, arm in limbs if not arm)
    whole = len(arms) >= 2 and len(legs) >= 2
    trunk = frozenset(j for limb in (*arms, *legs) for j in skeleton.ancestors(limb)) if whole else frozenset()
    return Figure(
        motion.fps,
        places,
        forward,
        _gaze(motion, forward, head),
        _contacts(places, floor, height, motion.fps),
        sides,
        bones,
        _radii(skeleton, places, bones, limbs, height),
        _chest(skeleton, arms, centre),
        (*legs, centre) if len(legs) >= 2 else (),
        trunk,
        head,
        head is not None and _is_crown(skeleton, places, head[1], arms, height),
        centre,
        height,
        floor,
    )


def joint_sides(skeleton: Skeleton) -> tuple[int, ...]:
    """+1 for joints of the left side, -1 for the right, 0 for the middle: by names in pairs, else by the rest pose."""
    pairs = skeleton.mirror_pairs()
    if any(pair != j for j, pair in enumerate(pairs)):
        named = [_side_of_name(skeleton.names[j], skeleton.names[pair]) for j, pair in enumerate(pairs)]
        for j, parent in enumerate(skeleton.parents):
            if not named[j] and parent >= 0 and (j in skeleton.ends or named[parent]):
                named[j] = named[parent]
        return tuple(named)
    x = skeleton.rest_positions()[:, 0] - skeleton.offsets[0, 0]
    margin = 0.02 * max(float(np.ptp(x)), 1e-9)
    return tuple(int(np.sign(v)) if abs(v) > margin else 0 for v in x)


def _side_of_name(name: str, other: str) -> int:
    first = next((a.lower() for a, b in zip(name, other) if a != b), "")
    return {"l": 1, "r": -1}.get(first, 0)


def _lengths(skeleton: Skeleton, places: Array) -> Array:
    """(joints,) the usual length of each joint's bone."""
    parents = [max(p, 0) for p in skeleton.parents]
    return np.median(np.linalg.norm(places - places[:, parents], axis=-1), axis=0)


def body_height(skeleton: Skeleton, places: Array) -> float:
    """Metres a body stands tall: of its upright poses, or judged by its bones where it never stands."""
    first = body_start(skeleton, places)
    lengths = _lengths(skeleton, places)
    down = np.zeros(len(skeleton))  # longest way from a joint down to a tip
    widest = 0.0
    for j in range(len(skeleton) - 1, first, -1):
        p, reach = skeleton.parents[j], down[j] + lengths[j]
        widest = max(widest, down[p] + reach)
        down[p] = max(down[p], reach)
    return max(_tall(places[:, first:]), 0.65 * widest) or 1.0


def _tall(places: Array) -> float:
    """Metres from lowest to highest joint in upright poses."""
    return float(np.percentile(np.ptp(places[..., 1], axis=1), 90))


def body_start(skeleton: Skeleton, places: Array) -> int:
    """The joint where the body begins: a lone reference joint before it (at the world's origin) is no part of it.

    All joints from this one on hang on it, since each of those before has one child only.
    """
    joint, height = 0, _tall(places)
    while len(children := skeleton.children(joint)) == 1:
        length = np.linalg.norm(places[:, children[0]] - places[:, joint], axis=-1)
        if length.max() < 0.3 * height and np.ptp(length) < 0.03 * height and length.max() > 1e-6:
            break
        joint = children[0]
    return joint if skeleton.children(joint) else 0


def _limbs(
    skeleton: Skeleton, places: Array, bones: tuple[tuple[int, int], ...], sides: tuple[int, ...]
) -> list[tuple[int, int, bool]]:
    """Arms and legs as (shoulder or hip, elbow or knee, is an arm): each begins with its two longest bones in a row.

    Arms leave the trunk after more bones than legs do, whatever somebody does. Where that does not part two from two,
    those that do not reach down, most of the time, are arms.
    """
    lengths = _lengths(skeleton, places)
    height = np.median(places[..., 1], axis=0)
    depth = [0] * len(skeleton)
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        depth[joint] = depth[parent] + 1
    limbs: list[tuple[int, int, int, bool]] = []
    for start in (c for p, c in bones if sides[c] != 0 and sides[p] == 0):
        inside = skeleton.below(start)
        pairs = [(skeleton.parents[j], j) for j in inside[1:] if skeleton.children(j)]
        if not pairs:
            continue
        best = max(pairs, key=lambda pair: lengths[pair[1]] + max(lengths[c] for c in skeleton.children(pair[1])))
        tip = max(inside, key=depth.__getitem__)
        drop = height[start] - height[tip]
        limbs.append((*best, depth[start], bool(drop < 0.35 * np.ptp(height))))
    first = min((leaves for _, _, leaves, _ in limbs), default=0)
    early = sum(leaves == first for _, _, leaves, _ in limbs)
    by_tree = 2 <= early <= len(limbs) - 2
    return [(start, joint, leaves > first if by_tree else high) for start, joint, leaves, high in limbs]


def _chest(skeleton: Skeleton, arms: tuple[int, ...], centre: int) -> tuple[int, ...]:
    """Shoulders and the joint where their lines meet."""
    if len(arms) < 2:
        return ()
    others = [set(skeleton.ancestors(arm)) for arm in arms[1:]]
    shared = [j for j in skeleton.ancestors(arms[0]) if all(j in other for other in others)]
    return (*arms, shared[0]) if shared and shared[0] != centre else arms


def _forward(places: Array, limbs: list[tuple[int, int, bool]], sides: tuple[int, ...]) -> Array:
    """(frames, 3) horizontal facing: across the hips and shoulders, then a quarter turn."""
    across = np.zeros((len(places), 3))
    for joint, _, _ in limbs:
        across += sides[joint] * places[:, joint]
    counts = [sum(sides[j] == s for j, _, _ in limbs) for s in (1, -1)]
    forward = np.cross(across, UP)
    length = np.linalg.norm(forward, axis=-1, keepdims=True)
    if counts[0] != counts[1] or length.max() < 1e-6:
        return np.tile([0.0, 0.0, 1.0], (len(places), 1))
    return _hold(forward / np.maximum(length, 1e-9), length[:, 0] > 0.1 * np.median(length))


def _hold(values: Array, good: NDArray[np.bool_]) -> Array:
    """Values with the bad rows replaced by the good row before (or the first good one)."""
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), -1))
    return values[np.where(last < 0, int(np.argmax(good)), last)]


def _head(skeleton: Skeleton, places: Array, body: list[int], sides: tuple[int, ...]) -> tuple[int, int] | None:
    named = [j for j in body[1:] if "head" in skeleton.names[j].lower()]
    tips = [j for j in body[1:] if not skeleton.children(j) and sides[j] == 0]
    if named:
        joint = named[0]
        below = [c for c in skeleton.children(joint) if c in skeleton.ends or "head" in skeleton.names[c].lower()]
        joint = below[0] if below else joint
        return skeleton.parents[joint], joint
    if not tips:
        return None
    highest = max(tips, key=lambda j: float(np.median(places[:, j, 1])))
    return skeleton.parents[highest], highest


def _is_crown(skeleton: Skeleton, places: Array, head: int, arms: tuple[int, ...], height: float) -> bool:
    """Whether the last joint of the head is its top and not the base of the skull: a head rises high over shoulders."""
    if not arms:
        return head in skeleton.ends
    rise = places[:, head] - places[:, list(arms)].mean(axis=1)
    return bool(np.median(np.linalg.norm(rise, axis=-1)) > 0.14 * height)


def _gaze(motion: Motion, forward: Array, head: tuple[int, int] | None) -> Array:
    """(frames, 3): the head's front: that direction in its own frame which agrees best with the trunk's front."""
    if head is None:
        return forward
    joint = head[0] if head[1] in motion.skeleton.ends else head[1]
    world = motion.world_rotations()[:, joint]
    front = rot.rotate(rot.inverse(world), forward).mean(axis=0)
    if np.linalg.norm(front) < 0.5:
        return forward
    return rot.rotate(world, np.broadcast_to(front / np.linalg.norm(front), forward.shape))


def _contacts(places: Array, floor: float, height: float, fps: float) -> NDArray[np.bool_]:
    if len(places) > 1:
        step = np.linalg.norm(np.diff(places, axis=0), axis=-1) * fps
        speed = np.minimum(np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]]))
    else:
        speed = np.zeros(places.shape[:2])
    return (places[..., 1] < floor + CONTACT_HEIGHT * height) & (speed < CONTACT_SPEED * height)


def _radii(
    skeleton: Skeleton,
    places: Array,
    bones: tuple[tuple[int, int], ...],
    limbs: list[tuple[int, int, bool]],
    height: float,
) -> Array:
    """(bones, 2): thick thighs, thinner further out, never thicker than a bone's length allows."""
    lengths = _lengths(skeleton, places)
    starts = {joint: (0.030 if arm else 0.046) for joint, _, arm in limbs}
    widths: list[tuple[float, int] | None] = [None] * len(skeleton)
    """Of a joint's bone: that at the start of its limb, and how many bones further out it is."""
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        above = widths[parent]
        widths[joint] = (starts[parent], 0) if parent in starts else above and (above[0], above[1] + 1)
    radii = np.empty((len(bones), 2))
    for i, (_, child) in enumerate(bones):
        first, out = widths[child] or (0.026, 0)
        widest = first * 0.76**out
        thick = np.clip(0.23 * lengths[child], 0.009 * height, widest * height)
        radii[i] = thick, 0.74 * thick
    return radii
