"""Motion files, in and out: the suffix picks the format."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from motionloom import formats
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import check_place
from motionloom.core.motion import Motion
from motionloom.formats import Format
from motionloom.retarget.upright import set_upright

GLTF = (".glb", ".gltf", ".vrm", ".vrma")
_OWN = "that is written for a character of such a file: --skeleton hero{0} --out moving{0}; else write a .glb"
_BLENDER = "Blender turns it into a .glb (docs/blender.md)"
_ROBOT = "joint angles of a robot go with its model: --robot, in Python robots.files.load_motion (docs/robots.md)"
_WAYS_OUT = {
    ".gltf": _OWN.format(".gltf"),
    ".vrm": _OWN.format(".vrm"),
    **dict.fromkeys((".usd", ".usdc", ".usdz"), "write a .usda, which USD's own usdcat turns into the others"),
    ".dae": "write a .glb or .bvh",
    ".csv": _ROBOT,
    ".blend": "write a .glb and import it in Blender (docs/blender.md)",
}
_WAYS_IN = dict.fromkeys((".dae", ".blend", ".usd", ".usda", ".usdc", ".usdz"), _BLENDER) | {".csv": _ROBOT}


def load(
    path: Path | str,
    *,
    fps: float | None = None,
    asf: Path | str | None = None,
    unit: float | None = None,
    up: str | None = None,
    clip: int | str | None = None,
) -> Motion:
    """Read a BVH, AMC (with its ASF), GLB, glTF, VRM, FBX (through Blender) or NPZ file as a `Motion` in metres.

    ``fps`` replaces the rate the file states (AMC files state none: 120), without resampling. ``unit`` is metres per
    unit of length (None: guessed for BVH, what an ASF says, metres for others). ``up`` is the axis of the file that is
    up, one of `motionloom.retarget.upright.AXES` (None: by how the person moves in BVH and AMC files, Y in others);
    a file that is turned, or in which it is not certain, is warned of. ``asf`` is the skeleton of an AMC file (None:
    looked for beside it). ``clip`` is the number, from 1, or the name of a clip of a glTF or FBX file.
    Raises `MotionloomError` for a file that is missing, damaged or of another kind.
    """
    path = Path(path)
    options = {"fps": fps, "unit": unit, "up": up, "asf": asf, "clip": clip}
    kind = _checked(path, fps, unit=unit, asf=asf)
    if clip is not None and not kind.clips:
        raise MotionloomError(f"{path} holds one motion; a clip is chosen in {', '.join(formats.with_clips())} files")
    own = {key: options[key] for key in kind.options if options.get(key) is not None}
    motion = _call(kind.reader, path, **own)
    motion = motion if fps is None or "fps" in own else replace(motion, fps=fps)
    motion = motion if unit is None or "unit" in own else motion.scaled(unit)
    return set_upright(motion, path, up) if "up" not in own and (up or kind.any_up) else motion


def _checked(path: Path, fps: float | None, *, unit: float | None, asf: Path | str | None) -> Format:
    """The format of a file that may be read, with options that may go with it."""
    kind = formats.find(path)
    suffix = kind.suffix
    if path.is_dir():
        raise MotionloomError(f"{path} is a folder; name a file in it")
    if suffix == ".asf":
        raise MotionloomError(f"{path} is a skeleton without a motion; name the .amc file instead")
    if not kind.reader:
        hint = f"; {_WAYS_IN[suffix]}" if suffix in _WAYS_IN else f"; it ends in {suffix or 'none'}"
        raise MotionloomError(f"{path} cannot be read: its name must end in {', '.join(formats.readable())}{hint}")
    if fps is not None and not 1e-3 <= fps <= 1e5:
        raise MotionloomError(f"the frame rate must be a number from 0.001 to 100000; got {fps:g}")
    if unit is not None and not 1e-9 < unit < 1e9:
        raise MotionloomError(f"the unit must be a positive number of metres; got {unit:g}")
    if asf is not None and "asf" not in kind.options:
        raise MotionloomError(f"{path} has its own skeleton; an ASF file is for AMC files")
    return kind


def open_character(path: Path | str, *, joint_map: Any = None) -> Any:
    """The `Character` of a file; ``joint_map``: which joints are which. Raises `MotionloomError` if it holds none."""
    path = Path(path)
    kind = formats.find(path)
    if not kind.character:
        raise MotionloomError(f"{path} is no character; one ends in {', '.join(formats.characters())}")
    return _call(kind.character, path, joint_map=joint_map)


def check_output(path: Path | str, *, own: str | None = None) -> Path:
    """The path, if `save` could write there; ask before long work. Raises `MotionloomError` otherwise.

    ``own`` is a further suffix that may be written, that of a character's own file.
    """
    path = Path(path)
    kind = formats.find(path)
    suffix = kind.suffix
    if not kind.writer and suffix != own and not path.is_dir():
        hint = f"; {_WAYS_OUT[suffix]}" if suffix in _WAYS_OUT else f"; it ends in {suffix or 'none'}"
        raise MotionloomError(f"cannot write {path}: its name must end in {', '.join(formats.writable())}{hint}")
    check_place(path)
    check_program(path)
    return path


def check_program(path: Path | str) -> None:
    """Raise `MotionloomError` where files of such a name need a program that is not here."""
    if needs := formats.find(path).needs:
        _call(needs)


def save(motions: Motion | Sequence[Motion], path: Path | str, *, captions: Sequence[str] | None = None) -> Path:
    """Write one motion or several; the suffix picks BVH (in metres), GLB, VRMA, USDA, FBX (through Blender),
    NPZ, MP4, GIF, PNG or HTML, a page that plays them; gives the path back.

    ``captions`` label pictures, films and pages, one per motion. BVH and NPZ files hold one person. The file appears
    whole or not at all. Raises `MotionloomError` for another suffix or a place that cannot be written.
    """
    path = check_output(path)
    several = [motions] if isinstance(motions, Motion) else list(motions)
    kind = formats.find(path)
    _check_count(several, kind, path)
    labels = {"captions": captions} if kind.labels == "captions" else {}
    return _call(kind.writer, several[0] if kind.single else several, path, **labels)


def _check_count(motions: Sequence[Motion], kind: Format, path: Path) -> None:
    if not motions or (len(motions) > 1 and kind.single):
        raise MotionloomError(f"{path} holds one motion; got {len(motions)}, so give each its own file or write a .glb")


def save_scene(
    motions: Sequence[Motion],
    path: Path | str,
    *,
    names: Sequence[str] | None = None,
    captions: Sequence[str] | None = None,
) -> Path:
    """Write people who share one world frame as one scene: GLB, USDA, or one MP4, GIF, PNG or HTML with all of them.

    ``names``, one per person, name them in a GLB or USDA and in a picture's legend; ``captions``, one per person, are
    written over pictures and films (one only where all are the same). `save` would draw the same people side by side.
    BVH and NPZ files hold one person. The file appears whole or not at all.
    Raises `MotionloomError` for names or captions of another count, another suffix, or a place that cannot be written.
    """
    path = check_output(path)
    for what, texts in (("names", names), ("captions", captions)):
        if texts is not None and len(texts) != len(motions):
            raise MotionloomError(f"{len(motions)} motions need as many {what}; got {len(texts)}")
    kind = formats.find(path)
    _check_count(motions, kind, path)
    if kind.single or not kind.labels:
        return save(motions, path)
    if kind.labels == "names":
        return _call(kind.writer, motions, path, names=names)
    title = "   |   ".join(dict.fromkeys(c for c in captions or () if c))
    if kind.scene:
        return _call(kind.scene, motions, path, caption=title)
    from motionloom.viz.overlay import draw_scene, tint
    from motionloom.viz.scene import Actor

    texts = [""] * len(motions) if names is None else names
    actors = [Actor(m, tint(i), label=text) for i, (m, text) in enumerate(zip(motions, texts))]
    return draw_scene(actors, path, caption=title)


def load_scene(path: Path | str) -> list[Motion]:
    """Everybody in a file, in its order and one world frame: a GLB's people, or the one motion of another format.

    Raises `MotionloomError` as `load` does; `load` itself gives a GLB's first person.
    """
    path = Path(path)
    kind = _checked(path, None, unit=None, asf=None)
    return _call(kind.people, path) if kind.people else [load(path)]


def _call(function: str | Callable[..., Any], *values: Any, **options: Any) -> Any:
    """The result of a format's function."""
    if not isinstance(function, str):
        return function(*values, **options)
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)(*values, **options)
