"""Pickles of plain values: what pickle writes is read equal, and what could act is refused before it acts."""

import collections
import contextlib
import io
import os
import pickle
import pickletools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.plain_pickle import MAX_DEPTH, read_plain, read_plain_file
from tests.work import work

LIMIT = 1 << 20
PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text() | st.integers(-9, 9), inner) | st.tuples(inner, inner),
    max_leaves=20,
)


@given(PLAIN, st.sampled_from(list(PROTOCOLS)))
@settings(max_examples=150, deadline=None)
def test_plain_values_come_back_equal_from_every_protocol(value, protocol):
    if protocol < 3 and _any_bytes(value):
        protocol = 3 if protocol == 0 else 2  # protocol 0 and bytes: encode() of a quoted unicode, also read, slowly
    assert read_plain(pickle.dumps(value, protocol), limit=LIMIT) == value


def _any_bytes(value):
    if isinstance(value, dict):
        return any(_any_bytes(item) for item in value.values())
    return any(_any_bytes(item) for item in value) if isinstance(value, list | tuple) else isinstance(value, bytes)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i8", "u1", "?", "<U3", "S2", "<c16"])
def test_arrays_and_scalars_come_back_equal_in_value_and_type(dtype, protocol):
    array = np.arange(24).reshape(2, 3, 4).astype(dtype)
    for value in (array, np.asfortranarray(array), array[:, ::2], array[:0], array[0, 0, :1].reshape(())):
        read = read_plain(pickle.dumps(value, protocol), limit=LIMIT)
        assert isinstance(read, np.ndarray)
        # NumPy's own reader, too, brings numbers into this machine's byte order.
        assert (read.dtype, read.shape) == (value.dtype.newbyteorder("="), value.shape)
        np.testing.assert_array_equal(read, value)
    scalar = array[1, 2, 3]
    assert read_plain(pickle.dumps([scalar], protocol), limit=LIMIT) == [scalar]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_an_array_of_objects_holds_its_values(protocol):
    value = {"S1": {"Walking": np.arange(6.0).reshape(2, 3)}}
    read = read_plain(pickle.dumps(np.array(value, dtype=object), protocol), limit=LIMIT)
    assert isinstance(read, np.ndarray)
    assert (read.dtype, read.shape) == (object, ())
    np.testing.assert_array_equal(read.item()["S1"]["Walking"], value["S1"]["Walking"])


def test_an_npy_file_of_objects_holds_its_pickle_after_the_header(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{"a": 1}, {"b": np.float32(2)}], dtype=object), allow_pickle=True)
    data = (tmp_path / "a.npy").read_bytes()
    read = read_plain(data[10 + struct.unpack("<H", data[8:10])[0] :], limit=LIMIT)
    assert list(read) == [{"a": 1}, {"b": 2.0}]  # type: ignore[call-overload]


def test_shared_arrays_stay_shared():
    array = np.arange(3.0)
    first, second = read_plain(pickle.dumps([array, array]), limit=LIMIT)  # type: ignore[misc]
    assert first is second


@pytest.mark.parametrize("quoted", [False, True], ids=["protocol-2", "protocol-0"])
def test_a_pickle_of_python_2_is_read_with_latin_1_strings(quoted):
    numbers = struct.pack("<3d", 1.5, -2.25, 1e300)
    if quoted:
        text = "'" + "".join(f"\\x{byte:02x}" for byte in numbers) + "'"
        string, letters, order = f"S{text}\n".encode(), b"S'f8'\n", b"S'<'\n"
        byte = b"S'b'\n"
    else:
        string = b"U" + bytes([len(numbers)]) + numbers
        letters, order, byte = b"U\x02f8", b"U\x01<", b"U\x01b"
    dtype = b"cnumpy\ndtype\n(" + letters + b"I0\nI1\ntR(I3\n" + order + b"NNNI-1\nI-1\nI0\ntb"
    array = b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\nt" + byte + b"tR(I1\n(I3\nt" + dtype
    data = b"}U\x05poses" + array + b"I00\n" + string + b"tbs."
    assert pickle.loads(data, encoding="latin1")["poses"].tolist() == [1.5, -2.25, 1e300]
    read = read_plain(data, limit=LIMIT)
    assert read["poses"].tolist() == [1.5, -2.25, 1e300]  # type: ignore[index]


class _Acts:
    def __init__(self, made):
        self.made = made

    def __reduce__(self):
        return self.made


CALLS = [os.system, eval, getattr, np.load, np.frombuffer, io.BytesIO, bytearray, list, dict]


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_a_pickle_that_names_anything_else_is_refused_and_nothing_runs(tmp_path, call, protocol):
    mark = tmp_path / "ran"
    data = pickle.dumps([1, _Acts((call, (f"touch {mark}",)))], protocol)
    with pytest.raises(MotionloomError, match="not a pickle of plain values"):
        read_plain(data, limit=LIMIT)
    assert not mark.exists()


NDARRAY = b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR"
F8 = b"cnumpy\ndtype\n(S'f8'\nI0\nI1\ntR(I3\nS'<'\nNNNI-1\nI-1\nI0\ntb"
HOSTILE = {
    "empty": b"",
    "no-pickle": b"hello",
    "ordered-dict": pickle.dumps(collections.OrderedDict(a=1)),
    "set": pickle.dumps({1, 2}, 2),
    "frozen-set": pickle.dumps(frozenset({1}), 4),
    "long-string-that-is-not-there": b"\x80\x04\x8e" + struct.pack("<Q", 1 << 62) + b"x.",
    "cut": pickle.dumps({"a": np.arange(9.0)})[:-20],
    "trailing": pickle.dumps(1) + b"N.",
    "persistent-id": b"Pfile\n.",
    "binary-persistent-id": b"Nq\x00Q.",
    "extension": b"\x82\x01.",
    "instance": b"(ios\nsystem\n.",
    "object": b"(cnumpy\nndarray\no.",
    "new-object": b"cnumpy\nndarray\n)\x81.",
    "a-bare-name": b"cnumpy\nndarray\n.",
    "a-bare-dtype": F8 + b".",
    "an-unbuilt-array": NDARRAY + b".",
    "ndarray-called": b"cnumpy\nndarray\n((I1000000000\nttR.",
    "bytes-called": b"c__builtin__\nbytes\n(I1000000000\ntR.",
    "dotted-name": b"\x80\x04\x8c\x05numpy\x8c\x0dndarray.dumps\x93.",
    "submodule": b"cnumpy.core.multiarray\nset_string_function\n.",
    "too-few-bytes": NDARRAY + b"(I1\n(I1000000000\nt" + F8 + b"I00\nS'12345678'\ntb.",
    "negative-shape": NDARRAY + b"(I1\n(I-1\nt" + F8 + b"I00\nS''\ntb.",
    "bytes-as-objects": NDARRAY + b"(I1\n(I1\ntcnumpy\ndtype\n(S'O8'\nI0\nI1\ntRI00\nS'12345678'\ntb.",
    "objects-as-numbers": NDARRAY + b"(I1\n(I1\nt" + F8 + b"I00\n(lp0\nNatb.",
    "fields": b"cnumpy\ndtype\n(S'V8'\nI0\nI1\ntR.",
    "built-twice": NDARRAY + (b"(I1\n(t" + F8 + b"I00\nS'12345678'\ntb") * 2 + b".",
    "no-characters": NDARRAY + b"(I1\n(I1\ntcnumpy\ndtype\n(S'U1'\nI0\nI1\ntRI00\nS'\\xff\\xff\\xff\\xff'\ntb.",
    "holds-itself": b"(lp0\ng0\na.",
    "array-in-itself": NDARRAY + b"p0\n(I1\n(I1\ntcnumpy\ndtype\n(S'O8'\nI0\nI1\ntRI00\n(lp1\ng0\natb.",
    "list-as-key": b"}]Ns.",
    "names-by-a-doubling-list": b"\x80\x04]q\x00" + b"(h\x00h\x00e" * 40 + b"h\x00\x93.",
    "names-by-a-deep-list": b"\x80\x04" + b"]" * 5000 + b"a" * 4999 + b"N\x93.",
    "names-by-lists-of-lists": b"\x80\x04]q\x00"
    + b"".join(b"](h%ch%ceq%c" % (n, n, n + 1) for n in range(60))
    + b"N\x93.",
    "deep": b"]" * (MAX_DEPTH + 3) + b"a" * (MAX_DEPTH + 2) + b".",
    "very-deep": b"(" * 100_000 + b"t" * 100_000 + b".",
    "many-operations": b"]" + b"Na" * (1 << 19) + b".",
    "long-number": pickle.dumps(1 << 64),
    "memo-missing": b"g7\n.",
    "underflow": b"\x86.",
    "mark-missing": b"t.",
    "two-values": b"NN.",
    "fills-a-string": b"U\x01aNa.",
}


KNOWN = {"GLOBAL", "STACK_GLOBAL", "REDUCE", "BUILD"}
"""Operations that act, of which the words of numpy's own pickles are read; any other word is tested above."""
ACTING = {"INST", "OBJ", "NEWOBJ", "NEWOBJ_EX", "EXT1", "EXT2", "EXT4", "PERSID", "BINPERSID"}


def test_every_operation_that_finds_or_calls_something_is_refused_by_name():
    answers = {}
    for operation in pickletools.opcodes:
        code = operation.code.encode("latin-1")
        with pytest.raises(MotionloomError) as caught:
            read_plain(b"\x80\x04](" + code + b"\x01\x00\x00\x00\x00\x00\x00\x00\n\n" + b"e.", limit=LIMIT)
        answers[operation.name] = str(caught.value)
    assert answers.keys() >= ACTING | KNOWN
    assert all(f"asks for {name})" in answers[name] for name in ACTING)


@pytest.mark.parametrize("name", list(HOSTILE))
def test_a_hostile_or_damaged_pickle_is_refused_with_one_sentence(name):
    with pytest.raises(MotionloomError, match="is not a pickle of plain values and is not opened") as caught:
        read_plain(HOSTILE[name], limit=LIMIT)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_very_many_operations_are_refused_before_they_are_done():
    """A list of as many lists as the file has bytes; counted, not timed."""
    with pytest.raises(MotionloomError, match="more than 262144 operations"):
        read_plain(b"\x80\x04](" + b"]" * 950_000 + b"e.", limit=LIMIT)
    assert work(lambda: read_plain(b"\x80\x04](" + b"]" * 1000 + b"e.", limit=LIMIT)) < 60_000


def test_shared_containers_that_unfold_without_end_are_refused():
    value: list = [1, 2]
    for _ in range(40):
        value = [value, value]
    with pytest.raises(MotionloomError, match="unfolds"):
        read_plain(pickle.dumps(value), limit=LIMIT)


def test_one_string_used_for_many_arrays_counts_each_time():
    """13 arrays of 80,000 bytes are within 2 ** 20, 14 are not; the pickle itself holds the bytes once."""
    string = b"T" + struct.pack("<I", 80_000) + b"\0" * 80_000 + b"p9\na"
    array = NDARRAY + b"(I1\n(I10000\nt" + F8 + b"I00\ng9\ntba"
    for many in (13, 14):
        with contextlib.nullcontext() if many == 13 else pytest.raises(MotionloomError, match="arrays hold more than"):
            assert len(read_plain(b"]" + string + array * many + b".", limit=LIMIT)) == 1 + many  # type: ignore[arg-type]


def test_one_text_decoded_again_and_again_counts_each_time():
    """Protocol 2 keeps bytes as text, which each mention decodes."""
    word = b"X" + struct.pack("<I", 1000) + b"a" * 1000 + b"q\x02X" + struct.pack("<I", 6) + b"latin1"
    first = b"c_codecs\nencode\nq\x01" + word + b"\x86q\x03R"
    for many in (4, 5):
        data = b"\x80\x02](" + first + b"h\x01h\x03R" * (many - 1) + b"e."
        with contextlib.nullcontext() if many == 4 else pytest.raises(MotionloomError, match="texts hold more than"):
            assert read_plain(data, limit=4999) == [b"a" * 1000] * many


def test_files_beyond_the_limit_or_missing_are_refused(tmp_path):
    (tmp_path / "a.pkl").write_bytes(pickle.dumps("x" * 100))
    assert read_plain_file(tmp_path / "a.pkl", limit=1000) == "x" * 100
    with pytest.raises(MotionloomError, match="files above 50 bytes are not read"):
        read_plain_file(tmp_path / "a.pkl", limit=50)
    with pytest.raises(MotionloomError, match="more than 50"):
        read_plain((tmp_path / "a.pkl").read_bytes(), limit=50)
    with pytest.raises(MotionloomError, match="cannot read"):
        read_plain_file(tmp_path / "b.pkl", limit=50)


@given(st.binary(max_size=200), st.integers(0, 199))
@settings(max_examples=200, deadline=None)
def test_damaged_bytes_are_refused_or_read_but_never_raise_otherwise(noise, place):
    good = pickle.dumps({"a": [np.arange(5.0), "x", 3]}, 2)
    for data in (noise, good[:place] + noise[:3] + good[place:]):
        with contextlib.suppress(MotionloomError):
            read_plain(data, limit=LIMIT)
