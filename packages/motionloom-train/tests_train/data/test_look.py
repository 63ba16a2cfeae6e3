"""`data look`: two clips of each source on one page, the recording beside what was made of it."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motionloom.core.errors import MotionloomError
from motionloom_train.data.build import build
from motionloom_train.data.gate import Compared
from motionloom_train.data.look import choose, draw_look
from tests_train.data.test_gate import find


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("look")
    build([folder], folder / "set", workers=1, mixed=0, find=find, progress=lambda line: None)
    return folder / "set"


def test_the_page_has_a_row_for_each_clip_with_both_bodies_on_it(built: Path, tmp_path: Path) -> None:
    """Two of the folded source, refused ones too, and the one of the other; folded bodies differ, sound ones do not."""
    lines: list[str] = []
    draw_look(built, [built.parent], tmp_path / "page.png", find=find, progress=lines.append)
    assert {line.split(": ")[1] for line in lines} == {"bent_1", "bent_2", "sound"}
    page = Image.open(tmp_path / "page.png").convert("L")
    rows = page.height // 3
    differ = []
    for k in range(3):
        left, right = (
            np.asarray(page.crop((x, k * rows + 24, x + 540, (k + 1) * rows - 28))) for x in (0, page.width - 552)
        )
        assert len(np.unique(left)) > 10  # somebody is drawn
        differ.append(float((left != right).mean()))
    assert min(differ[:2]) > 2 * differ[2]


def test_the_worst_comes_first_and_then_a_typical_one() -> None:
    compared = {
        f"clip{k}": Compared("cmu", {"all": (1.0, float(k))}, {}, {}, ("trunk off",) if k == 3 else ())
        for k in range(9)
    }
    assert choose(compared, 1) == ["clip3"]
    assert choose(compared, 2) == ["clip3", "clip5"]
    assert len(choose(compared, 20)) == 9


def test_what_cannot_be_drawn_is_said(built: Path, tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no set whose bodies were compared"):
        draw_look(tmp_path, [tmp_path], tmp_path / "page.png", find=find)
    with pytest.raises(MotionloomError, match="none of the recordings"):
        draw_look(built, [tmp_path], tmp_path / "page.png", find=lambda folder, captions=None: [])
    with pytest.raises(MotionloomError, match="1 to 20 clips"):
        draw_look(built, [tmp_path], tmp_path / "page.png", each=0, find=find)
    assert not list(tmp_path.iterdir())
