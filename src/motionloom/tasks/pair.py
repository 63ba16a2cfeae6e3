"""Two people at once: from words, one of them on a path, or going on from what both did (Shafir et al. 2024, ComMDM).

Both are drawn by one frozen prior that a communication block makes listen to itself (`nets.pair`). Their features tell
each from his own first frame; where the two stand to each other is drawn with them and puts both into one world.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from motionloom.diffusion import SOLVERS, Draw, guide, inpaint, levels, observe, row_draw, row_seed, sample
from motionloom.diffusion.sampling import Snapshot
from motionloom.edits.fitting import fit
from motionloom.edits.relative_pose import leader
from motionloom.edits.steering import Correction, toward
from motionloom.errors import MotionloomError
from motionloom.features import pair as two
from motionloom.features.humanml import positions_at
from motionloom.features.layout import FPS, LAYOUT, WIDTH
from motionloom.features.pair import one_world, together
from motionloom.goals.goal import Goal, Placement, placement_of
from motionloom.goals.segment import LONGEST
from motionloom.motion import Motion
from motionloom.nets.pair import PairNet, join, part
from motionloom.retarget import to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.tasks.control import moved
from motionloom.tasks.long import Past
from motionloom.tasks.splice import concatenated, kept_parts, splice, worn
from motionloom.tasks.text import (
    GUIDANCE,
    LARGEST_SEED,
    SOLVER,
    SPACING,
    STEPS,
    Progress,
    check,
    finish,
    frames_in,
    smooth,
)
from motionloom.tasks.watching import reported
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]
Duet = tuple[Motion, Motion]
Prompt = str | tuple[str, str]
Seed = int | tuple[int, int]

PAIRS = 8
"""Pairs denoised at once."""
MARK = "::"
"""Parts what the first person does from what the second does, in one text."""
CONTEXT = 3.0
"""Seconds of a past that are looked at for where its floor is."""
SEEN = 40
"""Frames of a past, at 20 per second, that the network sees."""
LEAST = 4
"""Frames behind a past that are put on a skeleton at once, at least, for its seam to fade over."""
MOST = 10_000.0
"""Seconds of all duets together that are made in one call."""


@torch.inference_mode()
def pair_features(
    prior: Prior,
    net: PairNet,
    prompts: Sequence[str],
    frames: int,
    *,
    seeds: Sequence[int],
    known: Tensor | None = None,
    mask: Tensor | None = None,
    change: Sequence[Correction | None] | None = None,
    still: Sequence[bool] | None = None,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    quiet: bool = True,
    progress: Progress | None = None,
) -> tuple[Tensor, Tensor]:
    """Features (pairs, 2, frames, 263), not standardised, and stands (pairs, 2, 4) of `features.pair`.

    prompts, seeds: one per row; rows are people, a0, b0, a1, b1, ...; an empty prompt asks for nothing. known
    (rows, 1 + frames, 263), mask (the same, or what broadcasts; True where known): a state of `nets.pair` that is given
    in part (`known_state`); with ``quiet`` the network sees it without noise (Shafir et al. 2024, section 3.3), else at
    the noise of its level (RePaint). change: for each row, or None, what its every guess goes through, standardised
    (frames, 263), as of `steering`. together, 0 to 1: how far every guess is led to where the block says that the two
    stand to each other later on (`duet_places`; 0: as published); rows that are ``still`` are not moved for that: whose
    guesses are changed, unless said otherwise. With a block that says nothing a row is what
    `text.sample_features` makes of its prompt and seed. No more than `PAIRS` pairs are denoised at once. Raises
    MotionloomError for what cannot be asked.
    """
    rows = len(prompts)
    changes = list(change or [None] * rows)
    kept = [one is not None for one in changes] if still is None else list(still)
    if rows % 2 or rows == 0 or {len(seeds), len(changes), len(kept)} != {rows}:
        raise MotionloomError(
            f"two people need two prompts and seeds a pair; got {rows} prompts and {len(seeds)} seeds"
        )
    check(prior, [], steps=steps, guidance=guidance, solver=SOLVER)
    shape = (rows, 1 + frames, len(prior.mean))
    data = torch.zeros(shape) if known is None else known.expand(shape)
    here = torch.zeros(shape, dtype=torch.bool) if mask is None else mask.expand(shape)
    made = []
    for start in range(0, rows, 2 * PAIRS):
        some = slice(start, start + 2 * PAIRS)
        held = _Held(
            data[some].to(prior.mean), here[some].to(prior.mean.device), changes[some], kept[some], quiet, together
        )

        def told(done: int, before: int = start // (2 * PAIRS) * steps) -> None:
            if progress:
                progress(before + done, -(-rows // (2 * PAIRS)) * steps)

        made.append(
            _walked(prior, net, prompts[some], seeds[some], held=held, guidance=guidance, steps=steps, told=told)
        )
    places, motion = part(torch.cat(made))
    features = motion * prior.std + prior.mean
    stands = net.talk.config.places.decode(places.unflatten(0, (-1, 2)))
    return features.unflatten(0, (-1, 2)).cpu(), stands.cpu()


@dataclass(frozen=True, eq=False)
class _Held:
    """What is known of some rows, and how their guesses are changed."""

    data: Tensor
    mask: Tensor
    changes: list[Correction | None]
    still: list[bool]
    quiet: bool
    together: float

    def changed(self, guess: Tensor, level: int) -> Tensor:
        """States whose motions went through the changes."""
        if not any(self.changes):
            return guess
        rows = [
            row if change is None else torch.cat([row[:1], change(row[1:], level)])
            for row, change in zip(guess, self.changes, strict=True)
        ]
        return torch.stack(rows)


def _walked(
    prior: Prior,
    net: PairNet,
    prompts: Sequence[str],
    seeds: Sequence[int],
    *,
    held: _Held,
    guidance: float,
    steps: int,
    told: Callable[[int], None],
) -> Tensor:
    """Clean states of some rows."""
    cond = prior.condition(list(prompts))
    scale = guidance if any(prompt.strip() for prompt in prompts) else 1.0
    guided = inpaint(guide(net, net.bind(cond), net.bind(cond.null()), scale), held.data, held.mask)
    lead = leader(prior, net, net.bind(cond), seeds=seeds, mask=held.mask, still=held.still, weight=held.together)

    def denoise(state: Tensor, level: int) -> Tensor:
        return lead(state, held.changed(guided(state, level), level), level)

    way, draw = levels(prior.schedule, steps, spacing=SPACING), pair_draw(seeds)
    hold = observe(held.data, held.mask, prior.schedule, torch.zeros_like if held.quiet else draw)
    state = hold(draw(held.data), way[0])
    walk = sample(
        denoise, state, levels=way, solver=SOLVERS[SOLVER], schedule=prior.schedule, draw=draw, constrain=hold
    )

    def placed(snapshot: Snapshot) -> np.ndarray:
        places, motion = part(snapshot.clean)
        stands = net.talk.config.places.decode(places.unflatten(0, (-1, 2)))
        return two.decode((motion * prior.std + prior.mean).unflatten(0, (-1, 2)), stands).cpu().numpy()

    for done, snapshot in enumerate(reported(walk, steps, range(len(prompts) // 2), placed), start=1):
        state = snapshot.state
        told(done)
    if prior.net.config.patch > 1:
        state = torch.cat([state[:, :1], smooth(state[:, 1:])], dim=1)
    return held.changed(torch.where(held.mask, held.data, state), 0)


def pair_draw(seeds: Sequence[int]) -> Draw:
    """Noise of rows' own seeds; a motion gets the noise it has where nobody else is there, the slot before it other."""
    places, motion = row_draw([row_seed(seed, 0, 1) for seed in seeds]), row_draw(seeds)
    return lambda like: torch.cat([places(like[:, :1]), motion(like[:, 1:])], dim=1)


def person_seeds(seed: Seed, number: int) -> tuple[int, int]:
    """The seeds of both people of duet ``number``; ``seed`` is one for both, or one for each person."""
    if isinstance(seed, tuple):
        return row_seed(seed[0], number), row_seed(seed[1], number)
    return row_seed(seed, number), row_seed(seed, number, 1)


def prompts_of(prompt: Prompt) -> tuple[str, str]:
    """What the first and what the second person is told: a text with `MARK` parts them, one without is for both."""
    if isinstance(prompt, tuple):
        return prompt
    said = [words.strip() for words in prompt.split(MARK)]
    if len(said) == 1:
        return prompt, prompt
    if len(said) > 2 or not all(said):
        raise MotionloomError(f"the prompt {prompt[:60]!r} must have words for each person around one {MARK}")
    return said[0], said[1]


def known_state(prior: Prior, net: PairNet, features: Tensor, stands: Tensor, frames: int) -> tuple[Tensor, Tensor]:
    """A state (2, 1 + frames, 263) and its mask: the first frames of two people and where they stand.

    features: (2, known frames, 263), not standardised; stands: (2, 4). For several pairs: concatenate.
    """
    spread = torch.where(prior.std > 0, prior.std, 1.0)
    motion = (features.to(prior.mean) - prior.mean) / spread
    places = net.talk.config.places.encode(stands.to(prior.mean))
    state = join(places, F.pad(motion, (0, 0, 0, frames - motion.shape[1])))
    mask = torch.zeros_like(state, dtype=torch.bool)
    mask[:, : 1 + motion.shape[1]] = True
    return state, mask


# From words


def generate_pair(
    prior: Prior,
    block: PairBlock,
    prompt: Prompt,
    *,
    seconds: float = 6.0,
    count: int = 1,
    seed: Seed = 0,
    goal: Goal | None = None,
    person: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Duet]:
    """Make ``count`` duets: two people of the 22-joint skeleton at 20 frames per second in one world.

    prompt: what both do together, or (what the first does, what the second does); ``"A :: B"`` says the same. seed:
    duet i depends on it and i alone; two numbers are one for each person, and go with him where people are exchanged.
    The first person starts at the origin facing +Z. goal: what ``person`` (0 or 1) is asked in the world (`Goal`), who
    then starts at its `placement_of`; the duet is as long as the goal, and ``seconds`` is not looked at. guidance,
    steps, clean: as of `text.generate`; together: as of `pair_features`. Raises `MotionloomError` for what cannot be
    asked.
    """
    said = prompts_of(prompt)
    if not all(words.strip() for words in said):
        raise MotionloomError("a prompt is empty; say in words what the two people do")
    length = len(goal) / FPS if goal else seconds
    check_asked(prior, count=count, seed=seed, person=person, seconds=length)
    frames = _goal_frames(goal) if goal else frames_in(seconds, prior.fps)
    place = placement_of(goal) if goal else Placement()
    change: list[Correction | None] = [None, None]
    if goal:
        change[person] = toward(goal.seen_from(place), prior)
    features, stands = pair_features(
        prior, block.net(prior), said * count, frames,
        seeds=[s for number in range(count) for s in person_seeds(seed, number)],
        change=change * count, guidance=guidance, steps=steps, together=together, progress=progress,
    )  # fmt: skip
    made = []
    for numbers, standing in zip(features, stands.double().numpy(), strict=True):
        if goal:
            standing = standing_at(standing, place, person)
        duet = [moved(finish(prior, f, clean=clean), placement(s)) for f, s in zip(numbers, standing, strict=True)]
        if goal:
            duet[person] = fit(duet[person], goal)
        made.append((duet[0], duet[1]))
    return made


def placement(stand: np.ndarray) -> Placement:
    """A stand (4,) of `features.pair` as a `Placement`."""
    c, s, x, z = (float(number) for number in stand)
    return Placement(x, z, float(np.arctan2(s, c)))


def standing_at(stands: Array, place: Placement, person: int) -> Array:
    """Stands (2, 4) moved rigidly on the ground so that ``person`` stands at a place."""
    there = np.array([np.cos(place.facing), np.sin(place.facing), place.x, place.z])
    return two.compose(there, two.seen(stands[person], stands))


def _goal_frames(goal: Goal) -> int:
    longest = round(LONGEST * FPS)
    if not 4 <= len(goal) <= longest:
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be followed; one of 4 to {longest} can")
    return len(goal)


def check_asked(prior: Prior, *, count: int, seed: Seed, person: int = 0, seconds: float = 0.0) -> None:
    """Raise MotionloomError for weights, counts, seeds and people that there are not."""
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers a frame; two people need {WIDTH} at {FPS:g} fps"
        )
    if count < 1 or (count > 1 and count * seconds > MOST):
        raise MotionloomError(
            f"{count} duets of {seconds:g} s cannot be made in one call; ask for 1 or more, of {MOST:g} s together"
        )
    for number in seed if isinstance(seed, tuple) else (seed,):
        if not 0 <= number < LARGEST_SEED:
            raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {number}")
    if person not in (0, 1):
        raise MotionloomError(f"the two people are 0 and 1; there is no person {person}")


# Going on


def complete_pair(
    prior: Prior,
    block: PairBlock,
    past: Duet,
    prompt: Prompt = "",
    *,
    seconds: float = 3.0,
    count: int = 1,
    seed: Seed = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Duet]:
    """``count`` duets that begin with both people's past, bit for bit, and go on for ``seconds``.

    past: motions of two people in one world, of equal rate and length, a second or more; each on any humanoid skeleton
    that stands upright along +Y, which it keeps. The last `SEEN` frames (at 20 per second) are seen. An empty prompt
    asks for nothing in particular. Otherwise as `generate_pair`. Raises `MotionloomError`, also as
    `data.pairs.together` does. (Prefix completion, Shafir et al. 2024, section 5.2.)
    """
    said = prompts_of(prompt)
    check_asked(prior, count=count, seed=seed, seconds=seconds)
    if not 0 < seconds <= LONGEST:
        raise MotionloomError(f"two people cannot go on for {seconds:g} s; ask for more than 0 and at most {LONGEST:g}")
    ground, added = Ground.of(past), max(round(seconds * past[0].fps), 1)
    known, stands, floors = ground.encoded()
    seen = known.shape[1]
    frames = seen + int(np.ceil(added / past[0].fps * FPS - 1e-6)) + 1
    net = block.net(prior)
    data, mask = known_state(prior, net, torch.from_numpy(known), torch.from_numpy(stands), frames)
    leaving = [Past(torch.from_numpy(one).float(), Placement()).holder(prior, frames) for one in known]
    features, _ = pair_features(
        prior, net, said * count, frames, seeds=[s for number in range(count) for s in person_seeds(seed, number)],
        known=data.repeat(count, 1, 1), mask=mask.repeat(count, 1, 1), change=leaving * count,
        still=[False] * (2 * count), guidance=guidance, steps=steps, together=together, progress=progress,
    )  # fmt: skip
    made = []
    for numbers in features.double().numpy():
        places = two.decode(numbers, stands) + floors[:, None, None, None] * np.array([0.0, 1.0, 0.0])
        contacts = numbers[..., LAYOUT["contacts"]]
        duet = [ground.behind(i, places[i], contacts[i], seen, added, clean=clean) for i in (0, 1)]
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

    def behind(self, person: int, places: Array, contacts: Array, seen: int, added: int, *, clean: bool) -> Motion:
        """The person's motion with ``added`` frames more: places (frames, 22, 3) at 20 per second on the common
        ground, contacts (frames, 4); frame ``seen - 1`` is the motion's last."""
        motion = self.motions[person]
        shown = int((seen - 1) / FPS * motion.fps + 1e-6) + 1
        tail = motion.frames(len(motion) - shown, len(motion))
        old = concatenated(tail, *[tail.frames(shown - 1, shown)] * max(added, LEAST))
        at = (np.arange(len(old)) - (shown - 1)) / motion.fps * FPS + seen - 1
        nearest = np.clip(at.round().astype(int), 0, len(contacts) - 1)
        drawn = positions_at(self.own(person, places), at)
        made = worn(drawn, old, contacts=contacts[nearest], clean=clean, known=shown)
        nothing = kept_parts(motion.skeleton, frozenset(), np.zeros(3, dtype=bool))
        new = splice(old, made, shown, last=len(old), kept=nothing).frames(shown, shown + added)
        return concatenated(motion, new)
