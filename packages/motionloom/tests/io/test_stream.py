"""Files that grow: piece by piece they are what the whole motion would have been, also when it stops in between."""

import errno
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.files import bvh_writer
from motionloom.core.motion import Motion
from motionloom.core.rotations import normalize, rotvec_to_quat
from motionloom.core.skeleton import SMPL22
from motionloom.io import stream as streams
from motionloom.io.stream import joined, open_stream, resampled
from tests.io.motions import largest_distance


def spinning(frames: int, *, seed: int = 0) -> Motion:
    """A person whose every joint turns on and on, so that each of its angles wraps and meets gimbal lock."""
    random = np.random.default_rng(seed)
    turns = np.cumsum(random.normal(size=(1, 22, 3)) * 0.3 + random.normal(size=(frames, 22, 3)) * 0.05, axis=0)
    quats = rotvec_to_quat(turns) if frames else np.empty((0, 22, 4))
    return Motion(SMPL22, 20.0, np.cumsum(random.normal(size=(frames, 3)) * 0.05, axis=0), normalize(quats))


def cut(motion: Motion, places: list[int]) -> list[Motion]:
    ends = [0, *sorted({p for p in places if 0 < p < len(motion)}), len(motion)]
    return [motion.frames(a, b) for a, b in pairwise(ends)]


def write(path: Path, pieces: list[Motion], **options) -> Path:
    with open_stream(path, total=options.get("total")) as stream:
        for piece in pieces:
            stream.write(piece)
    return path


@settings(max_examples=25)
@given(places=st.lists(st.integers(1, 119), max_size=12), seed=st.integers(0, 5))
def test_a_streamed_bvh_is_byte_for_byte_the_saved_one(tmp_path_factory, places, seed):
    folder, motion = tmp_path_factory.mktemp("grow"), spinning(120, seed=seed)
    streamed = write(folder / "a.bvh", cut(motion, places), total=120)
    assert streamed.read_bytes() == io.save(motion, folder / "b.bvh").read_bytes()


def test_unit_and_orders_of_a_streamed_bvh_are_those_asked_for(tmp_path):
    motion, manner = spinning(60), {"order": {"pelvis": "XYZ", "head": "YXZ"}, "unit": 0.01}
    with open_stream(tmp_path / "a.bvh", total=60, order=manner["order"], unit=manner["unit"]) as stream:
        for piece in cut(motion, [10, 33]):
            stream.write(piece)
    assert (tmp_path / "a.bvh").read_bytes() == bvh_writer.save_bvh(motion, tmp_path / "b.bvh", **manner).read_bytes()


def test_more_joints_leave_room_for_fewer_frames(tmp_path):
    for name, most in (("a.bvh", streams.MAX_BVH_FRAMES // 2), ("a.npz", streams.MAX_POSES // 44)):
        open_stream(tmp_path / name, total=most, joints=44)
        with pytest.raises(MotionloomError, match="split it"):
            open_stream(tmp_path / name, total=most + 1, joints=44)


def test_angles_go_on_across_the_seams(tmp_path):
    """A turn of ten rounds in pieces of one frame: no column ever jumps by more than the turn of one frame."""
    turn = np.zeros((200, 22, 3))
    turn[:, :, 1] = np.linspace(0, 20 * np.pi, 200)[:, None]
    motion = Motion(SMPL22, 20.0, np.zeros((200, 3)), rotvec_to_quat(turn))
    text = write(tmp_path / "a.bvh", cut(motion, list(range(200)))).read_text()
    rows = np.array([line.split() for line in text.partition("Frame Time")[2].splitlines()[1:]], dtype=float)
    step = 360 * 10 / 199
    np.testing.assert_allclose(np.abs(np.diff(rows, axis=0)).max(), step, rtol=1e-4)
    assert rows[:, 3:].max() == pytest.approx(3600)


def test_the_number_of_frames_is_that_written_whatever_was_expected(tmp_path):
    motion = spinning(50)
    for total in (None, 10, 50, 100_000):
        assert len(io.load(write(tmp_path / "a.bvh", cut(motion, [20]), total=total))) == 50
        assert [p.name for p in tmp_path.iterdir()] == ["a.bvh"]
    with pytest.raises(MotionloomError, match="more frames came than were announced"):
        write(tmp_path / "a.bvh", cut(motion, [7]), total=9)
    assert len(io.load(tmp_path / "a.bvh")) == 7


@pytest.mark.parametrize("suffix", [".bvh", ".npz", ".glb"])
@pytest.mark.parametrize("problem", [KeyboardInterrupt, MotionloomError, ZeroDivisionError])
def test_what_was_finished_before_a_problem_is_a_valid_file(tmp_path, suffix, problem):
    motion, place = spinning(60), tmp_path / f"a{suffix}"
    stream = open_stream(place, total=60)

    def interrupted() -> None:
        with stream:
            stream.write(motion.frames(0, 25))
            stream.write(motion.frames(25, 40))
            raise problem

    with pytest.raises(problem):
        interrupted()
    found = io.load(place)
    assert len(found) == 40
    assert largest_distance(motion.frames(0, 40), found) < 1e-4
    assert [p.name for p in tmp_path.iterdir()] == [place.name]
    assert (stream.saved, stream.frames, stream.seconds) == (True, 40, 2.0)


@pytest.mark.parametrize("suffix", [".bvh", ".npz", ".glb", ".mp4", ".gif", ".png"])
def test_with_nothing_finished_nothing_is_left_and_an_older_file_stays(tmp_path, suffix):
    place = tmp_path / f"a{suffix}"
    place.write_text("older")
    with pytest.raises(KeyboardInterrupt), open_stream(place, total=60) as stream:
        raise KeyboardInterrupt
    assert stream.close() is None
    assert place.read_text() == "older"
    assert [p.name for p in tmp_path.iterdir()] == [place.name]


def test_nothing_stands_at_the_place_until_it_is_closed(tmp_path):
    stream = open_stream(tmp_path / "a.bvh", total=None)
    stream.write(spinning(5))
    assert not (tmp_path / "a.bvh").exists()
    assert stream.close() == tmp_path / "a.bvh" == stream.close()
    with pytest.raises(MotionloomError, match="is closed"):
        stream.write(spinning(5))


def test_a_full_disk_keeps_the_pieces_that_fitted(tmp_path, monkeypatch):
    """The third piece gets half of itself onto the disk; the file ends after the second."""
    motion, put = spinning(60), bvh_writer._write

    def full(file, data):
        if len(data) < 1000:
            return put(file, data)
        put(file, data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    with open_stream(tmp_path / "a.bvh", total=60) as stream:
        stream.write(motion.frames(0, 20))
        stream.write(motion.frames(20, 40))
        monkeypatch.setattr(bvh_writer, "_write", full)
        with pytest.raises(MotionloomError, match=r"cannot write .*a\.bvh: No space"):
            stream.write(motion.frames(40, 60))
    assert len(io.load(tmp_path / "a.bvh")) == 40


def test_memory_does_not_grow_with_the_number_of_pieces(tmp_path):
    """Python's own peak for 60 pieces is that for 6, within a tenth."""
    import tracemalloc

    def peak(count: int) -> int:
        tracemalloc.start()
        with open_stream(tmp_path / "a.bvh", total=None) as stream:
            for number in range(count):
                stream.write(spinning(50, seed=number))
        highest = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return highest

    peak(2)
    assert peak(60) < 1.1 * peak(6)


@settings(max_examples=40)
@given(
    frames=st.integers(1, 60),
    places=st.lists(st.integers(1, 59), max_size=10),
    fps=st.sampled_from([1.0, 7.3, 10.0, 20.0, 24.0, 29.97, 30.0, 60.0, 240.0]),
)
def test_pieces_resampled_together_are_the_resampled_whole(frames, places, fps):
    motion = spinning(frames)
    found, wanted = joined(list(resampled(cut(motion, places), fps))), motion.resample(fps)
    assert (len(found), found.fps) == (len(wanted), wanted.fps)
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-9)
    np.testing.assert_allclose(found.positions(), wanted.positions(), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "total", "message"),
    [
        ("a.txt", 5, "must end in"),
        ("absent/a.bvh", 5, "does not exist"),
        ("a.gif", 1201, "write an .mp4"),
        ("a.bvh", streams.MAX_BVH_FRAMES + 1, "34.7 h"),
        ("a.npz", 10**7, "split it"),
    ],
)
def test_what_a_file_cannot_hold_is_reported_before_the_work(tmp_path, name, total, message):
    with pytest.raises(MotionloomError, match=message):
        open_stream(tmp_path / name, total=total)


def test_pieces_must_belong_together(tmp_path):
    motion = spinning(10)
    stretchy = Motion(SMPL22, 20.0, motion.root, motion.rotations, np.zeros((10, 22, 3)))
    for pieces, message in [([motion, motion.resample(30)], "frame rate"), ([stretchy], "change length")]:
        with pytest.raises(MotionloomError, match=message):
            write(tmp_path / "a.bvh", pieces)
