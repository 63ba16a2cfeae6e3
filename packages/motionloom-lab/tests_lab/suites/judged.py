"""A small world in which everything about text and motion is known: numbered people, and a judge who reads the numbers.

Person k has a place in a space of `WIDTH` dimensions, drawn once for all from k. Its features hold that place, its
captions say k, and the judge reads both back, so that every metric has a value that can be worked out on paper.
"""

import re
from collections.abc import Sequence

import numpy as np

from motionloom.core.features.representation import HUMANML3D
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.suites.items import Item

WIDTH = 6
HIDDEN = slice(70, 70 + WIDTH)
"""Where features hold the place: rotations, which no physical number reads."""


def place(k: int) -> np.ndarray:
    return np.random.default_rng(k).standard_normal(WIDTH)


def features(where: np.ndarray, frames: int) -> np.ndarray:
    numbers = np.zeros((frames, 263))
    numbers[:, HIDDEN] = where
    return numbers


def item(k: int, frames: int = 40, *, captions: int = 2, says: int | None = None) -> Item:
    number = k if says is None else says
    texts = tuple(Caption(f"person {number} walks, wording {w}.") for w in range(captions))
    return Item(f"item{k:04d}", "cmu", "test", texts, features(place(k), frames))


def number_in(text: str) -> int:
    return int(re.findall(r"\d+", text)[0])


class Judge:
    """Knows everybody; ``blind`` sees one and the same thing everywhere."""

    representation = HUMANML3D

    def __init__(self, *, blind: bool = False, name: str = "judge") -> None:
        self.blind, self.name, self.about = blind, name, {"made": "for tests"}
        self.seen: list[int] = []

    def motions(self, features: Sequence[np.ndarray]) -> np.ndarray:
        self.seen += [len(one) for one in features]
        return np.stack([np.zeros(WIDTH) if self.blind else one[:, HIDDEN].mean(0) for one in features])

    def texts(self, captions: Sequence[Caption]) -> np.ndarray:
        numbers = [number_in(c.text) if re.search(r"\d", c.text) else 0 for c in captions]
        return np.stack([np.zeros(WIDTH) if self.blind else place(k) for k in numbers])


class Painter:
    """Draws the person it is told, off by ``sigma`` times noise from the seed; remembers what it was asked."""

    def __init__(self, sigma: float = 0.0, *, stop_after: int | None = None) -> None:
        self.sigma, self.stop_after = sigma, stop_after
        self.calls: list[tuple[int, tuple[str, ...], tuple[int, ...], tuple[int, ...]]] = []

    def __call__(
        self, prompts: Sequence[str], frames: Sequence[int], *, seeds: Sequence[int], steps: int
    ) -> list[np.ndarray]:
        if self.stop_after is not None and len(self.calls) >= self.stop_after:
            raise KeyboardInterrupt
        self.calls.append((steps, tuple(prompts), tuple(frames), tuple(seeds)))
        return [
            features(place(number_in(p)) + self.sigma * np.random.default_rng(s).standard_normal(WIDTH), n)
            for p, n, s in zip(prompts, frames, seeds, strict=True)
        ]
