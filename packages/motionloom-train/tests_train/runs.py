"""A training run small enough for tests, also started as a program: ``python -m tests_train.runs SET OUT [STEPS]``.

It prints ``step loss`` lines with the loss written out in full, so that runs can be compared exactly.
"""

import sys
from pathlib import Path

import torch

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.features import humanml as hml
from motionloom_train.data.batches import Batches
from motionloom_train.data.clips import Clip, Note, write_clip
from motionloom_train.data.sets import load_set
from motionloom_train.loop import World, train
from motionloom_train.nets.prior import NetConfig, PriorNet
from motionloom_train.objectives import CleanError, Conditioned, WordBank
from motionloom_train.recipe import Recipe
from tests.kinematics import people
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH

NET = {
    "variant": "modulated",
    "width": 32,
    "layers": 1,
    "heads": 2,
    "hidden": 32,
    "text": WIDTH,
    "patch": 4,
    "dropout": 0.1,
}


def recipe(**changes) -> Recipe:
    values = {
        "name": "small",
        "steps": 60,
        "batch": 4,
        "windows": [20, 32],
        "shares": [0.5, 0.5],
        "save_every": 7,
        "warmup": 5,
        "rate": 3e-3,
        "levels": 50,
        "net": NET,
        "seed": 3,
        "amp": "float32",
    }
    return Recipe(**(values | changes))


def write_set(folder: Path) -> Path:
    """A built set of two described clips, written without `build`."""
    (folder / "clips").mkdir(parents=True)
    for name, speed, kind in (("slow", 0.7, "walk slow"), ("fast", 1.6, "walk fast")):
        features = hml.encode(hml.canonical(people.walking(speed, 3.0)), heading="corrected")
        notes = (Note(0, len(features), kind), Note(0, 40, "human", (f"a person walks {name}",)))
        write_clip(folder / "clips", Clip(name, "cmu", "free", "train", "plain", notes, features))
    (folder / "set.json").write_text("{}")
    return folder


def losses(data: Path, out: Path, plan: Recipe, *, say=print) -> list[float]:
    """Train (or go on) and give the losses of the steps taken here."""
    world = World.join("cpu")
    torch.manual_seed(plan.seed)
    net = PriorNet(NetConfig.parse(plan.net))
    motions = load_set(data, seed=plan.seed)
    batches = Batches(motions, windows=plan.windows, shares=plan.shares)
    words = WordBank(tiny.text(), motions.texts, progress=lambda line: None)
    objective = CleanError(net, SCHEDULES[plan.schedule](plan.levels), batches, words)
    values: list[float] = []

    def on_step(step: int, loss: float, seconds: float) -> None:
        values.append(loss)
        say(f"{step} {loss!r}", flush=True)

    train(objective, plan, out, world=world, wrap=Conditioned, on_step=on_step)
    return values


if __name__ == "__main__":
    torch.set_num_threads(1)
    losses(Path(sys.argv[1]), Path(sys.argv[2]), recipe(steps=int(sys.argv[3]) if len(sys.argv) > 3 else 60))
