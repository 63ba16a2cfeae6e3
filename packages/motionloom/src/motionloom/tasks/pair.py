"""Two people at once: from words, one of them on a path, or going on from what both did (Shafir et al. 2024, ComMDM).

Both are sampled by one frozen prior that a communication block makes listen to itself (`nets.pair`). Their features are
each relative to the own first frame; the relative pose of the two is sampled with them and puts both into one world.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np

from motionloom.core.diffusion import Denoiser, row_seed
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose
from motionloom.core.methods.com_mdm import pair_noise
from motionloom.core.methods.edit import Observed
from motionloom.core.models.networks.pair import PairSession, people
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.edits.fitting import fit
from motionloom.edits.meeting import Bodies, Meeting, met
from motionloom.edits.relative_pose import relative_pose_guidance
from motionloom.edits.steering import Correction, corrected_rows, toward
from motionloom.goals.contact import read_contact
from motionloom.goals.goal import Goal, start_of
from motionloom.goals.roles import prompts_of
from motionloom.requests.sampling import PairSampling, PairSettings, Seed
from motionloom.requests.shared import LONGEST
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.history import holding_correction
from motionloom.tasks.people import Duet, PairPast, finish_person, known_state
from motionloom.tasks.sampling import Batch, Progress, Rows, sample
from motionloom.tasks.text import check_goal_length, check_humanml, frames_in
from motionloom.tasks.watching import View

Prompt = str | tuple[str, str]

PAIRS = 8
"""Pairs denoised at once."""
MOST = 10_000.0
"""Seconds of all duets of one call together, at most."""


@dataclass(frozen=True, eq=False)
class PairEdits:
    """What is known of rows, and how their denoised estimates are changed; a row is a person: a0, b0, a1, b1, ..."""

    observed: Observed | None = None
    """(rows, 1 + frames, 263) of `nets.pair`: the slot of D, then the motion."""
    corrections: Sequence[Correction | None] | None = None
    """What each row's denoised motion (frames, 263), standardised, goes through, as of `steering`."""
    frozen: Sequence[bool] | None = None
    """Whose motion is not moved by pair guidance; those that are corrected where this is None."""
    meetings: Sequence[Meeting | None] | None = None
    """How the two of each pair touch."""


def pair_features(
    prior: Prior,
    net: PairSession,
    prompts: Sequence[str],
    frames: int,
    *,
    seeds: Sequence[int],
    edits: PairEdits | None = None,
    sampling: PairSampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[PairSettings],
) -> PairMotion:
    """Pairs, of features (pairs, 2, frames, 263) and poses (pairs, 2, 4).

    Args:
        net: the block over the prior's network.
        prompts: one per row; rows are people, a0, b0, a1, b1, ...; an empty prompt is no condition.
        frames: of each motion.
        seeds: one per row. With a silent block a row is that of `text.sample_features` with its seed.
        edits: what is known, and what changes the estimates.
        sampling: or single settings of it as keywords; ``batch_size`` counts pairs.

    Raises:
        MotionloomError: for an impossible request.
    """
    chosen, rows, row_edits = PairSampling.of(sampling, settings), len(prompts), edits or PairEdits()
    changes = list(row_edits.corrections or [None] * rows)
    meetings = row_edits.meetings or [None] * (rows // 2)
    frozen = [one is not None for one in changes] if row_edits.frozen is None else list(row_edits.frozen)
    if rows % 2 or rows == 0 or {len(seeds), len(changes), len(frozen)} != {rows}:
        raise MotionloomError(
            f"two people need two prompts and seeds a pair; got {rows} prompts and {len(seeds)} seeds"
        )
    known = False if row_edits.observed is None else row_edits.observed.mask
    mask = np.broadcast_to(known, (rows, 1 + frames, len(prior.mean)))
    changed = _PairEdit(prior, net, chosen, changes, frozen, mask, meetings)
    guidance = chosen.guidance if any(prompt.strip() for prompt in prompts) else 1.0
    how = replace(chosen, batch_size=2 * chosen.batch(PAIRS), guidance=guidance)
    batch_rows = Rows(prompts, [1 + frames] * rows, seeds, pair_noise, slots=1)
    view = View(lambda states: net.pairs(states).places().astype(np.float64), people=2)
    states = dict(
        sample(
            prior,
            batch_rows,
            how,
            network=net,
            edits=[changed],
            corrected=True,
            observed=row_edits.observed,
            progress=progress,
            view=view,
            choose=best_in_words,
        )
    )
    return net.pairs(np.stack([states[row] for row in range(rows)]))


@dataclass(frozen=True, eq=False)
class _PairEdit:
    """Estimates of rows, changed by their corrections, by the block's pose guidance, and as bodies."""

    prior: Prior
    net: PairSession
    sampling: PairSampling
    changes: Sequence[Correction | None]
    frozen: Sequence[bool]
    mask: np.ndarray
    """(rows, 1 + frames, 263) True where states are known."""
    meetings: Sequence[Meeting | None]
    """Of each pair; what its rows find out about it is stored there."""

    def __call__(self, denoise: Denoiser, batch: Batch) -> Denoiser:
        """The denoiser of some rows, changed; an edit of `sample`."""
        rows, prior, net = batch.rows, self.prior, self.net
        mask, frozen, own = self.mask[rows], [self.frozen[i] for i in rows], [self.changes[i] for i in rows]
        meetings = [self.meetings[row // 2] for row in rows[::2]]
        meetings = [deepcopy(one) for one in meetings] if batch.trial else meetings
        bodies = [Bodies.of(*one) for one in zip(people(mask), people(np.array(frozen)), meetings, strict=True)]
        weight = self.sampling.pair_guidance
        guide = relative_pose_guidance(
            prior, net, net.bind(batch.cond), seeds=batch.seeds, mask=mask, frozen=frozen, weight=weight
        )

        def changed(state: np.ndarray, level: int) -> np.ndarray:
            clean = denoise(state, level)
            if any(own):
                clean = np.concatenate([clean[:, :1], corrected_rows(clean[:, 1:], own, level)], axis=1)
            clean = guide(state, clean, level) if level else clean
            if not self.sampling.bodies or net.silent:
                return clean
            pairs = zip(bodies, people(clean), strict=True)
            bodies_edited = [one.edit(prior, net.places, pair, level)[0] for one, pair in pairs]
            return np.where(mask, clean, np.concatenate(bodies_edited))

        return changed


def person_seeds(seed: Seed, number: int) -> tuple[int, int]:
    """The seeds of both people of duet ``number``; ``seed`` is one for both, or one for each person."""
    if isinstance(seed, tuple):
        return row_seed(seed[0], number), row_seed(seed[1], number)
    return row_seed(seed, number), row_seed(seed, number, 1)


def pair_seeds(sampling: PairSampling) -> list[int]:
    """One seed per row of all duets of a sampling."""
    return [seed for number in sampling.numbers() for seed in person_seeds(sampling.seed, number)]


def meetings_of(prompts: tuple[str, str], sampling: PairSampling) -> list[Meeting | None]:
    """How the two of each duet touch, where their prompts have a contact."""
    contact = read_contact(prompts) if sampling.bodies else None
    return [Meeting(contact) if contact else None for _ in range(sampling.number())]


# From words


def generate_pair(
    prior: Prior,
    block: PairBlock,
    prompt: Prompt,
    *,
    seconds: float = 6.0,
    goals: tuple[Goal | None, Goal | None] = (None, None),
    foot_lock: bool = True,
    sampling: PairSampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[PairSettings],
) -> list[Duet]:
    """Generate duets: two people of the 22-joint skeleton at 20 frames per second in one world.

    Args:
        block: weights for two people with this prior.
        prompt: what both do together, or (what the first does, what the second does); ``"A :: B"`` is the same.
        seconds: length; not looked at where there is a goal, which has its own.
        goals: targets of the first and the second person in the world, who then start at its `start_of`; two
            goals are of one length. Without any the first person starts at the origin facing +Z.
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords. Duet i depends on ``seed`` and i alone; two seeds are one for
            each person, and go with the person where people are exchanged.
        progress: called after each network call with the calls done and the calls in all.

    Raises:
        MotionloomError: for an impossible request.
    """
    prompts, chosen = prompts_of(prompt), PairSampling.of(sampling, settings)
    if not all(words.strip() for words in prompts):
        raise MotionloomError("a prompt is empty; say in words what the two people do")
    prior = prior.for_words(*prompts)
    goal = goals[0] or goals[1]
    check_pair(prior, count=chosen.number(), seconds=len(goal) / FPS if goal else seconds)
    frames = _goal_frames(goals) if goal else frames_in(seconds, prior.fps)
    starts = [start_of(one) if one else GroundPose() for one in goals]
    change = [toward(one.relative_to(start), prior) if one else None for one, start in zip(goals, starts, strict=True)]
    person, net = 0 if goals[0] or not goals[1] else 1, block.net(prior)
    count, meetings = chosen.number(), meetings_of(prompts, chosen)
    first_poses = PairMotion(np.zeros((2, 0, WIDTH)), np.stack([start.numbers() for start in starts]))
    known = known_state(net, PairMotion.stack([first_poses] * count), frames) if all(goals) else None
    edits = PairEdits(known, change * count, meetings=meetings)
    sampled = pair_features(
        prior, net, prompts * count, frames, seeds=pair_seeds(chosen), edits=edits, sampling=chosen, progress=progress
    )
    duets = []
    for one, meeting in zip(sampled.each(), meetings, strict=True):
        one = one.moved_to(starts[person].numbers(), person) if goal else one
        duet = [finish_person(prior, one, i, foot_lock=foot_lock) for i in (0, 1)]
        duet = [fit(one, goal) if goal else one for one, goal in zip(duet, goals, strict=True)]
        duets.append(met(duet, meeting, goals) if chosen.bodies else (duet[0], duet[1]))
    return duets


def _goal_frames(goals: Sequence[Goal | None]) -> int:
    goal, *others = (goal for goal in goals if goal)
    if any(len(other) != len(goal) for other in others):
        raise MotionloomError(
            f"the goals of the two people have {len(goal)} and {len(others[0])} frames; give both the same length"
        )
    check_goal_length(goal, FPS)
    return len(goal)


def check_pair(prior: Prior, *, count: int = 1, seconds: float = 0.0) -> None:
    """Raise MotionloomError for weights that are not for two people, and for more duets than one call gives."""
    check_humanml(prior, "two people need")
    if count > 1 and count * seconds > MOST:
        raise MotionloomError(
            f"{count} duets of {seconds:g} s cannot be made in one call; ask for 1 or more, of {MOST:g} s together"
        )


# Going on


def complete_pair(
    prior: Prior,
    block: PairBlock,
    past: Duet,
    prompt: Prompt = "",
    *,
    seconds: float = 3.0,
    foot_lock: bool = True,
    sampling: PairSampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[PairSettings],
) -> list[Duet]:
    """Duets that begin with both people's past, bit for bit, and go on (Shafir et al. 2024, section 5.2).

    Args:
        past: motions of two people in one world, of equal rate and length, a second or more; each on any humanoid
            skeleton that stands upright along +Y, which it keeps. The network sees the last `PAST_FRAMES`.
        prompt: as of `generate_pair`; an empty one is no condition.
        seconds: how far to go on.
        foot_lock: keep planted feet still.
        sampling, progress: as of `generate_pair`.

    Raises:
        MotionloomError: for an impossible request, also as `data.pairs.together` does.
    """
    prompts, chosen = prompts_of(prompt), PairSampling.of(sampling, settings)
    prior = prior.for_words(*prompts)
    check_pair(prior, count=chosen.number(), seconds=seconds)
    if not 0 < seconds <= LONGEST:
        raise MotionloomError(f"two people cannot go on for {seconds:g} s; ask for more than 0 and at most {LONGEST:g}")
    pasts, added = PairPast.of(past), max(round(seconds * past[0].fps), 1)
    frames = pasts.known.features.shape[-2] + int(np.ceil(added / past[0].fps * FPS - 1e-6)) + 1
    net, count = block.net(prior), chosen.number()
    leaving = [holding_correction(one, prior, frames) for one in pasts.known.features]
    edits = PairEdits(
        known_state(net, PairMotion.stack([pasts.known] * count), frames),
        leaving * count,
        frozen=[False] * (2 * count),
        meetings=meetings_of(prompts, chosen),
    )
    sampled = pair_features(
        prior, net, prompts * count, frames, seeds=pair_seeds(chosen), edits=edits, sampling=chosen, progress=progress
    )
    return [pasts.extend(one, added, foot_lock=foot_lock) for one in sampled.each()]
