"""Training a prior from a recipe: the data, the network, the text encoder, and the weight file that comes out."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import BABEL, HUMANML3D
from motionloom.core.models.container import read_tensors
from motionloom.core.models.networks.text.known import Known, known_sentences
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.core.models.prior import (
    Card,
    Prior,
    find_weights,
    load_prior,
    save_prior,
)
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.batches import FAVOUR, Batches
from motionloom_train.data.clips import MEASURED
from motionloom_train.data.sets import MotionSet, load_set
from motionloom_train.loop import Average, Training
from motionloom_train.modules import prior_module, prior_session
from motionloom_train.modules import text_encoder as embedded
from motionloom_train.nets.prior import NetConfig, PriorNet
from motionloom_train.objectives import CleanError, Conditioned, WordBank
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import tensor

CAPTION_GROUPS = {"human": "captions that people wrote", "index": "descriptions of the collections"}
"""What the table calls the groups of items that are no single action."""


def known_table(motions: MotionSet, encoder: TextEncoder) -> Known:
    """The table of a set's sentences and of the seconds of each of its actions (groups of items).

    A named action and a measured label of one name are one action. Each is in the table with at least one sentence.
    Frames that several items of an action share count once; mirrored and other made copies count as more motion.
    """
    frames: dict[str, list[tuple[int, int]]] = {}
    texts: dict[str, dict[int, None]] = {}
    for item in motions.items:
        name = item.group.removeprefix(PREFIX).removeprefix(MEASURED)
        frames.setdefault(name, []).append((item.start, item.start + item.frames))
        texts.setdefault(name, {}).update(dict.fromkeys(item.texts))
    seconds = {group: _covered(spans) / motions.representation.fps for group, spans in frames.items()}
    groups = sorted(seconds, key=lambda group: (group in CAPTION_GROUPS, -seconds[group], group))
    numbers = dict.fromkeys(number for group in groups for number in texts[group])
    return known_sentences(
        [motions.texts[number] for number in numbers],
        {CAPTION_GROUPS.get(g, g): seconds[g] for g in groups},
        encoder,
        first=[motions.texts[next(iter(texts[group]))] for group in groups if texts[group]],
    )


def _covered(spans: list[tuple[int, int]]) -> int:
    """Frames in the union of half-open spans."""
    covered, reached = 0, 0
    for first, last in np.array(sorted(spans)):
        covered += max(0, int(last) - max(int(first), reached))
        reached = max(reached, int(last))
    return covered


def train_prior(run: Training, data: Path | str, text: TextEncoder) -> Path:
    """Train (or go on training) a prior on a built set; returns its weight file."""
    recipe, world = run.recipe, run.world
    motions = load_set(data, sources=recipe.sources, seed=recipe.seed)
    torch.manual_seed(recipe.seed)
    net = PriorNet(net_config(recipe, motions))
    teacher: nn.Module | None = None
    if recipe.start:
        start = load_start(recipe, net.config)
        module = prior_module(start)
        net.load_state_dict(module.state_dict())
        motions = restandardised(motions, tensor(start.mean), tensor(start.std))
        teacher = Conditioned(module.to(world.device)) if recipe.keep else None
    schedule = SCHEDULES[recipe.schedule](recipe.levels)
    motions = replace(motions, features=motions.features.to(world.device))
    batches = Batches(
        motions,
        windows=recipe.windows,
        shares=recipe.shares,
        favour=FAVOUR | recipe.favour,
        fresh=recipe.fresh,
        fresh_of=recipe.fresh_of,
    )
    words = WordBank(text, motions.texts, device=world.device, progress=run.progress)
    objective = CleanError(net, schedule, batches, words, recipe, world.device, teacher=teacher)
    known = known_table(motions, text)

    def export(average: Average, step: int) -> None:
        prior = replace(_prior(recipe, motions, average, step, text), known=known)
        save_prior(prior, run.place)
        if recipe.show_every and step % recipe.show_every == 0:
            _show(prior, recipe, run.folder / f"step_{step:07d}.png")

    capture = recipe.compile and world.size == 1 and world.device.startswith("cuda")

    def wrap(module: nn.Module) -> nn.Module:
        assert isinstance(module, PriorNet)
        model: nn.Module = Conditioned(module)
        # sentences have many lengths
        return torch.compile(model, dynamic=True) if recipe.compile and not capture else model  # type: ignore[return-value]

    about = (
        f"{sum(p.numel() for p in net.parameters()):,} parameters, {len(motions.items):,} described stretches, "
        f"{len(motions.texts):,} sentences, {motions.minutes:.0f} minutes recorded"
    )
    return run.run(objective, export, about, wrap=wrap, capture=capture)


def net_config(recipe: Recipe, motions: MotionSet) -> NetConfig:
    """The recipe's network, with as many numbers per frame as the set has where it does not say how many.

    Raises MotionloomError for a network, or for losses, that the set has not the numbers for.
    """
    kind = motions.representation
    config = NetConfig.parse({"features": kind.width, **recipe.net})
    if config.features != kind.width:
        raise MotionloomError(f"the recipe's network has net.features = {config.features}; this set has {kind}")
    if config.flags and motions.flags is None:
        raise MotionloomError("the recipe's net.flags reads where actions change, which this set does not say")
    if recipe.displacement and kind is not HUMANML3D:
        raise MotionloomError(f"the recipe's displacement is a loss of HumanML3D's numbers; this set has {kind}")
    if recipe.geometric and kind is not BABEL:
        raise MotionloomError(f"the recipe's geometric losses are of BABEL's numbers; this set has {kind}")
    return config


def load_start(recipe: Recipe, config: NetConfig) -> Prior:
    """The weights that a recipe goes on from; raises MotionloomError if they are not those it names, or of another
    network than ``config``."""
    path = find_weights(recipe.start)
    digest = sha256(path.read_bytes()).hexdigest()
    if recipe.start_sha256 and digest != recipe.start_sha256:
        raise MotionloomError(
            f"{path} has the SHA-256 {digest[:12]}..., and the recipe goes on from {recipe.start_sha256[:12]}...; name "
            "that file with --set start=FILE, or take any with --set start_sha256="
        )
    start = Prior.load(path)
    if replace(start.net.config, dropout=config.dropout) != config:
        raise MotionloomError(
            f"the recipe's network {config} is not that of {recipe.start!r}, {start.net.config}; copy its [net]"
        )
    return start


def restandardised(motions: MotionSet, mean: Tensor, std: Tensor) -> MotionSet:
    """The same motions under other statistics, (features,) each."""
    features = (motions.features * motions.std + motions.mean - mean) / std
    return replace(motions, features=features, mean=mean, std=std)


def text_encoder(weights: str) -> TextEncoder:
    """The text encoder inside a prior's weight file, or of a file that holds nothing but an encoder."""
    path = find_weights(weights)
    tensors, _ = read_tensors(path)
    if "vocabulary" in tensors:
        return embedded(tensors)
    return load_prior(path).text


def _prior(recipe: Recipe, motions: MotionSet, average: Average, step: int, text: TextEncoder) -> Prior:
    net = PriorNet(net_config(recipe, motions))
    net.load_state_dict({k: v.cpu() for k, v in average.weights.items()})
    notes: dict[str, Any] = {"steps": step, "recipe": recipe.name, "seed": recipe.seed}
    begun = {"start": recipe.start, "start_sha256": recipe.start_sha256}
    notes |= {"minutes": round(motions.minutes, 1)} | {key: value for key, value in begun.items() if value}
    card = Card(recipe.name, recipe.licence or "; ".join(motions.licences), "; ".join(motions.licences), notes)
    schedule = SCHEDULES[recipe.schedule](recipe.levels)
    mean, std = motions.mean.numpy(), motions.std.numpy()
    return Prior(prior_session(net), schedule, mean, std, text, card, motions.representation.fps)


def _show(prior: Prior, recipe: Recipe, path: Path) -> None:
    from motionloom.tasks.text import generate
    from motionloom.viz.video import draw_sheet

    draw_sheet(generate(prior, recipe.prompts, seconds=4.0), path, captions=recipe.prompts)
