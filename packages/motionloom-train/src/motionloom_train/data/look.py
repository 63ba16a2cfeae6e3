"""A page of pictures to look over a built set: recordings beside the clips built from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.physics import Array
from motionloom.retarget.fidelity import LEG
from motionloom.viz import draw
from motionloom.viz.draw import Camera
from motionloom.viz.figure import Figure, figure
from motionloom.viz.film import caption, font, shorten, suffixed
from motionloom_train.data import gate
from motionloom_train.data.build import Finder, clips_of
from motionloom_train.data.clips import read_clip
from motionloom_train.data.progress import Say
from motionloom_train.data.sources import Places, Take, find_takes

POSE = (92, 132)
"""Pixels of one pose."""
MOMENTS = (0.15, 0.5, 0.85)
"""Shares of a clip's time that the pictures show."""
SIDE, FRONT = -np.pi / 2, 0.0
"""Radians from where the person faces to where the camera is."""
_CAPTION, _GAP = 20, 10
_FAULT = (208, 62, 62)
MOST = 20
"""Clips of one source on a page."""


@dataclass(frozen=True, eq=False)
class Pair:
    """A recording and its clip, (frames, 22, 3) metres each, at 20 frames per second."""

    name: str
    recording: Array
    clip: Array
    remark: str
    sound: bool


def draw_look(
    built_set: Path | str,
    folders: Sequence[Path | str],
    path: Path | str,
    *,
    each: int = 2,
    find: Finder = find_takes,
    progress: Say = print,
) -> Path:
    """Write a PNG: a row for each clip, the recording at the left and the built one at the right.

    Of every source come those that are furthest from their recordings and typical ones, whether they were refused or
    not, at three moments from the side and from the front, on legs of one length.

    Args:
        built_set: a folder of `data.build`.
        folders: the recordings that it was built from.
        path: a name that ends in .png.
        each: clips of each source, 1 to 20.
        find: what finds the takes of a folder.

    Raises `MotionloomError` for a folder that is no such set, recordings of which the set has none, and a number or a
    path that cannot be.
    """
    target, built_set = suffixed(path, (".png",)), Path(built_set)
    if not 1 <= each <= MOST:
        raise MotionloomError(f"1 to {MOST} clips of each source are drawn; got {each}")
    if not (built_set / gate.FOLDER).is_dir():
        raise MotionloomError(
            f"{built_set} is no set whose bodies were compared; make one with `motionloom data build`"
        )
    compared = gate.read_compared(built_set)
    takes = {take.name: take for folder in reversed(folders) for take in find(folder, captions=None)}
    names = choose({name: one for name, one in compared.items() if name in takes}, each)
    if not names:
        raise MotionloomError(
            f"none of the recordings in {', '.join(map(str, folders))} is in {built_set}; name others"
        )
    rows = []
    for name in names:
        rows.append(_row(_pair(built_set, takes[name], compared[name])))
        progress(f"{len(rows)} of {len(names)}: {name}")
    sheet = Image.new("RGB", (rows[0].width, (rows[0].height + _GAP) * len(rows)), (255, 255, 255))
    for number, row in enumerate(rows):
        sheet.paste(row, (0, number * (row.height + _GAP)))
    with atomic_path(target) as temp:
        sheet.quantize(255, dither=Image.Dither.NONE).save(temp, format="PNG", optimize=True)
    return Path(path)


def choose(compared: Mapping[str, gate.Compared], each: int) -> list[str]:
    """``each`` takes of every source: the one furthest off, the one in the middle, and so on in turn."""
    names: list[str] = []
    for source in sorted({one.source for one in compared.values()}):
        of = [name for name, one in compared.items() if one.source == source]
        of.sort(key=lambda name: (len(compared[name].faults) > 0, compared[name].directions["all"][1]))
        for turn in range(min(each, len(of))):
            names.append(of.pop(-1 if turn % 2 == 0 else len(of) // 2))
    return names


def _pair(built_set: Path, take: Take, compared: gate.Compared) -> Pair:
    recordings: list[Places] = []
    first = next(clips_of(take, check=lambda places, clip: recordings.append(places)))
    path = built_set / "clips" / f"{take.name}.safetensors"
    clip = read_clip(path) if path.is_file() else first
    positions = clip.positions()
    own = hml.resample_positions(recordings[0].own, recordings[0].fps)[: len(positions)]
    median, high = compared.directions["all"]
    verdict = "refused" if compared.refused else "allowed" if compared.allowed else ""
    note = ": ".join(part for part in (verdict, ", ".join(compared.faults[:2])) if part)
    remark = f"{take.source}, {median:.1f} degrees off (95 %: {high:.0f}){'; ' + note if note else ''}"
    leg = np.linalg.norm(own[:, [4, 7]] - own[:, [1, 4]], axis=-1).sum(axis=-1)
    return Pair(take.name, own * (LEG / float(np.median(leg))), positions, remark, not compared.faults)


def _row(pair: Pair) -> Image.Image:
    frames = [round(share * (len(pair.clip) - 1)) for share in MOMENTS]
    shapes = [figure(_motion(places)) for places in (pair.recording, pair.clip)]
    span = 1.15 * max(_reach(shape, frames) for shape in shapes)
    poses = [_pose(shape, frame, span, azimuth) for shape in shapes for azimuth in (SIDE, FRONT) for frame in frames]
    half = POSE[0] * len(poses) // 2
    row = Image.new("RGB", (2 * half + _GAP, POSE[1] + _CAPTION), (255, 255, 255))
    for number, pose in enumerate(poses):
        row.paste(pose, (POSE[0] * number + (_GAP if number >= len(poses) // 2 else 0), _CAPTION))
    pen = ImageDraw.Draw(row)
    colour = draw.INK if pair.sound else _FAULT
    pen.text((4, 3), caption(shorten(f"{pair.name} ({pair.remark})", 13, row.width - 8)), fill=colour, font=font(13))
    for label, left in (("recording", 4), ("built", half + _GAP + 4)):
        pen.text((left, row.height - 16), label, fill=draw.QUIET, font=font(12))
    return row


def _motion(places: Array) -> Motion:
    """The 22 joints where they are, whatever the lengths of the bones."""
    bones = places - places[:, [max(parent, 0) for parent in SMPL22.parents]]
    turns = np.tile(rot.IDENTITY, (*places.shape[:2], 1))
    return Motion(SMPL22, float(FPS), places[:, 0], turns, translations=bones)


def _reach(shape: Figure, frames: list[int]) -> float:
    """Metres that the poses take up, each around its own middle."""
    around = shape.places[frames] - shape.places[frames].mean(axis=1, keepdims=True)
    return 2 * float(np.abs(around).max()) + 0.2


def _pose(shape: Figure, frame: int, span: float, azimuth: float) -> Image.Image:
    size = (POSE[0] * draw.SMOOTH, POSE[1] * draw.SMOOTH)
    picture = Image.new("RGB", size, draw.PAPER)
    pen = ImageDraw.Draw(picture)
    facing = float(np.arctan2(shape.forward[frame, 0], shape.forward[frame, 2]))
    middle = (shape.places[frame].max(axis=0) + shape.places[frame].min(axis=0)) / 2
    camera = Camera(middle, POSE, span, facing + azimuth, elevation=0.05)
    draw.paint_body(pen, camera, shape, frame)
    return picture.reduce(draw.SMOOTH)
