"""Futures of a clip: several at once, one whose arm is held to another motion, and the way into another clip.

python examples/11_predict.py
"""

from pathlib import Path

import numpy as np

from motionloom import load, save
from motionloom.core.models.predictor import Predictor
from motionloom.goals.hold import FixedJoints
from motionloom.goals.mask_file import read_mask
from motionloom.tasks.predict import predict, switch
from motionloom.viz.overlay import draw_futures

here = Path(__file__).parent
predictor = Predictor.load()
clip = load(here / "clips" / "walk.bvh")
past, later = clip.crop(0.0, 0.8), clip.crop(0.0, 1.6)

futures = predict(predictor, past, count=5, seconds=2.0, seed=1)
for number, motion in enumerate(futures):
    save(motion, f"future_{number}.bvh")
draw_futures(past, [motion.frames(len(past), len(motion)) for motion in futures], "futures.png", caption="walk")
same = all(np.array_equal(motion.rotations[: len(past)], past.rotations) for motion in futures)
ends = np.array([motion.root[-1] for motion in futures])
print(f"future_0.bvh to future_4.bvh, futures.png: they end up to {np.ptp(ends, axis=0).max():.2f} m from each other")
assert same

hold = FixedJoints(later, read_mask(here / "masks" / "left_arm.json", fps=past.fps))
[held] = predict(predictor, past, count=1, seconds=1.5, seed=1, hold=hold)
save(held, "held.bvh")
elbow = past.skeleton.index("left_elbow")
apart = np.abs(held.rotations[len(past) :, elbow] - later.rotations[: len(held) - len(past), elbow]).max()
print(f"held.bvh: the held elbow's rotations are {apart:.1e} away from those of the other motion")
assert apart < 1e-9

[whole] = switch(predictor, past, later, seconds=1.0, seed=1)
save(whole, "switch.bvh")
joints = np.abs(whole.rotations[-len(later) :, 1:] - later.rotations[:, 1:]).max()
print(f"switch.bvh: {past.seconds:.1f} s, 1 s of transition, and the other clip, {joints:.1e} away from itself")
assert joints < 1e-9
