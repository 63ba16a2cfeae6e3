"""Motion files, in and out: the suffix picks the format."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.atomic import check_place
from motionloom.motion import Motion

READS = (".bvh", ".amc", ".glb", ".gltf", ".vrm", ".vrma", ".fbx", ".npz")
GLTF = (".glb", ".gltf", ".vrm", ".vrma")
CLIPS = (*GLTF, ".fbx")
"""Files that hold several animations."""
WRITES = (".bvh", ".glb", ".vrma", ".usda", ".fbx", ".npz", ".mp4", ".gif", ".png")
_ONE_PERSON = (".bvh", ".npz", ".vrma")
_OWN = "that is written for a character of such a file: --skeleton hero{0} --out moving{0}; else write a .glb"
_BLENDER = "Blender turns it into a .glb (docs/blender.md)"
_WAYS_OUT = {
    ".gltf": _OWN.format(".gltf"),
    ".vrm": _OWN.format(".vrm"),
    **dict.fromkeys((".usd", ".usdc", ".usdz"), "write a .usda, which USD's own usdcat turns into the others"),
    ".dae": "write a .glb or .bvh",
    ".blend": "write a .glb and import it in Blender (docs/blender.md)",
}
_WAYS_IN = dict.fromkeys((".dae", ".blend", ".usd", ".usda", ".usdc", ".usdz"), _BLENDER)


def load(
    path: Path | str,
    *,
    fps: float | None = None,
    asf: Path | str | None = None,
    unit: float | None = None,
    clip: int | str | None = None,
) -> Motion:
    """Read a BVH, AMC (with its ASF), GLB, glTF, VRM, FBX (through Blender) or NPZ file as a `Motion` in metres.

    ``fps`` replaces the rate the file states (AMC files state none: 120), without resampling. ``unit`` is metres per
    unit of length for BVH, ASF and glTF (None: guessed, what the ASF says, metres). ``asf`` is the skeleton of an AMC
    file (None: looked for beside it). ``clip`` is the number, from 1, or the name of a clip of a glTF or FBX file.
    Raises `MotionloomError` for a file that is missing, damaged or of another kind.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    _check(path, suffix, fps, unit=unit, asf=asf)
    if clip is not None and suffix not in CLIPS:
        raise MotionloomError(f"{path} holds one motion; a clip is chosen in .glb, .gltf, .vrm and .fbx files")
    if suffix == ".bvh":
        from motionloom.io.bvh import load_bvh

        return load_bvh(path, fps=fps, unit=unit)
    if suffix == ".amc":
        from motionloom.io.asf import find_asf, load_asf_amc

        return load_asf_amc(asf or find_asf(path), path, fps=fps, unit=unit)
    if suffix == ".npz":
        from motionloom.io.npz import load_npz

        return load_npz(path, fps=fps)
    if suffix == ".fbx":
        from motionloom.io.fbx import load_fbx

        motion = load_fbx(path, clip=clip)
    else:
        from motionloom.io.gltf import load_glb

        motion = load_glb(path, clip=clip)
    motion = motion if fps is None else replace(motion, fps=fps)
    return motion if unit is None else motion.scaled(unit)


def _check(path: Path, suffix: str, fps: float | None, *, unit: float | None, asf: Path | str | None) -> None:
    if path.is_dir():
        raise MotionloomError(f"{path} is a folder; name a file in it")
    if suffix == ".asf":
        raise MotionloomError(f"{path} is a skeleton without a motion; name the .amc file instead")
    if suffix not in READS:
        hint = f"; {_WAYS_IN[suffix]}" if suffix in _WAYS_IN else f"; it ends in {suffix or 'none'}"
        raise MotionloomError(f"{path} cannot be read: its name must end in {', '.join(READS)}{hint}")
    if fps is not None and not 1e-3 <= fps <= 1e5:
        raise MotionloomError(f"the frame rate must be a number from 0.001 to 100000; got {fps:g}")
    if unit is not None and not 1e-9 < unit < 1e9:
        raise MotionloomError(f"the unit must be a positive number of metres; got {unit:g}")
    if unit is not None and suffix == ".npz":
        raise MotionloomError(f"{path} is in metres by its format; a unit is for BVH, ASF and glTF files")
    if asf is not None and suffix != ".amc":
        raise MotionloomError(f"{path} has its own skeleton; an ASF file is for AMC files")


def check_output(path: Path | str, *, own: str | None = None) -> Path:
    """The path, if `save` could write there; ask before long work. Raises `MotionloomError` otherwise.

    ``own`` is a further suffix that may be written, that of a character's own file.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (*WRITES, own) and not path.is_dir():
        hint = f"; {_WAYS_OUT[suffix]}" if suffix in _WAYS_OUT else f"; it ends in {suffix or 'none'}"
        raise MotionloomError(f"cannot write {path}: its name must end in {', '.join(WRITES)}{hint}")
    check_place(path)
    if suffix == ".fbx":
        from motionloom.io.blender import find_blender

        find_blender()
    if suffix == ".mp4":
        from motionloom.viz.film import find_ffmpeg

        find_ffmpeg()
    return path


def save(motions: Motion | Sequence[Motion], path: Path | str, *, captions: Sequence[str] | None = None) -> Path:
    """Write one motion or several; the suffix picks BVH (in metres), GLB, VRMA, USDA, FBX (through Blender),
    NPZ, MP4, GIF or PNG; gives the path back.

    ``captions`` label pictures and films, one per motion. BVH and NPZ files hold one person. The file appears whole
    or not at all. Raises `MotionloomError` for another suffix or a place that cannot be written.
    """
    path = check_output(path)
    several = [motions] if isinstance(motions, Motion) else list(motions)
    suffix = path.suffix.lower()
    _check_count(several, path)
    if suffix == ".bvh":
        from motionloom.io.bvh_writer import save_bvh

        return save_bvh(several[0], path)
    if suffix == ".npz":
        from motionloom.io.npz import save_npz

        return save_npz(several[0], path)
    if suffix == ".vrma":
        from motionloom.io.vrma import save_vrma

        return save_vrma(several[0], path)
    if suffix == ".usda":
        from motionloom.io.usda import save_usda

        return save_usda(several, path)
    if suffix == ".fbx":
        from motionloom.io.fbx import save_fbx

        return save_fbx(several, path)
    if suffix == ".glb":
        from motionloom.io.gltf import save_glb

        save_glb(several, path)
    else:
        from motionloom.viz.video import draw_sheet, draw_video

        draw = draw_sheet if suffix == ".png" else draw_video
        draw(several, path, captions=captions)
    return path


def _check_count(motions: Sequence[Motion], path: Path) -> None:
    if not motions or (len(motions) > 1 and path.suffix.lower() in _ONE_PERSON):
        raise MotionloomError(f"{path} holds one motion; got {len(motions)}, so give each its own file or write a .glb")


def save_scene(
    motions: Sequence[Motion],
    path: Path | str,
    *,
    names: Sequence[str] | None = None,
    captions: Sequence[str] | None = None,
) -> Path:
    """Write people who share one world frame as one scene: GLB, USDA, or one MP4, GIF or PNG with everybody in it.

    ``names``, one per person, name them in a GLB or USDA and in a picture's legend; ``captions``, one per person, stand
    over pictures and films (one only where all are the same). `save` would draw the same people side by side instead.
    BVH and NPZ files hold one person. The file appears whole or not at all.
    Raises `MotionloomError` for names or captions of another count, another suffix, or a place that cannot be written.
    """
    path = check_output(path)
    for what, texts in (("names", names), ("captions", captions)):
        if texts is not None and len(texts) != len(motions):
            raise MotionloomError(f"{len(motions)} motions need as many {what}; got {len(texts)}")
    _check_count(motions, path)
    suffix = path.suffix.lower()
    if suffix in _ONE_PERSON:
        return save(motions, path)
    if suffix == ".glb":
        from motionloom.io.gltf import save_glb

        return save_glb(motions, path, names=names)
    if suffix == ".usda":
        from motionloom.io.usda import save_usda

        return save_usda(motions, path, names=names)
    if suffix == ".fbx":
        from motionloom.io.fbx import save_fbx

        return save_fbx(motions, path, names=names)
    from motionloom.viz.overlay import draw_scene, tint
    from motionloom.viz.scene import Actor

    labels = names if names is not None else [""] * len(motions)
    actors = [Actor(m, tint(i), label=label) for i, (m, label) in enumerate(zip(motions, labels))]
    title = "   |   ".join(dict.fromkeys(c for c in captions or () if c))
    return draw_scene(actors, path, caption=title)


def load_scene(path: Path | str) -> list[Motion]:
    """Everybody in a file, in its order and one world frame: a GLB's people, or the one motion of another format.

    Raises `MotionloomError` as `load` does; `load` itself gives a GLB's first person.
    """
    path = Path(path)
    _check(path, path.suffix.lower(), None, unit=None, asf=None)
    if path.suffix.lower() not in GLTF:
        return [load(path)]
    from motionloom.io.gltf import load_glb_people

    return load_glb_people(path)
