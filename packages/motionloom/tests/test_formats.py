"""The registry of file formats: what help, errors and documents name is what it holds, and users add their own."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from motionloom import cli, formats, io
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22

FORMATS = sorted(formats.FORMATS)


def standing() -> Motion:
    turns = np.zeros((4, 22, 4))
    turns[..., 0] = 1.0
    return Motion(SMPL22, 20.0, np.tile([0.0, 1.0, 0.0], (4, 1)), turns)


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "FORMATS", dict(formats.FORMATS))


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_function_that_a_format_names_is_there(suffix: str) -> None:
    one = formats.FORMATS[suffix]
    for place in filter(None, (one.reader, one.people, one.writer, one.needs)):
        module, _, name = str(place).partition(":")
        __import__(module)
        assert callable(getattr(sys.modules[module], name))


def test_the_page_about_files_lists_every_format() -> None:
    page = next(p for p in Path(__file__).parents if (p / "docs").is_dir()) / "docs" / "files.md"
    read, written = set(), set()
    for line in re.findall(r"^\| `\..*$", page.read_text(), re.MULTILINE):
        suffixes, reads, writes = line.split("|")[1:4]
        found = set(re.findall(r"`(\.\w+)`", suffixes.split(" with ")[0]))
        read |= found if reads.strip() != "no" else set()
        written |= found if writes.strip() != "no" and "character" not in writes else set()
    assert read == set(formats.readable())
    assert written == set(formats.writable())


def test_help_names_the_formats(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        cli.main(["export", "--help"])
    shown = capsys.readouterr().out
    assert all(suffix in shown for suffix in FORMATS)


def test_an_unknown_suffix_is_refused_with_those_there_are(tmp_path: Path) -> None:
    (tmp_path / "walk.doc").write_text("")
    with pytest.raises(MotionloomError, match=re.escape(", ".join(formats.readable()))):
        io.load(tmp_path / "walk.doc")
    with pytest.raises(MotionloomError, match=re.escape(", ".join(formats.writable()))):
        io.save(standing(), tmp_path / "out.doc")


@pytest.mark.usefixtures("registered")
def test_a_format_of_a_user_is_read_and_written(tmp_path: Path) -> None:
    def write(motion: Motion, path: Path) -> Path:
        path.write_text(repr(motion.root.tolist()))
        return path

    def read(path: Path) -> Motion:
        return standing()

    formats.register(formats.Format(".roots", read, writer=write, single=True))
    place = io.save(standing(), tmp_path / "a.roots")
    assert place.read_text().startswith("[[0.0, 1.0, 0.0]")
    assert io.load(place).fps == 20.0
    assert io.load(place, fps=30.0).fps == 30.0
    assert io.load(place, unit=0.01).root[0, 1] == pytest.approx(0.01)
    assert ".roots" in formats.readable()
    with pytest.raises(MotionloomError, match="holds one motion; got 2"):
        io.save([standing()] * 2, place)
    with pytest.raises(MotionloomError, match="holds one motion; a clip is chosen in"):
        io.load(place, clip=1)


@pytest.mark.usefixtures("registered")
def test_a_package_brings_a_format_by_an_entry_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "roots.py").write_text(
        "from motionloom.formats import Format\n"
        "def write(motions, path):\n"
        "    path.write_text(str(len(motions)))\n"
        "    return path\n"
        "FORMAT = Format('.roots', writer=write)\n"
    )
    about = tmp_path / "roots-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: roots\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[{formats.GROUP}]\nroots = roots:FORMAT\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert io.save([standing()] * 3, tmp_path / "a.roots").read_text() == "3"
