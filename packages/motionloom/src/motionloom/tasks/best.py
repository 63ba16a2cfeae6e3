"""Best of several: which of a few seeds a motion is sampled from.

Several seeds are sampled half way (`tasks.sampling`). There the denoised estimates show what each becomes. Kept is one
that does the most of what its words allow to check (`Judge`), then one whose body is whole, then one that moves about
as much as the others. Of those that are left it is the one whose joint rotations lie nearest to the mean of what the
words ask for, which is what the network answers to pure noise: odd motions lie far from it, and so do those that move,
which is why the mean comes last. docs/decisions/0024 says what it is worth.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from motionloom.core.diffusion import row_noise, row_seed
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT, WIDTH
from motionloom.core.models.prior import Prior
from motionloom.kinematics.wholeness import ENOUGH, wholeness

STILL_SHARE = 0.8
"""Share of the middle candidate's pace below which another one counts as standing still."""
Rank = tuple[float, ...]
"""The smaller the better."""


class Judge(Protocol):
    """What the words of a motion allow to check; the sampler itself knows nothing of language."""

    def share_met(self, text: str, positions: np.ndarray, fps: float) -> float:
        """0 to 1: the share of what ``text`` says plainly that positions (frames, 22, 3) in metres show."""
        ...

    def asks_for_rest(self, text: str) -> bool:
        """Whether somebody who does what ``text`` says may stand still."""
        ...


class Chooser(Protocol):
    """A function that picks one of several candidates; see `best_candidate` for its arguments."""

    def __call__(
        self, prior: Prior, prompts: Sequence[str], states: np.ndarray, *, seeds: Sequence[int], level: int
    ) -> int: ...


def candidate_seeds(seed: int, count: int) -> list[int]:
    """The seeds among which one is chosen: the motion's own, and others that depend on it alone."""
    return [seed, *(row_seed(seed, number) for number in range(1, count))]


def best_candidate(
    prior: Prior,
    prompts: Sequence[str],
    states: np.ndarray,
    *,
    seeds: Sequence[int],
    level: int,
    judge: Judge | None = None,
) -> int:
    """The index of the best of several candidates.

    prompts: of each person. states: (candidates, people, frames, features) half-way estimates, standardised. seeds: of
    the candidates. level: the highest of the walk. judge: what compares bodies with words; None: bodies alone decide.
    """
    people = [_ranks(prior, prompt, states[:, i], seeds, level, judge) for i, prompt in enumerate(prompts)]
    return index_of_smallest([tuple(map(sum, zip(*one, strict=True))) for one in zip(*people, strict=True)])


def index_of_smallest(ranks: Sequence[Rank]) -> int:
    """The place of the best of them."""
    return ranks.index(min(ranks))


def _ranks(
    prior: Prior, prompt: str, states: np.ndarray, seeds: Sequence[int], level: int, judge: Judge | None
) -> list[Rank]:
    mean = _mean_estimate(prior, prompt, states.shape[1], seeds, level)
    return [
        (*before, _distance(one, mean))
        for before, one in zip(_candidate_ranks(prior, prompt, states, judge), states, strict=True)
    ]


def _candidate_ranks(prior: Prior, prompt: str, estimates: np.ndarray, judge: Judge | None) -> list[Rank]:
    """Of each estimate (rows, frames, features) what comes before the mean."""
    if len(prior.mean) != WIDTH:
        return [()] * len(estimates)
    bodies = humanml.decode_positions(prior.to_features(estimates))
    ranks = liveliness_ranks(bodies, rest=judge is not None and judge.asks_for_rest(prompt))
    if judge is None:
        return ranks
    return [(-judge.share_met(prompt, body, prior.fps), *rank) for body, rank in zip(bodies, ranks)]


def liveliness_ranks(bodies: np.ndarray, *, rest: bool = False) -> list[Rank]:
    """Of each motion (rows, frames, 22, 3) whether its body is not whole, and whether it moves less than the others.

    rest: standing still is as good as moving.
    """
    pace = np.linalg.norm(np.diff(bodies, axis=1), axis=-1).mean(axis=(1, 2))
    still = np.zeros(len(pace)) if rest else pace < STILL_SHARE * np.median(pace)
    return [(float(wholeness(body) < ENOUGH), float(slow)) for body, slow in zip(bodies, still, strict=True)]


def _mean_estimate(prior: Prior, prompt: str, length: int, seeds: Sequence[int], level: int) -> np.ndarray:
    """(length, features) standardised: the network's answer to pure noise, averaged over the noise of the seeds."""
    noise = row_noise(seeds)(np.empty((len(seeds), length, len(prior.mean)), np.float32))
    net = prior.for_words(prompt).net
    return net(noise, level, net.bind(prior.condition([prompt] * len(seeds)))).mean(0)


def _distance(state: np.ndarray, mean: np.ndarray) -> float:
    numbers = LAYOUT["rot6d"] if len(mean[0]) == WIDTH else slice(None)
    return float(((state - mean)[:, numbers] ** 2).mean())
