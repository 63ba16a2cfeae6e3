"""`Goal`: the targets of a motion, in the world: places of joints, and where the person faces.

Metres, +Y up, radians about +Y (0 faces +Z, a quarter turn +X); 20 frames per second like everything that is sampled.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.ground import GroundPose
from motionloom.core.motion import ground_pose
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FPS = 20.0
"""Frames per second of every goal."""
AGREE = 0.01
"""Metres: two goals whose places for one joint at one time are further apart than this contradict each other."""
AGREE_TURN = np.radians(5.0)
"""Radians: the same for directions."""
SET_OUT = 0.05
"""Metres from its beginning at which a path shows its first direction."""
_ACROSS = list(SMPL22.resolve(["left_hip", "right_hip", "left_shoulder", "right_shoulder"]))


@dataclass(frozen=True, eq=False)
class Goal:
    """Targets for each frame. Where the mask is False the values may be any finite number."""

    positions: Array
    """(frames, 22, 3) metres in the world."""
    mask: Flags
    """(frames, 22, 3): True at coordinates with a target; a path on the ground has x and z of the pelvis (joint 0)."""
    facing: Array
    """(frames,) radians."""
    facing_mask: Flags
    """(frames,) True at the frames that have a target direction."""
    start: GroundPose | None = None
    """The ground pose at frame 0, where that is known; no target: without it `start_of` goes by the targets."""

    def __post_init__(self) -> None:
        frames = len(self.positions)
        shapes = (frames, len(SMPL22), 3), (frames, len(SMPL22), 3), (frames,), (frames,)
        parts = (self.positions, self.mask, self.facing, self.facing_mask)
        if frames < 1 or any(part.shape != shape for part, shape in zip(parts, shapes, strict=True)):
            raise MotionloomError(f"a goal's parts do not fit each other: {[part.shape for part in parts]}")
        if not (np.isfinite(self.positions[self.mask]).all() and np.isfinite(self.facing[self.facing_mask]).all()):
            raise MotionloomError("a goal asks for a place that is not finite (NaN or infinity)")

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def empty(self) -> bool:
        """Whether there is no target at all."""
        return not (self.mask.any() or self.facing_mask.any())

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that have a target anywhere, in the skeleton's order."""
        return tuple(SMPL22.names[joint] for joint in np.flatnonzero(self.mask.any(axis=(0, 2))))

    def scaled(self, size: float) -> "Goal":
        """With every place so many times as far from the world's origin."""
        start = self.start
        start = start if start is None else replace(start, x=size * start.x, z=size * start.z)
        return replace(self, positions=size * self.positions, start=start)

    @staticmethod
    def nothing(frames: int) -> "Goal":
        """No targets for so many frames."""
        shape = (frames, len(SMPL22), 3)
        return Goal(np.zeros(shape), np.zeros(shape, bool), np.zeros(frames), np.zeros(frames, bool))

    def crop(self, first: int, last: int) -> "Goal":
        """The frames from ``first`` to before ``last``."""
        part = slice(first, last)
        start = self.start if first == 0 else None
        return Goal(self.positions[part], self.mask[part], self.facing[part], self.facing_mask[part], start)

    def padded(self, before: int, after: int) -> "Goal":
        """With so many frames without targets around it."""
        ends = Goal.nothing(before + len(self) + after)
        part = slice(before, before + len(self))
        for whole, own in zip(_parts(ends), _parts(self), strict=True):
            whole[part] = own
        return ends if before else replace(ends, start=self.start)

    def relative_to(self, place: GroundPose) -> "Goal":
        """The same targets in coordinates in which ``place`` is the origin and faces +Z.

        Single horizontal coordinates cannot be turned: both or none of x and z must have a target unless nothing turns.
        """
        if place.facing and (self.mask[..., 0] != self.mask[..., 2]).any():
            raise MotionloomError("a goal that asks for only one of x and z cannot be seen from another direction")
        return replace(
            self,
            positions=place.from_world(self.positions),
            facing=self.facing - place.facing,
            start=None if self.start is None else self.start.seen_from(place),
        )

    def placed(self, place: GroundPose) -> "Goal":
        """The same targets, given in coordinates in which ``place`` is the origin facing +Z, in those of the world."""
        return self.relative_to(place.inverse())


def start_of(goal: Goal) -> GroundPose:
    """The person's ground pose at frame 0: `Goal.start` or, without it, that of the targets.

    The place is the pelvis's, the direction that of the target facing at frame 0, else of the hips and shoulders with
    targets there, else the way that the pelvis's path sets out. What no target decides is 0: the origin, facing +Z.
    """
    if goal.start is not None:
        return goal.start
    x, z = np.where(goal.mask[0, 0, [0, 2]], goal.positions[0, 0, [0, 2]], 0.0)
    return GroundPose(float(x), float(z), _first_facing(goal))


def _first_facing(goal: Goal) -> float:
    if goal.facing_mask[0]:
        return float(goal.facing[0])
    if goal.mask[0, _ACROSS][:, [0, 2]].all():
        return ground_pose(goal.positions[0]).facing
    on_path = np.flatnonzero(goal.mask[:, 0][:, [0, 2]].all(axis=-1))
    if len(on_path) == 0 or on_path[0] != 0:
        return 0.0
    way = goal.positions[on_path, 0][:, [0, 2]] - goal.positions[0, 0, [0, 2]]
    away = np.flatnonzero(np.linalg.norm(way, axis=-1) > SET_OUT)
    return float(np.arctan2(*way[away[0]])) if len(away) else 0.0


def joined(first: Goal, second: Goal) -> Goal:
    """The targets of one stretch of frames and of the one behind it."""
    pairs = zip(_parts(first), _parts(second), strict=True)
    positions, mask, facing, facing_mask = (np.concatenate(pair) for pair in pairs)
    return Goal(positions, mask, facing, facing_mask, first.start)


def merged(first: Goal, second: Goal) -> Goal:
    """The targets of both; MotionloomError where they have different places (`AGREE`), naming joint and time."""
    if len(first) != len(second):
        raise MotionloomError(f"goals of {len(first)} and {len(second)} frames cannot be put together")
    both = first.mask & second.mask
    apart = np.where(both, np.abs(first.positions - second.positions), 0.0)
    if apart.max(initial=0.0) > AGREE:
        frame, joint, _ = np.unravel_index(int(apart.argmax()), apart.shape)
        raise MotionloomError(
            f"two goals contradict each other: {SMPL22.names[joint]} at {frame / FPS:.2f} s is asked to be in two "
            f"places {apart.max():.2f} m apart; drop one of them"
        )
    _check_turns(first, second)
    _check_starts(first.start, second.start)
    return overlaid(first, second)


def overlaid(first: Goal, second: Goal) -> Goal:
    """The targets of both; those of the first where both have one."""
    return Goal(
        np.where(first.mask, first.positions, second.positions),
        first.mask | second.mask,
        np.where(first.facing_mask, first.facing, second.facing),
        first.facing_mask | second.facing_mask,
        second.start if first.start is None else first.start,
    )


def _check_turns(first: Goal, second: Goal) -> None:
    both = first.facing_mask & second.facing_mask
    apart = np.where(both, np.abs(turn_between(first.facing, second.facing)), 0.0)
    if apart.max(initial=0.0) > AGREE_TURN:
        frame = int(apart.argmax())
        raise MotionloomError(
            f"two goals contradict each other: at {frame / FPS:.2f} s the person is asked to face two directions "
            f"{np.degrees(apart.max()):.0f} degrees apart; drop one of them"
        )


def _check_starts(first: GroundPose | None, second: GroundPose | None) -> None:
    if first is None or second is None:
        return
    apart = float(np.hypot(first.x - second.x, first.z - second.z))
    turn = abs(float(turn_between(first.facing, second.facing)))
    if apart > AGREE or turn > AGREE_TURN:
        raise MotionloomError(
            f"two goals contradict each other: the person is asked to start in two places {apart:.2f} m and "
            f"{np.degrees(turn):.0f} degrees apart; drop one of them"
        )


def turn_between(a: np.ndarray | float, b: np.ndarray | float) -> Array:
    """Radians from direction ``b`` to ``a`` the short way, -pi to pi."""
    return (np.asarray(a, dtype=np.float64) - b + np.pi) % (2 * np.pi) - np.pi


def _parts(goal: Goal) -> tuple[np.ndarray, ...]:
    return goal.positions, goal.mask, goal.facing, goal.facing_mask
