"""Motion files, in and out: the suffix picks the format."""

from collections.abc import Sequence
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.atomic import check_place
from motionloom.motion import Motion

READS = (".bvh", ".amc", ".glb", ".npz")
WRITES = (".bvh", ".glb", ".npz", ".mp4", ".gif", ".png")
_ONE_PERSON = (".bvh", ".npz")


def load(
    path: Path | str, *, fps: float | None = None, asf: Path | str | None = None, unit: float | None = None
) -> Motion:
    """Read a BVH, AMC (with its ASF), GLB or NPZ file as a `Motion` in metres.

    ``fps`` replaces the rate the file states (AMC files state none: 120), without resampling. ``unit`` is metres per
    unit of length for BVH and ASF (None: guessed, or what the ASF says). ``asf`` is the skeleton of an AMC file
    (None: looked for beside it). Raises `MotionloomError` for a file that is missing, damaged or of another kind.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    _check(path, suffix, fps, unit=unit, asf=asf)
    if suffix == ".bvh":
        from motionloom.io.bvh import load_bvh

        return load_bvh(path, fps=fps, unit=unit)
    if suffix == ".amc":
        from motionloom.io.asf import find_asf, load_asf_amc

        return load_asf_amc(asf or find_asf(path), path, fps=fps, unit=unit)
    if suffix == ".npz":
        from motionloom.io.npz import load_npz

        return load_npz(path, fps=fps)
    from motionloom.io.gltf import load_glb

    motion = load_glb(path)
    return motion if fps is None else Motion(motion.skeleton, fps, motion.root, motion.rotations, motion.translations)


def _check(path: Path, suffix: str, fps: float | None, *, unit: float | None, asf: Path | str | None) -> None:
    if path.is_dir():
        raise MotionloomError(f"{path} is a folder; name a file in it")
    if suffix == ".asf":
        raise MotionloomError(f"{path} is a skeleton without a motion; name the .amc file instead")
    if suffix not in READS:
        raise MotionloomError(
            f"{path} cannot be read: its name must end in {', '.join(READS)}; it ends in {suffix or 'none'}"
        )
    if fps is not None and not 1e-3 <= fps <= 1e5:
        raise MotionloomError(f"the frame rate must be a number from 0.001 to 100000; got {fps:g}")
    if unit is not None and not 1e-9 < unit < 1e9:
        raise MotionloomError(f"the unit must be a positive number of metres; got {unit:g}")
    if unit is not None and suffix in (".glb", ".npz"):
        raise MotionloomError(f"{path} is in metres by its format; a unit is for BVH and ASF files")
    if asf is not None and suffix != ".amc":
        raise MotionloomError(f"{path} has its own skeleton; an ASF file is for AMC files")


def check_output(path: Path | str) -> Path:
    """The path, if `save` could write there; ask before long work. Raises `MotionloomError` otherwise."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITES and not path.is_dir():
        raise MotionloomError(
            f"cannot write {path}: its name must end in {', '.join(WRITES)}; it ends in {suffix or 'none'}"
        )
    check_place(path)
    return path


def save(motions: Motion | Sequence[Motion], path: Path | str, *, captions: Sequence[str] | None = None) -> Path:
    """Write one motion or several; the suffix picks BVH (in metres), GLB, NPZ, MP4, GIF or PNG; gives the path back.

    ``captions`` label pictures and films, one per motion. BVH and NPZ files hold one person. The file appears whole
    or not at all. Raises `MotionloomError` for another suffix or a place that cannot be written.
    """
    path = check_output(path)
    several = [motions] if isinstance(motions, Motion) else list(motions)
    suffix = path.suffix.lower()
    if not several or (len(several) > 1 and suffix in _ONE_PERSON):
        raise MotionloomError(f"{path} holds one motion; got {len(several)}, so give each its own file or write a .glb")
    if suffix == ".bvh":
        from motionloom.io.bvh_writer import save_bvh

        return save_bvh(several[0], path)
    if suffix == ".npz":
        from motionloom.io.npz import save_npz

        return save_npz(several[0], path)
    if suffix == ".glb":
        from motionloom.io.gltf import save_glb

        save_glb(several, path)
    else:
        from motionloom.io.video import draw_sheet, draw_video

        draw = draw_sheet if suffix == ".png" else draw_video
        draw(several, path, captions=captions)
    return path
