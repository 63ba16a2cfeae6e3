"""Rows of many lengths through the network, with the same bits whatever rows are beside them.

A motion depends on its prompt and seed alone. In floating point that holds only as far as the sums of a network call
are made in the same order, and that order follows from the sizes of the call: fewer than four rows, other numbers of
words or of tokens, and it is another one. So rows share a call only if they have as many tokens, words are padded to
whole steps, prompts are encoded one by one, and calls have at least `LEAST` rows (docs/decisions/0020-bulk.md).
"""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional as F

from motionloom.diffusion import SOLVERS, guide, levels, row_noise, run
from motionloom.nets.prior import Condition, condition
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS, check, smooth
from motionloom.weights.prior import Prior

LEAST = 4
"""Rows of a network call; a smaller group is filled up with copies."""
WORDS = 16
"""Words of a prompt are padded to a multiple of this."""


def groups(prior: Prior, frames: Sequence[int], together: int) -> list[list[int]]:
    """Numbers of rows that share a network call, at most ``together``: of as many tokens; the longest first."""
    by_tokens: dict[int, list[int]] = {}
    for row, count in enumerate(frames):
        by_tokens.setdefault(-(-count // prior.net.config.patch), []).append(row)
    same = [by_tokens[tokens] for tokens in sorted(by_tokens, reverse=True)]
    return [rows[at : at + together] for rows in same for at in range(0, len(rows), together)]


@torch.inference_mode()
def draw_group(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    seeds: Sequence[int],
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
    bf16: bool = False,
) -> list[Tensor]:
    """Features (frames, 263 or the prior's), not standardised, on the CPU: of rows that `groups` put together.

    Row i is drawn from ``seeds[i]``. bf16: the network computes in bfloat16, the loop in float32.
    Raises `MotionloomError` as `motionloom.tasks.text.check` does.
    """
    check(prior, prompts, steps=steps, guidance=guidance, solver=solver)
    device = prior.mean.device
    chosen = [*range(len(prompts)), *([0] * (LEAST - len(prompts)))]
    lengths = [frames[row] for row in chosen]
    cond = _condition(prior, [prompts[row] for row in chosen], lengths)
    noise = row_noise([seeds[row] for row in chosen], lengths)
    state = noise(torch.empty(len(chosen), max(lengths), len(prior.mean), device=device))
    with torch.autocast(device.type, torch.bfloat16, enabled=bf16):
        denoise = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)
        state = run(
            denoise, state, levels=levels(prior.schedule, steps, spacing=SPACING), solver=SOLVERS[solver],
            schedule=prior.schedule, noise=noise,
        )  # fmt: skip
    finished = (state.float() * prior.std + prior.mean).cpu()
    rows = [finished[row, : frames[row]] for row in range(len(prompts))]
    return [smooth(row) for row in rows] if prior.net.config.patch > 1 else rows


def _condition(prior: Prior, prompts: Sequence[str], lengths: list[int]) -> Condition:
    texts = [prior.text.encode([prompt]).to(prior.mean.device) for prompt in prompts]
    pooled = torch.cat([text.pooled for text in texts])
    if not prior.net.modulated:
        return condition(pooled, lengths=lengths)
    most = max(text.mask.shape[1] for text in texts)
    most += -most % WORDS
    tokens = torch.cat([F.pad(text.tokens, (0, 0, 0, most - text.tokens.shape[1])) for text in texts])
    words = torch.cat([F.pad(text.mask, (0, most - text.mask.shape[1])) for text in texts])
    return condition(pooled, tokens=tokens, words=words, lengths=lengths)
