"""Several people in one scene: a picture of a few moments with a map, or a film. No display is needed.

Everybody has a colour of their own (the left side of a body lighter, the right darker) and an opacity, so that ten
futures of one past can be laid over each other. Metres, +Y up; all motions lie in one world frame.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
from PIL import Image, ImageDraw

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.viz import draw
from motionloom.viz.draw import SMOOTH, Array, Camera, Colour
from motionloom.viz.film import caption as one_line
from motionloom.viz.film import film_rate, film_size, font, shorten, suffixed, write_film
from motionloom.viz.scene import Actor, Shot, Stage, azimuth_of, extent, follow, span_of

PALETTE: tuple[Colour, ...] = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (213, 94, 0),
    (204, 121, 167),
    (86, 180, 233),
    (105, 20, 245),
    (175, 25, 45),
    (175, 215, 135),
    (115, 115, 255),
)
"""The first six are Okabe and Ito's (2008), which people of every colour vision can tell apart."""
PAST: Colour = (98, 105, 120)
TRUTH: Colour = (40, 46, 58)
MAX_ACTORS = 200
PICTURE_FPS = 30.0
PANEL = 380  # height of a panel of a picture, pixels
NARROW, WIDE = 150, 620  # widths of panels
MAX_MOMENTS = 7
FAINT = 0.7
TITLE, LEGEND = 44, 34  # heights, pixels


def tint(number: int) -> Colour:
    """A colour for person ``number``: the ten of `PALETTE`, then their lighter and darker shades."""
    colour, turn = PALETTE[number % len(PALETTE)], number // len(PALETTE) % 5
    towards, amount = ((colour, 0.0), (draw.INK, 0.4), (draw.PAPER, 0.4), (draw.INK, 0.22), (draw.PAPER, 0.2))[turn]
    return draw.mix(colour, towards, amount)


class Look(TypedDict, total=False):
    """How a picture or film looks."""

    caption: str
    size: tuple[int, int]
    """Pixels of a film."""
    fps: float | None
    """Frames per second of a film; None: those of the fastest motion."""


def draw_futures(
    past: Motion,
    futures: Sequence[Motion],
    path: str | Path,
    *,
    truth: Motion | None = None,
    held: Sequence[str] = (),
    lead: float = 2.0,
    **look: Unpack[Look],
) -> Path:
    """Draw many futures of one past, each in a colour of its own and translucent, the past grey, the truth black.

    A .png shows the past as ghosts up to its last pose, the futures at a few moments, and all ways from above; an .mp4
    or .gif plays the end of the past and then all futures at once. The same input gives the same bytes (pictures and
    GIFs).

    Args:
        past: what was seen.
        futures: begin one frame after the past's last, in its world; of its skeleton and rate.
        path: the file.
        truth: what came, as a future.
        held: names of joints to mark on every future.
        lead: seconds of the past that are shown.
        look: caption, size in pixels and frames per second, see `Look`.

    Raises:
        MotionloomError: no futures, another skeleton or rate, unknown joints, more than 200 people, or as `draw_scene`.
    """
    if not futures:
        raise MotionloomError("there is no future to draw; give at least one")
    for motion in (*futures, *([truth] if truth is not None else [])):
        if motion.skeleton != past.skeleton or motion.fps != past.fps:
            raise MotionloomError("every future needs the skeleton and frame rate of the past; retarget or resample it")
    if not (np.isfinite(lead) and lead > 0):
        raise MotionloomError(f"the past shown must last more than 0 seconds; got {lead:g}")
    unknown = sorted(set(held) - set(past.skeleton.names))
    if unknown:
        raise MotionloomError(f"the skeleton has no joint {unknown[0]!r}; name joints of the motion to mark them")
    past = past.frames(max(0, len(past) - max(1, round(lead * past.fps))), len(past))
    marks = tuple(past.skeleton.index(name) for name in dict.fromkeys(held))
    opacity = float(np.clip(1.2 / np.sqrt(len(futures)), 0.2, 0.7))
    actors = [Actor(past, PAST, 0.0, 1.0, "past", False)]
    actors += [Actor(m, tint(i), past.seconds, opacity, f"{i + 1}", marks=marks) for i, m in enumerate(futures)]
    if truth is not None:
        actors.append(Actor(truth, TRUTH, past.seconds, 0.8, "truth"))
    return draw_scene(actors, path, zero=past.seconds - 1 / past.fps, **look)


def draw_scene(
    actors: Sequence[Actor],
    path: str | Path,
    *,
    caption: str = "",
    zero: float = 0.0,
    size: tuple[int, int] = (960, 540),
    fps: float | None = None,
) -> Path:
    """Draw people in one scene: a .png of moments and a map, or an .mp4 or .gif of ``size`` pixels at ``fps``.

    ``zero`` (seconds from the scene's beginning) is called 0 s; what lies before it becomes ghosts in a picture's
    first panel. The camera looks along the least extended horizontal direction, keeps it, and follows so that
    everybody stays in the picture. A film's rate is that of the fastest motion, as for `draw_video`.
    Errors: nobody, more than 200 people, starts below 0, opacities outside (0, 1], a path that cannot be written.
    """
    _check(actors)
    still = Path(path).suffix.lower() == ".png"
    target = suffixed(path, (".png", ".mp4", ".gif"))
    fastest = max(a.motion.fps for a in actors)
    rate = min(PICTURE_FPS, fastest) if still else film_rate(path, fastest, fps)
    title = one_line(caption)
    if still:
        with atomic_path(target) as temporary:
            _picture(Stage(actors, rate), round(zero * rate), title).save(temporary, format="PNG", optimize=False)
        return Path(path)
    panel = film_size(size)
    count = max(round(a.start * rate) + max(1, round(len(a.motion) / a.motion.fps * rate)) for a in actors)

    def film(times: Sequence[int]) -> Iterator[Image.Image]:
        return _film(Stage(actors, rate), panel, zero=zero, title=title, times=times)

    return write_film(film, target, panel, rate=rate, count=count)


def _check(actors: Sequence[Actor]) -> None:
    if not 1 <= len(actors) <= MAX_ACTORS:
        raise MotionloomError(f"a scene has 1 to {MAX_ACTORS} people; got {len(actors)}")
    for actor in actors:
        if not 0 <= actor.start < 1e6 or not 0 < actor.opacity <= 1:
            raise MotionloomError(
                f"a person starts at 0 s or later with an opacity above 0 and up to 1; got {actor.start:g} s and "
                f"{actor.opacity:g}"
            )


# --- painting -----------------------------------------------------------------------------------------------------


def _paint(
    shots: Sequence[Shot], trails: Sequence[tuple[Array, Colour]], camera: Camera, *, floor: float, step: float
) -> Image.Image:
    """One view of the scene: floor, ways, shadows and bodies, far people first."""
    picture = Image.new("RGB", (camera.size[0] * SMOOTH, camera.size[1] * SMOOTH), draw.PAPER)
    pen = ImageDraw.Draw(picture)
    draw.paint_floor(pen, camera, floor, step=step)
    for way, colour in trails:
        draw.paint_path(pen, camera, way, colour, 0.016)
    ordered = sorted(shots, key=lambda s: -float(camera.see(s.shape.places[s.frame, s.shape.centre])[1]))
    for shot in ordered:
        strength = 0.36 * shot.opacity / np.sqrt(max(1, len(shots) / 2))
        draw.paint_shadow(picture, camera, shot.shape, shot.frame, strength=strength)
    for shot in ordered:
        _paint_shot(picture, camera, shot)
    for shot in ordered:
        if shot.opacity < FAINT and shot.actor.opacity < 1:
            _paint_sticks(pen, camera, shot)
        _paint_marks(pen, camera, shot)
    return picture.reduce(SMOOTH)


def _paint_sticks(pen: ImageDraw.ImageDraw, camera: Camera, shot: Shot) -> None:
    """The bones of a translucent body as lines in its full colour, over everything: they stay readable in a crowd."""
    xy, depth, scale = camera.see(shot.shape.places[shot.frame])
    thick = max(2, round(0.009 * shot.shape.height * float(np.median(scale))))
    shades = draw.shades(shot.actor.colour)
    for parent, child in sorted(shot.shape.bones, key=lambda bone: -float(depth[bone[1]])):
        line = [tuple(xy[parent].tolist()), tuple(xy[child].tolist())]
        pen.line(line, fill=shades[shot.shape.sides[child]], width=thick)


def _paint_shot(picture: Image.Image, camera: Camera, shot: Shot) -> None:
    """One body, blended as a whole over what is there, so that its own parts do not shine through each other."""
    xy, _, scale = camera.see(shot.points())
    margin = 0.16 * shot.shape.height * scale.max() + 4
    low = np.clip(np.floor(xy.min(axis=0) - margin), 0, picture.size).astype(int)
    high = np.clip(np.ceil(xy.max(axis=0) + margin), 0, picture.size).astype(int)
    if (high <= low).any():
        return
    box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
    under = picture.crop(box)
    over = under.copy()
    near = replace(camera, corner=(box[0], box[1]))
    pen = ImageDraw.Draw(over)
    draw.paint_body(pen, near, shot.shape, shot.frame, trunk=shot.actor.colour, tinted=True)
    picture.paste(over if shot.opacity == 1 else Image.blend(under, over, shot.opacity), box)


def _paint_marks(pen: ImageDraw.ImageDraw, camera: Camera, shot: Shot) -> None:
    """White dots with a rim of the actor's colour."""
    for joint in shot.actor.marks:
        at, _, scale = camera.see(shot.shape.places[shot.frame, joint])
        reach = max(4.0, 0.018 * shot.shape.height * float(scale))
        (x, y) = at.tolist()
        box = (x - reach, y - reach, x + reach, y + reach)
        pen.ellipse(box, fill=(255, 255, 255), outline=draw.mix(shot.actor.colour, draw.INK, 0.3), width=3)


def _paint_legend(pen: ImageDraw.ImageDraw, actors: Sequence[Actor], top: int, width: int) -> None:
    """Labels behind dots of their colours, on one line; what finds no room is left out."""
    x = 12
    for actor in actors:
        text = shorten(one_line(actor.label), 15, 0.4 * width) if actor.label else ""
        wide = 18 + font(15).getlength(text) + 14
        if not text or x + wide > width:
            continue
        colour = draw.mix(draw.PAPER, actor.colour, min(1.0, 0.4 + actor.opacity))
        pen.ellipse((x, top + 10, x + 13, top + 23), fill=colour, outline=draw.mix(colour, draw.INK, 0.5))
        pen.text((x + 18, top + 7), text, fill=draw.INK, font=font(15))
        x += int(wide)


# --- pictures -----------------------------------------------------------------------------------------------------


def _picture(stage: Stage, zero: int, title: str) -> Image.Image:
    zero = min(max(zero, 0), stage.length - 1)
    azimuth = azimuth_of(stage)
    views = [(zero, _ghosts(stage, zero))] + [(t, stage.shots(t)) for t in _moments(stage, zero)]
    views = [(time, shots) for time, shots in views if shots]
    cameras = _panels(stage, [shots for _, shots in views], azimuth)
    width = sum(c.size[0] for c in cameras) + PANEL
    sheet = Image.new("RGB", (width, TITLE + PANEL + LEGEND), draw.PAPER)
    step = draw.tile_step(cameras[0].span)
    x = 0
    for (time, shots), camera in zip(views, cameras):
        tile = _paint(shots, stage.trails(time), camera, floor=stage.floor, step=step)
        ImageDraw.Draw(tile).text((10, PANEL - 22), _clock(time - zero, stage.rate), fill=draw.QUIET, font=font(14))
        sheet.paste(tile, (x, TITLE))
        x += camera.size[0]
        ImageDraw.Draw(sheet).line([(x, TITLE), (x, TITLE + PANEL)], fill=(255, 255, 255), width=2)
    sheet.paste(_map(stage, azimuth), (x, TITLE))
    pen = ImageDraw.Draw(sheet)
    _paint_legend(pen, [a for a, _, _ in stage.cast], TITLE + PANEL, width)
    pen.text((12, 12), shorten(title, 18, width - 24), fill=draw.INK, font=font(18))
    return sheet


def _clock(frames: int, rate: float) -> str:
    return f"{frames / rate:+.1f} s".replace("+0.0", "0.0").replace("-0.0", "0.0")


def _ghosts(stage: Stage, zero: int) -> list[Shot]:
    """Everybody at frame ``zero``, and fainter the longer ago at a few frames before it."""
    steps = min(4, int(zero / (0.4 * stage.rate)))
    shots = []
    for k in range(steps, 0, -1):
        then = stage.shots(zero - round(k * zero / steps))
        shots += [replace(s, opacity=0.16 + 0.36 * s.opacity * (1 - k / (steps + 1))) for s in then]
    return shots + stage.shots(zero)


def _moments(stage: Stage, zero: int) -> list[int]:
    """Frames after ``zero``, as many half seconds (or seconds, ...) apart as give a few, and the last one."""
    last = stage.length - 1
    step = 0.5
    while (last - zero) / stage.rate / step > MAX_MOMENTS + 0.3:
        step *= 2
    times = [zero + round(k * step * stage.rate) for k in range(1, int((last - zero) / stage.rate / step) + 1)]
    if last > zero and (not times or last - times[-1] > 0.3 * step * stage.rate):
        times.append(last)
    return times


def _panels(stage: Stage, views: Sequence[Sequence[Shot]], azimuth: float) -> list[Camera]:
    """A camera per panel, all of one scale, as wide as its people need."""
    axes = Camera(np.zeros(3), (PANEL, PANEL), 1.0, azimuth).axes()
    extents = [extent(shots, axes) for shots in views]
    margin = 0.1 * stage.height
    fill = ((WIDE - 20) / PANEL, 1 - 2 * 14 / PANEL)
    spans = [span_of(shots, axes, np.mean(e, axis=0), fill=fill, margin=margin) for shots, e in zip(views, extents)]
    span = max(1.2 * stage.height, *spans)
    cameras = []
    for low, high in extents:
        middle = (low + high) / 2
        wide = high[0] - low[0] + 2 * margin + 0.1 * span
        near = 1 / (1 - min(0.5, (high[2] - middle[2]) / (3.2 * span)))
        size = (int(np.clip(np.ceil(wide * near * PANEL / span) + 16, NARROW, WIDE)), PANEL)
        cameras.append(Camera(middle @ axes, size, span, azimuth))
    return cameras


def _map(stage: Stage, azimuth: float) -> Image.Image:
    """Everybody's way from above, turned as the pictures are: start (ring), end (dot) and last facing."""
    big = PANEL * SMOOTH
    picture = Image.new("RGB", (big, big), (255, 255, 255))
    pen = ImageDraw.Draw(picture)
    plane = np.array([[np.cos(azimuth), -np.sin(azimuth)], [-np.sin(azimuth), -np.cos(azimuth)]])
    ways = [shape.path[:, [0, 2]] @ plane.T for _, shape, _ in stage.cast]
    low, high = (f(np.concatenate(ways), axis=0) for f in (np.min, np.max))
    middle = (low + high) / 2
    span = max(float((high - low).max()) * 1.3, 1.2 * stage.height)
    metre = 10.0 ** max(0, int(np.floor(np.log10(max(span / 2, 1.0)))))
    edges = [np.arange(np.ceil((m - span / 2) / metre), (m + span / 2) / metre) * metre for m in middle]

    def project(points: Array) -> list[tuple[float, float]]:
        flat = (points - middle) * (big / span) * [1, -1] + big / 2
        return [(x, y) for x, y in flat.tolist()]

    for k, lines in enumerate(edges):
        for at in lines.tolist():
            ends = np.array([[at, at], [at, at]])
            ends[:, 1 - k] = middle[1 - k] + np.array([-span, span]) / 2
            pen.line(project(ends), fill=draw.TILE, width=2)
    for (actor, shape, _), way in zip(stage.cast, ways):
        colour = draw.mix(draw.PAPER, actor.colour, 0.3 + 0.7 * actor.opacity)
        if len(way) > 1:
            pen.line(project(way), fill=colour, width=5, joint="curve")
        nose = way[-1] + 0.07 * span * plane @ shape.forward[-1, [0, 2]]
        if actor.stays:
            pen.line(project(np.stack([way[-1], nose])), fill=colour, width=3)
        (x, y), (u, v) = project(way[[0, -1]])
        if actor.start == 0:
            pen.ellipse((x - 9, y - 9, x + 9, y + 9), fill=(255, 255, 255), outline=colour, width=4)
        pen.ellipse((u - 9, v - 9, u + 9, v + 9), fill=colour)
    small = picture.reduce(SMOOTH)
    pen = ImageDraw.Draw(small)
    pen.text((8, PANEL - 20), f"from above, grid {metre:g} m", fill=draw.QUIET, font=font(13))
    pen.rectangle((0, 0, PANEL - 1, PANEL - 1), outline=draw.LINE)
    return small


# --- films --------------------------------------------------------------------------------------------------------


def _film(
    stage: Stage, size: tuple[int, int], *, zero: float, title: str, times: Sequence[int]
) -> Iterator[Image.Image]:
    """The film's pictures at the given frames, one after the other."""
    cameras = follow(stage, times[-1] + 1, size)
    step = draw.tile_step(max(c.span for c in cameras))
    actors = [actor for actor, _, _ in stage.cast]
    title = shorten(title, 18, size[0] - 24)
    for time in times:
        picture = _paint(stage.shots(time), stage.trails(time), cameras[time], floor=stage.floor, step=step)
        pen = ImageDraw.Draw(picture)
        if size[1] > 4 * LEGEND:
            _paint_legend(pen, actors, size[1] - LEGEND, size[0] - 90)
        pen.text((12, 10), title, fill=draw.INK, font=font(18))
        clock = _clock(time - round(zero * stage.rate), stage.rate)
        pen.text((size[0] - 12, size[1] - 10), clock, fill=draw.QUIET, font=font(15), anchor="rs")
        yield picture
