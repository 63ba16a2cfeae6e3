"""Sentences as motions: one action or several, with the numbers in the words kept, measured and tried again.

A number that the words say is a goal or a length (`motionloom.goals.timeline.timeline_of`). Turns and ways come as
asked; of steps and repetitions the drawn motion is counted, and where the number is another one it is drawn again from
another seed, with a shorter or longer way or stroke, `TRIES` times at most. The one with the least missing is kept.
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
from motionloom.goals import timeline as timelines
from motionloom.goals.amount_goal import kept, measured
from motionloom.goals.remarks import numbers_read, parts_read, remarks_on
from motionloom.goals.timeline import Timeline
from motionloom.goals.verbs import base_of, kind_of_verb
from motionloom.kinematics.gestures import still_from
from motionloom.motion import Motion
from motionloom.requests.sampling import LARGEST_SEED, SOLVER, Sampling, Settings
from motionloom.tasks.control import control
from motionloom.tasks.long import compose
from motionloom.tasks.sampling import Progress
from motionloom.tasks.splice import concatenated
from motionloom.tasks.supported import supported
from motionloom.tasks.text import check_prompts, frames_in, generate_each
from motionloom.weights.prior import Prior

TRIES = 6
STILL = 1.5
ENDS_STILL, MOSTLY_STILL = 0.3, 0.8
"""Shares of a motion after which standing still at its end is reported: with unknown words, and with any."""


@dataclass(frozen=True)
class Measured:
    """A number in the words, and what was drawn of it."""

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
    """What was drawn, segment by segment."""
    amounts: tuple[Measured, ...]
    """What was read of numbers in the words, in their order."""
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
    """What a sentence asks of a prior: its numbers as goals and lengths, its actions as segments.

    seconds: of the whole; None: what the words say, or 5. parted: part what follows each other; otherwise it is parted
    where one part has a number that is kept. amounts: read numbers. metre: as of `timelines.timeline_of`. Weights that
    make no long motion get the sentence as it is. Raises `MotionloomError` for what cannot be asked.
    """
    whole = timelines.whole(text, timelines.SECONDS if seconds is None else seconds)
    frames_in(whole.segments[0].seconds, prior.fps)
    if (len(prior.mean), prior.fps) != (WIDTH, FPS) or whole.segments[0].seconds < timelines.SHORTEST:
        return whole
    found = timelines.timeline_of(text, seconds, amounts=amounts, metre=metre)
    return found if parted or found.readings or len(found.segments) == 1 else whole


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
    """The motions of `motionloom.generate`, each with what was read in its words, what was drawn of it, and remarks.

    Arguments and errors as there.
    """
    chosen = Sampling.of(sampling, settings)
    said = [prompts] if isinstance(prompts, str) else list(prompts)
    lengths: list[float | None] = [None] * len(said)
    if seconds is not None:
        lengths = [float(s) for s in np.atleast_1d(np.asarray(seconds, dtype=np.float64))]
        lengths *= len(said) if np.ndim(seconds) == 0 else 1
    if len(lengths) != len(said):
        raise MotionloomError(f"there are {len(lengths)} lengths for {len(said)} prompts; give one, or one per prompt")
    if not said:
        raise MotionloomError("nothing to make: no prompt; give at least one")
    check_prompts(said)
    asked = [
        timelines.whole(text, timelines.SECONDS if length is None else length)
        if literal
        else read(prior, text, length, parted=False)
        for text, length in zip(said, lengths, strict=True)
        for _ in range(chosen.number())
    ]
    seeds = chosen.seeds(len(asked))
    made = draw(prior, asked, seeds=seeds, foot_lock=foot_lock, sampling=chosen, progress=progress)
    texts = [segment.text for one in asked for segment in one.segments]
    unknown = {one.text: one.line for one in remarks_on(texts, prior.known, prior.text)}
    return [
        replace(one, unknown={part.text: unknown[part.text] for part in one.timeline.segments if part.text in unknown})
        for one in made
    ]


def draw(
    prior: Prior,
    asked: Sequence[Timeline],
    *,
    seeds: Sequence[int],
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
) -> Iterator[Worded]:
    """The motions of timelines in their order, each from its own seed; those of one free action are drawn together.

    seeds: one per timeline. foot_lock, sampling: as of `motionloom.generate`, but that the sampling's ``seed`` and
    ``count`` are not looked at. Raises `MotionloomError` for what cannot be asked.
    """
    sampling, done = sampling or Sampling(), 0
    if sampling.solver != SOLVER and any(len(one.segments) > 1 for one in asked):
        raise MotionloomError(
            f"several actions one after the other are drawn with the solver {SOLVER} alone; got {sampling.solver}"
        )
    for free, run in groupby(asked, _is_free):
        several = list(run)
        if free:
            made = generate_each(
                prior,
                [one.segments[0].text for one in several],
                [one.segments[0].seconds for one in several],
                seeds=seeds[done : done + len(several)],
                foot_lock=foot_lock,
                sampling=sampling,
                progress=progress,
            )
            for number, motion in _in_order(made):
                yield Worded(motion, several[number], ())
            done += len(several)
            continue
        for one in several:
            yield _tried(prior, one, replace(sampling, count=1), seeds[done], foot_lock)
            done += 1
            if progress:
                progress(done, len(asked))


def _tried(prior: Prior, asked: Timeline, sampling: Sampling, seed: int, foot_lock: bool) -> Worded:
    """The drawing that misses the least of what can be counted, of `TRIES` at most."""
    tries, shares, best = [], [1.0] * len(asked.readings), None
    for number in range(TRIES):
        own = seed if number == 0 else row_seed(seed, number) % LARGEST_SEED
        now = _shared(asked, shares)
        motion = _drawn(prior, now, replace(sampling, seed=own, first=0), foot_lock)
        found = Worded(motion, now, _measured(now, motion))
        counted = [
            one
            for one, reading in zip(found.amounts, now.readings, strict=True)
            if reading.amount.kind in ("count", "steps")
        ]
        off = sum(abs(one.asked - one.measured) for one in counted)
        if best is None or off < tries[0]:
            best, tries = found, [off]
        if not off:
            break
        shares = [
            share * float(np.clip((one.asked / max(one.measured, 0.5)) ** 0.5, 0.75, 1.35))
            for share, one in zip(shares, found.amounts, strict=True)
        ]
    assert best is not None
    return best


def _shared(asked: Timeline, shares: Sequence[float]) -> Timeline:
    """The timeline with other ways of its steps, and other times of its strokes."""
    if all(share == 1.0 for share in shares):
        return asked
    segments, readings, at = [], [], 0
    for reading, share in zip(asked.readings, shares, strict=True):
        segments += asked.segments[at : reading.first]
        at = reading.end
        own = asked.segments[reading.first : reading.end]
        if reading.amount.kind in ("count", "steps"):
            together = replace(own[0], seconds=sum(one.seconds for one in own))
            own = timelines.with_amount(together, reading.amount, min(max(share, 0.5), 2.0))
        readings.append(replace(reading, first=len(segments), end=len(segments) + len(own)))
        segments += own
    return replace(asked, segments=(*segments, *asked.segments[at:]), readings=tuple(readings))


def _drawn(prior: Prior, asked: Timeline, sampling: Sampling, foot_lock: bool) -> Motion:
    segment, *more = asked.segments
    if more:
        motion = concatenated(*compose(prior, asked.segments, foot_lock=foot_lock, sampling=sampling))
        return supported(motion) if foot_lock else motion
    if segment.goal is not None:
        (made,) = control(prior, segment.text, segment.goal, foot_lock=foot_lock, sampling=sampling)
        return made.motion
    seeds, texts = sampling.seeds(1), [segment.text]
    ((_, motion),) = generate_each(prior, texts, [segment.seconds], seeds=seeds, foot_lock=foot_lock, sampling=sampling)
    return motion


def _measured(asked: Timeline, motion: Motion) -> tuple[Measured, ...]:
    places, begins = motion.positions(), asked.begins
    found = []
    for reading in asked.readings:
        amount = reading.amount
        got = measured(amount, places[begins[reading.first] : begins[reading.end]], motion.fps)
        found.append(Measured(str(amount), amount.size, round(got, 3), amount.unit, kept(amount, got)))
    return tuple(found)


def _is_free(asked: Timeline) -> bool:
    """Whether it is one action without a number to keep."""
    return len(asked.segments) == 1 and asked.segments[0].goal is None and not asked.readings


def _in_order(made: Iterator[tuple[int, Motion]]) -> Iterator[tuple[int, Motion]]:
    """Motions by their numbers, which those of other lengths are made before."""
    waiting: dict[int, Motion] = {}
    number = 0
    for found, motion in made:
        waiting[found] = motion
        while number in waiting:
            yield number, waiting.pop(number)
            number += 1
