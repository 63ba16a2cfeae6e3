"""Which ffmpeg writes a film, and what is said where there is none."""

import sys
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from motionloom.viz import film


def test_the_systems_ffmpeg_is_taken_where_no_other_came_along(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert film.find_ffmpeg() == str(program)


def test_without_any_ffmpeg_a_film_is_refused_before_a_picture_is_drawn(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MotionloomError, match=r"motionloom\[film\]"):
        film.write_film(lambda: pytest.fail("drawn"), tmp_path / "a.mp4", (64, 64), rate=20, count=1)
    assert not list(tmp_path.iterdir())
