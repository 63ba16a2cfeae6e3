"""Training a communication block on recordings of two people (Shafir et al. 2024, section 3.2), over a frozen prior.

One block learns three tasks: two people from a text; how both go on from a shared beginning, whose frames and places
are given free of noise, as published; and how one reacts to the other, who is given whole. The loss is over both
people's free numbers (published: one person's, over all of them), over the places D, and, where little noise leaves
them decided, over where each sees the other's pelvis, head and wrists (ours).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.goals.roles import without_two
from motionloom_train.data.pairs import Pair
from motionloom_train.duets import Crops, Duets, Sight
from motionloom_train.export import pair_graph
from motionloom_train.loop import STATE, Average, Training, compiled
from motionloom_train.modules import arrays, pair_module, prior_module
from motionloom_train.nets.pair import PLACE, PairConfig, PairNet, Talk, fitting, join, part
from motionloom_train.nets.prior import Condition
from motionloom_train.objectives import WordBank, displacement_error, feature_scale
from motionloom_train.recipe import Recipe, parse_table
from motionloom_train.tensors import noised, tensor

BEGUN, LONGEST_BEGUN, SHORTEST_BEGUN = 20, 40, 10
"""Frames of a given beginning: the commonest, the most and the fewest."""
HELD_FRAMES, HELD_ROWS = 80, 12
"""Frames of the held-out windows that are reported on, and how many are taken of each held-out pair."""


@dataclass(frozen=True)
class Settings:
    """The ``[pair]`` table of a recipe."""

    layers: int = 1
    split: int = -1
    """The block sits after so many layers of the prior; -1: after the last."""
    aware: bool = False
    dropout: float = 0.1
    prefix: float = 0.35
    """Share of the samples whose beginning is given."""
    react: float = 0.15
    """Share of the samples one of whose people is given; the others have a text alone."""
    silent: float = 0.5
    """Share of the former two without their text, which is optional there."""
    early: float = 0.5
    """Share of the samples at levels as samplers take them, most near pure noise; the others even (published)."""
    place: float = 1.0
    """Weight of the places D."""
    sight: float = 1.0
    """Weight of where the two see each other, at the cleanest levels."""
    faint: float = 0.25
    """How much of that weight is left near pure noise: there it is decided whether they stay together."""

    @staticmethod
    def parse(values: dict[str, Any]) -> "Settings":
        """From a recipe's table; raises MotionloomError for what there is not and for values out of range."""
        settings = parse_table(Settings, "[pair]", values)
        shares = (settings.prefix, settings.react, settings.silent, settings.early, settings.faint)
        total, weights = settings.prefix + settings.react, (settings.place, settings.sight)
        if not all(0 <= share <= 1 for share in (*shares, total)) or not all(0 <= w <= 1e3 for w in weights):
            raise MotionloomError("[pair] prefix, react, silent, early and faint are shares, place and sight weights")
        return settings

    def config(self, prior: Prior) -> PairConfig:
        """The block's sizes for a prior."""
        split = None if self.split < 0 else self.split
        config = fitting(prior.net.config, layers=self.layers, split=split, aware=self.aware)
        return replace(config, dropout=self.dropout)


class Sample(NamedTuple):
    """Samples of one step; rows 2k and 2k + 1 are two people."""

    clean: Tensor
    """(rows, 1 + frames, 263) states: D in the first slot, standardised frames behind it."""
    noise: Tensor
    known: Tensor
    """(rows, 1 + frames) bool: slots that are given, free of noise."""
    level: Tensor
    """(rows,) the same for both people."""
    cond: Condition
    lengths: Tensor
    """(rows,) valid frames, without the slot."""


class Parts(NamedTuple):
    """What an estimate costs."""

    motion: Tensor
    place: Tensor
    sight: Tensor
    displacement: Tensor


class PairError:
    """Squared error of the denoised estimate of two people: see `train.objectives.Objective`."""

    def __init__(
        self, net: PairNet, prior: Prior, duets: Duets, *, settings: Settings, recipe: Recipe, device: str = "cpu"
    ) -> None:
        self._net, self.schedule, self.duets = net, prior.schedule, duets
        self.settings, self.recipe, self.device = settings, recipe, device
        self.mean, self.std = tensor(prior.mean, device), tensor(prior.std, device)
        self.words = WordBank(prior.text, duets.texts, progress=lambda line: None)
        self.sight = Sight(net.talk.config.places)
        self.scale = feature_scale().to(self.mean)
        self.shares = settings.faint + (1 - settings.faint) * tensor(self.schedule.alpha_bar).to(self.mean)

    @property
    def net(self) -> nn.Module:
        """The trained weights: the block's."""
        return self._net

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`; rows: pairs."""
        sample = self.sample(seed, step, rows)
        return self.total(self.parts(self.denoised(net, sample), sample))

    def sample(self, seed: int, step: int, pairs: int) -> Sample:
        """What a step looks at, from ``(seed, step)`` alone."""
        rng = np.random.default_rng((seed, step))
        windows = self.recipe.windows
        window = int(rng.choice(windows, p=np.array(self.recipe.shares) / sum(self.recipe.shares)))
        return self.noised(rng, self.duets.draw(rng, window, pairs))

    def noised(self, rng: np.random.Generator, crops: Crops) -> Sample:
        """Crops with a task, a text or none, a level and noise each."""
        pairs, settings = len(crops.texts), self.settings
        frames = crops.features.shape[2]
        kind = rng.random(pairs)
        begun, react = kind < settings.prefix, (kind >= settings.prefix) & (kind < settings.prefix + settings.react)
        known = known_slots(rng, begun, react, crops.lengths, frames)
        dropped = np.where(begun | react, settings.silent, self.recipe.drop_text)
        keep = (rng.random(pairs) >= dropped) & (crops.texts > 0)
        at = rng.random(pairs)
        at = np.where(rng.random(pairs) < settings.early, 1 - (1 - at) ** 2, at)
        level = np.clip(np.ceil(at * self.schedule.steps), 1, self.schedule.steps).astype(np.int64)
        both = [torch.from_numpy(np.repeat(x, 2)) for x in (crops.lengths, crops.texts, keep, level)]
        lengths, texts, keeps, levels = (x.to(self.device) for x in both)
        cond = self.words.condition(texts.cpu(), lengths.cpu()).choose(keeps.cpu())
        places = self._net.talk.config.places.encode(crops.ground).flatten(0, 1)
        clean = join(places.to(self.mean), ((crops.features.to(self.mean) - self.mean) / self.std).flatten(0, 1))
        valid = torch.arange(frames, device=self.device) < lengths[:, None]
        clean[:, 1:] *= valid[..., None]
        noise = torch.from_numpy(rng.standard_normal(clean.shape, dtype=np.float32)).to(self.device)
        cond = Condition(*(x.to(self.device) for x in cond))
        return Sample(clean, noise, torch.from_numpy(known).to(self.device), levels, cond, lengths)

    def denoised(self, net: nn.Module, sample: Sample) -> Tensor:
        """The network's estimate of the clean states."""
        state = noised(self.schedule, sample.clean, sample.level, sample.noise * ~sample.known[..., None])
        return net(state, sample.level, self._net.bind(sample.cond))

    def parts(self, denoised: Tensor, sample: Sample) -> Parts:
        """What an estimate of the clean states costs; given slots are as they are given."""
        guess = torch.where(sample.known[..., None], sample.clean, denoised.float())
        valid = torch.arange(guess.shape[1] - 1, device=guess.device) < sample.lengths[:, None]
        free = valid & ~sample.known[:, 1:]
        error = ((guess - sample.clean) ** 2)[:, 1:]
        motion = _over_rows((error * self.scale).mean(-1), free)
        place = _over_rows(((guess - sample.clean) ** 2)[:, :1, :PLACE].mean(-1), ~sample.known[:, :1])
        (d0, x0), (d1, x1) = part(sample.clean), part(guess)
        sight = displacement = torch.zeros(())
        if self.settings.sight:
            away = self.sight.error(d1, x1 * self.std + self.mean, d0, x0 * self.std + self.mean)
            anyone = free | free.unflatten(0, (-1, 2)).flip(1).flatten(0, 1)
            sight = _over_rows(away * self.shares[sample.level][:, None], anyone)
        if self.recipe.displacement:
            displacement = displacement_error(x1, x0, sample.lengths, self.mean, self.std)
        return Parts(motion, place, sight, displacement)

    def total(self, parts: Parts) -> Tensor:
        """The loss."""
        total = parts.motion + self.settings.place * parts.place
        total = total + self.settings.sight * parts.sight
        return total + self.recipe.displacement * parts.displacement


def _over_rows(error: Tensor, free: Tensor) -> Tensor:
    """(rows, frames) twice: mean over the free frames of each row, then over the rows that have any."""
    count = free.sum(1)
    mean = (error * free).sum(1) / count.clamp(min=1)
    return mean.sum() / (count > 0).sum().clamp(min=1)


def known_slots(
    rng: np.random.Generator, begun: np.ndarray, react: np.ndarray, lengths: np.ndarray, frames: int
) -> np.ndarray:
    """(2 * pairs, 1 + frames) bool, what is given: D and a beginning of 10 to 40 frames (half of the time 20, and at
    most half of the window), or one person whole; begun, react (pairs,) bool, lengths (pairs,) valid frames."""
    pairs, slots = len(begun), np.arange(frames + 1)
    count = np.where(rng.random(pairs) < 0.5, BEGUN, rng.integers(SHORTEST_BEGUN, LONGEST_BEGUN + 1, pairs))
    count = np.minimum(count, lengths // 2)
    known = np.zeros((pairs, 2, frames + 1), dtype=bool)
    known |= (begun[:, None] & (slots <= count[:, None]))[:, None]
    known[np.arange(pairs), rng.integers(0, 2, pairs)] |= react[:, None] & (slots > 0) & (slots <= lengths[:, None])
    return known.reshape(2 * pairs, -1)


# Held-out pairs ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Report:
    """Errors of estimates on held-out pairs, at fixed windows, levels and noise."""

    loss: float
    motion: float
    """Squared, standardised and weighted, of the free numbers."""
    place: float
    """Squared, of D."""
    root: float
    """Metres on the ground from where a partner is seen to where that is estimated, mean over free frames."""

    def __str__(self) -> str:
        return f"motion {self.motion:.4f}, places {self.place:.4f}, partner {self.root:.3f} m off"


@dataclass(frozen=True, eq=False)
class Held:
    """Windows of pairs that no training saw."""

    objective: PairError
    sample: Sample

    @torch.no_grad()
    def report(self, net: PairNet) -> Report:
        """How well a block does on them."""
        denoised = self.objective.denoised(net.eval(), self.sample)
        parts, sample = self.objective.parts(denoised, self.sample), self.sample
        guess = torch.where(sample.known[..., None], sample.clean, denoised.float())
        mean, std = self.objective.mean, self.objective.std
        ways = [self.objective.sight.partner(d, x * std + mean) for d, x in (part(guess), part(sample.clean))]
        off = (ways[0] - ways[1])[..., 2:].norm(dim=-1)[~sample.known[:, 1:]].mean()
        return Report(float(self.objective.total(parts)), float(parts.motion), float(parts.place), float(off))


def held_out(objective: PairError, pairs: Sequence[Pair]) -> Held | None:
    """Windows of the pairs for validation; None where there are none."""
    pairs = [pair for pair in pairs if pair.split == "val"]
    frames = min([HELD_FRAMES, *(pair.frames - 1 for pair in pairs)])
    if not pairs:
        return None
    own = Duets(pairs, mirror=False, texts=objective.duets.texts)
    which = np.repeat(np.arange(len(pairs)), HELD_ROWS)
    starts = [np.linspace(0, pair.frames - 1 - frames, HELD_ROWS).round().astype(int) for pair in pairs]
    rng = np.random.default_rng(2)
    return Held(objective, objective.noised(rng, own.crops(which, np.concatenate(starts), frames)))


# A run ---------------------------------------------------------------------------------------------------------------


def train_pair(run: Training, pairs: Sequence[Pair]) -> Path:
    """Train (or go on training) a block for the prior ``start`` of the recipe; returns its weight file.

    That file holds the averaged weights of the saved step that did best on the pairs for validation (without such
    pairs the last), and ``folder/last.safetensors`` those of the last. A recipe's ``batch`` counts pairs.

    Raises MotionloomError for settings that cannot be, and pairs that are all too short, or all for tests, or that
    nobody described where a share of the samples has a text alone.
    """
    recipe, device = run.recipe, run.world.device
    settings = Settings.parse(recipe.pair)
    prior = Prior.load(recipe.start or "default")
    train = _usable([pair for pair in pairs if pair.split == "train"], recipe, settings)
    torch.manual_seed(recipe.seed)
    config = settings.config(prior)
    mean, std = tensor(prior.mean, device), tensor(prior.std, device)
    base, talk = prior_module(prior).to(device), Talk(config, prior.net.config).to(device)
    net = PairNet(base, talk, prior.schedule, mean=mean, std=std)
    objective = PairError(net, prior, Duets(train), settings=settings, recipe=recipe, device=device)
    seconds = sum(pair.frames for pair in train) / FPS
    about = f"{sum(p.numel() for p in net.parameters()):,} trained parameters, {len(train)} pairs of {seconds:.0f} s"
    export = _Export(run, prior, config, held_out(objective, pairs), train)
    return run.run(objective, export, about, wrap=compiled(recipe, dynamic=True))


def _usable(pairs: Sequence[Pair], recipe: Recipe, settings: Settings) -> list[Pair]:
    if not pairs:
        raise MotionloomError("no pair is for training; give pairs of the split train")
    shortest = min(recipe.windows)
    long = [pair for pair in pairs if pair.frames > shortest]
    if not long:
        frames = max(pair.frames for pair in pairs)
        raise MotionloomError(
            f"the longest pair to train on has {frames} frames at 20 per second, and the recipe's shortest window "
            f"needs {shortest + 1}; give the recipe shorter windows, or longer pairs"
        )
    if settings.prefix + settings.react < 1 and not any(pair.captions for pair in long):
        raise MotionloomError(
            "no pair says what its people do; write captions.txt, or learn completion alone with pair.prefix=1 and "
            "pair.react=0"
        )
    return long


class _Export:
    """Writes the weights at every save, and those that do best on the held-out pairs under the run's name."""

    def __init__(
        self, run: Training, prior: Prior, config: PairConfig, held: Held | None, pairs: Sequence[Pair]
    ) -> None:
        self.run, self.prior, self.config, self.held = run, prior, config, held
        self.licences = "; ".join(sorted({pair.licence for pair in pairs}))
        self.names = [pair.name for pair in pairs]
        texts = [without_two(text) for pair in pairs for text in pair.captions]
        self.known = known_sentences(texts, {}, prior.text) if texts else None
        self.digest = fingerprint(prior.net)
        going_on = (run.folder / STATE).is_file() and run.place.is_file()
        self.best = _loss_of(PairBlock.load(run.place, prior)) if going_on and held else float("inf")
        self.fresh = held.report(pair_module(self._block({}, 0), prior)) if held else None

    def __call__(self, average: Average, step: int) -> None:
        weights = {key.removeprefix("talk."): value.cpu().numpy() for key, value in average.weights.items()}
        block = self._block(weights, step)
        now = self.held.report(pair_module(block, self.prior)) if self.held else None
        if now:
            block.notes.update(held_out=asdict(now), fresh=asdict(self.fresh) if self.fresh else {})
        block.save(self.run.folder / "last.safetensors")
        better = now is None or now.loss < self.best
        if better:
            self.best = now.loss if now else self.best
            block.save(self.run.place)
        if now:
            best = " (the best so far)" if better else ""
            self.run.say(f"step {step}: held-out pairs: loss {now.loss:.4f}, {now}; fresh block: {self.fresh}{best}")

    def _block(self, weights: dict[str, np.ndarray], step: int) -> PairBlock:
        recipe = self.run.recipe
        weights = weights or arrays(Talk(self.config, self.prior.net.config))
        notes = {"steps": step, "batch": recipe.batch, "seed": recipe.seed, "pairs": self.names}
        return PairBlock(
            recipe.name,
            self.config,
            weights,
            self.prior.card.name,
            self.digest,
            recipe.licence or self.licences,
            self.licences,
            notes,
            pair_graph(self.config, self.prior.net.config),
            self.known,
        )


def _loss_of(block: PairBlock) -> float:
    held = block.notes.get("held_out")
    return float(held["loss"]) if isinstance(held, dict) and "loss" in held else float("inf")
