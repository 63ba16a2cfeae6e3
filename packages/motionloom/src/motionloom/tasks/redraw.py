"""A long motion after a change of its timeline: only what changed is sampled, the other blocks keep their frames.

A block is named by a digest of its request (`Block.digest`): words, length, goals, part of the path, sampling. The
blocks that an old motion was sampled from are compared with the new ones; each run of changed blocks is sampled with
half a transition of its neighbours on either side, between known frames of the old motion, as a chain of its own
(`long.chain_rows`). Outside of that the frames are the old ones bit for bit. What lies behind a run moves rigidly to
where the person now comes to; on a path it stays where it is.
"""

import hashlib
from collections import deque
from collections.abc import Container, Sequence
from dataclasses import asdict, dataclass, replace
from difflib import SequenceMatcher
from functools import cached_property, reduce
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from motionloom.core.body.feet import clean_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.features.layout import LAYOUT
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion, ground_pose
from motionloom.edits.fitting import fit
from motionloom.goals.goal import Goal
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import Sampling
from motionloom.tasks.body import Places, join_places
from motionloom.tasks.history import LOOK_BACK, Past
from motionloom.tasks.long import Track, long_features, place_pieces, segments_on
from motionloom.tasks.sampling import Moves
from motionloom.tasks.splice import concatenate, move_on_floor, splice


class Block(NamedTuple):
    """What a block of a long motion was sampled from; plain values, so that a motion's file can keep them."""

    digest: str
    """Of its request and how it was sampled, its neighbours apart."""
    frames: int
    half: int
    """Frames of the transition to the next one, on either side of the seam."""


class Run(NamedTuple):
    """Blocks ``old_first`` to before ``old_end`` of the old motion, where ``first`` to before ``end`` are to be."""

    old_first: int
    old_end: int
    first: int
    end: int


@dataclass(frozen=True, eq=False)
class Timed:
    """Segments, their path, and how they are sampled."""

    prior: Prior
    segments: Sequence[Segment]
    path: Goal | None
    sampling: Sampling
    foot_lock: bool = True

    @cached_property
    def track(self) -> Track | None:
        """The path, and which way it goes."""
        return None if self.path is None else Track.along(self.path, self.prior.fps)

    @cached_property
    def blocks(self) -> list[Block]:
        """Of the segments."""
        how = asdict(self.sampling) | {"count": 1, "first": 0, "batch_size": 0, "seed": self.sampling.seeds(1)}
        base = repr((sorted(how.items()), self.foot_lock, self.prior.digest))
        result, first = [], 0
        for one in self.segments:
            frames = round(one.seconds * self.prior.fps)
            digest = hashlib.sha256(repr((base, one.text, frames, one.guidance)).encode())
            for goal in (one.goal, self.track and self.track.path.crop(first, first + frames)):
                _update_digest(digest, goal)
            half = max(1, round(one.transition * self.prior.fps / 2))
            result.append(Block(digest.hexdigest()[:20], frames, half))
            first += frames
        return result


def changed_runs(old: Sequence[Block], timed: Timed) -> list[Run] | None:
    """The runs of blocks that have to be sampled, in order; None where no block stays.

    A seam whose transition changed is a run of no block.
    """
    new = timed.blocks
    first, least = 0, min(len(old), len(new))
    while first < least and old[first].digest == new[first].digest:
        first += 1
    rest = 0
    while rest < least - first and old[-1 - rest].digest == new[-1 - rest].digest:
        rest += 1
    some, others = ([one.digest for one in blocks[first : len(blocks) - rest]] for blocks in (old, new))
    same: list[tuple[int, int, int]] = []
    if len(some) == len(others):
        same = [(k, k, 1) for k, (one, other) in enumerate(zip(some, others, strict=True)) if one == other]
    matches = SequenceMatcher(None, some, others, autojunk=False).get_matching_blocks()
    if sum(match.size for match in matches) > len(same):
        same = list(matches)
    pairs = [(k, k) for k in range(first)]
    pairs += [(first + i + k, first + j + k) for i, j, size in same for k in range(size)]
    pairs += [(len(old) - k, len(new) - k) for k in range(rest, 0, -1)]
    pairs = _without_goals_at_seams(pairs, old, timed)
    runs, at = [], (-1, -1)
    for i, j in [*pairs, (len(old), len(new))]:
        seam = 0 < j < len(new) and (i, j) == (at[0] + 1, at[1] + 1) and old[i - 1].half != new[j - 1].half
        if seam or (i, j) != (at[0] + 1, at[1] + 1):
            runs.append(Run(at[0] + 1, i, at[1] + 1, j))
        at = i, j
    return runs if pairs else None


def resample_runs(
    timed: Timed,
    old: Motion,
    was: Sequence[Block],
    runs: Sequence[Run],
    progress: Moves | None = None,
    *,
    seed: int | None = None,
) -> Motion:
    """The old motion with each run sampled, one after the other.

    Args:
        timed: the new timeline.
        old: the 22-joint person at 20 frames per second.
        was: what it was sampled from.
        runs: of `changed_runs`; at least one block is in none of them.
        progress: as of `long.compose`.
        seed: of the first block of a run; None: its own.
    """
    begins, old_begins = _first_frames(timed.blocks), _first_frames(was)
    for run in runs:
        lead, trail = _margins(run, was, timed.blocks)
        moved = begins[run.first] - old_begins[run.old_first]
        first = begins[run.first] - lead
        at = _Stretch(first, old_begins[run.old_end] + moved + trail, lead, trail)
        own = timed.sampling.seeds(1)[0] + run.first if seed is None else seed
        old = _sample_run(timed, old, run, at, own, progress)
    return old


def sampled_frames(timed: Timed, was: Sequence[Block], runs: Sequence[Run]) -> list[tuple[int, int]]:
    """Half-open ranges of the frames of the new motion that `resample_runs` samples; arguments as there."""
    begins = _first_frames(timed.blocks)
    margins = [_margins(run, was, timed.blocks) for run in runs]
    return [
        (begins[run.first] - lead, begins[run.end] + trail) for run, (lead, trail) in zip(runs, margins, strict=True)
    ]


def blocks_from(values: Any, frames: int) -> list[Block]:
    """Blocks from the plain values in the file of a motion of so many frames; none where they do not fit it."""
    if not isinstance(values, list) or not all(isinstance(one, list) and len(one) == 3 for one in values):
        return []
    blocks = [Block(*one) for one in values]
    for one in blocks:
        if not (isinstance(one.digest, str) and isinstance(one.frames, int) and isinstance(one.half, int)):
            return []
    sound = all(0 < one.half <= one.frames for one in blocks)
    return blocks if sound and sum(one.frames for one in blocks) == frames else []


# What is beside a change


class _Stretch(NamedTuple):
    """Frames of the motion that are sampled."""

    first: int
    end: int
    """Behind the last one, in the old motion."""
    lead: int
    """How many of them lie before the first block that changed."""
    trail: int
    """How many of them lie behind the last one."""


def _update_digest(digest: Any, goal: Goal | None) -> None:
    """Add the targets of a goal to a digest."""
    if goal is None or goal.empty:
        digest.update(b"nothing")
        return
    for mask, targets in ((goal.mask, goal.positions), (goal.facing_mask, goal.facing)):
        digest.update(np.ascontiguousarray(mask).tobytes() + np.where(mask, targets, 0.0).tobytes())


def _without_goals_at_seams(pairs: list[tuple[int, int]], old: Sequence[Block], timed: Timed) -> list[tuple[int, int]]:
    """Pairs of blocks that stay, without those that have targets where a transition is sampled again."""
    new, left, before = timed.blocks, pairs, None
    while left != before:
        before, known = left, {*left, (-1, -1), (len(old), len(new))}
        left = [(i, j) for i, j in before if not _has_targets_at_seams(timed, old, i, j, known)]
    return left


def _has_targets_at_seams(
    timed: Timed, old: Sequence[Block], i: int, j: int, known: Container[tuple[int, int]]
) -> bool:
    """Whether block j, which was i, has targets near a neighbour that is not among the known pairs."""
    goal, new = timed.segments[j].goal, timed.blocks
    if goal is None or goal.empty:
        return False
    has_target = goal.mask.any(axis=(1, 2)) | goal.facing_mask
    head = max(old[i - 1].half if i else 0, new[j - 1].half if j else 0)
    changed = [(i - 1, j - 1) not in known or (i > 0 and old[i - 1].half != new[j - 1].half)]
    changed += [(i + 1, j + 1) not in known or (j + 1 < len(new) and old[i].half != new[j].half)]
    ends = has_target[:head], has_target[-max(old[i].half, new[j].half) :]
    return any(change and end.any() for change, end in zip(changed, ends, strict=True))


def _first_frames(blocks: Sequence[Block]) -> list[int]:
    return [0, *accumulate(block.frames for block in blocks)]


def _margins(run: Run, old: Sequence[Block], new: Sequence[Block]) -> tuple[int, int]:
    """Frames of the blocks before and behind a run that are sampled with it: half a transition, the old or the new."""
    lead = trail = 0
    if run.first:
        lead = max(old[run.old_first - 1].half, new[run.first - 1].half)
    if run.end < len(new):
        trail = max(blocks[end - 1].half for blocks, end in ((old, run.old_end), (new, run.end)) if end)
    return lead, trail


def _neighbouring_frames(old: Motion, at: _Stretch) -> Past:
    """The old frames on either side of what is sampled, as the network sees them."""
    before, behind = min(LOOK_BACK, at.first), min(LOOK_BACK, len(old) - 1 - at.end)
    known, comes = PlacedMotion.nothing(), None
    if before:
        known = PlacedMotion.of(old.frames(at.first - before, at.first + 1).positions())
    if behind > 0:
        comes = PlacedMotion.of(old.frames(at.end, at.end + behind + 1).positions()).features
    return Past(known.features, known.end, comes, at.lead, at.trail)


# One run


def _sample_run(timed: Timed, old: Motion, run: Run, at: _Stretch, seed: int, progress: Moves | None) -> Motion:
    """The old motion with one run sampled, its first block from that seed."""
    past, prior, track = _neighbouring_frames(old, at), timed.prior, timed.track
    if track and not at.first:
        past = replace(past, end=track.place(0))
    segments = timed.segments[run.first : run.end]
    run_segments = list(segments_on(track, segments, prior.fps, first=at.first + at.lead))
    if not run_segments:  # a seam: no block, but the words of what follows
        near = timed.segments[min(run.first, len(timed.segments) - 1)]
        run_segments = [replace(near, seconds=0.0, goal=None)]
    sampling = replace(timed.sampling, seed=seed, count=1, first=0)
    seconds = at.first / prior.fps
    rows = long_features(prior, run_segments, past=past, begin=seconds, sampling=sampling, progress=progress)
    whole = np.concatenate([*rows, *([] if past.behind is None else [past.behind[:1]])])
    lengths = [at.lead, *(block.frames for block in timed.blocks[run.first : run.end])]
    parts = np.split(whole, list(accumulate(lengths)))
    goals = [None, *(segment.goal for segment in segments), None]
    some = [(part, goal) for part, goal in zip(parts, goals, strict=True) if len(part)]
    placed = place_pieces(prior, (part for part, _ in some), deque(goal for _, goal in some), past.end, track, at.first)
    return _insert(timed, old, at, past, reduce(join_places, placed))


def _insert(timed: Timed, old: Motion, at: _Stretch, past: Past, sampled: Places) -> Motion:
    """The old motion with places in a stretch of it; they have a frame more where the old one goes on behind them."""
    before = [old.frames(0, at.first)] if at.first else []
    around = [part.frames(len(part) - len(past.known), len(part)) for part in before]
    stretches = [_known_places(part, past.known) for part in around]
    behind, beside = [old.frames(at.end, len(old))] if at.end < len(old) else [], []
    if past.behind is not None:
        if timed.track is None:
            here, to = ground_pose(behind[0].frames(0, 1).positions()[0]), ground_pose(sampled.positions[-1])
            behind = [move_on_floor(behind[0], here, to)]
        sampled = sampled.crop(0, len(sampled) - 1)
        beside = [behind[0].frames(0, len(past.behind))]
    first, end = len(past.known), len(past.known) + len(sampled)
    stretches += [sampled, *(_known_places(part, past.behind) for part in beside)]
    solved = _solve_body(timed, reduce(join_places, stretches), first, end)
    held = concatenate(*around, solved.frames(first, end), *beside)
    return concatenate(*before, splice(held, solved, first, last=end).frames(first, end), *behind)


def _solve_body(timed: Timed, places: Places, first: int, end: int) -> Motion:
    """A body in these places; a foot that is planted before ``first`` or behind ``end`` stays where it is there."""
    motion = motion_from_positions(places.positions, timed.prior.fps)
    if timed.foot_lock:
        for _ in range(2):  # what lies before, and then, backwards in time, what lies behind
            rest = [motion.frames(end, len(motion))] if end < len(motion) else []
            cleaned = clean_feet(motion.frames(0, end), contacts=places.contacts[:end], shown=first)
            motion = concatenate(cleaned, *rest)
            motion = replace(motion, root=motion.root[::-1].copy(), rotations=motion.rotations[::-1].copy())
            places = Places(places.positions[::-1], places.contacts[::-1], places.goal)
            first, end = len(motion) - end, len(motion)
    return motion if places.goal.empty else fit(motion, places.goal)


def _known_places(motion: Motion, known: np.ndarray | None) -> Places:
    assert known is not None
    return Places(motion.positions(), known[:, LAYOUT["contacts"]].astype(np.float64), Goal.nothing(len(motion)))
