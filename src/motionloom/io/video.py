"""Pictures and films of motions: a contact sheet as PNG, a film as MP4 or GIF. No display is needed.

Orange is the person's left, blue the right, grey the middle; a bone that stands on the floor is green.
The floor's tiles are half a metre wide and stay in the world, so a sliding foot shows.
"""

import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from motionloom.errors import MotionloomError
from motionloom.io import draw
from motionloom.io.atomic import atomic_path
from motionloom.io.draw import Camera
from motionloom.io.figure import Figure, figure
from motionloom.motion import Motion

Array = NDArray[np.float64]
CELL = (176, 236)  # one pose on a sheet, pixels
TITLE = 46  # height of a row's caption, pixels
MAX_FPS = 60.0
MAX_GIF_FRAMES = 1500
MAX_PIXELS = 4096 * 2304


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
    with atomic_path(_checked(path, (".png",))) as temp:
        sheet.save(temp, format="PNG", optimize=False)
    return Path(path)


def _row(shape: Figure, text: str, columns: int) -> Image.Image:
    row = Image.new("RGB", (CELL[0] * columns + CELL[1], TITLE + CELL[1]), draw.PAPER)
    frames = np.unique(np.linspace(0, len(shape) - 1, columns).round().astype(int))
    camera = _fit(shape, frames, CELL)
    for column, frame in enumerate(frames.tolist()):
        target = np.array([shape.path[frame, 0], camera.target[1], shape.path[frame, 2]])
        tile = _scene([shape], [frame], Camera(target, CELL, camera.span, camera.azimuth, camera.elevation))
        ImageDraw.Draw(tile).text((8, CELL[1] - 20), f"{frame / shape.fps:.1f} s", fill=draw.QUIET, font=_font(13))
        row.paste(tile, (CELL[0] * column, TITLE))
    row.paste(_map(shape, CELL[1]), (CELL[0] * columns, TITLE))
    pen = ImageDraw.Draw(row)
    pen.line([(0, 0), (row.width, 0)], fill=draw.LINE)
    pen.text((10, 7), _shorten(text, 18, row.width - 20), fill=draw.INK, font=_font(18))
    pen.text((10, 29), _summary(shape), fill=draw.QUIET, font=_font(13))
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

    def put(points: Array) -> list[tuple[float, float]]:
        return [(big / 2 + x * scale, big / 2 - y * scale) for x, y in (points - middle).tolist()]

    metre = 10.0 ** max(0, int(np.floor(np.log10(max(span / 2, 1.0)))))
    for k in range(int(np.floor((middle - span).min() / metre)), int(np.ceil((middle + span).max() / metre)) + 1):
        (x, _), (_, y) = put(np.array([[k * metre, 0.0], [0.0, k * metre]]))
        pen.line([(x, 0), (x, big)], fill=draw.TILE, width=2)
        pen.line([(0, y), (big, y)], fill=draw.TILE, width=2)
    if len(way) > 1:
        pen.line(put(way), fill=draw.PATH, width=5, joint="curve")
    step = max(1, round(shape.fps * max(0.5, shape.seconds / 16)))
    for frame in range(0, len(way), step):
        nose = way[frame] + 0.11 * span * plane @ shape.forward[frame, [0, 2]]
        pen.line(put(np.stack([way[frame], nose])), fill=draw.mix(draw.PATH, draw.PAPER, 0.35), width=3)
    for point, fill in ((way[0], draw.PAPER), (way[-1], draw.PATH)):
        (x, y) = put(point[None])[0]
        pen.ellipse((x - 11, y - 11, x + 11, y + 11), fill=fill, outline=draw.PATH, width=4)
    small = picture.reduce(draw.SMOOTH)
    pen = ImageDraw.Draw(small)
    pen.text((8, side - 20), f"from above, grid {metre:g} m", fill=draw.QUIET, font=_font(13))
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
    together: bool = False,
) -> Path:
    """Film motions as .mp4 (H.264) or .gif, side by side, or in one scene where ``together`` is set.

    ``fps`` is the film's frame rate (default: the fastest motion's, halved until at most 60; a GIF at most 25);
    time in the film is time in the motion, and a shorter motion holds its last pose.
    Errors: no motions, captions of another count, sizes below 64 or above 4K, a path that cannot be written.
    """
    texts = _captions(motions, captions)
    gif = Path(path).suffix.lower() == ".gif"
    rate = _film_rate(motions, fps, 25.0 if gif and fps is None else MAX_FPS)
    width, height = (int(v) // 2 * 2 for v in size)
    if min(width, height) < 64 or width * height > MAX_PIXELS:
        raise MotionloomError(f"a film is 64x64 to 4096x2304 pixels; got {size[0]}x{size[1]}")
    count = max(1, *(round((len(m) - 1) / m.fps * rate) + 1 for m in motions))
    if gif and count > MAX_GIF_FRAMES:
        raise MotionloomError(f"a GIF of {count} frames is too long (at most {MAX_GIF_FRAMES}); write an .mp4 instead")
    with atomic_path(_checked(path, (".mp4", ".gif"))) as temp:
        shapes = [figure(m.resample(rate)) for m in motions]
        frames = _film(shapes, texts, (width, height), count, together)
        if gif:
            _write_gif(frames, temp, rate)
        else:
            _write_mp4(frames, temp, (width, height), rate)
    return Path(path)


def _film_rate(motions: Sequence[Motion], fps: float | None, limit: float) -> float:
    if fps is not None:
        if not (np.isfinite(fps) and 1 <= fps <= 240):
            raise MotionloomError(f"a film has 1 to 240 frames per second; got {fps}")
        return float(fps)
    rate = max(m.fps for m in motions)
    return max(1.0, rate / np.ceil(rate / limit))


def _film(
    shapes: Sequence[Figure], texts: Sequence[str], size: tuple[int, int], count: int, together: bool
) -> Iterator[Image.Image]:
    """The film's pictures, one after the other."""
    scenes = [list(shapes)] if together else [[s] for s in shapes]
    titles = ["   |   ".join(t for t in texts if t)] if together else list(texts)
    columns = len(scenes) if len(scenes) <= 3 else int(np.ceil(np.sqrt(len(scenes))))
    rows = -(-len(scenes) // columns)
    panel = (size[0] // columns, size[1] // rows)
    cameras = [_follow(scene, panel, count) for scene in scenes]
    seconds = max(s.seconds for s in shapes)
    for k in range(count):
        picture = Image.new("RGB", size, draw.PAPER)
        for i, scene in enumerate(scenes):
            frames = [min(k, len(s) - 1) for s in scene]
            tile = _scene(scene, frames, cameras[i][min(k, len(cameras[i]) - 1)])
            _title(tile, titles[i])
            picture.paste(tile, (panel[0] * (i % columns), panel[1] * (i // columns)))
        clock = f"{k / scenes[0][0].fps:.1f} / {seconds:.1f} s"
        pen = ImageDraw.Draw(picture)
        pen.text((size[0] - 12, size[1] - 10), clock, fill=draw.QUIET, font=_font(15), anchor="rs")
        yield picture


def _title(tile: Image.Image, text: str) -> None:
    big = 18 if tile.width > 400 else 13
    if text:
        line = _shorten(text, big, tile.width - 24)
        ImageDraw.Draw(tile).text((12, 10), line, fill=draw.INK, font=_font(big))


def _follow(scene: Sequence[Figure], panel: tuple[int, int], count: int) -> list[Camera]:
    """Cameras, one per frame, that glide after the middle of the people."""
    cameras = [_fit(s, np.unique(np.linspace(0, len(s) - 1, 60).round().astype(int)), panel) for s in scene]
    paths = np.stack([s.path[np.minimum(np.arange(count), len(s) - 1)] for s in scene])
    middle = paths.mean(axis=0)
    apart = float(np.linalg.norm(paths - middle, axis=-1).max())
    smooth = _smooth(middle, 0.6 * scene[0].fps)
    lag = float(np.linalg.norm(smooth - middle, axis=-1).max())
    span = max(max(c.span for c in cameras), 2.0 * (apart + lag) * panel[1] / panel[0] + 1.1 * scene[0].height)
    azimuth = cameras[0].azimuth
    height = float(np.mean([c.target[1] for c in cameras]))
    return [Camera(np.array([x, height, z]), panel, span, azimuth) for x, _, z in smooth]


def _smooth(values: Array, width: float) -> Array:
    """Gaussian smoothing along axis 0; the ends are held."""
    reach = int(np.ceil(2.5 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(width, 1e-6)) ** 2)
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, kernel / kernel.sum(), mode="valid") for column in padded.T], axis=-1)


def _scene(people: Sequence[Figure], frames: Sequence[int], camera: Camera) -> Image.Image:
    """One picture: floor, paths, shadows and bodies, far people first."""
    big = (camera.size[0] * draw.SMOOTH, camera.size[1] * draw.SMOOTH)
    picture = Image.new("RGB", big, draw.PAPER)
    pen = ImageDraw.Draw(picture)
    draw.paint_floor(pen, camera, people[0].floor)
    order = sorted(range(len(people)), key=lambda i: -float(camera.see(people[i].path[frames[i]])[1]))
    for i in order:
        path, now = people[i].path, frames[i]
        draw.paint_path(pen, camera, path[now:], draw.mix(draw.PATH, draw.PAPER, 0.72), 0.014)
        draw.paint_path(pen, camera, path[: now + 1], draw.PATH, 0.02)
        draw.paint_shadow(picture, camera, people[i], now)
    for i in order:
        draw.paint_body(pen, camera, people[i], frames[i], trunk=draw.TRUNKS[i % len(draw.TRUNKS)])
    return picture.reduce(draw.SMOOTH)


# --- writing ------------------------------------------------------------------------------------------------------


def _write_mp4(frames: Iterator[Image.Image], path: Path, size: tuple[int, int], fps: float) -> None:
    """Pipe raw pictures into ffmpeg: an argument list, no shell, an absolute path."""
    import imageio_ffmpeg

    command = [
        imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:.6f}", "-i", "-", "-an", "-c:v", "libx264", "-preset", "veryfast",
        "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", f"file:{path.absolute()}",
    ]  # fmt: skip
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log)
        assert process.stdin is not None
        try:
            for frame in frames:
                process.stdin.write(frame.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # ffmpeg has stopped; its exit code and last words say why
        except BaseException:
            process.kill()
            raise
        finally:
            code = process.wait()
        if code != 0:
            log.seek(0)
            words = log.read().decode(errors="replace").strip().splitlines() or ["no message"]
            raise MotionloomError(f"ffmpeg could not write the film ({words[-1][:200]}); try another path or size")


def _write_gif(frames: Iterator[Image.Image], path: Path, fps: float) -> None:
    """One palette for the whole film; frame times are whole hundredths of a second that add up to the true time."""
    first = next(frames)
    palette = first.quantize(128, dither=Image.Dither.NONE)
    pictures = [palette, *(f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames)]
    ends = np.round(np.arange(len(pictures) + 1) * 100 / fps).astype(int)
    durations = (np.maximum(np.diff(ends), 2) * 10).tolist()
    pictures[0].save(path, format="GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)


def _checked(path: str | Path, suffixes: tuple[str, ...]) -> Path:
    if Path(path).suffix.lower() not in suffixes:
        raise MotionloomError(f"cannot write {str(path)!r}: the name must end in {' or '.join(suffixes)}")
    return Path(path)


def _captions(motions: Sequence[Motion], captions: Sequence[str] | None) -> list[str]:
    if not motions:
        raise MotionloomError("there is no motion to draw; give at least one")
    if captions is not None and len(captions) != len(motions):
        raise MotionloomError(f"{len(motions)} motions need as many captions; got {len(captions)}")
    return [" ".join(str(c)[:2000].split()) for c in captions] if captions is not None else [""] * len(motions)


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    if size not in _FONTS:
        _FONTS[size] = ImageFont.load_default(size)
    return _FONTS[size]


_FONTS: dict[int, ImageFont.FreeTypeFont | ImageFont.ImageFont] = {}


def _shorten(text: str, size: int, width: float) -> str:
    """The text, cut at the end with an ellipsis where it is wider than ``width`` pixels."""
    font = _font(size)
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"
