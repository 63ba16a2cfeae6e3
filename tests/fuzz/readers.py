"""Every reader of files from outside: how to make a small good file, and who reads it."""

import csv
import gzip
import json
import pickle
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch

from motionloom import io
from motionloom.errors import MotionloomError
from motionloom.io.character import load_character
from motionloom.io.glb import read_document
from motionloom.io.gltf_read import load_glb_people
from motionloom.motion import Motion
from motionloom.rotations import IDENTITY
from motionloom.skeleton import SMPL22
from tests.io.rigged import Hero, wave
from tests.io.test_asf import AMC, ASF
from tests.io.test_bvh import ARM


@dataclass(frozen=True)
class Reader:
    """Somebody who reads files."""

    name: str
    make: Callable[[Path], object]
    """Write good files into a folder."""
    kinds: dict[str, str]
    """The files that are damaged, by path in the folder, and what they are made of (`mutations.KINDS`)."""
    read: Callable[[Path], object]
    """Read the folder, all of it that is ever read, so that what is lazy is read too."""
    weight: int = 20
    """How often it is its turn."""


READERS: list[Reader] = []


def reader(
    name: str, make: Callable[[Path], object], kinds: dict[str, str], read: Callable[[Path], Any], *, weight: int = 20
) -> None:
    READERS.append(Reader(name, make, kinds, read, weight))


def say(line: str) -> None:
    """What is told of recordings that are left out must be one line too."""
    assert "\n" not in line, line


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
    for surface in character.surfaces():
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
    "joints": [{"joint": "left_wrist", "frame": "root", "curve": True,
                "points": [{"time": 0.5, "position": [0.4, 1.2, 0.1]}, {"time": 1, "position": [0.3, 1.3, 0.2]}]},
               {"joint": "head", "every_frame": [[None, 1.5, None], None, [0, 1.5, 0.1]]}],
}  # fmt: skip
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


# Recipes and runs ----------------------------------------------------------------------------------------------------

RECIPE = """name = "small"
licence = "free"  # as the data
steps = 2000
batch = 16
windows = [48, 80]
shares = [0.5, 0.5]
rate = 8e-4
favour.walk = 2.5
favour."kick ball" = 1
amp = "bf16"
prompts = ["a person walks.", "someone waves"]
schedule = "cosine"
[net]
manner = "modulated"
width = 64
layers = 2
heads = 2
hidden = 64
patch = 4
[predictor]
kept = 12
[pair]
layers = 1
prefix = 0.4
"""


def read_recipe(folder: Path) -> object:
    from motionloom.train.pair import Settings as Pair
    from motionloom.train.predictor import Settings
    from motionloom.train.recipe import changes, load_recipe

    recipe = load_recipe(folder / "a.toml", changes(["steps=30", "net.width=32", "name=other"]))
    return Settings.parse(recipe.predictor), Pair.parse(recipe.pair)


def read_changes(folder: Path) -> object:
    from motionloom.train.recipe import changes

    return changes(
        [line for line in (folder / "a.txt").read_bytes().decode("utf-8", "replace").split("\n") if "=" in line]
    )


def _run() -> tuple[Any, Any, Any, Any]:
    from motionloom.train.loop import Average, make_optimizer
    from tests.train.runs import recipe

    plan = recipe()
    net = torch.nn.Sequential(torch.nn.Linear(3, 2), torch.nn.Linear(2, 1))
    return net, Average(net, 0.9), make_optimizer(net, plan), plan


def state(folder: Path) -> None:
    from motionloom.train.loop import save_state

    net, average, optimizer, plan = _run()
    net(torch.ones(3)).sum().backward()
    optimizer.step()
    save_state(folder, net, average, optimizer, step=7, recipe=plan)


def read_state(folder: Path) -> None:
    """A damaged state is never taken for a good one: a run would go on with it, and nobody would know."""
    from motionloom.train.loop import STATE, changed, load_state

    net, average, optimizer, plan = _run()
    changed(folder, plan)
    load_state(folder / STATE, net, average, optimizer)


reader("recipe", text_file("a.toml", RECIPE), {"a.toml": "text"}, read_recipe)
reader(
    "recipe changes",
    text_file("a.txt", "steps=30\nnet.width=64\nname=walks\nfavour.walk=2\n"),
    {"a.txt": "text"},
    read_changes,
)
reader("training state", state, {"state.safetensors": "safetensors"}, read_state, weight=6)


# Recordings and captions ---------------------------------------------------------------------------------------------


def captions(number: str) -> str:
    path = f"./pose_data/CMU/{number[:2]}/{number}_poses.npy"
    row = {"amass_path": path, "mirrored": False, "start_s": 0.0, "end_s": 2.5,
           "split": "train", "captions": [{"text": "a man walks", "from_s": 0.0, "to_s": 0.0}]}  # fmt: skip
    return json.dumps(row) + "\n" + json.dumps(row | {"end_s": None, "split": "test"}) + "\n"


def pack(folder: Path) -> None:
    columns = ["clip", "path", "source", "split", "description", "seconds", "fps", "metres_per_unit", "partner"]
    with open(folder / "manifest.csv", "w", newline="") as lines:
        rows = csv.writer(lines)
        rows.writerow(columns)
        for name, other in (("02_01", "02_02"), ("02_02", "02_01")):
            rows.writerow([name, f"{name}.bvh", "cmu", "train", "walk, salsa", "2.0", "20", "1", f"{other}.bvh"])
    (folder / "captions").mkdir()
    spoken = {"clip": "02_01", "start_s": 0.0, "end_s": 2.0, "captions": ["a person walks", "he goes"]}
    (folder / "captions" / "cmu.jsonl").write_text(json.dumps(spoken) + "\n")
    io.save(motion(44), folder / "02_01.bvh")
    io.save(motion(44), folder / "02_02.bvh")


def read_takes(folder: Path) -> None:
    from motionloom.data.build import _clip
    from motionloom.lab.papers.readers import find_takes

    features = np.zeros((40, 263), np.float32)
    features[:, 3] = 0.9
    for take in find_takes(folder):
        _clip(take, features, "plain")  # what `data build` makes of the spans


def read_pairs(folder: Path) -> None:
    from motionloom.lab.papers.readers import find_pairs

    find_pairs(folder, say=say)


def download(folder: Path) -> None:
    two_texts(folder)
    (folder / "a.asf").rename(folder / "02.asf")
    (folder / "a.amc").rename(folder / "02_01.amc")
    (folder / "cmu-index.txt").write_text("Subject #2\n02_01   walk\n02_02\tjump, run\n")
    (folder / "c.jsonl").write_text(captions("02_01"))
    (folder / "c.jsonl.gz").write_bytes(gzip.compress(captions("02_01").encode(), mtime=0))


def read_download(name: str) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        from motionloom.data.build import _clip
        from motionloom.lab.papers.readers import find_takes

        for take in find_takes(folder, captions=folder / name):
            _clip(take, np.zeros((40, 263), np.float32), "plain")

    return read


def humanml3d(folder: Path) -> None:
    (folder / "new_joint_vecs").mkdir()
    (folder / "texts").mkdir()
    np.save(
        folder / "new_joint_vecs" / "000001.npy", np.random.default_rng(0).normal(size=(44, 263)).astype(np.float32)
    )
    (folder / "texts" / "000001.txt").write_text(
        "a man walks.#a/DET man/NOUN walk/VERB#0.0#0.0\nhe steps#he/PRON step/VERB#0.0#2.1\n"
    )
    for split in ("train", "val", "test"):
        (folder / f"{split}.txt").write_text("000001\n" if split == "test" else "")


def read_humanml3d(folder: Path) -> None:
    from motionloom.data.build import clips_of
    from motionloom.lab.papers.readers import find_takes
    from motionloom.lab.suites.items import read_items
    from motionloom.lab.suites.protocol import Selection

    problems = []
    try:
        for take in find_takes(folder):
            list(clips_of(take))
    except MotionloomError as error:
        problems.append(error)
    read_items(folder, Selection(splits=("test",), sources=("humanml3d",)))
    if problems:
        raise problems[0]


def babel_folder(folder: Path) -> None:
    from tests.lab.papers.test_babel import folder as make
    from tests.lab.papers.test_babel import label

    make(folder, [label("walk", 0, 0.4), label("transition", 0.4, 0.5), label("sit", 0.5, 1.0)], frames=60, fps=60.0)


def read_babel(folder: Path) -> None:
    from motionloom.lab.papers import babel

    items = babel.load_items(folder, shortest=5)
    if items:
        babel.statistics(items)
    read_takes(folder)


def read_amass(folder: Path) -> None:
    from motionloom.lab.papers.babel import read_amass

    looked_at(read_amass(folder / "amass" / "CMU" / "CMU" / "01" / "01_01_poses.npz"))


def amass_places(folder: Path) -> None:
    from tests.lab.papers.benchmark_files import z_up

    (folder / "CMU" / "01").mkdir(parents=True)
    (folder / "DanceDB" / "01").mkdir(parents=True)
    np.save(folder / "CMU" / "01" / "a_poses.npy", z_up(160))
    np.savez(folder / "DanceDB" / "01" / "b_poses.npz", positions=z_up(320), fps=np.array(60.0))
    (folder / "list.csv").write_text("dataset,file,file_idx,pred_init,pred_end\nDanceDB,01/b_poses,0,180,299\n")
    (folder / "list.json").write_text(json.dumps([["DanceDB/01/b_poses", 150]]))


def read_amass_places(listed: str | None) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        from motionloom.lab.papers.amass import read_amass

        read_amass(folder, segments=folder / listed if listed else None, say=say).windows()

    return read


def h36m(folder: Path) -> None:
    from tests.lab.papers.benchmark_files import person, write

    write(folder / "data_3d_h36m.npz", {"S1": {"Walking 1": person(130)}, "S9": {"Photo": person(130)}})


def humaneva(folder: Path) -> None:
    from tests.lab.papers.benchmark_files import person, write

    write(
        folder / "data_3d_humaneva15.npz",
        {"Train/S1": {"Jog 1 chunk0": person(80, 15)}, "Validate/S1": {"Jog": person(80, 15)}},
    )


def read_benchmark(folder: Path) -> None:
    from motionloom.lab.papers.benchmarks import find_protocol

    find_protocol(folder, say=say).windows()


def threedpw(folder: Path) -> None:
    from tests.data.test_pairs import at_30, write_sequence

    (folder / "sequenceFiles" / "train").mkdir(parents=True)
    (folder / "text" / "train").mkdir(parents=True)
    write_sequence(folder / "sequenceFiles" / "train" / "x.pkl", at_30(1.2), np.zeros((len(at_30(1.2)[0]), 3)))
    (folder / "text" / "train" / "x.txt").write_text("two people dance # well\nthey dance\n")


def own_pairs(folder: Path) -> None:
    first, second = motion(25), motion(26).frames(0, 25)
    io.save(first, folder / "dance_a.bvh")
    io.save(
        Motion(SMPL22, 20.0, second.root[::-1] + np.array([1.0, 0, 0]), second.rotations[::-1]), folder / "dance_b.bvh"
    )
    (folder / "captions.txt").write_text("dance: two people dance\ndance:\tthey turn\n".replace(":\t", "\t"))


def built(folder: Path) -> None:
    from tests.train.runs import write_set

    write_set(folder / "set")
    for path in (folder / "set" / "clips").iterdir():
        path.rename(folder / "set" / "clips" / f"{path.stem[0]}.safetensors")


def read_built(folder: Path) -> None:
    from motionloom.data.sets import Batches, load_set, summary

    summary(folder / "set")
    data = load_set(folder / "set")
    Batches(data, windows=(20,), shares=(1.0,)).draw(0, 0, 4)


reader("pack", pack, {"manifest.csv": "text", "captions/cmu.jsonl": "jsonl"}, read_takes, weight=6)
reader("pairs of the pack", pack, {"manifest.csv": "text"}, lambda f: _refused(read_pairs, f), weight=1)
reader("captions", download, {"c.jsonl": "jsonl", "cmu-index.txt": "text"}, read_download("c.jsonl"), weight=6)
reader("packed captions", download, {"c.jsonl.gz": "jsonl.gz"}, read_download("c.jsonl.gz"), weight=6)
reader(
    "humanml3d",
    humanml3d,
    {"test.txt": "text", "texts/000001.txt": "text", "new_joint_vecs/000001.npy": "npy"},
    read_humanml3d,
    weight=6,
)
reader("babel", babel_folder, {"train.json": "json"}, read_babel, weight=2)
reader("amass", babel_folder, {"amass/CMU/CMU/01/01_01_poses.npz": "npz"}, read_amass, weight=6)
reader(
    "amass places",
    amass_places,
    {"CMU/01/a_poses.npy": "npy", "DanceDB/01/b_poses.npz": "npz"},
    read_amass_places(None),
)
reader("amass list", amass_places, {"list.csv": "text"}, read_amass_places("list.csv"))
reader("amass list in json", amass_places, {"list.json": "json"}, read_amass_places("list.json"))
reader("human3.6m", h36m, {"data_3d_h36m.npz": "pickled npz"}, read_benchmark)
reader("humaneva", humaneva, {"data_3d_humaneva15.npz": "pickled npz"}, read_benchmark)
reader("3dpw", threedpw, {"sequenceFiles/train/x.pkl": "pickle", "text/train/x.txt": "text"}, read_pairs, weight=1)
reader("own pairs", own_pairs, {"captions.txt": "text", "dance_a.bvh": "text"}, read_pairs, weight=1)
reader("built set", built, {"set/clips/s.safetensors": "safetensors", "set/set.json": "json"}, read_built, weight=6)


def _refused(read: Callable[[Path], None], folder: Path) -> None:
    """The good files are refused too (both are the same motion); their manifest is read before that."""
    try:
        read(folder)
    except MotionloomError as error:
        if "same motion" not in str(error):
            raise


# Weights -------------------------------------------------------------------------------------------------------------


@cache
def tiny_prior() -> Any:
    from tests.nets import tiny

    return tiny.prior()


def prior(folder: Path) -> None:
    from motionloom.weights.prior import save_prior

    save_prior(tiny_prior(), folder / "a.safetensors")


def read_prior(folder: Path) -> object:
    from motionloom.weights.prior import Prior

    made = Prior.load(folder / "a.safetensors")
    return made.text.encode(["a person walks"])


def adapter(folder: Path) -> None:
    from tests.weights.test_adapter import adapter_of, trained

    net = tiny_prior().net
    adapter_of(trained(net), net).save(folder / "a.safetensors")


def read_adapter(folder: Path) -> object:
    from motionloom.weights.adapter import Adapter

    return Adapter.load(folder / "a.safetensors", tiny_prior())


def block(folder: Path) -> None:
    from tests.nets.test_pair import block_of

    made, _ = block_of("modulated")
    made.save(folder / "a.safetensors")


@cache
def block_prior() -> Any:
    from tests.nets.test_pair import block_of

    return block_of("modulated")[1]


def read_block(folder: Path) -> object:
    from motionloom.weights.pair import PairBlock

    return PairBlock.load(folder / "a.safetensors", block_prior())


def predictor(folder: Path) -> None:
    from motionloom.weights.predictor import save_predictor
    from tests.nets import tiny_predictor

    save_predictor(tiny_predictor.predictor(), folder / "a.safetensors")


def read_predictor(folder: Path) -> object:
    from motionloom.weights.predictor import load_predictor

    return load_predictor(folder / "a.safetensors")


@cache
def tiny_embedder() -> Any:
    from tests.lab.evaluator.test_net import embedder

    return embedder()


def evaluator(folder: Path) -> None:
    from motionloom.lab.evaluator.net import save_embedder

    save_embedder(tiny_embedder(), folder / "a.safetensors")


def read_evaluator(folder: Path) -> object:
    from motionloom.lab.evaluator.net import load_embedder

    return load_embedder(folder / "a.safetensors", tiny_embedder().text)


def mrt(folder: Path) -> None:
    from motionloom.lab.papers.mrt import MrtFile
    from tests.lab.papers.test_mrt import net_of

    MrtFile(net_of(), "free", "none", {"a": 1}).save(folder / "a.safetensors")


def read_mrt(folder: Path) -> object:
    from motionloom.lab.papers.mrt import MrtFile

    return MrtFile.load(folder / "a.safetensors")


def published(folder: Path) -> None:
    from tests.lab.papers.test_mdm import state as weights

    options = {"noise_schedule": "cosine", "diffusion_steps": 50, "arch": "trans_enc", "layers": 2, "latent_dim": 32}
    torch.save({"model": weights(), "iteration": 3}, folder / "model.pt")
    torch.save(weights(), folder / "old.pt", _use_new_zipfile_serialization=False)
    (folder / "args.json").write_text(json.dumps(options))


def read_checkpoint(name: str) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        from motionloom.lab.papers.published_priors import import_published

        return import_published(folder / name, mean=np.zeros(263), std=np.ones(263))

    return read


def humanmac(folder: Path) -> None:
    from motionloom.nets.predictor import NetConfig, TransLinear

    net = TransLinear(NetConfig(channels=48, kept=20, layers=2, width=16, heads=2))
    torch.save(net.state_dict(), folder / "a.pt")


def read_humanmac(folder: Path) -> object:
    from motionloom.lab.papers.humanmac_checkpoint import import_humanmac

    return import_humanmac(folder / "a.pt")


def guo(folder: Path) -> None:
    from tests.lab.papers.test_guo_nets import checkpoint

    torch.save(checkpoint(), folder / "finest.tar")


def read_guo(folder: Path) -> object:
    from motionloom.lab.papers.guo_nets import from_state_dict, read_guo

    return from_state_dict(read_guo(folder / "finest.tar"))


def hub(folder: Path) -> None:
    torch.save({"a.weight": torch.arange(6.0), "b": torch.ones(2, 2).half()}, folder / "pytorch_model.bin")


def read_hub(folder: Path) -> object:
    from motionloom.lab.papers.text_model import convert

    return convert(folder)


def words(folder: Path) -> None:
    from tests.lab.papers.test_guo_words import published as make

    make(folder)
    (folder / "glove.txt").write_text("walk 0.1 0.2 0.3\nunk 0 0 1\nsos 1 0 0\neos 0 1 0\n")
    (folder / "special.json").write_text(json.dumps({"Loc_VIP": ["left"], "Act_VIP": ["wave", "run"]}))


def read_words(folder: Path) -> object:
    from motionloom.lab.papers.guo_words import read_words

    return read_words(folder, lists=folder / "word_vectorizer.py"), read_words(folder, lists=folder / "special.json")


def read_glove(folder: Path) -> object:
    from motionloom.lab.papers.guo_words import read_words

    return read_words(folder / "glove.txt")


reader("prior", prior, {"a.safetensors": "safetensors"}, read_prior, weight=3)
reader("adapter", adapter, {"a.safetensors": "safetensors"}, read_adapter, weight=6)
reader("block of two people", block, {"a.safetensors": "safetensors"}, read_block, weight=6)
reader("predictor", predictor, {"a.safetensors": "safetensors"}, read_predictor, weight=3)
reader("evaluator", evaluator, {"a.safetensors": "safetensors"}, read_evaluator, weight=3)
reader("multi-range transformer", mrt, {"a.safetensors": "safetensors"}, read_mrt, weight=3)
reader(
    "published checkpoint", published, {"model.pt": "torch", "args.json": "json"}, read_checkpoint("model.pt"), weight=6
)
reader("old checkpoint", published, {"old.pt": "old torch"}, read_checkpoint("old.pt"), weight=6)
reader("humanmac", humanmac, {"a.pt": "torch"}, read_humanmac, weight=3)
reader("guo's evaluators", guo, {"finest.tar": "torch"}, read_guo, weight=3)
reader("text model", hub, {"pytorch_model.bin": "torch"}, read_hub, weight=6)
reader("guo's words", words, {"our_vab_data.npy": "npy", "our_vab_words.pkl": "pickle", "our_vab_idx.pkl": "pickle",
                              "word_vectorizer.py": "text", "special.json": "json"}, read_words)  # fmt: skip
reader("glove", words, {"glove.txt": "text"}, read_glove)


# Measurements --------------------------------------------------------------------------------------------------------


def reports(folder: Path) -> None:
    from motionloom.lab.report.report import encode
    from tests.lab.report.test_report import report

    (folder / "report.json").write_text(json.dumps(encode(report())))


def read_reports(folder: Path) -> object:
    from motionloom.lab.report.compare import compare, load
    from motionloom.lab.report.report import markdown

    (one,) = load(folder).values()
    markdown(one)
    return compare(one, one)


def part(folder: Path) -> None:
    from motionloom.lab.suites.parts import Parts

    (folder / "parts").mkdir()
    Parts(folder, "settings").keep("one", {"a": 1.5, "b": 0.0})


def read_part(folder: Path) -> object:
    from motionloom.lab.suites.parts import Parts

    return Parts(folder, "settings").find("one")


def seams(folder: Path) -> None:
    from motionloom.lab.suites.real_seams import shipped_file

    (folder / "a.json").write_text(shipped_file().read_text())


def read_seams(folder: Path) -> object:
    from motionloom.lab.suites.real_seams import load_shipped

    return load_shipped(folder / "a.json")


def attempts(folder: Path) -> None:
    attempt = {"prompt": "walk", "seed": 1, "obeyed": True, "measured": {"speed": 1.2}}
    (folder / "a.json").write_text(
        json.dumps({"settings": {"a": 1}, "checks": [{"name": "walk", "attempts": [attempt]}]})
    )


def read_attempts(folder: Path) -> object:
    from motionloom.lab.suites.obey import _read

    return _read(folder / "a.json", {"a": 1})


def reference(folder: Path) -> None:
    from motionloom.lab.suites import text_reference
    from motionloom.lab.suites.protocol import Selection
    from tests.lab.suites.judged import Judge, item

    made = text_reference.measure([item(k, 40 + k) for k in range(5)], Judge(), Selection())
    text_reference.save(made, folder / "a.safetensors")


def read_reference(folder: Path) -> object:
    from motionloom.lab.suites import text_reference
    from tests.lab.suites.judged import Judge

    return text_reference.load(folder / "a.safetensors", Judge())


def guo_kept(folder: Path) -> None:
    from motionloom.lab.papers.guo import read_published, save_guo
    from tests.lab.papers.test_guo import files

    save_guo(read_published(files(folder), card={"licence": "research only"}), folder / "guo.safetensors")


def read_guo_kept(folder: Path) -> object:
    from motionloom.lab.papers.guo import is_guo, load_guo

    is_guo(folder / "guo.safetensors")
    return load_guo(folder / "guo.safetensors")


def plain(folder: Path) -> None:
    value = {"a": [np.arange(6.0).reshape(2, 3), "x", 3, None, (1, 2.5)], "b": {"c": np.array(["u", "v"]), "d": b"raw"}}
    (folder / "a.pkl").write_bytes(pickle.dumps(value, 2))


def read_plain(folder: Path) -> object:
    from motionloom.lab.papers.plain_pickle import read_plain_file

    return read_plain_file(folder / "a.pkl", limit=1 << 29)


def arrays(folder: Path) -> None:
    with zipfile.ZipFile(folder / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in (
            ("a", np.arange(12.0).reshape(3, 4)),
            ("b", np.array(["x", "yz"])),
            ("c", np.zeros((0, 3))),
        ):
            with archive.open(f"{name}.npy", "w") as member:
                np.save(member, array)


def read_arrays(folder: Path) -> object:
    from motionloom.io.npz import read_arrays

    return read_arrays(folder / "a.npz")


reader("report", reports, {"report.json": "json"}, read_reports)
reader("part of a measurement", part, {"parts/one.json": "json"}, read_part)
reader("real seams", seams, {"a.json": "json"}, read_seams)
reader("attempts", attempts, {"a.json": "json"}, read_attempts)
reader("text reference", reference, {"a.safetensors": "safetensors"}, read_reference)
reader("guo's evaluators kept", guo_kept, {"guo.safetensors": "safetensors"}, read_guo_kept, weight=6)
reader("plain pickle", plain, {"a.pkl": "pickle"}, read_plain)
reader("arrays", arrays, {"a.npz": "npz"}, read_arrays)
