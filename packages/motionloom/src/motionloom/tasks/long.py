"""Long motion: a list of prompts to one motion without seams, of any length, in constant memory (DoubleTake).

Each segment is a row of the sampler. A row reaches over its seams into the neighbours, half a transition on either
side, and neighbours agree on what they share at every level (`diffusion.staggered`), so that a transition is sampled
knowing what comes before and after it. Rows come out one by one; their features are cut at the seams and strung
together, and a moving window of frames becomes positions and a body.

The published procedure is in `core.methods.double_take`; docs/decisions/0013 compares them.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion import lerp
from motionloom.core.errors import MotionloomError
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.edits.steering import Correction, toward
from motionloom.goals.goal import Goal, merged, overlaid, start_of
from motionloom.goals.paths import along
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import Sampling, Settings
from motionloom.tasks.adapting import adapted_priors, load_adapters
from motionloom.tasks.body import Places, solve_stream
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.history import Past, holding_correction
from motionloom.tasks.sampling import Moves, Network, eased, sample_chain
from motionloom.tasks.splice import concatenate
from motionloom.tasks.text import check_humanml, placed_positions
from motionloom.tasks.watching import ChainView

Array = NDArray[np.float64]

BATCH = 16
"""Rows in one network call."""


@dataclass(frozen=True, eq=False)
class Row:
    text: str
    frames: int
    """Between its seams."""
    before: int
    """Frames of the transition that lie before its first seam."""
    after: int
    overlap: int
    """Frames shared with the next row."""
    guidance: Callable[[int], float]
    cond: Bound
    null: Bound
    correct: Correction
    net: PriorSession
    """The prior's network, with the segment's adapters merged into it."""

    @property
    def length(self) -> int:
        return self.before + self.frames + self.after

    @property
    def texts(self) -> tuple[str, ...]:
        return (self.text,)

    def alone(self) -> "Row":
        return self

    def motions(self, state: np.ndarray) -> np.ndarray:
        return self.between(state)[None]

    def between(self, states: np.ndarray) -> np.ndarray:
        """The frames (..., frames, features) between the seams."""
        return states[..., self.before : self.before + self.frames, :]


def compose(
    prior: Prior,
    segments: Sequence[Segment],
    *,
    start: Motion | None = None,
    path: Goal | None = None,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[Settings],
) -> Motion:
    """One long motion of the 22-joint person.

    The arguments and errors are those of `compose_stream`, which yields the same motion in blocks; here there must be
    a segment, and an end of them.
    """
    if not segments:
        raise MotionloomError("there is no segment; say what the person does, one after the other")
    chosen = Sampling.of(sampling, settings)
    more: Any = {"start": start, "path": path, "foot_lock": foot_lock, "progress": progress}
    return concatenate(*compose_stream(prior, segments, sampling=chosen, **more))


def compose_stream(
    prior: Prior,
    segments: Iterable[Segment],
    *,
    start: Motion | None = None,
    path: Goal | None = None,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[Settings],
) -> Iterator[Motion]:
    """One long motion of the 22-joint person, block after block in one world, as it is sampled.

    For motions of hours: a block has up to 300 frames, and is yielded when it is finished.

    Args:
        prior: weights that make HumanML3D's 263 numbers at 20 frames per second.
        segments: what happens, one after the other, in all the sum of ``round(seconds * 20)`` frames; their goals are
            seen from the person's ground pose when they begin. They may be endless if there is no path; memory does not
            grow with them.
        start: a motion of anybody that this one goes on from, in its place; it is not repeated.
        path: where the pelvis is on the ground in each frame of the whole (`Goal` of that length, in the world).
        foot_lock: keep planted feet still.
        sampling: or single settings of it as keywords; segment i is sampled from ``seed + i``.
        progress: called with the number of further row moves; a segment takes as many as there are steps.

    Raises:
        MotionloomError: for an impossible request.

    (Shafir et al. 2024, section 4, as in docs/decisions/0013.)
    """
    chosen = Sampling.of(sampling, settings).alone()
    past, track, place = _prepare(prior, chosen, start, path)
    goals: deque[Goal | None] = deque()

    def remember_goals() -> Iterator[Segment]:
        for segment in segments:
            goals.append(segment.goal)
            yield segment

    on_path = segments_on(track, remember_goals(), prior.fps)
    pieces = long_features(prior, on_path, past=past, sampling=chosen, progress=progress)
    return solve_stream(place_pieces(prior, pieces, goals, place, track), prior.fps, foot_lock=foot_lock)


def compose_takes(
    prior: Prior,
    segments: Sequence[Segment],
    *,
    start: Motion | None = None,
    path: Goal | None = None,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[Settings],
) -> Iterator[Motion]:
    """As many motions of the same segments as ``count`` says, sampled in the same network calls, one after the other.

    Motion i is that of `compose` with ``seed + i``, up to the rounding of larger matrix products; all of them are seen
    at once while they are denoised (`watching`). The arguments and errors are those of `compose`, but that there is
    an end of the segments.
    """
    chosen = Sampling.of(sampling, settings)
    past, track, place = _prepare(prior, chosen, start, path)
    on_path = list(segments_on(track, segments, prior.fps))
    pieces = long_features(prior, on_path, past=past, sampling=chosen, progress=progress)
    for _ in range(chosen.number()):
        goals = deque(segment.goal for segment in segments)
        own = place_pieces(prior, islice(pieces, len(on_path)), goals, place, track)
        yield concatenate(*solve_stream(own, prior.fps, foot_lock=foot_lock))


def _prepare(
    prior: Prior, sampling: Sampling, start: Motion | None, path: Goal | None
) -> "tuple[Past | None, Track | None, GroundPose]":
    """The past, the path and the ground pose of frame 0; raises for impossible requests."""
    check_humanml(prior, "long motion needs")
    sampling.levels(prior.schedule)
    past = None if start is None else Past.of(start)
    track = None if path is None else Track.along(path, prior.fps)
    return past, track, past.end if past else track.place(0) if track else GroundPose()


def long_features(
    prior: Prior,
    segments: Iterable[Segment],
    *,
    past: "Past | None" = None,
    begin: float = 0.0,
    sampling: Sampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[Settings],
) -> Iterator[np.ndarray]:
    """Features (frames, numbers), not standardised, one piece per segment; strung together they are the long motion.

    Piece i has ``round(seconds * fps)`` frames, the first and the last one more by ``past``. begin: as of
    `watching.Denoised`. ``batch_size``: rows per network call; it changes speed and memory, not
    the result. ``count``: so many motions, the pieces of one behind those of the other; there must be an end of the
    segments then. The others as of `compose`. Raises `MotionloomError` for transitions that do not fit.
    """
    chosen = Sampling.of(sampling, settings)
    last = chosen.levels(prior.schedule)[-2]
    rows, each = chain_rows(prior, segments, chosen, past), None
    if chosen.number() > 1:
        own = list(rows)
        rows, each = own * chosen.number(), len(own)
    place = past.end if past else GroundPose()

    def features(row: Row, state: np.ndarray, _: int = 0) -> np.ndarray:
        return row.between(state) * prior.std + prior.mean

    def denoise(rows: Sequence[Row], states: Sequence[np.ndarray], at: Sequence[int]) -> list[np.ndarray]:
        denoised = _shift_averaged(prior, rows, states, at, last=last)
        return [row.correct(one, level) for row, one, level in zip(rows, denoised, at, strict=True)]

    def poses(pieces: list[np.ndarray]) -> Array:
        return placed_positions(prior, np.concatenate(pieces), place)[None]

    states = sample_chain(
        prior,
        rows,
        denoise,
        chosen,
        features=len(prior.mean),
        batch_size=BATCH,
        progress=progress,
        view=ChainView(features, poses, each, begin),
        choose=best_in_words,
    )
    for row, state in states:
        yield features(row, state)


def chain_rows(
    prior: Prior,
    segments: Iterable[Segment],
    sampling: Sampling,
    past: "Past | None",
    *,
    beside: Sequence[Segment] = (),
) -> Iterator[Row]:
    """The rows of the chain; one segment is read ahead, since the last has no transition behind it.

    beside: what somebody else does meanwhile, who has the same network.
    """
    before, number = len(past.known) if past else 0, 0
    lead, trail, behind = (past.lead, past.trail, past.behind) if past else (0, 0, None)
    adapted = adapted_priors(prior)
    iterator = iter(segments)
    segment = next(iterator, None)
    while segment is not None:
        following = next(iterator, None)
        overlap = 2 * max(1, round(segment.transition * prior.fps / 2)) if following else 0
        frames, shared = round(segment.seconds * prior.fps) + lead, before if number else 0
        frames += 0 if following else trail
        if frames < shared + overlap // 2 or frames < 2:
            raise MotionloomError(
                f"segment {number + 1} ({segment.text[:40]!r}) of {segment.seconds:g} s is shorter than the halves of "
                "its transitions together; make it longer or the transitions shorter"
            )
        after = overlap // 2 if following or behind is None else len(behind)
        length = before + frames + after
        own = adapted(segment.adapters).for_words(segment.text, *(one.text for one in beside[number : number + 1]))
        bound, null = (_bound(own, text, length, (2 * before, overlap)) for text in (segment.text, ""))
        edits = [holding_correction(past.known, prior, length)] if past and not number and len(past.known) else []
        if behind is not None and not following:
            edits.append(holding_correction(behind, prior, length, last=True))
        if segment.goal and not segment.goal.empty:
            edits.append(toward(segment.goal, prior, first=before + lead))
        scale = sampling.strength(prior.schedule, segment.guidance)
        if own.taught:
            scale = partial(_eased_strength, scale, own.guided_shares([segment.text]))
        correct = _chain_corrections(edits)
        yield Row(segment.text, frames, before, after, overlap, scale, bound, null, correct, own.net)
        before, segment, number, lead = overlap // 2, following, number + 1, 0


def _eased_strength(scale: Callable[[int], float], share: np.ndarray, level: int) -> float:
    return float(eased(scale(level), share)[0])


def _bound(prior: Prior, text: str, length: int, shared: tuple[int, int]) -> Bound:
    """The condition of a row; networks with transition flags see the frames it shares with either neighbour."""
    frames, cond = np.arange(length)[None], prior.condition([text], [length])
    flags = np.int64((frames < shared[0]) | (frames >= length - shared[1]))
    return prior.net.bind(cond._replace(flags=flags) if prior.net.config.flags else cond)


def load_segment_adapters(prior: Prior, segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """The same segments, the files of their adapters read: errors in them are raised before anything is sampled."""
    return tuple(
        replace(segment, adapters=load_adapters(prior, segment.adapters)) if segment.adapters else segment
        for segment in segments
    )


def _chain_corrections(edits: Sequence[Correction]) -> Correction:
    def correct(clean: np.ndarray, level: int) -> np.ndarray:
        for edit in edits:
            clean = edit(clean, level)
        return clean

    return correct


def _shift_averaged(
    prior: Prior, rows: Sequence[Row], states: Sequence[np.ndarray], at: Sequence[int], *, last: int
) -> list[np.ndarray]:
    """Estimates; those of the last move are averages over all ways to divide the frames into the network's tokens.

    A token holds several frames, and between tokens the network leaves small steps. (Averaging over shifts is the
    cycle spinning of Coifman & Donoho 1995; `smooth` is the cheaper remedy of single motions.)
    """
    cleans = guided_estimates(rows, states, at)
    ending = [i for i, level in enumerate(at) if level == last]
    shifts = range(1, prior.net.config.patch)
    sums = {i: cleans[i].copy() for i in ending}
    for shift in shifts:
        longer = [i for i in ending if len(states[i]) > shift]
        if not longer:
            break
        some = [rows[i] for i in longer]
        shifted = guided_estimates(some, [states[i][shift:] for i in longer], [last] * len(longer))
        for i, clean in zip(longer, shifted, strict=True):
            sums[i][shift:] += clean
    for i, total in sums.items():
        ways = np.arange(1, len(total) + 1, dtype=total.dtype).clip(max=len(shifts) + 1)
        cleans[i] = total / ways[:, None]
    return cleans


def guided_estimates(
    rows: Sequence[Row],
    states: Sequence[np.ndarray],
    at: Sequence[int],
    *,
    net: Callable[[Row], Network] = lambda row: row.net,
    slots: int = 0,
) -> list[np.ndarray]:
    """Estimates of rows of different lengths and levels, as one network call for each set of adapters.

    net: of a row. slots: tokens before the frames of a state.
    """
    estimates: dict[int, np.ndarray] = {}
    groups: dict[int, list[int]] = {}
    for number, row in enumerate(rows):
        groups.setdefault(id(row.net), []).append(number)
    for numbers in groups.values():
        some, tokens = [rows[i] for i in numbers], [len(states[i]) for i in numbers]
        x = np.stack([zero_padded(states[i], max(tokens)) for i in numbers])
        bound = stack_conditions([row.cond for row in some] + [row.null for row in some])
        bound = bound._replace(lengths=np.array([*tokens, *tokens]) - slots)
        levels = [at[i] for i in numbers]
        conditional, unconditional = np.split(net(some[0])(np.concatenate([x, x]), np.array(2 * levels), bound), 2)
        scale = np.array([row.guidance(level) for row, level in zip(some, levels, strict=True)], x.dtype)[:, None, None]
        guided = lerp(unconditional, conditional, scale)
        estimates.update((i, one[:count]) for i, one, count in zip(numbers, guided, tokens, strict=True))
    return [estimates[i] for i in range(len(rows))]


def stack_conditions(bounds: list[Bound]) -> Bound:
    """Rows of several conditions, their words and flags padded to the longest."""
    most, frames = (max(getattr(one, part).shape[-1] for one in bounds) for part in ("words", "flags"))
    padded: list[Bound] = []
    for one in bounds:
        keys, values = zero_padded(one.keys, most), zero_padded(one.values, most)
        words, flags = zero_padded(one.words, most, axis=-1), zero_padded(one.flags, frames, axis=-1)
        padded.append(one._replace(keys=keys, values=values, words=words, flags=flags))
    return Bound._make(map(np.concatenate, zip(*padded, strict=True)))


def zero_padded(array: np.ndarray, length: int, *, axis: int = -2) -> np.ndarray:
    """An array with zeros behind it, ``length`` long along an axis (-2: frames, or words)."""
    missing = [(0, 0)] * array.ndim
    missing[axis] = 0, length - array.shape[axis]
    return np.pad(array, missing) if missing[axis][1] else array


# Into the world


@dataclass(frozen=True, eq=False)
class Track:
    """A path for the whole, and which way it goes."""

    path: Goal
    directions: Array
    """(frames,) radians."""

    @staticmethod
    def along(path: Goal, fps: float) -> "Track":
        if not path.mask[:, 0, [0, 2]].all():
            raise MotionloomError("the path of a long motion must say where to be in every frame; give points for all")
        return Track(path, np.where(path.facing_mask, path.facing, along(path.positions[:, 0, [0, 2]], fps)))

    def place(self, frame: int) -> GroundPose:
        """Where the person is at that frame."""
        if frame == 0:
            return start_of(self.path)
        x, _, z = self.path.positions[frame, 0]
        return GroundPose(float(x), float(z), float(self.directions[frame]))

    def with_path(self, segment: Segment, first: int, frames: int) -> Segment:
        """The segment that begins with frame ``first``, with its part of the path among its targets."""
        if first + frames > len(self.path):
            raise MotionloomError(
                f"the path has {len(self.path)} frames and the segments have more; make them equally long"
            )
        part = self.path.crop(first, first + frames).relative_to(self.place(first))
        return replace(segment, goal=part if segment.goal is None else merged(part, segment.goal))


def segments_on(track: Track | None, segments: Iterable[Segment], fps: float, first: int = 0) -> Iterator[Segment]:
    """The segments, each with its part of the path among its targets; they begin with frame ``first`` of the path."""
    for segment in segments:
        frames = round(segment.seconds * fps)
        yield track.with_path(segment, first, frames) if track else segment
        first += frames


def place_pieces(
    prior: Prior,
    pieces: Iterable[np.ndarray],
    goals: deque[Goal | None],
    place: GroundPose,
    track: Track | None,
    first: int = 0,
) -> Iterator[Places]:
    """Each piece where the one before it ends; on a path bent once more, so that errors do not add up.

    first: the frame of the path with which the pieces begin.
    """
    mean, spread = prior.mean, prior.spread
    for piece in pieces:
        own_goal = goals.popleft()
        goal = Goal.nothing(len(piece)) if own_goal is None else own_goal.placed(place)
        if track:
            part = track.path.crop(first, first + len(piece))
            piece = toward(part.relative_to(place), prior)((piece - mean) / spread, 0) * spread + mean
            goal = overlaid(part, goal)
        placed = PlacedMotion(piece, place)
        yield Places(placed.positions, placed.contacts, goal)
        place, first = placed.end, first + len(piece)
