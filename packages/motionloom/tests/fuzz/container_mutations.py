"""How containers are damaged: archives, arrays, safetensors, GLB, pickles. What is inside of them as well."""

import io
import json
import math
import random
import struct
import zipfile
from collections.abc import Callable
from functools import cache

from tests.fuzz.plain_mutations import JSON, RAW, TEXT, Mutation, change


def _members(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _zipped(members: dict[str, bytes], kind: int) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", kind) as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content, compress_type=kind)
    return made.getvalue()


def in_zip(inner: Callable[[str], list[Mutation]]) -> Mutation:
    """Damage a member, or the list of members, of an archive that is whole again afterwards."""

    def change_inside(data: bytes, rng: random.Random) -> bytes:
        members = _members(data)
        name = rng.choice(list(members))
        choice = rng.randrange(10)
        if choice == 0:
            del members[name]
        elif choice == 1:
            members[rng.choice((name + "x", "../" + name, "a" * 3000, "é.npy"))] = members[name]
        elif choice == 2:
            members[name] = members[rng.choice(list(members))]
        else:
            members[name] = rng.choice(inner(name))(members[name], rng)
        kinds = (zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2)
        return _zipped(members, rng.choice(kinds))

    return change_inside


BOMBS = [
    ("|i1", (6 * 10**7,)),
    ("|u1", (10**6, 66)),
    ("<f4", (10**7, 3)),
    ("|b1", (450_000, 22, 3)),
    ("<f4", (6 * 10**6,)),
]


def bomb(data: bytes, rng: random.Random) -> bytes:
    """A member of very many equal numbers, packed small, whose head says so truthfully."""
    members = _members(data)
    name = rng.choice([n for n in members if n.endswith(".npy")])
    kind, shape = rng.choice(BOMBS)
    packed = rng.choice((zipfile.ZIP_DEFLATED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA))
    return _with_bomb(members, name, kind, shape, packed)


def _with_bomb(members: dict[str, bytes], name: str, kind: str, shape: tuple[int, ...], packed: int) -> bytes:
    made, head = io.BytesIO(), npy_head(kind, shape)
    info = zipfile.ZipInfo(name)
    info.compress_type, info.file_size = packed, len(head) + math.prod(shape) * int(kind[-1])
    info.CRC, body = _packed_bomb(kind, shape, packed)
    info.compress_size = len(body)
    with zipfile.ZipFile(made, "w") as archive:
        for other, content in members.items():
            if other != name:
                archive.writestr(zipfile.ZipInfo(other), content)
        info.header_offset = made.tell()  # what is packed already is put in as it is
        made.write(info.FileHeader() + body)
        archive.filelist.append(info)
        archive.NameToInfo[name] = info
        archive.start_dir, archive._didModify = made.tell(), True  # type: ignore[attr-defined]
    return made.getvalue()


@cache
def _packed_bomb(kind: str, shape: tuple[int, ...], packed: int) -> tuple[int, bytes]:
    """Checksum and packed bytes of an array of zeros as a file of numpy's."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        body = npy_head(kind, shape) + bytes(math.prod(shape) * int(kind[-1]))
        archive.writestr(zipfile.ZipInfo("a"), body, compress_type=packed, compresslevel=1)
        info = archive.getinfo("a")
    first = len(info.FileHeader())
    return info.CRC, made.getvalue()[first : first + info.compress_size]


def prepare() -> None:
    """Pack what takes long to pack: once, and not in every process."""
    for kind, shape in BOMBS:
        for packed in (zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA):
            _packed_bomb(kind, shape, packed)


def directory(data: bytes, rng: random.Random) -> bytes:
    """A number in the archive's own directory, which lies at its end."""
    at = data.rfind(b"PK\x01\x02" if rng.random() < 0.7 else b"PK\x05\x06")
    at += rng.randrange(4, 46)
    return (
        data[:at] + struct.pack("<I", rng.choice((0, 1, 0xFFFFFFFF, 1 << 31, rng.randrange(1 << 32)))) + data[at + 4 :]
    )


def npy_head(kind: str, shape: tuple[int, ...] | str, order: str = "False") -> bytes:
    head = f"{{'descr': {kind!r}, 'fortran_order': {order}, 'shape': {shape}, }}".encode()
    head += b" " * (-(len(head) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(head) % 65536) + head


def npy(data: bytes, rng: random.Random) -> bytes:
    """Another head before the same numbers."""
    length = struct.unpack("<H", data[8:10])[0]
    head, body = data[10 : 10 + length], data[10 + length :]
    if rng.random() < 0.5:
        kind = rng.choice(
            ("<f4", "<f8", ">f8", "<f2", "|O", "|V8", "<U4", "|S3", "<c16", "<M8[s]", "|b1", "<i8", "<f16", "x")
        )
        some = f"({max(len(body) // 8, 1)},)"
        shape = rng.choice(
            (
                "()",
                "(0,)",
                "(1,)",
                "(-1,)",
                "(3, 0, 10**9)",
                "(2**62, 4)",
                "(len('a'),)",
                "(1.0,)",
                some,
                "(True,)",
                "(1,)*40",
                "(" * 300 + ")" * 300,
                "[1]",
                "(1, 263)",
            )
        )
        return npy_head(kind, shape, rng.choice(("False", "True", "1", "None"))) + body
    head = rng.choice(TEXT)(head, rng)
    return b"\x93NUMPY" + bytes((rng.choice((1, 1, 2, 3)), 0)) + struct.pack("<H", len(head) % 65536) + head + body


def special(data: bytes, rng: random.Random) -> bytes:
    """Numbers that are none among those of an array's body."""
    at = rng.randrange(80, max(81, len(data) - 8))
    value = rng.choice(
        (
            struct.pack("<d", float("nan")),
            struct.pack("<f", float("inf")),
            struct.pack("<d", 1e300),
            b"\xff" * 8,
            struct.pack("<d", -1.0),
        )
    )
    return data[:at] + value + data[at + len(value) :]


NPY: list[Mutation] = [npy, npy, npy, special, special, *RAW]


def safetensors(data: bytes, rng: random.Random) -> bytes:
    """The head of a safetensors file, its JSON inside JSON too; lengths fit again afterwards."""
    length = struct.unpack("<Q", data[:8])[0]
    head, body = json.loads(data[8 : 8 + length]), data[8 + length :]
    about = head.get("__metadata__", {})
    choice = rng.randrange(25)
    if choice == 24:
        empty = {"dtype": "F32", "shape": [0], "data_offsets": [len(body)] * 2}
        head |= {f"x{number}": empty for number in range(rng.choice((10, 9_000, 12_000)))}
    elif choice < 12 and about:
        key = rng.choice(list(about))
        try:
            about[key] = json.dumps(change(json.loads(about[key]), rng))
        except ValueError:
            about[key] = rng.choice(("", "x", "1" * 5000, "[" * 5000))
    elif choice < 18:
        head = change(head, rng)
    else:
        names = [n for n in head if n != "__metadata__"]
        one, other = rng.choice(names), rng.choice(names)
        head[one], head[other] = head[other], head[one]
        if rng.random() < 0.5:
            head[one]["dtype"] = rng.choice(("F16", "BF16", "F64", "I64", "BOOL", "F8_E4M3", "U8", "C64", "F4"))
    made = json.dumps(head).encode("utf-8", "surrogatepass")
    made += b" " * (-len(made) % 8)
    return struct.pack("<Q", len(made)) + made + body


SAFETENSORS: list[Mutation] = [safetensors, safetensors, safetensors, special, *RAW]


def glb(data: bytes, rng: random.Random) -> bytes:
    """The JSON of a GLB, whose lengths fit again afterwards."""
    length = struct.unpack("<I", data[12:16])[0]
    said, rest = data[20 : 20 + length], data[20 + length :]
    said = rng.choice(JSON)(said, rng)
    said += b" " * (-len(said) % 4)
    return (
        data[:4]
        + struct.pack("<II", 2, 20 + len(said) + len(rest))
        + struct.pack("<I", len(said))
        + b"JSON"
        + said
        + rest
    )


OPERATIONS = [
    *(bytes([code]) for code in b"]}(N02tleasuRbQ\x93\x94"),
    b"h\0",
    b"q\0",
    b"h\x01",
    b"h\x02",
    b"K\xff",
    b"J\xff\xff\xff\x7f",
    b"\x8a\xff" + b"\xff" * 20,
    b"(h\0h\0e",
    b"]" * 3000,
    b"(" * 3000,
    b"(" + b"]" * 500_000 + b"e",
    b"]q\0(h\0h\0e" * 30,
    b"cos\nsystem\n",
    b"c__builtin__\nbytearray\nJ\0\0\0\x40\x85R",
    b"I" + b"9" * 6000 + b"\n",
    b"F1e999\n",
    b"\x8e" + b"\xff" * 8,
    b"\x8d" + b"\0" * 6 + b"\x10\0",
]


def pickled(data: bytes, rng: random.Random) -> bytes:
    """Operations of a pickle put in, left out or repeated."""
    at = rng.randrange(2, max(3, len(data)))
    piece = rng.choice(OPERATIONS)
    if rng.random() < 0.4:
        return data[:at] + data[at + rng.randint(1, 6) :]
    return data[:at] + piece * rng.choice((1, 1, 2, 50)) + data[at:]


PICKLE: list[Mutation] = [pickled, pickled, pickled, special, *RAW]


def torch_member(name: str) -> list[Mutation]:
    """What damages a member of a file of torch: its pickle, or raw numbers."""
    return PICKLE if name.endswith(".pkl") else RAW
