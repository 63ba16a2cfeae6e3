"""Fitting: a sampled motion is bent, as little and as smoothly as it takes, until it meets a goal.

One least-squares problem over the turns of the joints and the place of the root, solved by Gauss and Newton: the
targets, feet that stay where they are, small changes, small accelerations of the changes. Neighbouring frames are
coupled by the last term alone, so each step is one block-tridiagonal system and time is linear in length.
Bones keep their lengths because only turns change.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import true_spans
from motionloom.core.body.feet import planted_feet
from motionloom.core.body.ik import LIMBS
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FEET
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.edits.stances import carried
from motionloom.goals.goal import Goal
from motionloom.kinematics import costs

Array = NDArray[np.float64]

ROUND = 30
"""Frames before and after a target that may change."""
EXACT, STANDING, SWINGING = 0.0005, 0.001, 0.02
"""Metres: how exactly targets are met, standing feet stand, and other feet go where they went."""
SLOW = 30.0
"""Frames squared: a change as large as allowed costs as much as one that accelerates by that share of it per frame²."""
STEPS = 12
_TOLERANCE = 1e-4
"""Metres: no target gets nearer by more in the last step."""

_BALLS, _HINGES = costs.by_number(costs.BALL_TURN), costs.by_number(costs.HINGE_TURN)
"""Joints that turn freely, and that bend, with the radians by which they usually may."""
_ROOT = 0.05
"""Metres that the root usually may go."""
_BEND = (0.03, 2.6)
"""Radians between which knees and elbows stay, where they were."""
_BASES = {joint: costs.beside(joint, base) for joint, base in costs.by_number(costs.BASE).items()}
"""Joint from which another's reach is measured."""
_EASY, _STRETCH, _LEAN, _WALK = 0.97, 0.99, 0.08, 0.5
"""Shares of a chain's length that are reached with ease, and at all; metres that the body leans, and goes, for more."""

_AXES = {limb.middle: np.array(limb.hinge, dtype=np.float64) for limb in LIMBS}
_COLUMNS = 3 + 3 * len(_BALLS) + len(_HINGES)
_SIZES = np.concatenate([np.full(3, _ROOT), np.repeat(list(_BALLS.values()), 3), list(_HINGES.values())])
_FEET_OF = {joint: (2 * side, 2 * side + 1) for side, leg in enumerate(costs.LEGS) for joint in leg}
"""Columns of `FEET` that a target for a joint of the leg sets free."""


def fit(motion: Motion, goal: Goal) -> Motion:
    """The motion, changed so that it meets ``goal`` to millimetres where bones allow.

    ``motion`` on the 22-joint skeleton at 20 frames per second; ``goal`` of the same length, in the same world. Feet
    that stand keep their place, or all of a stance moves where the root's path does; knees and elbows never bend
    backwards; frames further than `ROUND` from any target stay exactly as they are. What is out of reach is pointed at.
    Facing is not fitted. Raises MotionloomError for another skeleton or length.
    """
    if motion.skeleton != SMPL22 or motion.translations is not None:
        raise MotionloomError("only motions of the 22-joint SMPL person can be fitted to a goal: retarget it first")
    if len(motion) != len(goal):
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be met by a motion of {len(motion)}; crop one")
    if not goal.mask.any():
        return motion
    places = motion.positions()
    if np.abs(np.where(goal.mask, goal.positions - places, 0.0)).max() < _TOLERANCE:
        return motion
    shift = _root_shift(places, goal)
    goal = replace(goal, positions=_in_reach(places + shift[:, None], goal))
    feet = _feet(places, shift, goal, motion.fps)
    root, rotations = motion.root.copy(), motion.rotations.copy()
    for start, stop in _windows(goal):
        part = slice(start, stop)
        pose = _Pose(motion.root[part], motion.rotations[part], np.zeros((stop - start, _COLUMNS)))
        pose.change[:, :3] = shift[part] / _ROOT
        targets = [_targets(goal, part), feet.crop(part)]
        change = _solved(pose, targets, _stiffness(stop - start, start > 0, stop < len(motion)))
        root[part], rotations[part] = replace(pose, change=change).posed()
    return replace(motion, root=root, rotations=rotations)


# Targets


@dataclass(frozen=True, eq=False)
class _Targets:
    """Places of some joints, each with a weight."""

    joints: tuple[int, ...]
    places: Array
    """(frames, joints, 3) metres."""
    weights: Array
    """(frames, joints, 3) 1 / standard deviation; 0 where there is no target."""

    def crop(self, part: slice) -> "_Targets":
        return _Targets(self.joints, self.places[part], self.weights[part])


def _targets(goal: Goal, part: slice) -> _Targets:
    joints = np.flatnonzero(goal.mask[part].any(axis=(0, 2)))
    mask = goal.mask[part][:, joints]
    return _Targets(tuple(joints.tolist()), np.where(mask, goal.positions[part][:, joints], 0.0), mask / EXACT)


def _windows(goal: Goal) -> Iterator[tuple[int, int]]:
    """Stretches of frames around targets."""
    busy = goal.mask.any(axis=(1, 2)).astype(float)
    yield from true_spans(np.convolve(busy, np.ones(2 * ROUND + 1))[ROUND:-ROUND] > 0.5)


def _in_reach(places: Array, goal: Goal) -> Array:
    """(frames, 22, 3) the targets, those out of reach brought as near to the body as it can follow them."""
    result = goal.positions.copy()
    for joint, base, length in _chains():
        base_mask = goal.mask[:, base].any(axis=-1, keepdims=True)
        centre = np.where(goal.mask[:, base], goal.positions[:, base], places[:, base])
        line = np.where(goal.mask[:, joint], goal.positions[:, joint] - centre, 0.0)
        longest = _STRETCH * length + np.where(base_mask, 0.0, _LEAN)
        share = np.minimum(1.0, longest / np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-9))
        far = (share < 1) & goal.mask[:, joint]
        result[:, joint] = np.where(far, centre + line * share, result[:, joint])
    return result


def _chains() -> Iterator[tuple[int, int, float]]:
    """Joint, joint that its reach is measured from, and metres of bones between."""
    lengths = SMPL22.bone_lengths()
    for joint, base in _BASES.items():
        at, length = joint, 0.0
        while at != base:
            length, at = length + lengths[at], SMPL22.parents[at]
        yield joint, base, length


def _root_shift(places: Array, goal: Goal) -> Array:
    """(frames, 3) metres, horizontal, smooth: what the whole body goes to be where its path, or a far target, is."""
    need, weight = np.zeros((len(places), 3)), np.zeros((len(places), 3))
    for joint, base, length in _chains():
        line = np.where(goal.mask[:, joint], goal.positions[:, joint] - places[:, base], 0.0)
        distance = np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-9)
        beyond = line * (1 - _EASY * length / distance).clip(0) * [1, 0, 1]
        beyond *= np.minimum(1, _WALK / np.linalg.norm(beyond, axis=-1, keepdims=True).clip(1e-9))
        far = np.linalg.norm(beyond, axis=-1, keepdims=True) > np.linalg.norm(need, axis=-1, keepdims=True)
        need, weight = np.where(far, beyond, need), np.where(far, 1 / 0.02, weight)
    own = goal.mask[:, 0] * np.array([True, False, True])
    need = np.where(own, goal.positions[:, 0] - places[:, 0], np.where(own.any(-1, keepdims=True), 0.0, need))
    weight = np.where(own, 1 / EXACT, np.where(own.any(-1, keepdims=True), 0.0, weight)) * _LARGE
    if not need.any():
        return need
    shift = np.zeros_like(need)
    for start, stop in _windows(goal):
        part = slice(start, stop)
        bands = _stiffness(stop - start, start > 0, stop < len(places))
        for c in (0, 2):
            square = weight[part, c] ** 2
            shift[part, c] = _banded(square[:, None, None], (square * need[part, c])[:, None], bands)[:, 0]
    return shift


_LARGE = 0.5
"""Metres that the whole body usually may go, feet and all."""


def _feet(places: Array, shift: Array, goal: Goal, fps: float) -> _Targets:
    """Where the feet go when the body goes by ``shift``: through every stance by the mean of it."""
    planted = planted_feet(places, fps)
    targets = places[:, list(FEET)].copy()
    weights = np.where(planted, 1 / STANDING, 1 / SWINGING)
    for side in (slice(0, 2), slice(2, 4)):
        targets[:, side] += carried(shift, planted[:, side].max(axis=1))[:, None]
    near = np.ones(13)
    for joint, columns in _FEET_OF.items():
        free = np.convolve(goal.mask[:, joint].any(axis=-1), near)[6:-6] > 0.5
        for column in columns:
            weights[:, column] = np.where(free, 1e-3 / SWINGING, weights[:, column])
    return _Targets(FEET, targets, np.repeat(weights[..., None], 3, axis=-1))


# The pose and its derivatives


@dataclass(frozen=True, eq=False)
class _Pose:
    root: Array
    rotations: Array
    """As sampled."""
    change: Array
    """(frames, columns), in units of `_SIZES`: root, turns of `_BALLS` in the parent's frame, bends of `_HINGES`."""

    def _turns(self) -> tuple[Array, Array]:
        amounts = self.change * _SIZES
        balls = amounts[:, 3 : 3 + 3 * len(_BALLS)].reshape(len(amounts), -1, 3)
        return balls, amounts[:, 3 + 3 * len(_BALLS) :]

    def posed(self) -> tuple[Array, Array]:
        """Root (frames, 3) and rotations (frames, 22, 4) with the change."""
        balls, bends = self._turns()
        rotations = self.rotations.copy()
        joints = list(_BALLS)
        rotations[:, joints] = rot.multiply(rot.rotvec_to_quat(balls), rotations[:, joints])
        hinges = np.stack([bends[:, i, None] * _AXES[joint] for i, joint in enumerate(_HINGES)], axis=1)
        rotations[:, list(_HINGES)] = rot.multiply(rotations[:, list(_HINGES)], rot.rotvec_to_quat(hinges))
        return self.root + self.change[:, :3] * _ROOT, rotations

    def places_and_world(self) -> tuple[Array, Array]:
        """Places (frames, 22, 3) and world matrices (frames, 22, 3, 3)."""
        root, rotations = self.posed()
        local = rot.quat_to_matrix(rotations)
        world, places = np.empty_like(local), np.empty((len(root), len(SMPL22), 3))
        world[:, 0], places[:, 0] = local[:, 0], root
        for j, p in enumerate(SMPL22.parents[1:], start=1):
            world[:, j] = world[:, p] @ local[:, j]
            places[:, j] = places[:, p] + world[:, p] @ SMPL22.offsets[j]
        return places, world

    def axes(self, world: Array) -> Array:
        """(frames, columns - 3, 3): world turn of what hangs on the joint, per unit of each column after the root."""
        balls, _ = self._turns()
        parents = [SMPL22.parents[joint] for joint in _BALLS]
        frames = world[:, parents].copy()
        frames[:, 0] = np.eye(3)  # the pelvis turns in the world
        turned = frames @ _left_jacobian(balls)
        hinges = np.stack([world[:, joint] @ _AXES[joint] for joint in _HINGES], axis=1)
        both = np.concatenate([turned.swapaxes(-1, -2).reshape(len(world), -1, 3), hinges], axis=1)
        return both * _SIZES[3:, None]

    def jacobian(self, joints: tuple[int, ...], places: Array, axes: Array) -> Array:
        """(frames, joints, 3, columns) metres per unit of change."""
        result = np.zeros((len(places), len(joints), 3, _COLUMNS))
        result[..., :3] = _ROOT * np.eye(3)
        for i, joint in enumerate(joints):
            for columns, pivot in _MOVED_BY[joint]:
                arm = (places[:, joint] - places[:, pivot])[:, None]
                result[:, i, :, columns] = np.cross(axes[:, columns.start - 3 : columns.stop - 3], arm).swapaxes(-1, -2)
        return result


def _moved_by() -> dict[int, list[tuple[slice, int]]]:
    """For each joint the columns whose turns move it, and the joints that they turn about."""
    columns = {joint: slice(3 + 3 * i, 6 + 3 * i) for i, joint in enumerate(_BALLS)}
    start = 3 + 3 * len(_BALLS)
    columns |= {joint: slice(start + i, start + i + 1) for i, joint in enumerate(_HINGES)}
    result: dict[int, list[tuple[slice, int]]] = {0: []}
    for joint, parent in enumerate(SMPL22.parents[1:], start=1):
        result[joint] = result[parent] + ([(columns[parent], parent)] if parent in columns else [])
    return result


_MOVED_BY = _moved_by()


def _left_jacobian(v: Array) -> Array:
    """(..., 3, 3): world turn per change of a rotation vector (Sola et al. 2018, eq. 145)."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    small = angle < 1e-4
    a = np.where(small, 1.0, angle)
    cross = np.zeros((*v.shape, 3))
    cross[..., 2, 1], cross[..., 0, 2], cross[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    cross -= cross.swapaxes(-1, -2)
    first = np.where(small, 0.5, (1 - np.cos(a)) / a**2)
    second = np.where(small, 1 / 6, (a - np.sin(a)) / a**3)
    return np.eye(3) + first * cross + second * cross @ cross


def _bends(places: Array, world: Array) -> Array:
    """(frames, hinges) radians by which knees and elbows are bent."""
    result = []
    for joint in _HINGES:
        limb = next(limb for limb in LIMBS if limb.middle == joint)
        upper, lower = places[:, joint] - places[:, limb.start], places[:, limb.end] - places[:, joint]
        axis = world[:, joint] @ _AXES[joint]
        result.append(np.arctan2((axis * np.cross(upper, lower)).sum(-1), (upper * lower).sum(-1)))
    return np.stack(result, axis=-1)


# Gauss and Newton


def _solved(pose: _Pose, targets: list[_Targets], bands: Array) -> Array:
    """(frames, columns) the change that meets the targets best."""
    sampled = replace(pose, change=np.zeros_like(pose.change))
    bent = _bends(*sampled.places_and_world())
    low, high = ((limit(bent, b) - bent) / list(_HINGES.values()) for limit, b in zip((np.minimum, np.maximum), _BEND))
    damping, best, cost = 1e-3, pose.change, np.inf
    last = np.inf
    for _ in range(STEPS):
        places, world = pose.places_and_world()
        now, off = _cost(pose, places, targets, bands)
        if now > cost:
            damping *= 10
            pose = replace(pose, change=(pose.change + best) / 2)
            if damping > 1e3:
                break
            continue
        settled = cost - now < 1e-3 * now and abs(last - off) < _TOLERANCE
        best, cost, last, damping = pose.change, now, off, damping / 3
        if settled:
            break
        axes = pose.axes(world)
        blocks, slope = np.zeros((len(places), _COLUMNS, _COLUMNS)), np.zeros_like(pose.change)
        for target in targets:
            jacobian = pose.jacobian(target.joints, places, axes) * target.weights[..., None]
            jacobian = jacobian.reshape(len(places), -1, _COLUMNS)
            error = (target.weights * (target.places - places[:, list(target.joints)])).reshape(len(places), -1, 1)
            blocks += jacobian.swapaxes(-1, -2) @ jacobian
            slope += (jacobian.swapaxes(-1, -2) @ (error + jacobian @ pose.change[..., None]))[..., 0]
        blocks[:, range(_COLUMNS), range(_COLUMNS)] += damping
        change = _banded(blocks, slope + damping * pose.change, bands)
        step = change - pose.change
        step *= np.minimum(1.0, 1.5 / np.abs(step).max(axis=1, keepdims=True).max().clip(1e-9))
        change = pose.change + step
        change[:, -len(_HINGES) :] = change[:, -len(_HINGES) :].clip(low, high)
        pose = replace(pose, change=change)
    return best


def _cost(pose: _Pose, places: Array, targets: list[_Targets], bands: Array) -> tuple[float, float]:
    """What is minimised, and metres that the targets are off on average."""
    total = float((pose.change * (pose.change + _stiff(bands, pose.change))).sum())
    for target in targets:
        total += float(((target.weights * (target.places - places[:, list(target.joints)])) ** 2).sum())
    first = targets[0]
    off = np.abs(np.where(first.weights > 0, first.places - places[:, list(first.joints)], 0.0))
    return total, float(off.max(initial=0.0))


def _stiffness(frames: int, before: bool, after: bool) -> Array:
    """(3, frames): diagonal, first and second off-diagonal of the squared second differences, times `SLOW`².

    The change is 0 outside where there are frames ``before`` or ``after``.
    """
    rows = np.arange(-2 if before else 0, frames - (0 if after else 2))
    bands = np.zeros((3, frames + 4))
    for i, a in enumerate((1.0, -2.0, 1.0)):
        for k, b in enumerate((1.0, -2.0, 1.0)[i:]):
            inside = rows[(rows + i >= 0) & (rows + i + k < frames)]
            np.add.at(bands[k], inside + i, a * b)
    return SLOW**2 * bands[:, :frames]


def _stiff(bands: Array, x: Array) -> Array:
    result = bands[0, :, None] * x
    for k in (1, 2):
        if len(x) > k:
            result[:-k] += bands[k, :-k, None] * x[k:]
            result[k:] += bands[k, :-k, None] * x[:-k]
    return result


def _banded(blocks: Array, right: Array, bands: Array) -> Array:
    """Solve (blocks + 1 + bands) x = right for x (frames, n): blocks (frames, n, n) per frame, bands between frames.

    Two frames at a time the system is block-tridiagonal (Thomas).
    """
    frames, n = right.shape
    count = -(-frames // 2)
    eye = np.eye(n)
    main = np.tile(np.eye(2 * n), (count, 1, 1))
    upper = np.zeros((count, 2 * n, 2 * n))
    sides = np.zeros((2 * count, n))
    sides[:frames] = right
    for f in range(frames):
        k, s = divmod(f, 2)
        here = slice(s * n, s * n + n)
        main[k, here, here] = blocks[f] + (1 + bands[0, f]) * eye
        for gap in (1, 2):
            if f + gap < frames:
                l, t = divmod(f + gap, 2)
                there = slice(t * n, t * n + n)
                target = main[k] if l == k else upper[k]
                target[here, there] = bands[gap, f] * eye
                if l == k:
                    main[k][there, here] = bands[gap, f] * eye
    x = sides.reshape(count, 2 * n).copy()
    gains = np.zeros_like(upper)
    for k in range(count):
        if k:
            main[k] -= upper[k - 1].T @ gains[k - 1]
            x[k] -= upper[k - 1].T @ x[k - 1]
        solved = np.linalg.solve(main[k], np.concatenate([upper[k], x[k][:, None]], axis=1))
        gains[k], x[k] = solved[:, :-1], solved[:, -1]
    for k in range(count - 2, -1, -1):
        x[k] -= gains[k] @ x[k + 1]
    return x.reshape(2 * count, n)[:frames]
