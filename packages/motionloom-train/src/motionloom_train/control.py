"""Training control: algorithm 1 of Shafir et al. 2024 ("Human Motion Diffusion as a Generative Prior").

    noise <- noise * (1 - M);   x_t = signal * x_0 + noise_t * noise;   loss over all numbers of the denoised estimate

The given numbers M of a state are thus signal * x_0, without noise. From a finished prior, either all its weights are
trained on (``full``, as published) or a low-rank adapter whose input also shows what is given (`weights.adapter`).

What is given is random, in the ways that users give it: a path or a hand in all frames, at a few keyframes, on
stretches, from the beginning, around a gap; whole poses; half of the body. A joint's place is measured from the root,
so most rows that give a joint give both.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import LAYOUT, WIDTH, mask
from motionloom.core.features.representation import HUMANML3D
from motionloom.core.models.adapter import Adapter, fingerprint
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.core.models.prior import Card, Prior, save_prior
from motionloom.core.skeleton import SMPL22
from motionloom_train.data.batches import FAVOUR, Batches
from motionloom_train.data.sets import MotionSet, load_set, read_clips
from motionloom_train.loop import Average, Training
from motionloom_train.low_rank import AdapterNet, adapted, show, tensors_of
from motionloom_train.modules import prior_module, prior_session
from motionloom_train.nets.prior import Condition, PriorNet
from motionloom_train.objectives import CleanError, WordBank
from motionloom_train.prior import restandardised
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import conditions, noised, tensor

Flags = NDArray[np.bool_]

CONTROLS = ("trajectory", "left_wrist", "right_wrist", "left_foot", "right_foot", "head", "any")
"""The controls that ship. Names of `features.layout.mask` can be trained too."""
NOTHING = 0.05
"""Share of rows that give nothing, so that the prior stays what it was."""
WITH_ROOT = 0.75
"""Share of rows with a joint that give the root as well."""


def check_control(control: str) -> None:
    """Raise MotionloomError for a control that cannot be trained."""
    if not control:
        raise MotionloomError(
            f"the recipe does not say which control to train; control is one of {', '.join(CONTROLS)}"
        )
    if control not in ("any", "trajectory") and not mask(control).any():
        raise MotionloomError(f"the control {control!r} gives nothing to train; {', '.join(CONTROLS)} do")


def draw_masks(control: str, lengths: NDArray[np.int64], frames: int, *, rng: np.random.Generator) -> Flags:
    """(rows, frames, 263) True at the numbers that are given, one row for each of the valid ``lengths``."""
    draw = {"any": _anything, "trajectory": _trajectory}.get(control)
    rows = np.zeros((len(lengths), frames, WIDTH), dtype=bool)
    for row, length in zip(rows, lengths, strict=True):
        if rng.random() >= NOTHING:
            if draw:
                row |= draw(int(length), frames, rng)
            else:
                when = some_frames(int(length), frames, 0.55, rng)
                row |= (when[:, None] & mask(control)) | _root(when, rng)
    return rows


def some_frames(length: int, frames: int, dense: float, rng: np.random.Generator) -> Flags:
    """(frames,) when something is given: always with probability ``dense``, else at keys, in a rhythm, in a stretch,
    at the beginning, or at both ends."""
    chosen = np.zeros(frames, dtype=bool)
    if rng.random() < dense:
        return ~chosen  # padding too, as published
    kind, half = rng.integers(5), max(length // 2, 1)
    if kind == 0:
        chosen[rng.choice(length, size=min(int(rng.integers(1, 7)), length), replace=False)] = True
    elif kind == 1:
        beat = int(rng.integers(4, 31))
        chosen[int(rng.integers(beat)) % length : length : beat] = True
    elif kind == 2:
        first = int(rng.integers(length))
        chosen[first : int(rng.integers(first, length)) + 1] = True
    else:
        chosen[: int(rng.integers(1, half + 1))] = True
        if kind == 4:
            chosen[length - int(rng.integers(1, half + 1)) : length] = True
    return chosen


def _trajectory(length: int, frames: int, rng: np.random.Generator) -> Flags:
    return some_frames(length, frames, 0.7, rng)[:, None] & mask("root_horizontal")


def _root(when: Flags, rng: np.random.Generator) -> Flags:
    """The root's four numbers, in all frames or in those of the joint; or not at all."""
    numbers = np.arange(WIDTH) < 4
    if rng.random() >= WITH_ROOT:
        return np.zeros((len(when), WIDTH), dtype=bool)
    return np.ones_like(when)[:, None] & numbers if rng.random() < 0.7 else when[:, None] & numbers


def _anything(length: int, frames: int, rng: np.random.Generator) -> Flags:
    kind = rng.random()
    if kind < 0.2:  # whole poses: places alone, or every number
        numbers = np.arange(WIDTH) < (WIDTH if rng.random() < 0.5 else LAYOUT["ric"].stop)
        return some_frames(length, frames, 0.0, rng)[:, None] & numbers
    if kind < 0.3:
        return some_frames(length, frames, 0.7, rng)[:, None] & mask(str(rng.choice(["lower_body", "upper_body"])))
    if kind < 0.4:
        return _trajectory(length, frames, rng)
    when = some_frames(length, frames, 0.5, rng)
    flags = _root(when, rng)
    for joint in rng.choice(np.arange(1, len(SMPL22)), size=int(rng.choice([1, 1, 2, 2, 3, 4, 8, 21])), replace=False):
        own = some_frames(length, frames, 0.5, rng) if rng.random() < 0.3 else when
        flags |= own[:, None] & mask(SMPL22.names[joint])
    return flags


HELD_WINDOW, HELD_ROWS = 80, 48
"""Frames and number of the held-out windows that are reported on."""


class ControlledNet(nn.Module):
    """A network in training that binds its condition and takes what is given, if it can, in one call."""

    def __init__(self, net: PriorNet | AdapterNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor, level: Tensor, cond: Condition, values: Tensor, mask: Tensor) -> Tensor:
        return self.net(x, level, show(self.net, self.net.bind(cond), values, mask))


class ControlledError(CleanError):
    """`CleanError` of states whose given numbers are free of noise; the masks of a step follow from (seed, step)."""

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`; ``net`` is a wrapped `ControlledNet`."""
        sample = self.sample(seed, step, rows)
        if self.recipe.spacing == "early":  # most levels near pure noise
            even = sample.level.double() / self.schedule.steps
            sample = sample._replace(level=(self.schedule.steps * (1 - (1 - even) ** 2)).round().long())
        rng = np.random.default_rng((seed, step, 2))
        clean, level, noise, cond = sample
        masks = draw_masks(self.recipe.control, cond.lengths.cpu().numpy(), clean.shape[1], rng=rng)
        mask = torch.from_numpy(masks).to(self.device)
        state = noised(self.schedule, clean, level, noise * ~mask)
        return self.error(net(state, level, cond, clean, mask), sample)


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
        captions = (n.texts[0] for n in clip.notes if n.kind == "human" and n.first <= first and n.texts)
        prompts.append(next(captions, ""))
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
        load_set(data, sources=recipe.sources, seed=recipe.seed, only=HUMANML3D), tensor(prior.mean), tensor(prior.std)
    )
    torch.manual_seed(recipe.seed)
    net = _trained(recipe, prior, world.device)
    batches = Batches(motions, windows=recipe.windows, shares=recipe.shares, favour=FAVOUR | recipe.favour)
    words = WordBank(text, motions.texts, progress=run.progress)
    alike = replace(recipe, early=0.0, heights=1.0)  # as published; levels go by the recipe's ``spacing``
    objective = ControlledError(net, prior.schedule, batches, words, alike, world.device)
    held = held_out(data, prior, recipe)

    def export(average: Average, step: int) -> None:
        weights = {k: v.cpu() for k, v in average.weights.items()}
        whole = _full(recipe, prior, motions, weights, step) if recipe.full else None
        if whole:
            save_prior(whole, run.place)
        else:
            _adapter(recipe, prior, motions, weights, step).save(run.place)
        if held:
            base = prior_module(prior)
            now = prior_module(whole) if whole else adapted(base, Adapter.load(run.place, prior))
            run.say(f"step {step}: {_report(held, now, base)}")

    count = sum(p.numel() for p in net.parameters())
    about = f"{count:,} trained parameters, {len(motions.items):,} described stretches"
    return run.run(objective, export, about, wrap=_wrap)


def _wrap(net: nn.Module) -> nn.Module:
    assert isinstance(net, PriorNet | AdapterNet)
    return ControlledNet(net)


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
    (known, free), (known0, free0) = held.errors(net), held.errors(base)
    return (
        f"held-out squared error, given numbers {known:.4f} (base network {known0:.4f}), "
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
