"""Several sentences become one long motion, written while it is made: it may last hours.

python examples/04_long.py
"""

import numpy as np

from motionloom import Prior, Segment, compose_stream, load
from motionloom.io.stream import open_stream

segments = [
    Segment("a person walks forward", 5.0),
    Segment("a person jumps up", 3.0, transition=0.5),  # what it shares with the next one, in seconds
    Segment("a person walks in a circle", 6.0, guidance=3.0),
    Segment("a person waves with the right hand", 5.0),
]
with open_stream("long.bvh", total=None) as file:
    for piece in compose_stream(Prior.load(), segments, seed=1, steps=8):  # 24 steps, the default, look better
        file.write(piece)
        print(f"{file.seconds:5.2f} s are on the disk")

motion = load("long.bvh")
strides = np.linalg.norm(np.diff(motion.positions(), axis=0), axis=-1).max(axis=1)  # metres a frame, the fastest joint
seams = np.cumsum([round(20 * segment.seconds) for segment in segments])[:-1]
at_seams = max(strides[seam - 2 : seam + 2].max() for seam in seams)
print(
    f"long.bvh: {motion.seconds:g} s; strides are at most {at_seams:.3f} m at seams and {strides.max():.3f} m anywhere"
)
assert len(motion) == 380
assert at_seams < 0.25, "somebody jumped between two frames"
