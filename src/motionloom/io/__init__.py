"""Motion files, in and out: the suffix picks the format."""

from collections.abc import Sequence
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.motion import Motion

READS = (".bvh", ".amc", ".glb", ".npz")
WRITES = (".bvh", ".glb", ".npz", ".mp4", ".gif", ".png")


def load(
    path: Path | str, *, fps: float | None = None, asf: Path | str | None = None, unit: float | None = None
) -> Motion:
    """Read a BVH, AMC (with its ASF), GLB or NPZ file as a `Motion` in metres.

    ``fps`` replaces the rate the file states (AMC files state none: 120), without resampling. ``unit`` is metres per
    unit of length for BVH and ASF (None: guessed, or what the ASF says). ``asf`` is the skeleton of an AMC file
    (None: looked for beside it). Raises `MotionloomError` for a file that is missing, damaged or of another kind.
    """
    path = Path(path)
    if fps is not None and not 0 < fps < 1e5:
        raise MotionloomError(f"the frame rate must be a positive number; got {fps}")
    if unit is not None and not 1e-9 < unit < 1e9:
        raise MotionloomError(f"the unit must be a positive number of metres; got {unit}")
    match path.suffix.lower():
        case ".bvh":
            from motionloom.io.bvh import load_bvh

            return load_bvh(path, fps=fps, unit=unit)
        case ".amc":
            from motionloom.io.asf import find_asf, load_asf_amc

            return load_asf_amc(asf or find_asf(path), path, fps=fps, unit=unit)
        case ".asf":
            raise MotionloomError(f"{path} is a skeleton without a motion; name the .amc file (and the skeleton with asf)")
        case _:
            raise MotionloomError(f"{path}: files that end in {path.suffix or 'nothing'} are not read; {', '.join(READS)} are")
