"""Safetensors files from strangers: what their heads claim is looked at before anybody parses them."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import MAX_HEAD, MAX_TENSORS, check_head, save_tensors
from motionloom.core.models.container import PRIORS, read_tensors
from motionloom.core.models.prior import read_card
from tests.work import work


def with_head(path: Path, head: bytes, *, length: int | None = None) -> Path:
    path.write_bytes((len(head) if length is None else length).to_bytes(8, "little") + head)
    return path


def empty_tensors(path: Path, count: int) -> Path:
    """A file of so many tensors that hold nothing."""
    entry = {"dtype": "F32", "shape": [0], "data_offsets": [0, 0]}
    return with_head(path, json.dumps({f"t{number}": entry for number in range(count)}).encode())


def test_a_usual_file_is_read(tmp_path: Path) -> None:
    path = save_tensors({"a": np.ones(3, np.float32)}, tmp_path / "a.safetensors", metadata={"b": "{}" * 100})
    check_head(path, max_bytes=10_000)
    tensors, about = read_tensors(path)
    assert tensors["a"].tolist() == [1, 1, 1]
    assert about == {"b": "{}" * 100}


@pytest.mark.parametrize("kind", ["BF16", "F8_E4M3"])
def test_numbers_that_numpy_has_not_are_refused(tmp_path: Path, kind: str) -> None:
    """Where a package that gives NumPy such numbers is imported too."""
    pytest.importorskip("ml_dtypes")
    size = 2 if kind == "BF16" else 1
    head = json.dumps({"a": {"dtype": kind, "shape": [3], "data_offsets": [0, 3 * size]}}).encode()
    path = tmp_path / "a.safetensors"
    path.write_bytes(len(head).to_bytes(8, "little") + head + bytes(3 * size))
    with pytest.raises(MotionloomError, match="is not a whole safetensors file"):
        read_tensors(path)


@pytest.mark.parametrize("read", [read_tensors, read_card], ids=lambda read: read.__name__)
def test_very_many_tensors_are_refused_before_they_are_parsed(tmp_path: Path, read) -> None:
    path = empty_tensors(tmp_path / "a.safetensors", MAX_TENSORS + 1)
    with pytest.raises(MotionloomError, match="more than 10,000 tensors"):
        read(path)
    assert not PRIORS.signed(path)

    def refused() -> None:
        with pytest.raises(MotionloomError):
            read(path)

    assert work(refused) < 5_000


@pytest.mark.parametrize("length", [MAX_HEAD + 1, 2**63, 2**64 - 1])
def test_a_head_of_very_many_bytes_is_refused(tmp_path: Path, length: int) -> None:
    with pytest.raises(MotionloomError, match="32 MiB"):
        read_tensors(with_head(tmp_path / "a.safetensors", b"{}", length=length))


@pytest.mark.parametrize("content", [b"", b"\0", b"\x02\0\0\0\0\0\0\0", b"\x02\0\0\0\0\0\0\0{", bytes(8)])
def test_what_is_cut_short_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.safetensors").write_bytes(content)
    with pytest.raises(MotionloomError, match="not a whole safetensors file"):
        read_tensors(tmp_path / "a.safetensors")


def test_what_is_larger_than_such_a_file_is_refused(tmp_path: Path) -> None:
    path = save_tensors({"a": np.ones(300, np.float32)}, tmp_path / "a.safetensors", metadata={})
    with pytest.raises(MotionloomError, match="larger than the 0 MiB"):
        read_tensors(path, 1000)
