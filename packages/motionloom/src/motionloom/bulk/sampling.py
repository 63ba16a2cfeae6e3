"""Rows of many lengths through the network, with the same bits whatever rows are beside them.

A motion depends on its prompt and seed alone: the sums of a row are made in the same order whatever rows, words and
frames are beside it (`motionloom.runtime`; docs/decisions/0020-bulk.md). Rows share a call if they have as many tokens,
so that little is computed for padding.
"""

from collections.abc import Sequence

import numpy as np

from motionloom.diffusion import SOLVERS, guide, levels, row_noise, run
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS, check
from motionloom.weights.prior import Prior


def groups(prior: Prior, frames: Sequence[int], together: int) -> list[list[int]]:
    """Numbers of rows that share a network call, at most ``together``: of as many tokens; the longest first."""
    by_tokens: dict[int, list[int]] = {}
    for row, count in enumerate(frames):
        by_tokens.setdefault(-(-count // prior.net.config.patch), []).append(row)
    same = [by_tokens[tokens] for tokens in sorted(by_tokens, reverse=True)]
    return [rows[at : at + together] for rows in same for at in range(0, len(rows), together)]


def draw_group(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    seeds: Sequence[int],
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
) -> list[np.ndarray]:
    """Features (frames, 263 or the prior's) float32, not standardised: of rows that `groups` put together.

    Row i is drawn from ``seeds[i]``.
    Raises `MotionloomError` as `motionloom.tasks.text.check` does.
    """
    check(prior, prompts, steps=steps, guidance=guidance, solver=solver)
    cond = prior.condition(list(prompts), list(frames))
    noise = row_noise(seeds, frames)
    denoise = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)
    state = run(
        denoise,
        noise(np.empty((len(prompts), max(frames), len(prior.mean)), np.float32)),
        levels=levels(prior.schedule, steps, spacing=SPACING),
        solver=SOLVERS[solver],
        schedule=prior.schedule,
        noise=noise,
    )
    finished = state * prior.std + prior.mean
    return [prior.smoothed(finished[row, : frames[row]]) for row in range(len(prompts))]
