"""Best of several: which of a few seeds a motion is sampled from.

Several seeds are sampled half way. There the denoised estimates show what each becomes. Kept is the one whose joint
rotations lie nearest to the mean of what the words ask for, which is what the network answers to pure noise.
Odd motions, and those that do only half of what is said, lie far from it. docs/decisions/0024 says what it is worth.
"""

from dataclasses import replace

import numpy as np

from motionloom.diffusion import row_noise
from motionloom.diffusion.sampling import row_seed
from motionloom.errors import MotionloomError
from motionloom.features.layout import LAYOUT, WIDTH
from motionloom.tasks.sampling import Progress, Rows, Sampling, sample
from motionloom.weights.prior import Prior

MOST = 16


def check_best_of(count: int) -> None:
    """Raise `MotionloomError` for a number of seeds that cannot be tried."""
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST:
        raise MotionloomError(f"the best is chosen of 1 to {MOST} motions; got {count}")


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
        mean = _mean(prior, rows.prompts[row], rows.lengths[row], seeds, sampling)
        away = [_distance(estimates[row * count + number], mean) for number in range(count)]
        chosen.append(seeds[away.index(min(away))])
    return replace(rows, seeds=chosen)


def _mean(prior: Prior, prompt: str, length: int, seeds: list[int], sampling: Sampling) -> np.ndarray:
    """(length, features) standardised: the network's answer to pure noise, averaged over the noise of the seeds."""
    noise = row_noise(seeds)(np.empty((len(seeds), length, len(prior.mean)), np.float32))
    level = sampling.levels(prior.schedule)[0]
    return prior.net(noise, level, prior.net.bind(prior.condition([prompt] * len(seeds)))).mean(0)


def _distance(state: np.ndarray, mean: np.ndarray) -> float:
    numbers = LAYOUT["rot6d"] if len(mean[0]) == WIDTH else slice(None)
    return float(((state - mean)[:, numbers] ** 2).mean())
