"""Two people and what else there is: a second person for a motion, and long duets of several prompts.

A long duet is a chain of rows as in `tasks.long`, each holding both people. Neighbouring rows agree on what each person
does where they overlap; the relative pose of the two is sampled for the first row, and carried along by everybody's
own way into every further one, at each step.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from itertools import chain, tee
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose
from motionloom.core.models.networks.pair import PLACE, PairSession, join, part
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.edits.meeting import Bodies, Meeting
from motionloom.edits.relative_pose import PoseGuidance, relative_pose_guidance
from motionloom.goals.contact import read_contact
from motionloom.goals.goal import Goal
from motionloom.goals.roles import prompts_of
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import PairSampling, PairSettings
from motionloom.tasks.body import solve_stream
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.long import (
    Row,
    Track,
    chain_rows,
    guided_estimates,
    place_pieces,
    segments_on,
    stack_conditions,
    zero_padded,
)
from motionloom.tasks.pair import (
    PairEdits,
    check_pair,
    meetings_of,
    pair_features,
    pair_seeds,
    person_seeds,
)
from motionloom.tasks.people import Duet, Partner
from motionloom.tasks.sampling import Moves, Progress, sample_chain
from motionloom.tasks.splice import concatenate
from motionloom.tasks.watching import ChainView

Array = NDArray[np.float64]

BATCH = 8
"""Rows of a long duet in one network call."""


# An answer to somebody's motion


def react(
    prior: Prior,
    block: PairBlock,
    motion: Motion,
    prompt: str = "",
    *,
    foot_lock: bool = True,
    sampling: PairSampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[PairSettings],
) -> list[Duet]:
    """Duets whose first person is ``motion``, bit for bit, and whose second is sampled to go with it.

    Args:
        motion: one person on any humanoid skeleton that stands upright along +Y, 1 to 60 seconds, at any rate. The
            second is the 22-joint person, of as many frames at that rate, in the same world and on the same floor.
        prompt: as of `pair.generate_pair`; an empty one is no condition.
        foot_lock: keep the second person's planted feet still.
        sampling, progress: as of `pair.generate_pair`.

    Raises:
        MotionloomError: for an impossible request.
    """
    prompts, chosen = prompts_of(prompt), PairSampling.of(sampling, settings)
    check_pair(prior, count=chosen.number(), seconds=motion.seconds)
    prior = prior.for_words(*prompts)
    partner, net, count = Partner.of(motion), block.net(prior), chosen.number()
    known = partner.state(net, count)
    sampled = pair_features(
        prior,
        net,
        prompts * count,
        known.values.shape[1] - 1,
        seeds=pair_seeds(chosen),
        edits=PairEdits(known, meetings=meetings_of(prompts, chosen)),
        sampling=chosen,
        progress=progress,
    )
    return [(motion, partner.answer(prior, one, foot_lock=foot_lock)) for one in sampled.each()]


# Several prompts


def compose_pair(
    prior: Prior,
    block: PairBlock,
    segments: Sequence[Segment],
    *,
    path: Goal | None = None,
    person: int = 0,
    other: Goal | None = None,
    foot_lock: bool = True,
    sampling: PairSampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[PairSettings],
) -> Duet:
    """One long duet; the arguments and errors are those of `compose_pair_stream`, which yields the same in blocks."""
    chosen = PairSampling.of(sampling, settings)
    more: dict[str, Any] = {
        "path": path,
        "person": person,
        "other": other,
        "foot_lock": foot_lock,
        "progress": progress,
    }
    first, second = zip(*compose_pair_stream(prior, block, segments, sampling=chosen, **more), strict=True)
    return concatenate(*first), concatenate(*second)


def compose_pair_stream(
    prior: Prior,
    block: PairBlock,
    segments: Sequence[Segment],
    *,
    path: Goal | None = None,
    person: int = 0,
    other: Goal | None = None,
    foot_lock: bool = True,
    sampling: PairSampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[PairSettings],
) -> Iterator[Duet]:
    """One long duet, block after block in one world, as it is sampled; in memory that does not grow with its length.

    Args:
        segments: as of `long.compose_stream`; a text with "::" in it says what the first and what the second person
            does. In all there are ``round(seconds * 20)`` frames of each.
        path: where ``person`` is on the ground in every frame of the whole, in the world; goals of segments are that
            person's too. The first person starts at the origin facing +Z, or ``person`` where the path begins.
        person: 0 or 1; whoever has a goal is not moved by pair guidance.
        other: a path as ``path``, of the other person; goes with one.
        foot_lock: keep planted feet still.
        sampling, progress: as of `long.compose_stream`, with `PairSampling`.

    Raises:
        MotionloomError: for an impossible request.

    (Shafir et al. 2024, sections 3 and 4, in one loop; nothing published does both.)
    """
    check_pair(prior)
    if person not in (0, 1):
        raise MotionloomError(f"the two people are 0 and 1; there is no person {person}")
    chosen = PairSampling.of(sampling, settings).alone()
    chosen.levels(prior.schedule)
    if not segments:
        raise MotionloomError("there is no segment; say what the two people do, one after the other")
    tracks = [None if one is None else Track.along(one, prior.fps) for one in (path, other)][:: -1 if person else 1]
    both = [_segments_of(segments, i, tracks[i], person) for i in (0, 1)]
    if other is not None and path is None:
        raise MotionloomError("a path of the other person goes with one of the first; give both")
    begin = np.stack([track.place(0).numbers() for track in tracks if track]) if other is not None else None
    sampled = duet_features(prior, block.net(prior), both, begin=begin, sampling=chosen, progress=progress)
    first = next(sampled)
    if begin is not None:
        first = PairMotion(first.features, begin)
    elif track := tracks[person]:
        first = first.moved_to(track.place(0).numbers(), person)
    pieces = tee(chain([first], sampled))
    people = [
        solve_stream(
            place_pieces(
                prior,
                _features_of_person(pieces[i], i),
                deque(segment.goal for segment in both[i]),
                GroundPose.of_numbers(first.poses[i]),
                tracks[i],
            ),
            prior.fps,
            foot_lock=foot_lock,
        )
        for i in (0, 1)
    ]
    yield from zip(*people, strict=True)


def _segments_of(segments: Sequence[Segment], person: int, track: Track | None, goals_of: int) -> list[Segment]:
    """The segments of one person; on a path each has its part among its targets."""
    own = (
        replace(one, text=prompts_of(one.text)[person], goal=one.goal if person == goals_of else None)
        for one in segments
    )
    return list(segments_on(track, own, FPS))


def _features_of_person(pieces: Iterable[PairMotion], person: int) -> Iterator[np.ndarray]:
    return (piece.features[person] for piece in pieces)


def duet_features(
    prior: Prior,
    net: PairSession,
    segments: Sequence[Sequence[Segment]],
    *,
    begin: Array | None = None,
    sampling: PairSampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[PairSettings],
) -> Iterator[PairMotion]:
    """Pieces, one per segment; the ground poses of the first one are those of the very first frame.

    segments: those of each person, of equal lengths and transitions. Strung together the pieces are the two motions.
    begin: the ground poses (2, 4) of the first frame, where they are known.
    Row i is sampled from ``seed + i``. ``batch_size``: rows per network call; it changes speed and memory, not the
    result.
    """
    chosen = PairSampling.of(sampling, settings)
    denoise = _PairDenoiser(prior, net, chosen.levels(prior.schedule), chosen.pair_guidance, chosen.bodies, begin)
    both = (
        chain_rows(prior, one, chosen, None, beside=other) for one, other in zip(segments, segments[::-1], strict=True)
    )
    rows = denoise.rows(zip(*both, strict=True), segments, chosen.seeds(1)[0])
    states = sample_chain(
        prior,
        rows,
        denoise,
        chosen,
        features=2 * (WIDTH + PLACE),
        batch_size=BATCH,
        progress=progress,
        view=ChainView(denoise.row_motion, denoise.poses),
        choose=best_in_words,
    )
    for row, state in states:
        row.before = None  # what a finished row began with is needed no more
        motion, places = _split_state(state)
        features = row.people[0].between(prior.smoothed(motion)) * prior.std + prior.mean
        yield PairMotion(features, net.places.decode(places).astype(np.float64))


def _split_state(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A row (length, 534) of the chain to two motions (2, length, 263) and, from its first frame, D (2, 4)."""
    motion = state[:, : 2 * WIDTH].reshape(-1, 2, WIDTH).swapaxes(0, 1)
    return motion, state[0, 2 * WIDTH :].reshape(2, PLACE)


def _join_state(motion: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The inverse of `_split_state`: D is in the first frame, and zeros behind it."""
    frames = motion.shape[1]
    row = motion.swapaxes(0, 1).reshape(frames, -1)
    return np.concatenate([row, zero_padded(places.reshape(1, -1), frames)], axis=1)


@dataclass(eq=False)
class _PairRow:
    """A row of the chain: both people of a segment."""

    people: tuple[Row, ...]
    net: PairSession
    """With the segment's adapters."""
    guidance: PoseGuidance
    bodies: Bodies | None
    before: "_PairRow | None"
    """The row before, as long as this one is under way."""
    first: bool = False
    noise: np.ndarray | None = None
    """(2, 4) that this row's D began as."""
    ends: dict[int, np.ndarray] = field(default_factory=dict)
    """Relative poses (2, 4) at the frame with which the next row begins, by level of the estimate."""

    @property
    def texts(self) -> tuple[str, ...]:
        """What each does."""
        return tuple(one.text for one in self.people)

    def alone(self) -> "_PairRow":
        """The row without the one before, and with what is found in it."""
        return replace(self, bodies=deepcopy(self.bodies), before=None, noise=None, ends={})

    def motions(self, state: np.ndarray) -> np.ndarray:
        """(2, frames, 263) between the seams."""
        return self.people[0].between(_split_state(state)[0])

    @property
    def length(self) -> int:
        """Frames."""
        return self.people[0].length

    @property
    def overlap(self) -> int:
        """Frames shared with the next row."""
        return self.people[0].overlap


@dataclass(frozen=True, eq=False)
class _PairDenoiser:
    """Guided estimates of rows of a chain; each row remembers its last one, from which the next row begins."""

    prior: Prior
    net: PairSession
    levels: Sequence[int]
    pair_guidance: float
    bodies: bool
    begin: Array | None = None
    """Ground poses (2, 4) of the first frame of the first row, where they are known."""

    def rows(
        self, both: Iterable[tuple[Row, ...]], segments: Sequence[Sequence[Segment]], seed: int
    ) -> Iterator[_PairRow]:
        """The rows of the chain; whoever has a goal is not moved by pair guidance."""
        before: _PairRow | None = None
        for number, both_of in enumerate(both):
            goals = [one[number].goal for one in segments]
            net = self._net(both_of[0].net, before)
            mask = np.zeros((2, 1 + both_of[0].length, WIDTH), np.bool_)
            frozen = [goal is not None and not goal.empty for goal in goals]
            guidance = relative_pose_guidance(
                self.prior,
                net,
                stack_conditions([one.cond for one in both_of]),
                seeds=person_seeds(seed + number, 0),
                mask=mask,
                frozen=frozen,
                weight=self.pair_guidance,
            )
            contact = read_contact([one[number].text for one in segments])
            bodies = Bodies.of(mask, frozen, Meeting(contact) if contact else None, still=int(before is not None))
            edited_bodies = bodies if self.bodies and not net.silent else None
            before = _PairRow(both_of, net, guidance, edited_bodies, before, first=number == 0)
            yield before

    def __call__(self, rows: Sequence[_PairRow], states: Sequence[np.ndarray], at: Sequence[int]) -> list[np.ndarray]:
        parts = [_split_state(state) for state in states]
        inputs = [
            join(self._conditioning_pose(row, places, level), motion)
            for row, (motion, places), level in zip(rows, parts, at, strict=True)
        ]
        nets = {id(person): row.net for row in rows for person in row.people}
        denoised = guided_estimates(
            [person for row in rows for person in row.people],
            [state for pair in inputs for state in pair],
            [level for level in at for _ in (0, 1)],
            net=lambda person: nets[id(person)],
            slots=1,
        )
        estimates = []
        for row, level, *pair, (state, _) in zip(rows, at, denoised[::2], denoised[1::2], parts, strict=True):
            places, motion = part(np.stack(pair))
            each = zip(motion, row.people, strict=True)
            motion = np.stack([person.correct(part_of, level) for part_of, person in each])
            begin = self._begin_poses_or_sampled(places, row, level)
            motion = self._with_pose_guidance(row, level, motion, begin, state=state)
            if row.bodies:
                state, begin = row.bodies.edit(self.prior, self.net.places, join(places, motion), level, begin)
                places, motion = part(state)
            estimates.append(_join_state(motion, places))
            end = row.length - max(row.overlap, 1)
            row.ends[level] = self._pair(motion, begin).crop(end, end).poses
        return estimates

    def _conditioning_pose(self, row: _PairRow, places: np.ndarray, level: int) -> np.ndarray:
        """D as the network sees it: sampled for the first row, else the end of the row before, noised as learned."""
        row.noise, end = places if row.noise is None else row.noise, self._begin_poses(row, level)
        if end is None:
            return places
        return self.prior.schedule.noised(self.net.places.encode(end), level, row.noise)

    def _begin_poses(self, row: _PairRow, level: int) -> np.ndarray | None:
        """The ground poses when a row begins, by what the row before estimated one level earlier: which of the two
        moves first must not matter."""
        if row.first:
            return self.begin
        step = self.levels.index(level)
        return row.before.ends.get(self.levels[step - 1]) if step and row.before else None

    def _begin_poses_or_sampled(self, places: np.ndarray, row: _PairRow, level: int) -> np.ndarray:
        """The same; for the first row and at the first level that of D (2, 4)."""
        begin = self._begin_poses(row, level)
        return self.net.places.decode(places) if begin is None else begin

    def _pair(self, motion: np.ndarray, begin: np.ndarray) -> PairMotion:
        """A standardised motion (2, frames, 263) that begins with ground poses (2, 4)."""
        return PairMotion(motion * self.prior.std + self.prior.mean, begin)

    def row_motion(self, row: _PairRow, state: np.ndarray, level: int) -> PairMotion:
        """A denoised row between its seams."""
        (motion, places), one = _split_state(state), row.people[0]
        return self._pair(motion, self._begin_poses_or_sampled(places, row, level)).crop(
            one.before, one.before + one.frames
        )

    def poses(self, motions: list[PairMotion]) -> Array:
        """(2, frames, 22, 3) of the motions of rows (`row_motion`)."""
        return np.concatenate([one.places() for one in motions], axis=1)

    def _with_pose_guidance(
        self, row: _PairRow, level: int, motion: np.ndarray, begin: np.ndarray, *, state: np.ndarray
    ) -> np.ndarray:
        """The estimate of a row, its people moved to each other from where they begin."""
        places = self.net.places.encode(begin)
        return part(row.guidance(join(places, state), join(places, motion), level))[1]

    def _net(self, base: PriorSession, before: _PairRow | None) -> PairSession:
        """The block over the prior's network, or over that network with a segment's adapters in it."""
        if base is self.prior.net:
            return self.net
        return before.net if before and before.people[0].net is base else self.net.over(base)
