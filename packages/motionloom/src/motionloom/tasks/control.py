"""Control: motions that meet a goal in the world, from a prompt.

The goal is seen from the person's ground pose at frame 0; there it steers every denoised estimate of the sampler
(`steering`); the sampled motion is placed in the world and fitted to what is left of the targets (`fitting`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Literal, Unpack

import numpy as np

from motionloom.core.diffusion import Denoiser, Weight, mix
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import mask as named
from motionloom.core.features.layout import ric
from motionloom.core.methods.blending import blended
from motionloom.core.models.adapter import Adapter, adapted
from motionloom.core.models.adapter import adapters as shipped
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.edits import fitting
from motionloom.edits.steering import Correction, corrected, toward
from motionloom.goals.goal import Goal, start_of
from motionloom.requests.sampling import Sampling, Settings
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.sampling import Batch, Progress, Rows, sample, strength
from motionloom.tasks.text import check_goal_length, check_prompts, single_person_view, to_motion

Weighted = tuple[Adapter, Weight]
Adapters = Literal["none", "fitting"] | Sequence[Adapter | Weighted]

MISSED = 0.05
"""Metres off beyond which a target counts as missed."""
SENTENCES = 10
"""Missed targets that are reported, at most."""


@dataclass(frozen=True, eq=False)
class Controlled:
    """A motion for a goal, and how well it meets it."""

    motion: Motion
    """In the world of the goal."""
    sampled: Motion
    """The same before it was fitted."""
    error: float
    """Metres: mean over the joints and frames with a target."""
    worst: float
    """Metres: the largest of them."""
    missed: tuple[str, ...]
    """A sentence for each of the targets that are more than `MISSED` off, at most `SENTENCES`, the worst first."""


def control(
    prior: Prior,
    prompt: str,
    goal: Goal,
    *,
    adapters: Adapters = "none",
    fit: bool = True,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[Controlled]:
    """Generate motions of the goal's length that do what ``prompt`` says and meet ``goal``.

    Args:
        prior: weights that make HumanML3D's 263 numbers.
        prompt: what the person does.
        goal: in the world, metres, at 20 frames per second; the person's ground pose in frame 0 is its `start_of`.
        adapters: networks trained to see the targets, each alone or with its weight (the mean of all by default);
            "fitting" takes the shipped ones that fit (`fitting_adapters`), "none" the prior's own network: the shipped
            ones were measured to have no smaller errors but more jerk (docs/decisions/0012).
        fit: fit the sampled motion to the goal.
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords; motion i is sampled from ``seed + i`` alone.
        progress: called after each network call with the calls done and the calls in all.

    Raises:
        MotionloomError: for an impossible request; a goal out of reach is no error (see `Controlled.missed`).
    """
    chosen = Sampling.of(sampling, settings)
    seeds = chosen.seeds(chosen.number())
    how = {"adapters": adapters, "fit": fit, "foot_lock": foot_lock, "progress": progress}
    return control_each(prior, [prompt] * len(seeds), goal, seeds=seeds, sampling=chosen, **how)


def control_each(
    prior: Prior,
    prompts: Sequence[str],
    goal: Goal,
    *,
    seeds: Sequence[int],
    sampling: Sampling,
    adapters: Adapters = "none",
    fit: bool = True,
    foot_lock: bool = True,
    progress: Progress | None = None,
) -> list[Controlled]:
    """`control` for motions of one goal, each of its own prompt and seed; arguments and errors as there."""
    check_goal_length(goal, prior.fps)
    place = start_of(goal)
    nets = fitting_adapters(prior, goal) if adapters == "fitting" else () if adapters == "none" else adapters
    features = steered_features(
        prior,
        prompts,
        goal.relative_to(place),
        seeds=seeds,
        adapters=nets,
        sampling=sampling,
        progress=progress,
    )
    sampled = [to_motion(row.astype(np.float64), prior.fps, foot_lock=foot_lock).placed(place) for row in features]
    return [evaluate(fitting.fit(motion, goal) if fit else motion, motion, goal) for motion in sampled]


def steered_features(
    prior: Prior,
    prompts: Sequence[str],
    goal: Goal,
    *,
    seeds: Sequence[int],
    adapters: Sequence[Adapter | Weighted] = (),
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[np.ndarray]:
    """`motionloom.tasks.text.sample_features` for rows of the goal's length, each estimate steered towards ``goal``.

    ``goal`` as of `steering.toward`. With ``adapters`` their blended estimates are steered; the numbers with targets
    are in the state without noise, as the last steered estimate has them (as in Shafir et al. 2024, algorithm 2, whose
    numbers are known beforehand; here they depend on where the rest of the body goes).
    """
    check_prompts(prompts)
    pairs = [one if isinstance(one, tuple) else (one, 1 / len(adapters)) for one in adapters]
    weights, adapted_nets = [weight for _, weight in pairs], lru_cache(1)(partial(_adapted_nets, pairs))
    chosen, change = Sampling.of(sampling, settings), toward(goal, prior)
    mask = goal_feature_mask(goal)

    def steer(denoise: Denoiser, batch: Batch) -> Denoiser:
        if not pairs:
            return corrected(denoise, [change] * len(batch.rows))
        own = prior.for_words(prompts[batch.rows[0]])
        net = partial(
            blended,
            adapted_nets(own.net),
            batch.cond,
            weights=weights,
            guidance=strength(own, chosen, [prompts[row] for row in batch.rows]),
        )
        return _conditioned(net, change, prior, mask)

    rows = Rows(prompts, [len(goal)] * len(prompts), seeds)
    states = dict(
        sample(
            prior, rows, chosen, edits=[steer], progress=progress, view=single_person_view(prior), choose=best_in_words
        )
    )
    return [prior.to_features(states[row]) for row in range(len(prompts))]


def _adapted_nets(adapters: Sequence[Weighted], net: PriorSession) -> list[PriorSession]:
    return [adapted(net, adapter) for adapter, _ in adapters]


def goal_feature_mask(goal: Goal) -> np.ndarray:
    """(frames, 263) bool: the numbers of the representation that a goal is about, frame by frame."""
    mask = np.zeros((len(goal), len(named("root"))), dtype=bool)
    mask[goal.mask[:, 0].any(axis=-1)] |= named("root_horizontal")
    mask[goal.mask[:, 0, 1], 3] = True
    for joint in range(1, len(SMPL22)):
        mask[goal.mask[:, joint].any(axis=-1), ric(joint)] = True
    return mask


def fitting_adapters(prior: Prior, goal: Goal) -> list[Adapter]:
    """The adapters beside the shipped weights for a goal: one per joint that has its own, else ``any``.

    MotionloomError where there are none, for other weights than those they belong to, and for damaged files.
    """
    names = shipped()
    if not names:
        raise MotionloomError(
            "no adapters lie in weights/control of this installation: they come with the repository, not with the "
            "package; name adapter files, or control without them, which is as good"
        )
    requested = {("trajectory" if joint == "pelvis" else joint) for joint in goal.joints}
    chosen = {name if name in names else "any" for name in requested} & set(names)
    return [Adapter.load(name, prior) for name in sorted(chosen)]


def _conditioned(
    net: Callable[[np.ndarray, np.ndarray], Denoiser], change: Correction, prior: Prior, mask: np.ndarray
) -> Denoiser:
    """The steered denoiser that shows its networks the last steered estimate, free of noise, where ``mask`` is True.

    ``net`` (known, mask) is the denoiser of the networks that see the known numbers. At the first level none is known.
    """
    last: np.ndarray | None = None

    def denoise(state: np.ndarray, level: int) -> np.ndarray:
        nonlocal last
        if last is None:
            denoised = net(np.zeros_like(state), np.zeros(state.shape, np.bool_))(state, level)
        else:
            mixed = mix(state, prior.schedule.at(level)[0] * last, mask)
            denoised = net(last, np.broadcast_to(mask, state.shape))(mixed, level)
        last = np.stack([change(row, level) for row in denoised])
        return last

    return denoise


def evaluate(motion: Motion, sampled: Motion, goal: Goal) -> Controlled:
    """How far ``motion`` is from the targets of ``goal``, joint by joint and frame by frame."""
    off = np.where(goal.mask, motion.positions() - goal.positions, 0.0)
    has_target = goal.mask.any(axis=-1)
    distance = np.linalg.norm(off, axis=-1)
    if not has_target.any():
        return Controlled(motion, sampled, 0.0, 0.0, ())
    order = np.argsort(-distance, axis=None)[:SENTENCES]
    worst = [np.unravel_index(k, distance.shape) for k in order]
    missed = tuple(
        f"{SMPL22.names[joint]} at {frame / motion.fps:.2f} s is {distance[frame, joint]:.2f} m away from its goal"
        for frame, joint in worst
        if distance[frame, joint] > MISSED
    )
    return Controlled(motion, sampled, float(distance[has_target].mean()), float(distance.max()), missed)
