"""Changing a clip by words: parts or some time of it sampled anew, its end tied to its beginning, or more behind it.

Everything that is kept comes back exactly, on the clip's own skeleton and at its own rate. Only a window around what is
sampled goes through the network, so that the time does not grow with the length of the clip.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, Unpack

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion import Denoiser
from motionloom.core.errors import MotionloomError
from motionloom.core.features import layout
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.methods.edit import Observed
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.edits.boundary import InpaintWindow, arrival, joining
from motionloom.goals.heads import read_head
from motionloom.requests.fields import specs
from motionloom.requests.sampling import Sampling, Settings
from motionloom.requests.shared import LONGEST
from motionloom.requests.tasks import Edit
from motionloom.retarget import to_smpl22
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.direct_edits import (
    Look,
    Nod,
    Overlay,
    Smooth,
    Span,
    SpanChange,
    check_parts,
    is_only_head_free,
    joints_of,
    kept_parts_of,
)
from motionloom.tasks.sampling import Batch, Progress, Rows, sample
from motionloom.tasks.splice import (
    apply_sample,
    concatenate,
    ground_pose_at,
    move_on_floor,
    person_at_20,
    splice,
)
from motionloom.tasks.text import check_humanml
from motionloom.tasks.watching import View

WINDOW = 8.0
"""Seconds that the network sees of a clip around a short stretch, the stretch included."""
CONTEXT = (1.0, 3.0)
"""Seconds, least and most, that it sees on either side."""
SHORTEST = 8
"""Frames at 20 fps of the shortest clip that can be edited."""
BLEND = 1.0
"""Seconds that are sampled anew for a loop."""
NEAR = (0.5, np.radians(45))
"""Metres and radians between the ends of a clip within which a loop closes in the world too."""


@dataclass(frozen=True)
class Redraw(SpanChange):
    """Some time of a clip, or some parts of it, sampled anew."""

    keep: Sequence[str] = ()
    """Parts whose own rotations stay: joints and groups of the 22-joint skeleton, ``root`` (its place),
    ``root_horizontal``."""
    strength: float = 1.0
    """How much noise the old motion gets before it is denoised again, above 0 to 1 (nothing of it is left)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        specs(Edit)["strength"].check(self.strength, "strength")
        check_parts(self.keep)

    def check(self, length: float, frame: float) -> float:
        """The seconds of a clip of ``length`` afterwards; raises MotionloomError where it cannot be changed so."""
        length = super().check(length, frame)
        longest = max((stop - start for start, stop in self.spans), default=length)
        if longest > LONGEST:
            raise MotionloomError(f"{longest:.0f} s cannot be sampled at once; name stretches of at most {LONGEST:g} s")
        return length

    def apply(self, sampler: "_Sampler", clip: Motion, seed: int) -> Motion:
        """The clip with its stretches sampled, one after the other."""
        for span in self.frames(clip):
            clip = _inpaint_span(sampler, clip, span, self, seed)
        return clip


@dataclass(frozen=True)
class Extend:
    """More behind the end of a clip."""

    seconds: float

    def __post_init__(self) -> None:
        if not 2 / FPS <= self.seconds <= LONGEST:
            raise MotionloomError(f"a clip can be extended by {2 / FPS:g} to {LONGEST:g} seconds; got {self.seconds:g}")

    def check(self, length: float, frame: float) -> float:
        """The seconds of a clip of ``length`` afterwards."""
        return length + self.seconds

    def apply(self, sampler: "_Sampler", clip: Motion, seed: int) -> Motion:
        """The clip and what comes behind it."""
        tail = clip.frames(max(len(clip) - round(CONTEXT[1] * clip.fps), 0), len(clip))
        added = max(round(self.seconds * clip.fps), 1)
        window = concatenate(tail, *[tail.frames(len(tail) - 1, len(tail))] * added)
        stretch = replace(_inpaint_window(window, len(tail), len(window)), begin=(len(clip) - len(tail)) / clip.fps)
        sampled = sampler.sample(window, stretch, seed)
        spliced = splice(window, sampled, len(tail))
        return concatenate(clip, spliced.frames(len(tail), len(window)))


@dataclass(frozen=True)
class Loop:
    """The end of a clip sampled anew so that frame 0 can follow the last one: where the clip ends near where it began
    in the world too, else in pose and velocity."""

    blend: float = BLEND
    """Seconds that are sampled."""

    def check(self, length: float, frame: float) -> float:
        """The seconds of a clip of ``length`` afterwards; raises MotionloomError where it is too short."""
        if not 2 / FPS <= self.blend <= length - SHORTEST / FPS:
            raise MotionloomError(
                f"a loop of a clip of {length:.2f} s blends over {2 / FPS:g} to "
                f"{max(length - SHORTEST / FPS, 0):.2f} seconds; got {self.blend:g}"
            )
        return length

    def apply(self, sampler: "_Sampler", clip: Motion, seed: int) -> Motion:
        """The clip as a loop."""
        return _close_loop(sampler, clip, self.blend, seed)


Change: TypeAlias = Redraw | Extend | Loop | Overlay | Look | Nod | Smooth


def edit(
    prior: Prior,
    motion: Motion,
    text: str = "",
    changes: Change | Sequence[Change] = (),
    *,
    skeleton: Literal["own", "smpl"] = "own",
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[Motion]:
    """Versions of a clip of one person, changed by the text.

    Args:
        prior: weights that make HumanML3D's 263 numbers.
        motion: the clip, on any humanoid skeleton and at any rate; what is not changed comes back bit for bit.
        text: what the person does; an empty one is no condition.
        changes: `Redraw`, `Extend`, `Loop`, `Overlay`, `Look`, `Nod` and `Smooth`, one after the other; a text
            alone redraws the whole clip.
        skeleton: the clip's own, or the 22-joint person. The result is where the clip was.
        foot_lock: keep planted feet still where legs are sampled.
        sampling: or single settings of it as keywords; version i of ``count`` is sampled from ``seed + i``.
        progress: called after each network call with the calls done and the calls in all.

    Raises:
        MotionloomError: for an impossible request, and for a clip of no person (see `retarget`).

    (Inpainting: Lugmayr et al. 2022; of motion: Tevet et al. 2023. Strength: Meng et al., SDEdit, 2022.)
    """
    requested = [changes] if isinstance(changes, Change) else list(changes)
    requested = requested or changes_from_options(text)
    chosen = Sampling.of(sampling, settings)
    chosen.levels(prior.schedule)
    if skeleton not in ("own", "smpl"):
        raise MotionloomError(f"the skeleton is 'own' or 'smpl'; got {skeleton!r}")
    _check(prior, motion, requested)
    clip = motion if skeleton == "own" else to_smpl22(motion)
    stages = sum(
        len(one.frames(clip)) if isinstance(one, Redraw) else not isinstance(one, SpanChange) for one in requested
    )
    seeds = chosen.seeds(chosen.number())
    sampler = _Sampler(prior, text, chosen, foot_lock, _in_stages(progress, len(seeds) * stages, chosen.steps))
    versions = []
    for seed in seeds:
        version = clip
        for change in requested:
            version = change.apply(sampler, version, seed)
        versions.append(version)
    return versions


def changes_from_options(
    text: str,
    *,
    keep: Sequence[str] = (),
    between: Sequence[Span] = (),
    loop: bool = False,
    extend: float = 0.0,
    strength: float = 1.0,
    blend: float = BLEND,
    source: Motion | None = None,
    look: NDArray[np.float64] | None = None,
    smooth: float = 0.0,
) -> list[Change]:
    """The changes that single options describe: with neither ``between`` nor ``extend`` a text is about the whole clip.

    Where everything is kept but the head, the text says what that does (`motionloom.goals.heads`).
    source: a clip whose parts take the place of a text. look: where the head looks, as of `Look`.
    smooth: seconds, as of `Smooth`. Raises MotionloomError where there is no change, and for a text beside a source.
    """
    changes: list[Change] = []
    has_text = bool(text.strip()) and not extend
    if source is not None:
        if has_text:
            raise MotionloomError("parts do what a text says or what another clip does; leave out one of them")
        changes.append(Overlay(tuple(between), source, tuple(keep)))
    elif has_text and is_only_head_free(keep):
        changes.append(Nod(tuple(between), read_head(text)))
    elif has_text or (between and look is None and not smooth):
        changes.append(Redraw(tuple(between), tuple(keep), strength))
    elif keep and not smooth:
        raise MotionloomError("kept parts belong to a text or a stretch, and there is neither; add one")
    changes += [Smooth(tuple(between), smooth, tuple(keep))] if smooth else []
    changes += [Look(tuple(between), look)] if look is not None else []
    changes += [Extend(extend)] if extend else []
    changes += [Loop(blend)] if loop else []
    if not changes:
        raise MotionloomError(
            "nothing to change: say in words what to make, name a stretch, smooth, look, loop or extend"
        )
    return changes


def _in_stages(progress: Progress | None, stages: int, steps: int) -> Progress:
    """What the stages of all versions report to, one after the other, each as so many steps."""
    before = 0

    def report(calls: int, total: int) -> None:
        nonlocal before
        if progress:
            progress(round((before + calls / total) * steps), stages * steps)
        before += calls == total

    return report


@dataclass(frozen=True, eq=False)
class _Sampler:
    """What samples, and how."""

    prior: Prior
    text: str
    sampling: Sampling
    foot_lock: bool
    progress: Progress

    def sample(self, motion: Motion, window: InpaintWindow, seed: int) -> Motion:
        """A clip with a window of it sampled, on its own skeleton, not yet spliced."""
        placed = inpaint_motion(self.prior, window, self.text, self.sampling, seed=seed, progress=self.progress)
        return apply_sample(placed, motion, foot_lock=self.foot_lock)


def kept_feature_mask(keep: Sequence[str]) -> NDArray[np.bool_]:
    """(263,) True at the features of the kept parts."""
    chosen = layout.mask([name for name in keep if name.startswith("root")])
    joints = joints_of(keep)
    if 0 in joints:
        chosen |= layout.mask("root")
    for joint in joints:
        chosen[layout.vel(joint)] = True
        if joint:
            chosen[layout.ric(joint)] = chosen[layout.rot(joint)] = True
    if set(layout.FEET) <= joints:
        chosen[layout.LAYOUT["contacts"]] = True
    return chosen


# What the changes do


def _inpaint_span(sampler: _Sampler, motion: Motion, span: tuple[int, int], change: Redraw, seed: int) -> Motion:
    start, stop = span
    around = round(float(np.clip((WINDOW - (stop - start) / motion.fps) / 2, *CONTEXT)) * motion.fps)
    begin, end = max(start - around, 0), min(stop + around, len(motion))
    window = motion.frames(begin, end)
    first, last = start - begin, stop - begin
    stretch = _inpaint_window(window, first, last, keep=kept_feature_mask(change.keep), strength=change.strength)
    sampled = sampler.sample(window, replace(stretch, begin=begin / motion.fps), seed)
    spliced = splice(window, sampled, first, last=last, keep=kept_parts_of(motion, change.keep))
    before = [motion.frames(0, start)] if start else []
    behind = [motion.frames(stop, len(motion))] if stop < len(motion) else []
    return concatenate(*before, spliced.frames(first, last), *behind)


def _close_loop(sampler: _Sampler, motion: Motion, blend: float, seed: int) -> Motion:
    """The end flows into the beginning: a stretch between the last frames and, moved behind them, the first ones."""
    rest, around = len(motion) - round(blend * motion.fps), round(CONTEXT[1] * motion.fps)
    tail, head = motion.frames(max(rest - around, 0), rest), motion.frames(0, min(around, rest))
    end, start = ground_pose_at(motion, len(motion) - 1), ground_pose_at(motion, 0)
    metres, radians = end.apart(start)
    straight = radians < NEAR[1]
    here = straight and metres < NEAR[0]
    if not here:
        head = move_on_floor(head, start, replace(end, facing=start.facing) if straight else end)
    gap = _interpolated(tail, head, len(motion) - rest)
    first, last = len(tail), len(tail) + len(gap)
    window = concatenate(tail, gap, head)
    stretch = _inpaint_window(window, first, last)
    begin = max(rest - around, 0) / motion.fps
    sampled = sampler.sample(window, replace(stretch, facing=straight, place=here, begin=begin), seed)
    if not here:
        arrived, left = ground_pose_at(sampled, last), ground_pose_at(window, last)
        arrived = replace(arrived, facing=left.facing) if straight else arrived
        window = concatenate(tail, gap, move_on_floor(head, left, arrived))
    spliced = splice(window, sampled, first, last=last)
    return concatenate(motion.frames(0, rest), spliced.frames(first, last))


def _interpolated(before: Motion, behind: Motion, frames: int) -> Motion:
    """So many frames from the last one before to the first one behind, evenly."""
    ends = concatenate(before.frames(len(before) - 1, len(before)), behind.frames(0, 1))
    return replace(replace(ends, fps=1.0).resample(frames + 1.0), fps=before.fps).frames(1, frames + 1)


def _inpaint_window(
    window: Motion, first: int, last: int, *, keep: NDArray[np.bool_] | None = None, strength: float = 1.0
) -> InpaintWindow:
    positions = person_at_20(window)
    at = [int(np.ceil(frame / window.fps * FPS - 1e-6)) for frame in (first, last)]
    stop = at[1] if last < len(window) else len(positions) - 1
    return InpaintWindow(positions, at[0], stop, np.zeros(WIDTH, dtype=bool) if keep is None else keep, strength)


# Errors of requests


def _check(prior: Prior, motion: Motion, changes: Sequence[Change]) -> None:
    check_humanml(prior, "edits need")
    length = motion.seconds
    if length * FPS < SHORTEST - 1e-6 or len(motion) < 3:
        raise MotionloomError(
            f"the clip is {length:.2f} s long (frames: {len(motion)}); at least {SHORTEST / FPS:g} s and 3 frames are "
            "needed to edit it: take a longer one"
        )
    for change in changes:
        length = change.check(length, 1 / motion.fps)


# What is sampled: a stretch of a person's motion between frames that are known, which stay (Lugmayr et al.,
# "RePaint", CVPR 2022, without its repetitions). Where the motion goes on behind it, every denoised estimate is bent
# to arrive there: features hold velocities of the root, nothing else would.

Array = NDArray[np.float64]


def inpaint_motion(
    prior: Prior, window: InpaintWindow, text: str, sampling: Sampling, *, seed: int, progress: Progress | None = None
) -> PlacedMotion:
    """A whole window with the frames ``first`` to before ``last`` sampled by the text; the others come back to float32.

    An empty text is no condition. Frames from 0 on are placed by the next ones.
    """
    whole = PlacedMotion.of(window.positions)
    known = whole.features[None]
    mask = np.ones(known.shape, np.bool_)
    mask[:, window.first : window.last] = window.keep
    spread = prior.spread
    meet, reach = joining(known, mask, window.first, window.last), arrival(known, mask, window)

    def bent(denoise: Denoiser, _: Batch) -> Denoiser:
        return lambda state, level: (reach(meet(denoise(state, level) * spread + prior.mean)) - prior.mean) / spread

    def poses(states: np.ndarray) -> Array:
        return _placed(states[0] * spread + prior.mean, whole, window).positions[None, None]

    observed = Observed((known - prior.mean) / spread, mask, strength=window.strength)
    rows = Rows([text], [known.shape[1]], [seed])
    [(_, state)] = sample(
        prior,
        rows,
        sampling,
        edits=[bent],
        observed=observed,
        corrected=True,
        progress=progress,
        view=View(poses, begin=window.begin),
        choose=best_in_words,
    )
    return _placed(state * spread + prior.mean, whole, window)


def _placed(features: np.ndarray, whole: PlacedMotion, window: InpaintWindow) -> PlacedMotion:
    """A sampled window in the world, where the frames before the stretch are, or else those behind it."""
    placed = PlacedMotion(features, whole.begin)
    if window.first == 0 and window.last < len(features):
        return placed.moved_to(whole.at(window.last), window.last)
    return placed
