"""Whatever bytes a stranger sends: a motion or one sentence, soon, and never another exception."""

import io as stdio
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import read_bytes
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from tests.io.test_asf import AMC, ASF
from tests.io.test_bvh import ARM
from tests.work import work

JUNK = [
    b"nan",
    b"-inf",
    b"1e999",
    b"9" * 400,
    b"-1",
    b"0",
    b"{",
    b"}",
    b"\n",
    b"\r",
    b"\0",
    b"\xff\xfe",
    b"ROOT x",
    b"End Site",
    b"MOTION",
    b"Frames: 1000000000000",
    b"CHANNELS 6",
    b"OFFSET",
    b":hierarchy",
    b"begin",
    b"end",
    b"root root",
    b"#",
    b":",
    b"1_0",
    b"0x10",
    "\u0661\u0662".encode(),
    b"\x1c",
    b"1" * 30,
    b"PK\x03\x04",
]
QUICK = settings(deadline=None, max_examples=120, suppress_health_check=[HealthCheck.too_slow])


@pytest.fixture(scope="session")
def npz(tmp_path_factory) -> bytes:
    motion = Motion(SMPL22, 30, np.zeros((2, 3)), np.tile(IDENTITY, (2, 22, 1)))
    return io.save(motion, tmp_path_factory.mktemp("valid") / "a.npz").read_bytes()


def try_to_load(path: Path, **options: Path) -> None:
    problem = ""
    try:
        assert np.isfinite(io.load(path, asf=options.get("asf")).positions()).all()
    except MotionloomError as error:
        problem = str(error)
    assert "\n" not in problem
    assert len(problem) < 600


@st.composite
def damage(draw: st.DrawFn) -> list[tuple[float, bytes, int]]:
    """Where (0 to 1), what is put in, and how many bytes go."""
    return draw(
        st.lists(
            st.tuples(st.floats(0, 1), st.sampled_from(JUNK) | st.binary(max_size=6), st.integers(0, 40)),
            min_size=1,
            max_size=4,
        )
    )


def damaged(data: bytes, changes: list[tuple[float, bytes, int]]) -> bytes:
    for where, new, gone in changes:
        at = int(where * len(data))
        data = data[:at] + new + data[at + gone :]
    return data


@QUICK
@given(data=st.binary(max_size=400), suffix=st.sampled_from([".bvh", ".amc", ".npz"]))
def test_arbitrary_bytes_are_refused(tmp_path_factory, data, suffix):
    path = tmp_path_factory.mktemp("junk") / f"a{suffix}"
    path.write_bytes(data)
    path.with_suffix(".asf").write_bytes(data if len(data) % 2 else ASF.encode())
    with pytest.raises(MotionloomError):
        io.load(path)


@QUICK
@given(changes=damage())
def test_damaged_bvh_is_read_or_refused(tmp_path_factory, changes):
    path = tmp_path_factory.mktemp("junk") / "a.bvh"
    path.write_bytes(damaged(ARM.encode(), changes))
    try_to_load(path)


@QUICK
@given(changes=damage(), skeleton=st.booleans())
def test_damaged_asf_and_amc_are_read_or_refused(tmp_path_factory, changes, skeleton):
    folder = tmp_path_factory.mktemp("junk")
    asf, amc = ASF.encode(), AMC.encode()
    (folder / "a.asf").write_bytes(damaged(asf, changes) if skeleton else asf)
    (folder / "a.amc").write_bytes(amc if skeleton else damaged(amc, changes))
    try_to_load(folder / "a.amc", asf=folder / "a.asf")


@QUICK
@given(changes=damage())
def test_damaged_npz_is_read_or_refused(tmp_path_factory, npz, changes):
    path = tmp_path_factory.mktemp("junk") / "a.npz"
    path.write_bytes(damaged(npz, changes))
    try_to_load(path)


@QUICK
@given(changes=damage(), which=st.integers(0, 8))
def test_archives_whole_outside_and_damaged_inside_are_read_or_refused(tmp_path_factory, npz, changes, which):
    path = tmp_path_factory.mktemp("junk") / "a.npz"
    with zipfile.ZipFile(stdio.BytesIO(npz)) as whole, zipfile.ZipFile(path, "w") as archive:
        for at, name in enumerate(whole.namelist()):
            archive.writestr(name, damaged(whole.read(name), changes) if at == which else whole.read(name))
    try_to_load(path)


@QUICK
@given(where=st.floats(0, 1, exclude_max=True))
def test_files_cut_off_anywhere_are_read_or_refused(tmp_path_factory, npz, where):
    folder = tmp_path_factory.mktemp("junk")
    for name, data in (("a.bvh", ARM.encode()), ("a.asf", ASF.encode()), ("a.amc", AMC.encode()), ("b.npz", npz)):
        (folder / name).write_bytes(data[: int(where * len(data))])
    for name in ("a.bvh", "a.amc", "b.npz"):
        try_to_load(folder / name)
    with pytest.raises(MotionloomError):
        io.load(folder / "b.npz")


def chain(depth: int, rows: int = 1) -> str:
    joints = "".join(f"JOINT j{i} {{ OFFSET 0.001 0 0 CHANNELS 1 Xrotation\n" for i in range(depth))
    head = f"HIERARCHY\nROOT r {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{joints}{'}' * (depth + 1)}\n"
    row = " ".join(["1"] * (depth + 1)) + "\n"
    return f"{head}MOTION\nFrames: {rows}\nFrame Time: 0.04\n{row * rows}"


def test_three_thousand_joints_in_a_row_are_no_recursion(tmp_path):
    (tmp_path / "a.bvh").write_text(chain(3000))
    motion = io.load(tmp_path / "a.bvh")
    assert len(motion.skeleton) == 3001
    again = io.load(io.save(motion, tmp_path / "b.bvh"))
    assert again.skeleton.names == motion.skeleton.names


def test_more_than_ten_thousand_joints_are_refused(tmp_path):
    (tmp_path / "a.bvh").write_text(chain(10_001))
    with pytest.raises(MotionloomError, match="more than 10000 joints"):
        io.load(tmp_path / "a.bvh")


def test_a_small_file_that_would_fill_the_memory_is_refused(tmp_path):
    still = "".join(f"JOINT j{i} {{ OFFSET 0 0 0 CHANNELS 0 }}\n" for i in range(9_000))
    head = (
        f"HIERARCHY\nROOT r {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{still}}}\nMOTION\nFrames: 20000\nFrame Time: 0.04\n"
    )
    (tmp_path / "a.bvh").write_text(head + "0\n" * 20_000)
    with pytest.raises(MotionloomError, match="20000 frames of 9001 joints"):
        io.load(tmp_path / "a.bvh")


@pytest.mark.parametrize(
    "text",
    [
        "HIERARCHY\nMOTION\nFrames" + " " * 300_000 + "x",
        "HIERARCHY\nMOTION\n" + "\n" * 300_000 + "Frames: 1",
        "HIERARCHY\nMOTION\nFrames: 1\n" + " " * 300_000 + "\nFrame" + "_" * 300_000,
        "HIERARCHY\n" + "ROOT " * 100_000,
        "HIERARCHY\n" + " " * 2_000_000,
        "HIERARCHY\nROOT " + "x" * 2_000_000,
        "HIERARCHY\n" + "{" * 500_000,
    ],
)
def test_long_nonsense_is_refused_soon_and_briefly(tmp_path, text):
    """It is not walked through token by token; a pattern that tried again at every place would take hours."""
    (tmp_path / "a.bvh").write_text(text)
    said: list[str] = []

    def refused() -> None:
        with pytest.raises(MotionloomError) as caught:
            io.load(tmp_path / "a.bvh")
        said.append(str(caught.value))

    refused()  # what is imported and compiled once does not count
    assert work(refused) < 20_000
    assert len(said[-1]) < 600


def test_work_does_not_grow_with_the_square_of_the_number_of_frames(tmp_path):
    def counted(rows: int) -> int:
        (tmp_path / "a.bvh").write_text(chain(3, rows))
        assert len(io.load(tmp_path / "a.bvh")) == rows
        return work(lambda: io.load(tmp_path / "a.bvh"))

    assert counted(8_000) <= 8 * counted(1_000)


@pytest.mark.parametrize("suffix", [".bvh", ".amc", ".npz", ".glb"])
def test_empty_missing_and_folder_are_told_apart(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    with pytest.raises(MotionloomError, match=r"No such file|no ASF"):
        io.load(path)
    path.mkdir()
    with pytest.raises(MotionloomError, match="is a folder"):
        io.load(path)
    (tmp_path / f"b{suffix}").write_bytes(b" \n")
    with pytest.raises(MotionloomError, match=r"empty|no ASF|GLB|glb"):
        io.load(tmp_path / f"b{suffix}")


def test_unknown_suffixes_are_refused_with_the_known_ones(tmp_path):
    for name in ("a.dae", "a", "a.bvh.txt", "a.asf"):
        with pytest.raises(MotionloomError, match=r"\.bvh|\.amc"):
            io.load(tmp_path / name)
    motion = Motion(SMPL22, 30, np.zeros((2, 3)), np.tile(IDENTITY, (2, 22, 1)))
    for name in ("a.dae", "a", "a.amc"):
        with pytest.raises(MotionloomError, match=r"\.bvh"):
            io.save(motion, tmp_path / name)
    for several in ([], [motion, motion]):
        with pytest.raises(MotionloomError, match="holds one motion"):
            io.save(several, tmp_path / "a.bvh")
    with pytest.raises(MotionloomError, match="does not exist"):
        io.save(motion, tmp_path / "no" / "a.bvh")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices here")
def test_a_device_is_no_file():
    for name in ("/dev/zero", "/dev/null"):
        with pytest.raises(MotionloomError, match="is a device"):
            read_bytes(name)


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="no files here that do not say their size")
def test_a_file_that_says_it_is_empty_is_left_at_the_limit():
    assert Path("/proc/self/maps").stat().st_size == 0
    with pytest.raises(MotionloomError, match="gives more than 100 bytes"):
        read_bytes("/proc/self/maps", max_bytes=100)
    assert len(read_bytes("/proc/self/maps", max_bytes=10_000_000)) > 1000


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices here")
def test_nothing_is_read_out_of_a_device(tmp_path):
    """By whoever reads what a user names: motions, maps of joints, weights, jobs, timelines."""
    from motionloom.cli import main

    io.save(Motion(SMPL22, 30, np.zeros((2, 3)), np.tile(IDENTITY, (2, 22, 1))), tmp_path / "a.bvh")
    for suffix in (".bvh", ".glb", ".npz", ".json", ".yaml", ".jsonl", ".safetensors", ".svg", ".txt"):
        (tmp_path / f"zero{suffix}").symlink_to("/dev/zero")
    zero, out = str(tmp_path / "zero"), str(tmp_path / "out.bvh")
    for words in (
        ["export", f"{zero}.bvh", out],
        ["export", f"{zero}.glb", out],
        ["export", f"{zero}.npz", out],
        ["export", str(tmp_path / "a.bvh"), out, "--skeleton", f"{zero}.glb"],
        ["export", str(tmp_path / "a.bvh"), out, "--skeleton", "smpl", "--source-map", f"{zero}.json"],
        ["compose", f"{zero}.yaml", "--out", out],
        ["control", "walk", "--path", f"{zero}.svg", "--out", out],
        ["control", "walk", "--goal", f"{zero}.json", "--out", out],
        ["generate", "--from", f"{zero}.txt", "--out", out],
        ["generate", "walk", "--weights", f"{zero}.safetensors", "--out", out],
        ["generate", "walk", "--adapter", f"{zero}.safetensors", "--out", out],
        ["batch", f"{zero}.jsonl", "--out", str(tmp_path / "made")],
        ["weights", f"{zero}.safetensors"],
    ):
        assert main(words) == 2, words
    assert not (tmp_path / "out.bvh").exists()


def test_a_pipe_is_read_to_its_end():
    reading, writing = os.pipe()
    os.write(writing, b"a person walks")
    os.close(writing)
    assert read_bytes(f"/dev/fd/{reading}", max_bytes=100) == b"a person walks"
    os.close(reading)
