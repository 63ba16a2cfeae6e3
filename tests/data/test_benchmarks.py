"""Human3.6M, HumanEva-I and AMASS out of small made-up files of the usual layout: splits, windows, axes, refusals."""

import io
import json
import os
import pickle
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.data.amass import AMASS_SETS, AMASS_SPEEDS, UNIFORM, read_amass, set_name
from motionloom.data.benchmarks import (
    H36M_SPEEDS,
    find_protocol,
    h36m_class,
    held_out,
    read_h36m,
    read_humaneva,
)
from motionloom.data.pickled import read_tables
from motionloom.data.prediction import Protocol
from motionloom.errors import MotionloomError
from tests.data import people
from tests.data.test_babel import amass

RIGHT_HIP, LEFT_HIP, HEAD, LEFT_WRIST = 1, 6, 15, 19  # in the file's 32 joints


def person(frames: int, joints: int = 32) -> np.ndarray:
    """(frames, joints, 3) +Z up: each number says its frame, joint and axis; nobody in particular."""
    frame, joint, axis = np.meshgrid(range(frames), range(joints), range(3), indexing="ij")
    return (frame * 0.001 + joint * 0.01 + axis * 0.1).astype(np.float32)


def write(path: Path, table: Any, **more: Any) -> Path:
    np.savez_compressed(path, positions_3d=np.array(table, dtype=object), **more)
    return path


def h36m(folder: Path, frames: int = 151) -> Path:
    names = [f"{a}{n}" for a in ("Directions", "Eating", "WalkTogether") for n in ("", " 1")]
    table = {s: {a: person(frames) for a in names} for s in ("S1", "S5", "S6", "S7", "S8", "S9", "S11")}
    table["S9"] = {"Photo 1": person(200), "Walking 2": person(126), "Sitting": person(125), "Posing": person(40)}
    del table["S11"]["Directions"]
    return write(folder / "data_3d_h36m.npz", table)


def humaneva(folder: Path, **changes: dict[str, np.ndarray]) -> Path:
    chunks = {"Walking 1 chunk0": 80, "Walking 1 chunk2": 80, "Walking 1 chunk4": 80, "Box 1 chunk0": 75, "Jog 2": 74}
    table = {
        f"{part}/S{n}": {name: person(frames, 15) for name, frames in chunks.items()}
        for part in ("Train", "Validate") for n in (1, 2, 3)
    }  # fmt: skip
    return write(folder / "data_3d_humaneva15.npz", table | changes | {"Unlabeled/S4": {"x": person(90, 15)}})


def starts(protocol: Protocol) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for recording, start in protocol.windows():
        found.setdefault(recording.name, []).append(start)
    return found


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
    kept = [1, 2, 3, 6, 7, 8, 12, 13, 14, 15, 17, 18, 19, 25, 26, 27]
    layout = read_h36m(path).layout
    seen = layout.encode(one.positions, layout.place(one.positions[24]))
    assert np.allclose(seen.reshape(151, 16, 3), file[:, kept] - file[:, :1], atol=1e-6)
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


def test_a_tenth_of_each_persons_actions_is_held_out() -> None:
    """Of 30 actions in 15 pairs three each, and over five people every pair exactly once; one action stays."""
    kept = [held_out(30, person) for person in range(5)]
    assert [len(k) for k in kept] == [3] * 5
    assert sorted(i // 2 for k in kept for i in k) == list(range(15))
    assert held_out(1, 0) == held_out(0, 3) == set()
    assert all(len(held_out(n, s)) == max(1, n // 10) and held_out(n, s) <= set(range(n))
               for n in range(2, 60) for s in range(6))  # fmt: skip


def test_missing_subjects_are_told(tmp_path: Path) -> None:
    """A file with one subject is read and the others are named; one with none is refused."""
    told: list[str] = []
    read_h36m(write(tmp_path / "a.npz", {"S9": {"Waiting": person(130)}}), say=told.append)
    assert any("lacks S1, S5, S6, S7, S8, S11" in line for line in told)
    with pytest.raises(MotionloomError, match=r"none of the subjects .* it has 'S2'"):
        read_h36m(write(tmp_path / "b.npz", {"S2": {"Waiting": person(130)}}))


# HumanEva-I


def test_humaneva_drops_three_chunks_and_short_ones(tmp_path: Path) -> None:
    """By hand: of each five, Jog 2 (74 frames) goes; Train/S3 loses chunks 0 and 2, Validate/S3 chunk 4."""
    read = read_humaneva(humaneva(tmp_path))
    names = {r.name for r in read.recordings}
    all_names = {"Walking 1 chunk0", "Walking 1 chunk2", "Walking 1 chunk4", "Box 1 chunk0"}
    assert {n.removeprefix("Train/S3/") for n in names if n.startswith("Train/S3")} == {
        "Walking 1 chunk4", "Box 1 chunk0",
    }  # fmt: skip
    assert {n.removeprefix("Validate/S3/") for n in names if n.startswith("Validate/S3")} == all_names - {
        "Walking 1 chunk4"
    }
    assert {n.removeprefix("Train/S1/") for n in names if n.startswith("Train/S1")} == all_names
    assert not any("Unlabeled" in n for n in names)
    assert {r.action for r in read.recordings} == {"Walking", "Box"}


def test_humaneva_windows_and_exactly_75_frames(tmp_path: Path) -> None:
    """80 frames give the one window at 0, and 75 none for the test but a recording that training may draw."""
    read = read_humaneva(humaneva(tmp_path))
    found = starts(read)
    assert found["Validate/S1/Walking 1 chunk0"] == [0]
    assert "Validate/S1/Box 1 chunk0" not in found
    assert any(len(r.positions) == 75 for r in read.split("train"))
    assert (read.fps, read.observed, read.future, read.layout.joints) == (60.0, 15, 60, 15)
    assert {r.name.split("/")[0] for r in read.split("test")} == {"Validate"}
    assert {r.name.split("/")[0] for r in read.split("train") + read.split("val")} == {"Train"}
    assert len(read.split("val")) == 3


# AMASS


def z_up(frames: int) -> np.ndarray:
    return person(frames, 22).astype(np.float32)


def amass_folder(root: Path) -> Path:
    """Places of several data sets, old and new names, as .npy at 60 Hz."""
    frames = {"CMU/01/a_poses": 200, "SFU/x/b_poses": 160, "SSM_synced/p/c_poses": 421, "DanceDB/q/d_poses": 420,
              "GRAB/s1/lift_poses": 301, "GRAB/s2/lift_poses": 540, "Unknown/z/e": 900}  # fmt: skip
    for name, count in frames.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        np.save(root / f"{name}.npy", z_up(count))
    return root


def test_amass_windows_and_data_sets(tmp_path: Path) -> None:
    """By hand: from 150 on every 120, so 421 frames give 150 and 270, 420 only 150, 301 one, 540 three."""
    read = read_amass(amass_folder(tmp_path))
    assert starts(read) == {
        "SSM/p/c_poses": [150, 270], "DanceDB/q/d_poses": [150], "GRAB/s1/lift_poses": [150],
        "GRAB/s2/lift_poses": [150, 270],
    }  # fmt: skip
    assert {r.action: r.split for r in read.recordings} == {
        "CMU": "train", "SFU": "val", "SSM": "test", "DanceDB": "test", "GRAB": "test",
    }  # fmt: skip
    assert (read.fps, read.observed, read.future, read.threshold, read.layout.channels) == (60.0, 30, 120, 0.4, 63)
    assert UNIFORM not in read.licence
    assert set(read.speeds) == set(AMASS_SETS["test"]) == set(AMASS_SPEEDS)


def test_amass_data_sets_are_disjoint_and_known_by_their_old_names() -> None:
    """No data set is in two splits, and the archive's first names are the same ones."""
    every = [name for names in AMASS_SETS.values() for name in names]
    assert len(set(every)) == len(every) == 22
    old = {"BioMotionLab_NTroje": "BMLrub", "MPI_Limits": "PosePrior", "TCD_handMocap": "TCDHands", "MPI_mosh": "MoSh",
           "MPI_HDM05": "HDM05", "Eyes_Japan_Dataset": "EyesJapanDataset", "DFaust_67": "DFaust",
           "SSM_synced": "SSM", "Transitions_mocap": "Transitions"}  # fmt: skip
    assert {name: set_name(name) for name in old} == old
    assert set_name("WEIZMANN") is None


def test_amass_places_keep_the_files_axes(tmp_path: Path) -> None:
    """What a network sees are the file's places less the root, +Z up."""
    read = read_amass(amass_folder(tmp_path))
    one = next(r for r in read.recordings if r.action == "CMU")
    seen = read.layout.encode(one.positions, read.layout.place(one.positions[29])).reshape(200, 21, 3)
    assert np.allclose(seen, z_up(200)[:, 1:] - z_up(200)[:, :1], atol=1e-6)


def test_amass_poses_stand_up_and_are_the_uniform_person(tmp_path: Path) -> None:
    """120 Hz become 60; somebody who faces -Y and glides there does so in the file's axes; the licence line says it."""
    amass(tmp_path / "DFaust_67" / "50002" / "hips_poses.npz", frames=700)
    read = read_amass(tmp_path)
    one = read.recordings[0]
    assert (one.name, one.subject, one.action) == ("DFaust/50002/hips_poses", "DFaust/50002", "DFaust")
    assert one.positions.shape == (350, 22, 3)
    seen = read.layout.encode(one.positions, read.layout.place(one.positions[0])).reshape(350, 21, 3)
    head, left_hip, right_hip = seen[0, 14], seen[0, 0], seen[0, 1]
    assert head[2] > 0.5
    assert left_hip[0] > 0.03
    assert right_hip[0] < -0.03
    step = one.positions[1, 0] - one.positions[0, 0]
    assert np.allclose(step, [-1 / 60, 0, 0], atol=1e-6)  # the file's -Y is -X here: (x, y, z) to (y, z, x)
    assert UNIFORM in read.licence


def test_places_made_with_the_body_model_are_preferred(tmp_path: Path) -> None:
    """The same recording as poses and as places is read once, as places; 120 Hz places are thinned to 60."""
    amass(tmp_path / "SOMA" / "a" / "one_poses.npz", frames=700)
    np.save(tmp_path / "SOMA" / "a" / "one_poses.npy", z_up(200))
    np.savez(tmp_path / "SOMA" / "a" / "two_poses.npz", joints=z_up(400), fps=np.array(120.0))
    read = read_amass(tmp_path)
    assert {r.name: len(r.positions) for r in read.recordings} == {"SOMA/a/one_poses": 200, "SOMA/a/two_poses": 200}
    assert np.allclose(read.recordings[1].positions, z_up(400)[::2][..., [1, 2, 0]])


def test_broken_recordings_are_told_and_left_out(tmp_path: Path) -> None:
    """NaN, another number of joints, no archive, a pickle: each is named, and the good one is read."""
    place = amass_folder(tmp_path) / "SOMA" / "a"
    place.mkdir(parents=True)
    np.save(place / "nan.npy", np.full((10, 22, 3), np.nan))
    np.save(place / "joints.npy", z_up(10)[:, :21])
    np.save(place / "object.npy", np.array({"a": 1}, dtype=object))
    (place / "junk_poses.npz").write_bytes(b"PK junk")
    (place / "empty.npy").write_bytes(b"")
    (place / "male_stagei.npz").write_bytes(b"betas of a person, no recording")
    told: list[str] = []
    read = read_amass(tmp_path, say=told.append)
    assert sum(line.startswith("left out SOMA/a/") for line in told) == 5
    assert not any(r.action == "SOMA" for r in read.recordings)


def test_a_published_list_names_the_windows(tmp_path: Path) -> None:
    """pred_init is the first predicted frame; recordings of one name take the rows they are long enough for."""
    folder = amass_folder(tmp_path / "data")
    rows = ["dataset,file,file_idx,pred_init,pred_end", "SSM,c_poses,4,300,419", "GRAB,lift_poses,0,180,299",
            "GRAB,lift_poses,7,180,299", "GRAB,lift_poses,7,300,419", "SSM,gone_poses,5,180,299"]  # fmt: skip
    (tmp_path / "list.csv").write_text("\n".join(rows))
    told: list[str] = []
    read = read_amass(folder, segments=tmp_path / "list.csv", say=told.append)
    assert read.listed == (
        ("SSM/p/c_poses", 270), ("GRAB/s1/lift_poses", 150), ("GRAB/s2/lift_poses", 150), ("GRAB/s2/lift_poses", 270),
    )  # fmt: skip
    assert [(r.name, s) for r, s in read.windows()] == list(read.listed)
    assert any("1 of the 5 windows of list.csv are not there" in line for line in told)


def test_a_list_of_ones_own_names_files_and_first_frames(tmp_path: Path) -> None:
    """The same windows out of .json pairs and out of .csv with file and first."""
    folder = amass_folder(tmp_path / "data")
    (tmp_path / "l.json").write_text(json.dumps([["SSM_synced/p/c_poses.npz", 12], ["GRAB/s2/lift_poses", 390]]))
    (tmp_path / "l.csv").write_text("file,first\nSSM_synced/p/c_poses.npz,12\nGRAB/s2/lift_poses,390\n")
    expected = (("SSM/p/c_poses", 12), ("GRAB/s2/lift_poses", 390))
    assert read_amass(folder, segments=tmp_path / "l.json").listed == expected
    assert find_protocol(folder, segments=tmp_path / "l.csv").listed == expected


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", "dataset,file,pred_init\nSSM,c_poses,20\n"),  # begins at -10
        ("b.csv", "dataset,file,file_idx,pred_init,pred_end\nSSM,c_poses,4,180,659\n"),  # another length
        ("c.csv", "who,when\nme,now\n"), ("d.csv", "file,first\n"), ("e.json", "[[1]]"), ("f.json", "{"),
        ("g.json", "[" * 100_000), ("h.csv", "file,first\nSSM/p/none,0\n"), ("i.json", "7"),
    ],
)  # fmt: skip
def test_unusable_lists_are_refused(tmp_path: Path, name: str, content: str) -> None:
    """Each with one short sentence that names the list."""
    (tmp_path / name).write_text(content)
    with pytest.raises(MotionloomError, match=name.replace(".", r"\.")) as error:
        read_amass(amass_folder(tmp_path / "data"), segments=tmp_path / name)
    assert len(str(error.value)) < 500
    assert "\n" not in str(error.value)


# Pickles that are not run


@pytest.mark.parametrize("protocol", [2, 3, 4])
@pytest.mark.parametrize("order", ["C", "F"])
def test_objects_are_read_as_numpy_would(tmp_path: Path, protocol: int, order: Any) -> None:
    """Every protocol that NumPy has written files with, kinds of numbers, big-endian, Fortran order, empty arrays."""
    table = {
        "S1": {"a": np.asarray(np.random.default_rng(0).normal(size=(5, 3, 3)), dtype="<f4", order=order)},
        "S2": {"a": np.arange(6, dtype=">f8").reshape(2, 3), "b": np.empty((0, 3)), "c": np.arange(3, dtype=np.int16)},
    }
    found = read_tables(hostile(tmp_path, pickle.dumps(table, protocol=protocol)), "positions_3d")
    assert list(found) == list(table)
    for subject, actions in table.items():
        assert list(found[subject]) == list(actions)
        for action, array in actions.items():
            assert found[subject][action].dtype == array.dtype
            assert np.array_equal(found[subject][action], array)


def test_the_files_of_older_numpy_are_read(tmp_path: Path) -> None:
    """Before NumPy 2 the same function had its place in numpy.core."""
    data = pickle.dumps({"S1": {"a": np.ones((2, 2), np.float32)}}, protocol=2)
    older = hostile(tmp_path, data.replace(b"numpy._core.multiarray", b"numpy.core.multiarray"))
    assert np.array_equal(read_tables(older, "positions_3d")["S1"]["a"], np.ones((2, 2)))


class Shell:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch owned",)


def hostile(
    tmp_path: Path, data: bytes, header: str = "{'descr': '|O', 'fortran_order': False, 'shape': (), }"
) -> Path:
    text = header.encode().ljust(117) + b"\n"
    member = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("positions_3d.npy", member)
    path = tmp_path / "data_3d_h36m.npz"
    path.write_bytes(buffer.getvalue())
    return path


GOOD = pickle.dumps({"S1": {"Waiting": np.zeros((3, 32, 3), np.float32)}}, protocol=3)
HOSTILE: dict[str, bytes] = {
    "a shell": pickle.dumps({"S1": Shell()}),
    "a shell, old": b"cposix\nsystem\n(S'touch owned'\ntR.",
    "eval": b"\x80\x02c__builtin__\neval\nX\x01\x00\x00\x001\x85R.",
    "a loader": b"\x80\x02cnumpy\nload\nX\x01\x00\x00\x00x\x85R.",
    "numpy calls itself": b"\x80\x02cnumpy\nndarray\n(K\x01tR.",
    "inst": b"(S'touch owned'\niposix\nsystem\n.",
    "cut": GOOD[:-9],
    "nothing": b"",
    "text": b"hello",
    "no table": pickle.dumps([1, 2]),
    "a flat table": pickle.dumps({"S1": np.zeros((3, 32, 3))}),
    "numbers as keys": pickle.dumps({1: {"a": np.zeros(3)}}),
    "objects in an array": pickle.dumps({"S1": {"a": np.array([{}, {}], dtype=object)}}),
    "numbers as inner keys": pickle.dumps({"S1": {1: np.zeros(3)}}),
    "truth in an array": pickle.dumps({"S1": {"a": np.ones(3, bool)}}),
    "text in an array": pickle.dumps({"S1": {"a": np.array(["x"])}}),
    "a complex array": pickle.dumps({"S1": {"a": np.zeros(3, complex)}}),
    "a scalar": pickle.dumps({"S1": {"a": np.float32(3)}}),
    "a set": pickle.dumps({"S1": {"a": {1, 2}}}),
    "a huge shape": GOOD.replace(b"K\x03K K\x03\x87", b"J\xff\xff\xff\x7fJ\xff\xff\xff\x7fJ\xff\xff\xff\x7f\x87"),
    "a negative shape": GOOD.replace(b"K\x03K K\x03\x87", b"J\xfd\xff\xff\xffJ\xe0\xff\xff\xffK\x03\x87"),
    "deep": b"\x80\x02" + b"]" * 20_000 + b"a" * 19_999 + b".",
    "no key": b"\x80\x02}(]]u.",
    "a memo of nobody": b"\x80\x02h\x07.",
    "a million words": b"\x80\x04\x8e" + struct.pack("<Q", 1 << 62) + b"x.",
}


@pytest.mark.parametrize("kind", list(HOSTILE))
def test_hostile_pickles_are_refused_in_a_sentence(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is run, the message is short and names the file."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MotionloomError, match=r"data_3d_h36m\.npz") as error:
        read_h36m(hostile(tmp_path, HOSTILE[kind]))
    assert not (tmp_path / "owned").exists()
    assert len(str(error.value)) < 400
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["a complex array", "text in an array", "truth in an array", "objects in an array"])
def test_only_arrays_of_numbers_are_tables(tmp_path: Path, kind: str) -> None:
    """Whoever asks for the tables need not look again."""
    with pytest.raises(MotionloomError, match="else than arrays of numbers"):
        read_tables(hostile(tmp_path, HOSTILE[kind]), "positions_3d")


def test_the_hostile_shapes_do_replace_the_good_one(tmp_path: Path) -> None:
    """The cases above differ from a file that is read in the shape alone."""
    assert read_tables(hostile(tmp_path, GOOD), "positions_3d")["S1"]["Waiting"].shape == (3, 32, 3)
    assert HOSTILE["a huge shape"] != GOOD != HOSTILE["a negative shape"]


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.zeros((130, 17, 3), np.float32), r"\(130, 17, 3\)"), (np.zeros((130, 96), np.float32), r"\(130, 96\)"),
        (np.zeros((0, 32, 3), np.float32), r"\(0, 32, 3\)"), (np.zeros((130, 32, 3), np.int32), "int32"),
        (np.full((130, 32, 3), np.nan, np.float32), "not finite"), (np.full((130, 32, 3), np.inf), "not finite"),
        (np.full((130, 32, 3), 900.0), "in metres"),
    ],
    ids=["17 joints", "flat", "empty", "whole numbers", "nan", "inf", "millimetres"],
)  # fmt: skip
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
