"""Control: motions that meet a goal in the world, from a prompt.

The goal is seen from where the person stands at frame 0; there it steers every guess of the sampler (`steering`); the
drawn motion is put into the world and fitted to what is left of the wishes (`fitting`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from motionloom import rotations as rot
from motionloom.checkpoint import Prior
from motionloom.diffusion import SOLVERS, guide, levels, row_draw, sample
from motionloom.errors import MotionloomError
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22
from motionloom.tasks.fitting import fit
from motionloom.tasks.goals import Goal, Placement, placement_of
from motionloom.tasks.steering import Correction, corrected, toward
from motionloom.tasks.text import (
    GUIDANCE,
    LARGEST_SEED,
    LONGEST,
    ROWS,
    SOLVER,
    SPACING,
    STEPS,
    Progress,
    _check,
    smooth,
    to_motion,
)  # fmt: skip

MISSED = 0.05
"""Metres off beyond which a wish counts as missed."""
TOLD = 10
"""Missed wishes that are put into words."""


@dataclass(frozen=True, eq=False)
class Controlled:
    """A motion made for a goal, and how well it meets it."""

    motion: Motion
    """In the world of the goal."""
    drawn: Motion
    """The same before it was fitted."""
    error: float
    """Metres: mean over the joints and frames that are asked for a place."""
    worst: float
    """Metres: the largest of them."""
    missed: tuple[str, ...]
    """A sentence for each of the wishes that are more than `MISSED` off, at most `TOLD`, the worst first."""


def control(
    prior: Prior,
    prompt: str,
    goal: Goal,
    *,
    count: int = 1,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    exact: bool = True,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Controlled]:
    """Make ``count`` motions of the goal's length that do what ``prompt`` says and what ``goal`` asks.

    Motion i is drawn from ``seed + i`` alone. ``goal`` in the world at 20 frames per second; where the person stands
    at frame 0 is `placement_of` it. ``exact``: fit the drawn motion to the goal; ``clean``: lock planted feet.
    Raises MotionloomError for what cannot be asked; a goal out of reach is no error (see `Controlled.missed`).
    """
    if count < 1:
        raise MotionloomError(f"nothing to make: {count} motions; ask for 1 or more")
    if not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {seed}")
    if not 4 <= len(goal) <= LONGEST * prior.fps:
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be followed; give 4 to {LONGEST * prior.fps:.0f}")
    place = placement_of(goal)
    change = toward(goal.seen_from(place), prior)
    made = steered_features(
        prior, [prompt] * count, len(goal), corrections=[change] * count, seeds=[seed + i for i in range(count)],
        guidance=guidance, steps=steps, progress=progress,
    )  # fmt: skip
    drawn = [moved(to_motion(row.numpy().astype(np.float64), prior.fps, clean=clean), place) for row in made]
    return [judged(fit(motion, goal) if exact else motion, motion, goal) for motion in drawn]


@torch.inference_mode()
def steered_features(
    prior: Prior,
    prompts: Sequence[str],
    frames: int,
    *,
    corrections: Sequence[Correction | None],
    seeds: Sequence[int],
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
    spacing: str = SPACING,
    progress: Progress | None = None,
) -> list[Tensor]:
    """`motionloom.tasks.text.sample_features` for rows of one length, each guess changed by the row's correction."""
    _check(prior, prompts, steps=steps, guidance=guidance, solver=solver)
    way = levels(prior.schedule, steps, spacing=spacing)  # type: ignore[arg-type]
    result: list[Tensor] = []
    for start in range(0, len(prompts), ROWS):
        rows = slice(start, start + ROWS)
        cond = prior.condition(list(prompts[rows]))
        guided = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)
        draw = row_draw(seeds[rows])
        state = draw(torch.empty(len(prompts[rows]), frames, len(prior.mean), device=prior.mean.device))
        denoise = corrected(guided, corrections[rows])
        walk = sample(denoise, state, levels=way, solver=SOLVERS[solver], schedule=prior.schedule, draw=draw)
        for done, snapshot in enumerate(walk, start=1):
            state = snapshot.state
            if progress:
                progress(start // ROWS * steps + done, -(-len(prompts) // ROWS) * steps)
        finished = state * prior.std + prior.mean
        result += list((smooth(finished) if prior.net.config.patch > 1 else finished).cpu())
    return result


def moved(motion: Motion, place: Placement) -> Motion:
    """A motion that starts at the origin facing +Z, put to ``place``."""
    turn = rot.rotvec_to_quat(np.array([0.0, place.facing, 0.0]))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
    return replace(motion, root=place.to_world(motion.root), rotations=rot.unroll(rotations))


def judged(motion: Motion, drawn: Motion, goal: Goal) -> Controlled:
    """How far ``motion`` is from what ``goal`` asks, joint by joint and frame by frame."""
    off = np.where(goal.asked, motion.positions() - goal.positions, 0.0)
    asked = goal.asked.any(axis=-1)
    distance = np.linalg.norm(off, axis=-1)
    if not asked.any():
        return Controlled(motion, drawn, 0.0, 0.0, ())
    order = np.argsort(-distance, axis=None)[:TOLD]
    worst = [np.unravel_index(k, distance.shape) for k in order]
    missed = tuple(
        f"{SMPL22.names[joint]} at {frame / motion.fps:.2f} s is {distance[frame, joint]:.2f} m away from its goal"
        for frame, joint in worst
        if distance[frame, joint] > MISSED
    )
    return Controlled(motion, drawn, float(distance[asked].mean()), float(distance.max()), missed)
