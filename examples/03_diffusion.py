"""The sampling loop without a network: with the exact denoiser of a known distribution, every solver finds it.

The data are two points, -1 and 3, equally likely. E[x_0 | x_level] is then known in closed form, so this shows the
loop, the solvers and one edit of each kind on a problem with a known answer. Needs no weights.

    python examples/03_diffusion.py
"""

import numpy as np

from motionloom.core.diffusion import Ddim, DpmSolver2M, cosine, inpaint, levels, observe, row_noise, run

POINTS = np.array([-1.0, 3.0])
schedule = cosine(1000)
rows = 200


def exact(x: np.ndarray, level: int) -> np.ndarray:
    """E[x_0 | x] for the two points under x = signal x_0 + noise e."""
    signal, noise = schedule.signal[level], schedule.noise[level]
    logits = -((x[..., None] - signal * POINTS) ** 2) / (2 * noise**2)  # equal priors cancel
    weights = np.exp(logits - logits.max(-1, keepdims=True))
    return ((weights * POINTS).sum(-1) / weights.sum(-1)).astype(x.dtype)


noise = row_noise(range(rows))  # each row has its own: a row is the same in any batch
start = noise(np.empty((rows, 4, 1), np.float32))  # rows, tokens, features

solvers = {"DDPM, 100 steps": (Ddim(eta=1.0), 100), "DDIM, 25": (Ddim(), 25), "DPM-Solver++, 10": (DpmSolver2M(), 10)}
for name, (solver, steps) in solvers.items():
    own = row_noise(range(rows))
    x = run(exact, start, levels=levels(schedule, steps), solver=solver, schedule=schedule, noise=own)
    away = np.abs(x[..., None] - POINTS).min(-1).max()
    print(f"{name:18s} share of 3: {(x > 1).mean():.2f}, furthest from a point: {away:.3f}")

# The two edits. Token 0 is known to be 3; the others are free.
known, mask = np.full_like(start, 3.0), np.zeros_like(start)
mask[:, 0] = 1
held = observe(known, mask, schedule, row_noise(range(rows)))
few = levels(schedule, 25)
edited = run(inpaint(exact, known, mask), start, levels=few, solver=Ddim(), schedule=schedule, noise=noise)
state = run(exact, start, levels=few, solver=Ddim(), schedule=schedule, noise=noise, constrain=held)
print(f"token 0 by editing the estimate: {edited[:, 0].mean():.3f}, by editing the state: {state[:, 0].mean():.3f}")
