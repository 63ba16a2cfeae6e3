"""glTF from strangers: every mistake is one sentence, and nothing takes long."""

import copy
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.io.gltf import load_glb, save_glb
from tests.io.gltf_files import CHAIN, Foreign, random_motion
from tests.work import work


def broken(change: str) -> Foreign:
    """A sound file with one thing wrong."""
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "rotation", [0, 0.04], [[0, 0, 0, 1]] * 2)
    exec(change, {"file": file, "j": file.json, "np": np})
    return file


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("j['nodes'][1]['children'] = [0]", "circle"),
        ("j['nodes'][1]['children'] = [1]", "two parents"),
        ("j['nodes'].append({'children': [1]})", "two parents"),
        ("j['nodes'][0]['children'] = [7]", "names none of its 2 nodes"),
        ("j['nodes'][0]['children'] = [True]", "names none"),
        ("j['nodes'][0]['scale'] = [1, 2, 1]", "scaled by"),
        ("j['nodes'][0]['scale'] = [0, 0, 0]", "scaled by"),
        ("j['nodes'][0]['scale'] = [-1, -1, -1]", "scaled by"),
        ("j['nodes'][0]['matrix'] = [1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]", "sheared"),
        ("j['nodes'][0]['matrix'] = [0] * 16", "flat"),
        ("j['nodes'][1]['translation'] = [0, 1e300, 0]", "finite"),
        ("j['nodes'][1]['translation'] = [0, 1e8, 0]", "check the units"),
        ("j['nodes'][1]['translation'] = 'up'", "3 finite numbers"),
        ("j['nodes'][0]['rotation'] = [0, 0, 0, 0]", "unit quaternion"),
        ("j['nodes'] = []", "nodes"),
        ("j['nodes'] = {'a': 1}", "list of objects"),
        ("j['accessors'][0]['count'] = 2**40", "claims"),
        ("j['accessors'][0]['count'] = 10**7", "beyond the end"),
        ("j['accessors'][0]['count'] = -1", "count"),
        ("j['accessors'][1]['count'] = 1", "1 values for 2 key times"),
        ("j['accessors'][1]['type'] = 'VEC3'", "must be VEC4"),
        ("j['accessors'][1]['componentType'] = 5130", "component type"),
        ("j['accessors'][1]['byteOffset'] = 8", "beyond the end"),
        ("j['accessors'][1]['sparse'] = {}", "sparse"),
        ("j['bufferViews'][1]['byteStride'] = 3", "stride"),
        ("j['bufferViews'][1]['byteLength'] = 10**9", "beyond the end"),
        ("j['bufferViews'][1]['buffer'] = 4", "buffers"),
        ("file.data = file.data[:8] + np.full(8, np.nan, '<f4').tobytes()", "not finite"),
        ("file.data = np.array([1, 0], '<f4').tobytes() + file.data[8:]", "do not rise"),
        ("file.data = np.array([0, 1e6], '<f4').tobytes() + file.data[8:]", "too large"),
        ("file.data = file.data[:8] + bytes(32)", "unit quaternion"),
        ("j['animations'][0]['samplers'][0]['interpolation'] = 'MAGIC'", "MAGIC"),
        ("j['animations'][0]['samplers'][0]['interpolation'] = 'CUBICSPLINE'", "values for"),
        ("j['animations'][0]['channels'][0]['sampler'] = 9", "samplers"),
        ("j['animations'] = []", "neither"),
        ("j['asset'] = {'version': '1.0'}", "version"),
        ("j['asset'] = 3", "version"),
        ("j['skins'] = [{'joints': []}]", "no joints"),
        ("j['skins'] = [{'joints': [5]}]", "nodes"),
        ("j['bufferViews'][0]['extensions'] = {'EXT_meshopt_compression': {}}", "compress"),
    ],
)
def test_wrong_files_are_refused_in_one_sentence(tmp_path: Path, change: str, words: str) -> None:
    with pytest.raises(MotionloomError, match=words) as caught:
        load_glb(broken(change).write(tmp_path))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300 + len(str(tmp_path))


@pytest.mark.parametrize(
    "uri", ["secret.bin", "../../etc/passwd", "/etc/passwd", "file:///etc/passwd", "http://a/b", 7]
)
def test_outside_files_are_never_followed(tmp_path: Path, uri: Any) -> None:
    (tmp_path / "secret.bin").write_bytes(bytes(100))
    path = broken("").write(tmp_path)
    content = json.loads(path.read_text())
    content["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(content))
    with pytest.raises(MotionloomError, match="outside file"):
        load_glb(path)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"glTF",
        b"glTF" + struct.pack("<II", 2, 2**32 - 1) + bytes(20),
        b"glTF" + struct.pack("<II", 1, 32) + bytes(20),
        b"glTF" + struct.pack("<III", 2, 32, 2**32 - 1) + b"JSON" + bytes(12),
        b"glTF" + struct.pack("<III", 2, 32, 12) + b"BIN\0" + bytes(12),
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe{}",
        b"[" * 100_000,
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [NaN, 0, 0]}]}',
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [' + b"9" * 5000 + b", 0, 0]}]}",
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [1e999, 0, 0]}]}',
        bytes(range(256)),
    ],
)
def test_junk_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "x.glb"
    path.write_bytes(data)
    with pytest.raises(MotionloomError):
        load_glb(path)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.glb", tmp_path):
        with pytest.raises(MotionloomError):
            load_glb(path)


def test_every_truncation_is_refused(tmp_path: Path) -> None:
    data = save_glb([random_motion(0, joints=3, frames=2)], tmp_path / "x.glb", body=False).read_bytes()
    path = tmp_path / "cut.glb"
    for length in range(0, len(data), 29):
        path.write_bytes(data[:length])
        with pytest.raises(MotionloomError):
            load_glb(path)


def load_or_complaint(path: Path) -> Motion | str:
    try:
        return load_glb(path)
    except MotionloomError as error:
        return str(error)


def loads_or_complains(path: Path) -> None:
    result = load_or_complaint(path)
    if isinstance(result, str):
        assert "\n" not in result
    else:
        assert np.isfinite(result.positions()).all()


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=6))
def test_changed_bytes_give_a_motion_or_a_sentence(tmp_path: Path, edits: list[tuple[float, int]]) -> None:
    source = tmp_path / "sound.glb"
    if not source.exists():
        save_glb([random_motion(0, joints=3, frames=3, moving=True)], source)
    data = bytearray(source.read_bytes())
    for where, value in edits:
        data[int(where * len(data))] = value
    path = tmp_path / "mutant.glb"
    path.write_bytes(data)
    loads_or_complains(path)


def leaves(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Ways to every value in a JSON tree."""
    below = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [way for key, inner in below for way in [(*at, key), *leaves(inner, (*at, key))]]


NASTY = st.sampled_from(
    [
        None,
        True,
        -1,
        0,
        1,
        3,
        2**31,
        2**63,
        10**30,
        1e300,
        -0.5,
        "",
        "x",
        "\ud800",
        [],
        {},
        [0],
        [[]],
        {"a": 1},
        [None] * 4,
    ]
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(st.tuples(st.integers(0, 10**6), NASTY), min_size=1, max_size=3))
def test_changed_declarations_give_a_motion_or_a_sentence(tmp_path: Path, edits: list[tuple[int, Any]]) -> None:
    file = Foreign(
        [{"name": "top", "scale": [2, 2, 2], "children": [1]}, {"children": [2], "rotation": [0, 0, 0, 1]}, {}]
    )
    file.json["skins"] = [{"joints": [1, 2], "skeleton": 1}]
    file.key(1, "rotation", [0, 0.04, 0.08], [[0, 0, 0, 1]] * 3).key(
        1, "translation", [0, 1], [[0, 0, 0]] * 2, mode="STEP"
    )
    file.key(2, "translation", [0, 1], [[0, 1, 0]] * 6, mode="CUBICSPLINE").key(0, "scale", [0], [[2, 2, 2]])
    path = file.write(tmp_path)
    content = json.loads(path.read_text())
    for number, value in edits:
        ways = leaves(content)
        if not ways:
            break
        *way, last = ways[number % len(ways)]
        place = content
        for key in way:
            place = place[key]
        place[last] = copy.deepcopy(value)
    path.write_text(json.dumps(content))
    loads_or_complains(path)


def deep_wide_and_many(size: int) -> tuple[Foreign, Foreign, Foreign]:
    """A chain of so many nodes, a node with so many children, and a chain under sixty skins."""
    chain = [{"children": [i + 1]} for i in range(size)] + [{}]
    fan = [{"children": list(range(1, size))}] + [{} for _ in range(size)]
    deep, wide = (Foreign(nodes).key(0, "rotation", [0], [[0, 0, 0, 1]]) for nodes in (chain, fan))
    many = Foreign([{"children": [i + 1]} for i in range(size)] + [{}])
    many.json["skins"] = [{"joints": list(range(size + 1))}] * 60
    return deep, wide, many


@pytest.mark.parametrize("kind", [0, 1, 2], ids=["deep", "wide", "many"])
def test_deep_and_wide_trees_are_as_much_work_as_they_are_large(tmp_path: Path, kind: int) -> None:
    def counted(size: int) -> int:
        path = deep_wide_and_many(size)[kind].write(tmp_path)
        load_or_complaint(path)
        return work(lambda: load_or_complaint(path))

    assert counted(1_600) <= 9 * counted(200)
    load_or_complaint(deep_wide_and_many(9_999)[kind].write(tmp_path))
