"""Human3.6M and HumanEva-I out of small made-up files of the usual layout: splits, windows, axes, refusals."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.benchmarks import (
    H36M_SPEEDS,
    find_protocol,
    h36m_class,
    held_out,
    read_h36m,
    read_humaneva,
)
from tests.work import ends
from tests_lab.papers.benchmark_files import amass_folder, h36m, humaneva, person, starts, write
from tests_train.data import people

RIGHT_HIP, LEFT_HIP, HEAD, LEFT_WRIST = 1, 6, 15, 19  # in the file's 32 joints


# Human3.6M


def test_h36m_windows_are_counted_as_published(tmp_path: Path) -> None:
    """By hand: 200 frames give 0, 25, 50 (75 + 125 = 200 ends with the last frame); 126 give one, 125 none."""
    read = read_h36m(h36m(tmp_path))
    of_s9 = {name: s for name, s in starts(read).items() if name.startswith("S9")}
    assert of_s9 == {"S9/Photo 1": [0, 25, 50], "S9/Walking 2": [0]}
    assert {tuple(s) for name, s in starts(read).items() if name.startswith("S11")} == {(0, 25)}
    assert (read.fps, read.observed, read.future, read.threshold, read.strict) == (50.0, 25, 100, 0.5, True)


def test_h36m_people_are_in_one_part(tmp_path: Path) -> None:
    """S9 and S11 are tested and no other; validation is out of the training people and shares no recording."""
    read = read_h36m(h36m(tmp_path))
    people_of = {s: {r.subject for r in read.split(s)} for s in ("train", "val", "test")}
    assert people_of["test"] == {"S9", "S11"}
    assert people_of["train"] == people_of["val"] == {"S1", "S5", "S6", "S7", "S8"}
    assert len({r.name for r in read.recordings}) == len(read.recordings) == 5 * 6 + 4 + 5
    assert len(read.split("val")) == 5


def test_h36m_keeps_the_17_joints_and_the_files_numbers(tmp_path: Path) -> None:
    """What a network sees is the file's numbers: the kept joints less the hip, +Z up, in the published order."""
    path = h36m(tmp_path)
    one = read_h36m(path).recordings[0]
    file = person(151)
    joints = [1, 2, 3, 6, 7, 8, 12, 13, 14, 15, 17, 18, 19, 25, 26, 27]
    layout = read_h36m(path).layout
    features = layout.encode(one.positions, layout.place(one.positions[24]))
    assert np.allclose(features.reshape(151, 16, 3), file[:, joints] - file[:, :1], atol=1e-6)
    assert np.allclose(one.positions[:, 0], file[:, 0, [1, 2, 0]])  # the root keeps its way


def test_a_standing_person_stays_standing_and_left_stays_left(tmp_path: Path) -> None:
    """Somebody who stands on the floor z = 0 and faces the file's +X has the head up and the left at +X facing +Z."""
    pose = np.zeros((130, 32, 3), np.float32)
    pose[:, :, 2] = 0.9
    pose[:, HEAD, 2], pose[:, LEFT_HIP, 1], pose[:, RIGHT_HIP, 1] = 1.7, 0.1, -0.1  # facing +X the left is at +Y
    pose[:, LEFT_WRIST, 0] = 0.5  # stretched forward
    path = write(tmp_path / "data_3d_h36m.npz", {"S9": {"Waiting": pose}})
    read = read_h36m(path)
    names, places = read.layout.names, read.recordings[0].positions[0]
    assert places[names.index("head")] == pytest.approx([0, 1.7, 0])
    assert places[names.index("left_hip")] == pytest.approx([0.1, 0.9, 0])
    assert places[names.index("right_hip")] == pytest.approx([-0.1, 0.9, 0])
    assert places[names.index("left_wrist")] == pytest.approx([0, 0.9, 0.5])


def test_classes_are_actions_without_their_number(tmp_path: Path) -> None:
    """Every class of the table is itself with and without a number, and long names are the short ones."""
    assert all(h36m_class(name) == h36m_class(f"{name} 1") == h36m_class(f"{name}_2") == name for name in H36M_SPEEDS)
    longer = ("TakingPhoto 1", "WalkingDog", "WalkingTogether 1")
    assert [h36m_class(n) for n in longer] == ["Photo", "WalkDog", "WalkTogether"]
    assert {r.action for r in read_h36m(h36m(tmp_path)).recordings} <= set(read_h36m(h36m(tmp_path)).speeds)
    assert sum(H36M_SPEEDS.values()) == pytest.approx(0.0724604)


@pytest.mark.parametrize(
    "name", ["Walking " + "9" * 400_000 + "x", "9" * 400_000 + "x", "Walking" + " 9" * 200_000 + "x"]
)
def test_endless_names_take_no_endless_time(name: str) -> None:
    """Digits before something else: a search that began at each of them would take hours."""
    assert ends(lambda: h36m_class(name))


def test_a_tenth_of_each_persons_actions_is_held_out() -> None:
    """Of 30 actions in 15 pairs three each, and over five people every pair exactly once; one action stays."""
    numbers = [held_out(30, person) for person in range(5)]
    assert [len(k) for k in numbers] == [3] * 5
    assert sorted(i // 2 for k in numbers for i in k) == list(range(15))
    assert held_out(1, 0) == held_out(0, 3) == set()
    assert all(
        len(held_out(n, s)) == max(1, n // 10) and held_out(n, s) <= set(range(n))
        for n in range(2, 60)
        for s in range(6)
    )


def test_missing_subjects_are_reported(tmp_path: Path) -> None:
    """A file with one subject is read and the others are named; one with none is refused."""
    lines: list[str] = []
    read_h36m(write(tmp_path / "a.npz", {"S9": {"Waiting": person(130)}}), say=lines.append)
    assert any("lacks S1, S5, S6, S7, S8, S11" in line for line in lines)
    with pytest.raises(MotionloomError, match=r"none of the subjects .* it has 'S2'"):
        read_h36m(write(tmp_path / "b.npz", {"S2": {"Waiting": person(130)}}))


# HumanEva-I


def test_humaneva_drops_three_chunks_and_short_ones(tmp_path: Path) -> None:
    """By hand: of each five, Jog 2 (74 frames) goes; Train/S3 loses chunks 0 and 2, Validate/S3 chunk 4."""
    read = read_humaneva(humaneva(tmp_path))
    names = {r.name for r in read.recordings}
    all_names = {"Walking 1 chunk0", "Walking 1 chunk2", "Walking 1 chunk4", "Box 1 chunk0"}
    assert {n.removeprefix("Train/S3/") for n in names if n.startswith("Train/S3")} == {
        "Walking 1 chunk4",
        "Box 1 chunk0",
    }
    assert {n.removeprefix("Validate/S3/") for n in names if n.startswith("Validate/S3")} == all_names - {
        "Walking 1 chunk4"
    }
    assert {n.removeprefix("Train/S1/") for n in names if n.startswith("Train/S1")} == all_names
    assert not any("Unlabeled" in n for n in names)
    assert {r.action for r in read.recordings} == {"Walking", "Box"}


def test_humaneva_windows_and_exactly_75_frames(tmp_path: Path) -> None:
    """80 frames give the one window at 0, and 75 none for the test but a recording that training may draw."""
    read = read_humaneva(humaneva(tmp_path))
    first = starts(read)
    assert first["Validate/S1/Walking 1 chunk0"] == [0]
    assert "Validate/S1/Box 1 chunk0" not in first
    assert any(len(r.positions) == 75 for r in read.split("train"))
    assert (read.fps, read.observed, read.future, read.layout.joints) == (60.0, 15, 60, 15)
    assert {r.name.split("/")[0] for r in read.split("test")} == {"Validate"}
    assert {r.name.split("/")[0] for r in read.split("train") + read.split("val")} == {"Train"}
    assert len(read.split("val")) == 3


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.zeros((130, 17, 3), np.float32), r"\(130, 17, 3\)"),
        (np.zeros((130, 96), np.float32), r"\(130, 96\)"),
        (np.zeros((0, 32, 3), np.float32), r"\(0, 32, 3\)"),
        (np.zeros((130, 32, 3), np.int32), "int32"),
        (np.full((130, 32, 3), np.nan, np.float32), "not finite"),
        (np.full((130, 32, 3), np.inf), "not finite"),
        (np.full((130, 32, 3), 900.0), "in metres"),
    ],
    ids=["17 joints", "flat", "empty", "whole numbers", "nan", "inf", "millimetres"],
)
def test_arrays_of_another_form_are_named(tmp_path: Path, array: np.ndarray, said: str) -> None:
    """The message has the subject, the action and what was there."""
    path = write(tmp_path / "data_3d_h36m.npz", {"S9": {"Waiting": array}})
    with pytest.raises(MotionloomError, match=f"S9, Waiting .*{said}"):
        read_h36m(path)


# Recognising


def test_each_data_set_is_recognised(tmp_path: Path) -> None:
    """By file name, by folder, by the subjects in a file of another name, by folders of data sets, by a manifest."""
    for folder in ("a", "b", "c", "d", "e", "f"):
        (tmp_path / folder).mkdir()
    assert find_protocol(h36m(tmp_path / "a")).name == find_protocol(tmp_path / "a").name == "h36m"
    assert find_protocol(humaneva(tmp_path / "b")).name == find_protocol(tmp_path / "b").name == "humaneva"
    assert find_protocol(h36m(tmp_path / "a").rename(tmp_path / "a" / "poses.npz")).name == "h36m"
    assert find_protocol(humaneva(tmp_path / "b").rename(tmp_path / "b" / "poses.npz")).name == "humaneva"
    assert find_protocol(amass_folder(tmp_path / "c" / "amass").parent, splits=("test",)).name == "amass"
    walk = people.walker(seconds=3.5)
    assert find_protocol(people.write_pack(tmp_path / "pack", {"02_01": (walk, "train", "walk")})).name == "cmu"
    people.write_bvh(tmp_path / "e" / "mine.bvh", walk)
    assert find_protocol(tmp_path / "e").name == "own"
    (tmp_path / "e" / "mine.bvh").rename(tmp_path / "f" / "16_01.bvh")
    assert find_protocol(tmp_path / "f").name == "cmu"
    named = find_protocol(tmp_path / "f", name="own", fps=20.0)
    assert (named.name, named.fps) == ("own", 20.0)


def test_what_is_not_recognised_is_said(tmp_path: Path) -> None:
    """Nothing there, an empty folder, two data sets, a wrong name, another file, a list that does not belong."""
    with pytest.raises(MotionloomError, match="there is no"):
        find_protocol(tmp_path / "none")
    with pytest.raises(MotionloomError, match=r"no \.amc or \.bvh"):
        find_protocol(tmp_path)
    with pytest.raises(MotionloomError, match="no folder of train, val, test called after"):
        find_protocol(tmp_path, name="amass")
    both = humaneva(tmp_path)
    h36m(tmp_path)
    with pytest.raises(MotionloomError, match=r"data_3d_h36m\.npz and data_3d_humaneva15\.npz; name the one"):
        find_protocol(tmp_path)
    assert find_protocol(tmp_path, name="humaneva").name == "humaneva"
    with pytest.raises(MotionloomError, match="no data set 'kit'"):
        find_protocol(tmp_path, name="kit")
    with pytest.raises(MotionloomError, match="test segments is for AMASS"):
        find_protocol(both, segments=tmp_path / "list.csv")
    with pytest.raises(MotionloomError, match="none of the subjects"):
        find_protocol(both, name="h36m")
    other = write(tmp_path / "other.npz", {"me": {"a": person(130)}})
    with pytest.raises(MotionloomError, match=r"neither Human3\.6M nor HumanEva-I; it has 'me'"):
        find_protocol(other)
    (tmp_path / "x.bvh").write_text("")
    with pytest.raises(MotionloomError, match="is a file"):
        find_protocol(tmp_path / "x.bvh")
