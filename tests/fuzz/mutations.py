"""How files are damaged: by what they are made of. Every mutation is a function of the bytes and a random generator."""

import gzip
import io
import json
import math
import random
import re
import struct
import zipfile
from collections.abc import Callable
from functools import cache
from typing import Any

Mutation = Callable[[bytes, random.Random], bytes]

LARGEST = 900_000
"""Bytes of a damaged file."""
NUMBERS = [b"nan", b"NaN", b"-inf", b"Infinity", b"1e308", b"-1e308", b"1e999", b"1e-320", b"0", b"-0", b"-1", b"1",
           b"0.5", b"1e9", b"2147483648", b"-9223372036854775809", b"18446744073709551616", b"9" * 400, b"9" * 5000,
           b"0x10", b"1_0", b"1,5", b"--1", b"1e", b"\xd9\xa1", b"true", b"null", b"'1'", b"1" + b"0" * 30]  # fmt: skip
WORDS = [b"", b" ", b"\0", b"\n", b"\r", b"\x1b[31m", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe9", b"\xed\xa0\x80",
         b"../../x", b"/etc/passwd", b"%s%n", b"{", b"}", b"[", b"]", b"(", b")", b"\"", b"'", b"#", b":", b"=", b",",
         b"<", b">", b"&", b"*", b"!", b"\\", b"\\u0000", b"a.a.a.a", b"x" * 300, b" " * 3000, b"(" * 500, b"[" * 3000,
         b"{\"a\":" * 2000, "\u2028".encode(), "\u202e".encode(), b"-----", b"MOTION", b"End Site\n{\n}\n",
         b"\x80\x04.", b"PK\x03\x04"]  # fmt: skip
NUMBER = re.compile(rb"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
TOKEN = re.compile(rb"[^\s,;:{}\[\]()\"'<>=]+")
PLAIN: list[Any] = [None, True, False, 0, -1, 1, 2**31, 2**63, 2**64, 10**30, 10**400, 0.5, -0.0, 1e308, 1e-320, 1e999,
                    "", " ", "x", "a\nb", "\x00", "\ud800", "x" * 5000, "1", "nan", [], {}, [[]], {"a": {}},
                    [None] * 300, [0.0] * 1000, ["x"] * 1000,
                    {str(k): k for k in range(300)}]  # fmt: skip


def mutated(data: bytes, kind: str, rng: random.Random) -> bytes:
    """The bytes of a file of this kind, damaged one to four times."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        try:
            data = rng.choice(KINDS[kind])(data, rng)
        except Exception:
            data = rng.choice(RAW)(data, rng)  # damaged beyond its structure by the mutation before
        data = data[:LARGEST]
    return data


# Bytes ---------------------------------------------------------------------------------------------------------------


def _span(data: bytes, rng: random.Random, most: int = 64) -> tuple[int, int]:
    at = rng.randrange(len(data) + 1)
    return at, min(len(data), at + rng.randint(1, most))


def flip(data: bytes, rng: random.Random) -> bytes:
    content = bytearray(data)
    for _ in range(min(len(content), rng.choice((1, 1, 2, 8, 64)))):
        content[rng.randrange(len(content))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
    return bytes(content)


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.7 else data[rng.randrange(len(data) + 1) :]


def drop(data: bytes, rng: random.Random) -> bytes:
    first, last = _span(data, rng, rng.choice((4, 64, 4096)))
    return data[:first] + data[last:]


def repeat(data: bytes, rng: random.Random) -> bytes:
    first, last = _span(data, rng, rng.choice((8, 64, 1024)))
    return data[:last] + data[first:last] * rng.choice((1, 2, 20, 300)) + data[last:]


def swap(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    n = rng.randint(1, 64)
    return data[:a] + data[b : b + n] + data[a + n : b] + data[a : a + n] + data[b + n :]


def insert(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice((*WORDS, *NUMBERS, rng.randbytes(8))) + data[at:]


def size(data: bytes, rng: random.Random) -> bytes:
    """A number of four or eight bytes somewhere: lengths and counts are such."""
    form = rng.choice(("<I", ">I", "<Q", "<H"))
    at = rng.randrange(max(1, len(data) - 8))
    if rng.random() < 0.5:
        at = min(at, rng.randrange(64))
    top = 1 << 8 * struct.calcsize(form)
    value = rng.choice((0, 1, top - 1, top // 2, rng.randrange(top), 1 << 20, len(data))) % top
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form) :]


RAW: list[Mutation] = [flip, flip, cut, drop, repeat, swap, insert, size]


# Text ----------------------------------------------------------------------------------------------------------------


def number(data: bytes, rng: random.Random) -> bytes:
    found = rng.choice(list(NUMBER.finditer(data)))
    return data[: found.start()] + rng.choice(NUMBERS) + data[found.end() :]


def all_numbers(data: bytes, rng: random.Random) -> bytes:
    value, share = rng.choice(NUMBERS[:20]), rng.random()
    return NUMBER.sub(lambda m: value if rng.random() < share else m[0], data)


def token(data: bytes, rng: random.Random) -> bytes:
    """One word for another of the file, or for one that nobody expects."""
    found = list(TOKEN.finditer(data))
    one = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.5 else rng.choice(WORDS)
    return data[: one.start()] + other + data[one.end() :]


def many_tokens(data: bytes, rng: random.Random) -> bytes:
    one = rng.choice(list(TOKEN.finditer(data)))
    mark = rng.choice((b" ", b".", b",", b"\n", b"", b"/", b"_"))
    return data[: one.start()] + (one[0][:200] + mark) * rng.choice((10, 1000, 20_000)) + data[one.end() :]


def lines(data: bytes, rng: random.Random) -> bytes:
    rows = data.split(b"\n")
    first, last = sorted((rng.randrange(len(rows)), rng.randrange(len(rows))))
    choice = rng.randrange(5)
    if choice == 0:
        del rows[first : min(last, first + 5) + 1]
    elif choice == 1:
        rows[first:first] = rows[first : last + 1] * rng.choice((1, 3, 100))
    elif choice == 2:
        rows[first], rows[last] = rows[last], rows[first]
    elif choice == 3:
        rows = rows[:first] + rows[last:]
    else:
        rows[first] = rng.choice(WORDS) + rows[first]
    return b"\n".join(rows)


def blanks(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    one = rng.choice((b" ", b"\t", b"\n", b"\r\n", b"\0", b".", b"-", b"9"))
    return data[:at] + one * rng.choice((10, 1000, 200_000)) + data[at:]


def encoding(data: bytes, rng: random.Random) -> bytes:
    said = data.decode("utf-8", "replace")
    return said.encode(rng.choice(("utf-16", "utf-8-sig", "latin-1", "utf-32")), "replace")


TEXT: list[Mutation] = [number, number, all_numbers, token, token, many_tokens, lines, lines, blanks, encoding, *RAW]


# JSON ----------------------------------------------------------------------------------------------------------------


def _places(value: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    for key in value if isinstance(value, dict) else range(len(value)):
        found.append((value, key))
        if isinstance(value[key], dict | list):
            _places(value[key], found)
    return found


def change(value: Any, rng: random.Random) -> Any:
    """One change of a value of dictionaries and lists."""
    places = _places(value, [])
    if not places:
        return rng.choice(PLAIN)
    inside, key = rng.choice(places)
    choice = rng.randrange(8)
    if choice <= 2:
        inside[key] = rng.choice(PLAIN)
    elif choice == 3:
        del inside[key]
    elif choice == 4:
        other, at = rng.choice(places)
        inside[key] = (
            json.loads(json.dumps(other[at])) if at in (other if isinstance(other, dict) else range(len(other))) else 0
        )
    elif choice == 5 and isinstance(inside, list):
        most = LARGEST // len(json.dumps(inside[key])) + 1  # more would be cut off anyway
        inside[key:key] = [inside[key]] * min(most, rng.choice((1, 10, 2000)))
    elif choice == 5:
        inside[rng.choice(("x", "", "\n", "a" * 2000, "__class__"))] = inside[key]
    elif choice == 6:
        for _ in range(rng.choice((1, 30, 600))):
            inside[key] = [inside[key]] if rng.random() < 0.5 else {"a": inside[key]}
    elif isinstance(inside[key], int | float) and not isinstance(inside[key], bool):
        inside[key] = rng.choice((inside[key] + 1, -inside[key], inside[key] * 1e6, inside[key] + 0.5, 2**40))
    return value


def tree(data: bytes, rng: random.Random) -> bytes:
    value = json.loads(data)
    for _ in range(rng.choice((1, 1, 2, 5))):
        value = change(value, rng)
    return json.dumps(value).encode("utf-8", "surrogatepass")


def twice(data: bytes, rng: random.Random) -> bytes:
    """A key again, behind many others."""
    at = rng.choice([m.end() for m in re.finditer(rb"\{", data)])
    many = b"".join(b'"k%d":0,' % k for k in range(rng.choice((0, 10, 30_000))))
    return data[:at] + many + rng.choice((b'"k1":0,', b'"path":0,', b'"a":[' + b"[" * 50)) + data[at:]


JSON: list[Mutation] = [tree, tree, tree, tree, twice, number, all_numbers, *RAW]


def json_lines(data: bytes, rng: random.Random) -> bytes:
    rows = data.split(b"\n")
    at = rng.randrange(len(rows))
    rows[at] = rng.choice(JSON)(rows[at], rng)
    return b"\n".join(rows)


def unpacked(inner: list[Mutation]) -> Mutation:
    """Damage what is packed with gzip, and pack it again."""

    def change_inside(data: bytes, rng: random.Random) -> bytes:
        return gzip.compress(rng.choice(inner)(gzip.decompress(data), rng), mtime=0)

    return change_inside


# Containers ----------------------------------------------------------------------------------------------------------


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
        shape = rng.choice(("()", "(0,)", "(1,)", "(-1,)", "(3, 0, 10**9)", "(2**62, 4)", "(len('a'),)", "(1.0,)", some,
                            "(True,)", "(1,)*40", "(" * 300 + ")" * 300, "[1]", "(1, 263)"))  # fmt: skip
        return npy_head(kind, shape, rng.choice(("False", "True", "1", "None"))) + body
    head = rng.choice(TEXT)(head, rng)
    return b"\x93NUMPY" + bytes((rng.choice((1, 1, 2, 3)), 0)) + struct.pack("<H", len(head) % 65536) + head + body


def special(data: bytes, rng: random.Random) -> bytes:
    """Numbers that are none among those of an array's body."""
    at = rng.randrange(80, max(81, len(data) - 8))
    value = rng.choice((struct.pack("<d", float("nan")), struct.pack("<f", float("inf")), struct.pack("<d", 1e300),
                        b"\xff" * 8, struct.pack("<d", -1.0)))  # fmt: skip
    return data[:at] + value + data[at + len(value) :]


NPY: list[Mutation] = [npy, npy, npy, special, special, *RAW]


def safetensors(data: bytes, rng: random.Random) -> bytes:
    """The head of a safetensors file, its JSON inside JSON too; lengths fit again afterwards."""
    length = struct.unpack("<Q", data[:8])[0]
    head, body = json.loads(data[8 : 8 + length]), data[8 + length :]
    about = head.get("__metadata__", {})
    choice = rng.randrange(4)
    if choice <= 1 and about:
        key = rng.choice(list(about))
        try:
            about[key] = json.dumps(change(json.loads(about[key]), rng))
        except ValueError:
            about[key] = rng.choice(("", "x", "1" * 5000, "[" * 5000))
    elif choice == 2:
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
    b"h\0", b"q\0", b"h\x01", b"h\x02", b"K\xff", b"J\xff\xff\xff\x7f", b"\x8a\xff" + b"\xff" * 20, b"(h\0h\0e",
    b"]" * 3000, b"(" * 3000, b"]q\0(h\0h\0e" * 30, b"cos\nsystem\n", b"c__builtin__\nbytearray\nJ\0\0\0\x40\x85R",
    b"I" + b"9" * 6000 + b"\n", b"F1e999\n", b"\x8e" + b"\xff" * 8, b"\x8d" + b"\0" * 6 + b"\x10\0",
]  # fmt: skip


def pickled(data: bytes, rng: random.Random) -> bytes:
    """Operations of a pickle put in, left out or repeated."""
    at = rng.randrange(2, max(3, len(data)))
    piece = rng.choice(OPERATIONS)
    if rng.random() < 0.4:
        return data[:at] + data[at + rng.randint(1, 6) :]
    return data[:at] + piece * rng.choice((1, 1, 2, 50)) + data[at:]


PICKLE: list[Mutation] = [pickled, pickled, pickled, special, *RAW]


TRANSFORMS = [b" " * 200_000, b"scale(2)" * 3000, b"rotate(1 " * 3000, b"matrix(" + b"1 " * 50_000, b"(((("]
DRAWN = [b" l1 1" * 30_000, b" a1 1 0 0 1 1 1" * 3000, b"h" + b"9" * 100_000, b" c" + b"1 " * 60_000]


def xml(data: bytes, rng: random.Random) -> bytes:
    """An element or an attribute too many, too deep or too long."""
    at = rng.choice([m.end() for m in re.finditer(rb"<\w+", data)])
    pieces = (
        b" transform='" + rng.choice(TRANSFORMS) + b"'", b" d='M0 0" + rng.choice(DRAWN) + b"'",
        b" points='" + b"1," * 60_000 + b"'", b"><g>" + b"<g>" * 400, b" xmlns='x' id='\xff'",
    )  # fmt: skip
    return data[:at] + rng.choice(pieces) + data[at:]


def torch_member(name: str) -> list[Mutation]:
    """What damages a member of a file of torch: its pickle, or raw numbers."""
    return PICKLE if name.endswith(".pkl") else RAW


KINDS: dict[str, list[Mutation]] = {
    "raw": RAW,
    "text": TEXT,
    "json": JSON,
    "jsonl": [json_lines, json_lines, *TEXT],
    "jsonl.gz": [unpacked([json_lines, *TEXT]), unpacked([json_lines, *TEXT]), *RAW],
    "npy": NPY,
    "npz": [in_zip(lambda name: NPY), in_zip(lambda name: NPY), in_zip(lambda name: NPY), bomb, directory, *RAW, *RAW],
    "pickled npz": [in_zip(lambda name: [pickled, npy, *RAW]), in_zip(lambda name: PICKLE), directory, *RAW],
    "safetensors": SAFETENSORS,
    "glb": [glb, glb, glb, *RAW],
    "pickle": PICKLE,
    "torch": [in_zip(torch_member), in_zip(torch_member), directory, directory, *RAW],
    "old torch": PICKLE,
    "svg": [xml, *TEXT],
}
"""By the kind of file."""
