"""What training two people looks at: crops of recorded pairs, and where each of the two sees the other."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from motionloom.core.features import humanml
from motionloom.core.features.pair import PlaceCode, along, encode
from motionloom.core.ground import compose, from_world, relative, to_world
from motionloom_train.data.pairs import Pair, mirrored
from motionloom_train.nets.pair import other

KEEN = (0, 15, 20, 21)
"""Joints that `Sight` looks at: pelvis, head and wrists."""
NEAR = 0.35
"""Metres between two joints that touch or hold, about."""


class Crops(NamedTuple):
    """Windows of pairs."""

    features: Tensor
    """(pairs, 2, frames, 263) float32, not standardised; zeros behind a short pair's end."""
    ground: Tensor
    """(pairs, 2, 4) ground poses (cos f, sin f, x, z) at the window's first frame."""
    lengths: np.ndarray
    """(pairs,) valid frames."""
    texts: np.ndarray
    """(pairs,) numbers of `Duets.texts`; 0 where there is no caption."""


@dataclass(frozen=True, eq=False)
class _Encoded:
    features: Tensor
    ground: Tensor
    texts: tuple[int, ...]


class Duets:
    """Pairs and their mirror images, encoded once; crops of them are slices."""

    def __init__(self, pairs: Sequence[Pair], *, mirror: bool = True, texts: Sequence[str] = ()) -> None:
        pairs = [*pairs, *(mirrored(pair) for pair in pairs)] if mirror else pairs
        self.texts = tuple(texts) or ("", *dict.fromkeys(text for pair in pairs for text in pair.captions))
        self.encoded = [self._encode(pair) for pair in pairs]
        self.lengths = np.array([pair.features.shape[1] for pair in self.encoded])

    def _encode(self, pair: Pair) -> _Encoded:
        features, ground = encode(pair.positions)
        features, ground = torch.from_numpy(features).double(), torch.from_numpy(ground)
        ways = compose(ground[:, None], along(features))
        known = {text: number for number, text in enumerate(self.texts)}
        return _Encoded(features.float(), ways.float(), tuple(known[t] for t in pair.captions if t in known) or (0,))

    def draw(self, rng: np.random.Generator, window: int, rows: int) -> Crops:
        """Windows anywhere in recordings chosen by the root of their length; half of them with the people exchanged."""
        which = rng.choice(len(self.encoded), rows, p=np.sqrt(self.lengths) / np.sqrt(self.lengths).sum())
        starts = rng.integers(0, np.maximum(self.lengths[which] - window, 0) + 1)
        crops = self.crops(which, starts, window, rng=rng)
        flip = torch.from_numpy(rng.random(rows) < 0.5)
        features = torch.where(flip[:, None, None, None], crops.features.flip(1), crops.features)
        return crops._replace(
            features=features, ground=torch.where(flip[:, None, None], crops.ground.flip(1), crops.ground)
        )

    def crops(
        self, which: np.ndarray, starts: np.ndarray, window: int, *, rng: np.random.Generator | None = None
    ) -> Crops:
        """The windows that begin at ``starts``; without ``rng`` with the first caption of each."""
        features = torch.zeros(len(which), 2, window, humanml.WIDTH)
        lengths = np.minimum(self.lengths[which] - starts, window)
        ground, texts = [], []
        for row, (number, start, length) in enumerate(zip(which, starts, lengths, strict=True)):
            pair = self.encoded[number]
            features[row, :, :length] = pair.features[:, start : start + length]
            ground.append(pair.ground[:, start])
            texts.append(pair.texts[int(rng.integers(len(pair.texts))) if rng else 0])
        return Crops(features, torch.stack(ground), lengths, np.array(texts))


@dataclass(frozen=True)
class Sight:
    """Where each of two people sees the other, frame by frame, from D and features; rows 2k and 2k + 1 are two."""

    code: PlaceCode

    def ground(self, places: Tensor) -> Tensor:
        """D (rows, 4), exact or estimated, to the other's ground pose at frame 0 as each sees it, not `normalized`.

        (Making a direction of an estimate near zero would have gradients without bounds.)
        """
        raw = self.code.raw(places)
        return raw if self.code.kind == "mutual" else relative(raw, other(raw))

    def partner(self, places: Tensor, features: Tensor) -> Tensor:
        """D (rows, 4), features (rows, frames, 263) to the other's ground pose as each sees it, (rows, frames, 4)."""
        way = along(features)
        return relative(way, compose(self.ground(places)[:, None], other(way)))

    def joints(self, places: Tensor, features: Tensor) -> Tensor:
        """(rows, frames, 4, 4, 3) metres: from each joint of `KEEN` to each of the other person, in the own heading."""
        way = along(features)[..., None, :]
        own = humanml.decode_positions(features)[..., list(KEEN), :]
        theirs = to_world(other(own), self.ground(places)[:, None, None])
        return from_world(theirs, way)[..., None, :, :] - from_world(own, way)[..., :, None, :]

    def error(self, places: Tensor, features: Tensor, true_places: Tensor, true_features: Tensor) -> Tensor:
        """(rows, frames) square metres of estimated `joints`; what is `NEAR` counts up to five times as much."""
        true = self.joints(true_places, true_features)
        near = torch.exp(-0.5 * true.square().sum(-1) / NEAR**2)
        away = (self.joints(places, features) - true).square().sum(-1)
        return (away * (1 + 4 * near)).mean((-1, -2))
