"""Time to write and read a 10-minute BVH file (18,000 frames of 24 joints at 30 fps); prints JSON, seconds.

Usage: python benchmarks/bvh_speed.py [FRAMES]. ``wall`` is by the clock, ``cpu`` what the process itself used:
on a busy machine they differ. Each number is the best of three.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import Skeleton
from motionloom.io.bvh import load_bvh, save_bvh

JOINTS = 24


def swinging(frames: int) -> Motion:
    """A chain of 24 joints that all turn smoothly, walking off at random."""
    random = np.random.default_rng(0)
    skeleton = Skeleton(tuple(f"joint{j}" for j in range(JOINTS)), (-1, *range(JOINTS - 1)), np.full((JOINTS, 3), 0.1))
    rotations = rotvec_to_quat(np.cumsum(random.normal(0, 0.02, (frames, JOINTS, 3)), axis=0))
    return Motion(skeleton, 30, np.cumsum(random.normal(0, 0.01, (frames, 3)), axis=0), rotations)


def best(work: Callable[[], object]) -> dict[str, float]:
    """Best of three runs."""
    runs = []
    for _ in range(3):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        runs.append((time.perf_counter() - wall, time.process_time() - cpu))
    return {"wall": round(min(w for w, _ in runs), 3), "cpu": round(min(c for _, c in runs), 3)}


def main() -> None:
    """Measure and print."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 18_000
    motion = swinging(frames)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bvh"
        times = {"write": best(lambda: save_bvh(motion, path)), "read": best(lambda: load_bvh(path, unit=1))}
        print(json.dumps({"frames": frames, "joints": JOINTS, "bytes": path.stat().st_size, **times}))


if __name__ == "__main__":
    main()
