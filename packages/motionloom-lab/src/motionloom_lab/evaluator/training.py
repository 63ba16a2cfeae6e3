"""Training the own evaluator: the contrastive objective, and the file that comes out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import LAYOUT
from motionloom.core.features.representation import HUMANML3D
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom_lab.evaluator.net import (
    Embedder,
    EvaluatorConfig,
    EvaluatorNet,
    inputs,
    save_embedder,
    standardised,
    text_digest,
)
from motionloom_lab.evaluator.pairs import Pairs, negatives, senses
from motionloom_train.loop import Average, Training
from motionloom_train.objectives import WordBank
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import number_of

SHARPEST = 4.6
"""Logarithm: the temperature does not go below 0.01."""
BLOCKS = (slice(0, 1), slice(1, 3), slice(3, 4), LAYOUT["ric"], slice(67, 133), slice(133, 135), slice(135, 137))
"""Of the inputs of HumanML3D's numbers: each block has one spread, as in the published statistics."""
FORGET = 0.1
"""Share of word pieces that a training step does not see."""


class Contrast:
    """Symmetric InfoNCE (van den Oord et al. 2018; Radford et al. 2021) with filtered negatives (TMR, section 3.3).

    Each sentence picks its motion among the batch's and, where there is one, the contrary of its motion (mirrored or
    run backwards); each motion its sentence among the batch's and the contrary of its sentence.
    """

    def __init__(
        self, net: EvaluatorNet, pairs: Pairs, words: WordBank, mean: Tensor, std: Tensor, *, device: str = "cpu"
    ) -> None:
        self.net, self.pairs, self.words, self.device = net, pairs, words, device
        self.mean, self.std = mean.to(device), std.to(device)
        self.directions = senses(pairs.texts)

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `Objective.loss`."""
        batch = self.pairs.draw(seed, step, rows)
        condition = self.words.condition(batch.texts, batch.lengths[:1].expand(len(batch.texts)))
        generator = torch.Generator().manual_seed(number_of(seed, step))
        keep = condition.words & (torch.rand(condition.words.shape, generator=generator) >= FORGET)
        keep[:, 0] = True
        lengths = batch.lengths.to(self.device)
        x = standardised(inputs(batch.features.to(self.device), lengths), lengths, self.mean, self.std)
        motions, texts = net(x, lengths, condition.tokens.to(self.device), keep.to(self.device))
        allowed = negatives(batch, self.words.pooled, self.directions).to(self.device)
        sharpness = self.net.sharpness.clamp(max=SHARPEST).exp()
        hard_motion, hard_text = batch.hard_motion.to(self.device), batch.hard_text.to(self.device)
        with torch.autocast(torch.device(self.device).type, enabled=False):
            motion, text = motions[:rows].float(), texts[:rows].float()
            from_text = contrast(text * sharpness, motion, motions[rows:].float(), hard_motion, allowed)
            from_motion = contrast(motion * sharpness, text, texts[rows:].float(), hard_text, allowed.T)
            own = torch.arange(rows, device=self.device)
            return (F.cross_entropy(from_text, own) + F.cross_entropy(from_motion, own)) / 2


def contrast(ask: Tensor, answer: Tensor, hard: Tensor, owner: Tensor, allowed: Tensor) -> Tensor:
    """Products (rows, rows + 1): each asking row with all answers, -inf where not allowed, and with its contrary.

    ask, answer: (rows, width) that belong together row by row; hard: (some, width), ``owner`` says whose they are.
    """
    rows = len(ask)
    own = torch.eye(rows, dtype=torch.bool, device=ask.device)
    main = (ask @ answer.T).masked_fill(~(allowed | own), float("-inf"))
    last = torch.full((rows,), float("-inf"), device=ask.device)
    last = last.index_put((owner,), (ask[owner] * hard).sum(-1))
    return torch.cat([main, last[:, None]], dim=1)


def input_statistics(pairs: Pairs, *, seed: int) -> tuple[Tensor, Tensor]:
    """Mean (inputs,) and spread, one per block of HumanML3D's, of what is read of at most 1500 windows of the set."""
    rng = np.random.default_rng(seed)
    parts = []
    for number in rng.integers(len(pairs.data.items), size=min(1500, 20 * len(pairs.data.items))):
        window = torch.from_numpy(pairs.window(pairs.data.items[number], rng))[None].double()
        parts.append(inputs(window, torch.tensor([window.shape[1]]))[0])
    frames = torch.cat(parts)
    mean, std = frames.mean(0), frames.std(0)
    for block in BLOCKS if pairs.data.representation is HUMANML3D else ():
        std[block] = std[block].mean()
    return mean.float(), std.clamp(min=1e-4).float()


def train_evaluator(run: Training, data: Path | str, text: TextEncoder) -> Path:
    """Train (or go on training) an evaluator on a built set; returns its file."""
    recipe, device = run.recipe, run.world.device
    text_digest(text)
    pairs = Pairs.load(data, sources=recipe.sources, seed=recipe.seed)
    config = replace(config_of(recipe, text), representation=pairs.data.representation.name)
    torch.manual_seed(recipe.seed)
    net = EvaluatorNet(config)
    mean, std = input_statistics(pairs, seed=recipe.seed)
    words = WordBank(text, pairs.texts, room=64, progress=run.progress)
    objective = Contrast(net, pairs, words, mean, std, device=device)
    about = (
        f"{sum(p.numel() for p in net.parameters()):,} parameters of {config.inputs} inputs, {len(pairs.data.items):,} "
        f"described stretches, {len(pairs.texts):,} sentences, {pairs.data.minutes:.0f} minutes recorded"
    )

    def export(average: Average, step: int) -> None:
        result = EvaluatorNet(config)
        result.load_state_dict({k: v.cpu() for k, v in average.weights.items()})
        licences = "; ".join(pairs.data.licences)
        how = f"recipe {recipe.name}, {step} steps of {recipe.batch} pairs, seed {recipe.seed}"
        card = {"name": recipe.name, "licence": recipe.licence or licences, "data": licences, "made": how}
        save_embedder(Embedder(result.eval(), mean, std, text, card), run.place)

    return run.run(objective, export, about)


def config_of(recipe: Recipe, text: TextEncoder) -> EvaluatorConfig:
    """The sizes that the recipe's [net] names, of those that an evaluator has."""
    known = {"width", "layers", "heads", "hidden", "text", "dropout"}
    if unknown := sorted(recipe.net.keys() - known):
        raise MotionloomError(f"an evaluator's [net] has no {unknown[0]!r}; it has {', '.join(sorted(known))}")
    config = EvaluatorConfig(**recipe.net)
    if config.text != text.width:
        raise MotionloomError(f"the recipe reads texts of width {config.text}; the text encoder gives {text.width}")
    return config
