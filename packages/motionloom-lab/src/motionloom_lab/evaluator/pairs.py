"""Pairs of a motion and a sentence for contrastive training, and which other pairs of a batch are no negatives.

Nothing here is trained. A draw depends on the seed and the step alone, so that training resumes exactly.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motionloom.core.features import humanml
from motionloom.core.features.representation import HUMANML3D
from motionloom_train.data.sets import Item, MotionSet, load_set, read_clips
from motionloom_train.data.words import STATES, mirror_text

SHARE = {"human": 0.5, "index": 0.12, "label": 0.38}
"""How often a pair shows a written caption, an index description, a measured label."""
LONGEST = 200
"""Frames: what captions of the field describe. Longer stretches of a lasting state are cropped to 40 to 200."""
SHORTEST = 20
ALIKE = 0.7
"""Cosine of two pooled sentence vectors above which they mean the same and are no negatives of each other."""
HARD = 0.33
"""Most rows of a batch that get a contrary motion or sentence."""
DERIVED = re.compile(r"_(looped|reversed|bent\d*)$")
"""The end of names of clips of one recording: ``M05_01_bent2`` and ``M05_01`` are one, mirrored ones apart."""
_ONWARD = {"forward": "backward", "forwards": "backwards", "backward": "forward", "backwards": "forwards"}
_ONWARD_WORD = re.compile(r"\b(forwards?|backwards?)\b", re.IGNORECASE)
_SENSES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"\bleft",
        r"\bright(?! now| away)",
        r"(?<!counter)(?<!counter )(?<!counter-)\bclockwise",
        r"\b(counter|anti)[ -]?clockwise",
        r"\bforwards?\b",
        r"\bback(wards?)?\b",
        r"\bup(wards?)?\b",
        r"\bdown(wards?)?\b",
    )
)
"""Directions in opposite pairs: words that pooled sentence vectors hardly distinguish."""
TIMED = re.compile(
    r"\b(walk|run|ran|jog|step|climb|stairs|sit|sits|sat|stand(s|ing)? up|jump(s|ed|ing)? (forward|down|over)|forward|"
    r"backward|kick|throw|lift|pick|rais|lower|crouch|kneel|bend)",
    re.IGNORECASE,
)
"""Words for what looks different when the film runs backwards."""


def contrary(text: str) -> str:
    """The sentence with left and right exchanged, or else forward and backward; itself where it has neither."""
    mirrored = mirror_text(text)
    if mirrored != text:
        return mirrored
    return _ONWARD_WORD.sub(lambda match: _ONWARD[match.group(0).lower()], text)


def senses(texts: Sequence[str]) -> Tensor:
    """(texts, 8) bool: which directions a sentence names, opposites side by side."""
    return torch.tensor([[bool(sense.search(text)) for sense in _SENSES] for text in texts]).reshape(-1, len(_SENSES))


def opposed(first: Tensor, second: Tensor) -> Tensor:
    """(n, 8) and (m, 8) `senses` to (n, m) bool: one has only left where the other has only right, and so on."""
    only = [side & ~side.unflatten(-1, (-1, 2)).flip(-1).flatten(-2) for side in (first, second)]
    other = only[1].unflatten(-1, (-1, 2)).flip(-1).flatten(-2)
    return (only[0][:, None] & other[None]).any(-1)


def backwards(features: np.ndarray) -> np.ndarray:
    """The film run backwards, (n, 263) to (n - 1, 263)."""
    positions = humanml.decode_positions(features.astype(np.float64))[::-1].copy()
    return humanml.encode(positions, heading="corrected")


@dataclass(frozen=True)
class PairBatch:
    """Motions, their sentences, and a contrary of some of both."""

    features: Tensor
    """(rows + hard, frames, numbers) unstandardised, zeros behind each length; the last ones are contrary motions."""
    lengths: Tensor
    texts: Tensor
    """(rows + hard texts,) numbers of sentences; the last ones are contrary sentences."""
    rows: int
    hard_motion: Tensor
    """(hard,) the row that each contrary motion belongs to."""
    hard_text: Tensor
    groups: Tensor
    """(rows,) same number: the same measured label."""
    takes: Tensor
    """(rows,) same number: stretches of one recording, mirrored ones apart."""


class Pairs:
    """Draws `PairBatch`es from the training split of a built set."""

    def __init__(self, data: MotionSet, takes: Sequence[int], *, hard: float = HARD) -> None:
        self.data, self.takes, self.hard = data, tuple(takes), hard
        known = {text: number for number, text in enumerate(data.texts)}
        texts = list(data.texts)
        self.contrary: list[int] = []
        for text in data.texts:
            other = contrary(text)
            if other not in known:
                known[other] = len(texts)
                texts.append(other)
            self.contrary.append(known[other])
        self.texts = tuple(texts)
        """All sentences: those of the data first, then contraries that it lacks."""
        groups = sorted({item.group for item in data.items})
        self._group = {name: number for number, name in enumerate(groups)}
        self._pools = self._pool()

    @staticmethod
    def load(folder: Path | str, *, sources: Sequence[str], seed: int, hard: float = HARD) -> "Pairs":
        """From the training split of a built set; ``sources`` as in a recipe."""
        data = load_set(folder, sources=sources, seed=seed)
        clips = read_clips(folder, sources=sources)
        ends = np.cumsum([len(clip.features) for clip in clips])
        known: dict[str, int] = {}
        families = [known.setdefault(DERIVED.sub("", clip.name), len(known)) for clip in clips]
        places = np.searchsorted(ends, [item.start for item in data.items], side="right")
        return Pairs(data, [families[place] for place in places], hard=hard)

    def _pool(self) -> dict[str, list[np.ndarray]]:
        pools: dict[str, dict[str, list[int]]] = {}
        for number, item in enumerate(self.data.items):
            kind = item.group if item.group in SHARE else "label"
            if item.frames >= SHORTEST:
                pools.setdefault(kind, {}).setdefault(item.group, []).append(number)
        return {kind: [np.array(numbers) for numbers in groups.values()] for kind, groups in pools.items()}

    def window(self, item: Item, rng: np.random.Generator) -> np.ndarray:
        """The frames to show: whole events, up to a tenth less of captioned stretches, a part of what lasts."""
        lasting = item.group in STATES or item.group == "index" or "+" in item.group
        least = min(item.frames, 40) if lasting else round(0.9 * item.frames) if item.group == "human" else item.frames
        length = int(rng.integers(least, min(item.frames, LONGEST) + 1)) if least < LONGEST else LONGEST
        start = item.start + int(rng.integers(item.frames - length + 1))
        part = self.data.features[start : start + length]
        return (part * self.data.std + self.data.mean).numpy()

    def draw(self, seed: int, step: int, rows: int) -> PairBatch:
        """The batch of one step."""
        rng = np.random.default_rng((seed, step))
        kinds = [kind for kind in SHARE if kind in self._pools]
        share = np.array([SHARE[kind] for kind in kinds])
        numbers = []
        for kind in rng.choice(len(kinds), size=rows, p=share / share.sum()):
            groups = self._pools[kinds[kind]]
            numbers.append(int(rng.choice(groups[rng.integers(len(groups))])))
        items = [self.data.items[n] for n in numbers]
        windows = [self.window(item, rng) for item in items]
        texts = [item.texts[rng.integers(len(item.texts))] for item in items]
        motions, motion_rows = self._hard_motions(windows, texts, rng)
        text_rows = [row for row, text in enumerate(texts) if self.contrary[text] != text][: round(self.hard * rows)]
        lengths = torch.tensor([len(m) for m in (*windows, *motions)])
        features = torch.zeros(len(lengths), int(lengths.max()), self.data.features.shape[1])
        for row, motion in enumerate((*windows, *motions)):
            features[row, : len(motion)] = torch.from_numpy(motion)
        alone = ("human", "index")  # captions: each its own group
        return PairBatch(
            features,
            lengths,
            torch.tensor([*texts, *(self.contrary[texts[row]] for row in text_rows)]),
            rows,
            torch.tensor(motion_rows, dtype=torch.long),
            torch.tensor(text_rows, dtype=torch.long),
            torch.tensor([-1 - row if i.group in alone else self._group[i.group] for row, i in enumerate(items)]),
            torch.tensor([self.takes[n] for n in numbers]),
        )

    def _hard_motions(
        self, windows: Sequence[np.ndarray], texts: Sequence[int], rng: np.random.Generator
    ) -> tuple[list[np.ndarray], list[int]]:
        """Mirror images where a sentence names a side, films run backwards where it names what shows that.

        Both are of HumanML3D's numbers; motions of others have no contrary.
        """
        motions: list[np.ndarray] = []
        rows: list[int] = []
        if self.data.representation is not HUMANML3D:
            return motions, rows
        for row, (motion, number) in enumerate(zip(windows, texts, strict=True)):
            if len(rows) >= round(self.hard * len(windows)):
                break
            text = self.texts[number]
            sided, timed = mirror_text(text) != text, TIMED.search(text) is not None
            if not (sided or timed):
                continue
            mirrored = sided and (not timed or rng.random() < 0.7)  # sides are learned last
            motions.append(humanml.mirror(motion) if mirrored else backwards(motion))
            rows.append(row)
        return motions, rows


def negatives(batch: PairBatch, pooled: Tensor, directions: Tensor) -> Tensor:
    """(rows, rows) bool: True where motion j is a negative of sentence i.

    pooled, directions: (sentences, width) and `senses` of all sentences. Not negatives: the same measured label, the
    same recording, sentences that are alike, unless they name opposite directions.
    """
    texts = batch.texts[: batch.rows]
    unit = torch.nn.functional.normalize(pooled[texts].float(), dim=-1)
    apart = (unit @ unit.T < ALIKE) | opposed(directions[texts], directions[texts])
    same = (batch.groups[:, None] == batch.groups) | (batch.takes[:, None] == batch.takes)
    return apart & ~same
