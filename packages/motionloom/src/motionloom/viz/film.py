"""Films from pictures: MP4 through ffmpeg, GIF through Pillow; rates, sizes and lengths that are sane; lettering."""

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageFont

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path

MAX_FPS = 60.0
MAX_GIF_FPS = 25.0
MAX_GIF_FRAMES = 1500
SAMPLED = 9
"""Pictures of a GIF that its palette is from."""
MAX_PIXELS = 4096 * 2304


def film_rate(path: str | Path, fastest: float, fps: float | None) -> float:
    """Frames per second of a film: ``fps``, or the fastest motion's rate halved (or thirded, ...) until few enough."""
    if fps is not None:
        if not (np.isfinite(fps) and 1 <= fps <= 240):
            raise MotionloomError(f"a film has 1 to 240 frames per second; got {fps}")
        return float(fps)
    return max(1.0, fastest / np.ceil(fastest / (MAX_GIF_FPS if _is_gif(path) else MAX_FPS)))


def film_size(size: tuple[int, int]) -> tuple[int, int]:
    """Pixels in even numbers, as H.264 wants them; raises `MotionloomError` below 64 x 64 and above 4096 x 2304."""
    width, height = (int(v) // 2 * 2 for v in size)
    if min(width, height) < 64 or width * height > MAX_PIXELS:
        raise MotionloomError(f"a film is 64x64 to 4096x2304 pixels; got {size[0]}x{size[1]}")
    return width, height


def write_film(
    frames: Callable[[Sequence[int]], Iterator[Image.Image]],
    path: str | Path,
    size: tuple[int, int],
    *,
    rate: float,
    count: int,
) -> Path:
    """Write ``count`` pictures of ``size`` as .mp4 (H.264) or .gif.

    frames: gives the pictures of some numbers, in their order; it is called once the place is sure, for all of them,
    and for a GIF before that for a few from all over the film, of which its palette is.
    """
    if _is_gif(path) and count > MAX_GIF_FRAMES:
        raise MotionloomError(f"a GIF of {count} frames is too long (at most {MAX_GIF_FRAMES}); write an .mp4 instead")
    target = suffixed(path, (".mp4", ".gif"))
    ffmpeg = "" if _is_gif(path) else find_ffmpeg()
    with atomic_path(target) as temp:
        if _is_gif(path):
            _write_gif(frames, temp, rate, count)
        else:
            _write_mp4(frames(range(count)), temp, size, rate, ffmpeg=ffmpeg)
    return Path(path)


def find_ffmpeg() -> str:
    """The program that encodes .mp4: the one that comes with imageio-ffmpeg, or the system's.

    Raises `MotionloomError` where there is neither.
    """
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        program = shutil.which("ffmpeg")
    if program is None:
        raise MotionloomError(
            "there is no ffmpeg to write .mp4 with; pip install 'motionloom[film]' brings one; or write a .gif"
        )
    return program


def _is_gif(path: str | Path) -> bool:
    return Path(path).suffix.lower() == ".gif"


def _write_mp4(frames: Iterator[Image.Image], path: Path, size: tuple[int, int], fps: float, *, ffmpeg: str) -> None:
    """Pipe raw pictures into ffmpeg: an argument list, no shell, an absolute path."""
    source = f"-f rawvideo -pix_fmt rgb24 -s {size[0]}x{size[1]} -r {fps:.6f} -i - -an"
    encoding = "-c:v libx264 -preset veryfast -crf 20 -pix_fmt yuv420p -movflags +faststart -f mp4"
    options = f"-y -loglevel error {source} {encoding}".split()
    command = [ffmpeg, *options, f"file:{path.absolute()}"]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log, start_new_session=True
        )  # in a session of its own: a Ctrl-C is for us, who may be about to finish the film
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


def _write_gif(frames: Callable[[Sequence[int]], Iterator[Image.Image]], path: Path, fps: float, count: int) -> None:
    """One palette for the whole film; frame times are whole hundredths of a second that add up to the true time."""
    chosen = np.unique(np.linspace(0, count - 1, SAMPLED).round().astype(int)).tolist()
    palette = _palette(frames(chosen), len(chosen))
    pictures = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames(range(count))]
    ends = np.round(np.arange(len(pictures) + 1) * 100 / fps).astype(int)
    durations = (np.maximum(np.diff(ends), 2) * 10).tolist()
    pictures[0].save(path, format="GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)


def _palette(pictures: Iterator[Image.Image], number: int) -> Image.Image:
    """The colours of so many pictures, which are thinned: together they have no more points than one of them."""
    step = int(np.ceil(np.sqrt(number)))
    points = [np.asarray(one)[::step, ::step].reshape(-1, 3) for one in pictures]
    together = Image.fromarray(np.concatenate(points)[None])
    return together.quantize(256, Image.Quantize.MAXCOVERAGE)  # thin lines keep their own colours


def suffixed(path: str | Path, suffixes: tuple[str, ...]) -> Path:
    """The path, if its name ends in one of the suffixes; raises `MotionloomError` otherwise."""
    if Path(path).suffix.lower() not in suffixes:
        raise MotionloomError(f"cannot write {str(path)!r}: the name must end in {' or '.join(suffixes)}")
    return Path(path)


def caption(text: str) -> str:
    """A text of any source on one line and of bounded length."""
    return " ".join(str(text)[:2000].split())


def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The built-in font at a size in pixels."""
    if size not in _FONTS:
        _FONTS[size] = ImageFont.load_default(size)
    return _FONTS[size]


_FONTS: dict[int, ImageFont.FreeTypeFont | ImageFont.ImageFont] = {}


def shorten(text: str, size: int, width: float) -> str:
    """The text, cut at the end with an ellipsis where it is wider than ``width`` pixels."""
    letters = font(size)
    if letters.getlength(text) <= width:
        return text
    while text and letters.getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"
