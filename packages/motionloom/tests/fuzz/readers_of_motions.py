"""Readers of motions, and of what is asked of them: goals, timelines, masks, drawings."""

import json
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from motionloom.io.character import load_character
from motionloom.io.glb import read_document
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.io.gltf_read import load_glb_people
from tests.fuzz.plain_mutations import LARGEST
from tests.fuzz.reader import reader
from tests.io.rigged import Hero, wave
from tests.io.test_asf import AMC, ASF
from tests.io.test_bvh import ARM
from tests.shared import SHARED

# Motions -------------------------------------------------------------------------------------------------------------


@cache
def motion(frames: int = 3) -> Motion:
    generator = np.random.default_rng(0)
    turns = np.tile(IDENTITY, (frames, 22, 1)) + 0.1 * generator.normal(size=(frames, 22, 4))
    root = np.cumsum(0.02 * generator.normal(size=(frames, 3)), axis=0) + np.array([0, 0.9, 0])
    return Motion(SMPL22, 20.0, root, turns / np.linalg.norm(turns, axis=-1, keepdims=True))


def looked_at(motion: Motion) -> None:
    """What `info` and every retargeting look at."""
    from motionloom.io.info import describe
    from motionloom.retarget import to_smpl22

    assert np.isfinite(motion.positions()).all()
    seldom = zlib.crc32(motion.root.tobytes()) % 16 == 0  # it takes a hundred times as long as reading
    if seldom and len(motion) * len(motion.skeleton) < 20_000:
        describe(motion)
        assert np.isfinite(to_smpl22(motion).rotations).all()


def text_file(name: str, said: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(said, encoding="utf-8")


def saved(name: str, frames: int = 3) -> Callable[[Path], object]:
    return lambda folder: io.save(motion(frames), folder / name)


def two_texts(folder: Path) -> None:
    (folder / "a.asf").write_text(ASF)
    (folder / "a.amc").write_text(AMC)


def gltf(folder: Path) -> None:
    """The GLB's JSON with its numbers in base64."""
    import base64
    import struct

    data = io.save(motion(), folder / "a.glb").read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    said = json.loads(data[20 : 20 + length])
    body = base64.b64encode(data[28 + length :]).decode()
    said["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{body}"
    (folder / "a.glb").unlink()
    (folder / "a.gltf").write_text(json.dumps(said))


def hero(folder: Path) -> None:
    """A character with a mesh, feet on a control and a clip."""
    Hero(hang={"left_ankle": "pelvis"}).clip("wave", wave(3)).write(folder / "a.glb")


def carried(path: Path) -> None:
    """The character's meshes, and its own file with a motion in it."""
    character = load_character(path)
    for surface in read_surfaces(character):
        assert np.isfinite(surface.points).all()
        assert np.isfinite(surface.weights).all()
        assert surface.triangles.max(initial=0) < len(surface.points)
    turns = np.tile(IDENTITY, (2, len(character.skeleton), 1))
    moving = Motion(character.skeleton, 30.0, np.zeros((2, 3)), turns)
    out = character.save(moving, path.with_name("out.glb"))
    assert read_document(out).items("animations")[-1]["channels"]


def places(folder: Path) -> None:
    np.savez_compressed(folder / "a.npz", positions=motion().positions().astype(np.float32), fps=np.array(20.0))


reader("bvh", text_file("a.bvh", ARM), {"a.bvh": "text"}, lambda f: looked_at(io.load(f / "a.bvh")))
reader("bvh of a person", saved("a.bvh"), {"a.bvh": "text"}, lambda f: looked_at(io.load(f / "a.bvh")), weight=6)
reader("asf and amc", two_texts, {"a.asf": "text", "a.amc": "text"}, lambda f: looked_at(io.load(f / "a.amc")))
reader("glb", saved("a.glb"), {"a.glb": "glb"}, lambda f: looked_at(io.load(f / "a.glb")), weight=6)
reader("gltf", gltf, {"a.gltf": "json"}, lambda f: [looked_at(m) for m in load_glb_people(f / "a.gltf")], weight=6)
reader("character", hero, {"a.glb": "glb"}, lambda f: carried(f / "a.glb"), weight=10)
reader("npz", saved("a.npz"), {"a.npz": "npz"}, lambda f: looked_at(io.load(f / "a.npz")), weight=6)
reader("npz of places", places, {"a.npz": "npz"}, lambda f: looked_at(io.load(f / "a.npz")), weight=3)


# Rigs of other people, where they lie beside the repository -----------------------------------------------------------

KINDS = {".bvh": "text", ".glb": "glb", ".vrm": "glb", ".vrma": "glb"}


@cache
def is_character(rig: Path) -> bool:
    """Whether the sound file has meshes to be carried; else it is a motion."""
    try:
        load_character(rig)
    except MotionloomError:
        return False
    return True


def read_rig(rig: Path) -> Callable[[Path], None]:
    character = rig.suffix != ".bvh" and is_character(rig)

    def read(folder: Path) -> None:
        place = folder / rig.name
        try:
            carried(place) if character else looked_at(io.load(place))
        except MotionloomError:
            if place.read_bytes() != rig.read_bytes():  # some are no persons, and are refused as they are
                raise

    return read


def copied(rig: Path) -> Callable[[Path], object]:
    return lambda folder: (folder / rig.name).write_bytes(rig.read_bytes())


for rig in sorted((SHARED / "rigs").glob("*")):
    if rig.suffix in KINDS and rig.stat().st_size < LARGEST:
        reader(f"rig {rig.name[:18]}", copied(rig), {rig.name: KINDS[rig.suffix]}, read_rig(rig), weight=1)


# What is asked -------------------------------------------------------------------------------------------------------

TIMELINE = """# a walk
seed: 3
guidance: 2.5
path: {path: {points: [[0, 0], [1, 2], [3, 4.5]], times: [0, 2, 9]}}
segments:
- {text: a person walks, seconds: 5, guidance: 3}
- text: "a person jumps"
  seconds: 2.5
  transition: 0.75
- sit
"""
GOAL = {
    "start": {"position": [0, 0], "facing": 30},
    "path": {"points": [[0, 0], [0.5, 1], [0, 2.2]], "times": [0, 1, 2], "facing": "along", "smooth": True},
    "joints": [
        {
            "joint": "left_wrist",
            "frame": "root",
            "curve": True,
            "points": [{"time": 0.5, "position": [0.4, 1.2, 0.1]}, {"time": 1, "position": [0.3, 1.3, 0.2]}],
        },
        {"joint": "head", "every_frame": [[None, 1.5, None], None, [0, 1.5, 0.1]]},
    ],
}
OTHERS = {
    "poses": [{"time": 2, "from": "pose.npz", "at": 0.05, "position": [0, 2.2], "facing": 0}],
    "follow": [{"from": "pose.npz", "joints": ["right_wrist"], "times": [0, 0.1]}],
}
DRAWN = {"path": {"svg": "a.svg", "scale": 0.005, "times": [0, 2], "facing": [0, 90]}}
SVG = """<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">
<g transform="translate(3, 4) rotate(20 5 5)"><path transform="scale(2 3) skewX(10)"
d="M10,10 L20 20 C 30 20 40 40 50,30 s 5 5 9 1 Q 1 2 3 4 t 9 9
A 5 6 30 0 1 60 60 h 5 v 5 z" style="fill:none"/></g></svg>"""
POINTS = """<svg xmlns="http://www.w3.org/2000/svg">
<polyline points="0,0 10,20 30,15.5 40 2" transform="matrix(1 0 0 1 2 3)"/></svg>"""
SCRIPT = """seconds: 12
seed: 3
commands:
- {at: 0, say: a person walks forward}
- {at: 4.5, steer: {direction: 90, speed: 1.4, facing: -10}}
- {at: 8, path: {points: [[2, 3], [4, 0]], speed: 1}}
- {at: 9, reach: {joint: left_wrist, position: [0, 1, 2], within: 0.5}}
"""
MASK = """hold:
- joints: [left_wrist, right_wrist]
  from: 0.5
  to: 1.25
- joints: [left_leg]
  frames: [[0, 10], [20, 30]]
"""


def goal(folder: Path) -> None:
    (folder / "a.json").write_text(json.dumps(GOAL))


def goal_of_others(folder: Path) -> None:
    io.save(motion(), folder / "pose.npz")
    (folder / "a.json").write_text(json.dumps(OTHERS))


def drawn_goal(folder: Path) -> None:
    (folder / "a.json").write_text(json.dumps(DRAWN))
    (folder / "a.svg").write_text(SVG)


def read_goal(folder: Path) -> object:
    from motionloom.goals.goal_file import read_goal

    return read_goal(folder / "a.json", frames=41, folder=folder)


def read_timeline(folder: Path) -> object:
    from motionloom.goals.timeline import read_timeline

    return read_timeline(folder / "a.yaml")


def read_script(folder: Path) -> object:
    from motionloom.live.script import read_script

    return read_script(folder / "a.yaml")


def read_mask(folder: Path) -> object:
    from motionloom.goals.mask_file import read_mask

    return read_mask(folder / "a.yaml", fps=30.0)


def read_drawing(folder: Path) -> object:
    from motionloom.goals.drawing import read_drawing

    return read_drawing(folder / "a.svg")


def read_prompts(folder: Path) -> object:
    from motionloom.cli.generate import _lines

    return _lines(folder / "a.txt")


def joint_map(folder: Path) -> None:
    (folder / "a.json").write_text(json.dumps({"left_knee": "left_knee", "head": {"neck": 0.5, "head": 0.5}}))


def read_joint_map(folder: Path) -> object:
    from motionloom.retarget.anatomy import read_body

    return read_body(SMPL22, folder / "a.json")


reader("timeline", text_file("a.yaml", TIMELINE), {"a.yaml": "text"}, read_timeline)
reader("live script", text_file("a.yaml", SCRIPT), {"a.yaml": "text"}, read_script)
reader("goal", goal, {"a.json": "json"}, read_goal)
reader("goal of others", goal_of_others, {"a.json": "json", "pose.npz": "npz"}, read_goal, weight=1)
reader("goal with a drawing", drawn_goal, {"a.json": "json", "a.svg": "svg"}, read_goal)
reader("drawing", text_file("a.svg", SVG), {"a.svg": "svg"}, read_drawing)
reader("polyline", text_file("a.svg", POINTS), {"a.svg": "svg"}, read_drawing)
reader("mask", text_file("a.yaml", MASK), {"a.yaml": "text"}, read_mask)
reader("prompts", text_file("a.txt", "a person walks\nsomeone jumps\n"), {"a.txt": "text"}, read_prompts)
reader("joint map", joint_map, {"a.json": "json"}, read_joint_map, weight=3)


# What the page sends -------------------------------------------------------------------------------------------------


def played(folder: Path) -> None:
    """A motion as the server gives it to the page, and takes it back."""
    import base64

    def encoded(values: np.ndarray) -> str:
        return base64.b64encode(values.astype("<f4").tobytes()).decode()

    one = {"root": encoded(motion().root), "rotations": encoded(motion().rotations)}
    (folder / "a.json").write_text(json.dumps({"fps": 20, "people": [one]}))


def read_played(folder: Path) -> object:
    from motionloom.server.files import from_json

    people = from_json(folder / "a.json", "a.json")
    for person in people:
        looked_at(person)
    return people


reader("motion of a page", played, {"a.json": "json"}, read_played, weight=3)
