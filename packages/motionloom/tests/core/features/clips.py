"""Real people beside the repository, as positions of the uniform person at 20 fps."""

import numpy as np

from motionloom.core.features import humanml
from motionloom.io.asf import load_asf_amc
from motionloom.retarget import joints22
from tests.shared import shared


def real(clip: str) -> np.ndarray:
    """(frames, 22, 3) metres of an ASF/AMC clip such as ``07_01``; skips the test where it is absent."""
    folder = shared(f"data/cmu/asf_amc/{clip[:-3]}")
    motion = load_asf_amc(folder / f"{clip[:-3]}.asf", folder / f"{clip}.amc", fps=30)
    return humanml.canonical(humanml.uniform(humanml.resample_positions(joints22(motion), motion.fps)))
