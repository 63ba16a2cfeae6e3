"""Training the multi-range transformer on pairs, as its paper does without the adversary (Wang et al. 2021, section 4).

Loss: mean squared error of the displacements from frame to frame of each of three seconds, each from the true second
before it. Pairs are cropped, mirrored half of the time and turned any way.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.errors import MotionloomError
from motionloom.features.layout import FPS
from motionloom.kinematics.physics import turned
from motionloom_lab.papers.mrt import Mrt, MrtConfig, MrtFile
from motionloom_train.data.pairs import Pair, mirrored
from motionloom_train.loop import Average, Training
from motionloom_train.recipe import Recipe

SECONDS = 3
"""Seconds that are predicted after the first."""
RECIPE = Recipe(
    name="mrt",
    steps=1500,
    batch=16,
    rate=3e-4,
    warmup=30,
    cooldown=0.5,
    decay=0.0,
    ema=0.995,
    amp="float32",
    save_every=250,
)
"""Of a CPU's sitting; the paper: rate 3e-4, batches of 64, 100 epochs."""


class Seconds:
    """The objective: windows of the train pairs."""

    def __init__(self, net: Mrt, pairs: Sequence[Pair], *, device: str = "cpu") -> None:
        frames = net.config.frames * (1 + SECONDS)
        both = [one for pair in pairs for one in (pair, mirrored(pair))]
        self.positions = [pair.positions for pair in both if pair.frames >= frames]
        if not self.positions:
            raise MotionloomError(f"no pair has the {frames} frames ({frames / FPS:g} s) of a window to train on")
        self.net, self.device, self.frames = net, device, frames

    def draw(self, seed: int, step: int, rows: int) -> Tensor:
        """(rows, 2, frames, 22, 3) metres: windows turned any way, around the middle of the two; from (seed, step)."""
        rng = np.random.default_rng((seed, step))
        return torch.from_numpy(np.stack([self._window(rng) for _ in range(rows)]).astype(np.float32)).to(self.device)

    def _window(self, rng: np.random.Generator) -> np.ndarray:
        chosen = self.positions[rng.integers(len(self.positions))]
        start = int(rng.integers(chosen.shape[1] - self.frames + 1))
        window = chosen[:, start : start + self.frames]
        ground = window[:, 0, 0].mean(axis=0) * np.array([1.0, 0.0, 1.0])
        return turned(window - ground, float(rng.uniform(0, 2 * np.pi)))

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`; metres squared times 1000, which the gradient's largest norm is made for."""
        window, second = self.draw(seed, step, rows), self.net.config.frames
        starts = range(0, SECONDS * second, second)
        past = torch.cat([window[:, :, k : k + second] for k in starts])
        wanted = torch.cat([window[:, :, k + second - 1 : k + 2 * second].diff(dim=2) for k in starts])
        said = torch.cat([past[:, :, -1:], net(past)], dim=2).diff(dim=2)
        return 1000 * ((said - wanted) ** 2).mean()


def train_mrt(run: Training, pairs: Sequence[Pair], config: MrtConfig | None = None) -> Path:
    """Train (or go on training) on the ``train`` pairs at 20 frames per second; returns the file of the weights.

    run: with `RECIPE`, or another number of steps, of rows or of the seed. config: sizes; None: the usual ones.
    """
    recipe = run.recipe
    chosen = [pair for pair in pairs if pair.split == "train"]
    torch.manual_seed(recipe.seed)
    net = Mrt(config or MrtConfig())
    objective = Seconds(net, chosen, device=run.world.device)

    def export(average: Average, step: int) -> None:
        made = Mrt(net.config)
        made.load_state_dict(average.weights)
        notes = {"steps": step, "batch": recipe.batch, "seed": recipe.seed, "recordings": len(chosen)}
        licences = "; ".join(sorted({pair.licence for pair in chosen}))
        sources = ", ".join(sorted({pair.source for pair in chosen}))
        MrtFile(made, licences, f"{len(chosen)} train pairs of {sources}", notes).save(run.place)

    about = f"{sum(p.numel() for p in net.parameters()):,} parameters, {len(chosen)} pairs and their mirror images"
    return run.run(objective, export, about)
