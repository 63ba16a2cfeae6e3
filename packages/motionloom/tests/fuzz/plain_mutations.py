"""How bytes, text, JSON and XML are damaged."""

import copy
import gzip
import json
import random
import re
import struct
from collections.abc import Callable
from typing import Any

Mutation = Callable[[bytes, random.Random], bytes]

LARGEST = 900_000
"""Bytes of a damaged file."""
NUMBERS = [
    b"nan",
    b"NaN",
    b"-inf",
    b"Infinity",
    b"1e308",
    b"-1e308",
    b"1e999",
    b"1e-320",
    b"0",
    b"-0",
    b"-1",
    b"1",
    b"0.5",
    b"1e9",
    b"2147483648",
    b"-9223372036854775809",
    b"18446744073709551616",
    b"9" * 400,
    b"9" * 5000,
    b"1e" + b"9" * 5000,
    b"1e-" + b"9" * 5000,
    b"0.03e" + b"0" * 5000,
    b"-" + b"9" * 5000 + b".5",
    b"0." + b"0" * 5000 + b"1e5000",
    b"0x10",
    b"1_0",
    b"1,5",
    b"--1",
    b"1e",
    b"\xd9\xa1",
    b"true",
    b"null",
    b"'1'",
    b"1" + b"0" * 30,
]
WORDS = [
    b"",
    b" ",
    b"\0",
    b"\n",
    b"\r",
    b"\x1b[31m",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xe9",
    b"\xed\xa0\x80",
    b"../../x",
    b"/etc/passwd",
    b"%s%n",
    b"{",
    b"}",
    b"[",
    b"]",
    b"(",
    b")",
    b'"',
    b"'",
    b"#",
    b":",
    b"=",
    b",",
    b"<",
    b">",
    b"&",
    b"*",
    b"!",
    b"\\",
    b"\\u0000",
    b"a.a.a.a",
    b"x" * 300,
    b" " * 3000,
    b"(" * 500,
    b"[" * 3000,
    b'{"a":' * 2000,
    "\u2028".encode(),
    "\u202e".encode(),
    b"-----",
    b"MOTION",
    b"End Site\n{\n}\n",
    b"\x80\x04.",
    b"PK\x03\x04",
    b"walk " * 500,
    b"s",
    b", s,",
    b"\x1b]0;x\x07",
    "\x9b2J".encode(),
    b"\x7f",
]
NUMBER = re.compile(rb"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
TOKEN = re.compile(rb"[^\s,;:{}\[\]()\"'<>=]+")
PLAIN: list[Any] = [
    None,
    True,
    False,
    0,
    -1,
    1,
    2**31,
    2**63,
    2**64,
    10**30,
    10**400,
    0.5,
    -0.0,
    1e308,
    1e-320,
    1e999,
    "",
    " ",
    "x",
    "a\nb",
    "\x00",
    "\ud800",
    "x" * 5000,
    "1",
    "nan",
    [],
    {},
    [[]],
    {"a": {}},
    [None] * 300,
    [0.0] * 1000,
    ["x"] * 1000,
    {str(k): k for k in range(300)},
]


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
        return copy.deepcopy(rng.choice(PLAIN))
    inside, key = rng.choice(places)
    choice = rng.randrange(8)
    if choice <= 2:
        inside[key] = copy.deepcopy(rng.choice(PLAIN))  # later changes must not change the list itself
    elif choice == 3:
        del inside[key]
    elif choice == 4:
        other, at = rng.choice(places)
        inside[key] = (
            json.loads(json.dumps(other[at])) if at in (other if isinstance(other, dict) else range(len(other))) else 0
        )
    elif choice == 5 and isinstance(inside, list):
        most = LARGEST // len(json.dumps(inside[key])) + 1  # more would be cut off anyway
        one = json.dumps(inside[key])  # copies: one change of something that is there 2,000 times is not 2,000 changes
        inside[key:key] = [json.loads(one) for _ in range(min(most, rng.choice((1, 10, 2000))))]
    elif choice == 5:
        inside[rng.choice(("x", "", "\n", "a" * 2000, "__class__"))] = copy.deepcopy(inside[key])
    elif choice == 6:
        for _ in range(rng.choice((1, 30, 600))):
            inside[key] = [inside[key]] if rng.random() < 0.5 else {"a": inside[key]}
    elif isinstance(inside[key], int | float) and not isinstance(inside[key], bool):
        inside[key] = rng.choice((inside[key] + 1, -inside[key], inside[key] * 1e6, inside[key] + 0.5, 2**40))
    return value


def count(value: Any, rng: random.Random) -> Any:
    """One whole number a little more or less, or another one of the same value: counts no longer fit each other."""
    numbers = [(o, k) for o, k in _places(value, []) if type(o[k]) is int]
    inside, key = rng.choice(numbers)
    other, at = rng.choice(numbers)
    inside[key] = rng.choice((inside[key] - 1, inside[key] + 1, other[at], inside[key] // 2, inside[key] * 2))
    return value


def tree(data: bytes, rng: random.Random) -> bytes:
    value = json.loads(data)
    for _ in range(rng.choice((1, 1, 2, 5))):
        value = rng.choice((change, change, change, count))(value, rng)
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


# XML ------------------------------------------------------------------------------------------------------------------


TRANSFORMS = [b" " * 200_000, b"scale(2)" * 3000, b"rotate(1 " * 3000, b"matrix(" + b"1 " * 50_000, b"(((("]
DRAWN = [b" l1 1" * 30_000, b" a1 1 0 0 1 1 1" * 3000, b"h" + b"9" * 100_000, b" c" + b"1 " * 60_000]


def xml(data: bytes, rng: random.Random) -> bytes:
    """An element or an attribute too many, too deep or too long."""
    at = rng.choice([m.end() for m in re.finditer(rb"<\w+", data)])
    pieces = (
        b" transform='" + rng.choice(TRANSFORMS) + b"'",
        b" d='M0 0" + rng.choice(DRAWN) + b"'",
        b" points='" + b"1," * 60_000 + b"'",
        b"><g>" + b"<g>" * 400,
        b" xmlns='x' id='\xff'",
    )
    return data[:at] + rng.choice(pieces) + data[at:]
