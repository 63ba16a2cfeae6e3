"""A path on the ground and a hand, both kept to in one motion.

python examples/05_control.py
"""

from pathlib import Path

import numpy as np

from motionloom import Goal, Prior, control, save
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import merged
from motionloom.goals.goal_file import read_goal, root_path

frames = 60  # 3 s at 20 frames per second

# Metres on the ground, x to the left and z ahead of somebody who stands at the origin; walked at even speed.
path = root_path([(0, 0), (0.4, 1.0), (0.0, 2.0), (-0.4, 3.0)], frames=frames)

# The left wrist up high in the frames 30 to 39. An array asks for what it likes; `read_goal` reads files and mappings.
hand = Goal.nothing(frames)
hand.positions[30:40, SMPL22.index("left_wrist"), 1] = 1.6
hand.mask[30:40, SMPL22.index("left_wrist"), 1] = True
crouched = {"joints": [{"joint": "head", "points": [{"time": 2.9, "position": [None, 1.35, None]}]}]}
low = read_goal(crouched, frames=frames, folder=Path())

goal = merged(merged(path, hand), low)
[made] = control(Prior.load(), "a person walks forward", goal, seed=1, steps=8)
save(made.motion, "controlled.bvh")

apart = np.linalg.norm((made.motion.root - path.positions[:, 0])[:, [0, 2]], axis=-1)
print(f"controlled.bvh: {100 * made.error:.2f} cm from the goals, {100 * apart.max():.2f} cm from the path at most")
print(*made.missed, sep="\n")
assert made.error < 0.01
assert not made.missed
