"""Hostile sizes and half-written files: what small files may ask for, and what a killed process leaves behind."""

import os
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.core.errors import LONGEST_MESSAGE, MotionloomError
from motionloom.core.files import text
from motionloom.core.files.atomic import atomic_path, finished
from motionloom.core.files.tensors import save_tensors
from motionloom.core.skeleton import Skeleton
from motionloom.goals.drawing import read_drawing
from motionloom.goals.goal_file import read_goal
from motionloom.io import npz
from motionloom.io.folder import atomic_folder

HOLDS = """
import sys, time
from motionloom.core.files.atomic import atomic_path
with atomic_path(sys.argv[1]) as part:
    part.write_bytes(b"half")
    print("holds", flush=True)
    time.sleep(600)
"""


def holder(path: Path) -> subprocess.Popen[str]:
    """Another process in the middle of writing a file."""
    running = subprocess.Popen([sys.executable, "-c", HOLDS, str(path)], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None
    assert running.stdout.readline() == "holds\n"
    return running


def test_a_part_is_no_finished_file_and_is_swept_when_its_writer_is_gone(tmp_path: Path) -> None:
    """Only then: as long as the writer lives, its part stays, whoever writes beside it."""
    running = holder(tmp_path / "a.safetensors")
    try:
        (part,) = tmp_path.iterdir()
        assert part.name.startswith(".")
        assert finished(tmp_path, "*.safetensors", "*") == finished(tmp_path, "**/*") == []
        sweeps(tmp_path)
        assert part.exists()
    finally:
        running.kill()
        running.wait()
    sweeps(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def sweeps(folder: Path) -> None:
    """Another process that writes into the folder for the first time."""
    imports = "import sys\nfrom motionloom.core.files.atomic import atomic_path\n"
    program = f"{imports}with atomic_path(sys.argv[1]) as p: pass"
    subprocess.run([sys.executable, "-c", program, str(folder / "b")], check=True)


def test_what_lies_in_a_hidden_folder_is_not_finished(tmp_path: Path) -> None:
    with atomic_folder(tmp_path / "futures") as folder:
        (folder / "a.bvh").write_text("half")
        assert finished(tmp_path, "**/*.bvh", "**/*.amc") == []
    assert finished(tmp_path, "**/*.bvh") == [tmp_path / "futures" / "a.bvh"]


def test_weights_have_the_rights_of_other_files(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    save_tensors({"a": np.zeros(3, np.float32)}, tmp_path / "a.safetensors", metadata={"k": "v"})
    assert stat.S_IMODE((tmp_path / "a.safetensors").stat().st_mode) == stat.S_IMODE(
        (tmp_path / "plain").stat().st_mode
    )


def full(path: Path, data: bytes) -> int:
    raise OSError(28, "No space left on device")


def test_a_full_disk_is_one_sentence_that_names_what_was_asked_for(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(MotionloomError, match=r"cannot write .*/a\.safetensors: No space left") as caught:
        save_tensors({"a": np.zeros(3, np.float32)}, tmp_path / "a.safetensors", metadata={})
    assert ".part" not in str(caught.value)

    def fill() -> None:
        with atomic_folder(tmp_path / "new") as folder, atomic_path(folder / "a.bvh") as part:
            part.write_bytes(b"")

    with pytest.raises(MotionloomError, match=r"cannot write .*/new/a\.bvh: No space left") as caught:
        fill()
    assert ".part" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_pipes_and_links_in_a_circle_are_no_places_for_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.bvh")
    (tmp_path / "circle.bvh").symlink_to(tmp_path / "circle.bvh")
    for name in ("pipe.bvh", "circle.bvh"):
        with pytest.raises(MotionloomError, match="cannot write"), atomic_path(tmp_path / name):
            pytest.fail("the block must not run")
    assert stat.S_ISFIFO((tmp_path / "pipe.bvh").stat().st_mode)


def test_messages_are_one_line_of_bounded_length() -> None:
    said = str(MotionloomError("a\nb\x1b[31m" + "x" * 10_000 + "end"))
    assert said.startswith(r"a\nb\u001b[31m")
    assert said.endswith("end")
    assert len(said) <= LONGEST_MESSAGE + 10


# Archives ------------------------------------------------------------------------------------------------------------


def archive(path: Path, shape: tuple[int, ...], kind: int, dtype: str = "|i1") -> Path:
    """An array of zeros whose head says the truth."""
    with zipfile.ZipFile(path, "w", kind) as made, made.open("rotations.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": dtype, "fortran_order": False, "shape": shape})
        for _ in range(np.prod(shape) * np.dtype(dtype).itemsize // 1_000_000):
            member.write(bytes(1_000_000))
    return path


def test_a_small_archive_of_very_many_numbers_is_not_unpacked(tmp_path: Path, monkeypatch) -> None:
    path = archive(tmp_path / "a.npz", (60_000_000,), zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 100_000
    read: list[int] = []
    inner = zipfile.ZipExtFile.read
    monkeypatch.setattr(zipfile.ZipExtFile, "read", lambda self, n=-1: read.append(n) or inner(self, n))
    with pytest.raises(MotionloomError, match="far more numbers"):
        io.load(path)
    assert max(read) < 10_000  # the head, and no more


def test_archives_of_other_kinds_are_refused_and_usual_ones_read(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="packed in a way"):
        npz.read_arrays(archive(tmp_path / "a.npz", (1_000_000,), zipfile.ZIP_LZMA))
    found = npz.read_arrays(archive(tmp_path / "b.npz", (7_000_000,), zipfile.ZIP_DEFLATED))
    assert found["rotations"].shape == (7_000_000,)


def test_the_numbers_of_all_arrays_count_together(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(npz, "SPARE_NUMBERS", 1000)
    monkeypatch.setattr(npz, "NUMBERS_PER_BYTE", 1)
    np.savez_compressed(tmp_path / "a.npz", **{f"a{k}": np.zeros(990) for k in range(40)})
    with pytest.raises(MotionloomError, match="far more numbers"):
        npz.read_arrays(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "head", [b"(" * 3000, b"{'descr': '<f8', 'fortran_order': False, 'shape': (1.5,), }", b"\xff" * 60]
)
def test_damaged_heads_of_arrays_are_one_sentence(tmp_path: Path, head: bytes) -> None:
    data = b"\x93NUMPY\x01\0" + len(head).to_bytes(2, "little") + head + bytes(8)
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(MotionloomError, match=r"a\.npy"):
        npz.read_array(tmp_path / "a.npy")


# Work that must not grow with the square -----------------------------------------------------------------------------


def steps(call) -> int:
    """Lines of Python that a call runs."""
    count = 0

    def watch(frame, event, given):
        nonlocal count
        count += event == "line"
        return watch

    sys.settrace(watch)
    try:
        call()
    except MotionloomError:
        pass
    finally:
        sys.settrace(None)
    return count


def bvh(ends: int) -> str:
    tips = "End Site\n{\nOFFSET 0 1 0\n}\n" * ends
    return (
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        + tips
        + "}\nMOTION\nFrames: 1\nFrame Time: 0.05\n0 0 0\n"
    )


def test_many_ends_of_one_joint_take_work_in_proportion(tmp_path: Path) -> None:
    few, many = tmp_path / "few.bvh", tmp_path / "many.bvh"
    few.write_text(bvh(200))
    many.write_text(bvh(2000))
    assert steps(lambda: io.load(many)) < 15 * steps(lambda: io.load(few))


def test_a_bvh_of_joints_that_it_says_nothing_about_is_refused(tmp_path: Path) -> None:
    """9,990 joints without channels times 9,000 frames: 277 KB that asked for 3.4 GB."""
    head, mark, _ = bvh(9_900).partition("MOTION\n")
    (tmp_path / "a.bvh").write_text(f"{head}{mark}Frames: 9000\nFrame Time: 0.05\n" + "0 0 0\n" * 9000)
    with pytest.raises(MotionloomError, match="says nothing about"):
        io.load(tmp_path / "a.bvh")


SVG = '<svg xmlns="http://www.w3.org/2000/svg"><path transform="{}" d="M0 0 L1 1"/></svg>'


@pytest.mark.parametrize("said", [" " * 200_000 + "x", "scale(2)" * 200_000, "scale(" + "1 " * 200_000 + ")"])
def test_a_long_transform_is_refused_without_trying_its_every_part(tmp_path: Path, said: str) -> None:
    (tmp_path / "a.svg").write_text(SVG.format(said))
    assert steps(lambda: read_drawing(tmp_path / "a.svg")) < 3_000_000
    with pytest.raises(MotionloomError):
        read_drawing(tmp_path / "a.svg")


def test_a_key_that_stands_twice_behind_many_others_is_found_at_once(tmp_path: Path) -> None:
    def write(count: int) -> Path:
        keys = ",".join(f'"k{k}": 0' for k in range(count))
        (tmp_path / f"{count}.json").write_text(f'{{{keys}, "twice": 0, "twice": 0}}')
        return tmp_path / f"{count}.json"

    for path in (write(1000), write(90_000)):
        with pytest.raises(MotionloomError, match="the key 'twice' stands in it twice"):
            read_goal(path, frames=20, folder=tmp_path)


def test_json_is_shallow_and_finite_where_it_is_to_be() -> None:
    deep = "[" * 65 + "]" * 65
    for bad in (deep, "NaN", '{"a": -Infinity}', "9" * 5000, "{", b"\xff"):
        with pytest.raises(MotionloomError, match="x is not JSON"):
            text.parse_json(bad, "x")
    assert text.plain_json("[" * 64 + "]" * 64)
    assert np.isnan(text.plain_json("NaN"))


def test_names_of_joints_are_bounded_and_mirrored_in_proportion() -> None:
    with pytest.raises(MotionloomError, match="1000 are the most"):
        Skeleton(("a" * 1001,), (-1,), np.zeros((1, 3)))
    names = tuple(f"{side}_{k}" for k in range(2000) for side in ("left", "right"))
    skeleton = Skeleton(names, (-1, *range(len(names) - 1)), np.zeros((len(names), 3)))
    assert skeleton.mirror_pairs()[:4] == (1, 0, 3, 2)
