"""What Python draws, written for `studio/tests/prior.test.ts` to compare with what the page's own code draws."""

import json
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from motionloom.core.diffusion import generator, guide
from motionloom.core.diffusion.sampling import row_seed
from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom.core.models.networks.text.protocol import as_rows
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.amounts import measured
from motionloom.goals.goal import start_of
from motionloom.goals.paths import root_path
from motionloom.goals.segment import Segment
from motionloom.goals.timeline import timeline_of
from motionloom.requests.sampling import LARGEST_SEED, Sampling
from motionloom.tasks.control import steered_features
from motionloom.tasks.long import Track, compose, long_features, place_pieces
from motionloom.tasks.supported import add_support
from motionloom.tasks.text import sample_features, to_motion

SENTENCES = (
    "a person walks forward",
    "someone jumps twice, then waves",
    "a man sits down",
    "she kicks with the right leg",
    "a dancer spins around",
    "a person crawls on the floor",
    "he throws a ball",
    "somebody does a cartwheel",
    "a person runs in a circle to the left",
    "a person stands still and looks around",
)
CHAINS: tuple[tuple[tuple[str, float], ...], ...] = (
    (("a person walks forward", 3.0), ("a person jumps up", 2.0), ("a person dances", 2.55)),
)
PATH = ((0.5, 1.0), (0.2, 2.6), (1.6, 3.9), (3.0, 3.4))
"""Metres, x and z in the world."""
WORDED = (
    "turn left 90 degrees",
    "a person takes two steps to the left",
    "a person walks backwards in a half circle to the right",
    "jump three times",
    "claps four times",
)
"""Sentences whose numbers are kept: a facing, a way, a chain of strokes, a length."""
BORNE = (
    "a person walks up the stairs",
    "a person goes down stairs",
    "a person climbs a ladder",
    "she crawls on the floor",
)
"""Who gets steps, who is lowered, and who has hands under the floor."""
ODD_TEXTS = (
    "",
    "  Ünïcode  CAFÉ—naïve\t(won't) stop!? 中文 x́y \u200b\x07 ﬁ İstanbul ΣΊΣΥΦΟΣ",
    "supercalifragilisticexpialidocious " * 40,
    "a" * 101 + " walks \ud800 ok",
)


class Numbers:
    """Arrays of float32 in one file, by name."""

    def __init__(self) -> None:
        self.parts: list[np.ndarray] = []
        self.index: dict[str, tuple[int, int]] = {}
        self.count = 0

    def add(self, name: str, array: np.ndarray) -> None:
        """Put an array behind the others."""
        self.parts.append(np.ascontiguousarray(array, np.float32).reshape(-1))
        self.index[name] = self.count, self.parts[-1].size
        self.count += self.parts[-1].size

    def motion(self, name: str, motion: Motion) -> None:
        """Put places and rotations of a motion."""
        self.add(f"{name}.places", motion.positions())
        self.add(f"{name}.turns", motion.rotations)


def write(prior: Prior, folder: Path, *, precise: bool, weights: dict[str, np.ndarray] | None = None) -> None:
    """Write `expected.json` and `expected.bin` beside the exported weights.

    weights: other numbers of the network than the prior's own, which the page has too.
    """
    if weights is not None:
        prior = replace(prior, net=replace(prior.net, weights=weights))
    found, sizes = Numbers(), []
    _one_call(prior, found)
    for seed, text in enumerate(SENTENCES if precise else SENTENCES[:1]):
        seconds = 2.0 + 0.35 * seed
        [features] = sample_features(prior, [text], [round(seconds * 20)], seeds=[seed])
        found.add(f"sentence {seed}.features", features)
        found.motion(f"sentence {seed}", to_motion(features.astype(np.float64), prior.fps))
    for number, chain in enumerate(CHAINS if precise else ()):
        _chain(prior, found, f"chain {number}", chain)
    if precise:
        _paths(prior, found)
        for text in BORNE:
            [features] = sample_features(prior, [text], [90], seeds=[0])
            found.add(f"{text}.features", features)
            found.motion(text, add_support(to_motion(features.astype(np.float64), prior.fps)))
        for text in WORDED:
            sizes.append(_worded(prior, found, text))
    if precise:
        for seed in (0, 7, 2**40 + 5):
            found.add(f"noise {seed}", generator(seed).standard_normal(200_000, np.float32))
    np.concatenate(found.parts).tofile(folder / "expected.bin")
    assert isinstance(prior.text, MiniLM)
    texts = (*SENTENCES, *ODD_TEXTS)
    said = {
        "index": found.index,
        "sentences": SENTENCES if precise else SENTENCES[:1],
        "chains": CHAINS,
        "path": PATH,
        "worded": list(zip(WORDED, sizes)) if precise else (),
        "borne": BORNE if precise else (),
        "seeds": [(seed, n, str(row_seed(seed, n) % LARGEST_SEED)) for seed in (0, 7, 2**40 + 5) for n in (1, 5)],
    }
    tokens = [[text, prior.text.ids(text)] for text in as_rows(texts)]
    (folder / "expected.json").write_text(json.dumps({**said, "tokens": tokens, "precise": precise}))


def _one_call(prior: Prior, found: Numbers) -> None:
    """A guided answer of the network to noise, at three levels."""
    cond = prior.condition([SENTENCES[0]])
    denoise = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), 2.5)
    noise = generator(1).standard_normal((1, 42, 263), np.float32)
    found.add("state", noise)
    for level in (1000, 500, 3):
        found.add(f"denoised {level}", denoise(noise, level))


def _chain(prior: Prior, found: Numbers, name: str, chain: Sequence[tuple[str, float]]) -> None:
    segments = [Segment(text, seconds) for text, seconds in chain]
    pieces = list(long_features(prior, segments, sampling=Sampling(seed=4)))
    found.add(f"{name}.features", np.concatenate(pieces))
    motion = compose(prior, segments, sampling=Sampling(seed=4))
    found.motion(name, motion)


def _paths(prior: Prior, found: Numbers) -> None:
    """One sentence along a path, as `control` steers it, and a chain along the same one, as `compose` does."""
    goal = root_path(PATH, frames=100)
    place = start_of(goal)
    [features] = steered_features(prior, ["a person walks"], goal.relative_to(place), seeds=[4])
    found.add("path.features", features)
    found.motion("path", to_motion(features.astype(np.float64), prior.fps).placed(place))
    segments = [Segment(text, seconds) for text, seconds in CHAINS[0]]
    frames = [round(segment.seconds * prior.fps) for segment in segments]
    track = Track.along(root_path(PATH, frames=sum(frames)), prior.fps)
    asked = [track.with_path(part, sum(frames[:n]), frames[n]) for n, part in enumerate(segments)]
    pieces = long_features(prior, asked, sampling=Sampling(seed=5))  # with 4, a foot is at the edge of being planted
    places = place_pieces(prior, pieces, deque([None] * len(asked)), track.place(0), track)
    found.add("path of a chain.seen", np.concatenate([piece.positions for piece in places]))


def _worded(prior: Prior, found: Numbers, text: str) -> float:
    """A sentence whose number is kept, as it is sampled first, before anything is counted; what is measured of it."""
    timeline = timeline_of(text, amounts=True)
    asked = list(timeline.segments)
    if len(asked) > 1:
        features = np.concatenate(list(long_features(prior, asked, sampling=Sampling(seed=6))))
    elif asked[0].goal is not None:
        [features] = steered_features(prior, [asked[0].text], asked[0].goal, seeds=[6])
    else:
        [features] = sample_features(prior, [asked[0].text], [round(asked[0].seconds * 20)], seeds=[6])
    found.add(f"{text}.features", features)
    motion = to_motion(features.astype(np.float64), prior.fps)
    found.motion(text, motion)
    return measured(timeline.readings[0].amount, motion.positions())
