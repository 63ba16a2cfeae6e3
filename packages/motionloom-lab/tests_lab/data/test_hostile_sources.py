"""Damaged captions, lists and times: one sentence that names the file, and no folder of a set is begun."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import MAX_TENSORS
from motionloom_lab.suites.items import read_items
from motionloom_lab.suites.protocol import Selection
from motionloom_train.data.build import build
from motionloom_train.data.clips import Clip, Note, read_clip, write_clip
from motionloom_train.data.sources import Span, find_takes
from tests.io.test_tensors import empty_tensors

ROW = {
    "amass_path": "x/CMU/02/02_01_poses.npy",
    "mirrored": False,
    "start_s": 0.0,
    "end_s": 2.0,
    "split": "train",
    "captions": [{"text": "a man walks", "from_s": 0, "to_s": 0}],
}


def folder(root: Path) -> Path:
    (root / "02_01.bvh").write_text("")
    return root


@pytest.mark.parametrize("time", ["NaN", "1e308", "1e999", "-1", "9" * 400, '"x"', "[]", "-Infinity"])
def test_times_that_are_no_seconds_are_refused_before_a_set_is_begun(tmp_path: Path, time: str) -> None:
    said = json.dumps(ROW).replace('"start_s": 0.0', f'"start_s": {time}')
    (folder(tmp_path) / "c.jsonl").write_text(said)
    with pytest.raises(MotionloomError, match=r"c\.jsonl"):
        build([tmp_path], tmp_path / "set", captions=tmp_path / "c.jsonl", workers=1, progress=lambda line: None)
    assert not (tmp_path / "set").exists()


PACKED = gzip.compress((json.dumps(ROW) + "\n").encode() * 2000, mtime=0)
DAMAGED = {
    "cut short": PACKED[: len(PACKED) // 2],
    "turned over": PACKED[:60] + b"\xff" * 20 + PACKED[80:],
    "not packed": b"{}",
    "deep": gzip.compress(b"[" * 100_000),
    "latin-1": gzip.compress(b'{"amass_path": "\xe9"}'),
    "a long line": gzip.compress(b" " * (2 << 20)),
    "unfolds far": gzip.compress((b" " * 500_000 + b"\n") * 400),
}


@pytest.mark.parametrize("what", list(DAMAGED))
def test_damaged_captions_are_one_sentence(tmp_path: Path, what: str) -> None:
    (folder(tmp_path) / "c.jsonl.gz").write_bytes(DAMAGED[what])
    with pytest.raises(MotionloomError, match=r"c\.jsonl\.gz") as caught:
        find_takes(tmp_path, captions=tmp_path / "c.jsonl.gz")
    assert "\n" not in str(caught.value)


def test_whole_packed_captions_are_read(tmp_path: Path) -> None:
    (folder(tmp_path) / "c.jsonl.gz").write_bytes(PACKED)
    (take,) = find_takes(tmp_path, captions=tmp_path / "c.jsonl.gz")
    assert len(take.spans) == 2000


@pytest.mark.parametrize("line", [b"caf\xe9#x/NOUN#0.0#0.0", b"a#x/NOUN#1e308#1e309", b"a#x/NOUN#-1#2"])
def test_texts_of_humanml3d_are_utf_8_with_seconds(tmp_path: Path, line: bytes) -> None:
    for part in ("new_joint_vecs", "texts"):
        (tmp_path / part).mkdir()
    np.save(tmp_path / "new_joint_vecs" / "1.npy", np.zeros((50, 263), np.float32))
    (tmp_path / "texts" / "1.txt").write_bytes(line)
    for split in ("train", "val", "test"):
        (tmp_path / f"{split}.txt").write_text("1" if split == "train" else "")
    with pytest.raises(MotionloomError, match=r"1\.txt"):
        find_takes(tmp_path)


@pytest.mark.parametrize(
    ("lists", "named"),
    [(["1\n1", "", ""], "train.txt lists 1, which train.txt"), (["1", "", "1"], "test.txt lists 1, which train.txt")],
    ids=["twice in a list", "in two lists"],
)
def test_a_clip_is_listed_once(tmp_path: Path, lists: list[str], named: str) -> None:
    """A list of a clip 20,000 times would be 20,000 takes; and what is trained on is not tested with."""
    for part in ("new_joint_vecs", "texts"):
        (tmp_path / part).mkdir()
    np.save(tmp_path / "new_joint_vecs" / "1.npy", np.zeros((50, 263), np.float32))
    (tmp_path / "texts" / "1.txt").write_text("a man walks#a/DET#0.0#0.0")
    for split, names in zip(("train", "val", "test"), lists, strict=True):
        (tmp_path / f"{split}.txt").write_text(names)
    with pytest.raises(MotionloomError, match=named):
        find_takes(tmp_path)
    with pytest.raises(MotionloomError, match=named):
        read_items(tmp_path, Selection(splits=("train", "test"), sources=("humanml3d",)))


def test_captions_are_not_longer_than_captions_are(tmp_path: Path) -> None:
    """2,000 characters; the longest of HumanML3D has 897."""
    Span(0.0, 1.0, ("x" * 2000,), "human")
    with pytest.raises(ValueError, match="2,001 characters"):
        Span(0.0, 1.0, ("x", "x" * 2001), "human")
    row = ROW | {"captions": [{"text": "walk " * 500, "from_s": 0, "to_s": 0}]}
    (folder(tmp_path) / "c.jsonl").write_text(json.dumps(row))
    with pytest.raises(MotionloomError, match="a caption has 2,500 characters"):
        find_takes(tmp_path, captions=tmp_path / "c.jsonl")
    clip = Clip(
        "a", "x", "x", "train", "plain", (Note(0, 20, "human", ("x" * 2001,)),), np.zeros((20, 263), np.float32)
    )
    write_clip(tmp_path, clip)
    with pytest.raises(MotionloomError, match="2,001 characters"):
        read_clip(tmp_path / "a.safetensors")


def test_a_part_that_a_killed_process_left_is_no_recording(tmp_path: Path) -> None:
    folder(tmp_path)
    (tmp_path / ".0123456789ab.part.bvh").write_text("HIERARCHY")
    assert [take.name for take in find_takes(tmp_path)] == ["02_01"]


def test_spans_are_seconds() -> None:
    assert Span(0.0, float("inf"), ("x",), "human").end_s == float("inf")
    for start, end in ((float("nan"), 1.0), (0.0, float("nan")), (-1.0, 1.0), (1e300, 1e301), (0.0, -1.0)):
        with pytest.raises(ValueError, match="seconds"):
            Span(start, end, ("x",), "human")


def test_a_clip_of_very_many_tensors_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    path = empty_tensors(tmp_path / "a.safetensors", MAX_TENSORS + 1)
    with pytest.raises(MotionloomError, match="more than 10,000 tensors"):
        read_clip(path)
