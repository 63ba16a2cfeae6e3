"""Films from pictures: MP4 through ffmpeg, GIF through Pillow; rates, sizes and lengths that are sane; lettering."""

import itertools
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageFont

from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path

MAX_FPS = 60.0
MAX_GIF_FPS = 25.0
MAX_GIF_FRAMES = 1500
MAX_PIXELS = 4096 * 2304


def film_rate(path: str | Path, fastest: float, fps: float | None) -> float:
    """Frames per second of a film: ``fps``, or the fastest motion's rate halved (or thirded, ...) until few enough."""
    if fps is not None:
        if not (np.isfinite(fps) and 1 <= fps <= 240):
            raise MotionloomError(f"a film has 1 to 240 frames per second; got {fps}")
        return float(fps)
    return max(1.0, fastest / np.ceil(fastest / (MAX_GIF_FPS if _is_gif(path) else MAX_FPS)))


def film_size(size: tuple[int, int]) -> tuple[int, int]:
    """Pixels made even, as H.264 wants them; raises `MotionloomError` below 64 x 64 and above 4096 x 2304."""
    width, height = (int(v) // 2 * 2 for v in size)
    if min(width, height) < 64 or width * height > MAX_PIXELS:
        raise MotionloomError(f"a film is 64x64 to 4096x2304 pixels; got {size[0]}x{size[1]}")
    return width, height


def write_film(
    frames: Callable[[], Iterator[Image.Image]],
    path: str | Path,
    size: tuple[int, int],
    *,
    rate: float,
    count: int,
    sample: Callable[[], Image.Image] | None = None,
) -> Path:
    """Write ``count`` pictures of ``size`` as .mp4 (H.264) or .gif; ``frames`` is asked once the place is sure.

    ``sample`` gives a picture with all colours of the film, for a GIF's palette (None: the first picture has them).
    """
    if _is_gif(path) and count > MAX_GIF_FRAMES:
        raise MotionloomError(f"a GIF of {count} frames is too long (at most {MAX_GIF_FRAMES}); write an .mp4 instead")
    target = suffixed(path, (".mp4", ".gif"))
    ffmpeg = "" if _is_gif(path) else find_ffmpeg()
    with atomic_path(target) as temp:
        if _is_gif(path):
            _write_gif(frames(), temp, rate, sample() if sample else None)
        else:
            _write_mp4(frames(), temp, size, rate, ffmpeg=ffmpeg)
    return Path(path)


def find_ffmpeg() -> str:
    """The program that encodes .mp4: the one that comes with imageio-ffmpeg, or the system's.

    Raises `MotionloomError` where there is neither.
    """
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        found = shutil.which("ffmpeg")
    if found is None:
        raise MotionloomError(
            "there is no ffmpeg to write .mp4 with; pip install 'motionloom[film]' brings one; or write a .gif"
        )
    return found


def _is_gif(path: str | Path) -> bool:
    return Path(path).suffix.lower() == ".gif"


def _write_mp4(frames: Iterator[Image.Image], path: Path, size: tuple[int, int], fps: float, *, ffmpeg: str) -> None:
    """Pipe raw pictures into ffmpeg: an argument list, no shell, an absolute path."""
    read = f"-f rawvideo -pix_fmt rgb24 -s {size[0]}x{size[1]} -r {fps:.6f} -i - -an"
    written = "-c:v libx264 -preset veryfast -crf 20 -pix_fmt yuv420p -movflags +faststart -f mp4"
    options = f"-y -loglevel error {read} {written}".split()
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


def _write_gif(frames: Iterator[Image.Image], path: Path, fps: float, sample: Image.Image | None) -> None:
    """One palette for the whole film; frame times are whole hundredths of a second that add up to the true time."""
    first = next(frames)
    palette = first.quantize(128) if sample is None else sample.quantize(256)
    pictures = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in itertools.chain([first], frames)]
    ends = np.round(np.arange(len(pictures) + 1) * 100 / fps).astype(int)
    durations = (np.maximum(np.diff(ends), 2) * 10).tolist()
    pictures[0].save(path, format="GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)


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
