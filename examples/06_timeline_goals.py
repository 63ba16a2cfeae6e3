"""A timeline: what happens, when, where on one path, and what a hand does inside of a segment.

python examples/06_timeline_goals.py
"""

from pathlib import Path

import numpy as np

from motionloom import SMPL22, Prior, compose, save
from motionloom.goals.timeline import read_timeline

Path("timeline.yaml").write_text("""
seed: 2
path:                                             # for the whole, in the world
  path: { points: [[0, 0], [1, 2.5], [0, 5]] }
segments:
  - text: a person walks forward
    seconds: 3
  - text: a person walks and raises the right hand
    seconds: 3
    transition: 0.6
    goal:                                         # the segment's own: its time begins at 0
      joints:
        - joint: right_wrist
          points: [{ time: 1.5, position: [null, 1.7, null] }]
  - text: a person walks forward
    seconds: 2
""")
timeline = read_timeline("timeline.yaml")
motion = compose(Prior.load(), timeline.segments, seed=timeline.seed or 0, path=timeline.path, steps=8)
save(motion, "timeline.bvh")

assert timeline.path is not None
wanted = timeline.path.positions[:, 0, [0, 2]]
apart = np.linalg.norm(motion.root[:, [0, 2]] - wanted, axis=-1).max()
raised = motion.positions()[timeline.begins[1] + 30, SMPL22.index("right_wrist"), 1]
print(
    f"timeline.bvh: {motion.seconds:g} s, {100 * apart:.1f} cm from its path at most, the hand is {raised:.2f} m high"
)
assert apart < 0.02
assert abs(raised - 1.7) < 0.02
