"""A sampling loop of one's own: a known past and known legs are held while a goal leads a hand.

What `edit`, `control` and prediction do in their ways is here on one loop: edits of the estimate (guidance, steering,
inpainting) are functions around the denoiser, edits of the state (observations) a chain behind each move.

    python examples/10_holds.py
"""

from pathlib import Path

import numpy as np

from motionloom import SMPL22, Goal, Prior, load, save
from motionloom.core.diffusion import DDPM, chain, guide, inpaint, levels, observe, row_noise, run
from motionloom.core.features import humanml, layout
from motionloom.edits.steering import corrected, toward
from motionloom.tasks.splice import person_at_20
from motionloom.tasks.text import finish

prior = Prior.load()
clip = person_at_20(load(Path(__file__).parent / "clips" / "walk.bvh"))  # (frames + 1, 22, 3) metres
clip = clip - clip[0, 0] * [1, 0, 1]
known = (humanml.encode(clip)[None] - prior.mean) / prior.spread

# What is held: everything in the first half second (the past); way, legs and feet in all of them (a part of the body).
past = np.zeros(known.shape, bool)
past[:, :10] = True
legs = np.zeros_like(past)
legs[..., layout.mask("lower_body")] = True

# The target: the left wrist 1.6 m high after a second and a half.
wrist = SMPL22.index("left_wrist")
goal = Goal.nothing(known.shape[1])
goal.positions[30, wrist, 1] = 1.6
goal.mask[30, wrist, 1] = True

noise, way = row_noise([1]), levels(prior.schedule, 12, spacing="early")
cond = prior.condition(["a person walks and raises the left hand"])
free = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), 2.5)
denoise = inpaint(corrected(free, [toward(goal, prior)]), known, past | legs)
hold = chain(observe(known, past, prior.schedule, noise), observe(known, legs, prior.schedule, noise))
start = hold(noise(known), way[0])
state = run(denoise, start, levels=way, solver=DDPM, schedule=prior.schedule, noise=noise, constrain=hold)

motion = finish(prior, (state * prior.std + prior.mean)[0])
save(motion, "held.bvh")
off = np.abs(state - known)[past | legs].max()
height = humanml.decode_positions((state * prior.std + prior.mean)[0].astype(np.float64))[30, wrist, 1]
was = clip[30, wrist, 1]
print(f"held.bvh: what is held is {off:.6f} off; the wrist is {height:.2f} m high and was {was:.2f} m in the clip")
assert off < 1e-5
assert abs(height - 1.6) < 0.05
