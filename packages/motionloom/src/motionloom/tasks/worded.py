"""Sentences as motions: one action or several, with the numbers in the words measured, and sampled again.

A number that the words say is a goal or a length (`motionloom.goals.timeline.timeline_of`). Turns and ways are
met; steps and repetitions are counted in the motion, and where the number differs it is sampled again from another
seed, with a shorter or longer way or stroke, `TRIES` times at most. The result is the one with the least missing.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Unpack

import numpy as np

from motionloom.diffusion.sampling import row_seed
from motionloom.errors import MotionloomError
from motionloom.features.layout import FPS, WIDTH
from motionloom.goals import timeline as goal_timeline
from motionloom.goals.amounts import is_met, measured
from motionloom.goals.remarks import numbers_read, parts_read, remarks_on
from motionloom.goals.timeline import Timeline
from motionloom.goals.verbs import base_of, kind_of_verb
from motionloom.kinematics.gestures import still_from
from motionloom.motion import Motion
from motionloom.requests.sampling import LARGEST_SEED, SOLVER, Sampling, Settings
from motionloom.requests.timeline import usual_seconds
from motionloom.tasks.control import control
from motionloom.tasks.long import compose
from motionloom.tasks.sampling import Progress
from motionloom.tasks.splice import concatenate
from motionloom.tasks.supported import add_support
from motionloom.tasks.text import check_prompts, frames_in, generate_each
from motionloom.weights.prior import Prior

TRIES = 6
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
    unknown: Mapping[str, str] = field(default_factory=dict)
    """The texts that the weights do not know, each with a sentence about it (`motionloom.goals.remarks`)."""

    @property
    def remarks(self) -> list[str]:
        """One sentence each: how the words were read, which are not known, what of them was missed."""
        texts = dict.fromkeys(segment.text for segment in self.timeline.segments)
        unknown = [self.unknown[text] for text in texts if text in self.unknown]
        return [*filter(None, (numbers_read(self.timeline), parts_read(self.timeline))), *unknown, *self.shortfalls]

    @property
    def shortfalls(self) -> list[str]:
        """A sentence for each number that was missed, and for an end where nothing happens any more."""
        share = ENDS_STILL if self.timeline.segments[-1].text in self.unknown else MOSTLY_STILL
        return [*filter(None, [*(amount.problem for amount in self.amounts), self.stillness(of=share)])]

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
        if begin is None or kinds & {"state", "change"} or self.motion.seconds - begin < of * self.motion.seconds:
            return ""
        return f"it ends standing still, from {begin:.1f} s on: what these weights do not know often does"


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
    timelines = [
        goal_timeline.single_segment(text, usual_seconds(text) if length is None else length)
        if literal
        else read(prior, text, length, parted=False)
        for text, length in zip(texts, lengths, strict=True)
        for _ in range(chosen.number())
    ]
    seeds = chosen.seeds(len(timelines))
    motions = generate_timelines(prior, timelines, seeds=seeds, foot_lock=foot_lock, sampling=chosen, progress=progress)
    texts = [segment.text for one in timelines for segment in one.segments]
    unknown = {one.text: one.line for one in remarks_on(texts, prior.known, prior.text)}
    return [
        replace(one, unknown={part.text: unknown[part.text] for part in one.timeline.segments if part.text in unknown})
        for one in motions
    ]


def generate_timelines(
    prior: Prior,
    timelines: Sequence[Timeline],
    *,
    seeds: Sequence[int],
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
) -> Iterator[Worded]:
    """The motions of timelines in their order, each from its own seed; those of one free action are sampled together.

    seeds: one per timeline. foot_lock, sampling: as of `motionloom.generate`, but that the sampling's ``seed`` and
    ``count`` are not looked at. Raises `MotionloomError` for an impossible request.
    """
    sampling, done = sampling or Sampling(), 0
    if sampling.solver != SOLVER and any(len(one.segments) > 1 for one in timelines):
        raise MotionloomError(
            f"several actions one after the other are drawn with the solver {SOLVER} alone; got {sampling.solver}"
        )
    for free, run in groupby(timelines, _is_free):
        several = list(run)
        if free:
            sampled = generate_each(
                prior,
                [one.segments[0].text for one in several],
                [one.segments[0].seconds for one in several],
                seeds=seeds[done : done + len(several)],
                foot_lock=foot_lock,
                sampling=sampling,
                progress=progress,
            )
            for number, motion in _in_order(sampled):
                yield Worded(motion, several[number], ())
            done += len(several)
            continue
        for one in several:
            yield _best_try(prior, one, replace(sampling, count=1), seeds[done], foot_lock)
            done += 1
            if progress:
                progress(done, len(timelines))


def _best_try(prior: Prior, timeline: Timeline, sampling: Sampling, seed: int, foot_lock: bool) -> Worded:
    """The sample that misses the least of what can be counted, of `TRIES` at most."""
    tries, shares, best = [], [1.0] * len(timeline.readings), None
    for number in range(TRIES):
        own = seed if number == 0 else row_seed(seed, number) % LARGEST_SEED
        now = _scaled(timeline, shares)
        motion = _sample_timeline(prior, now, replace(sampling, seed=own, first=0), foot_lock)
        candidate = Worded(motion, now, _measure_amounts(now, motion))
        counted = [
            one
            for one, reading in zip(candidate.amounts, now.readings, strict=True)
            if reading.amount.kind in ("count", "steps")
        ]
        off = sum(abs(one.asked - one.measured) for one in counted)
        if best is None or off < tries[0]:
            best, tries = candidate, [off]
        if not off:
            break
        shares = [
            share * float(np.clip((one.asked / max(one.measured, 0.5)) ** 0.5, 0.75, 1.35))
            for share, one in zip(shares, candidate.amounts, strict=True)
        ]
    assert best is not None
    return best


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
            together = replace(own[0], seconds=sum(one.seconds for one in own))
            own = goal_timeline.with_amount(together, reading.amount, min(max(share, 0.5), 2.0))
        readings.append(replace(reading, first=len(segments), end=len(segments) + len(own)))
        segments += own
    return replace(timeline, segments=(*segments, *timeline.segments[at:]), readings=tuple(readings))


def _sample_timeline(prior: Prior, timeline: Timeline, sampling: Sampling, foot_lock: bool) -> Motion:
    segment, *more = timeline.segments
    if more:
        motion = concatenate(*compose(prior, timeline.segments, foot_lock=foot_lock, sampling=sampling))
        return add_support(motion) if foot_lock else motion
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


def _in_order(numbered: Iterator[tuple[int, Motion]]) -> Iterator[tuple[int, Motion]]:
    """Motions in the order of their numbers; they come in another one."""
    waiting: dict[int, Motion] = {}
    number = 0
    for place, motion in numbered:
        waiting[place] = motion
        while number in waiting:
            yield number, waiting.pop(number)
            number += 1
