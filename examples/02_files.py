"""From one file format to another, by hand: load, look, cut, change the rate, mirror, save. Needs no weights.

python examples/02_files.py
"""

import numpy as np

from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import SMPL22
from motionloom.io import load, save

# Two seconds of a T-posed person who turns once about the vertical axis and raises the left arm.
frames, fps = 60, 30.0
turn = np.zeros((frames, len(SMPL22), 3))
turn[:, 0, 1] = np.linspace(0, 2 * np.pi, frames)
turn[:, SMPL22.index("left_shoulder"), 2] = np.linspace(0, 1.2, frames)
motion = Motion(SMPL22, fps, np.tile(SMPL22.offsets[0], (frames, 1)), rotvec_to_quat(turn))

save(motion, "turn.bvh")
again = load("turn.bvh")
order = [again.skeleton.index(name) for name in SMPL22.names]  # a BVH lists joints depth first
apart = np.abs(again.positions()[:, order] - motion.positions()).max()
print(f"turn.bvh: {len(again)} frames at {again.fps:g} fps, {apart:.6f} m from what was saved")

save(motion.crop(0.5, 1.5).resample(20).mirror(), "mirrored.npz")
print(f"mirrored.npz: {load('mirrored.npz').seconds:g} s")
