"""What a step of training minimises. An objective owns the modules and turns a batch into one number."""

from typing import Any, NamedTuple, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.core.diffusion import Schedule
from motionloom.core.features.humanml import displacements
from motionloom.core.features.layout import FEET, LAYOUT
from motionloom.core.features.representation import HUMANML3D, Representation
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom_train.data.batches import Batch, Batches
from motionloom_train.data.progress import Say
from motionloom_train.low_rank import AdapterNet
from motionloom_train.nets.prior import Condition, PriorNet, condition
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import number_of, tensor

WEIGHTS = {
    "yaw_velocity": 6.0,
    "root_velocity": 6.0,
    "root_height": 6.0,
    "ric": 1.5,
    "rot6d": 0.4,
    "joint_velocity": 1.0,
    "contacts": 0.5,
}
"""Weights of the feature blocks in the loss: the few numbers of the root decide where a person goes, the 126 of the
rotations are read by nobody when motions are exported. 1 everywhere is the published loss."""


class Objective(Protocol):
    """One kind of training for `train.loop.train`."""

    @property
    def net(self) -> nn.Module:
        """The trained weights."""
        ...

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """The loss of one step, which follows from ``(seed, step)`` alone; ``net`` may be a wrapped `self.net`."""
        ...


class WordBank:
    """Token states of all sentences of a set, encoded once, float16, on the device that computes."""

    def __init__(
        self,
        encoder: TextEncoder,
        texts: tuple[str, ...],
        *,
        room: int = 40,
        device: str = "cpu",
        progress: Say = print,
    ) -> None:
        starts = [0]
        tokens, pooled = [], []
        progress(f"encoding {len(texts)} sentences")
        for first in range(0, len(texts), 256):
            batch = encoder.encode(texts[first : first + 256])
            pooled.append(batch.pooled)
            for row, mask in zip(batch.tokens, batch.mask, strict=True):
                count = min(int(mask.sum()), room)
                tokens.append(row[:count].astype(np.float16))
                starts.append(starts[-1] + count)
        self.starts = torch.tensor(starts, device=device)
        self.most = int(np.diff(starts).max())
        self.tokens, self.pooled = tensor(np.concatenate(tokens), device), tensor(np.concatenate(pooled), device)

    def condition(self, texts: Tensor, lengths: Tensor, flags: Tensor | None = None) -> Condition:
        """The condition of a batch: numbers of sentences and valid frames (rows,), perhaps flags (rows, frames)."""
        device = self.tokens.device
        texts, lengths = texts.to(device), lengths.to(device)
        first, counts = self.starts[texts], self.starts[texts + 1] - self.starts[texts]
        # a GPU computes in few shapes: it has kernels and graphs for each
        most = int(counts.max()) if device.type == "cpu" else self.most
        place = torch.arange(most, device=device)
        words = place < counts[:, None]
        indices = (first[:, None] + place).clamp(max=len(self.tokens) - 1)
        tokens = self.tokens[indices].float() * words[..., None]
        return condition(self.pooled[texts], tokens=tokens, words=words, lengths=lengths, flags=flags)


class Sample(NamedTuple):
    """One step's samples."""

    clean: Tensor
    """(rows, frames, features) standardised."""
    level: Tensor
    """(rows,)"""
    noise: Tensor
    cond: Condition


class CleanError:
    """Mean squared error of the estimate of x0 at a uniformly drawn level (Tevet et al. 2023, eq. 2), blocks weighted.

    The mean is over valid frames and numbers of each row, then over rows, as published (specification of MDM's loss).
    The recipe's ``early``, ``heights``, ``drop_text`` and ``displacement`` are heeded: early levels lie near pure
    noise, where it is decided what a motion will show, and `displacement_error` is in place of MDM's geometric losses
    (eq. 4 and 5), which its published text models leave out.

    The recipe's ``keep`` holds the network to ``teacher``, the one it began as, on rows that are not fresh: their error
    against its estimate of the same state under the same condition is added (as Li & Hoiem 2016, "Learning without
    forgetting").
    """

    def __init__(
        self,
        net: nn.Module,
        schedule: Schedule,
        batches: Batches,
        words: WordBank,
        recipe: Recipe | None = None,
        device: str = "cpu",
        *,
        teacher: nn.Module | None = None,
    ) -> None:
        """``teacher``: called as the network in `loss` is, on ``device``; needed where the recipe has ``keep``."""
        self.net, self.schedule, self.batches, self.words = net, schedule, batches, words
        self.teacher = teacher
        self.recipe, self.device = recipe or Recipe(), device
        self.mean, self.std = batches.data.mean.to(device), batches.data.std.to(device)
        self.representation = batches.data.representation
        self.scale = feature_scale(self.recipe.heights, self.representation).to(device)
        self._signal, self._spread = (tensor(table, device).float() for table in (schedule.signal, schedule.noise))

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`."""
        window, picked = self.pick(seed, step, rows)
        return self.shown_loss(net, window, picked.to(self.device), self._generator(seed, step))

    def pick(self, seed: int, step: int, rows: int) -> tuple[int, Tensor]:
        """See `motionloom_train.captured.Capturable`."""
        return self.batches.pick(seed, step, rows)

    def shown_loss(self, net: nn.Module, shape: int, picked: Tensor, generator: torch.Generator) -> Tensor:
        """See `motionloom_train.captured.Capturable`."""
        sample = self._noisy(shape, picked, generator)
        at = sample.level[:, None, None]
        state = self._signal[at] * sample.clean + self._spread[at] * sample.noise
        denoised = net(state, sample.level, sample.cond)
        error = self.error(denoised, sample)
        return error + self.recipe.keep * self.strayed(denoised, state, sample) if self.recipe.keep else error

    def strayed(self, denoised: Tensor, state: Tensor, sample: Sample) -> Tensor:
        """How far estimates are from those of ``teacher``, over the rows that are not fresh; they count as in a batch
        of which they are a part, so that ``keep`` means the same beside the data's error at any share of fresh rows."""
        assert self.teacher is not None, "the recipe keeps near weights that are not there"
        old = slice(self.batches.old_rows(len(denoised)))
        cond = Condition(*(part[old] for part in sample.cond))
        with torch.no_grad():
            target = self.teacher(state[old], sample.level[old], cond).float()
        return masked_error(denoised[old], target, cond.lengths, self.scale) * len(target) / len(denoised)

    def number(self, seed: int, step: int) -> int:
        """See `motionloom_train.captured.Capturable`."""
        return number_of(seed, step)

    def sample(self, seed: int, step: int, rows: int) -> Sample:
        """What a step looks at, from ``(seed, step)`` alone, on the objective's device."""
        window, picked = self.pick(seed, step, rows)
        return self._noisy(window, picked.to(self.device), self._generator(seed, step))

    def _generator(self, seed: int, step: int) -> torch.Generator:
        return torch.Generator(self.device).manual_seed(self.number(seed, step))

    def _noisy(self, window: int, picked: Tensor, generator: torch.Generator) -> Sample:
        batch: Batch = self.batches.show(window, picked)
        rows = len(batch.lengths)
        level = self.random_levels(rows, generator)
        noise = torch.randn(batch.features.shape, generator=generator, device=self.device)
        keep = torch.rand(rows, generator=generator, device=self.device) >= self.recipe.drop_text
        cond = self.words.condition(batch.texts, batch.lengths, batch.flags)
        return Sample(batch.features, level, noise, cond.choose(keep))

    def random_levels(self, rows: int, generator: torch.Generator) -> Tensor:
        """(rows,) levels: a share ``early`` as the sampler's spacing of that name goes, the rest evenly."""
        how: dict[str, Any] = {"generator": generator, "device": generator.device}
        level = torch.randint(1, self.schedule.steps + 1, (rows,), **how)
        if not self.recipe.early:
            return level
        often = (self.schedule.steps * (1 - torch.rand(rows, **how) ** 2)).ceil().clamp(min=1).long()
        return torch.where(torch.rand(rows, **how) < self.recipe.early, often, level)

    def error(self, denoised: Tensor, sample: Sample) -> Tensor:
        """What an estimate of the clean data costs."""
        error = masked_error(denoised, sample.clean, sample.cond.lengths, self.scale)
        if self.recipe.displacement:
            moved = displacement_error(denoised, sample.clean, sample.cond.lengths, self.mean, self.std)
            error = error + self.recipe.displacement * moved
        if self.recipe.geometric:
            bodily = geometric_error(
                denoised, sample.clean, sample.cond.lengths, self.mean, self.std, kind=self.representation
            )
            error = error + self.recipe.geometric * bodily
        return error


def feature_scale(heights: float = 1.0, kind: Representation = HUMANML3D) -> Tensor:
    """(numbers,) how much each one's error counts, 1 on average; ``heights``: how much more that of a height does."""
    scale = torch.ones(kind.width)
    for name, block in kind.blocks.items() if kind is HUMANML3D else ():  # others are weighed as published
        scale[block] = WEIGHTS[name]
    scale[list(kind.heights)] *= heights
    return scale / scale.mean()


class Conditioned(nn.Module):
    """A network that binds its condition in the same call, so that wrappers (DDP, compile) see one forward."""

    def __init__(self, net: PriorNet | AdapterNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor, level: Tensor, cond: Condition) -> Tensor:
        return self.net(x, level, self.net.bind(cond))


def masked_error(denoised: Tensor, clean: Tensor, lengths: Tensor, scale: Tensor) -> Tensor:
    """Weighted squared error over valid frames: (rows, frames, features) twice, (rows,), (features,) to one number."""
    valid = torch.arange(clean.shape[1], device=clean.device) < lengths[:, None]
    error = ((denoised.float() - clean) ** 2 * scale).mean(-1)
    return ((error * valid).sum(1) / lengths.clamp(min=1)).mean()


STANDING = 0.01
"""Metres per frame: a foot that moves no more stands, in `geometric_error`."""


def geometric_error(
    denoised: Tensor, clean: Tensor, lengths: Tensor, mean: Tensor, std: Tensor, *, kind: Representation
) -> Tensor:
    """MDM's geometric losses, each of weight 1 (Tevet et al. 2023, eq. 3 to 5), for any `Representation`.

    Squared errors, meaned over valid frames and numbers of each row, then over rows: of the joints' places in the world
    (metres), of the frame-to-frame differences of the standardised numbers but for the root's three, and of the steps
    (metres) of feet that stand in the data. (rows, frames, numbers) standardised twice, (rows,), (numbers,) twice, to
    one number.
    """
    denoised = denoised.float()
    places, real = (kind.decode_positions(x * std + mean) for x in (denoised, clean))
    root = max(kind.blocks["root_height"].stop, kind.blocks["root_velocity"].stop)
    changes = (denoised.diff(dim=1) - clean.diff(dim=1))[..., root:]
    feet = list(FEET)
    steps, stands = places[:, :, feet].diff(dim=1), real[:, :, feet].diff(dim=1).norm(dim=-1) <= STANDING
    one = torch.ones((), device=clean.device)
    error = masked_error(places.flatten(-2), real.flatten(-2), lengths, one)
    error = error + masked_error(changes, torch.zeros_like(changes), lengths - 1, one)
    slides = (steps * stands[..., None]).flatten(-2)
    return error + masked_error(slides, torch.zeros_like(slides), lengths - 1, one)


PLANTED = 4.0
"""How much more a foot that is planted counts in `displacement_error`."""


def displacement_error(denoised: Tensor, clean: Tensor, lengths: Tensor, mean: Tensor, std: Tensor) -> Tensor:
    """Squared error of how far each joint goes from frame to frame, as positions decode it, in units of its spread.

    (rows, frames, features) standardised twice, (rows,), (features,) twice, to one number. Four frames share a token:
    this is what makes neighbouring tokens agree, and planted feet stay.
    """
    block = LAYOUT["joint_velocity"]
    target = (clean[:, :-1, block] * std[block] + mean[block]).unflatten(-1, (22, 3))
    error = ((displacements(denoised.float() * std + mean) - target) ** 2).sum(-1) / (3 * std[block].mean() ** 2)
    planted = clean[:, :-1, LAYOUT["contacts"]] * std[LAYOUT["contacts"]] + mean[LAYOUT["contacts"]] > 0.5
    weight = torch.ones_like(error)
    for place, foot in enumerate(FEET):  # a list of places would be copied to the GPU, which then waits
        weight[..., foot] += (PLANTED - 1) * planted[..., place]
    valid = torch.arange(1, clean.shape[1], device=clean.device) < lengths[:, None]
    error = (error * weight).mean(-1)
    return ((error * valid).sum(1) / (lengths - 1).clamp(min=1)).mean()
