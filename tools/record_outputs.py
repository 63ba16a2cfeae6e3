"""Record anew what every command makes of fixed seeds, for tests/outputs.

python tools/record_outputs.py

Do so after a change that is meant to change what is made: new shipped weights, another sampler, a better fit. Say in
the commit why the outputs changed. With `--compare` nothing is written, and the largest distance is printed for each.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from motionloom.io.atomic import atomic_path
from tests.outputs.commands import COMMANDS, RECORDED, places, sampled


def main() -> None:
    made = {}
    for name in COMMANDS:
        with tempfile.TemporaryDirectory() as folder:
            made[name] = sampled(places(name, Path(folder)))
    if "--compare" in sys.argv[1:]:
        with np.load(RECORDED, allow_pickle=False) as recorded:
            for name, positions in made.items():
                same = name in recorded and recorded[name].shape == positions.shape
                print(f"{name:24}", f"{np.abs(recorded[name] - positions).max():.1e} m" if same else "not as recorded")
        return
    with atomic_path(RECORDED) as path, path.open("wb") as file:
        np.savez_compressed(file, **made)
    print(f"{RECORDED}: {len(made)} commands, {RECORDED.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
