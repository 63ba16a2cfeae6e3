"""Changing a clip by words: some parts or some time of it drawn anew, its end tied to its beginning, or more behind it.

Everything that is kept comes back exactly, on the clip's own skeleton and at its own rate. Only a window around what is
drawn goes through the network, so that the time does not grow with the length of the clip.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.edits.boundary import Stretch
from motionloom.errors import MotionloomError
from motionloom.features import layout
from motionloom.features.layout import FPS, WIDTH
from motionloom.goals.segment import LONGEST
from motionloom.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22
from motionloom.tasks.redraw import redraw
from motionloom.tasks.splice import (
    Kept,
    carried_level,
    concatenated,
    dressed,
    kept_parts,
    person_at_20,
    splice,
    standing,
)
from motionloom.tasks.text import GUIDANCE, LARGEST_SEED, STEPS, Progress
from motionloom.weights.prior import Prior

WINDOW = 8.0
"""Seconds that the network sees of a clip around a short stretch, the stretch included."""
CONTEXT = (1.0, 3.0)
"""Seconds, least and most, that it sees on either side."""
SHORTEST = 8
"""Frames at 20 fps of the shortest clip that can be edited."""
BLEND = 1.0
"""Seconds that are drawn anew for a loop."""
NEAR = (0.5, np.radians(45))
"""Metres and radians between the ends of a clip within which a loop closes in the world too."""

Span = tuple[float, float]
Stage = Callable[[Motion, int], Motion]


def edit(
    prior: Prior,
    motion: Motion,
    text: str = "",
    *,
    keep: Sequence[str] = (),
    between: Sequence[Span] = (),
    loop: bool = False,
    extend: float = 0.0,
    strength: float = 1.0,
    blend: float = BLEND,
    count: int = 1,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    skeleton: Literal["own", "smpl"] = "own",
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Motion]:
    """``count`` versions of a clip of one person, changed by the text; version i is drawn from ``seed + i``.

    keep: parts that stay: joints and groups of the 22-joint skeleton, ``root`` (its place), ``root_horizontal``; their
    own rotations stay as they are. between: stretches (start, end) in seconds; the rest stays. With neither ``between``
    nor ``extend`` a text changes the whole clip. extend: seconds to go on behind the clip. loop: draw the last
    ``blend`` seconds so that frame 0 can follow the last one: where the clip ends near where it began in the world too,
    else in pose and velocity. strength: how much noise the old motion gets before it is drawn again, above 0 to 1
    (nothing of it is left); the looped and added seconds are always drawn from noise. skeleton: the clip's own, or the
    22-joint person. clean: keep planted feet still where legs are drawn. The result stands where the clip stood.

    Raises `MotionloomError` for what cannot be asked, and for a clip of no person (see `retarget`).
    (Inpainting: Lugmayr et al. 2022; of motion: Tevet et al. 2023. Strength: Meng et al., SDEdit, 2022.)
    """
    asked = _Asked(text, tuple(keep), tuple(between), loop, extend, strength, blend)
    _check(prior, motion, asked, count=count, seed=seed, guidance=guidance, steps=steps)
    if skeleton not in ("own", "smpl"):
        raise MotionloomError(f"the skeleton is 'own' or 'smpl'; got {skeleton!r}")
    clip = motion if skeleton == "own" else to_smpl22(motion)
    done = calls = 0

    def tick() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done, calls)

    stages = _stages(_Pen(prior, text, guidance, steps, clean, tick), clip, asked)
    calls = count * len(stages) * steps
    made = []
    for number in range(count):
        version = clip
        for stage in stages:
            version = stage(version, seed + number)
        made.append(version)
    return made


@dataclass(frozen=True)
class _Asked:
    text: str
    keep: tuple[str, ...]
    between: tuple[Span, ...]
    loop: bool
    extend: float
    strength: float
    blend: float

    @property
    def whole(self) -> bool:
        """Whether the text is about all of the clip."""
        return bool(self.text.strip()) and not self.between and not self.extend


@dataclass(frozen=True, eq=False)
class _Pen:
    """What draws, and how."""

    prior: Prior
    text: str
    guidance: float
    steps: int
    clean: bool
    tick: Callable[[], None]
    """Called after each network call."""

    def draw(self, window: Motion, stretch: Stretch, seed: int) -> Motion:
        """The window with a new stretch, on its own skeleton, not yet spliced."""
        drawn = redraw(
            self.prior, stretch, self.text, seed=seed, guidance=self.guidance, steps=self.steps, progress=self.tick
        )
        return dressed(drawn, window, clean=self.clean)


def _stages(pen: _Pen, clip: Motion, asked: _Asked) -> list[Stage]:
    """One change after the other; each sees what those before it made."""
    numbers, kept = kept_numbers(asked.keep), kept_joints(clip, asked.keep)
    spans = [(0, len(clip))] if asked.whole else [_frames(clip, span) for span in sorted(asked.between)]
    stages: list[Stage] = [
        lambda motion, seed, span=span: _redrawn(pen, motion, span, seed, kept, numbers, asked.strength)
        for span in spans
    ]
    if asked.extend:
        stages.append(lambda motion, seed: _extended(pen, motion, asked.extend, seed))
    if asked.loop:
        stages.append(lambda motion, seed: _looped(pen, motion, asked.blend, seed))
    return stages


def kept_numbers(keep: Sequence[str]) -> NDArray[np.bool_]:
    """(263,) True at the features that tell about the kept parts."""
    chosen = layout.mask([name for name in keep if name.startswith("root")])
    joints = _joints(keep)
    if 0 in joints:
        chosen |= layout.mask("root")
    for joint in joints:
        chosen[layout.vel(joint)] = True
        if joint:
            chosen[layout.ric(joint)] = chosen[layout.rot(joint)] = True
    if set(layout.FEET) <= joints:
        chosen[layout.LAYOUT["contacts"]] = True
    return chosen


def kept_joints(clip: Motion, keep: Sequence[str]) -> Kept:
    """The same on the clip's own skeleton."""
    whole, level = "root" in keep, "root" in keep or "root_horizontal" in keep
    return kept_parts(clip.skeleton, _joints(keep), np.array([level, whole, level]))


def _joints(keep: Sequence[str]) -> frozenset[int]:
    return frozenset(SMPL22.resolve(name for name in keep if name not in ("root", "root_horizontal")))


# The three changes


def _redrawn(
    pen: _Pen, motion: Motion, span: tuple[int, int], seed: int, kept: Kept, numbers: NDArray[np.bool_], strength: float
) -> Motion:
    start, stop = span
    around = round(float(np.clip((WINDOW - (stop - start) / motion.fps) / 2, *CONTEXT)) * motion.fps)
    begin, end = max(start - around, 0), min(stop + around, len(motion))
    window = motion.frames(begin, end)
    first, last = start - begin, stop - begin
    stretch = _stretch(window, first, last, keep=numbers, strength=strength)
    made = pen.draw(window, stretch, seed)
    spliced = splice(window, made, first, last=last, kept=kept)
    before, behind = (_some(motion.frames, span) for span in ((0, start), (stop, len(motion))))
    return concatenated(*before, spliced.frames(first, last), *behind)


def _extended(pen: _Pen, motion: Motion, seconds: float, seed: int) -> Motion:
    tail = motion.frames(max(len(motion) - round(CONTEXT[1] * motion.fps), 0), len(motion))
    added = max(round(seconds * motion.fps), 1)
    window = concatenated(tail, *[tail.frames(len(tail) - 1, len(tail))] * added)
    made = pen.draw(window, _stretch(window, len(tail), len(window)), seed)
    spliced = splice(window, made, len(tail), last=len(window), kept=kept_joints(motion, ()))
    return concatenated(motion, spliced.frames(len(tail), len(window)))


def _looped(pen: _Pen, motion: Motion, blend: float, seed: int) -> Motion:
    """The end flows into the beginning: a stretch between the last frames and, moved behind them, the first ones."""
    rest, around = len(motion) - round(blend * motion.fps), round(CONTEXT[1] * motion.fps)
    tail, head = motion.frames(max(rest - around, 0), rest), motion.frames(0, min(around, rest))
    (end, facing), (begin, faced) = standing(motion, len(motion) - 1), standing(motion, 0)
    turn = rot.multiply(facing, rot.inverse(faced))
    straight = 2 * np.arccos(min(abs(float(turn[0])), 1.0)) < NEAR[1]
    here = straight and float(np.linalg.norm((end - begin)[[0, 2]])) < NEAR[0]
    if not here:
        head = carried_level(head, rot.IDENTITY if straight else turn, begin, end)
    gap = _between(tail, head, len(motion) - rest)
    first, last = len(tail), len(tail) + len(gap)
    window = concatenated(tail, gap, head)
    stretch = _stretch(window, first, last)
    made = pen.draw(window, replace(stretch, facing=straight, place=here), seed)
    if not here:
        (to, drawn), (begin, faced) = standing(made, last), standing(window, last)
        turn = rot.IDENTITY if straight else rot.multiply(drawn, rot.inverse(faced))
        window = concatenated(tail, gap, carried_level(head, turn, begin, to))
    spliced = splice(window, made, first, last=last, kept=kept_joints(motion, ()))
    return concatenated(motion.frames(0, rest), spliced.frames(first, last))


def _between(before: Motion, behind: Motion, frames: int) -> Motion:
    """So many frames from the last one before to the first one behind, evenly."""
    ends = concatenated(before.frames(len(before) - 1, len(before)), behind.frames(0, 1))
    return replace(replace(ends, fps=1.0).resample(frames + 1.0), fps=before.fps).frames(1, frames + 1)


def _stretch(
    window: Motion, first: int, last: int, *, keep: NDArray[np.bool_] | None = None, strength: float = 1.0
) -> Stretch:
    positions = person_at_20(window)
    at = [int(np.ceil(frame / window.fps * FPS - 1e-6)) for frame in (first, last)]
    stop = at[1] if last < len(window) else len(positions) - 1
    return Stretch(positions, at[0], stop, np.zeros(WIDTH, dtype=bool) if keep is None else keep, strength)


def _some(frames: Callable[[int, int], Motion], span: Span) -> list[Motion]:
    return [frames(int(span[0]), int(span[1]))] if span[0] < span[1] else []


# What cannot be asked


def _frames(clip: Motion, span: Span) -> tuple[int, int]:
    return round(span[0] * clip.fps), min(round(span[1] * clip.fps), len(clip))


def _check(prior: Prior, motion: Motion, asked: _Asked, *, count: int, seed: int, guidance: float, steps: int) -> None:
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers a frame; edits need {WIDTH} at {FPS:g} fps"
        )
    if count < 1 or not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"the count must be 1 or more and the seed 0 to below 2**62; got {count} and {seed}")
    if not isinstance(steps, int) or not 1 <= steps <= prior.schedule.steps:
        raise MotionloomError(f"{steps} steps cannot be taken; these weights take 1 to {prior.schedule.steps}")
    if not np.isfinite(guidance) or abs(guidance) > 100:
        raise MotionloomError(f"a guidance of {guidance:g} makes no motion; usual values are 1 to 7")
    if not 0 < asked.strength <= 1:
        raise MotionloomError(f"the strength must be above 0 and at most 1; got {asked.strength:g}")
    _check_parts(asked)
    _check_times(motion, asked)


def _check_parts(asked: _Asked) -> None:
    known = ("root", "root_horizontal", *SMPL22.groups, *SMPL22.names)
    unknown = [name for name in asked.keep if name not in known]
    if unknown:
        raise MotionloomError(f"no part called {unknown[0]!r} to keep; the parts are {', '.join(known)}")
    if not (asked.whole or asked.between or asked.loop or asked.extend):
        raise MotionloomError("nothing to change: say in words what to draw, name a stretch, loop or extend")
    if asked.keep and not (asked.whole or asked.between):
        raise MotionloomError("kept parts belong to a text or a stretch, and there is neither; add one")
    if len(_joints(asked.keep)) == len(SMPL22):
        raise MotionloomError("nothing to change: all joints are kept; keep fewer")


def _check_times(motion: Motion, asked: _Asked) -> None:
    length, frame = motion.seconds, 1 / motion.fps
    if length * FPS < SHORTEST - 1e-6 or len(motion) < 3:
        raise MotionloomError(f"the clip is {length:.2f} s long; at least {SHORTEST / FPS:g} s are needed to edit it")
    if not 0 <= asked.extend <= LONGEST or (asked.extend and asked.extend < 2 / FPS):
        raise MotionloomError(f"a clip can be extended by {2 / FPS:g} to {LONGEST:g} seconds; got {asked.extend:g}")
    for start, stop in asked.between:
        if not (0 <= start < stop <= length + frame and stop - start >= 3 / FPS):
            raise MotionloomError(
                f"no stretch from {start:g} to {stop:g} s: a clip of {length:.2f} s has stretches from 0 to "
                f"{length:.2f}, at least {3 / FPS:g} s long"
            )
    ordered = sorted(asked.between)
    for (start, stop), (following, end) in pairwise(ordered):
        if following < stop:
            raise MotionloomError(f"the stretches {start:g} to {stop:g} s and {following:g} to {end:g} s overlap")
    longest = max([length] if asked.whole else [stop - start for start, stop in asked.between], default=0.0)
    if longest > LONGEST:
        raise MotionloomError(f"{longest:.0f} s cannot be drawn at once; name stretches of at most {LONGEST:g} s")
    if asked.loop and not 2 / FPS <= asked.blend <= length + asked.extend - SHORTEST / FPS:
        raise MotionloomError(
            f"a loop of a clip of {length + asked.extend:.2f} s blends over {2 / FPS:g} to "
            f"{max(length + asked.extend - SHORTEST / FPS, 0):.2f} seconds; got {asked.blend:g}"
        )
