"""Other motions as goals: where the joints of a recording are, for somebody else to follow."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.features.humanml import resample_positions
from motionloom.goals.goal import FPS, Goal
from motionloom.motion import Motion, ground_pose
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22


def follow(motion: Motion, joints: Sequence[str], *, frames: int, at: Sequence[float] | None = None) -> Goal:
    """The places of joints (or groups) of a motion of any humanoid, as a goal of so many frames at 20 fps.

    The motion is put on the uniform person first; places are those in its world, and the goal starts where its person
    stands. at: seconds, each within the motion; None: every frame that the motion has. Raises `MotionloomError` for
    an unknown joint or a time that either of the two does not have.
    """
    chosen = list(SMPL22.resolve(joints))
    positions = resample_positions(to_smpl22(motion).positions(), motion.fps)
    return tracks(positions, chosen, frames=frames, at=at)


def tracks(positions: np.ndarray, joints: Sequence[int], *, frames: int, at: Sequence[float] | None) -> Goal:
    """`follow` for joints, by number, of places (n, 22, 3) at 20 fps."""
    known = min(len(positions), frames)
    if at is None:
        rows = np.arange(known)
    else:
        rows = np.array([round(time * FPS) for time in at], dtype=int)
        if len(rows) == 0 or rows.min() < 0 or rows.max() > known:
            raise MotionloomError(
                f"a motion can be followed at 0 to {(known - 1) / FPS:g} s here; got "
                f"{', '.join(f'{t:g}' for t in at[:20]) or 'none'}"
            )
        rows = np.minimum(rows, known - 1)
    goal = Goal.nothing(frames)
    for joint in joints:
        goal.positions[rows, joint] = positions[rows, joint]
        goal.mask[rows, joint] = True
    return replace(goal, start=ground_pose(positions[0]))
