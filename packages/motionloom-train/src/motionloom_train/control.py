"""Training control: algorithm 1 of Shafir et al. 2024 ("Human Motion Diffusion as a Generative Prior").

    noise <- noise * (1 - M);   x_t = signal * x_0 + noise_t * noise;   loss over all numbers of the denoised estimate

The given numbers M of a state are thus signal * x_0, without noise. From a finished prior, either all its weights are
trained on (``full``, as published) or a low-rank adapter whose input also says what is given (`weights.adapter`).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.errors import MotionloomError
from motionloom.runtime.text.protocol import TextEncoder
from motionloom.weights.adapter import Adapter, fingerprint
from motionloom.weights.prior import Card, Prior, save_prior
from motionloom_train.data.batches import FAVOUR, Batches
from motionloom_train.data.sets import MotionSet, load_set, read_clips
from motionloom_train.loop import Average, Training
from motionloom_train.low_rank import AdapterNet, adapted, show, tensors_of
from motionloom_train.masks import check_control, draw_masks
from motionloom_train.modules import prior_module, prior_session
from motionloom_train.nets.prior import Condition, PriorNet
from motionloom_train.objectives import CleanError, WordBank
from motionloom_train.prior import restandardised
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import conditions, noised, tensor

HELD_WINDOW, HELD_ROWS = 80, 48
"""Frames and number of the held-out windows that are reported on."""


class Shown(nn.Module):
    """A network in training that binds its condition and takes what is given, if it can, in one call."""

    def __init__(self, net: PriorNet | AdapterNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor, level: Tensor, cond: Condition, given: Tensor, mask: Tensor) -> Tensor:
        return self.net(x, level, show(self.net, self.net.bind(cond), given, mask))


class ControlledError(CleanError):
    """`CleanError` of states whose given numbers are free of noise; the masks of a step follow from (seed, step)."""

    control = "any"
    early = False
    """Draw levels as the spacing ``early`` of `motionloom.diffusion.levels` does: most of them near pure noise."""

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`; ``net`` is a wrapped `Shown`."""
        drawn = self.sample(seed, step, rows)
        if self.early:
            even = drawn.level.double() / self.schedule.steps
            drawn = drawn._replace(level=(self.schedule.steps * (1 - (1 - even) ** 2)).round().long())
        rng = np.random.default_rng((seed, step, 2))
        masks = draw_masks(self.control, drawn.cond.lengths.cpu().numpy(), drawn.clean.shape[1], rng=rng)
        mask = torch.from_numpy(masks).to(self.device)
        state = noised(self.schedule, drawn.clean, drawn.level, drawn.noise * ~mask)
        return self.error(net(state, drawn.level, drawn.cond, drawn.clean, mask), drawn)


@dataclass(frozen=True, eq=False)
class Held:
    """Windows of recordings that no training saw, at fixed levels, noise and masks."""

    clean: Tensor
    """(rows, frames, features) standardised."""
    noised: Tensor
    """The same without noise at the given numbers."""
    mask: Tensor
    """(rows, frames, features) bool."""
    level: Tensor
    cond: Condition

    @torch.no_grad()
    def errors(self, net: nn.Module) -> tuple[float, float]:
        """Mean squared error of the denoised estimate over the given and over the free numbers, standardised."""
        denoised = net(self.noised, self.level, show(net, net.bind(self.cond), self.clean, self.mask))  # type: ignore[operator]
        error = (denoised - self.clean) ** 2
        return float(error[self.mask].mean()), float(error[~self.mask].mean())


def held_out(data: Path | str, prior: Prior, recipe: Recipe) -> Held | None:
    """The windows of the set's validation clips; None where it has none long enough."""
    try:
        clips = read_clips(data, sources=recipe.sources, splits=("val",))
    except MotionloomError:
        return None
    clips = [clip for clip in clips if len(clip.features) >= HELD_WINDOW]
    if not clips:
        return None
    rng, windows, prompts = np.random.default_rng(2), [], []
    for number in np.linspace(0, len(clips) - 1, HELD_ROWS).round().astype(int):
        clip = clips[number]
        first = int(rng.integers(len(clip.features) - HELD_WINDOW + 1))
        windows.append(torch.from_numpy(clip.features[first : first + HELD_WINDOW]).float())
        said = (n.texts[0] for n in clip.notes if n.kind == "human" and n.first <= first and n.texts)
        prompts.append(next(said, ""))
    clean = (torch.stack(windows) - tensor(prior.mean)) / tensor(prior.std)
    masks = draw_masks(recipe.control, np.full(HELD_ROWS, HELD_WINDOW), HELD_WINDOW, rng=rng)
    mask = torch.from_numpy(masks)
    level = torch.linspace(1, prior.schedule.steps, HELD_ROWS).long()[torch.from_numpy(rng.permutation(HELD_ROWS))]
    noise = torch.from_numpy(rng.standard_normal(clean.shape, dtype=np.float32))
    cond = conditions(prior.condition(prompts))
    return Held(clean, noised(prior.schedule, clean, level, noise * ~mask), mask, level, cond)


def train_control(run: Training, data: Path | str, text: TextEncoder) -> Path:
    """Train (or go on training) a control on a built set; returns its weight file.

    An adapter for the prior ``recipe.start``, or with ``recipe.full`` a prior of its own. Raises MotionloomError for
    what cannot be trained.
    """
    recipe, world = run.recipe, run.world
    check_control(recipe.control)
    prior = Prior.load(recipe.start or "default")
    motions = restandardised(
        load_set(data, sources=recipe.sources, seed=recipe.seed), tensor(prior.mean), tensor(prior.std)
    )
    torch.manual_seed(recipe.seed)
    net = _trained(recipe, prior, world.device)
    batches = Batches(motions, windows=recipe.windows, shares=recipe.shares, favour=recipe.favour or FAVOUR)
    words = WordBank(text, motions.texts, progress=run.progress)
    objective = ControlledError(
        net,
        prior.schedule,
        batches,
        words,
        drop_text=recipe.drop_text,
        displacement=recipe.displacement,
        device=world.device,
    )
    objective.control, objective.early = recipe.control, recipe.spacing == "early"
    held = held_out(data, prior, recipe)

    def export(average: Average, step: int) -> None:
        weights = {k: v.cpu() for k, v in average.weights.items()}
        made = _full(recipe, prior, motions, weights, step) if recipe.full else None
        if made:
            save_prior(made, run.place)
        else:
            _adapter(recipe, prior, motions, weights, step).save(run.place)
        if held:
            base = prior_module(prior)
            now = prior_module(made) if made else adapted(base, Adapter.load(run.place, prior))
            run.say(f"step {step}: {_report(held, now, base)}")

    count = sum(p.numel() for p in net.parameters())
    about = f"{count:,} trained parameters, {len(motions.items):,} described stretches"
    return run.run(objective, export, about, wrap=_wrap)


def _wrap(net: nn.Module) -> nn.Module:
    assert isinstance(net, PriorNet | AdapterNet)
    return Shown(net)


def _trained(recipe: Recipe, prior: Prior, device: str) -> PriorNet | AdapterNet:
    """What is trained, on its device: a copy of the prior's network, or an adapter over it."""
    if recipe.full:
        if recipe.adapter:
            raise MotionloomError("a full fine-tune does not go on from an adapter; give one of full and adapter")
        return prior_module(prior).requires_grad_(True).to(device)
    start = Adapter.load(recipe.adapter, prior) if recipe.adapter else None
    rank, given_rank = recipe.rank, recipe.given_rank
    if start and (start.rank, start.given_rank) != (rank, given_rank):
        raise MotionloomError(
            f"the adapter {recipe.adapter} has rank {start.rank} and given_rank {start.given_rank}, and the recipe "
            f"says {rank} and {given_rank}; copy them"
        )
    return AdapterNet(prior_module(prior).to(device), rank, given_rank=given_rank, start=start)


def _report(held: Held, net: nn.Module, base: nn.Module) -> str:
    (given, free), (given0, free0) = held.errors(net), held.errors(base)
    return (
        f"held-out squared error, given numbers {given:.4f} (base network {given0:.4f}), "
        f"free numbers {free:.4f} (base network {free0:.4f})"
    )


def _notes(recipe: Recipe, motions: MotionSet, step: int) -> dict:
    notes = {"steps": step, "batch": recipe.batch, "seed": recipe.seed, "minutes": round(motions.minutes, 1)}
    return notes | ({"from": Path(recipe.adapter).stem} if recipe.adapter else {})


def _adapter(recipe: Recipe, prior: Prior, motions: MotionSet, weights: dict[str, Tensor], step: int) -> Adapter:
    licences = "; ".join(motions.licences)
    return Adapter(
        recipe.name,
        recipe.control,
        recipe.rank,
        tensors_of(weights),
        prior.card.name,
        fingerprint(prior.net),
        recipe.licence or licences,
        licences,
        _notes(recipe, motions, step),
    )


def _full(recipe: Recipe, prior: Prior, motions: MotionSet, weights: dict[str, Tensor], step: int) -> Prior:
    net = PriorNet(prior.net.config)
    net.load_state_dict(weights)
    licences = "; ".join(motions.licences)
    notes = _notes(recipe, motions, step) | {"control": recipe.control, "from": prior.card.name}
    card = Card(recipe.name, recipe.licence or licences, licences, notes)
    return Prior(prior_session(net), prior.schedule, prior.mean, prior.std, prior.text, card)
