"""Teaching a prior an action or a style from a few clips: a low-rank adapter, and what was known stays.

A step sees two kinds of rows. Some show a clip, with its caption, and cost what a clip costs in training a prior. The
others show what the prior itself generates for sentences it knows, some of them without their sentence, and cost what
the changed network's estimate differs from the unchanged one's (learning without forgetting, Li & Hoiem 2016; prior
preservation, Ruiz et al. 2023). Since nothing is taught without words, guidance strengthens what was taught.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from tempfile import TemporaryDirectory

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.core.arrays import unit
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS, LAYOUT, WIDTH
from motionloom.core.models.adapter import TAUGHT, Adapter, origin
from motionloom.core.models.networks.text.known import bare
from motionloom.core.models.prior import Prior
from motionloom.requests.fields import declare, like
from motionloom.requests.teach import Teach
from motionloom.tasks.text import sample_features
from motionloom_train.data.examples import Example
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.words import LABELS, imperative
from motionloom_train.loop import Average, World, train
from motionloom_train.low_rank import AdapterNet, tensors_of
from motionloom_train.modules import prior_module
from motionloom_train.nets.prior import Condition
from motionloom_train.objectives import Conditioned, WordBank, displacement_error, feature_scale, masked_error
from motionloom_train.precision import CHOICES, choose
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import find_device, noised, number_of, tensor

WINDOWS, SHARES = (60, 100, 160, 196), (0.2, 0.4, 0.25, 0.15)
"""Frames of the windows that a step sees, and how often."""
DRAWS, DRAWN_FRAMES, DRAWN_STEPS = 96, 100, 12
"""Motions that the prior generates of what it knows, their frames and the steps each takes."""
OTHERS, FAR = 2000, 0.9
"""Known sentences besides those of these motions. Above this share of the levels, where hardly anything of a motion
is left and it is decided what will be shown, one of these is kept instead of the motion's own."""
UNLIKE = 0.6
"""Cosine under which they must be to what is taught, so that other words for it may change as well."""
KEEP_WEIGHT = 2.0
"""How much their error counts."""
SILENT = 0.25
"""Share of those without their sentence."""
SAME = 0.9
"""Cosine of vectors from which on a known sentence means what is taught, and is not kept as it was."""
LIKE = 16
"""Known sentences that are likest to what is taught: they are kept in any case."""
AGAIN = 0.5
"""A pose is the first one again if it is this near to it, beside the median distance of the clip's poses."""
APART = 8
"""Frames on each side among which it is the nearest."""
BEFORE = 16
"""Frames of a held pose that a window shows at most before a short clip begins."""
DISPLACEMENT = 0.5
"""Weight of `displacement_error`, which keeps planted feet in their places."""

_WHOLE = re.compile(r"(an?|the|he|she|they|my|our|his|her|some\w*|[a-z]+ing)\b")
"""How a known sentence begins that needs no subject before it."""


@dataclass(frozen=True, kw_only=True)
class Lesson(Teach):
    """How something is taught: the request, and how it is trained."""

    name: str = like(Teach, "name", default="adapter")
    amp: str = like(Teach, "amp", words=CHOICES)
    batch: int = declare("whole", "rows of a step", 16, low=2, high=1024)
    rate: float = declare("number", "learning rate", 1e-3, low=1e-6, high=0.1)


def teach(
    prior: Prior,
    examples: Sequence[Example],
    lesson: Lesson | None = None,
    *,
    device: str = "cpu",
    say: Say = silent,
) -> Adapter:
    """An adapter that makes ``prior`` show what the examples show for their captions.

    device: PyTorch's, that is taught on; motions are sampled where the prior is.
    The same seed teaches the same on the same machine with as many threads and the same `Lesson.amp`, which the
    adapter's notes have. Raises `MotionloomError` where there is nothing to learn from, and for a prior that does not
    generate 263 numbers a frame at 20 per second.
    """
    find_device(device)
    lesson = lesson or Lesson()
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers a frame at {prior.fps:g} fps; those of {WIDTH} at {FPS:g} "
            "fps can be taught"
        )
    if not examples:
        raise MotionloomError("there is no clip; give at least one to learn from")
    captions = list(dict.fromkeys(text for example in examples for text in example.captions))
    prompts, others = known_prompts(prior, captions, lesson.seed)
    say(f"drawing {len(prompts)} motions that are known already")
    motions = sample_features(
        prior,
        prompts,
        [DRAWN_FRAMES] * len(prompts),
        seeds=[lesson.seed + i for i in range(len(prompts))],
        steps=DRAWN_STEPS,
    )
    torch.manual_seed(lesson.seed)
    net = AdapterNet(prior_module(prior), lesson.rank, given_rank=0, taught=True)
    amp = lesson.amp
    if amp == "auto":
        amp, why = choose(net, device)
        say(why)
    known = list(zip(prompts, motions, strict=True))
    objective = Teaching(net, prior, examples, known, others, keep=lesson.keep, device=device)
    recipe = Recipe(
        name=lesson.name,
        steps=lesson.steps,
        batch=lesson.batch,
        rate=lesson.rate,
        seed=lesson.seed,
        warmup=40,
        cooldown=0.5,
        ema=0.99,
        decay=0.0,
        save_every=lesson.steps,
        amp=amp,
    )
    with TemporaryDirectory(prefix="motionloom-teach-") as folder:
        progress = _progress(lesson, say)
        average = train(objective, recipe, folder, world=World(device=device), wrap=_wrap, on_step=progress, say=say)
    return _adapter(prior, examples, captions, replace(lesson, amp=amp), average)


def known_prompts(prior: Prior, captions: Sequence[str], seed: int) -> tuple[list[str], list[str]]:
    """`DRAWS` sentences that the prior knows and that do not mean what ``captions`` mean; up to `OTHERS` further ones.

    Of the former those that are likest to the captions come first: from them the new action must be distinguished. The
    latter are unlike the captions. The sentences are those of the prior's file, or of measured labels where it has
    none.
    """
    rng = np.random.default_rng((seed, 17))
    pool = list(prior.known.sentences) if prior.known else [phrase for phrases in LABELS.values() for phrase in phrases]
    vectors = prior.text.encode([bare(text) for text in pool]).pooled if not prior.known else prior.known.vectors
    target = prior.text.encode([bare(text) for text in captions]).pooled
    like = (unit(vectors) @ unit(target).T).max(1)
    order = [int(i) for i in (-like).argsort(stable=True) if like[i] < SAME]
    if not order:
        raise MotionloomError("these weights know no other sentences than the captions; describe the clips otherwise")
    rest = rng.permutation(order[LIKE:]).tolist()
    chosen = [*order[:LIKE], *rest]
    chosen = [chosen[i % len(chosen)] for i in range(DRAWS)]
    others = [i for i in rest if like[i] < UNLIKE][:OTHERS]
    sentences = [text if _WHOLE.match(text) else f"a person {text}" for text in pool]
    return [sentences[i] for i in chosen], [sentences[i] for i in others]


def wordings(caption: str) -> tuple[str, ...]:
    """A caption in a few other words that mean the same: another subject, a command."""
    action = bare(caption)
    if action == " ".join(caption.lower().split()).strip(" .!?"):  # its subject, if any, is part of what is taught
        return (caption,)
    return (caption, caption, f"a person {action}", f"someone {action}", f"a man {action}", action, imperative(action))


class Teaching:
    """What a step of teaching minimises; see the module. What a step sees follows from (seed, step)."""

    def __init__(
        self,
        net: AdapterNet,
        prior: Prior,
        examples: Sequence[Example],
        known: Sequence[tuple[str, np.ndarray]],
        others: Sequence[str] = (),
        *,
        keep: float,
        device: str = "cpu",
    ) -> None:
        self.net, self.schedule, self.base = net, prior.schedule, prior_module(prior).to(device)
        self.keep, self.device = keep, device
        self.mean, self.std = tensor(prior.mean, device), tensor(prior.std, device)
        self.examples = examples
        features = [((e.features - prior.mean) / prior.spread).astype(np.float32) for e in examples]
        self.features = [tensor(one, device) for one in features]
        self.begins = [_beginnings(e, one) for e, one in zip(examples, features)]
        self.known = torch.stack([tensor((f - prior.mean) / prior.spread, device) for _, f in known])
        texts = dict.fromkeys(text for e in examples for caption in e.captions for text in wordings(caption))
        texts |= dict.fromkeys([*(prompt for prompt, _ in known), *others])
        self.numbers = {text: number for number, text in enumerate(texts)}
        self.prompts = [self.numbers[prompt] for prompt, _ in known]
        self.others = [self.numbers[prompt] for prompt in others]
        self.words = WordBank(prior.text, tuple(texts), progress=lambda line: None)
        self.scale = feature_scale().to(self.device)

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> Tensor:
        """See `motionloom_train.objectives.Objective`."""
        rng = np.random.default_rng((seed, step))
        window = int(rng.choice(WINDOWS, p=SHARES))
        own = rows - min(round(self.keep * rows), rows - 1)
        clean, texts, lengths = self._rows(rng, window, rows, own)
        generator = torch.Generator().manual_seed(number_of(seed, step))
        even = torch.rand(rows, generator=generator, dtype=torch.float64)
        level = (self.schedule.steps * (1 - even**2)).ceil().long().clamp(1, self.schedule.steps)  # as samplers go
        noise = torch.randn(clean.shape, generator=generator).to(clean)
        for row in range(own, rows if self.others else 0):
            if level[row] > FAR * self.schedule.steps:
                texts[row] = int(rng.choice(self.others))
        speaks = torch.ones(rows, dtype=torch.bool)
        speaks[own:] = torch.rand(rows - own, generator=generator) >= SILENT
        cond = self.words.condition(torch.tensor(texts), torch.tensor(lengths)).choose(speaks)
        cond = Condition(*(part.to(self.device) for part in cond))
        state = noised(self.schedule, clean, level, noise)
        denoised, before = net(state, level, cond), clean[own:]
        if own < rows:
            with torch.no_grad():
                old = Condition(*(part[own:] for part in cond))
                before = self.base(state[own:], level[own:], self.base.bind(old))
        return self._error(denoised, clean, before, cond.lengths, own)

    def _rows(self, rng: np.random.Generator, window: int, rows: int, own: int) -> tuple[Tensor, list[int], list[int]]:
        """Windows (rows, window, 263), first those of examples, then what the prior drew; their texts and lengths."""
        clean = torch.zeros(rows, window, self.known.shape[2], device=self.device)
        texts, lengths = [], []
        for row in range(own):
            number = int(rng.integers(len(self.examples)))
            first = _first(self.examples[number], self.begins[number], window, rng)
            part = self.features[number][first : first + window]
            clean[row, : len(part)] = part
            choices = wordings(str(rng.choice(self.examples[number].captions)))
            texts.append(self.numbers[choices[int(rng.integers(len(choices)))]])
            lengths.append(len(part))
        for row in range(own, rows):
            number = int(rng.integers(len(self.known)))
            length = min(window, self.known.shape[1])
            clean[row, :length] = self.known[number, :length]
            texts.append(self.prompts[number])
            lengths.append(length)
        return clean, texts, lengths

    def _error(self, denoised: Tensor, clean: Tensor, before: Tensor, lengths: Tensor, own: int) -> Tensor:
        error = masked_error(denoised[:own], clean[:own], lengths[:own], self.scale)
        error = error + DISPLACEMENT * displacement_error(
            denoised[:own], clean[:own], lengths[:own], self.mean, self.std
        )
        if own == len(denoised):
            return error
        changed = masked_error(denoised[own:], before.float(), lengths[own:], self.scale)
        return error + KEEP_WEIGHT * changed


def _beginnings(example: Example, features: np.ndarray) -> np.ndarray:
    """Frames at which what is repeated begins anew; none in a clip that repeats nothing.

    features: (frames, 263) of the example, standardised. Windows that begin anywhere in a repetition show the same
    sentence with every phase, and the mean of all phases is a body that hardly moves.
    """
    begin, end = example.span
    poses = features[begin:end, LAYOUT["ric"]]
    far = np.sqrt(((poses - poses[0]) ** 2).mean(axis=1))
    far = np.convolve(np.pad(far, 2, "edge"), np.full(5, 0.2), "valid")
    near = [
        at
        for at in range(APART, len(far) - APART)
        if far[at] < AGAIN * np.median(far) and far[at] == far[at - APART : at + APART + 1].min()
    ]
    return begin + np.array([0, *near]) if near else np.zeros(0, int)


def _first(example: Example, begins: np.ndarray, window: int, rng: np.random.Generator) -> int:
    """Where a window begins: with a repetition; else anywhere in a loop or a long clip, or so that it shows all of what
    was recorded, soon."""
    begin, end = example.span
    frames = len(example.features)
    if end - begin >= window or example.looped:
        if (fits := begins[begins <= end - window]).size:
            return int(rng.choice(fits))
        return int(rng.integers(begin, max(end - window, begin) + 1))
    low, high = max(0, end - window, min(begin - BEFORE, frames - window)), min(begin, frames - window)
    return int(rng.integers(low, max(low, high) + 1)) if frames > window else 0


def _wrap(net: nn.Module) -> nn.Module:
    assert isinstance(net, AdapterNet)
    return Conditioned(net)


def _progress(lesson: Lesson, say: Say) -> Callable[[int, float, float], None]:
    losses: list[float] = []

    def on_step(step: int, loss: float, seconds: float) -> None:
        losses.append(loss)
        if (step + 1) % 50 == 0 or step + 1 == lesson.steps:
            say(f"step {step + 1} of {lesson.steps}  loss {np.mean(losses[-50:]):.4f}  {seconds:.2f} s a step")

    return on_step


def _adapter(
    prior: Prior, examples: Sequence[Example], captions: list[str], lesson: Lesson, average: Average
) -> Adapter:
    recorded = [e for e in examples if not e.name.startswith("M")]
    seconds = sum(e.span[1] - e.span[0] for e in recorded if not e.looped) / FPS
    notes = {
        "captions": captions[:64],
        "clips": len(recorded),
        "seconds": round(seconds, 1),
        "steps": lesson.steps,
        "batch": lesson.batch,
        "rate": lesson.rate,
        "keep": lesson.keep,
        "seed": lesson.seed,
        "amp": lesson.amp,
    }
    licence = lesson.licence or f"as the owner of the clips allows, and as the prior's: {prior.card.licence}"
    data = f"{len(recorded)} clips of the user's own: {'; '.join(captions)[:500]}"
    tensors = tensors_of({key: value.cpu() for key, value in average.weights.items()})
    return Adapter(lesson.name, TAUGHT, lesson.rank, tensors, prior.card.name, origin(prior), licence, data, notes)
