"""A long motion that goes on from a clip, with a goal in its first segment.

python examples/07_continue.py
"""

from pathlib import Path

import numpy as np

from motionloom import SMPL22, Goal, Prior, Segment, compose, load, save, to_smpl22
from motionloom.io.stream import joined

clip = to_smpl22(load(Path(__file__).parent / "clips" / "walk.bvh")).resample(20)  # any humanoid will do

# Seen from where the clip ends: the left wrist is 1.5 m high after a second and a half.
wrist = SMPL22.index("left_wrist")
goal = Goal.nothing(60)
goal.positions[30, wrist, 1] = 1.5
goal.mask[30, wrist, 1] = True
segments = [Segment("a person walks forward", 3.0, goal=goal), Segment("a person turns around", 3.0)]

made = compose(Prior.load(), segments, start=clip, seed=1, steps=8)
whole = joined([clip, made])
save(whole, "continued.bvh")

strides = np.linalg.norm(np.diff(whole.positions(), axis=0), axis=-1).max(axis=1)  # metres a frame, the fastest joint
seam, usual, height = strides[len(clip) - 1], strides[: len(clip) - 1].max(), made.positions()[30, wrist, 1]
print(f"continued.bvh: {clip.seconds:g} s of the clip, {made.seconds:g} s more; the wrist is {height:.2f} m high")
print(f"from the clip to what follows the fastest joint goes {seam:.3f} m, within the clip {usual:.3f} m at most")
assert abs(height - 1.5) < 0.02
assert seam < 1.5 * usual
