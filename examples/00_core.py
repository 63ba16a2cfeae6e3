"""A weight file, a sentence, a motion, a BVH: the core alone, with nothing that is built on it.

python examples/00_core.py
"""

import numpy as np

from motionloom.core.features.layout import mask
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.methods.double_take import double_take_features
from motionloom.core.methods.edit import Observed, edit
from motionloom.core.methods.text import text_to_motion, to_motion
from motionloom.core.methods.walk import Walk
from motionloom.core.models.prior import Prior

prior = Prior.load()  # the network, its noise schedule, its statistics, and the encoder of texts
walk = Walk(steps=24, solver="ddpm", guidance=2.5)

[features] = text_to_motion(prior, ["a person walks forward and waves"], 80, seeds=[1], walk=walk)  # (80, 263)
save_bvh(to_motion(features, prior.fps), "core.bvh")

# the legs of that walk, and other arms
known = ((features - prior.mean) / prior.std)[None].astype(np.float32)
legs = np.broadcast_to(mask("lower_body,root"), known.shape).copy()
[other] = edit(prior, ["a person walks with the arms raised"], Observed(known, legs), seeds=[2], walk=walk)
save_bvh(to_motion(prior.to_features(other), prior.fps), "core_edited.bvh")

# two actions that share a second: DoubleTake
texts = ["a person walks forward", "a person jumps"]
long, ends = double_take_features(prior, texts, [90, 90], mode="paper", ramp=5, seed=3, steps=50)
save_bvh(to_motion(long, prior.fps), "core_long.bvh")
print(f"core.bvh, core_edited.bvh, core_long.bvh: {len(long)} frames, the first action ends at {ends[0]}")
