"""Many motions on one picture: a tile for each, marks that keep their colour, a small file."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.viz import draw
from motionloom.viz.video import CAPTION, GAP, POSE, draw_grid
from tests.kinematics.people import FPS, standing, walking

GREEN, RED = (24, 178, 107), (208, 62, 62)


def test_a_grid_has_a_tile_per_motion_and_marks_in_their_colours(tmp_path: Path) -> None:
    motions = [motion_from_positions(p, FPS) for p in (standing(2), walking(1.2, 2), standing(1))]
    path = draw_grid(
        motions, tmp_path / "g.png", captions=["a", "b", "c"], marks=[GREEN, RED, None], poses=3, columns=2
    )
    with Image.open(path) as picture:
        assert picture.size == (2 * (3 * POSE[0] + GAP) + GAP, 2 * (POSE[1] + CAPTION + GAP) + GAP)
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    wide, tall = POSE[0] * 3 + GAP, POSE[1] + CAPTION + GAP
    for k, colour in enumerate((GREEN, RED, draw.PAPER)):
        at = pixels[GAP + tall * (k // 2) + 8, GAP + wide * (k % 2) + 2]
        assert np.abs(at - colour).max() <= 12
    body = pixels[GAP + CAPTION : GAP + CAPTION + POSE[1], GAP : GAP + POSE[0]]
    assert (np.abs(body - draw.LEFT).max(axis=-1) < 20).sum() > 50  # the left side of somebody who stands there
    assert path.stat().st_size < 100_000


@pytest.mark.parametrize(
    ("count", "captions", "poses", "name"),
    [(0, 0, 6, "g.png"), (2, 1, 6, "g.png"), (1, 1, 1, "g.png"), (1, 1, 6, "g.jpg")],
)
def test_a_grid_that_cannot_be_is_one_sentence(
    tmp_path: Path, count: int, captions: int, poses: int, name: str
) -> None:
    motions = [motion_from_positions(standing(1), FPS)] * count
    with pytest.raises(MotionloomError):
        draw_grid(motions, tmp_path / name, captions=["x"] * captions, poses=poses)
    assert not list(tmp_path.iterdir())
