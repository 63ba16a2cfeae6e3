"""Sentences as motions: one action or several; what the words say plainly is looked for, and sampled again.

A number that the words say is a goal or a length (`motionloom.goals.timeline.timeline_of`). Turns and ways are
met; steps and repetitions are counted in the motion, and where the number differs it is sampled again from another
seed, with a shorter or longer way or stroke, `TRIES` times at most. What else the words say plainly
(`motionloom.goals.expected`: a turn to the left, a wave, a kick of the right leg) is looked for in `ATTEMPTS` motions
at most, of which all but the first have a common verb for each rare one ("walks" for "trudges"). The result is the one
with the least missing; of several actions only those that miss something are sampled again (`reattempts`). A head that
nods, is shaken or looks aside is turned in it (`motionloom.goals.heads`).
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby, pairwise
from typing import Any, Unpack

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals import timeline as goal_timeline
from motionloom.goals.amounts import is_met, measured
from motionloom.goals.expected import climbs, missing
from motionloom.goals.heads import head_said
from motionloom.goals.remarks import clipped, numbers_read, parts_read, replacement_line
from motionloom.goals.sequence import usual_seconds
from motionloom.goals.timeline import Timeline
from motionloom.goals.verbs import base_of, kind_of_verb
from motionloom.kinematics.gestures import still_from
from motionloom.requests.sampling import SOLVER, Sampling, Settings
from motionloom.tasks.control import control
from motionloom.tasks.direct_edits import Nod
from motionloom.tasks.long import compose
from motionloom.tasks.reattempts import ATTEMPTS, PLAINER_FROM, attempt_seed, reattempt
from motionloom.tasks.redraw import Timed
from motionloom.tasks.remarks import lines_by_text, remarks_on_words
from motionloom.tasks.sampling import Progress
from motionloom.tasks.supported import add_support, lowered
from motionloom.tasks.text import check_prompts, frames_in, generate_each
from motionloom.tasks.watching import watching

TRIES = 6
"""Motions of which the best is kept where numbers are counted; `ATTEMPTS` where the words are plain without numbers."""
_TOGETHER = 256
"""Motions that are sampled and looked at together."""
_SIDED = re.compile(r"\b(?:left|right|(?:counter|anti)?-?clockwise)\b", re.IGNORECASE)
STILL = 1.5
ENDS_STILL, MOSTLY_STILL = 0.3, 0.8
"""Shares of a motion after which standing still at its end is reported: with unknown words, and with any."""


@dataclass(frozen=True)
class Measured:
    """A number in the words, and its size in the motion."""

    read: str
    """What was read, in words: "3 steps forward"."""
    asked: float
    measured: float
    unit: str
    """Degrees, m, steps, or what is repeated."""
    kept: bool

    @property
    def problem(self) -> str:
        """A sentence where it was missed; empty where it was not."""
        if self.kept:
            return ""
        digits = 2 if self.unit == "m" else 0
        return f"{self.read} asked; {self.measured:.{digits}f} {self.unit} drawn"


@dataclass(frozen=True, eq=False)
class Worded:
    """A motion of a sentence."""

    motion: Motion
    timeline: Timeline
    """The generated timeline, segment by segment."""
    amounts: tuple[Measured, ...]
    """The numbers in the words, in their order."""
    attempts: int = 1
    """Motions in which what the words say plainly was looked for, at most."""
    said: Timeline | None = None
    """The timeline before its verbs were replaced; None: they were not."""
    unknown: Mapping[str, str] = field(default_factory=dict)
    """The texts that the weights do not know, each with a sentence about it (`motionloom.goals.remarks`)."""

    @cached_property
    def missing(self) -> list[str]:
        """What else the words say plainly and the motion does not show: "a turn to the left"."""
        places, begins = self.motion.positions(), self.timeline.begins
        texts = [segment.text for segment in (self.said or self.timeline).segments]
        measured = {i for one in self.timeline.readings for i in range(one.first, one.end)}
        free = [(i, i + 1) for i in range(len(texts)) if i not in measured]
        if len(set(texts)) == 1 and len(free) == len(texts):  # flights of stairs
            free = [(0, len(texts))]
        names = [
            name for i, end in free for name in missing(texts[i], places[begins[i] : begins[end]], self.motion.fps)
        ]
        for reading in self.timeline.readings:
            if reading.amount.of:  # how often is measured; where and with what is not
                own = places[begins[reading.first] : begins[reading.end]]
                found = missing(texts[reading.first], own, self.motion.fps)
                names += [name for name in found if not name.endswith(reading.amount.of)]
        return names

    @property
    def remarks(self) -> list[str]:
        """One sentence each: how the words were read, which are not known, what of them was missed."""
        texts = dict.fromkeys(segment.text for segment in self.timeline.segments)
        unknown = [self.unknown[text] for text in texts if text in self.unknown]
        return [*filter(None, (numbers_read(self.timeline), parts_read(self.timeline))), *unknown, *self.shortfalls]

    @property
    def replaced(self) -> str:
        """A sentence with the common verbs that replace rare ones; empty where none does."""
        both = zip((self.said or self.timeline).segments, self.timeline.segments, strict=True)
        return replacement_line([(one.text, other.text) for one, other in both])

    @property
    def shortfalls(self) -> list[str]:
        """A sentence for replaced verbs, each missed number, what is not shown, and an end without motion."""
        share = ENDS_STILL if self.timeline.segments[-1].text in self.unknown else MOSTLY_STILL
        looked = list(dict.fromkeys(self.missing)) if self.attempts > 1 else []
        unseen = clipped(f"not shown in {self.attempts} attempts: {', '.join(looked)}") if looked else ""
        problems = [self.replaced, *(amount.problem for amount in self.amounts)]
        return [*filter(None, [*problems, unseen, self.stillness(of=share)])]

    @property
    def still_from(self) -> float | None:
        """Seconds from which on no part of the body moves, if that is `STILL` or more before the end."""
        begin = still_from(self.motion.positions(), self.motion.fps)
        return None if begin is None or self.motion.seconds - begin < STILL else round(begin, 2)

    def stillness(self, *, of: float) -> str:
        """A sentence where somebody who should move stands still at the end, for that share of the motion or more.

        Empty for words that ask for it: waiting, sitting, a change of posture or a stop.
        """
        begin, last = self.still_from, self.timeline.segments[-1]
        kinds = {
            kind_of_verb(word, last.text.lower()) for word in re.findall("[a-z]+", last.text.lower()) if base_of(word)
        }
        if (
            head_said(last.text)
            or begin is None
            or kinds & {"state", "change"}
            or self.motion.seconds - begin < of * self.motion.seconds
        ):
            return ""
        return f"it stands still from {begin:.1f} s on"


def read(
    prior: Prior,
    text: str,
    seconds: float | None = None,
    *,
    parted: bool = True,
    amounts: bool = True,
    metre: float = 1.0,
) -> Timeline:
    """A sentence as a timeline: its numbers as goals and lengths, its actions as segments.

    seconds: of the whole; None: what the words say, or `usual_seconds`. parted: part what follows each other;
    otherwise it is parted where one part has a number that is read. amounts: read numbers. metre: as of `timeline_of`.
    Weights that make no long motion get the sentence as it is. Raises `MotionloomError` for an impossible request.
    """
    whole = goal_timeline.single_segment(text, usual_seconds(text) if seconds is None else seconds)
    frames_in(whole.segments[0].seconds, prior.fps)
    if (len(prior.mean), prior.fps) != (WIDTH, FPS) or whole.segments[0].seconds < goal_timeline.SHORTEST:
        return whole
    parsed = goal_timeline.timeline_of(text, seconds, amounts=amounts, metre=metre)
    return parsed if parted or parsed.readings or len(parsed.segments) == 1 else whole


def generate_worded(
    prior: Prior,
    prompts: Sequence[str] | str,
    *,
    seconds: float | Sequence[float] | None = None,
    literal: bool = False,
    as_one: bool = False,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[Worded]:
    """The motions of `motionloom.generate`, each with its timeline, the measured numbers of its words, and remarks.

    Arguments and errors as there.
    """
    chosen = Sampling.of(sampling, settings)
    texts = [prompts] if isinstance(prompts, str) else list(prompts)
    lengths: list[float | None] = [None] * len(texts)
    if seconds is not None:
        lengths = [float(s) for s in np.atleast_1d(np.asarray(seconds, dtype=np.float64))]
        lengths *= len(texts) if np.ndim(seconds) == 0 else 1
    if len(lengths) != len(texts):
        raise MotionloomError(f"there are {len(lengths)} lengths for {len(texts)} prompts; give one, or one per prompt")
    if not texts:
        raise MotionloomError("nothing to make: no prompt; give at least one")
    check_prompts(texts)
    readings = [
        read(prior, text, length, parted=not as_one, amounts=not (literal or as_one))
        for text, length in zip(texts, lengths, strict=True)
    ]
    timelines = [timeline for timeline in readings for _ in range(chosen.number())]
    motions = generate_timelines(
        prior,
        timelines,
        seeds=chosen.seeds(len(timelines)),
        attempts=1 if literal or as_one else ATTEMPTS,
        foot_lock=foot_lock,
        sampling=chosen,
        progress=progress,
    )
    texts = [segment.text for one in timelines for segment in one.segments]
    unknown = lines_by_text(remarks_on_words(prior, texts, heads=not (literal or as_one)))
    return [
        replace(one, unknown={part.text: unknown[part.text] for part in one.timeline.segments if part.text in unknown})
        for one in motions
    ]


def generate_timelines(
    prior: Prior,
    timelines: Sequence[Timeline],
    *,
    seeds: Sequence[int],
    attempts: int = ATTEMPTS,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
) -> Iterator[Worded]:
    """The motions of timelines in their order, each from its own seed; those of one free action are sampled together.

    seeds: one per timeline. attempts: motions in which the words are looked for, at most; 1: the first is kept.
    foot_lock, sampling: as of `motionloom.generate`, but that the sampling's ``seed`` and ``count`` are not looked at.
    Raises `MotionloomError` for an impossible request.
    """
    sampling = sampling or Sampling()
    if sampling.solver != SOLVER and any(len(one.segments) > 1 for one in timelines):
        raise MotionloomError(
            f"several actions one after the other are drawn with the solver {SOLVER} alone; got {sampling.solver}; "
            "choose that one, or leave the sentence whole (as_one)"
        )
    done = 0
    how: dict[str, Any] = {"attempts": attempts, "foot_lock": foot_lock}
    for free, run in groupby(timelines, _is_free):
        several = list(run)
        if free:
            for begin in range(0, len(several), _TOGETHER):
                some = several[begin : begin + _TOGETHER]
                own = seeds[done : done + len(some)]
                best = _best_attempts(prior, some, seeds=own, sampling=sampling, progress=progress, **how)
                yield from (_finished(one, foot_lock) for one in best)
                done += len(some)
            continue
        for one in several:
            best_try = _best_try(prior, one, sampling=replace(sampling, count=1), seed=seeds[done], **how)
            yield _finished(best_try, foot_lock)
            done += 1
            if progress:
                progress(done, len(timelines))


def _finished(one: Worded, foot_lock: bool) -> Worded:
    """The motion with whoever floats on the floor, unless the words climb, and with a head that does what the words
    of each segment say of it, where words are looked for at all."""
    segments = one.timeline.segments
    motion = lowered(one.motion) if foot_lock and not climbs(part.text for part in segments) else one.motion
    for segment, (first, last) in zip(segments, pairwise(one.timeline.begins), strict=True):
        if one.attempts > 1 and (move := head_said(segment.text)):
            motion = Nod(((first / FPS, last / FPS),), move=move).apply(None, motion, 0)
    return one if motion is one.motion else replace(one, motion=motion)


def _best_attempts(
    prior: Prior,
    timelines: Sequence[Timeline],
    *,
    seeds: Sequence[int],
    attempts: int,
    foot_lock: bool,
    sampling: Sampling,
    progress: Progress | None,
) -> Iterator[Worded]:
    """Motions of one free action each, in order; of each the attempt with the least missing, the first of equals."""
    best: dict[int, Worded] = {}
    plainer = [one.plainer for one in timelines]
    unseen, finished = list(range(len(timelines))), 0
    first, later = _once_at_its_end(progress)
    for number in range(attempts):
        words = plainer if number >= PLAINER_FROM else timelines
        sampled = generate_each(
            prior,
            [words[i].segments[0].text for i in unseen],
            [words[i].segments[0].seconds for i in unseen],
            seeds=[attempt_seed(seeds[i], number) for i in unseen],
            foot_lock=foot_lock,
            sampling=sampling,
            progress=later if number else first,
        )
        again = set(unseen)
        for place, motion in _unwatched(sampled) if number else sampled:
            i = unseen[place]
            attempt = _or_mirrored(Worded(motion, words[i], (), attempts, timelines[i]))
            if i not in best or len(attempt.missing) < len(best[i].missing):
                best[i] = attempt
            if number + 1 == attempts or not best[i].missing:
                again.remove(i)
            while finished in best and finished not in again:
                yield best.pop(finished)
                finished += 1
        unseen = sorted(again)
        if not unseen:
            return


def _unwatched(sampled: Iterator[tuple[int, Motion]]) -> list[tuple[int, Motion]]:
    """All of them, sampled unseen by who is watching: what is watched is the first attempt."""
    with watching(lambda denoised: None):
        return list(sampled)


def _once_at_its_end(progress: Progress | None) -> tuple[Progress | None, Progress | None]:
    """What the first attempt reports to, and the later ones, which stay at the end of the first: they may cancel."""
    if progress is None:
        return None, None
    calls = 1

    def first(done: int, of: int) -> None:
        nonlocal calls
        calls = of
        progress(done, of)

    return first, lambda done, of: progress(calls, calls)


def _best_try(
    prior: Prior, timeline: Timeline, *, sampling: Sampling, seed: int, attempts: int, foot_lock: bool
) -> Worded:
    """The sample that misses the least of what can be counted, then of what else the words say plainly."""
    least, shares, best = (np.inf, 0), [1.0] * len(timeline.readings), None
    counts = any(reading.amount.kind in ("count", "steps") for reading in timeline.readings)
    in_blocks = attempts > 1 and len({segment.text for segment in timeline.segments}) > 1
    for number in range(TRIES if counts else 1 if in_blocks else attempts):
        said = _scaled(timeline, shares)
        now = said.plainer if number >= PLAINER_FROM else said
        own = replace(sampling, seed=attempt_seed(seed, number), first=0)
        motion = _sample_timeline(prior, now, own, foot_lock)
        candidate = Worded(motion, now, _measure_amounts(now, motion), attempts, said)
        candidate = _or_mirrored(candidate)
        off = _missed(candidate)
        if best is None or off < least:
            best, least = candidate, off
        if not off[0] and (in_blocks or not off[1] or number + 1 >= attempts):
            break
        shares = [
            share * float(np.clip((one.asked / max(one.measured, 0.5)) ** 0.5, 0.75, 1.35))
            for share, one in zip(shares, candidate.amounts, strict=True)
        ]
    assert best is not None
    if in_blocks and best.missing:
        own = replace(sampling, seed=seed, first=0)
        best = _blocks_again(best, Timed(prior, best.timeline.segments, None, own, foot_lock))
    several = len(timeline.segments) > 1
    stairs = climbs(segment.text for segment in timeline.segments)
    return replace(best, motion=add_support(best.motion, stairs=stairs)) if several and foot_lock else best


def _missed(one: Worded) -> tuple[float, int]:
    """By how much its counts differ from those of the words, and how much else of the words it does not show."""
    both = zip(one.amounts, one.timeline.readings, strict=True)
    counted = [amount for amount, reading in both if reading.amount.kind in ("count", "steps")]
    return sum(abs(amount.asked - amount.measured) for amount in counted), len(one.missing)


def _or_mirrored(one: Worded) -> Worded:
    """The motion, or its mirror image where that is nearer to words of one action that name a side.

    A way, a turn and steps whose size is in the words have a goal, which knows the side.
    """
    texts = {segment.text for segment in one.timeline.segments}
    has_goal = any(reading.amount.kind != "count" for reading in one.timeline.readings)
    if one.attempts == 1 or has_goal or len(texts) > 1 or not _SIDED.search(min(texts)) or _missed(one) == (0, 0):
        return one
    motion = one.motion.mirror()
    other = replace(one, motion=motion, amounts=_measure_amounts(one.timeline, motion))
    return other if _missed(other) < _missed(one) else one


def _blocks_again(one: Worded, timed: Timed) -> Worded:
    """The motion with those of its actions sampled again that do not show what their words say (`reattempts`)."""
    timeline = one.timeline
    counted = {i for reading in timeline.readings for i in range(reading.first, reading.end)}
    blocks = [i for i in range(len(timeline.segments)) if i not in counted]
    found = reattempt(timed, one.motion, blocks, attempts=one.attempts)
    texts = [found.again.get(i, segment.text) for i, segment in enumerate(timeline.segments)]
    segments = tuple(replace(segment, text=text) for segment, text in zip(timeline.segments, texts, strict=True))
    now = replace(timeline, segments=segments)
    amounts = _measure_amounts(now, found.motion)
    return replace(one, motion=found.motion, timeline=now, amounts=amounts, said=one.said or timeline)


def _scaled(timeline: Timeline, shares: Sequence[float]) -> Timeline:
    """The timeline with other ways of its steps, and other times of its strokes."""
    if all(share == 1.0 for share in shares):
        return timeline
    segments, readings, at = [], [], 0
    for reading, share in zip(timeline.readings, shares, strict=True):
        segments += timeline.segments[at : reading.first]
        at = reading.end
        own = timeline.segments[reading.first : reading.end]
        if reading.amount.kind in ("count", "steps"):
            together = replace(own[0], seconds=sum(one.seconds for one in own), goal=None)
            own = goal_timeline.with_amount(together, reading.amount, min(max(share, 0.5), 2.0))
            own = goal_timeline.in_seconds(own, together.seconds) if reading.fixed else own
        readings.append(replace(reading, first=len(segments), end=len(segments) + len(own)))
        segments += own
    return replace(timeline, segments=(*segments, *timeline.segments[at:]), readings=tuple(readings))


def _sample_timeline(prior: Prior, timeline: Timeline, sampling: Sampling, foot_lock: bool) -> Motion:
    segment, *more = timeline.segments
    if more:
        return compose(prior, timeline.segments, foot_lock=foot_lock, sampling=sampling)
    if segment.goal is not None:
        (controlled,) = control(prior, segment.text, segment.goal, foot_lock=foot_lock, sampling=sampling)
        return controlled.motion
    seeds, texts = sampling.seeds(1), [segment.text]
    ((_, motion),) = generate_each(prior, texts, [segment.seconds], seeds=seeds, foot_lock=foot_lock, sampling=sampling)
    return motion


def _measure_amounts(timeline: Timeline, motion: Motion) -> tuple[Measured, ...]:
    places, begins = motion.positions(), timeline.begins
    measurements = []
    for reading in timeline.readings:
        amount = reading.amount
        size = measured(amount, places[begins[reading.first] : begins[reading.end]], motion.fps)
        measurements.append(Measured(str(amount), amount.size, round(size, 3), amount.unit, is_met(amount, size)))
    return tuple(measurements)


def _is_free(timeline: Timeline) -> bool:
    """Whether it is one action without a number to keep."""
    return len(timeline.segments) == 1 and timeline.segments[0].goal is None and not timeline.readings
