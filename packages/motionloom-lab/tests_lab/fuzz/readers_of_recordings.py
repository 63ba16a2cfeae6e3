"""Readers of recordings, captions and data sets, and of recipes and stopped runs."""

import csv
import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from tests.fuzz.reader import reader, say
from tests.fuzz.readers_of_motions import looked_at, motion, text_file, two_texts

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
variant = "modulated"
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
    from motionloom_train.pair import Settings as Pair
    from motionloom_train.predictor import Settings
    from motionloom_train.recipe import changes, load_recipe

    recipe = load_recipe(folder / "a.toml", changes(["steps=30", "net.width=32", "name=other"]))
    return Settings.parse(recipe.predictor), Pair.parse(recipe.pair)


def read_changes(folder: Path) -> object:
    from motionloom_train.recipe import changes

    return changes(
        [line for line in (folder / "a.txt").read_bytes().decode("utf-8", "replace").split("\n") if "=" in line]
    )


def _run() -> tuple[Any, Any, Any, Any]:
    from motionloom_train.loop import Average, make_optimizer
    from tests_train.runs import recipe

    plan = recipe()
    net = torch.nn.Sequential(torch.nn.Linear(3, 2), torch.nn.Linear(2, 1))
    return net, Average(net, 0.9), make_optimizer(net, plan), plan


def state(folder: Path) -> None:
    from motionloom_train.loop import save_state

    net, average, optimizer, plan = _run()
    net(torch.ones(3)).sum().backward()
    optimizer.step()
    save_state(folder, net, average, optimizer, step=7, recipe=plan)


def read_state(folder: Path) -> None:
    """A damaged state is never taken for a good one: a run would go on with it, and nobody would know."""
    from motionloom_train.loop import STATE, changed, load_state

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
    row = {
        "amass_path": path,
        "mirrored": False,
        "start_s": 0.0,
        "end_s": 2.5,
        "split": "train",
        "captions": [{"text": "a man walks", "from_s": 0.0, "to_s": 0.0}],
    }
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
    from motionloom_lab.papers.readers import find_takes
    from motionloom_train.data.build import _clip

    features = np.zeros((40, 263), np.float32)
    features[:, 3] = 0.9
    for take in find_takes(folder):
        _clip(take, features, "plain")  # what `data build` makes of the spans


def read_pairs(folder: Path) -> None:
    from motionloom_lab.papers.readers import find_pairs

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
        from motionloom_lab.papers.readers import find_takes
        from motionloom_train.data.build import _clip

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
    from motionloom_lab.papers.readers import find_takes
    from motionloom_lab.suites.items import read_items
    from motionloom_lab.suites.protocol import Selection
    from motionloom_train.data.build import clips_of

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
    from tests_lab.papers.test_babel import folder as make
    from tests_lab.papers.test_babel import label

    make(folder, [label("walk", 0, 0.4), label("transition", 0.4, 0.5), label("sit", 0.5, 1.0)], frames=60, fps=60.0)


def read_babel(folder: Path) -> None:
    from motionloom_lab.papers import babel

    items = babel.load_items(folder, shortest=5)
    if items:
        babel.statistics(items)
    read_takes(folder)


def read_amass(folder: Path) -> None:
    from motionloom_lab.papers.babel import read_amass

    looked_at(read_amass(folder / "amass" / "CMU" / "CMU" / "01" / "01_01_poses.npz"))


def amass_places(folder: Path) -> None:
    from tests_lab.papers.benchmark_files import z_up

    (folder / "CMU" / "01").mkdir(parents=True)
    (folder / "DanceDB" / "01").mkdir(parents=True)
    np.save(folder / "CMU" / "01" / "a_poses.npy", z_up(160))
    np.savez(folder / "DanceDB" / "01" / "b_poses.npz", positions=z_up(320), fps=np.array(60.0))
    (folder / "list.csv").write_text("dataset,file,file_idx,pred_init,pred_end\nDanceDB,01/b_poses,0,180,299\n")
    (folder / "list.json").write_text(json.dumps([["DanceDB/01/b_poses", 150]]))


def read_amass_places(listed: str | None) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        from motionloom_lab.papers.amass import read_amass

        read_amass(folder, segments=folder / listed if listed else None, say=say).windows()

    return read


def h36m(folder: Path) -> None:
    from tests_lab.papers.benchmark_files import person, write

    write(folder / "data_3d_h36m.npz", {"S1": {"Walking 1": person(130)}, "S9": {"Photo": person(130)}})


def humaneva(folder: Path) -> None:
    from tests_lab.papers.benchmark_files import person, write

    write(
        folder / "data_3d_humaneva15.npz",
        {"Train/S1": {"Jog 1 chunk0": person(80, 15)}, "Validate/S1": {"Jog": person(80, 15)}},
    )


def read_benchmark(folder: Path) -> None:
    from motionloom_lab.papers.benchmarks import find_protocol

    find_protocol(folder, say=say).windows()


def threedpw(folder: Path) -> None:
    from tests_lab.data.test_pairs import at_30, write_sequence

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
    from tests_train.runs import write_set

    write_set(folder / "set")
    for path in (folder / "set" / "clips").iterdir():
        path.rename(folder / "set" / "clips" / f"{path.stem[0]}.safetensors")


def read_built(folder: Path) -> None:
    from motionloom_train.data.batches import Batches
    from motionloom_train.data.sets import load_set, summary

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
