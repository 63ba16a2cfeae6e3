"""Files of `torch.save`: what it wrote is read equal, and one that says more than it holds is refused."""

import contextlib
import io
import pickle
import struct
import zipfile
from collections import OrderedDict
from pathlib import Path

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.torch_file import read_torch_file

KINDS = [
    torch.float32,
    torch.float64,
    torch.float16,
    torch.bfloat16,
    torch.int64,
    torch.int32,
    torch.int16,
    torch.int8,
    torch.uint8,
    torch.bool,
]


def saved(path: Path, value: object, *, zipped: bool = True) -> Path:
    torch.save(value, path, _use_new_zipfile_serialization=zipped)
    return path


def rezipped(data: bytes, change=lambda members: None, kind: int = zipfile.ZIP_STORED) -> bytes:
    """The archive with its members changed by `change`."""
    with zipfile.ZipFile(io.BytesIO(data)) as old:
        members = {name: old.read(name) for name in old.namelist()}
    change(members)
    result = io.BytesIO()
    with zipfile.ZipFile(result, "w", kind) as new:
        for name, content in members.items():
            new.writestr(name, content)
    return result.getvalue()


def same(a: object, b: object) -> bool:
    if isinstance(a, Tensor):
        return isinstance(b, Tensor) and a.dtype == b.dtype and a.shape == b.shape and torch.equal(a, b)
    if isinstance(a, dict):
        return isinstance(b, dict) and list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))  # type: ignore[arg-type]
    return a == b


@pytest.mark.parametrize("zipped", [True, False], ids=["new", "old"])
def test_what_torch_wrote_is_what_torch_would_read(tmp_path: Path, zipped: bool) -> None:
    """Parts and views of the same numbers, empty and single ones, every kind, optimisers and ordered dictionaries."""
    layer = torch.nn.Linear(3, 2)
    optimizer = torch.optim.Adam(layer.parameters())
    layer(torch.ones(3)).sum().backward()
    optimizer.step()
    base = torch.arange(24).reshape(2, 3, 4)
    value = {
        "kinds": [torch.arange(6).reshape(2, 3).to(kind) for kind in KINDS],
        "views": (base.mT, base[:, 1:], base[0, 0, 0], base[:0], base.expand(2, 2, 3, 4)),
        "net": layer.state_dict(),
        "weight": layer.weight,
        "optimizer": optimizer.state_dict(),
        "plain": OrderedDict(a=[1, -2.5, None, True, "text"], b=(2**40, b"bytes")),
    }
    path = saved(tmp_path / "a.pt", value, zipped=zipped)
    assert same(read_torch_file(path), torch.load(path, weights_only=True))


def test_numbers_that_two_tensors_share_are_kept_once(tmp_path: Path) -> None:
    base = torch.arange(1000.0)
    first, second = read_torch_file(saved(tmp_path / "a.pt", [base, base[10:]]))  # type: ignore[misc]
    assert first.untyped_storage().data_ptr() == second.untyped_storage().data_ptr()


def test_packed_archives_are_refused_before_they_are_unpacked(tmp_path: Path) -> None:
    data = saved(tmp_path / "a.pt", {"a": torch.zeros(1 << 20)}).read_bytes()
    (tmp_path / "b.pt").write_bytes(rezipped(data, kind=zipfile.ZIP_DEFLATED))
    assert (tmp_path / "b.pt").stat().st_size < 1 << 16
    with pytest.raises(MotionloomError, match="packed"):
        read_torch_file(tmp_path / "b.pt")


def test_members_that_share_their_bytes_count_each_time(tmp_path: Path) -> None:
    """A hundred entries of the archive's directory lead to one megabyte."""
    data = saved(tmp_path / "a.pt", {"a": torch.zeros(1 << 18)}).read_bytes()
    result = io.BytesIO(data)
    with zipfile.ZipFile(result, "a") as archive:
        entry = archive.getinfo("a/data/0")
        for number in range(1, 100):
            more = zipfile.ZipInfo(f"a/data/{number}")
            more.header_offset, more.CRC = entry.header_offset, entry.CRC
            more.file_size = more.compress_size = entry.file_size
            archive.filelist.append(more)
        archive._didModify = True
    (tmp_path / "b.pt").write_bytes(result.getvalue())
    with pytest.raises(MotionloomError, match="claims to hold more"):
        read_torch_file(tmp_path / "b.pt")


def test_an_archive_behind_another_is_not_measured_by_one_and_read_by_the_other(tmp_path: Path) -> None:
    """What is read is what the one reader finds, which is the last archive."""
    first = saved(tmp_path / "a.pt", {"a": torch.zeros(1000)}).read_bytes()
    second = saved(tmp_path / "b.pt", {"a": torch.ones(2)}).read_bytes()
    (tmp_path / "c.pt").write_bytes(first + second)
    assert torch.equal(read_torch_file(tmp_path / "c.pt")["a"], torch.ones(2))  # type: ignore[index]


def tensor_pickle(
    count: int, *, first: int = 0, shape: tuple = (2,), strides: tuple = (1,), kind: str = "Float"
) -> bytes:
    """The pickle of one tensor as torch writes it, with numbers of choice."""

    def number(value: int) -> bytes:
        return b"\x8a\x08" + struct.pack("<q", value)

    def row(values: tuple) -> bytes:
        return b"(" + b"".join(map(number, values)) + b"t"

    storage = b"(X\x07\0\0\0storagectorch\n" + kind.encode() + b"Storage\nX\x01\0\0\0" + b"0X\x03\0\0\0cpu"
    return (
        b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\n("
        + storage
        + number(count)
        + b"tQ"
        + number(first)
        + row(shape)
        + row(strides)
        + b"\x89ccollections\nOrderedDict\n)RtR."
    )


@pytest.mark.parametrize(
    "pickled",
    [
        tensor_pickle(1 << 40),
        tensor_pickle(3),
        tensor_pickle(-2),
        tensor_pickle(2, first=1),
        tensor_pickle(2, first=-1),
        tensor_pickle(2, shape=(3,)),
        tensor_pickle(2, shape=(1 << 50,)),
        tensor_pickle(2, shape=(-1,)),
        tensor_pickle(2, strides=(2,)),
        tensor_pickle(2, strides=(-1,)),
        tensor_pickle(2, strides=()),
        tensor_pickle(2, shape=(1,) * 17, strides=(1,) * 17),
        tensor_pickle(2, kind="Untyped"),
        tensor_pickle(2, kind="Double"),
    ],
)
def test_a_tensor_beyond_the_bytes_that_are_there_is_refused(tmp_path: Path, pickled: bytes) -> None:
    good = saved(tmp_path / "a.pt", torch.zeros(2)).read_bytes()

    def write(content: bytes) -> Path:
        path = tmp_path / "b.pt"
        path.write_bytes(rezipped(good, lambda members: members.update({"a/data.pkl": content})))
        return path

    assert torch.equal(read_torch_file(write(tensor_pickle(2))), torch.zeros(2))  # type: ignore[arg-type]
    with pytest.raises(MotionloomError, match="is not opened"):
        read_torch_file(write(pickled))


def test_an_old_file_that_claims_more_numbers_than_it_has_is_refused(tmp_path: Path) -> None:
    data = saved(tmp_path / "a.pt", torch.zeros(2), zipped=False).read_bytes()
    for count in (3, 1 << 40, -1):
        claimed = data.replace(struct.pack("<q", 2), struct.pack("<q", count))
        (tmp_path / "b.pt").write_bytes(claimed)
        with pytest.raises(MotionloomError, match="is not opened"):
            read_torch_file(tmp_path / "b.pt")


class Acts:
    def __init__(self, *made: object) -> None:
        self.made = made

    def __reduce__(self) -> tuple:
        return self.made  # type: ignore[return-value]


@pytest.mark.parametrize("zipped", [True, False], ids=["new", "old"])
@pytest.mark.parametrize("call", [bytearray, Path.touch, torch.zeros, torch.empty], ids=lambda call: call.__name__)
def test_nothing_is_called(tmp_path: Path, call, zipped: bool) -> None:
    """`bytearray(n)` is what torch's own weights-only reader does call."""
    argument = tmp_path / "ran" if call is Path.touch else 1 << 20
    path = saved(tmp_path / "a.pt", {"x": Acts(call, (argument,))}, zipped=zipped)
    with pytest.raises(MotionloomError, match="it names"):
        read_torch_file(path)
    assert not (tmp_path / "ran").exists()


@given(data=st.data())
def test_damaged_files_give_one_kind_of_error(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    path = saved(folder / "a.pt", {"a": torch.arange(3.0), "b": [1, 2]}, zipped=data.draw(st.booleans()))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(len(content) // 2, len(content)))])
    with contextlib.suppress(MotionloomError):
        read_torch_file(path)


def test_a_bare_pickle_is_no_torch_file(tmp_path: Path) -> None:
    (tmp_path / "a.pt").write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(MotionloomError, match="no file of torch"):
        read_torch_file(tmp_path / "a.pt")
