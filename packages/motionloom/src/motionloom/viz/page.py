"""Motions as one page of HTML that plays them: the studio's viewer (`studio/src/viewer`) with the motions in it.

The page loads nothing from anywhere, and nothing in it that comes from outside is markup or code: names and numbers
are in it as JSON, of which every character that HTML knows is written as an escape.
"""

import base64
import html
import json
import math
import struct
import tempfile
import warnings
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.character import Character
from motionloom.retarget import joints22, to_smpl22
from motionloom.viz.film import caption

VIEWER = Path(__file__).with_name("viewer.html")
MISSING = (
    "the viewer is not built into this installation: run 'make page' in a clone of motionloom, or install it again "
    "('pip install .') with Node.js 20.19 or later on the PATH"
)
MAX_BYTES = 1_500_000
"""Of a page without a character; longer motions are shown at a lower frame rate."""
MAX_PEOPLE = 8
UNIT = 0.00025
"""Metres: places are whole numbers of it."""
_GRAIN = 2.0**-13
"""Quaternions and metres of a character's motion are multiples of it: 0.01 degrees, 0.1 millimetres."""
_MOTION = '<script type="application/json" id="motion">', "</script>"
_TITLE = "<title>motionloom</title>"
_PACKED = {"EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_texture_basisu"}
_FLOAT = 5126
"""Of numbers in glTF."""
_MATRICES = ("inverseBindMatrices", "extensions")


@dataclass(frozen=True)
class Take:
    """People who share one world, under one name."""

    name: str
    people: Sequence[Motion]


def find_viewer() -> Path:
    """Where the viewer lies; raises `MotionloomError` where it was not built."""
    if not VIEWER.is_file():
        raise MotionloomError(MISSING)
    return VIEWER


def save_page(motions: Sequence[Motion], path: Path | str, *, captions: Sequence[str] | None = None) -> Path:
    """Write motions as takes of one page of HTML, under their captions; gives the path back.

    Raises `MotionloomError` as `page` does, and for captions of another count.
    """
    names = [""] * len(motions) if captions is None else list(captions)
    if len(names) != len(motions):
        raise MotionloomError(f"{len(motions)} motions need as many captions; got {len(names)}")
    return write_page([Take(name, [motion]) for name, motion in zip(names, motions)], path)


def save_people(motions: Sequence[Motion], path: Path | str, *, caption: str = "") -> Path:
    """Write people who share one world frame as one take of one page."""
    return write_page([Take(caption, motions)], path)


def write_page(takes: Sequence[Take], path: Path | str, *, character: Character | None = None) -> Path:
    """Write `page` as a file, whole or not at all; gives the path back."""
    text = page(takes, character=character)
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def page(takes: Sequence[Take], *, character: Character | None = None, most: int = MAX_BYTES) -> str:
    """The text of a page of HTML that plays takes, with nothing else to load.

    takes: of humanoids; without a character the uniform person plays them, whatever body they have.
    character: a .glb or .vrm whose skeleton the motions have; its file becomes part of the page, with its pictures.
    most: bytes of the page without the character; frames are left out, which is said, until it is no larger.

    Raises `MotionloomError` where the viewer is not built, there is nothing to play or nobody in it, for more than
    `MAX_PEOPLE` in a take, and for a character in another kind of file.
    """
    takes = [Take(caption(take.name), _in_step(take.people)) for take in takes]
    people = [motion for take in takes for motion in take.people]
    if not people or not all(1 <= len(take.people) <= MAX_PEOPLE for take in takes):
        counts = ", ".join(str(len(take.people)) for take in takes) or "none"
        raise MotionloomError(f"a page shows takes of 1 to {MAX_PEOPLE} people; got {counts}")
    template = find_viewer().read_text(encoding="utf-8")
    body = None if character is None else _animated(character, people)
    places = [_places(motion) if character is None else joints22(motion) for motion in people]
    room = most - len(template.encode()) - sum(12 * len(take.name) for take in takes)
    step, data = 1, _packed(places, 1)
    while sum(map(len, data)) > room and step < max(map(len, places)):
        step = max(step + 1, math.ceil(step * sum(map(len, data)) / max(room, 1)))
        data = _packed(places, step)
    if step > 1:
        warnings.warn(
            f"one frame in {step} is kept, so that the page stays under {most / 1e6:g} MB; cut the motion for all of "
            "them (--start, --end)",
            stacklevel=2,
        )
    parts = iter(zip((len(one[::step]) for one in places), data))
    entries = [
        {
            "name": take.name,
            "fps": take.people[0].fps / step,
            "people": [{"frames": frames, "data": text} for frames, text in islice(parts, len(take.people))],
        }
        for take in takes
    ]
    title = " | ".join(dict.fromkeys(take["name"] for take in entries if take["name"]))[:200]
    return _filled(template, title or "motionloom", {"takes": entries, "unit": UNIT, "character": body})


def _in_step(people: Sequence[Motion]) -> list[Motion]:
    """Everybody at the rate of the first, until the last one ends; who ends before stays as they are."""
    if len({(len(motion), motion.fps) for motion in people}) < 2:
        return list(people)
    fps = people[0].fps
    frames = max(round(motion.seconds * fps) for motion in people)
    return [motion.at(np.arange(frames) * (motion.fps / fps), fps) for motion in people]


def _places(motion: Motion) -> np.ndarray:
    """(frames, 22, 3) metres of the uniform person."""
    return (motion if motion.skeleton == SMPL22 else to_smpl22(motion)).positions()


def _packed(places: Sequence[np.ndarray], step: int) -> list[str]:
    """For each person deflated differences from frame to frame: the root's places, the others' from it.

    Whole numbers of `UNIT`, joint after joint, all low bytes before all higher ones, so that equal ones are near.
    """
    texts = []
    for one in places:
        frames = one[::step].copy()
        frames[:, 1:] -= frames[:, :1]
        whole = np.rint(frames.reshape(len(frames), -1) / UNIT).clip(-(2**30), 2**30).astype("<i4")
        steps = np.ascontiguousarray(np.diff(whole, axis=0, prepend=0).astype("<i4").T)
        planes = steps.view(np.uint8).reshape(-1, 4).T.tobytes()
        texts.append(_deflated(planes))
    return texts


def _animated(character: Character, people: Sequence[Motion]) -> str:
    """The character's file with these motions as its animations, in their order, deflated."""
    if ".glb" not in character.suffixes:
        raise MotionloomError(
            f"a page carries a character of one file, a .glb or .vrm; got {character.path}: export it as one"
        )
    before = character.file.document.json
    if packed := sorted(_PACKED.intersection(before.get("extensionsRequired", []))):
        raise MotionloomError(f"a page cannot unpack {packed[0]}, which {character.path} needs; export it without it")
    with tempfile.TemporaryDirectory() as folder:
        clips = [(motion, f"motion {number}") for number, motion in enumerate(people)]
        data = character.save_clips(clips, Path(folder) / "character.glb", replace=True).read_bytes()
    return _deflated(_rounded(_without(data, before.get("animations", []))))


def _rounded(data: bytes) -> bytes:
    """A .glb whose animations have multiples of `_GRAIN`, of which less is left when they are deflated."""
    (length,) = struct.unpack_from("<I", data, 12)
    document, result = json.loads(data[20 : 20 + length]), bytearray(data)
    samplers = [one for animation in document["animations"] for one in animation["samplers"]]
    for number in sorted({one["output"] for one in samplers}):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        if accessor["componentType"] != _FLOAT or "byteStride" in view or "extensions" in view:
            continue
        start = 28 + length + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        values = np.frombuffer(result, "<f4", count, start)
        values[:] = np.rint(values / _GRAIN) * _GRAIN
    return bytes(result)


def _without(data: bytes, animations: Sequence[dict]) -> bytes:
    """A .glb with zeros, which take no room deflated, where only animations have their numbers that it lost."""
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    views, accessors = document.get("bufferViews", []), document.pop("accessors", [])
    used = _numbers(document.get("meshes")) | _numbers([document.get("skins"), document["nodes"]], _MATRICES)
    lost = _numbers(list(animations), ("samplers",)) - _numbers(document["animations"], ("samplers",)) - used
    needed = _numbers([one for number, one in enumerate(accessors) if number not in lost], ("bufferView",))
    needed |= _numbers(document, ("bufferView",))
    if any(view.get("extensions") or view.get("buffer", 0) for view in views):
        return data
    empty = np.zeros(len(data), bool)
    for keep in (False, True):
        for number, view in enumerate(views):
            if (number in needed) == keep:
                start = 28 + length + view.get("byteOffset", 0)
                empty[start : start + view["byteLength"]] = not keep
    return np.where(empty, np.uint8(0), np.frombuffer(data, np.uint8)).tobytes()


def _numbers(tree: object, keys: Sequence[str] = ()) -> set[int]:
    """Whole numbers anywhere in JSON, or those of some keys alone."""
    if isinstance(tree, dict):
        inside = (_numbers(value, () if key in keys else keys) for key, value in tree.items())
        return set().union(*inside)
    if isinstance(tree, list):
        return set().union(*(_numbers(value, keys) for value in tree))
    return {tree} if isinstance(tree, int) and not keys else set()


def _deflated(data: bytes) -> str:
    return base64.b64encode(zlib.compress(data, 9)).decode()


def _filled(template: str, title: str, content: dict) -> str:
    """The viewer with a title and with what it shows; letters that are none (half of a pair) become question marks."""
    if template.count("".join(_MOTION)) != 1 or template.count(_TITLE) != 1:
        raise MotionloomError(f"{VIEWER} is not the viewer of this version; build it again by 'make page'")
    text = json.dumps(content).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    whole = template.replace("".join(_MOTION), text.join(_MOTION))
    title = html.escape(title.encode("utf-8", "replace").decode())
    return whole.replace(_TITLE, f"<title>{title}</title>", 1)
