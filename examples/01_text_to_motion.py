"""A sentence becomes a motion, then a file: the main job from Python.

python examples/01_text_to_motion.py
"""

from motionloom import Prior, generate, save

prior = Prior.load()
for i, motion in enumerate(generate(prior, ["a person walks forward", "a person waves"], seconds=3.0, seed=1)):
    low, high = motion.positions()[..., 1].min(), motion.positions()[..., 1].max()
    print(f"motion {i}: {motion.seconds:g} s, from {low:.2f} to {high:.2f} m")
    save(motion, f"motion{i}.bvh")
