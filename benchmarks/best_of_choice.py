"""Which of four seeds `--best-of 4` keeps, by numbers that it does not look at.

    python benchmarks/best_of_choice.py > benchmarks/best_of_choice.txt

Prompts of the everyday set, judged by the checks of `evaluate obedience` on finished motions (the choice sees estimates
half way, by checks of its own); frames in which no joint is faster than 0.2 m/s; jerk. Beside the first seed and the
choice by the mean alone, which it was before.
"""

import numpy as np

from motionloom.core.diffusion.sampling import row_seed
from motionloom.core.models.prior import Prior, find_weights
from motionloom.goals.sequence import split_actions
from motionloom.kinematics.physics import jerk, velocity
from motionloom.requests.sampling import Sampling
from motionloom.tasks import best
from motionloom.tasks.sampling import Rows, sample, with_best_seeds
from motionloom.tasks.text import finish, frames_in, sample_features
from motionloom_lab.metrics.obedience import EVERYDAY, Check
from motionloom_lab.suites.harness import weight_marks

SEEDS, COUNT, EVERY = (200, 201), 4, 5


def measured(check: Check, positions: np.ndarray, fps: float) -> tuple[float, float, float]:
    """Whether it obeys, the share of frames without motion, and m/s^3 of jerk."""
    still = np.linalg.norm(velocity(positions, fps), axis=-1).max(axis=1) < 0.2
    return float(check.obeyed(check.measured(positions, fps))), float(still.mean()), jerk(positions, fps).mean


def main() -> None:
    """Print a line for each prompt and the means."""
    prior, sampling = Prior.load("default"), Sampling(best_of=COUNT)
    rows = []
    print("prompt, seed | obeys, still, jerk: first | nearest to the mean | chosen")
    for check in EVERYDAY[::EVERY]:
        if len(split_actions(check.prompt)) > 1:
            continue
        frames = frames_in(check.seconds, prior.fps)
        for seed in SEEDS:
            seeds = [seed, *(row_seed(seed, number) for number in range(1, COUNT))]
            asked = Rows([check.prompt] * COUNT, [frames] * COUNT, seeds)
            estimates = dict(sample(prior, asked, sampling, halfway=True))
            mean = best._mean_estimate(prior, check.prompt, frames, seeds, sampling.levels(prior.schedule)[0])
            away = [best._distance(estimates[number], mean) for number in range(COUNT)]
            chosen = with_best_seeds(prior, Rows([check.prompt], [frames], [seed]), sampling).seeds[0]
            picked = [0, away.index(min(away)), seeds.index(chosen)]
            made = sample_features(prior, asked.prompts, asked.lengths, seeds=seeds)
            found = {
                number: measured(check, finish(prior, made[number]).positions(), prior.fps) for number in set(picked)
            }
            rows.append([found[number] for number in picked])
            cells = [f"{one[0]:.0f}, {one[1]:.2f}, {one[2]:.0f}" for one in rows[-1]]
            print(f"{check.prompt}, {seed} | {' | '.join(cells)}", flush=True)
    means = [f"{100 * one[0]:.0f} %, {one[1]:.2f}, {one[2]:.0f}" for one in np.mean(rows, axis=0)]
    print(f"{len(rows)} motions | {' | '.join(means)}")
    [(name, mark)] = weight_marks([find_weights("default")]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
