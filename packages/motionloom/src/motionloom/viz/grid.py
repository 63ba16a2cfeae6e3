"""Many motions on one picture, each a few small poses under its caption: to look over a whole set of prompts."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path
from motionloom.motion import Motion
from motionloom.viz import draw
from motionloom.viz.draw import Camera, Colour
from motionloom.viz.figure import Figure, figure
from motionloom.viz.film import caption, font, shorten, suffixed

POSE = (76, 112)
"""Pixels of one pose."""
CAPTION = 20
"""Height of a caption, pixels."""
GAP = 8
MOST = 400
"""Motions on one picture."""
COLOURS = 255


def draw_grid(
    motions: Sequence[Motion],
    path: str | Path,
    *,
    captions: Sequence[str],
    marks: Sequence[Colour | None] = (),
    poses: int = 6,
    columns: int = 4,
) -> Path:
    """Write a PNG: a tile per motion with its caption and ``poses`` poses over its whole time, side by side.

    Every tile has a camera of its own, at three quarters from the front of the first pose, that holds all of its poses;
    each pose is drawn over the same spot, with the floor's tiles of the world below it. The palette is reduced, so that
    a hundred motions stay below two megabytes.

    Args:
        motions: what to draw, at most 400.
        path: a name that ends in .png.
        captions: a line per motion.
        marks: a colour for the bar before a caption, or None for no bar; empty: none at all.
        poses: poses per motion, 2 to 20.
        columns: tiles side by side, 1 to 12.

    Raises:
        MotionloomError: no motions or too many, counts that do not agree, or a path that cannot be written.
    """
    if not 1 <= len(motions) <= MOST:
        raise MotionloomError(f"a grid shows 1 to {MOST} motions; got {len(motions)}")
    if len(captions) != len(motions) or len(marks) not in (0, len(motions)):
        raise MotionloomError(
            f"{len(motions)} motions need as many captions and marks; got {len(captions)}, {len(marks)}"
        )
    if not (2 <= poses <= 20 and 1 <= columns <= 12):
        raise MotionloomError(f"a grid has 2 to 20 poses and 1 to 12 columns; got {poses} and {columns}")
    target = suffixed(path, (".png",))
    wide, tall = POSE[0] * poses + GAP, POSE[1] + CAPTION + GAP
    columns = min(columns, len(motions))
    sheet = Image.new("RGB", (wide * columns + GAP, tall * -(-len(motions) // columns) + GAP), (255, 255, 255))
    for k, (motion, text) in enumerate(zip(motions, captions, strict=True)):
        tile = _tile(figure(motion), caption(text), poses, marks[k] if marks else None)
        sheet.paste(tile, (GAP + wide * (k % columns), GAP + tall * (k // columns)))
    with atomic_path(target) as temp:
        sheet.quantize(COLOURS, dither=Image.Dither.NONE).save(temp, format="PNG", optimize=True)
    return Path(path)


def _tile(shape: Figure, text: str, poses: int, mark: Colour | None) -> Image.Image:
    tile = Image.new("RGB", (POSE[0] * poses, POSE[1] + CAPTION), draw.PAPER)
    frames = np.linspace(0, len(shape) - 1, poses).round().astype(int)
    camera = _camera(shape, frames)
    for column, frame in enumerate(frames.tolist()):
        here = np.array([shape.path[frame, 0], camera.target[1], shape.path[frame, 2]])
        moved = Camera(here, POSE, camera.span, camera.azimuth, camera.elevation)
        tile.paste(_pose(shape, frame, moved), (POSE[0] * column, CAPTION))
    pen = ImageDraw.Draw(tile)
    if mark is not None:
        pen.rectangle((0, 0, 5, CAPTION - 3), fill=mark)
    clock = f"{shape.seconds:.1f} s"
    room = tile.width - 14 - font(12).getlength(clock)
    pen.text((10, 3), shorten(text, 13, room - 8), fill=draw.INK, font=font(13))
    pen.text((tile.width - 4, 4), clock, fill=draw.QUIET, font=font(12), anchor="ra")
    return tile


def _camera(shape: Figure, frames: np.ndarray) -> Camera:
    """Looks at three quarters at the first pose; its span holds every pose, each over its own place on the floor."""
    around = shape.places[frames] - shape.path[frames, None]
    top = max(float(around[..., 1].max()) + 0.12 * shape.height, 0.6 * shape.height)
    low = min(float(around[..., 1].min()), 0.0)
    azimuth = float(np.arctan2(shape.forward[0, 0], shape.forward[0, 2])) - 0.75
    trial = Camera(np.zeros(3), POSE, 1.0, azimuth)
    wide = 2 * float(np.abs(around @ trial.axes()[0]).max()) + 0.15 * shape.height
    span = max(1.02 * (top - low) + 0.12 * shape.height, wide * POSE[1] / POSE[0])
    return Camera(np.array([0.0, shape.floor + (top + low) / 2, 0.0]), POSE, span, azimuth)


def _pose(shape: Figure, frame: int, camera: Camera) -> Image.Image:
    picture = Image.new("RGB", (POSE[0] * draw.SMOOTH, POSE[1] * draw.SMOOTH), draw.PAPER)
    pen = ImageDraw.Draw(picture)
    draw.paint_floor(pen, camera, shape.floor)
    draw.paint_path(pen, camera, shape.path[: frame + 1], draw.PATH, 0.02)
    draw.paint_shadow(picture, camera, shape, frame)
    draw.paint_body(pen, camera, shape, frame)
    return picture.reduce(draw.SMOOTH)
