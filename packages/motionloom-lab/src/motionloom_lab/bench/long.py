"""What long motion costs: time and memory against length, and the published recipe for the same prompts."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from motionloom.core.diffusion import Denoiser, lerp, levels, row_noise
from motionloom.core.methods.double_take import (
    HANDSHAKE,
    MODES,
    Plan,
    first_take,
    keep_weights,
    restarted,
    sandwiches,
    second_take,
)
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.prior import Prior
from motionloom.goals.segment import TRANSITION, Segment
from motionloom.io.stream import open_stream
from motionloom.tasks.long import BATCH, compose_stream
from motionloom.tasks.text import SOLVER, SPACING
from motionloom_lab.bench.speed import Entry, Process, Sampling, fit, process, timed
from motionloom_train.data.progress import Say, silent

ACTIONS = (
    "walks forward",
    "runs",
    "jumps",
    "turns around",
    "walks in a circle",
    "waves with the right hand",
    "dances",
    "sits down and stands up",
    "kicks with the left leg",
    "crouches",
    "throws a ball",
    "claps",
    "walks backwards",
    "raises both arms",
    "picks something up",
)
MANNERS = ("", " slowly", " quickly", " carefully")


@dataclass(frozen=True)
class Course:
    """What is measured."""

    lengths: tuple[float, ...]
    """Seconds of motion, rising."""
    each: float
    """Seconds per prompt."""
    repeats: int
    steps: int
    """Steps of either take of the published recipe that are timed at once; all steps of a take cost the same."""


FULL = Course((60.0, 120.0, 300.0, 600.0), 10.0, 3, 4)
QUICK = Course((10.0, 20.0, 40.0), 10.0, 1, 2)


@dataclass(frozen=True)
class Take:
    """One take of the published recipe, reckoned from a few steps."""

    rows: int
    frames: int
    """Of the longest row; all are padded to it."""
    steps: int
    calls: int
    """Network calls a step."""
    timed: int
    """Steps that were timed at once."""
    step_s: float

    @property
    def seconds(self) -> float:
        """All steps."""
        return self.steps * self.step_s


@dataclass(frozen=True)
class Measured:
    """The numbers, and how they came about."""

    lengths: tuple[float, ...]
    """Seconds of motion."""
    times: tuple[float, ...]
    """Seconds `compose` took with writing the BVH file, weights loaded."""
    peaks_mb: tuple[float, ...]
    """Greatest resident memory of `motionloom compose` in a process of its own, 2^20 bytes."""
    published: tuple[Take, Take]
    """First and second take for the prompts of the last length."""
    settings: dict[str, float | int | str]


def prompts(count: int) -> list[str]:
    """The first of 60 different prompts; after them they begin anew."""
    every = [f"a person {action}{manner}" for manner in MANNERS for action in ACTIONS]
    return [every[i % len(every)] for i in range(count)]


def long_motion(
    prior: Prior,
    how: Sampling,
    course: Course,
    *,
    weights: str = "default",
    run: Callable[[Sequence[str]], Process] = process,
    progress: Say = silent,
) -> Measured:
    """Measure; times of all lengths and of the published steps are taken in turns, memory afterwards."""
    texts = [prompts(round(seconds / course.each)) for seconds in course.lengths]
    takes, steps = published_takes(prior, how, texts[-1], seconds=course.each, steps=course.steps)
    progress(f"making {course.lengths[-1]:g} s of motion and shorter ones, and steps of the published recipe")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "long.bvh"
        makes = [_making(prior, how, some, course.each, out) for some in texts]
        first, second, *times = timed([*steps, *makes], course.repeats, warm=3)
        peaks = []
        for some in texts:
            make = ["--seconds", f"{course.each:g}", "--steps", str(how.steps), "--guidance", str(how.guidance)]
            peaks.append(run(["compose", *some, "--literal", *make, "--weights", weights, "--out", str(out)]).peak_mb)
            progress(f"{len(some)} prompts: {peaks[-1]:.0f} MB")
    settings = {
        "prompts": len(texts[-1]),
        "seconds_each": course.each,
        "transition_s": TRANSITION,
        "steps": how.steps,
        "guidance": how.guidance,
        "solver": SOLVER,
        "spacing": SPACING,
        "together": BATCH,
        "repeats": course.repeats,
        "published_mode": "published",
        "published_handshake": HANDSHAKE,
    }
    published = takes(first / course.steps, second / course.steps)
    return Measured(course.lengths, tuple(times), tuple(peaks), published, settings)


def _making(prior: Prior, how: Sampling, texts: Sequence[str], each: float, out: Path) -> Callable[[], None]:
    segments = [Segment(text, each) for text in texts]

    def make() -> None:
        with open_stream(out, total=len(texts) * round(each * prior.fps), fps=prior.fps) as file:
            for piece in compose_stream(prior, segments, guidance=how.guidance, steps=how.steps):
                file.write(piece)

    return make


def published_takes(
    prior: Prior, how: Sampling, texts: Sequence[str], *, seconds: float, steps: int
) -> tuple[Callable[[float, float], tuple[Take, Take]], list[Callable[[], np.ndarray]]]:
    """Jobs that make the first ``steps`` of either take, and what turns the seconds of a step into `Take`s.

    As released (Shafir et al. 2024): all prompts are one batch, every level is a step, the second take starts at 0.9 of
    them; each step has two network calls of the batch, with the text and without it in the first take, twice without
    it in the second. The motion is as long as that of `compose`: shared frames come on top of ``seconds``.
    """
    mode, half = MODES["published"], HANDSHAKE // 2
    ends = {0, len(texts) - 1}
    own = round(seconds * prior.fps)
    plan = Plan.of([own + half * (1 if i in ends else 2) for i in range(len(texts))], HANDSHAKE, mode.ramp)
    way = levels(prior.schedule, prior.schedule.steps)
    later = restarted(way, prior.schedule, mode.restart)
    noise = row_noise(range(len(texts)))
    x = noise(np.empty((len(texts), max(plan.lengths), len(prior.mean)), np.float32))
    bound = prior.net.bind(prior.condition(list(texts)))
    null = prior.net.bind(prior.condition([""] * len(texts)).null())
    none = prior.net.bind(prior.condition([""] * len(plan.handshakes)).null())
    inside, weights = sandwiches(x, plan), keep_weights(plan, mode.keep)

    def first() -> np.ndarray:
        denoise = in_two_calls(prior, bound, null, how.guidance)
        return first_take(denoise, x, plan, way=way[: steps + 1], schedule=prior.schedule, noise=noise)

    def second() -> np.ndarray:
        denoise, again = in_two_calls(prior, none, none, 0.0), row_noise(range(len(inside)))
        return second_take(denoise, inside, weights, way=later[: steps + 1], schedule=prior.schedule, noise=again)

    def takes(first_s: float, second_s: float) -> tuple[Take, Take]:
        return (
            Take(len(texts), max(plan.lengths), len(way) - 1, 2, steps, first_s),
            Take(len(inside), plan.width, len(later) - 1, 2, steps, second_s),
        )

    return takes, [first, second]


def in_two_calls(prior: Prior, bound: Bound, null: Bound, scale: float) -> Denoiser:
    """Guidance as the released code has it: the network is called once with and once without the text."""

    def denoise(x: np.ndarray, level: int) -> np.ndarray:
        with_text = prior.net(x, level, bound)
        return lerp(prior.net(x, level, null), with_text, np.array(scale, np.float32))

    return denoise


def entries_of(costs: Measured) -> list[Entry]:
    """The numbers against their targets."""
    return [_straight(costs), _memory(costs), _against_published(costs)]


def _straight(costs: Measured) -> Entry:
    slope, start, r2 = fit(costs.lengths, costs.times)
    off = 100 * max(abs(t / (start + slope * s) - 1) for s, t in zip(costs.lengths, costs.times, strict=True))
    pairs = list(zip(costs.lengths, costs.times, strict=True))
    stretches = [(t - u) / (s - r) / slope for (r, u), (s, t) in pairwise(pairs)]
    note = (
        ", ".join(f"{s:g} s: {t:.1f} s" for s, t in pairs)
        + f"; {60 * slope:.2f} s for each minute and {start:.2f} s once, r^2 {r2:.4f}; "
        + "slope from one to the next over that of the line: "
        + ", ".join(f"{value:.2f}" for value in stretches)
    )
    return Entry("long motion, time off a straight line", off, "%", "<= 10", off <= 10, note)


def _memory(costs: Measured) -> Entry:
    ratio = costs.peaks_mb[-1] / costs.peaks_mb[0]
    note = ", ".join(f"{s:g} s: {peak:.0f} MB" for s, peak in zip(costs.lengths, costs.peaks_mb, strict=True))
    name = f"long motion, memory of {costs.lengths[-1]:g} s / {costs.lengths[0]:g} s"
    return Entry(name, ratio, "times", "<= 1.3", ratio <= 1.3, f"{note}; peak resident, whole process")


def _against_published(costs: Measured) -> Entry:
    total = sum(take.seconds for take in costs.published)
    ratio = total / costs.times[-1]
    first, second = costs.published
    note = (
        f"{costs.lengths[-1]:g} s of motion: {costs.times[-1]:.1f} s; published: {total:.0f} s, extrapolated from "
        f"{first.timed} steps of each take: {first.steps} steps of {first.step_s:.2f} s ({first.calls} calls of "
        f"{first.rows} x {first.frames} frames) and {second.steps} of {second.step_s:.2f} s ({second.calls} of "
        f"{second.rows} x {second.frames})"
    )
    return Entry("published recipe / long motion", ratio, "times", ">= 50", ratio >= 50, note)
