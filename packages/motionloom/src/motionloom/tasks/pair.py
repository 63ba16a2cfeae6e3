"""Two people at once: from words, one of them on a path, or going on from what both did (Shafir et al. 2024, ComMDM).

Both are sampled by one frozen prior that a communication block makes listen to itself (`nets.pair`). Their features are
each relative to the own first frame; the relative pose of the two is sampled with them and puts both into one world.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.diffusion import Denoiser, NoiseSource, row_noise, row_seed
from motionloom.edits.bodies import Bodies
from motionloom.edits.fitting import fit
from motionloom.edits.meeting import Meeting, met
from motionloom.edits.relative_pose import people, relative_pose_guidance
from motionloom.edits.steering import Correction, corrected_rows, toward
from motionloom.errors import MotionloomError
from motionloom.features import pair as two
from motionloom.features.humanml import positions_at
from motionloom.features.layout import FPS, LAYOUT, WIDTH
from motionloom.features.pair import one_world, together
from motionloom.goals.contact import read_contact
from motionloom.goals.goal import Goal, start_of
from motionloom.goals.roles import prompts_of
from motionloom.ground import GroundPose, compose, relative
from motionloom.motion import Motion
from motionloom.requests.sampling import PairSampling, PairSettings, Seed
from motionloom.requests.shared import LONGEST
from motionloom.retarget import to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.runtime.pair import PLACE, PairSession, join, part
from motionloom.tasks.control import moved
from motionloom.tasks.long import Past, lengthened
from motionloom.tasks.sampling import Batch, Observed, Progress, Rows, sample
from motionloom.tasks.splice import concatenated, continued
from motionloom.tasks.text import finish, frames_in
from motionloom.tasks.watching import View
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]
Duet = tuple[Motion, Motion]
Prompt = str | tuple[str, str]

PAIRS = 8
"""Pairs denoised at once."""
CONTEXT = 3.0
"""Seconds of a past that are looked at for where its floor is."""
SEEN = 40
"""Frames of a past, at 20 per second, that the network sees."""
LEAST = 4
"""Frames behind a past that are put on a skeleton at once, at least, for its seam to fade over."""
MOST = 10_000.0
"""Seconds of all duets together that are made in one call."""


@dataclass(frozen=True, eq=False)
class PairEdits:
    """What is known of rows, and how their denoised estimates are changed; a row is a person: a0, b0, a1, b1, ..."""

    observed: Observed | None = None
    """(rows, 1 + frames, 263) of `nets.pair`: the slot of D, then the motion."""
    corrections: Sequence[Correction | None] | None = None
    """What each row's denoised motion (frames, 263), standardised, goes through, as of `steering`."""
    frozen: Sequence[bool] | None = None
    """Whose motion is not moved by pair guidance; those that are corrected, unless said otherwise."""
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
) -> tuple[np.ndarray, np.ndarray]:
    """Features (pairs, 2, frames, 263), not standardised, and relative poses (pairs, 2, 4) of `features.pair`.

    Args:
        net: the block over the prior's network.
        prompts: one per row; rows are people, a0, b0, a1, b1, ...; an empty prompt asks for nothing.
        frames: of each motion.
        seeds: one per row. With a block that says nothing a row is what `text.sample_features` makes of its seed.
        edits: what is known, and what changes the estimates.
        sampling: or single settings of it as keywords; ``batch_size`` counts pairs.

    Raises:
        MotionloomError: for what cannot be asked.
    """
    chosen, rows, given = PairSampling.of(sampling, settings), len(prompts), edits or PairEdits()
    changes, meetings = list(given.corrections or [None] * rows), given.meetings or [None] * (rows // 2)
    frozen = [one is not None for one in changes] if given.frozen is None else list(given.frozen)
    if rows % 2 or rows == 0 or {len(seeds), len(changes), len(frozen)} != {rows}:
        raise MotionloomError(
            f"two people need two prompts and seeds a pair; got {rows} prompts and {len(seeds)} seeds"
        )
    known = False if given.observed is None else given.observed.mask
    mask = np.broadcast_to(known, (rows, 1 + frames, len(prior.mean)))
    bodies = [Bodies.of(mask[k : k + 2], frozen[k : k + 2], meetings[k // 2]) for k in range(0, rows, 2)]

    def corrected(state: np.ndarray, batch: Sequence[int], level: int) -> np.ndarray:
        own = [changes[i] for i in batch]
        return np.concatenate([state[:, :1], corrected_rows(state[:, 1:], own, level)], axis=1) if any(own) else state

    def two_bodies(own: list[Bodies], state: np.ndarray, batch: list[int], level: int) -> np.ndarray:
        if not chosen.bodies or net.silent:
            return state
        return np.where(mask[batch], state, _two_bodies(prior, net, own, state, level))

    def edit(denoise: Denoiser, batch: Batch) -> Denoiser:
        own = [bodies[row // 2] for row in batch.rows[::2]]
        own = [deepcopy(one) for one in own] if batch.trial else own
        guided = relative_pose_guidance(
            prior,
            net,
            net.bind(batch.cond),
            seeds=batch.seeds,
            mask=mask[batch.rows],
            frozen=[frozen[i] for i in batch.rows],
            weight=chosen.pair_guidance,
        )

        def changed(state: np.ndarray, level: int) -> np.ndarray:
            led = guided(state, corrected(denoise(state, level), batch.rows, level), level)
            return two_bodies(own, led, batch.rows, level)

        return changed

    guidance = chosen.guidance if any(prompt.strip() for prompt in prompts) else 1.0
    how = replace(chosen, batch_size=2 * chosen.batch(PAIRS), guidance=guidance)
    asked, view = Rows(prompts, [1 + frames] * rows, seeds, pair_noise), _view(prior, net)
    walk = sample(prior, asked, how, network=net, edits=[edit], observed=given.observed, progress=progress, view=view)
    made = dict(walk)
    state = np.stack([made[row] for row in range(rows)])
    state = np.concatenate([state[:, :1], prior.smoothed(state[:, 1:])], axis=1)
    if given.observed is not None:
        state = np.where(mask, given.observed.values, state)
    places, motion = part(two_bodies(bodies, corrected(state, range(rows), 0), list(range(rows)), 0))
    return people(motion * prior.std + prior.mean), net.places.decode(people(places))


def _two_bodies(prior: Prior, net: PairSession, bodies: list[Bodies], state: np.ndarray, level: int) -> np.ndarray:
    """Denoised states (2 * pairs, 1 + frames, 263), those of each pair changed as `Bodies.edit` does."""
    places, motion = (people(each).copy() for each in part(state))
    for i, one in enumerate(bodies):
        poses = net.places.decode(places[i])
        motion[i], places[i], _ = one.edit(prior, net.places, motion[i], places[i], poses, level=level)
    return join(places.reshape(-1, PLACE), motion.reshape(-1, *motion.shape[2:]))


def _view(prior: Prior, net: PairSession) -> View:
    """Two rows to a motion, in the world of the first person."""

    def poses(states: np.ndarray) -> Array:
        places, motion = part(states)
        ground = net.places.decode(people(places))
        return two.decode(people(motion * prior.std + prior.mean), ground).astype(np.float64)

    return View(poses, people=2)


def pair_noise(seeds: Sequence[int]) -> NoiseSource:
    """Noise of rows' own seeds; a motion gets the noise it has where nobody else is there, the slot before it other."""
    places, motion = row_noise([row_seed(seed, 0, 1) for seed in seeds]), row_noise(seeds)
    return lambda like: np.concatenate([places(like[:, :1]), motion(like[:, 1:])], axis=1)


def person_seeds(seed: Seed, number: int) -> tuple[int, int]:
    """The seeds of both people of duet ``number``; ``seed`` is one for both, or one for each person."""
    if isinstance(seed, tuple):
        return row_seed(seed[0], number), row_seed(seed[1], number)
    return row_seed(seed, number), row_seed(seed, number, 1)


def pair_seeds(sampling: PairSampling) -> list[int]:
    """One seed per row of as many duets as are to be made."""
    return [seed for number in sampling.numbers() for seed in person_seeds(sampling.seed, number)]


def known_state(prior: Prior, net: PairSession, features: np.ndarray, poses: np.ndarray, frames: int) -> Observed:
    """A state (2, 1 + frames, 263) in which the first frames of two people are known, and their ground poses.

    features: (2, known frames, 263), not standardised; poses: (2, 4). The network sees them without noise.
    """
    motion = (features.astype(np.float32) - prior.mean) / prior.spread
    places = net.places.encode(poses.astype(np.float32))
    state = join(places, lengthened(motion, frames))
    mask = np.zeros(state.shape, np.bool_)
    mask[:, : 1 + motion.shape[1]] = True
    return Observed(state, mask, noise_free=True)


def known_places(net: PairSession, poses: np.ndarray, frames: int) -> Observed:
    """A state (2, 1 + frames, 263) in which only the ground poses (2, 4) of two people at frame 0 are known."""
    state = join(net.places.encode(poses.astype(np.float32)), np.zeros((2, frames, WIDTH), np.float32))
    mask = np.zeros(state.shape, np.bool_)
    mask[:, 0] = True
    return Observed(state, mask, noise_free=True)


def stacked(pairs: Sequence[Observed]) -> Observed:
    """What is known of several pairs."""
    values, masks = (np.concatenate(parts) for parts in zip(*((one.values, one.mask) for one in pairs), strict=True))
    return replace(pairs[0], values=values, mask=masks)


def meetings_of(prompts: tuple[str, str], sampling: PairSampling) -> list[Meeting | None]:
    """How the two of each duet touch, where their prompts say that they do."""
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
    """Make duets: two people of the 22-joint skeleton at 20 frames per second in one world.

    Args:
        block: what makes two people of one prior.
        prompt: what both do together, or (what the first does, what the second does); ``"A :: B"`` says the same.
        seconds: length; not looked at where there is a goal, which has its own.
        goals: what the first and the second person are asked to do in the world, who then start at its `start_of`; two
            goals are of one length. Without any the first person starts at the origin facing +Z.
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords. Duet i depends on ``seed`` and i alone; two seeds are one for
            each person, and go with the person where people are exchanged.
        progress: called after each network call with the calls done and the calls in all.

    Raises:
        MotionloomError: for what cannot be asked.
    """
    said, chosen = prompts_of(prompt), PairSampling.of(sampling, settings)
    if not all(words.strip() for words in said):
        raise MotionloomError("a prompt is empty; say in words what the two people do")
    goal = goals[0] or goals[1]
    check_pair(prior, count=chosen.number(), seconds=len(goal) / FPS if goal else seconds)
    frames = _goal_frames(goals) if goal else frames_in(seconds, prior.fps)
    starts = [start_of(one) if one else GroundPose() for one in goals]
    change = [toward(one.seen_from(start), prior) if one else None for one, start in zip(goals, starts, strict=True)]
    person = 0 if goals[0] or not goals[1] else 1
    net = block.net(prior)
    observed = known_places(net, np.stack([start.numbers() for start in starts]), frames) if all(goals) else None
    count, meetings = chosen.number(), meetings_of(said, chosen)
    features, poses = pair_features(
        prior,
        net,
        said * count,
        frames,
        seeds=pair_seeds(chosen),
        edits=PairEdits(stacked([observed] * count) if observed else None, change * count, meetings=meetings),
        sampling=chosen,
        progress=progress,
    )
    made = []
    for numbers, beside, meeting in zip(features, poses.astype(np.float64), meetings, strict=True):
        if goal:
            beside = poses_at(beside, starts[person], person)
        people = [finish(prior, one, foot_lock=foot_lock) for one in numbers]
        duet = [moved(one, GroundPose.of_numbers(pose)) for one, pose in zip(people, beside, strict=True)]
        duet = [fit(one, goal) if goal else one for one, goal in zip(duet, goals, strict=True)]
        made.append(met(duet, meeting, goals) if chosen.bodies else (duet[0], duet[1]))
    return made


def poses_at(poses: Array, place: GroundPose, person: int) -> Array:
    """Ground poses (2, 4) moved rigidly on the ground so that that of ``person`` is ``place``."""
    return compose(place.numbers(), relative(poses[person], poses))


def _goal_frames(goals: Sequence[Goal | None]) -> int:
    goal, *others = (goal for goal in goals if goal)
    longest = round(LONGEST * FPS)
    if any(len(other) != len(goal) for other in others):
        raise MotionloomError(
            f"the goals of the two people have {len(goal)} and {len(others[0])} frames; give both the same length"
        )
    if not 4 <= len(goal) <= longest:
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be followed; one of 4 to {longest} can")
    return len(goal)


def check_pair(prior: Prior, *, count: int = 1, seconds: float = 0.0) -> None:
    """Raise MotionloomError for weights that make no two people, and for more than one call makes."""
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers a frame; two people need {WIDTH} at {FPS:g} fps"
        )
    if count > 1 and count * seconds > MOST:
        raise MotionloomError(
            f"{count} duets of {seconds:g} s cannot be made in one call; ask for 1 or more, of {MOST:g} s together"
        )


def check_person(person: int) -> int:
    """0 or 1; raises MotionloomError for anybody else."""
    if person not in (0, 1):
        raise MotionloomError(f"the two people are 0 and 1; there is no person {person}")
    return person


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
            skeleton that stands upright along +Y, which it keeps. The last `SEEN` frames (at 20 per second) are seen.
        prompt: as of `generate_pair`; an empty one asks for nothing in particular.
        seconds: how far to go on.
        foot_lock: keep planted feet still.
        sampling, progress: as of `generate_pair`.

    Raises:
        MotionloomError: for what cannot be asked, also as `data.pairs.together` does.
    """
    said, chosen = prompts_of(prompt), PairSampling.of(sampling, settings)
    check_pair(prior, count=chosen.number(), seconds=seconds)
    if not 0 < seconds <= LONGEST:
        raise MotionloomError(f"two people cannot go on for {seconds:g} s; ask for more than 0 and at most {LONGEST:g}")
    ground, added = Ground.of(past), max(round(seconds * past[0].fps), 1)
    known, poses, floors = ground.encoded()
    seen = known.shape[1]
    frames = seen + int(np.ceil(added / past[0].fps * FPS - 1e-6)) + 1
    net, count = block.net(prior), chosen.number()
    observed = known_state(prior, net, known, poses, frames)
    leaving = [Past(one, GroundPose()).holder(prior, frames) for one in known]
    edits = PairEdits(
        stacked([observed] * count), leaving * count, frozen=[False] * (2 * count), meetings=meetings_of(said, chosen)
    )
    features, _ = pair_features(
        prior, net, said * count, frames, seeds=pair_seeds(chosen), edits=edits, sampling=chosen, progress=progress
    )
    made = []
    for numbers in features.astype(np.float64):
        places = two.decode(numbers, poses) + floors[:, None, None, None] * np.array([0.0, 1.0, 0.0])
        contacts = numbers[..., LAYOUT["contacts"]]
        duet = [ground.behind(i, places[i], contacts[i], seen, added, foot_lock=foot_lock) for i in (0, 1)]
        made.append((duet[0], duet[1]))
    return made


@dataclass(frozen=True, eq=False)
class Ground:
    """Two people's own motions and the one ground on which both are uniform people (`data.pairs`)."""

    motions: Duet
    tails: Duet
    """Their last seconds."""
    legs: tuple[float, float]
    """Metres."""

    @staticmethod
    def of(motions: Duet) -> "Ground":
        """Raises `MotionloomError` as `data.pairs.together` does."""
        first, second = motions
        alike = len(first) == len(second) and abs(first.fps - second.fps) <= 1e-3 * first.fps
        count = round(CONTEXT * first.fps) + 2 if alike else max(len(first), len(second))
        tails = tuple(motion.frames(max(len(motion) - count, 0), len(motion)) for motion in motions)
        together(tails[0], tails[1], name="the past of the two")
        legs = [read_body(motion.skeleton).leg for motion in motions]
        return Ground(motions, (tails[0], tails[1]), (legs[0], legs[1]))

    def encoded(self) -> two.Encoded:
        """The last frames at 20 per second, up to `SEEN`; the last is the motions' last, and goes straight on."""
        count, fps = len(self.tails[0]), self.tails[0].fps
        seen = min(int((count - 1) / fps * FPS + 1e-6) + 1, SEEN)
        at = count - 1 - np.arange(seen)[::-1] / FPS * fps
        uniform = one_world([to_smpl22(tail).positions() for tail in self.tails], self.legs)
        places = np.stack([positions_at(person, at) for person in uniform])
        return two.encode(np.concatenate([places, 2 * places[:, -1:] - places[:, -2:-1]], axis=1))

    def own(self, person: int, places: Array) -> Array:
        """Places (frames, 22, 3) on the common ground as the uniform person that ``person`` alone is: `one_world`
        undone."""
        ratio = float(np.mean(self.legs)) / self.legs[person]
        return places + (ratio - 1.0) * places[:, :1] * np.array([1.0, 0.0, 1.0])

    def behind(self, person: int, places: Array, contacts: Array, seen: int, added: int, *, foot_lock: bool) -> Motion:
        """The person's motion with ``added`` frames more: places (frames, 22, 3) at 20 per second on the common
        ground, contacts (frames, 4); frame ``seen - 1`` is the motion's last."""
        motion = self.motions[person]
        shown = int((seen - 1) / FPS * motion.fps + 1e-6) + 1
        tail = motion.frames(len(motion) - shown, len(motion))
        at = (np.arange(shown + max(added, LEAST)) - (shown - 1)) / motion.fps * FPS + seen - 1
        nearest = np.clip(at.round().astype(int), 0, len(contacts) - 1)
        sampled = positions_at(self.own(person, places), at)
        new = continued(tail, sampled, contacts=contacts[nearest], foot_lock=foot_lock)
        return concatenated(motion, new.frames(0, added))
