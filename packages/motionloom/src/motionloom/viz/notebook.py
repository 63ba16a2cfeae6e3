"""What a notebook shows of a motion: a poster, and on a click a small player of the skeleton (`player.html`).

It needs neither the studio's viewer nor the network, and nothing of the motion but numbers is in it.
"""

import base64
import html
import io
import json
import zlib
from pathlib import Path

import numpy as np
from PIL import Image

from motionloom.core.motion import Motion
from motionloom.viz.figure import Figure, figure
from motionloom.viz.video import draw_strip

PLAYER = Path(__file__).with_name("player.html")
MAX_BYTES = 100_000
"""Of all that is added to a notebook's file; longer motions are shown at a lower frame rate."""
FRAMES = 600


def framed(motion: Motion, *, height: int = 300) -> str:
    """A motion for a notebook, as HTML of less than `MAX_BYTES`: a frame that may run its player and nothing else.

    height: of the frame, in pixels.
    """
    poster = _poster(figure(motion.thinned(FRAMES)))
    most = min(FRAMES, max(len(motion), 1))
    while True:
        text = PLAYER.read_text(encoding="utf-8").replace("CLIP", json.dumps(_clip(motion.thinned(most), poster)), 1)
        shown = (
            f'<iframe srcdoc="{html.escape(text)}" sandbox="allow-scripts" title="motion" '
            f'style="width: 100%; height: {height}px; border: 0"></iframe>'
        )
        if len(shown) < MAX_BYTES or most == 1:
            return shown
        most = max(most * 2 // 3, 1)


def _poster(shape: Figure) -> str:
    """Six moments, as a PNG in base64."""
    buffer = io.BytesIO()
    draw_strip(shape, poses=6).quantize(128, dither=Image.Dither.NONE).save(buffer, format="PNG", optimize=True)
    return base64.b64encode(buffer.getvalue()).decode()


def _clip(motion: Motion, poster: str) -> dict[str, object]:
    """What the player reads; places are differences from frame to frame in whole numbers of ``unit`` metres."""
    shape = figure(motion)
    unit = max(0.001, float(np.abs(shape.places).max()) / 16_000)
    whole = np.rint(shape.places.reshape(len(shape), -1) / unit).astype(np.int16)
    steps = np.ascontiguousarray(np.diff(whole, axis=0, prepend=np.int16(0)).T.astype("<i2"))
    return {
        "fps": shape.fps,
        "frames": len(shape),
        "unit": unit,
        "places": base64.b64encode(zlib.compress(steps.tobytes(), 9)).decode(),
        "bones": [[above, below, shape.sides[below]] for above, below in shape.bones],
        "root": shape.centre,
        "floor": shape.floor,
        "height": shape.height,
        "tile": 0.3 * shape.height,
        "azimuth": float(np.arctan2(shape.forward[0, 0], shape.forward[0, 2])) - 0.75,
        "poster": poster,
    }
