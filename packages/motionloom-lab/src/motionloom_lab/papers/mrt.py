"""Multi-range transformer: several people's next second from their last one (Wang et al. 2021, "Multi-Person 3D Motion
Prediction with Multi-Range Transformers"), a baseline of prefix completion.

For each person: a local encoder sees the cosine spectrum of the own last second, as differences of neighbouring rows; a
global encoder sees every frame of everybody, with how near they are; a decoder with one query, the person's last pose,
attends to both and gives the displacements of the next second as a spectrum. Longer futures go second by second.

Written from the paper's description. Here: 22 joints at 20 frames a second (there: 15 joints at 15), the places
relative to the middle of all people's last roots (there: absolute in a centred scene), and no discriminator. The loss
(section 4, without the adversary): mean squared error of the displacements from frame to frame of each of three
seconds, each from the true second before it; pairs are cropped, mirrored half of the time and turned any way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.diffusion import Dct
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.models.container import Container
from motionloom.kinematics.physics import turned
from motionloom_train.data.pairs import Pair, mirrored
from motionloom_train.loop import Average, Training
from motionloom_train.modules import arrays, fill
from motionloom_train.nets.prior import sinusoids
from motionloom_train.recipe import Recipe

FILES = Container("multi-range transformer", "motionloom-mrt", max_bytes=64 << 20)
JOINTS = 22


@dataclass(frozen=True)
class MrtConfig:
    """Sizes; the defaults are the paper's but for joints and frames."""

    frames: int = 20
    """Frames of a second: seen, and predicted at once."""
    width: int = 128
    hidden: int = 1024
    layers: int = 3
    """Of each encoder and of the decoder."""
    heads: int = 8
    key: int = 64
    """Width of a head."""
    dropout: float = 0.2

    def __post_init__(self) -> None:
        sizes = (self.frames, self.width, self.hidden, self.layers, self.heads, self.key)
        whole = all(isinstance(n, int) and not isinstance(n, bool) and 0 < n <= 4096 for n in sizes)
        number = isinstance(self.dropout, int | float) and not isinstance(self.dropout, bool)
        if (
            not whole
            or self.frames < 2
            or self.width % 2
            or self.layers > 64
            or not number
            or not 0 <= self.dropout < 1
        ):
            raise MotionloomError(f"the multi-range transformer's sizes are not usable: {asdict(self)}")


class Mrt(nn.Module):
    """``net(past)``: the next ``frames`` of everybody, (rows, people, frames, 22, 3), from as many before.

    Metres in any world whose axes stay: what is given moves with the people, but does not turn with them. People who
    are exchanged give exchanged results.
    """

    def __init__(self, config: MrtConfig) -> None:
        super().__init__()
        self.config = config
        self.basis = torch.from_numpy(
            Dct(config.frames, config.frames).matrix
        )  # orthonormal: transposed it is the way back
        numbers = 3 * JOINTS
        self.local_in, self.global_in, self.ask = (nn.Linear(numbers, config.width) for _ in range(3))
        self.local, self.everybody, self.decoder = (
            nn.ModuleList(_Layer(config) for _ in range(config.layers)) for _ in range(3)
        )
        self.expand = nn.Linear(config.width, config.frames * config.width)
        self.out = nn.Linear(config.width, numbers)

    def forward(self, past: Tensor) -> Tensor:
        """past (rows, people, frames, 22, 3)."""
        return past[:, :, -1:] + self.displacements(past).cumsum(dim=2)

    def displacements(self, past: Tensor) -> Tensor:
        """(rows, people, frames, 22, 3) metres from each next frame to the one after it, the last seen one first."""
        rows, people, frames = past.shape[:3]
        if frames != self.config.frames or past.shape[3:] != (JOINTS, 3):
            raise MotionloomError(f"the multi-range transformer sees {self.config.frames} frames; got {past.shape}")
        places = past - middle(past)
        near = _nearness(places)
        own = self._own(places.flatten(0, 1).flatten(2))
        others = self._all(places.flatten(3))
        memory = torch.cat([own, (others[:, None] + near[..., None]).flatten(0, 1)], dim=1)
        query = self.ask(places[:, :, -1].flatten(0, 1).flatten(1))[:, None]
        for layer in self.decoder:
            query = layer(query, memory)
        spectrum = self.out(F.gelu(self.expand(query)).view(len(query), frames, -1))
        return (self.basis.to(spectrum).mT @ spectrum).view(rows, people, frames, JOINTS, 3)

    def _own(self, places: Tensor) -> Tensor:
        """(rows * people, frames, 66) to (rows * people, frames - 1, width)."""
        x = self.local_in((self.basis.to(places) @ places).diff(dim=1))
        x = x + _times(x.shape[1], x)
        for layer in self.local:
            x = layer(x, x)
        return x

    def _all(self, places: Tensor) -> Tensor:
        """(rows, people, frames, 66) to (rows, people * frames, width); who is who is not encoded, only when."""
        x = self.global_in(places)
        x = (x + _times(x.shape[2], x)).flatten(1, 2)
        for layer in self.everybody:
            x = layer(x, x)
        return x


def middle(past: Tensor) -> Tensor:
    """(rows, 1, 1, 1, 3): the middle of all people's last roots on the ground."""
    roots = past[:, :, -1, 0].mean(dim=1)
    return (roots * roots.new_tensor([1.0, 0.0, 1.0]))[:, None, None, None]


def _nearness(places: Tensor) -> Tensor:
    """(rows, people, people * frames): exp of minus the mean squared distance of each pose to each one's last pose."""
    apart = places[:, :, -1][:, :, None, None] - places[:, None]
    return torch.exp(-(apart**2).sum(-1).mean(-1)).flatten(2)


def _times(count: int, like: Tensor) -> Tensor:
    return sinusoids(torch.arange(count, device=like.device), like.shape[-1]).to(like)


class _Layer(nn.Module):
    """Attention of x to a memory (itself in the encoders), then two linear layers; each with a sum and a norm."""

    def __init__(self, config: MrtConfig) -> None:
        super().__init__()
        inner = config.heads * config.key
        self.heads, self.dropout = config.heads, nn.Dropout(config.dropout)
        self.query, self.key, self.value = (nn.Linear(config.width, inner, bias=False) for _ in range(3))
        self.back = nn.Linear(inner, config.width)
        self.hidden, self.shown = nn.Linear(config.width, config.hidden), nn.Linear(config.hidden, config.width)
        self.norm1, self.norm2 = nn.LayerNorm(config.width), nn.LayerNorm(config.width)

    def forward(self, x: Tensor, memory: Tensor) -> Tensor:
        q, k, v = (
            m(z).unflatten(-1, (self.heads, -1)).transpose(1, 2)
            for m, z in ((self.query, x), (self.key, memory), (self.value, memory))
        )
        mixed = F.scaled_dot_product_attention(q, k, v, dropout_p=self.dropout.p if self.training else 0.0)
        x = self.norm1(x + self.dropout(self.back(mixed.transpose(1, 2).flatten(2))))
        return self.norm2(x + self.dropout(self.shown(F.relu(self.hidden(x)))))


@torch.inference_mode()
def completed(net: Mrt, past: np.ndarray, frames: int) -> np.ndarray:
    """(rows, people, past + frames, 22, 3) metres: the past as it is, then what follows, second by second.

    past (rows, people, at least one second, 22, 3) metres at 20 frames per second, +Y up. Raises MotionloomError for
    fewer frames.
    """
    second = net.config.frames
    if past.ndim != 5 or past.shape[2] < second or past.shape[3:] != (JOINTS, 3) or frames < 1:
        raise MotionloomError(f"a completion needs pasts (rows, people, {second} or more, 22, 3); got {past.shape}")
    ones = next(net.parameters())
    last = torch.as_tensor(past[:, :, -second:]).to(ones)
    pieces, count = [], 0
    while count < frames:
        last = net(last)
        pieces.append(last)
        count += second
    after = torch.cat(pieces, dim=2)[:, :, :frames].cpu().numpy().astype(past.dtype)
    return np.concatenate([past, after], axis=2)


# The weight file -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class MrtFile:
    """A trained network and what it was trained on."""

    net: Mrt
    licence: str = "unknown: ask whoever gave you this file"
    data: str = "unknown"
    notes: Mapping[str, Any] = field(default_factory=dict)

    def save(self, path: Path | str) -> Path:
        """Write it as a .safetensors file; it appears whole or not at all."""
        about = {"config": asdict(self.net.config), "licence": self.licence, "data": self.data, "notes": self.notes}
        return FILES.write(path, arrays(self.net), about)

    @staticmethod
    def load(path: Path | str, *, device: str = "cpu") -> "MrtFile":
        """Read it, ready to predict; raises MotionloomError for a file that is missing, damaged or something else."""
        path = Path(path)
        if not path.is_file():
            raise MotionloomError(f"there is no {path}; train one with --train-mrt STEPS")
        about, tensors = FILES.read(path)
        with FILES.parsing(path):
            with torch.device("meta"):
                net = Mrt(MrtConfig(**about["config"]))
            fill(net, tensors, str(path))
            file = MrtFile(net, str(about["licence"]), str(about["data"]), dict(about["notes"]))
        file.net.to(device).eval().requires_grad_(False)
        return file


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
        """See `Objective.loss`; metres squared times 1000, which the gradient's largest norm is chosen for."""
        window, second = self.draw(seed, step, rows), self.net.config.frames
        starts = range(0, SECONDS * second, second)
        past = torch.cat([window[:, :, k : k + second] for k in starts])
        target = torch.cat([window[:, :, k + second - 1 : k + 2 * second].diff(dim=2) for k in starts])
        estimate = torch.cat([past[:, :, -1:], net(past)], dim=2).diff(dim=2)
        return 1000 * ((estimate - target) ** 2).mean()


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
        result = Mrt(net.config)
        result.load_state_dict(average.weights)
        notes = {"steps": step, "batch": recipe.batch, "seed": recipe.seed, "recordings": len(chosen)}
        licences = "; ".join(sorted({pair.licence for pair in chosen}))
        sources = ", ".join(sorted({pair.source for pair in chosen}))
        MrtFile(result, licences, f"{len(chosen)} train pairs of {sources}", notes).save(run.place)

    about = f"{sum(p.numel() for p in net.parameters()):,} parameters, {len(chosen)} pairs and their mirror images"
    return run.run(objective, export, about)
