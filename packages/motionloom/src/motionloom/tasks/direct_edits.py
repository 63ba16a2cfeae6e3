"""Changes of a clip without sampling: parts of another clip over it, a head that looks somewhere, smoothing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.body.feet import clean_feet, planted_feet
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.heads import HeadMove
from motionloom.kinematics.gaze import looking, turned
from motionloom.retarget import to_smpl22
from motionloom.retarget.onto import onto, place_of, with_place
from motionloom.tasks.splice import KeptParts, ground_pose_at, kept_parts, move_on_floor, splice

Span = tuple[float, float]

EASE = 0.4
"""Seconds in which a head turns to what it looks at, and back."""
PARTS = ("root", "root_horizontal", *SMPL22.groups, *SMPL22.names)


@dataclass(frozen=True)
class SpanChange:
    """A change of some time of a clip."""

    spans: Sequence[Span] = ()
    """Stretches (start, end) in seconds; none: the whole clip."""

    def __post_init__(self) -> None:
        for (start, stop), (following, end) in pairwise(sorted(self.spans)):
            if following < stop:
                raise MotionloomError(f"the stretches {start:g} to {stop:g} s and {following:g} to {end:g} s overlap")

    def check(self, length: float, frame: float) -> float:
        """The seconds of a clip of ``length`` afterwards; raises MotionloomError where it cannot be changed so."""
        for start, stop in self.spans:
            if not (0 <= start < stop <= length + frame and stop - start >= 3 / FPS):
                raise MotionloomError(
                    f"no stretch from {start:g} to {stop:g} s: a clip of {length:.2f} s has stretches from 0 to "
                    f"{length:.2f}, at least {3 / FPS:g} s long"
                )
        return length

    def frames(self, clip: Motion) -> list[tuple[int, int]]:
        """First frames of the stretches and those behind their last."""
        ends = [(round(start * clip.fps), round(stop * clip.fps)) for start, stop in sorted(self.spans)]
        return [(start, min(stop, len(clip))) for start, stop in ends] or [(0, len(clip))]


@dataclass(frozen=True, eq=False)
class Overlay(SpanChange):
    """Parts that do what they do in another clip, from its beginning on, in each stretch."""

    source: Motion | None = None
    keep: Sequence[str] = ()
    """Parts that stay, as of `Redraw`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self.keep)

    def apply(self, sampler: Any, clip: Motion, seed: int) -> Motion:
        """The clip with the parts in it; a stretch is no longer than the source."""
        assert self.source is not None
        source = self.source.resample(clip.fps)
        for first, last in self.frames(clip):
            count = min(last - first, len(source))
            clip = _overlay_stretch(clip, source.frames(0, count), first, kept_parts_of(clip, self.keep))
        return clip


@dataclass(frozen=True, eq=False)
class Look(SpanChange):
    """A head that looks at a place, or at places."""

    at: NDArray[np.float64] | None = None
    """(3,) metres in the world, or (frames of the clip, 3)."""

    def apply(self, sampler: Any, clip: Motion, seed: int) -> Motion:
        """The clip with its head turned."""
        assert self.at is not None
        weights = np.zeros(len(clip))
        for first, last in self.frames(clip):
            # A stretch that begins with the clip, or ends with it, has no side to come from.
            begin = np.inf if first == 0 else (np.arange(last - first) + 1) / clip.fps
            end = np.inf if last == len(clip) else (last - first - np.arange(last - first)) / clip.fps
            weights[first:last] = smoothstep(np.minimum(begin, end) / EASE)
        return looking(clip, self.at, weights)


@dataclass(frozen=True, eq=False)
class Nod(SpanChange):
    """A head that nods, is shaken or looks aside in each stretch, from where it is."""

    move: HeadMove | None = None

    def apply(self, sampler: Any, clip: Motion, seed: int) -> Motion:
        """The clip with its head moved."""
        assert self.move is not None
        left, up = np.zeros((2, len(clip)))
        for first, last in self.frames(clip):
            time = np.arange(0.5, last - first) / clip.fps
            left[first:last], up[first:last] = self.move.at(time, (last - first) / clip.fps)
        return turned(clip, left, up)


@dataclass(frozen=True, eq=False)
class Smooth(SpanChange):
    """Joints and the root without what is quicker than some seconds, in each stretch."""

    seconds: float = 0.2
    """Two standard deviations of the Gaussian that is laid over rotations and places."""
    keep: Sequence[str] = ()
    """Parts that stay, as of `Redraw`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self.keep)

    def apply(self, sampler: Any, clip: Motion, seed: int) -> Motion:
        """The clip, smoothed; feet that stood still stand still, if the sampler keeps them and the legs do not stay."""
        parts, width = kept_parts_of(clip, self.keep), self.seconds * clip.fps / 2
        turns = gaussian_smooth(rot.unroll(clip.rotations).reshape(len(clip), -1), width).reshape(clip.rotations.shape)
        smoothed = with_place(replace(clip, rotations=rot.normalize(turns)), gaussian_smooth(place_of(clip), width))
        if sampler.foot_lock and not joints_of(self.keep).issuperset(SMPL22.groups["lower_body"]):
            still = planted_feet(to_smpl22(clip).positions(), clip.fps)
            smoothed = onto(clean_feet(to_smpl22(smoothed), contacts=still), smoothed)
        for first, last in self.frames(clip):
            clip = splice(clip, smoothed, first, last=last, keep=parts)
        return clip


def gaussian_smooth(values: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """(frames, channels) smoothed along time by a Gaussian of ``width`` frames; both ends go on as their mirror image.

    The mirror image is about the end itself, so that a steady slope stays one.
    """
    reach = min(int(np.ceil(2.5 * width)), len(values) - 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(width, 1e-6)) ** 2)
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    return np.stack([np.convolve(column, kernel / kernel.sum(), mode="valid") for column in padded.T], axis=-1)


def check_parts(keep: Sequence[str]) -> None:
    """Raise MotionloomError for parts that there are not, and where all of the body stays."""
    unknown = [name for name in keep if name not in PARTS]
    if unknown:
        raise MotionloomError(f"no part called {unknown[0]!r} to keep; the parts are {', '.join(PARTS)}")
    if len(joints_of(keep)) == len(SMPL22):
        raise MotionloomError("nothing to change: all joints are kept; keep fewer")


def joints_of(keep: Sequence[str]) -> frozenset[int]:
    """The joints of parts, out of 22."""
    return frozenset(SMPL22.resolve(name for name in keep if name not in ("root", "root_horizontal")))


def is_only_head_free(keep: Sequence[str]) -> bool:
    """Whether everything stays but head and neck, of which the text says what they do; errors as of `check_parts`."""
    check_parts(keep)
    return not set(range(len(SMPL22))) - joints_of(keep) - set(SMPL22.groups["head_neck"])


def kept_parts_of(clip: Motion, keep: Sequence[str]) -> KeptParts:
    """The kept parts on the clip's own skeleton."""
    whole, level = "root" in keep, "root" in keep or "root_horizontal" in keep
    return kept_parts(clip.skeleton, joints_of(keep), np.array([level, whole, level]))


def _overlay_stretch(clip: Motion, source: Motion, first: int, parts: KeptParts) -> Motion:
    last = first + len(source)
    there = clip.frames(first, last)
    piece = source if source.skeleton == clip.skeleton else onto(to_smpl22(source), there)
    piece = move_on_floor(piece, ground_pose_at(piece, 0), ground_pose_at(there, 0))
    # Outside it is as at its ends: from how far that is from the clip, the splice eases in and out.
    at = np.clip(np.arange(len(clip)) - first, 0, len(piece) - 1)
    extended = with_place(replace(clip, rotations=piece.rotations[at]), place_of(piece)[at])
    return splice(clip, extended, first, last=last, keep=parts)
