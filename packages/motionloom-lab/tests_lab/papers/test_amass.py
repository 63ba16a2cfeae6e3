"""AMASS out of small made-up files: data sets, windows, axes, lists of windows."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.amass import AMASS_SETS, AMASS_SPEEDS, UNIFORM, read_amass, set_name
from motionloom_lab.papers.benchmarks import (
    find_protocol,
)
from tests_lab.papers.benchmark_files import amass_folder, starts, z_up
from tests_lab.papers.test_babel import amass


def test_amass_windows_and_data_sets(tmp_path: Path) -> None:
    """By hand: from 150 on every 120, so 421 frames give 150 and 270, 420 only 150, 301 one, 540 three."""
    read = read_amass(amass_folder(tmp_path))
    assert starts(read) == {
        "SSM/p/c_poses": [150, 270],
        "DanceDB/q/d_poses": [150],
        "GRAB/s1/lift_poses": [150],
        "GRAB/s2/lift_poses": [150, 270],
    }
    assert {r.action: r.split for r in read.recordings} == {
        "CMU": "train",
        "SFU": "val",
        "SSM": "test",
        "DanceDB": "test",
        "GRAB": "test",
    }
    assert (read.fps, read.observed, read.future, read.threshold, read.layout.channels) == (60.0, 30, 120, 0.4, 63)
    assert UNIFORM not in read.licence
    assert set(read.speeds) == set(AMASS_SETS["test"]) == set(AMASS_SPEEDS)
    assert sum(AMASS_SPEEDS.values()) == pytest.approx(0.0410691)


def test_amass_data_sets_are_disjoint_and_known_by_their_old_names() -> None:
    """No data set is in two splits, and the archive's first names are the same ones."""
    every = [name for names in AMASS_SETS.values() for name in names]
    assert len(set(every)) == len(every) == 22
    old = {
        "BioMotionLab_NTroje": "BMLrub",
        "MPI_Limits": "PosePrior",
        "TCD_handMocap": "TCDHands",
        "MPI_mosh": "MoSh",
        "MPI_HDM05": "HDM05",
        "Eyes_Japan_Dataset": "EyesJapanDataset",
        "DFaust_67": "DFaust",
        "SSM_synced": "SSM",
        "Transitions_mocap": "Transitions",
    }
    assert {name: set_name(name) for name in old} == old
    assert set_name("WEIZMANN") is None


def test_amass_places_keep_the_files_axes(tmp_path: Path) -> None:
    """What a network sees are the file's places less the root, +Z up."""
    read = read_amass(amass_folder(tmp_path))
    one = next(r for r in read.recordings if r.action == "CMU")
    features = read.layout.encode(one.positions, read.layout.place(one.positions[29])).reshape(200, 21, 3)
    assert np.allclose(features, z_up(200)[:, 1:] - z_up(200)[:, :1], atol=1e-6)


def test_amass_poses_stand_up_and_are_the_uniform_person(tmp_path: Path) -> None:
    """120 Hz become 60; somebody who faces -Y and glides there does so in the file's axes; the licence line says it."""
    amass(tmp_path / "DFaust_67" / "50002" / "hips_poses.npz", frames=700)
    read = read_amass(tmp_path)
    one = read.recordings[0]
    assert (one.name, one.subject, one.action) == ("DFaust/50002/hips_poses", "DFaust/50002", "DFaust")
    assert one.positions.shape == (350, 22, 3)
    features = read.layout.encode(one.positions, read.layout.place(one.positions[0])).reshape(350, 21, 3)
    head, left_hip, right_hip = features[0, 14], features[0, 0], features[0, 1]
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


def test_broken_recordings_are_reported_and_left_out(tmp_path: Path) -> None:
    """NaN, another number of joints, no archive, a pickle: each is named, and the good one is read."""
    place = amass_folder(tmp_path) / "SOMA" / "a"
    place.mkdir(parents=True)
    np.save(place / "nan.npy", np.full((10, 22, 3), np.nan))
    np.save(place / "joints.npy", z_up(10)[:, :21])
    np.save(place / "object.npy", np.array({"a": 1}, dtype=object))
    (place / "junk_poses.npz").write_bytes(b"PK junk")
    (place / "empty.npy").write_bytes(b"")
    (place / "male_stagei.npz").write_bytes(b"betas of a person, no recording")
    lines: list[str] = []
    read = read_amass(tmp_path, say=lines.append)
    assert sum(line.startswith("left out SOMA/a/") for line in lines) == 5
    assert not any(r.action == "SOMA" for r in read.recordings)


def test_a_published_list_names_the_windows(tmp_path: Path) -> None:
    """pred_init is the first predicted frame; recordings of one name take the rows they are long enough for."""
    folder = amass_folder(tmp_path / "data")
    rows = [
        "dataset,file,file_idx,pred_init,pred_end",
        "SSM,c_poses,4,300,419",
        "GRAB,lift_poses,0,180,299",
        "GRAB,lift_poses,7,180,299",
        "GRAB,lift_poses,7,300,419",
        "SSM,gone_poses,5,180,299",
    ]
    (tmp_path / "list.csv").write_text("\n".join(rows))
    lines: list[str] = []
    read = read_amass(folder, segments=tmp_path / "list.csv", say=lines.append)
    assert read.listed == (
        ("SSM/p/c_poses", 270),
        ("GRAB/s1/lift_poses", 150),
        ("GRAB/s2/lift_poses", 150),
        ("GRAB/s2/lift_poses", 270),
    )
    assert [(r.name, s) for r, s in read.windows()] == list(read.listed)
    assert any("1 of the 5 windows of list.csv are not there" in line for line in lines)


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
        ("c.csv", "who,when\nme,now\n"),
        ("d.csv", "file,first\n"),
        ("e.json", "[[1]]"),
        ("f.json", "{"),
        ("g.json", "[" * 100_000),
        ("h.csv", "file,first\nSSM/p/none,0\n"),
        ("i.json", "7"),
    ],
)
def test_unusable_lists_are_refused(tmp_path: Path, name: str, content: str) -> None:
    """Each with one short sentence that names the list."""
    (tmp_path / name).write_text(content)
    with pytest.raises(MotionloomError, match=name.replace(".", r"\.")) as error:
        read_amass(amass_folder(tmp_path / "data"), segments=tmp_path / name)
    assert len(str(error.value)) < 500
    assert "\n" not in str(error.value)
