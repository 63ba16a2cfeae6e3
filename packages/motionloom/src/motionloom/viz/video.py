"""Pictures and films of motions: a contact sheet or a grid as PNG, a film as MP4 or GIF. No display is needed.

Orange is the person's left, blue the right, grey the middle; a bone that stands on the floor is green.
The floor's tiles are half a metre wide and stay in the world, so a sliding foot shows.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.viz import draw
from motionloom.viz.draw import Camera, Colour
from motionloom.viz.figure import Figure, figure
from motionloom.viz.film import MAX_PIXELS, caption, film_rate, film_size, font, shorten, suffixed, write_film
from motionloom.viz.scene import smoothed

Array = NDArray[np.float64]
CELL = (176, 236)  # one pose on a sheet, pixels
TITLE = 46  # height of a row's caption, pixels
POSE = (76, 112)
"""Pixels of one pose of a grid."""
CAPTION = 20
"""Height of a caption of a grid, pixels."""
GAP = 8
MOST = 400
"""Motions of one grid."""
COLOURS = 255


# --- contact sheets -----------------------------------------------------------------------------------------------


def draw_sheet(
    motions: Sequence[Motion], path: str | Path, *, captions: Sequence[str] | None = None, columns: int = 8
) -> Path:
    """Write a PNG with one row per motion: caption, poses over time in one three-quarter view, and a map of the path.

    Errors: no motions, captions of another count, fewer than two columns, or a path that cannot be written.
    """
    texts = _captions(motions, captions)
    if not 2 <= columns <= 40:
        raise MotionloomError(f"a contact sheet has 2 to 40 columns; got {columns}")
    width, height = CELL[0] * columns + CELL[1], TITLE + CELL[1]
    if len(motions) * width * height > 16 * MAX_PIXELS:
        raise MotionloomError(f"{len(motions)} motions are too many for one contact sheet; draw fewer at a time")
    sheet = Image.new("RGB", (width, height * len(motions)), draw.PAPER)
    for row, (motion, text) in enumerate(zip(motions, texts)):
        sheet.paste(_row(figure(motion), text, columns), (0, row * height))
    with atomic_path(suffixed(path, (".png",))) as temp:
        sheet.save(temp, format="PNG", optimize=False)
    return Path(path)


def _row(shape: Figure, text: str, columns: int) -> Image.Image:
    row = Image.new("RGB", (CELL[0] * columns + CELL[1], TITLE + CELL[1]), draw.PAPER)
    frames = np.unique(np.linspace(0, len(shape) - 1, columns).round().astype(int))
    camera = _fit(shape, frames, CELL)
    for column, frame in enumerate(frames.tolist()):
        target = np.array([shape.path[frame, 0], camera.target[1], shape.path[frame, 2]])
        tile = _scene(shape, frame, Camera(target, CELL, camera.span, camera.azimuth, camera.elevation))
        ImageDraw.Draw(tile).text((8, CELL[1] - 20), f"{frame / shape.fps:.1f} s", fill=draw.QUIET, font=font(13))
        row.paste(tile, (CELL[0] * column, TITLE))
    row.paste(_map(shape, CELL[1]), (CELL[0] * columns, TITLE))
    pen = ImageDraw.Draw(row)
    pen.line([(0, 0), (row.width, 0)], fill=draw.LINE)
    pen.text((10, 7), shorten(text, 18, row.width - 20), fill=draw.INK, font=font(18))
    pen.text((10, 29), _summary(shape), fill=draw.QUIET, font=font(13))
    return row


def _summary(shape: Figure) -> str:
    steps = np.linalg.norm(np.diff(shape.path, axis=0), axis=-1).sum()
    away = np.linalg.norm(shape.path[-1] - shape.path[0])
    turned = np.degrees(shape.heading()[-1])
    way = f"turned {abs(turned):.0f}° {'left' if turned > 0 else 'right'}" if abs(turned) > 10 else "did not turn"
    return (
        f"{shape.seconds:.1f} s at {shape.fps:g} fps   path {steps:.1f} m, ends {away:.1f} m away   {way}   "
        f"(orange: left, blue: right, green: on the floor)"
    )


def _facing(shape: Figure) -> float:
    """Azimuth of the motion's first facing, radians."""
    return float(np.arctan2(shape.forward[0, 0], shape.forward[0, 2]))


def _fit(shape: Figure, frames: NDArray[np.int_], size: tuple[int, int]) -> Camera:
    """A three-quarter camera whose span holds every one of the poses, each centred on its pelvis."""
    around = shape.places[frames] - shape.path[frames, None]
    around = around[:, [bone[1] for bone in shape.bones] or [0]]
    top = max(float(around[..., 1].max()) + 0.14 * shape.height, 0.6 * shape.height)
    low = min(float(around[..., 1].min()), 0.0)
    trial = Camera(np.zeros(3), size, 1.0, _facing(shape) - 0.75)
    wide = 2 * float(np.abs(around @ trial.axes()[0]).max()) + 0.15 * shape.height
    span = max(1.04 * (top - low) * np.cos(trial.elevation) + 0.2 * shape.height, wide * size[1] / size[0])
    middle = shape.floor + (top + low) / 2 - 0.03 * span
    return Camera(np.array([0.0, middle, 0.0]), size, span, trial.azimuth, trial.elevation)


def _map(shape: Figure, side: int) -> Image.Image:
    """The way from above, first facing up: path, facing every half second, start (ring) and end (dot)."""
    big = side * draw.SMOOTH
    picture = Image.new("RGB", (big, big), (255, 255, 255))
    pen = ImageDraw.Draw(picture)
    angle = _facing(shape)
    right, ahead = np.array([-np.cos(angle), np.sin(angle)]), np.array([np.sin(angle), np.cos(angle)])
    plane = np.stack([right, ahead])
    way = (shape.path[:, [0, 2]] - shape.path[0, [0, 2]]) @ plane.T
    middle = (way.min(axis=0) + way.max(axis=0)) / 2
    span = max(float(np.ptp(way, axis=0).max()) * 1.25, 1.6 * shape.height)
    scale = big / span

    def project(points: Array) -> list[tuple[float, float]]:
        return [(big / 2 + x * scale, big / 2 - y * scale) for x, y in (points - middle).tolist()]

    metre = 10.0 ** max(0, int(np.floor(np.log10(max(span / 2, 1.0)))))
    for k in range(int(np.floor((middle - span).min() / metre)), int(np.ceil((middle + span).max() / metre)) + 1):
        (x, _), (_, y) = project(np.array([[k * metre, 0.0], [0.0, k * metre]]))
        pen.line([(x, 0), (x, big)], fill=draw.TILE, width=2)
        pen.line([(0, y), (big, y)], fill=draw.TILE, width=2)
    if len(way) > 1:
        pen.line(project(way), fill=draw.PATH, width=5, joint="curve")
    step = max(1, round(shape.fps * max(0.5, shape.seconds / 16)))
    for frame in range(0, len(way), step):
        nose = way[frame] + 0.11 * span * plane @ shape.forward[frame, [0, 2]]
        pen.line(project(np.stack([way[frame], nose])), fill=draw.mix(draw.PATH, draw.PAPER, 0.35), width=3)
    for point, fill in ((way[0], draw.PAPER), (way[-1], draw.PATH)):
        (x, y) = project(point[None])[0]
        pen.ellipse((x - 11, y - 11, x + 11, y + 11), fill=fill, outline=draw.PATH, width=4)
    small = picture.reduce(draw.SMOOTH)
    pen = ImageDraw.Draw(small)
    pen.text((8, side - 20), f"from above, grid {metre:g} m", fill=draw.QUIET, font=font(13))
    pen.rectangle((0, 0, side - 1, side - 1), outline=draw.LINE)
    return small


# --- films --------------------------------------------------------------------------------------------------------


def draw_video(
    motions: Sequence[Motion],
    path: str | Path,
    *,
    captions: Sequence[str] | None = None,
    size: tuple[int, int] = (960, 540),
    fps: float | None = None,
) -> Path:
    """Film motions as .mp4 (H.264) or .gif, side by side; `overlay.draw_scene` shows people in one scene.

    ``fps`` is the film's frame rate (default: the fastest motion's, halved until at most 60; a GIF at most 25);
    time in the film is time in the motion, and a shorter motion holds its last pose.
    Errors: no motions, captions of another count, sizes below 64 or above 4K, a path that cannot be written.
    """
    texts = _captions(motions, captions)
    rate = film_rate(path, max(m.fps for m in motions), fps)
    panel = film_size(size)
    count = max(1, *(round((len(m) - 1) / m.fps * rate) + 1 for m in motions))

    @cache
    def shapes() -> list[Figure]:
        return [figure(m.resample(rate)) for m in motions]

    def frames(numbers: Sequence[int]) -> Iterator[Image.Image]:
        return _film(shapes(), texts, panel, numbers)

    return write_film(frames, path, panel, rate=rate, count=count)


def _film(
    shapes: Sequence[Figure], texts: Sequence[str], size: tuple[int, int], numbers: Sequence[int]
) -> Iterator[Image.Image]:
    """The film's pictures of these numbers, one after the other."""
    columns = len(shapes) if len(shapes) <= 3 else int(np.ceil(np.sqrt(len(shapes))))
    rows = -(-len(shapes) // columns)
    panel = (size[0] // columns, size[1] // rows)
    cameras = [_follow(shape, panel) for shape in shapes]
    seconds = max(s.seconds for s in shapes)
    for k in numbers:
        picture = Image.new("RGB", size, draw.PAPER)
        for i, shape in enumerate(shapes):
            frame = min(k, len(shape) - 1)
            tile = _scene(shape, frame, cameras[i][frame])
            height = 18 if tile.width > 400 else 13
            title = shorten(texts[i], height, tile.width - 24)
            ImageDraw.Draw(tile).text((12, 10), title, fill=draw.INK, font=font(height))
            picture.paste(tile, (panel[0] * (i % columns), panel[1] * (i // columns)))
        clock = f"{k / shapes[0].fps:.1f} / {seconds:.1f} s"
        pen = ImageDraw.Draw(picture)
        pen.text((size[0] - 12, size[1] - 10), clock, fill=draw.QUIET, font=font(15), anchor="rs")
        yield picture


def _follow(shape: Figure, panel: tuple[int, int]) -> list[Camera]:
    """Cameras, one per frame, that glide after a person."""
    camera = _fit(shape, np.unique(np.linspace(0, len(shape) - 1, 60).round().astype(int)), panel)
    glide = smoothed(shape.path, 0.6 * shape.fps)
    lag = float(np.linalg.norm(glide - shape.path, axis=-1).max())
    span = max(camera.span, 2.0 * lag * panel[1] / panel[0] + 1.1 * shape.height)
    return [Camera(np.array([x, camera.target[1], z]), panel, span, camera.azimuth) for x, _, z in glide]


def _scene(person: Figure, now: int, camera: Camera, *, ahead: bool = True) -> Image.Image:
    """One picture: floor, path, shadow and body; ``ahead``: with the path that is still to come."""
    big = (camera.size[0] * draw.SMOOTH, camera.size[1] * draw.SMOOTH)
    picture = Image.new("RGB", big, draw.PAPER)
    pen = ImageDraw.Draw(picture)
    draw.paint_floor(pen, camera, person.floor)
    if ahead:
        draw.paint_path(pen, camera, person.path[now:], draw.mix(draw.PATH, draw.PAPER, 0.72), 0.014)
    draw.paint_path(pen, camera, person.path[: now + 1], draw.PATH, 0.02)
    draw.paint_shadow(picture, camera, person, now)
    draw.paint_body(pen, camera, person, now)
    return picture.reduce(draw.SMOOTH)


def _captions(motions: Sequence[Motion], captions: Sequence[str] | None) -> list[str]:
    if not motions:
        raise MotionloomError("there is no motion to draw; give at least one")
    if captions is not None and len(captions) != len(motions):
        raise MotionloomError(f"{len(motions)} motions need as many captions; got {len(captions)}")
    return [""] * len(motions) if captions is None else [caption(c) for c in captions]


# --- grids --------------------------------------------------------------------------------------------------------


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
    tile.paste(draw_strip(shape, poses), (0, CAPTION))
    pen = ImageDraw.Draw(tile)
    if mark is not None:
        pen.rectangle((0, 0, 5, CAPTION - 3), fill=mark)
    clock = f"{shape.seconds:.1f} s"
    room = tile.width - 14 - font(12).getlength(clock)
    pen.text((10, 3), shorten(text, 13, room - 8), fill=draw.INK, font=font(13))
    pen.text((tile.width - 4, 4), clock, fill=draw.QUIET, font=font(12), anchor="ra")
    return tile


def draw_strip(shape: Figure, poses: int) -> Image.Image:
    """So many poses over the whole time, side by side, each over the same spot."""
    strip = Image.new("RGB", (POSE[0] * poses, POSE[1]), draw.PAPER)
    frames = np.linspace(0, len(shape) - 1, poses).round().astype(int)
    camera = _grid_camera(shape, frames)
    for column, frame in enumerate(frames.tolist()):
        here = np.array([shape.path[frame, 0], camera.target[1], shape.path[frame, 2]])
        view = Camera(here, POSE, camera.span, camera.azimuth, camera.elevation)
        strip.paste(_scene(shape, frame, view, ahead=False), (POSE[0] * column, 0))
    return strip


def _grid_camera(shape: Figure, frames: np.ndarray) -> Camera:
    """Looks at three quarters at the first pose; its span holds every pose, each over its own place on the floor."""
    around = shape.places[frames] - shape.path[frames, None]
    top = max(float(around[..., 1].max()) + 0.12 * shape.height, 0.6 * shape.height)
    low = min(float(around[..., 1].min()), 0.0)
    azimuth = _facing(shape) - 0.75
    trial = Camera(np.zeros(3), POSE, 1.0, azimuth)
    wide = 2 * float(np.abs(around @ trial.axes()[0]).max()) + 0.15 * shape.height
    span = max(1.02 * (top - low) + 0.12 * shape.height, wide * POSE[1] / POSE[0])
    return Camera(np.array([0.0, shape.floor + (top + low) / 2, 0.0]), POSE, span, azimuth)
