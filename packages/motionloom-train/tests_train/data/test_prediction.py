"""Recordings and windows for prediction: which frames are tested, who is held out, what a folder gives."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.skeleton import SMPL22
from motionloom_train.data.prediction import (
    CMU_TEST,
    CMU_VAL,
    Protocol,
    Recording,
    checked,
    cmu_split,
    read_cmu,
    read_folder,
)
from motionloom_train.data.sources import Places, Take, find_takes
from tests.shared import shared
from tests_train.data import people


def recording(name: str, frames: int, split: str = "test") -> Recording:
    return Recording(name, name, "walk", split, np.zeros((frames, 22, 3), np.float32))


def protocol(*recordings: Recording, **changes: object) -> Protocol:
    """Ten frames in all: four shown, six to predict."""
    values: dict = {"layout": SMPL_LAYOUT, "recordings": recordings, "licence": ""} | changes
    return Protocol("p", 10.0, 4, 6, **values)


@pytest.mark.parametrize(
    ("frames", "strict", "starts"),
    [
        (9, True, []),
        (10, True, []),
        (10, False, [0]),
        (11, True, [0]),
        (14, True, [0]),
        (14, False, [0, 4]),
        (15, True, [0, 4]),
        (22, True, [0, 4, 8]),
        (22, False, [0, 4, 8, 12]),
    ],
)
def test_windows_start_every_observed_length(frames: int, strict: bool, starts: list[int]) -> None:
    """Counted by hand: 0, 4, 8 ... while start + 10 < frames, or <= where it is not strict."""
    windows = protocol(recording("a", frames), strict=strict).windows()
    assert [start for _, start in windows] == starts


def test_first_and_stride_move_the_windows() -> None:
    """From frame 7 on, every 5: the window at 22 would end with frame 31, the last of 32."""
    read = protocol(recording("a", 32), recording("b", 18), recording("c", 32, "train"), first=7, stride=5)
    assert [(r.name, start) for r, start in read.windows()] == [("a", 7), ("a", 12), ("a", 17), ("b", 7)]
    assert [(r.name, start) for r, start in read.windows("train")] == [("c", 7), ("c", 12), ("c", 17)]


def test_listed_windows_are_those_of_the_list() -> None:
    """A benchmark's list names the test windows in its order; other splits keep the rule."""
    listed = (("b", 3), ("a", 5), ("missing", 0))
    read = protocol(recording("a", 30), recording("b", 30), recording("v", 12, "val"), listed=listed)
    assert [(r.name, start) for r, start in read.windows()] == [("b", 3), ("a", 5)]
    assert [(r.name, start) for r, start in read.windows("val")] == [("v", 0)]


def test_nothing_long_enough_is_said() -> None:
    """Recordings shorter than a window make no protocol, whatever their split."""
    assert checked("here", protocol(recording("v", 10, "val")))
    with pytest.raises(MotionloomError, match=r"here has no recording of 1 s or more.*it has 2"):
        checked("here", protocol(recording("a", 9), recording("b", 9)))


def take(name: str) -> Take:
    return Take(name, "cmu", "", "train", (), lambda: Places(np.zeros((1, 22, 3)), np.zeros((1, 22, 3)), 30.0))


def test_cmu_is_split_by_subject() -> None:
    """All recordings of a subject are in the split of the subject, and the lists do not overlap."""
    assert not set(CMU_TEST) & set(CMU_VAL)
    assert {cmu_split(take(f"{subject}_{n:02}")) for subject in CMU_TEST for n in (1, 20)} == {"test"}
    assert {cmu_split(take(f"{subject}_01")) for subject in CMU_VAL} == {"val"}
    assert cmu_split(take("01_02")) == cmu_split(take("25_13")) == "train"


def test_no_subject_and_no_pair_of_the_pack_is_in_two_splits() -> None:
    """On the real pack every subject has one split, all three have some, and two who dance together stay together."""
    folder = shared("data")
    splits: dict[str, set[str]] = {}
    takes = [t for t in find_takes(folder) if t.source == "cmu"]
    for one in takes:
        splits.setdefault(one.name.split("_")[0], set()).add(cmu_split(one))
    assert all(len(parts) == 1 for parts in splits.values())
    assert set().union(*splits.values()) == {"train", "val", "test"}
    assert splits["60"] == splits["61"]  # the dancers
    assert set(CMU_TEST + CMU_VAL) <= set(splits)


def test_a_pack_is_read_at_30_frames_a_second(tmp_path: Path) -> None:
    """Four seconds at 20 frames a second become 119 at 30, upright, under the subject of the name."""
    walk = people.walker(seconds=4.0)
    people.write_pack(tmp_path / "pack", {"02_01": (walk, "train", "walk"), "16_01": (walk, "test", "run")})
    read = read_cmu(tmp_path / "pack")
    assert [(r.name, r.subject, r.split) for r in read.recordings] == [
        ("02_01", "02", "test"),
        ("16_01", "16", "train"),
    ]
    assert all(len(r.positions) == 119 and r.positions.dtype == np.float32 for r in read.recordings)
    head, feet = SMPL22.index("head"), SMPL22.index("left_foot")
    assert (read.recordings[0].positions[:, head, 1] - read.recordings[0].positions[:, feet, 1] > 1.0).all()
    assert [start for _, start in read.windows()] == [0]  # 90 frames of 119
    assert [r.name for r in read_cmu(tmp_path / "pack", splits=("test",)).recordings] == ["02_01"]


def test_ten_files_of_ones_own_make_three_splits(tmp_path: Path) -> None:
    """The fifth by name is for validation, the tenth for test; broken ones are told, left out, and still counted."""
    for number in range(10):
        (tmp_path / f"clip{number}.bvh").write_text("HIERARCHY\n")
    people.write_bvh(tmp_path / "clip0.bvh", people.walker(seconds=3.1))
    for number in (4, 9):
        (tmp_path / f"clip{number}.bvh").write_bytes((tmp_path / "clip0.bvh").read_bytes())
    lines: list[str] = []
    read = read_folder(tmp_path, fps=20.0, say=lines.append)
    assert {r.name: r.split for r in read.recordings} == {"clip0": "train", "clip4": "val", "clip9": "test"}
    assert sum("left out clip" in line for line in lines) == 7
    assert (read.observed, read.future, read.fps) == (20, 40, 20.0)
