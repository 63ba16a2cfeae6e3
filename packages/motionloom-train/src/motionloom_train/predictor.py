"""Training a predictor: windows of recordings, what the condition shows of them, and the weight file that comes out.

Variant `published` is HumanMAC's training (Chen et al. 2023, section 3.2): noise prediction on raw spectra, the padded
observation as the condition of four samples in five (one coin per sample; the published code throws one per batch).
Variant `masked` trains one network for every mask: most rows are given a past, some also the end of the window, some
joints or the root's path in the future.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from motionloom.core.diffusion import SCHEDULES, Dct, Frames
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import Place
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.predictor import Predictor, condition_shape, find_predictor, load_predictor, save_predictor
from motionloom.core.models.prior import Card
from motionloom_train.data.prediction import Protocol, Recording
from motionloom_train.loop import Average, Training, compiled
from motionloom_train.modules import predictor_module, predictor_session
from motionloom_train.nets.predictor import TransLinear
from motionloom_train.recipe import Recipe, parse_table
from motionloom_train.tensors import noised, number_of, tensor

WHOLE_PAST = 0.75
"""How often all of the past is given; else its last 2 frames or more."""
KINDS = {"past": 0.6, "end": 0.15, "joints": 0.1, "path": 0.05, "scattered": 0.1}
"""How often what is given, variant `masked`: the past alone; also the window's end; some joints in all of the future;
the root's path in the future; some joints in some stretches."""
STATISTICS = 4096
"""Windows that mean and spread are measured on."""
HELD = 256
"""Held-out windows of a report."""


@dataclass(frozen=True)
class Settings:
    """The ``[predictor]`` table of a recipe."""

    variant: Literal["published", "masked"] = "masked"
    kept: int = 24
    """Frequencies."""
    dct: bool = True
    """False: frames themselves are the tokens (the paper's table 7)."""
    layers: int = 8
    width: int = 256
    heads: int = 8
    dropout: float = 0.1
    condition_dropout: float = 0.1
    """Share of samples without a condition (published: 0.2)."""
    smoothed: float = 0.0
    """Share of samples whose past is given smoothed, as the network's own results are: else it takes their
    smoothness for calm, and long motions come to rest."""

    @staticmethod
    def parse(values: dict[str, Any]) -> "Settings":
        """From a recipe's table; raises MotionloomError for what there is not and for values of the wrong kind."""
        settings = parse_table(Settings, "[predictor]", values)
        shares = 0 <= settings.condition_dropout < 1 and 0 <= settings.smoothed <= 1
        if settings.variant not in ("published", "masked") or not shares:
            raise MotionloomError(
                "[predictor] variant is 'published' or 'masked', condition_dropout and smoothed are shares"
            )
        if not 1 <= settings.kept <= 8192:
            raise MotionloomError("[predictor] kept is a number of frequencies, from 1 to the frames of a window")
        return settings


class Sample(NamedTuple):
    """Windows of one step."""

    features: np.ndarray
    """(rows, frames, channels) float32."""
    context: np.ndarray
    """The same as the condition shows it: some pasts are smoothed."""
    pose: np.ndarray
    """(rows, channels) the last observed pose."""
    mask: np.ndarray
    """(rows, frames, parts) 1 where it is given."""


class Windows:
    """Random windows of recordings; recordings are sampled by the root of their length, windows in them evenly."""

    def __init__(
        self, recordings: tuple[Recording, ...], protocol: Protocol, *, variant: str, smoothed: float = 0.0
    ) -> None:
        long = [r.positions for r in recordings if len(r.positions) >= protocol.frames]
        if not long:
            raise MotionloomError(f"no recording to train on has the {protocol.frames} frames of a window")
        self.protocol, self.layout, self.variant, self.smoothed = protocol, protocol.layout, variant, smoothed
        self.positions = np.concatenate(long)
        self.lengths = np.array([len(p) for p in long])
        self.starts = np.cumsum(self.lengths) - self.lengths
        self.shares = np.sqrt(self.lengths) / np.sqrt(self.lengths).sum()

    def draw(self, seed: int, step: int, rows: int) -> Sample:
        """Windows, mirrored half of the time, and what is given of them; from ``(seed, step)`` alone."""
        rng = np.random.default_rng((seed, step))
        frames, layout = self.protocol.frames, self.layout
        which = rng.choice(len(self.lengths), rows, p=self.shares)
        first = self.starts[which] + rng.integers(0, self.lengths[which] - frames + 1)
        places = self.positions[first[:, None] + np.arange(frames)].astype(np.float64)
        flipped = rng.random(rows) < 0.5
        places[flipped] = layout.mirrored(places[flipped])
        past = self._pasts(rng, rows)
        evidence = self._smoothed(np.random.default_rng((seed, step, 3)), places, past) if self.smoothed else places
        place = self._place(rng, evidence[np.arange(rows), past - 1])
        features, context = layout.encode(places, place), layout.encode(evidence, place)
        mask = np.stack([self._mask(rng, int(h)) for h in past])
        pose = context[np.arange(rows), past - 1]
        arrays = (features, context, pose, mask)
        return Sample(*(np.ascontiguousarray(x, dtype=np.float32) for x in arrays))

    def _smoothed(
        self, rng: np.random.Generator, places: NDArray[np.float64], past: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Windows (rows, frames, joints, 3), in some of them the past frames smoothed by a Gaussian of up to 0.1 s."""
        result = places.copy()
        for row in np.flatnonzero(rng.random(len(places)) < self.smoothed):
            h, width = past[row], rng.uniform(0.02, 0.1) * self.protocol.fps
            reach = int(np.ceil(3 * width))
            kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
            known = places[row, :h]
            ahead, behind = known[-1] - known[-2], known[1] - known[0]
            steps = np.arange(1, reach + 1)[:, None, None]
            longer = np.concatenate([known[0] - steps[::-1] * behind, known, known[-1] + steps * ahead])
            spread = np.lib.stride_tricks.sliding_window_view(longer, len(kernel), axis=0)
            result[row, :h] = spread @ (kernel / kernel.sum())
        return result

    def _pasts(self, rng: np.random.Generator, rows: int) -> NDArray[np.int64]:
        whole = np.full(rows, self.protocol.observed)
        if self.variant == "published":
            return whole
        return np.where(rng.random(rows) < WHOLE_PAST, whole, rng.integers(2, self.protocol.observed + 1, rows))

    def _place(self, rng: np.random.Generator, last: NDArray[np.float64]) -> Place:
        """The origin and heading of the window; seen from anywhere where the layout does not turn the person itself."""
        place = self.layout.place(last)
        if self.layout.across:
            return place
        turn = np.where(rng.random(len(last)) < 0.5, rng.uniform(0, 2 * np.pi, len(last)), 0.0)
        return Place(place.origin, turn)

    def _mask(self, rng: np.random.Generator, past: int) -> NDArray[np.float32]:
        frames, parts = self.protocol.frames, self.layout.parts
        mask = np.zeros((frames, parts), dtype=np.float32)
        mask[:past] = 1
        kind = "past" if self.variant == "published" else rng.choice(list(KINDS), p=list(KINDS.values()))
        if kind == "end":
            mask[
                frames - rng.integers(1, max(2, (frames - past) * 2 // 3)) :, rng.random() < 0.5 and self.layout.root :
            ] = 1
        elif kind == "joints":
            mask[past:, rng.choice(parts, rng.integers(1, parts), replace=False)] = 1
        elif kind == "path" and self.layout.root:
            mask[past:, 0] = 1
        elif kind == "scattered":
            for _ in range(rng.integers(1, 4)):
                a, b = np.sort(rng.integers(past, frames + 1, 2))
                mask[a:b, rng.choice(parts, rng.integers(1, parts + 1), replace=False)] = 1
        return mask


class Completion:
    """Mean squared error of the network's estimate at a uniformly drawn level."""

    def __init__(
        self, net: nn.Module, predictor: Predictor, windows: Windows, *, condition_dropout: float, device: str = "cpu"
    ) -> None:
        """net: the module that is trained; of the predictor everything else is read."""
        self.net, self.predictor, self.windows = net.to(device), predictor, windows
        self.condition_dropout, self.device = condition_dropout, device
        scale = predictor.std if predictor.variant == "masked" else np.ones_like(predictor.std)
        self.scale = tensor(scale / scale.mean(), device)

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`: the noise's error (published, 1 at first), or the clean spectrum's.

        The latter is standardised and weighted by its spread, between metres and equal weights for all frequencies.
        """
        p, sample = self.predictor, self.windows.draw(seed, step, rows)
        generator = torch.Generator().manual_seed(number_of(seed, step))
        low = 2 if p.variant == "published" else 1  # the published code never trains its first noisy level
        level = torch.randint(low, p.schedule.steps + 1, (rows,), generator=generator).to(self.device)
        clean = tensor(p.to_state(sample.features, sample.pose), self.device)
        noise = torch.randn(clean.shape, generator=generator).to(self.device)
        keep = (torch.rand(rows, generator=generator) >= self.condition_dropout).to(self.device)
        condition = tensor(p.condition(sample.context, sample.mask, sample.pose), self.device)
        predicted = net(noised(p.schedule, clean, level, noise), level - 1, condition, keep)
        target = noise if p.variant == "published" else clean
        return ((predicted.float() - target) ** 2 * self.scale).mean()


def new_predictor(protocol: Protocol, settings: Settings, windows: Windows, *, schedule: str, levels: int) -> Predictor:
    """An untrained predictor for a protocol's windows, with their statistics."""
    layout, frames = protocol.layout, protocol.frames
    if settings.dct and settings.kept > frames:
        raise MotionloomError(f"[predictor] kept is {settings.kept}, and a window has {frames} frames; keep fewer")
    basis = Dct(frames, settings.kept) if settings.dct else Frames(frames)
    count = basis.kept
    condition = condition_shape(layout, count) if settings.variant == "masked" else None
    config = PredictorConfig(
        layout.channels,
        count,
        settings.layers,
        settings.width,
        settings.heads,
        settings.dropout,
        condition,
        condition is not None,
    )
    sample = windows.draw(2**31 - 1, 0, STATISTICS)
    pose = np.stack([sample.pose.mean(0), sample.pose.std(0, ddof=1).clip(min=1e-3)])
    plain = np.zeros((count, layout.channels), np.float32)
    predictor = Predictor(
        predictor_session(TransLinear(config)),
        SCHEDULES[schedule](levels),
        layout,
        basis,
        protocol.observed,
        protocol.fps,
        settings.variant,
        plain,
        np.ones_like(plain),
        pose,
        Card("predictor"),
    )
    if settings.variant == "published":
        return predictor
    state = predictor.to_state(sample.features, sample.pose)
    return replace(predictor, mean=state.mean(0), std=state.std(0, ddof=1).clip(min=1e-4))


def train_predictor(run: Training, protocol: Protocol) -> Path:
    """Train (or go on training) a predictor on a data set; returns its weight file.

    Raises MotionloomError for settings that cannot be and data too short for one window.
    """
    recipe, device = run.recipe, run.world.device
    settings = Settings.parse(recipe.predictor)
    windows = Windows(protocol.split("train"), protocol, variant=settings.variant, smoothed=settings.smoothed)
    torch.manual_seed(recipe.seed)
    if recipe.start:
        predictor = load_predictor(find_predictor(recipe.start))
        if predictor.layout != protocol.layout or predictor.frames != protocol.frames:
            raise MotionloomError(
                f"{recipe.start} sees other joints or windows than the data; train from random weights"
            )
    else:
        predictor = new_predictor(protocol, settings, windows, schedule=recipe.schedule, levels=recipe.levels)
    net = predictor_module(predictor).requires_grad_(True)
    minutes = windows.lengths.sum() / protocol.fps / 60
    dropout = settings.condition_dropout
    objective = Completion(net, predictor, windows, condition_dropout=dropout, device=device)
    held = _held(protocol, settings)

    def export(average: Average, step: int) -> None:
        result = _finished(predictor, recipe, protocol, average, step=step, minutes=minutes)
        save_predictor(result, run.place)
        if held is not None:
            run.say(f"step {step}: held-out loss {_held_loss(result, held, settings):.4f}")

    about = f"{sum(p.numel() for p in net.parameters()):,} parameters, {minutes:.0f} minutes recorded"
    return run.run(objective, export, about, wrap=compiled(recipe))


def _held(protocol: Protocol, settings: Settings) -> Windows | None:
    try:
        return Windows(protocol.split("val"), protocol, variant=settings.variant)
    except MotionloomError:
        return None


@torch.no_grad()
def _held_loss(predictor: Predictor, held: Windows, settings: Settings) -> float:
    net = predictor_module(predictor)
    return float(Completion(net, predictor, held, condition_dropout=settings.condition_dropout).loss(net, 0, 0, HELD))


def _finished(
    predictor: Predictor, recipe: Recipe, protocol: Protocol, average: Average, *, step: int, minutes: float
) -> Predictor:
    net = TransLinear(predictor.net.config)
    net.load_state_dict({k: v.cpu() for k, v in average.weights.items()})
    count = len({r.subject for r in protocol.split("train")})
    notes = {"steps": step, "batch": recipe.batch, "seed": recipe.seed, "minutes": round(float(minutes), 1)}
    notes |= {"data": protocol.name, "subjects": count, "from": Path(recipe.start).stem}
    card = Card(recipe.name, recipe.licence or protocol.licence, protocol.licence, notes)
    return replace(predictor, net=predictor_session(net), card=card)
