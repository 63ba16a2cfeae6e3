"""Control: motions that meet a goal in the world, from a prompt.

The goal is seen from where the person stands at frame 0; there it steers every guess of the sampler (`steering`); the
drawn motion is put into the world and fitted to what is left of the wishes (`fitting`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from motionloom import rotations as rot
from motionloom.diffusion import SOLVERS, Denoiser, Weight, guide, levels, mix, row_draw, sample
from motionloom.edits.fitting import fit
from motionloom.edits.steering import Correction, corrected, toward
from motionloom.errors import MotionloomError
from motionloom.features.layout import mask as named
from motionloom.features.layout import ric
from motionloom.goals.goal import Goal, Placement, placement_of
from motionloom.goals.segment import LONGEST
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22
from motionloom.tasks.blending import blended
from motionloom.tasks.text import (
    GUIDANCE,
    LARGEST_SEED,
    ROWS,
    SOLVER,
    SPACING,
    STEPS,
    Progress,
    check,
    places_of,
    smooth,
    to_motion,
)
from motionloom.tasks.watching import reported
from motionloom.weights.adapter import Adapter, adapted
from motionloom.weights.adapter import adapters as shipped
from motionloom.weights.prior import Prior

Adapters = Literal["none", "fitting"] | Sequence[Adapter]

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
    adapters: Adapters = "none",
    weights: Sequence[Weight] | None = None,
    exact: bool = True,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Controlled]:
    """Make ``count`` motions of the goal's length that do what ``prompt`` says and what ``goal`` asks.

    Motion i is drawn from ``seed + i`` alone. ``goal`` in the world at 20 frames per second; where the person stands
    at frame 0 is `placement_of` it. adapters: networks trained to see what is asked, blended with ``weights`` (one
    each, else the mean); "fitting" takes the shipped ones that fit (`fitting_adapters`), "none" the prior's own
    network: the shipped ones were measured to make no smaller errors but more jerk (docs/decisions/0012).
    exact: fit the drawn motion to the goal; clean: lock planted feet.
    Raises MotionloomError for what cannot be asked; a goal out of reach is no error (see `Controlled.missed`).
    """
    if count < 1:
        raise MotionloomError(f"nothing to make: {count} motions; ask for 1 or more")
    if not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {seed}")
    longest = round(LONGEST * prior.fps)
    if not 4 <= len(goal) <= longest:
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be followed; one of 4 to {longest} can")
    place = placement_of(goal)
    chosen = fitting_adapters(prior, goal) if adapters == "fitting" else () if adapters == "none" else adapters
    made = steered_features(
        prior, [prompt] * count, goal.seen_from(place), seeds=[seed + i for i in range(count)], guidance=guidance,
        steps=steps, adapters=chosen, weights=weights, progress=progress,
    )  # fmt: skip
    drawn = [moved(to_motion(row.numpy().astype(np.float64), prior.fps, clean=clean), place) for row in made]
    return [judged(fit(motion, goal) if exact else motion, motion, goal) for motion in drawn]


@torch.inference_mode()
def steered_features(
    prior: Prior,
    prompts: Sequence[str],
    goal: Goal,
    *,
    seeds: Sequence[int],
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    adapters: Sequence[Adapter] = (),
    weights: Sequence[Weight] | None = None,
    progress: Progress | None = None,
) -> list[Tensor]:
    """`motionloom.tasks.text.sample_features` for rows of the goal's length, each guess steered towards ``goal``.

    ``goal`` as of `steering.toward`. With ``adapters`` their blended guesses are steered, and the numbers that are
    asked stand in the state without noise, as the last steered guess has them (as `blending.control_features`, whose
    numbers are known beforehand; here they depend on where the rest of the body goes).
    """
    check(prior, prompts, steps=steps, guidance=guidance, solver=SOLVER)
    if weights is not None and len(weights) != len(adapters):
        raise MotionloomError(f"there are {len(weights)} weights for {len(adapters)} adapters; give one for each")
    way = levels(prior.schedule, steps, spacing=SPACING)
    nets = [adapted(prior.net, adapter) for adapter in adapters]
    change, mask = toward(goal, prior), controlled_numbers(goal).to(prior.mean.device)
    result: list[Tensor] = []
    for start in range(0, len(prompts), ROWS):
        said = list(prompts[start : start + ROWS])
        cond, draw = prior.condition(said), row_draw(seeds[start : start + ROWS])
        if nets:
            shares = list(weights or [1 / len(nets)] * len(nets))
            told = partial(blended, nets, cond, weights=shares, guidance=guidance)
            denoise = _seeing(told, change, prior, mask)
        else:
            guided = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)
            denoise = corrected(guided, [change] * len(said))
        state = draw(torch.empty(len(said), len(goal), len(prior.mean), device=prior.mean.device))
        walk = sample(denoise, state, levels=way, solver=SOLVERS[SOLVER], schedule=prior.schedule, draw=draw)
        rows = range(start, start + len(said))
        walk = reported(walk, steps, rows, lambda snapshot: places_of(prior, snapshot.clean)[:, None])
        for done, snapshot in enumerate(walk, start=1):
            state = snapshot.state
            if progress:
                progress(start // ROWS * steps + done, -(-len(prompts) // ROWS) * steps)
        finished = state * prior.std + prior.mean
        result += list((smooth(finished) if prior.net.config.patch > 1 else finished).cpu())
    return result


def controlled_numbers(goal: Goal) -> Tensor:
    """(frames, 263) bool: the numbers of the representation that a goal is about, frame by frame."""
    mask = np.zeros((len(goal), len(named("root"))), dtype=bool)
    mask[goal.asked[:, 0].any(axis=-1)] |= named("root_horizontal")
    mask[goal.asked[:, 0, 1], 3] = True
    for joint in range(1, len(SMPL22)):
        mask[goal.asked[:, joint].any(axis=-1), ric(joint)] = True
    return torch.from_numpy(mask)


def fitting_adapters(prior: Prior, goal: Goal) -> list[Adapter]:
    """The adapters beside the shipped weights for what is asked: one per joint that has its own, else ``any``.

    MotionloomError where there are none, for other weights than those they belong to, and for damaged files.
    """
    names = shipped()
    if not names:
        raise MotionloomError(
            "no adapters lie in weights/control of this installation: they come with the repository, not with the "
            "package; name adapter files, or control without them, which is as good"
        )
    wanted = {("trajectory" if joint == "pelvis" else joint) for joint in goal.joints}
    chosen = {name if name in names else "any" for name in wanted} & set(names)
    return [Adapter.load(name, prior) for name in sorted(chosen)]


def _seeing(told: Callable[[Tensor, Tensor], Denoiser], change: Correction, prior: Prior, mask: Tensor) -> Denoiser:
    """The steered denoiser that shows its networks the last steered guess, free of noise, where ``mask`` is True.

    ``told`` (given, mask) are the networks that know what is given. At the first level nothing is.
    """
    last: Tensor | None = None

    def seen(state: Tensor, level: int) -> Tensor:
        nonlocal last
        if last is None:
            guess = told(torch.zeros_like(state), torch.zeros_like(state, dtype=torch.bool))(state, level)
        else:
            shown = mix(state, prior.schedule.at(level)[0] * last, mask)
            guess = told(last, mask.expand(len(state), -1, -1))(shown, level)
        last = torch.stack([change(row, level) for row in guess])
        return last

    return seen


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
