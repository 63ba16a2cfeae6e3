"""What a notebook shows of a motion."""

import base64
import html
import io
import json
import re
import zlib

import numpy as np
import pytest
from PIL import Image

from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.viz.notebook import MAX_BYTES
from tests.viz.test_video import standing


def inside(shown: str) -> str:
    """The page within the frame."""
    [frame] = re.findall(r"<iframe ([^>]*)>", shown)
    attributes = dict(re.findall(r'([a-z]+)="([^"]*)"', frame))
    assert attributes["sandbox"] == "allow-scripts"
    assert shown.count("<") == 2, "nothing of the page is markup of the notebook"
    return html.unescape(attributes["srcdoc"])


def clip_of(page: str) -> dict:
    [text] = re.findall(r'<script type="application/json" id="clip">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def places(clip: dict) -> np.ndarray:
    """(frames, joints, 3), read as the player does."""
    steps = np.frombuffer(zlib.decompress(base64.b64decode(clip["places"])), "<i2").reshape(-1, clip["frames"])
    return np.cumsum(steps, axis=1, dtype=np.int16).T.reshape(clip["frames"], -1, 3) * clip["unit"]


def wild(frames: int) -> Motion:
    """Motion that no compression makes small, far from the origin."""
    random = np.random.default_rng(0)
    root = np.cumsum(random.normal(size=(frames, 3)), axis=0)
    return Motion(SMPL22, 60.0, root, rotvec_to_quat(random.normal(scale=0.5, size=(frames, 22, 3))))


@pytest.mark.parametrize("motion", [standing(40, speed=1.0), standing(1), wild(200)], ids=["walk", "pose", "wild"])
def test_the_player_has_the_places_of_the_motion(motion: Motion) -> None:
    clip = clip_of(inside(motion._repr_html_()))
    assert (clip["frames"], clip["fps"]) == (len(motion), motion.fps)
    assert np.abs(places(clip) - motion.positions()).max() <= 0.51 * clip["unit"]
    with Image.open(io.BytesIO(base64.b64decode(clip["poster"]))) as poster:
        assert len(poster.convert("RGB").getcolors(1 << 20) or ()) > 10


@pytest.mark.parametrize("frames", [1, 300, 20_000])
def test_it_is_small_and_as_long_as_the_motion(frames: int) -> None:
    motion = wild(frames)
    shown = motion._repr_html_()
    assert len(shown.encode()) < MAX_BYTES == 100_000
    clip = clip_of(inside(shown))
    assert clip["frames"] / clip["fps"] == pytest.approx(motion.seconds, rel=0.02, abs=0.02)


def test_names_of_joints_are_not_in_it() -> None:
    turns = np.tile([1.0, 0, 0, 0], (2, 2, 1))
    lamp = Motion(Skeleton(("</script><b>lamp", "arm"), (-1, 0), np.eye(2, 3)), 20.0, np.zeros((2, 3)), turns)
    assert "lamp" not in inside(lamp._repr_html_())
