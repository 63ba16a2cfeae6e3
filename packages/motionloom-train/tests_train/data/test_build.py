"""`data build` on folders made here: layouts, splits, copies, what is dropped, and going on after a stop."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom_train.data import augment
from motionloom_train.data import build as building
from motionloom_train.data.actions import ACTIONS, sentences
from motionloom_train.data.batches import Batches
from motionloom_train.data.build import _mirrored_texts, _with_mirror, build, join_spans
from motionloom_train.data.clips import Clip, Note, read_clip, write_clip
from motionloom_train.data.derived import mixed_clips
from motionloom_train.data.sets import load_set, read_clips
from motionloom_train.data.sources import BANDAI_LICENCE, CMU_LICENCE, UNKNOWN_LICENCE, Take, find_takes
from tests.kinematics import people
from tests_train.data import people as recordings


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two training clips, one for validation, one too short, one that is no BVH."""
    clips = {
        "go": (recordings.walker(), "train", "walk, veer left"),
        "back": (recordings.walker(-1.0), "train", ""),
        "kept": (recordings.walker(0.9), "val", "walk"),
        "blink": (recordings.walker(seconds=0.6), "train", ""),
    }
    folder = recordings.write_pack(
        tmp_path_factory.mktemp("pack") / "pack", clips, {"go": "a person walks to the left"}
    )
    (folder / "bvh" / "broken.bvh").write_bytes(b"HIERARCHY\nROOT")
    with open(folder / "manifest.csv", "a") as file:
        file.write("bvh/broken.bvh,cmu,broken,20,1.0,train,,1.0\n")
    return folder


@pytest.fixture(scope="module")
def built(pack: Path) -> tuple[Path, list[str]]:
    lines: list[str] = []
    out = pack.parent / "set"
    build([pack], out, workers=1, mixed=0, progress=lines.append)
    return out, lines


def by_name(folder: Path) -> dict[str, Clip]:
    return {clip.name: clip for clip in read_clips(folder, splits=("train", "val"))}


def test_every_take_is_there_or_dropped_with_a_reason(built: tuple[Path, list[str]]) -> None:
    out, lines = built
    assert {"go", "Mgo", "back", "Mback", "kept", "Mkept"} <= by_name(out).keys()
    dropped = json.loads((out / "set.json").read_text())["dropped"]
    assert set(dropped) == {"blink", "broken"}
    assert "0.6" in dropped["blink"]
    assert {line.split(":")[0] for line in lines if line.startswith("dropped")} == {"dropped blink", "dropped broken"}


def test_only_training_clips_are_multiplied(built: tuple[Path, list[str]]) -> None:
    """The validation clip has its mirrored copy and nothing else; the training walk is bent and reversed too."""
    clips = by_name(built[0])
    assert {c.name for c in clips.values() if c.split == "val"} == {"kept", "Mkept"}
    assert {"bent", "reversed", "looped"} <= {c.way for c in clips.values() if c.name.startswith("go")}
    assert all(c.licence == CMU_LICENCE for c in clips.values())


def test_captions_and_labels_are_those_of_the_clip_and_are_mirrored(built: tuple[Path, list[str]]) -> None:
    clips = by_name(built[0])

    def texts(name: str) -> dict[str, tuple[str, ...]]:
        return {note.kind: note.texts for note in clips[name].notes}

    assert texts("go")["human"] == ("a person walks to the left",)
    assert texts("Mgo")["human"] == ("a person walks to the right",)
    assert any("left" in text for text in texts("go")["index"])
    assert "walk" in texts("go")
    assert "walk backward" in texts("back")
    assert "walk backward" in texts("go_reversed")


def test_features_are_those_of_the_recording(built: tuple[Path, list[str]]) -> None:
    """What a clip decodes to walks ahead at the recorded speed, facing +Z, as long as the recording less a frame."""
    positions = hml.decode_positions(by_name(built[0])["go"].features.astype(np.float64))
    assert len(positions) == 79
    assert positions[-1, 0, 2] - positions[0, 0, 2] == pytest.approx(1.2 * 78 / 20, rel=0.1)
    assert abs(positions[-1, 0, 0]) < 0.1


def test_mean_and_std_are_of_the_training_split(built: tuple[Path, list[str]]) -> None:
    about = json.loads((built[0] / "set.json").read_text())
    frames = np.concatenate([c.features for c in by_name(built[0]).values() if c.split == "train"]).astype(np.float64)
    np.testing.assert_allclose(about["mean"], frames.mean(0), atol=1e-5)
    np.testing.assert_allclose(about["std"], frames.std(0), atol=1e-5)


def test_a_second_run_has_nothing_to_do(built: tuple[Path, list[str]], pack: Path) -> None:
    out, lines = built[0], []
    before = {p: p.stat().st_mtime_ns for p in (out / "clips").iterdir()}
    build([pack], out, workers=1, mixed=0, progress=lines.append)
    assert lines[0] == "0 takes to do, 5 already done"
    assert {p: p.stat().st_mtime_ns for p in (out / "clips").iterdir()} == before


KILLED = """
import os, pathlib, signal, sys
from motionloom_train.data import build

def written(folder, clip, write=build.write_clip):
    write(folder, clip)
    if any((folder.parent / "done").glob("[a-z]*")):
        os.kill(os.getpid(), signal.SIGKILL)

build.write_clip = written
build.build([sys.argv[1]], pathlib.Path(sys.argv[2]), workers=1, mixed=0)
"""


def test_a_killed_build_goes_on(built: tuple[Path, list[str]], pack: Path, tmp_path: Path) -> None:
    """Killed behind the first clip that is written after a take is done; the second run ends with the same files."""
    out = tmp_path / "set"
    running = subprocess.run([sys.executable, "-c", KILLED, pack, out], stdout=subprocess.DEVNULL, check=False)
    assert running.returncode == -signal.SIGKILL
    assert 0 < len(list((out / "done").glob("[a-z]*"))) < 5
    build([pack], out, workers=1, mixed=0, progress=lambda line: None)
    names = {p.name for p in (out / "clips").iterdir() if not p.name.startswith(".")}
    assert names == {p.name for p in (built[0] / "clips").iterdir()}
    assert (out / "set.json").read_bytes() == (built[0] / "set.json").read_bytes()


def test_a_built_set_is_drawn_from_by_step_alone(built: tuple[Path, list[str]]) -> None:
    motions = load_set(built[0], seed=3)
    a, b = Batches(motions, windows=[40], shares=[1.0]), Batches(motions, windows=[40], shares=[1.0])
    b.draw(0, 1, 4)
    first, again = a.draw(0, 7, 4), b.draw(0, 7, 4)
    assert np.array_equal(first.features, again.features)
    assert np.array_equal(first.texts, again.texts)
    assert not np.array_equal(first.features, a.draw(0, 8, 4).features)
    assert bool((first.features[0, int(first.lengths[0]) :] == 0).all())


def test_windows_longer_than_the_set_are_refused(built: tuple[Path, list[str]]) -> None:
    with pytest.raises(MotionloomError, match="900 frames"):
        Batches(load_set(built[0]), windows=[900], shares=[1.0])


def test_a_folder_that_is_no_set_and_sources_that_are_not_in_it(built: tuple[Path, list[str]], tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=r"set\.json"):
        load_set(tmp_path)
    with pytest.raises(MotionloomError, match="bandai"):
        load_set(built[0], sources=["bandai"])


def clip(**changes) -> Clip:
    features = np.zeros((30, 263), np.float32)
    values = {
        "name": "a",
        "source": "cmu",
        "licence": "x",
        "split": "train",
        "way": "plain",
        "notes": (),
        "features": features,
    }
    return Clip(**(values | changes))


@pytest.mark.parametrize(
    "bad",
    [
        {"features": np.zeros((30, 9), np.float32)},
        {"features": np.full((30, 263), np.nan, np.float32)},
        {"notes": (Note(0, 31, "walk"),)},
        {"notes": (Note(5, 5, "walk"),)},
        {"notes": (Note(0, 9, "fly"),)},
        {"notes": (Note(0, 9, "human"),)},
        {"split": 3},
        {"kind": {"made": 1}},
        {"kind": "drawn"},
    ],
    ids=str,
)
def test_damaged_clips_are_refused(tmp_path: Path, bad: dict) -> None:
    write_clip(tmp_path, clip(notes=(Note(0, 30, "walk"), Note(0, 20, "human", ("a",)))))
    assert len(read_clip(tmp_path / "a.safetensors").notes) == 2
    write_clip(tmp_path, clip(**bad))
    with pytest.raises(MotionloomError, match="build again"):
        read_clip(tmp_path / "a.safetensors")


def test_truncated_clips_are_refused(tmp_path: Path) -> None:
    write_clip(tmp_path, clip())
    path = tmp_path / "a.safetensors"
    path.write_bytes(path.read_bytes()[:-50])
    with pytest.raises(MotionloomError, match="build again"):
        read_clip(path)


def test_states_are_joined_and_events_are_not() -> None:
    spans = [(0, 50, "walk"), (10, 60, "walk"), (200, 250, "walk"), (0, 50, "jump"), (10, 60, "jump")]
    assert sorted(join_spans(spans)) == [(0, 50, "jump"), (0, 60, "walk"), (10, 60, "jump"), (200, 250, "walk")]


def test_mixed_clips_wear_the_arms_of_one_licence() -> None:
    walk = hml.encode(hml.canonical(people.walking(1.2)), heading="corrected")
    waver = people.standing()
    waver[:, (19, 21), 1] += 0.9
    wave = hml.encode(hml.canonical(waver), heading="corrected")
    body = clip(name="w", features=walk, notes=(Note(0, len(walk), "walk"),))
    arms = clip(name="v", features=wave, notes=(Note(0, len(wave), "wave"),))
    mixed = list(mixed_clips([body, arms], 3, seed=1))
    assert [c.notes[0].kind for c in mixed] == ["walk+wave"] * 3
    assert [c.way for c in mixed] == ["mixed"] * 3
    assert list(mixed_clips([body, clip(name="v", features=wave, licence="y", notes=arms.notes)], 3)) == []
    assert list(mixed_clips([clip(name="w", features=walk, notes=body.notes, split="val"), arms], 3)) == []


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (("../../etc/passwd.bvh", "cmu", "a", 20, 1, "train", "", 1.0), "leads out"),
        (("/etc/passwd.bvh", "cmu", "a", 20, 1, "train", "", 1.0), "leads out"),
        (("a.bvh", "cmu", "../a", 20, 1, "train", "", 1.0), "name of a clip"),
        (("a.bvh", "cmu", "a", "fast", 1, "train", "", 1.0), "mend it"),
        (("a.bvh", "cmu", "a", 20, 1, "training", "", 1.0), "mend it"),
        (("a.bvh", "cmu", "a"), "mend it"),
    ],
    ids=str,
)
def test_manifests_that_lead_astray_are_refused(tmp_path: Path, row: tuple, reason: str) -> None:
    recordings.write_manifest(tmp_path, [row])
    with pytest.raises(MotionloomError, match=reason):
        build([tmp_path], tmp_path / "set", workers=1, progress=lambda line: None)
    assert not (tmp_path / "set").exists()


@pytest.mark.parametrize("column", recordings.COLUMNS, ids=str)
def test_a_row_with_an_empty_cell_is_left_out_by_name_and_the_build_goes_on(tmp_path: Path, column: str) -> None:
    clips = {name: (recordings.walker(), "train", "walk") for name in ("first", "second")}
    folder = recordings.write_pack(tmp_path / "pack", clips)
    lines = (folder / "manifest.csv").read_text().splitlines()
    cells = lines[1].split(",")
    cells[recordings.COLUMNS.index(column)] = ""
    (folder / "manifest.csv").write_text("\n".join([lines[0], ",".join(cells), lines[2]]))
    said: list[str] = []
    path = build([folder], tmp_path / "set", workers=1, mixed=0, progress=said.append)
    dropped = json.loads(path.read_text())["dropped"]
    if column == "description":
        assert not dropped
    else:
        (reason,) = dropped.values()
        assert f"manifest.csv has nothing under {column}" in reason
        assert reason.startswith("line 2 of")
        assert any(line.startswith("dropped ") and "line 2" in line for line in said)
    assert "second" in by_name(tmp_path / "set")


@pytest.mark.parametrize("unit", ["", 1.0])
def test_places_of_joints_are_read_from_a_manifest(tmp_path: Path, unit: str | float) -> None:
    walk = hml.uniform(recordings.walker())
    np.savez(tmp_path / "walk.npz", positions=walk)
    recordings.write_manifest(tmp_path, [("walk.npz", "mine", "walk", 20, 4, "train", "a person walks", unit)])
    build([tmp_path], tmp_path / "set", workers=1, mixed=0, progress=lambda line: None)
    np.testing.assert_allclose(by_name(tmp_path / "set")["walk"].positions()[:, 21, 2], walk[:-1, 21, 2], atol=0.01)


def test_a_licence_is_never_made_up(tmp_path: Path) -> None:
    """Only sources called cmu or bandai get those licences; a manifest may state its own."""
    rows = [(f"{n}.bvh", n, n, 20, 1, "train", "", 1.0) for n in ("cmu-x", "bandai-1", "mine")]
    recordings.write_manifest(tmp_path, rows)
    assert [t.licence for t in find_takes(tmp_path)] == [CMU_LICENCE, BANDAI_LICENCE, UNKNOWN_LICENCE]
    text = (tmp_path / "manifest.csv").read_text().splitlines()
    (tmp_path / "manifest.csv").write_text("\n".join([text[0] + ",licence", *(line + ",CC0" for line in text[1:])]))
    assert {t.licence for t in find_takes(tmp_path)} == {"CC0"}


def test_a_humanml3d_folder_is_recognised(tmp_path: Path) -> None:
    """Features are taken as they are, mirrored names are skipped (copies are made here), timed texts are spans."""
    (tmp_path / "new_joint_vecs").mkdir()
    (tmp_path / "texts").mkdir()
    walk = hml.encode(hml.canonical(people.walking(1.2)), heading="corrected")
    for name in ("000001", "M000001", "000002"):
        np.save(tmp_path / "new_joint_vecs" / f"{name}.npy", walk)
    lines = ["a man walks left.#a/DET man/NOUN#0.0#0.0", "he steps#he/PRON#1.0#2.5", "no times"]
    (tmp_path / "texts" / "000001.txt").write_text("\n".join(lines))
    for split, names in (("train", "000001\nM000001\n"), ("val", "000002\n"), ("test", "")):
        (tmp_path / f"{split}.txt").write_text(names)
    build([tmp_path], tmp_path / "set", workers=1, mixed=0, progress=lambda line: None)
    clips = by_name(tmp_path / "set")
    assert set(clips) == {"000001", "M000001", "000002", "M000002"}
    np.testing.assert_array_equal(clips["000001"].features, walk)
    human = [(n.first, n.last, n.texts) for n in clips["000001"].notes if n.kind == "human"]
    assert human == [(0, len(walk), ("a man walks left.",)), (20, 50, ("he steps",))]
    assert "humanml" in clips["000002"].source


@pytest.mark.parametrize(
    "array", [np.zeros((5, 7)), np.zeros(263), np.array(["x"]), None], ids=["shape", "flat", "text", "cut"]
)
def test_humanml3d_arrays_are_checked(tmp_path: Path, array: np.ndarray | None) -> None:
    (tmp_path / "new_joint_vecs").mkdir()
    path = tmp_path / "new_joint_vecs" / "000001.npy"
    np.save(path, np.zeros((900, 263)) if array is None else array)
    if array is None:
        path.write_bytes(path.read_bytes()[:500])
    for split in ("train", "val", "test"):
        (tmp_path / f"{split}.txt").write_text("000001\n" if split == "train" else "")
    with pytest.raises(MotionloomError, match=r"not an array of finite features|is damaged"):
        find_takes(tmp_path)[0].read()


def test_a_cmu_download_is_recognised(tmp_path: Path) -> None:
    """Subject folders with one skeleton each; index text and HumanML3D captions find their take."""
    (tmp_path / "07").mkdir()
    for name in ("07_01", "07_02"):
        (tmp_path / "07" / f"{name}.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n")
    (tmp_path / "07" / "07.asf").write_text("")
    (tmp_path / "cmu-mocap-index-text.txt").write_text("Subject #7 (walk)\n07_01\tslow walk\n07_02   forward jump\n")
    row = {
        "amass_path": "./pose_data/CMU/07/07_01_poses.npy",
        "mirrored": False,
        "start_s": 1.0,
        "end_s": None,
        "split": "test",
        "captions": [{"text": "a man strolls", "from_s": 0, "to_s": 0}, {"text": "part", "from_s": 1, "to_s": 2}],
    }
    captions = tmp_path / "captions.jsonl"
    captions.write_text(json.dumps(row) + "\n" + json.dumps(row | {"mirrored": True}))
    takes = {take.name: take for take in find_takes(tmp_path, captions=captions)}
    assert set(takes) == {"07_01", "07_02"}
    assert takes["07_01"].split == "test"
    assert takes["07_01"].spans[0].texts == ("a man strolls",)
    assert takes["07_01"].spans[0].start_s == 1.0
    assert any("slowly" in text for text in takes["07_01"].spans[1].texts)
    assert takes["07_02"].split == "train"
    assert takes["07_02"].licence == CMU_LICENCE
    with pytest.raises(MotionloomError):  # a take that is found may still be unreadable: it is dropped with this reason
        takes["07_01"].read()


def test_a_plain_folder_of_bvh_files_is_ones_own(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "stroll.bvh").write_text("")
    (take,) = find_takes(tmp_path)
    assert (take.name, take.source, take.licence, take.split) == ("stroll", "own", UNKNOWN_LICENCE, "train")


@pytest.mark.parametrize("content", ["{", '{"amass_path": 3}', "[]", '{"amass_path": "CMU/7/7_1_poses"}'])
def test_captions_of_another_kind_are_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.bvh").write_text("")
    (tmp_path / "captions.jsonl").write_text(content)
    with pytest.raises(MotionloomError, match=r"captions\.jsonl"):
        find_takes(tmp_path, captions=tmp_path / "captions.jsonl")


def test_folders_with_nothing_in_them_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=r"manifest\.csv"):
        find_takes(tmp_path)
    with pytest.raises(MotionloomError, match="not a folder"):
        find_takes(tmp_path / "absent")


def test_the_same_name_twice_is_reported(tmp_path: Path) -> None:
    for part in ("a", "b"):
        recordings.write_bvh(tmp_path / part / "same.bvh", recordings.walker(seconds=2.0))
    lines: list[str] = []
    build([tmp_path / "a", tmp_path / "b"], tmp_path / "set", workers=1, mixed=0, progress=lines.append)
    assert any("second same" in line for line in lines)


def die(job: building.Job) -> None:
    os._exit(1)


def test_a_worker_that_dies_is_reported(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several takes and workers, one of which is killed: one sentence, and finished takes are kept."""
    monkeypatch.setattr(building, "_prepare", die)
    with pytest.raises(MotionloomError, match="worker"):
        build([pack], tmp_path / "set", workers=2, progress=lambda line: None)


def test_takes_left_out_leave_nothing_behind(pack: Path, built: tuple[Path, list[str]], tmp_path: Path) -> None:
    """Neither themselves nor copies; a name that no take has, and a folder that holds one already, are refused."""
    build([pack], tmp_path / "set", workers=1, mixed=0, exclude=["go", "bl"], progress=lambda line: None)
    left = {name for name in by_name(built[0]) if not name.removeprefix("M").startswith("go")}
    assert by_name(tmp_path / "set").keys() == left
    assert set(json.loads((tmp_path / "set" / "set.json").read_text())["dropped"]) == {"broken"}
    with pytest.raises(MotionloomError, match="'nobody'"):
        build([pack], tmp_path / "other", workers=1, exclude=["nobody"])
    assert not (tmp_path / "other").exists()
    with pytest.raises(MotionloomError, match="already holds go"):
        build([pack], built[0], workers=1, exclude=["go"])


def test_a_turn_to_the_right_is_only_described_with_its_side() -> None:
    """The average of turning round to either side is a straight walk, so that one side goes without saying."""
    action = ACTIONS["walk turn around"]
    note = Note(0, 90, "action:walk turn around", sentences(action, side="left"))
    assert any("left" not in text for text in note.texts)
    mirrored = _mirrored_texts(note)
    assert mirrored
    assert all("right" in text for text in mirrored)
    assert _mirrored_texts(Note(0, 90, note.kind, mirrored)) == note.texts
    assert _mirrored_texts(Note(0, 90, "human", ("he turns left",))) == ("he turns right",)


def test_the_mirror_image_of_a_sway_is_not_shown() -> None:
    """It begins to the other side, and the same words for both would mean standing still."""
    features = hml.encode(hml.canonical(people.walking(1.0, 4.0)), heading="corrected")
    notes = (
        Note(0, len(features), "action:sway", ("a person sways",), (16, 56)),
        Note(0, len(features), "walk"),
    )
    plain, mirrored = _with_mirror(Clip("posture_0", "cmu", "free", "train", "made", notes, features, "made"))
    assert [note.kind for note in plain.notes] == ["action:sway", "walk"]
    assert [note.kind for note in mirrored.notes] == ["walk"]


def test_who_stands_in_a_bent_clip_does_not_turn_around() -> None:
    """The curve is added to every frame: who does not walk is turned like a statue."""
    features = augment.bend(hml.encode(hml.canonical(people.standing(6.0)), heading="corrected"), 1.0 / 20)
    take = Take("a", "cmu", "free", "train", (), lambda: features)
    kinds = {way: {n.kind for n in building._clip(take, features, way).notes} for way in ("plain", "bent")}
    assert "turn around" in kinds["plain"]
    assert not any(kind.startswith("turn ") for kind in kinds["bent"])
