"""Two people and what else there is: an answer to somebody's motion, and long duets of several prompts.

A long duet is a chain of rows as in `tasks.long`, each holding both people. Neighbouring rows agree on what each person
does where they overlap; where the two stand to each other is drawn for the first row, and carried along by everybody's
own way into every further one, at each guess.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, tee

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from motionloom.diffusion import SOLVERS, Link, levels, staggered
from motionloom.edits.relative_pose import Lead, leader
from motionloom.errors import MotionloomError
from motionloom.features import pair as two
from motionloom.features.layout import FPS, WIDTH
from motionloom.features.pair import one_world
from motionloom.goals.goal import Goal
from motionloom.goals.segment import LONGEST, Segment
from motionloom.motion import Motion
from motionloom.nets.pair import PLACE, PairNet, join, part
from motionloom.nets.prior import PriorNet
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.skeleton import SMPL22
from motionloom.tasks.body import bodies
from motionloom.tasks.control import moved
from motionloom.tasks.long import Progress as Moves
from motionloom.tasks.long import Row, Track, bound_together, chain_rows, in_world, same_net
from motionloom.tasks.pair import (
    Duet,
    Seed,
    check_asked,
    known_state,
    pair_features,
    person_seeds,
    placement,
    prompts_of,
    standing_at,
)
from motionloom.tasks.splice import person_at_20, worn
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS, Progress, check, finish, smooth
from motionloom.tasks.watching import Latest
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]

SHORTEST = 1.0
"""Seconds of the shortest motion that somebody can react to."""
AT_ONCE = 8
"""Rows of a long duet that are denoised at once."""


# Somebody is given


def react(
    prior: Prior,
    block: PairBlock,
    given: Motion,
    prompt: str = "",
    *,
    count: int = 1,
    seed: Seed = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Duet]:
    """``count`` duets whose first person is ``given``, bit for bit, and whose second is drawn to go with it.

    given: one person on any humanoid skeleton that stands upright along +Y, 1 to 60 seconds, at any rate. The second
    is the 22-joint person, of as many frames at that rate, in the same world and on the same floor. An empty prompt
    asks for nothing in particular. together: as of `pair.pair_features`. Raises `MotionloomError` for what cannot be
    asked.
    """
    said = prompts_of(prompt)
    check_asked(prior, count=count, seed=seed, seconds=given.seconds)
    if not SHORTEST - 1e-6 <= given.seconds <= LONGEST:
        raise MotionloomError(
            f"the given motion is {given.seconds:.2f} s long; {SHORTEST:g} to {LONGEST:g} s can be reacted to"
        )
    legs = read_body(given.skeleton).leg, read_body(SMPL22).leg
    ratio = float(np.mean(legs)) / legs[1]
    alone = person_at_20(given)
    places = one_world([alone, alone], legs)[0]
    known, stands, _ = two.encode(np.stack([places, places]))
    net = block.net(prior)
    data, mask = known_state(prior, net, torch.from_numpy(known), torch.from_numpy(stands), known.shape[1])
    mask[:, 0] = mask[1] = False
    features, drawn = pair_features(
        prior, net, said * count, known.shape[1],
        seeds=[s for number in range(count) for s in person_seeds(seed, number)],
        known=data.repeat(count, 1, 1), mask=mask.repeat(count, 1, 1),
        guidance=guidance, steps=steps, together=together, progress=progress,
    )  # fmt: skip
    floor, made = _floor(given), []
    at = np.arange(len(given)) / given.fps * FPS
    for numbers, standing in zip(features, drawn.double().numpy(), strict=True):
        stand = standing_at(standing, placement(stands[0]), 0)[1]
        other = moved(finish(prior, numbers[1], clean=clean), placement(stand)).at(at, given.fps)
        height = np.array([0.0, floor, 0.0])
        made.append((given, replace(other, root=other.root * [ratio, 1.0, ratio] + height)))
    return made


def _floor(motion: Motion) -> float:
    """Metres: the height on which somebody's own motion stands; raises where it does not stand upright along +Y."""
    few = motion.frames(0, min(len(motion), round(3 * motion.fps) + 2))
    uniform, own = to_smpl22(few), joints22(few)
    worn(uniform.positions(), few, clean=False)
    ratio = read_body(motion.skeleton).leg / read_body(SMPL22).leg
    return float(np.median(own[:, 0, 1] - ratio * uniform.root[:, 1]))


# Several prompts


def compose_pair(
    prior: Prior,
    block: PairBlock,
    segments: Sequence[Segment],
    *,
    seed: int = 0,
    path: Goal | None = None,
    person: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    clean: bool = True,
    at_once: int = AT_ONCE,
    progress: Moves | None = None,
) -> Iterator[Duet]:
    """One long duet, block after block in one world, as it is made; in memory that does not grow with its length.

    segments: as of `long.compose`; a text with "::" in it says what the first and what the second person does. In all
    there are ``round(seconds * 20)`` frames of each segment. path: where ``person`` is on the ground in every frame of
    the whole, in the world; goals of segments are his too. The first person starts at the origin facing +Z, or
    ``person`` where the path begins. together: as of `pair.pair_features`; whoever has a goal is not moved by it.
    Raises `MotionloomError` for what cannot be asked.
    (Shafir et al. 2024, sections 3 and 4, in one loop; nothing published does both.)
    """
    check_asked(prior, count=1, seed=seed, person=person)
    check(prior, [], steps=steps, guidance=guidance, solver=SOLVER)
    if not segments:
        raise MotionloomError("there is no segment; say what the two people do, one after the other")
    track = None if path is None else Track.along(path, prior.fps)
    asked = [_asked(segments, i, track if i == person else None, person) for i in (0, 1)]
    drawn = duet_features(
        prior, block.net(prior), asked, seed=seed, guidance=guidance, steps=steps, together=together, at_once=at_once,
        progress=progress,
    )  # fmt: skip
    features, stands = next(drawn)
    if track:
        stands = standing_at(stands, track.stands(0), person)
    pieces = tee(chain([features], (piece for piece, _ in drawn)))
    people = [
        bodies(
            in_world(
                prior, _of(pieces[i], i), deque(segment.goal for segment in asked[i]), placement(stands[i]),
                track if i == person else None,
            ),
            prior.fps, clean=clean,
        )
        for i in (0, 1)
    ]  # fmt: skip
    yield from zip(*people, strict=True)


def _asked(segments: Sequence[Segment], person: int, track: Track | None, goals_of: int) -> list[Segment]:
    """The segments of one person; on a path each has its part among its wishes."""
    result, first = [], 0
    for segment in segments:
        own = replace(segment, text=prompts_of(segment.text)[person], goal=segment.goal if person == goals_of else None)
        frames = round(own.seconds * FPS)
        result.append(track.led(own, first, frames) if track else own)
        first += frames
    return result


def _of(pieces: Iterable[Tensor], person: int) -> Iterator[Tensor]:
    return (piece[person] for piece in pieces)


@torch.inference_mode()
def duet_features(
    prior: Prior,
    net: PairNet,
    segments: Sequence[Sequence[Segment]],
    *,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    together: float = 1.0,
    at_once: int = AT_ONCE,
    progress: Moves | None = None,
) -> Iterator[tuple[Tensor, Array]]:
    """Pieces (2, frames, 263), not standardised, one per segment, and stands (2, 4) at the first frame of the first.

    segments: those of each person, of equal lengths and transitions. Strung together the pieces are the two motions.
    Row i draws from ``seed + i``. ``at_once``: rows per network call; it changes speed and memory, not the result.
    """
    way = levels(prior.schedule, steps, spacing=SPACING)
    guess = _Guess(prior, net, way, together)

    def links() -> Iterator[Link]:
        both = (chain_rows(prior, one, guidance, None) for one in segments)
        for number, row in enumerate(zip(*both, strict=True)):
            goals = [one[number].goal for one in segments]
            guess.add(number, row, asked=[goal is not None and not goal.empty for goal in goals], seed=seed + number)
            yield Link(row[0].length, row[0].overlap, seed + number)

    walk = staggered(
        links(), guess, levels=way, solver=SOLVERS[SOLVER], schedule=prior.schedule, features=2 * (WIDTH + PLACE),
        together=at_once, moved=progress or (lambda count: None),
    )  # fmt: skip
    for number, state in enumerate(walk):
        row = guess.rows[number][0]
        guess.drop(number)
        motion, places = _parted(state)
        motion = smooth(motion) if prior.net.config.patch > 1 else motion
        features = motion[:, row.before : row.before + row.frames] * prior.std + prior.mean
        yield features.cpu(), net.talk.config.places.decode(places).cpu().double().numpy()


def _parted(state: Tensor) -> tuple[Tensor, Tensor]:
    """A row (length, 534) of the chain to two motions (2, length, 263) and, from its first frame, D (2, 4)."""
    motion = state[:, : 2 * WIDTH].unflatten(1, (2, WIDTH)).transpose(0, 1)
    return motion, state[0, 2 * WIDTH :].view(2, PLACE)


def _strung(motion: Tensor, places: Tensor) -> Tensor:
    """The inverse of `_parted`: D stands in the first frame, and zeros behind it."""
    row = motion.transpose(0, 1).flatten(1)
    return torch.cat([row, F.pad(places.reshape(1, -1), (0, 0, 0, len(row) - 1))], dim=1)


@dataclass(eq=False)
class _Guess:
    """The guided guess of rows of a chain; it remembers everybody's last one, which says where the next row begins."""

    prior: Prior
    net: PairNet
    way: Sequence[int]
    together: float
    rows: dict[int, tuple[Row, ...]] = field(default_factory=dict)
    leads: dict[int, Lead] = field(default_factory=dict)
    ends: dict[tuple[int, int], Tensor] = field(default_factory=dict)
    """Stands (2, 4) at the frame of a row with which the next one begins, by row and level of the guess."""
    noise: dict[int, Tensor] = field(default_factory=dict)
    """(2, 4) that each row's D began as."""
    nets: dict[int, PairNet] = field(default_factory=dict)
    """The network of each row, with its segment's adapters."""
    seen: Latest = field(init=False)

    def __post_init__(self) -> None:
        self.seen = Latest(len(self.way) - 1)

    def __call__(self, numbers: Sequence[int], states: Sequence[Tensor], at: Sequence[int]) -> list[Tensor]:
        parts = [_parted(state.to(self.prior.mean)) for state in states]
        shown = [self._shown(n, places, level) for n, (_, places), level in zip(numbers, parts, at, strict=True)]
        frames = [motion.shape[1] for motion, _ in parts]
        x = torch.cat(
            [
                join(places, F.pad(motion, (0, 0, 0, max(frames) - motion.shape[1])))
                for places, (motion, _) in zip(shown, parts, strict=True)
            ]
        )
        cleans = self._guesses(numbers, x.unflatten(0, (-1, 2)), frames, at)
        made = []
        for number, count, level, clean, (state, _) in zip(numbers, frames, at, cleans, parts, strict=True):
            places, motion = part(clean)
            rows = zip(motion[:, :count], self.rows[number], strict=True)
            motion = torch.stack([row.correct(one, level) for one, row in rows])
            begin = self._begin(number, level)
            begin = self.net.talk.config.places.decode(places) if begin is None else begin
            motion = self._led(number, level, motion, begin, state=state)
            made.append(_strung(motion, places))
            self._carry(number, level, motion, begin)
            self.seen.add([number], [(motion, begin, self.rows[number][0])])
        self.seen.report(self._placed)
        return made

    def add(self, number: int, row: tuple[Row, ...], *, asked: Sequence[bool], seed: int) -> None:
        """Take in a row of the chain, of both people; ``asked``: who is asked to be somewhere."""
        self.rows[number] = row
        self.nets[number] = self._net(row[0].net)
        self.leads[number] = leader(
            self.prior, self.nets[number], bound_together([one.cond for one in row]), seeds=person_seeds(seed, 0),
            mask=torch.zeros(2, 1 + row[0].length, WIDTH, dtype=torch.bool, device=self.prior.mean.device),
            still=asked, weight=self.together,
        )  # fmt: skip

    def drop(self, number: int) -> None:
        """Forget a row that is finished, as its neighbours are."""
        del self.rows[number], self.leads[number], self.nets[number]
        self.ends = {key: stands for key, stands in self.ends.items() if key[0] != number - 1}
        self.noise.pop(number, None)

    def _shown(self, number: int, places: Tensor, level: int) -> Tensor:
        """D as the network sees it: drawn for the first row, else the end of the row before, noised as learned."""
        noise, end = self.noise.setdefault(number, places), self._begin(number, level)
        if end is None:
            return places
        return self.prior.schedule.noised(self.net.talk.config.places.encode(end), level, noise)

    def _begin(self, number: int, level: int) -> Tensor | None:
        """Where the two stand when a row begins, by what the row before guessed one level earlier: which of the two
        moves first must not matter."""
        step = self.way.index(level)
        return self.ends.get((number - 1, self.way[step - 1])) if step else None

    def _led(self, number: int, level: int, motion: Tensor, begin: Tensor, *, state: Tensor) -> Tensor:
        """The guess of a row, its people led to each other from where they begin."""
        places = self.net.talk.config.places.encode(begin)
        return part(self.leads[number](join(places, state), join(places, motion), level))[1]

    def _placed(self, parts: Sequence[tuple[Tensor, Tensor, Row]]) -> np.ndarray:
        """(2, frames, 22, 3) of rows between their seams: guesses (2, frames, 263), where they begin, and the row."""
        placed = []
        for motion, begin, row in parts:
            features = motion * self.prior.std + self.prior.mean
            own = features[:, row.before : row.before + row.frames]
            placed.append(two.decode(own, two.later(features, begin, row.before)))
        return torch.cat(placed, dim=1).cpu().numpy()

    def _carry(self, number: int, level: int, motion: Tensor, begin: Tensor) -> None:
        row, features = self.rows[number][0], motion * self.prior.std + self.prior.mean
        self.ends[number, level] = two.later(features, begin, row.length - max(row.overlap, 1))

    def _net(self, base: PriorNet) -> PairNet:
        """The block over the prior's network, or over that network with a segment's adapters in it."""
        if base is self.prior.net:
            return self.net
        known = (self.nets[n] for n, row in self.rows.items() if n in self.nets and row[0].net is base)
        return next(known, None) or self.net.over(base)

    def _guesses(self, numbers: Sequence[int], x: Tensor, frames: Sequence[int], at: Sequence[int]) -> list[Tensor]:
        """Guided guesses (2, 1 + frames, numbers) of rows x, one network call for each set of adapters."""
        cleans: dict[int, Tensor] = {}
        for places in same_net([self.rows[number][0] for number in numbers]):
            some = [numbers[i] for i in places]
            rows = [row for number in some for row in self.rows[number]]
            made = self._guided(
                self.nets[some[0]], rows, x[places].flatten(0, 1), [frames[i] for i in places], [at[i] for i in places]
            )
            cleans.update(zip(places, made.unflatten(0, (-1, 2)), strict=True))
        return [cleans[i] for i in range(len(numbers))]

    def _guided(self, net: PairNet, rows: Sequence[Row], x: Tensor, frames: Sequence[int], at: Sequence[int]) -> Tensor:
        """``rows``, and rows of x: a0, b0, a1, b1, ...; frames and levels: one per pair."""
        lengths = torch.tensor(frames, device=x.device).repeat_interleave(2).repeat(2)
        level = torch.tensor(at, device=x.device).repeat_interleave(2).repeat(2)
        bound = bound_together([row.cond for row in rows] + [row.null for row in rows])._replace(lengths=lengths)
        conditional, unconditional = net(torch.cat([x, x]), level, bound).chunk(2)
        scale = torch.tensor([row.guidance for row in rows]).to(x)[:, None, None]
        return torch.lerp(unconditional, conditional, scale)
