"""A clip changed by words: the legs stay, a stretch is drawn anew, the end meets the beginning.

python examples/08_edit.py
"""

from pathlib import Path

import numpy as np

from motionloom import SMPL22, Loop, Motion, Prior, Redraw, edit, load, save

prior = Prior.load()
clip = load(Path(__file__).parent / "clips" / "walk.bvh")
places = clip.positions()


def apart(motion: Motion, part: str) -> float:
    """Metres that the joints of a part are away from the clip's at most."""
    joints = [clip.skeleton.index(SMPL22.names[joint]) for joint in SMPL22.resolve([part])]
    return float(np.abs(motion.positions() - places)[:, joints].max())


def turn(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees by which the joint that turns most turns from rotations ``a`` to ``b``."""
    return float(np.degrees(2 * np.arccos(np.abs((a * b).sum(axis=-1)).clip(max=1))).max())


[waving] = edit(prior, clip, "a person waves with both hands", Redraw(keep=["lower_body"]), seed=1, steps=8)
save(waving, "waving.bvh")
legs, hands = apart(waving, "lower_body"), apart(waving, "hands")
print(f"waving.bvh: legs are {legs:.6f} m and hands {hands:.2f} m away from the clip's at most")
assert legs < 1e-6 < 0.1 < hands

[between] = edit(prior, clip, "a person crouches", Redraw([(0.6, 1.6)]), seed=1, steps=8)
save(between, "between.bvh")
changed = np.flatnonzero(np.abs(between.positions() - places).max(axis=(1, 2)) > 1e-6) / clip.fps
print(f"between.bvh: changed from {changed.min():.2f} to {changed.max():.2f} s")
assert 0.6 <= changed.min() <= changed.max() < 1.6

[loop] = edit(prior, clip, changes=Loop(), seed=1, steps=8)
save(loop, "loop.bvh")
closing, usual = (
    turn(loop.rotations[-1, 1:], loop.rotations[0, 1:]),
    turn(loop.rotations[1:, 1:], loop.rotations[:-1, 1:]),
)
print(f"loop.bvh: from its last frame to its first a joint turns {closing:.1f} degrees, elsewhere {usual:.1f} at most")
assert closing < 1.5 * usual
