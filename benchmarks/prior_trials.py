"""Short trials of the choices in recipes/default.toml: the same small run from random weights, with one thing changed.

    python benchmarks/prior_trials.py SET --out OUT [--only "usual;no clock"] [--steps 2000] [--seeds 3]

SET is what recipes/default.toml trains on. A trial of 2,000 steps takes about 20 minutes of one core and sees a twelfth
of what the run saw. So it says which choices learn faster, not where they end. Each is judged by the error of the
denoised estimate on held-out clips, in the same units whatever the trial's own loss was, and by the everyday prompts
that its weights obey. Trials that change the network get the steps of the same time. OUT gets NAME.json for each.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

import torch
from torch import Tensor, nn

from motionloom.diffusion import SCHEDULES
from motionloom.diffusion.bases import Dct
from motionloom.runtime.text.protocol import TextEncoder
from motionloom.weights.prior import Card, Prior
from motionloom_lab.metrics.obedience import chosen
from motionloom_lab.suites import obey
from motionloom_lab.suites.generator import generator
from motionloom_lab.suites.harness import Run
from motionloom_train.data import sets
from motionloom_train.data.sets import Batches, MotionSet, load_set
from motionloom_train.loop import Average, train
from motionloom_train.nets.prior import NetConfig, PriorNet
from motionloom_train.objectives import CleanError, Conditioned, Drawn, WordBank, feature_scale, masked_error
from motionloom_train.prior import restandardised, text_encoder
from motionloom_train.recipe import Recipe, load_recipe

RECIPE = Path(__file__).parents[1] / "recipes" / "default.toml"
LEVELS = {"pure noise": (980, 1000), "much": (700, 900), "little": (100, 400)}
"""Noise levels of 1000 that held-out clips are denoised at."""
AVERAGES = (0.9, 0.99)
"""Decays of the averages kept beside the usual one, which after 2,000 steps is 0.9955 (`loop.Average`)."""


@dataclass(frozen=True)
class Trial:
    """One thing changed."""

    recipe: dict[str, Any] = field(default_factory=dict)
    """Entries of the recipe."""
    share: dict[str, float] = field(default_factory=dict)
    """Entries of `sets.SHARE`: how often each kind of text is drawn."""
    weight: dict[str, float] = field(default_factory=dict)
    """Entries of `sets.WEIGHT`: how often clips are drawn by how they came to be."""
    slow: float = 0.0
    """Weight of the error of the eight lowest frequencies of each number, on top of the loss."""
    averages: tuple[float, ...] = ()
    """Further averages that are judged too."""
    cost: float = 1.0
    """Time of a step as a multiple of the usual one; the steps are divided by it."""


TRIALS = {
    "usual": Trial(averages=AVERAGES),
    "usual, seed 1": Trial({"seed": 1}),
    "heights as other places": Trial({"heights": 1.0}),
    "no clock": Trial({"net": {"clock": False}}),
    "levels evenly": Trial({"early": 0.0}),
    "levels all as the sampler goes": Trial({"early": 1.0}),
    "low frequencies": Trial(slow=1.0),
    "captions evenly": Trial(share={"action": 0.22, "human": 0.58}),
    "hand-keyed as recordings": Trial(weight={"keyed": 1.0, "made": 1.0}),
    "none hand-keyed": Trial({"sources": ["cmu", "accad", "ui_prmd", "animated_drawings"]}),
    "patch 2": Trial({"net": {"patch": 2}}, cost=1.9),
    "width 256": Trial({"net": {"width": 256, "heads": 4, "hidden": 768}}, cost=0.75),
    "width 448": Trial({"net": {"width": 448, "heads": 7, "hidden": 1408}}, cost=1.6),
}


class Objective(CleanError):
    """The prior's loss, with further averages of the weights and, where wanted, the error of slow parts."""

    def __init__(self, trial: Trial, *parts: Any, **options: Any) -> None:
        super().__init__(*parts, **options)
        self.slow = trial.slow
        self.averages = {decay: Average(self.net, decay) for decay in trial.averages}

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `CleanError`; the averages take in the weights before the step."""
        for average in self.averages.values():
            average.update(self.net, step)
        return super().loss(net, seed, step, rows)

    def error(self, denoised: Tensor, drawn: Drawn) -> Tensor:
        """See `CleanError`."""
        error = super().error(denoised, drawn)
        if not self.slow:
            return error
        valid = torch.arange(drawn.clean.shape[1])[None, :, None] < drawn.cond.lengths[:, None, None]
        off = torch.where(valid, denoised.float() - drawn.clean, 0.0)
        low = Dct(off.shape[1], 8).to_spectrum(off) ** 2 * self.scale
        return error + self.slow * (low.mean(-1).sum(-1) / drawn.cond.lengths).mean()


@cache
def encoder() -> TextEncoder:
    """The text encoder of the weights that ship."""
    return text_encoder("default")


@cache
def words(texts: tuple[str, ...]) -> WordBank:
    """The sentences of a set, encoded once for all trials."""
    return WordBank(encoder(), texts)


@contextmanager
def drawn_as(trial: Trial) -> Iterator[None]:
    """Clips and texts are drawn as the trial says."""
    with mock.patch.dict(sets.SHARE, trial.share), mock.patch.dict(sets.WEIGHT, trial.weight):
        yield


def held_out(folder: str, recipe: Recipe, like: MotionSet) -> MotionSet:
    """The clips that no training sees, under the statistics of those that it does."""
    with mock.patch.object(sets, "read_clips", partial(sets.read_clips, splits=("val", "test"))):
        return restandardised(load_set(folder, sources=recipe.sources), like.mean, like.std)


@torch.inference_mode()
def errors(net: PriorNet, objective: CleanError, *, batches: int = 24, rows: int = 32) -> dict[str, float]:
    """Error of the denoised estimate by level, weighted as in the loss but with heights as other places."""
    found, scale = {}, feature_scale()
    called = Conditioned(net.eval())
    for name, (low, high) in LEVELS.items():
        total = 0.0
        for step in range(batches):
            drawn = objective.drawn(17, step, rows)
            generator = torch.Generator().manual_seed(step)
            level = torch.randint(low, high + 1, (rows,), generator=generator)
            noised = objective.schedule.noised(drawn.clean, level, drawn.noise)
            total += float(masked_error(called(noised, level, drawn.cond), drawn.clean, drawn.cond.lengths, scale))
        found[name] = total / batches
    return found


def judged(prior: Prior, held: CleanError, seeds: int) -> dict[str, float]:
    """What weights are worth: errors on held-out clips, everyday prompts obeyed of all motions drawn."""
    found = errors(prior.net, held)
    results = obey.run(Run(), chosen("everyday"), generate=generator(prior), seeds=seeds, first_seed=300)
    return found | {"obeyed": obey.totals(results, chosen("everyday"))["seeds_obeyed_share"]}


def tried(name: str, folder: str, out: Path, *, steps: int, seeds: int) -> dict[str, Any]:
    """Train and judge one trial."""
    trial = TRIALS[name]
    recipe = load_recipe(RECIPE, trial.recipe)
    steps = round(steps / trial.cost)
    recipe = replace(recipe, steps=steps, save_every=steps)
    with drawn_as(trial):
        data = load_set(folder, sources=recipe.sources)
        batches = Batches(data, windows=recipe.windows, shares=recipe.shares)
    torch.manual_seed(recipe.seed)
    net, schedule = PriorNet(NetConfig.parse(recipe.net)), SCHEDULES[recipe.schedule](recipe.levels)
    objective = Objective(
        trial,
        net,
        schedule,
        batches,
        words(data.texts),
        drop_text=recipe.drop_text,
        displacement=recipe.displacement,
        early=recipe.early,
        heights=recipe.heights,
    )
    other = held_out(folder, recipe, data)
    held = CleanError(net, schedule, Batches(other), words(other.texts), drop_text=0.0)
    began = time.perf_counter()
    with drawn_as(trial):
        usual = train(objective, recipe, out / "run" / name, wrap=_bound, on_step=_say(name))
    seconds = time.perf_counter() - began
    found: dict[str, Any] = {"steps": steps, "seconds": round(seconds), "averages": {}}
    for decay, average in {recipe.ema: usual, **objective.averages}.items():
        net = PriorNet(NetConfig.parse(recipe.net))
        net.load_state_dict(average.weights)
        prior = Prior(net.eval().requires_grad_(False), schedule, data.mean, data.std, encoder(), Card("trial"))
        found["averages"][str(decay)] = judged(prior, held, seeds)
    return found


def _bound(net: nn.Module) -> nn.Module:
    assert isinstance(net, PriorNet)
    return Conditioned(net)


def _say(name: str) -> Callable[[int, float, float], None]:
    def say(step: int, loss: float, seconds: float) -> None:
        if (step + 1) % 200 == 0:
            print(f"{name}: step {step + 1}, loss {loss:.4f}, {seconds:.2f} s a step", flush=True)

    return say


def main() -> None:
    """Run the trials that are asked for; those that OUT has are not run again."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("set")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default=";".join(TRIALS), help="names, divided by semicolons")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    for name in arguments.only.split(";"):
        place = arguments.out / f"{name}.json"
        if not place.is_file():
            found = tried(name, arguments.set, arguments.out, steps=arguments.steps, seeds=arguments.seeds)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        for decay, numbers in json.loads(place.read_text(encoding="utf-8"))["averages"].items():
            print(name, decay, {key: round(value, 4) for key, value in numbers.items()}, flush=True)


if __name__ == "__main__":
    main()
