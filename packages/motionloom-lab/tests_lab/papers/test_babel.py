"""BABEL's label files and AMASS recordings, made up in the published form: what is read, paired, cut and refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import babel as codec
from motionloom.core.features.babel import decode
from motionloom.core.motion import Motion
from motionloom_lab.papers import babel
from motionloom_lab.papers.babel import Recording, Segment
from motionloom_lab.papers.readers import find_takes
from motionloom_train.data.build import build
from motionloom_train.data.clips import read_clip

PLACE = "CMU/CMU/01/01_01_poses.npz"


def label(text: str, start: float, end: float, acts: list[str] | None = None) -> dict[str, Any]:
    """One entry of ``frame_ann``, as distributed."""
    return {
        "raw_label": f"{text}s",
        "proc_label": text,
        "seg_id": "x",
        "act_cat": acts or [text],
        "start_t": start,
        "end_t": end,
    }


def entry(labels: list[dict[str, Any]] | None, place: str = PLACE) -> dict[str, Any]:
    """One sequence of ``train.json``; None: nobody labelled its parts."""
    whole = {"raw_label": "walking around", "proc_label": "walk around", "seg_id": "y", "act_cat": ["walk"]}
    parts = None if labels is None else {"babel_lid": "l", "anntr_id": "a", "mul_act": True, "labels": labels}
    return {
        "babel_sid": 12,
        "url": "https://x",
        "feat_p": place,
        "dur": 10.0,
        "frame_ann": parts,
        "seq_ann": {"babel_lid": "m", "anntr_id": "b", "mul_act": True, "labels": [whole]},
    }


def amass(path: Path, *, frames: int = 1200, fps: float = 120.0, speed: float = 1.0, **changes: Any) -> Path:
    """Somebody in the T-pose (SMPL-H, 156 numbers) who faces -Y of the +Z-up world and glides there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    poses, trans = np.zeros((frames, 156)), np.zeros((frames, 3))
    poses[:, 0] = np.pi / 2
    trans[:, 1], trans[:, 2] = -np.arange(frames) * speed / fps, 0.95
    arrays = {
        "poses": poses,
        "trans": trans,
        "mocap_framerate": np.array(fps),
        "gender": np.array("male"),
        "betas": np.zeros(16),
        "dmpls": np.zeros((frames, 8)),
    } | changes
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    return path


def folder(root: Path, labels: list[dict[str, Any]] | None, **motion: Any) -> Path:
    """A BABEL folder with one recording of ten seconds."""
    (root / "train.json").write_text(json.dumps({"12": entry(labels)}))
    amass(root / "amass" / PLACE, **motion)
    return root


def recording(*segments: tuple[str, float, float]) -> Recording:
    parts = tuple(Segment(text, (text,), start, end) for text, start, end in segments)
    return Recording("babel_1", "train", PLACE, (), parts)


def still(frames: int) -> Motion:
    """Height grows by a centimetre per frame, so that every frame shows its own number."""
    numbers = np.zeros((frames, 135))
    numbers[:, 0] = np.arange(frames) / 100
    numbers[:, 3:] = np.tile([1, 0, 0, 0, 1, 0], 22)
    return decode(numbers)


def frames_of(item: babel.BabelItem) -> tuple[int, int]:
    """First and last (half-open) frame of `still` that an item holds."""
    numbers = np.round(item.features[:, 0] * 100).astype(int)
    assert (np.diff(numbers) == 1).all()
    return int(numbers[0]), int(numbers[-1]) + 1


# Labels


def test_labels_are_read_as_processed_in_order_of_time(tmp_path: Path) -> None:
    labels = [label("turn left", 4, 6, ["turn"]), label("walk", 0, 4.5), label("gone", 3, 3)]
    recordings = babel.find_recordings(folder(tmp_path, labels))
    assert len(recordings) == 1
    assert (recordings[0].name, recordings[0].split, recordings[0].place, recordings[0].whole) == (
        "babel_12",
        "train",
        PLACE,
        ("walk around",),
    )
    assert [(s.text, s.acts, s.start, s.end) for s in recordings[0].segments] == [
        ("walk", ("walk",), 0, 4.5),
        ("turn left", ("turn",), 4, 6),
    ]


def test_both_splits_and_the_releases_own_folder_are_found(tmp_path: Path) -> None:
    (tmp_path / "babel_v1.0_release").mkdir()
    (tmp_path / "babel_v1.0_release" / "val.json").write_text(json.dumps({"7": entry(None)}))
    (tmp_path / "train.json").write_text(json.dumps({"12": entry(None)}))
    recordings = babel.find_recordings(tmp_path)
    assert [(r.name, r.split, r.segments) for r in recordings] == [("babel_12", "train", ()), ("babel_7", "val", ())]
    with pytest.raises(MotionloomError, match=r"test\.json"):
        babel.find_recordings(tmp_path, splits=("test",))


@pytest.mark.parametrize(
    "damage",
    [
        "[]",
        "{",
        "\xff",
        "[" * 100_000,
        '{"1": 3}',
        '{"1": {}}',
        json.dumps({"1": entry(None, place="x.exe")}),
        json.dumps({"1": entry(None, place="x\0.npz")}),
        json.dumps({"../1": entry(None)}),
        json.dumps({"1": entry([label("walk", float("nan"), 2)])}),
        json.dumps({"1": entry([label("walk", -1, 2)])}),
        json.dumps({"1": entry([{"proc_label": "walk"}])}),
        json.dumps({"1": entry(None) | {"frame_ann": {"labels": 3}}}),
        json.dumps({"1": entry([label("walk", 0, 2) | {"act_cat": "walk"}])}),
        json.dumps({"1": entry([label("walk", 0, 2) | {"proc_label": 3}])}),
        json.dumps({"1": entry([{}] * 1001)}),
        json.dumps({"1": entry([label("walk " * 500, 0, 2)])}),
    ],
    ids=range(17),
)
def test_other_json_is_refused_in_one_sentence_with_the_files_name(tmp_path: Path, damage: str) -> None:
    (tmp_path / "train.json").write_bytes(damage.encode("latin-1"))
    with pytest.raises(MotionloomError, match=r"train\.json") as caught:
        babel.find_recordings(tmp_path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


# Recordings


def test_a_recording_stands_upright_and_walks_where_it_faces(tmp_path: Path) -> None:
    """Facing -Y of the +Z-up world is facing +Z of the +Y-up one; 0.95 m up; 1 m/s for 10 s."""
    motion = babel.read_amass(amass(tmp_path / "a.npz"))
    assert (len(motion), motion.fps) == (1200, 120)
    np.testing.assert_allclose(motion.root[-1], [0, 0.95, 1199 / 120], atol=1e-9)
    np.testing.assert_allclose(np.abs(motion.rotations), np.broadcast_to([1, 0, 0, 0], (1200, 22, 4)), atol=1e-9)


def test_the_first_66_numbers_are_the_body(tmp_path: Path) -> None:
    """The left elbow is joint 18: numbers 54 to 57; fingers (66 on) are nobody's."""
    poses = np.zeros((40, 156))
    poses[:, 54:57], poses[:, 66:] = [0.0, 0.5, 0.0], 1.0
    motion = babel.read_amass(amass(tmp_path / "a.npz", frames=40, poses=poses))
    np.testing.assert_allclose(motion.rotations[3, 18], [np.cos(0.25), 0, np.sin(0.25), 0], atol=1e-9)
    np.testing.assert_allclose(motion.rotations[3, [17, 21]], np.tile([1, 0, 0, 0], (2, 1)), atol=1e-9)


@pytest.mark.parametrize("width", [66, 72, 165], ids=["body", "SMPL", "SMPL-X"])
def test_other_widths_and_the_other_name_of_the_rate_are_read(tmp_path: Path, width: int) -> None:
    changes = {"poses": np.zeros((40, width)), "mocap_framerate": None, "mocap_frame_rate": np.array(60)}
    assert babel.read_amass(amass(tmp_path / "a.npz", frames=40, **changes)).fps == 60


def test_arrays_nobody_needs_may_be_objects(tmp_path: Path) -> None:
    """Some releases keep marker labels as pickled lists, or the gender as bytes."""
    path = amass(tmp_path / "a.npz", frames=40, gender=np.array(b"male"), labels=np.array([["a"], 1], dtype=object))
    assert len(babel.read_amass(path)) == 40


@pytest.mark.parametrize(
    "changes",
    [
        {"poses": np.array([None] * 40, dtype=object)},
        {"poses": None},
        {"trans": None},
        {"mocap_framerate": None},
        {"poses": np.zeros((40, 63))},
        {"poses": np.zeros((39, 156))},
        {"poses": np.zeros(40)},
        {"trans": np.full((40, 3), np.nan)},
        {"trans": np.full((40, 3), 1e6)},
        {"poses": np.full((40, 156), np.inf)},
        {"mocap_framerate": np.array(0.0)},
        {"mocap_framerate": np.array(np.nan)},
        {"mocap_framerate": np.array([30.0, 30.0])},
        {"mocap_framerate": np.array("fast")},
        {"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))},
    ],
    ids=range(15),
)
def test_broken_recordings_are_refused_in_one_sentence_with_the_files_name(tmp_path: Path, changes: dict) -> None:
    with pytest.raises(MotionloomError, match=r"a\.npz") as caught:
        babel.read_amass(amass(tmp_path / "a.npz", frames=40, **changes))
    assert "\n" not in str(caught.value)


def test_no_archive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(b"\x80\x04pickle")
    with pytest.raises(MotionloomError, match=r"a\.npz"):
        babel.read_amass(tmp_path / "a.npz")


def test_recordings_are_found_where_archives_unpack_to(tmp_path: Path) -> None:
    one = recording()
    for place in ("amass/" + PLACE, PLACE, "CMU/01/01_01_poses.npz", "amass/CMU/01/01_01_poses.npz"):
        root = tmp_path / place.replace("/", "_")
        amass(root / place, frames=3)
        assert babel.find_motion(root, one) == (root / place).resolve()
    with pytest.raises(MotionloomError, match="01_01_poses"):
        babel.find_motion(tmp_path, one)


@pytest.mark.parametrize("place", ["../../b.npz", "/etc/b.npz", "CMU/../../b.npz"])
def test_paths_stay_inside_the_folder(tmp_path: Path, place: str) -> None:
    amass(tmp_path / "b.npz", frames=3)
    (tmp_path / "x").mkdir()
    with pytest.raises(MotionloomError, match="leads out"):
        babel.find_motion(tmp_path / "x", Recording("babel_1", "train", place, (), ()))


@pytest.mark.parametrize(
    ("fps", "frames", "at"),
    [
        (120.0, 16, [0, 5, 10, 15]),
        (60.0, 9, [0, 2, 5, 8]),
        (30.0, 4, [0, 1, 2, 3]),
        (15.0, 3, [0, 0, 0, 1, 1, 2]),
    ],
    ids=["120", "60", "30", "15"],
)
def test_frames_are_picked_by_interpolated_index(fps: float, frames: int, at: list[int]) -> None:
    """int(frames * 30 / fps) indices evenly from the first to the last, rounded down: worked out by hand."""
    motion = still(frames)
    picked = babel.at_30(Motion(motion.skeleton, fps, motion.root, motion.rotations))
    assert np.round(picked.root[:, 1] * 100).astype(int).tolist() == at
    assert picked.fps == 30


# Pairs


def spans(*segments: tuple[str, float, float]) -> list[tuple]:
    return [(p.texts, p.first, p.between, p.second) for p in babel.pairs(recording(*segments).segments)]


def test_adjacent_actions_are_a_pair_without_transition() -> None:
    assert spans(("walk", 0, 4), ("sit", 4, 9)) == [(("walk", "sit"), (0, 4), (4, 4), (4, 9))]
    assert spans(("walk", 0, 4), ("sit", 4.03, 9)) == [(("walk", "sit"), (0, 4), (4.03, 4.03), (4.03, 9))]
    assert spans(("walk", 0, 4), ("sit", 4.1, 9)) == []


def test_overlapping_actions_share_their_overlap_as_transition() -> None:
    assert spans(("walk", 0, 5), ("sit", 4, 9)) == [(("walk", "sit"), (0, 4), (4, 5), (5, 9))]


def test_an_action_within_another_does_not_follow_it() -> None:
    assert spans(("walk", 0, 9), ("wave", 2, 4)) == []
    assert spans(("walk", 0, 9), ("wave", 0, 9)) == []


def test_a_labelled_transition_joins_what_it_touches() -> None:
    """A ends within it, B begins within it: three parts that meet at its ends."""
    assert spans(("walk", 0, 4), ("transition", 4, 5), ("sit", 5, 9)) == [(("walk", "sit"), (0, 4), (4, 5), (5, 9))]
    assert spans(("walk", 0, 4.5), ("transition", 4, 5), ("sit", 4.8, 9)) == [(("walk", "sit"), (0, 4), (4, 5), (5, 9))]
    assert spans(("walk", 0, 3), ("transition", 4, 5), ("sit", 5, 9)) == []


def test_three_actions_in_a_row_are_two_pairs() -> None:
    parts = spans(("walk", 0, 3), ("turn", 3, 5), ("sit", 5, 9))
    assert sorted(pair[0] for pair in parts) == [("turn", "sit"), ("walk", "turn")]


@pytest.mark.parametrize("pose", ["t-pose", "T pose", "a pose", "A-Pose"])
def test_calibration_poses_make_no_pair(pose: str) -> None:
    assert spans((pose, 0, 3), ("walk", 3, 6), ("sit", 6, 9)) == [(("walk", "sit"), (3, 6), (6, 6), (6, 9))]


def test_a_category_tells_too() -> None:
    """What is called 'stand still' and categorised as a T-pose, and a renamed transition."""
    parts = (
        Segment("walk", ("walk",), 0, 4),
        Segment("move on", ("transition",), 4, 5),
        Segment("sit", ("sit",), 5, 9),
        Segment("stand still", ("stand", "t pose"), 9, 12),
    )
    pairs = babel.pairs(parts)
    assert [(p.texts, p.between) for p in pairs] == [(("walk", "sit"), (4, 5))]


# Items


def test_a_pair_makes_four_items_with_flags_in_the_transition() -> None:
    """Ten seconds at 30 fps: walk to 4 s, transition to 5 s, sit to 9 s."""
    one = recording(("walk", 0, 4), ("transition", 4, 5), ("sit", 5, 9))
    items = list(babel.items(one, still(300)))
    contents = [(i.text, *frames_of(i), np.flatnonzero(i.flags).tolist()) for i in items]
    assert contents == [
        ("walk", 0, 120, []),
        ("sit", 150, 270, []),
        ("walk", 0, 150, list(range(120, 150))),
        ("sit", 120, 270, list(range(30))),
    ]
    assert len({i.name for i in items}) == 4
    assert all(len(i.flags) == len(i) for i in items)


def test_an_item_is_a_motion_of_its_own() -> None:
    """Turned by its own first frame and without velocity there, as the codec makes it of the cut motion."""
    motion = still(300)
    item = list(babel.items(recording(("walk", 0, 4), ("sit", 4, 9)), motion))[1]
    np.testing.assert_array_equal(item.features, codec.encode(motion.frames(120, 270)))


def test_what_two_pairs_share_is_one_item() -> None:
    items = list(babel.items(recording(("walk", 0, 3), ("turn", 3, 6), ("sit", 6, 9)), still(300)))
    assert sorted(i.text for i in items) == ["sit", "turn", "walk"]


@pytest.mark.parametrize(("frames", "kept"), [(44, 0), (45, 1), (250, 1), (254, 1), (255, 0)])
def test_lengths_are_limited(frames: int, kept: int) -> None:
    """45 to 250 frames and four more; the second action is always too short here."""
    one = recording(("walk", 0, frames / 30), ("sit", frames / 30, frames / 30 + 1))
    assert len(list(babel.items(one, still(400)))) == kept


def test_longer_ones_are_cropped_at_random_when_asked() -> None:
    one = recording(("walk", 0, 20), ("sit", 20, 21))
    items = [next(babel.items(one, still(650), crop=np.random.default_rng(s))) for s in range(8)]
    places = [frames_of(i) for i in items]
    assert {b - a for a, b in places} == {250}
    assert len({a for a, _ in places}) > 4
    assert all(a >= 0 and b <= 600 for a, b in places)


def test_labels_beyond_the_recording_are_cut_to_it() -> None:
    items = list(babel.items(recording(("walk", 0, 4), ("sit", 4, 99)), still(240)))
    assert frames_of(items[1]) == (120, 240)


@pytest.mark.parametrize(
    ("frames", "lengths"), [(100, (96, 100)), (254, (250, 250)), (252, (248, 250)), (46, (45, 46))]
)
def test_items_lose_up_to_four_frames_at_random(frames: int, lengths: tuple[int, int]) -> None:
    item = babel.BabelItem("a", "walk", np.zeros((frames, 135), np.float32), np.zeros(frames, bool))
    recordings = {len(babel.trimmed(item, np.random.default_rng(s))) for s in range(60)}
    assert (min(recordings), max(recordings)) == lengths
    assert len(recordings) == lengths[1] - lengths[0] + 1


def test_items_are_cut_at_thirty_frames_per_second(tmp_path: Path) -> None:
    """A hundred and twenty frames per second are not taken for thirty: the caller resamples."""
    with pytest.raises(MotionloomError, match="120"):
        list(babel.items(recording(), babel.read_amass(amass(tmp_path / "a.npz", frames=40))))


def test_a_folder_becomes_items(tmp_path: Path) -> None:
    """Ten seconds of gliding: 135 numbers, the height of the recording, a metre per second towards -X as published."""
    labels = [label("walk", 0, 4), label("transition", 4, 5), label("sit", 5, 9)]
    items = babel.load_items(folder(tmp_path, labels))
    assert [(i.text, len(i)) for i in items] == [("walk", 120), ("sit", 120), ("walk", 150), ("sit", 150)]
    for item in items:
        assert item.features.dtype == np.float32
        np.testing.assert_allclose(item.features[:, 0], 0.95, atol=1e-6)
        np.testing.assert_allclose(item.features[1:, 1].mean(), -1 / 30, rtol=0.01)
        assert item.features[0, 1:3].tolist() == [0, 0]
    mean, std = babel.statistics(items)
    assert (mean.shape, std.shape) == ((135,), (135,))
    assert mean[0] == pytest.approx(0.95)
    assert (std > 0).all()


def test_what_is_missing_or_too_short_is_named_or_left_out(tmp_path: Path) -> None:
    folder(tmp_path, [label("walk", 0, 4), label("sit", 4, 9)])
    whole = json.loads((tmp_path / "train.json").read_text())
    whole |= {"13": entry(None, "KIT/KIT/a_poses.npz"), "14": entry(None, "CMU/CMU/02/b_poses.npz")}
    (tmp_path / "train.json").write_text(json.dumps(whole))
    amass(tmp_path / "CMU/02/b_poses.npz", frames=40)
    with pytest.raises(MotionloomError, match="a_poses"):
        babel.load_items(tmp_path)
    lines: list[str] = []
    assert len(babel.load_items(tmp_path, dropped=lines.append)) == 2
    assert ["a_poses" in lines[0], "b_poses" in lines[1], len(lines)] == [True, True, 2]


def test_statistics_of_nothing_are_refused() -> None:
    with pytest.raises(MotionloomError, match="no items"):
        babel.statistics([])


# The same recordings as HumanML3D features


def test_the_builder_reads_a_babel_folder(tmp_path: Path) -> None:
    """A clip of 263 numbers that walks ahead at 1 m/s, with the labels as captions in frames of 20 per second."""
    root = tmp_path / "babel"
    root.mkdir()
    folder(root, [label("walk", 0, 4), label("transition", 4, 5), label("sit", 5, 9)])
    takes = find_takes(root)
    assert [(t.name, t.source, t.split) for t in takes] == [("babel_12", "babel", "train")]
    build([root], tmp_path / "set", workers=1, mixed=0, find=find_takes, progress=lambda line: None)
    clip = read_clip(tmp_path / "set" / "clips" / "babel_12.safetensors")
    captions = [(n.first, n.last, n.texts) for n in clip.notes if n.kind == "human"]
    assert captions == [(0, len(clip.features), ("walk around",)), (0, 80, ("walk",)), (100, 180, ("sit",))]
    assert np.median(clip.features[:, 2]) == pytest.approx(0.05, rel=0.05)
    assert "BABEL" in clip.licence
