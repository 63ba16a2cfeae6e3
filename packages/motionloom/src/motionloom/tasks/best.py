"""Best of several: which of a few seeds a motion is sampled from.

Several seeds are sampled half way. There the denoised estimates show what each becomes. Kept is one that does the most
of what its words allow to check (`motionloom.goals.expected`), then one whose body is whole, then one that moves
about as much as the others. Of those that are left it is the one whose joint rotations lie nearest to the mean of what
the words ask for, which is what the network answers to pure noise: odd motions lie far from it, and so do those that
move, which is why the mean comes last. docs/decisions/0024 says what it is worth.
"""

from dataclasses import replace

import numpy as np

from motionloom.diffusion import row_noise
from motionloom.diffusion.sampling import row_seed
from motionloom.features import humanml
from motionloom.features.layout import LAYOUT, WIDTH
from motionloom.goals.expected import asks_for_rest, share_met
from motionloom.kinematics.wholeness import ENOUGH, wholeness
from motionloom.requests.sampling import Sampling
from motionloom.tasks.sampling import Progress, Rows, sample, to_features
from motionloom.weights.prior import Prior

STILLER = 0.8
"""Share of the middle candidate's pace below which another one counts as one that stands."""


def with_best_seeds(
    prior: Prior, rows: Rows, count: int, sampling: Sampling, *, progress: Progress | None = None
) -> Rows:
    """The same rows, each with the best of ``count`` seeds: its own and others that depend on it alone.

    progress: called after each network call with the calls done and the calls there are for choosing.
    """
    tried = [[seed, *(row_seed(seed, number) for number in range(1, count))] for seed in rows.seeds]
    several = Rows(
        [prompt for prompt in rows.prompts for _ in range(count)],
        [length for length in rows.lengths for _ in range(count)],
        [seed for seeds in tried for seed in seeds],
    )
    estimates = dict(sample(prior, several, sampling, halfway=True, progress=progress))
    chosen = []
    for row, seeds in enumerate(tried):
        prompt, own = rows.prompts[row], np.stack([estimates[row * count + number] for number in range(count)])
        mean = _mean(prior, prompt, rows.lengths[row], seeds, sampling)
        ranks = [
            (*before, _distance(one, mean)) for before, one in zip(_looked_at(prior, prompt, own), own, strict=True)
        ]
        chosen.append(seeds[ranks.index(min(ranks))])
    return replace(rows, seeds=chosen)


def _looked_at(prior: Prior, prompt: str, estimates: np.ndarray) -> list[tuple[float, ...]]:
    """Of each estimate (rows, frames, features) what comes before the mean, the smaller the better."""
    if len(prior.mean) != WIDTH:
        return [()] * len(estimates)
    bodies = humanml.decode_positions(to_features(prior, estimates))
    pace = np.linalg.norm(np.diff(bodies, axis=1), axis=-1).mean(axis=(1, 2))
    still = np.zeros(len(pace)) if asks_for_rest(prompt) else pace < STILLER * np.median(pace)
    return [
        (-share_met(prompt, body, prior.fps), float(wholeness(body) < ENOUGH), float(slow))
        for body, slow in zip(bodies, still, strict=True)
    ]


def _mean(prior: Prior, prompt: str, length: int, seeds: list[int], sampling: Sampling) -> np.ndarray:
    """(length, features) standardised: the network's answer to pure noise, averaged over the noise of the seeds."""
    noise = row_noise(seeds)(np.empty((len(seeds), length, len(prior.mean)), np.float32))
    level = sampling.levels(prior.schedule)[0]
    return prior.net(noise, level, prior.net.bind(prior.condition([prompt] * len(seeds)))).mean(0)


def _distance(state: np.ndarray, mean: np.ndarray) -> float:
    numbers = LAYOUT["rot6d"] if len(mean[0]) == WIDTH else slice(None)
    return float(((state - mean)[:, numbers] ** 2).mean())
