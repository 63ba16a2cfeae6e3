"""Pickled tables are read as NumPy would, and nothing in them is run."""

import io
import os
import pickle
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.benchmarks import (
    read_h36m,
)
from motionloom_lab.papers.plain_pickle import read_tables


@pytest.mark.parametrize("protocol", [2, 3, 4])
@pytest.mark.parametrize("order", ["C", "F"])
def test_objects_are_read_as_numpy_would(tmp_path: Path, protocol: int, order: Any) -> None:
    """Every protocol that NumPy has written files with, kinds of numbers, big-endian, Fortran order, empty arrays."""
    table = {
        "S1": {"a": np.asarray(np.random.default_rng(0).normal(size=(5, 3, 3)), dtype="<f4", order=order)},
        "S2": {"a": np.arange(6, dtype=">f8").reshape(2, 3), "b": np.empty((0, 3)), "c": np.arange(3, dtype=np.int16)},
    }
    tables = read_tables(hostile(tmp_path, pickle.dumps(table, protocol=protocol)), "positions_3d")
    assert list(tables) == list(table)
    for subject, actions in table.items():
        assert list(tables[subject]) == list(actions)
        for action, array in actions.items():
            assert tables[subject][action].dtype == array.dtype.newbyteorder("=")  # as NumPy's own reader does
            assert np.array_equal(tables[subject][action], array)


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
