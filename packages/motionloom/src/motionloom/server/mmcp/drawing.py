"""The answer to an MMCP request: segments and constraints to motions on the client's skeleton."""

import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.body.feet import planted_feet
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FEET
from motionloom.core.motion import Motion
from motionloom.edits.fitting import fit
from motionloom.goals.goal import FPS, Goal, start_of
from motionloom.goals.segment import Segment
from motionloom.goals.timeline import Timeline
from motionloom.requests.sampling import Sampling
from motionloom.requests.tasks import Compose, Edit, Generate
from motionloom.server.mmcp.constraints import Clock, Goals, as_goal, read_constraints, standing_as, whole_path
from motionloom.server.mmcp.rigs import Rig, read_rig
from motionloom.tasks.run import Models, Plan, run, run_each
from motionloom.tasks.splice import concatenate, ground_pose_at, move_on_floor
from motionloom.tasks.worded import read

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

TRANSITION = 1.0
"""Seconds that two segments share where a request gives none."""
POSE_SECONDS = 2.0
"""Length of the motion that a single pose is taken from; it is its middle."""
VARIED = 0.75
"""How far a performance may be from the motion that it is like: the ``strength`` of `edit`."""
SEAM = 0.4
"""Seconds before and after the seam with a motion that is like another, which are sampled anew."""
NEAR = 0.6
"""Metres from a foot within which a point of the ground is under it."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The samples of a request: rotations as MMCP has them."""

    rotations: Array
    """(samples, frames, joints, 4) x, y, z, w."""
    root: Array
    """(samples, frames, 3)"""
    translations: Array | None
    boundaries: list[list[int]]
    names: dict[str, str]
    """The client's joint for each of the 22."""
    notes: list[dict[str, str]]


def answer(models: Models, request: Any, progress: Progress) -> Iterator[Answer]:
    """Answer a `motionmcp.GenerateRequest`; one answer with all of its samples."""
    rig = read_rig([joint.model_dump() for joint in request.skeleton.joints])
    clock = Clock(request.total_frames, request.fps(FPS))
    goals = read_constraints(request.constraints, rig, clock)
    options = request.options
    seed, count = (options.seed, options.num_samples) if options else (None, 1)
    seed = secrets.randbelow(2**31) if seed is None else abs(seed) % 2**61
    motions = []
    for number in range(count):
        motion = _sample(models, request, rig, clock, goals, seed + number)
        motions.append(rig.from_person(clock.resampled(motion)))
        progress(number + 1, count)
    places = [rig.places_of(motion) for motion in motions]
    free = [one for one in places if one is not None]
    yield Answer(
        np.stack([rig.rotations_of(motion) for motion in motions]),
        np.stack([motion.root for motion in motions]),
        np.stack(free) if len(free) == count else None,
        [_request_ends(request)[:-1]] * count,
        {} if rig.uniform else rig.joints(),
        list(goals.notes),
    )


def _request_ends(request: Any) -> list[int]:
    """The request's frames at which its segments end."""
    return np.cumsum([segment.duration_frames for segment in request.segments], dtype=int).tolist()


@dataclass(frozen=True)
class _Sampler:
    """Samples by the library's own requests, through the one `run`."""

    models: Models
    sampling: Sampling

    def run(self, plan: Plan, seed: int) -> Motion:
        """The one motion of a plan."""
        [result] = run(replace(plan, sampling=replace(self.sampling, seed=seed)), self.models)
        return result.people[0]

    def compose(self, segments: Sequence[Segment], seed: int, path: Goal | None = None) -> Motion:
        """Segments, one after the other."""
        timeline = Timeline(tuple(segments), path=path)
        values = Compose(timeline=timeline)
        return self.run(Plan(task="compose", values=values, sampling=self.sampling, timeline=timeline), seed)

    def edit(self, values: Edit, seed: int) -> Motion:
        """A motion changed by a request without words."""
        people = (values.motion,)
        return self.run(Plan(task="edit", values=values, sampling=self.sampling, people=people), seed)


def _sample(models: Models, request: Any, rig: Rig, clock: Clock, goals: Goals, seed: int) -> Motion:
    """One motion of the uniform person at 20 per second."""
    kinds = {segment.type for segment in request.segments}
    sampler = _Sampler(models, _sampling(request))
    if kinds == {"pose"}:
        return _poses(sampler, request, seed)
    if "pose" in kinds:
        raise MotionloomError(
            "a pose has one frame and no motion: ask for poses and for motion in requests of their own"
        )
    if "motion_reference" in kinds:
        motion = _like(sampler, request, rig, clock, seed)
        goal = _posed(goals.goal, goals, motion)
        motion = motion if goal.empty else fit(motion, goal)
    else:
        segments = _segments(request, clock)
        motion = _generated(sampler, segments, goals, seed)
    if request.options and request.options.loop:
        motion = _looped(sampler, motion, seed)
    return motion if goals.ground is None else on_ground(motion, goals.ground)


def _sampling(request: Any) -> Sampling:
    """One motion, with the steps and guidance of the request."""
    settings: dict[str, Any] = {}
    if request.options is not None and "diffusion_steps" in request.options.model_fields_set:
        settings["steps"] = request.options.diffusion_steps
    if request.options is not None and request.options.guidance is not None:
        settings["guidance"] = request.options.guidance.weight[0] if request.options.guidance.weight else 1.0
    return Sampling(count=1, **settings)


def _segments(request: Any, clock: Clock) -> list[Segment]:
    """Segments at 20 frames per second whose frames add up to those that are sampled."""
    listed = request.segments or [None]
    ends = [clock.sampled_frames] if request.segments == [] else _ends(request, clock)
    frames = np.diff([0, *ends]).tolist()
    transition = TRANSITION
    if request.options is not None and "transition_frames" in request.options.model_fields_set:
        transition = max(request.options.transition_frames / clock.fps, 2 / FPS)
    shared = [min(transition, min(a, b) / FPS / 2) for a, b in zip(frames, [*frames[1:], frames[-1]], strict=True)]
    if min(frames) < 4:
        raise MotionloomError(f"a segment of {min(frames) / FPS:g} s is too short; 0.2 s is the least")
    return [
        Segment(getattr(one, "prompt", ""), count / FPS, transition=overlap)
        for one, count, overlap in zip(listed, frames, shared, strict=True)
    ]


def _ends(request: Any, clock: Clock) -> list[int]:
    return [*map(clock.frame, _request_ends(request)[:-1]), clock.sampled_frames]


def _generated(sampler: _Sampler, segments: list[Segment], goals: Goals, seed: int) -> Motion:
    """The segments, steered to their constraints; poses without a place are placed where a first sample is."""
    goal = goals.goal
    if goals.floating:
        goal = _posed(goal, goals, _steered(sampler, segments, goal, seed))
    return _steered(sampler, segments, goal, seed)


def _steered(sampler: _Sampler, segments: list[Segment], goal: Goal, seed: int) -> Motion:
    """One motion of the segments that meets a goal in the world."""
    if goal.empty:
        return sampler.compose(segments, seed)
    if len(segments) == 1:
        place = start_of(goal)
        (only,) = segments
        return sampler.compose([replace(only, goal=goal.relative_to(place))], seed).placed(place)
    if goal.mask[:, 0, [0, 2]].all(axis=-1).any():
        return sampler.compose(segments, seed, whole_path(goal))
    return fit(sampler.compose(segments, seed), goal)


def _posed(goal: Goal, goals: Goals, motion: Motion) -> Goal:
    """The goal, and the poses without a place of their own where ``motion`` is then."""
    places = motion.positions()
    for pose in goals.floating:
        other = as_goal(standing_as(pose, places[pose.frame]), len(goal))
        positions = np.where(goal.mask, goal.positions, other.positions)
        goal = replace(goal, positions=positions, mask=goal.mask | other.mask)
    return goal


def _poses(sampler: _Sampler, request: Any, seed: int) -> Motion:
    """One frame for each prompt: the middle of a short motion, at the origin."""
    plans = [
        Plan(
            task="generate",
            values=Generate(prompt=segment.prompt),
            sampling=replace(sampler.sampling, seed=seed + number),
            timeline=read(sampler.models.prior, segment.prompt, POSE_SECONDS, parted=False),
        )
        for number, segment in enumerate(request.segments)
    ]
    clips = [result.people[0] for _, result in run_each(plans, sampler.models)]
    middle = [motion.frames(len(motion) // 2, len(motion) // 2 + 1) for motion in clips]
    return concatenate(*middle, *[middle[-1]] * 4)  # the clock takes as many as it needs


def _like(sampler: _Sampler, request: Any, rig: Rig, clock: Clock, seed: int) -> Motion:
    """Segments of which some are given by a motion: each sampled by itself and placed behind the one before."""
    whole: Motion | None = None
    begins = [0, *_ends(request, clock)]
    for number, (segment, begin, end) in enumerate(zip(request.segments, begins, begins[1:], strict=False)):
        frames = end - begin
        if segment.type == "motion_reference":
            part = _performance(sampler, segment, rig, frames, seed + number)
        else:
            one = Segment(getattr(segment, "prompt", ""), frames / FPS)
            part = sampler.compose([one], seed + number)
        whole = part if whole is None else _joined(sampler, whole, part, seed + number)
    assert whole is not None
    return whole


def _performance(sampler: _Sampler, segment: Any, rig: Rig, frames: int, seed: int) -> Motion:
    """A new performance of a clip, of so many frames: its middle varied, its end gone on from where it is short."""
    own = read_rig([joint.model_dump() for joint in segment.skeleton.joints]) if segment.skeleton else rig
    turns = np.array(segment.rotations, dtype=np.float64)
    root = np.array(segment.root_positions, dtype=np.float64)
    clip = own.person(own.motion(segment.joint_names, turns, root, segment.fps)).resample(FPS)
    longest = 60 * FPS
    clip = clip.frames(0, int(min(len(clip), max(frames, 8), longest)))
    if len(clip) < 8:
        raise MotionloomError(f"a motion to be like is {len(clip) / FPS:.2f} s long; at least 0.4 s are needed")
    missing = frames - len(clip)
    longer = max(missing, 2) / FPS if missing > 0 else 0.0
    changed = sampler.edit(Edit(motion=clip, between=((0.0, clip.seconds),), strength=VARIED, extend=longer), seed)
    return changed.frames(0, frames)


def _joined(sampler: _Sampler, before: Motion, behind: Motion, seed: int) -> Motion:
    behind = move_on_floor(behind, ground_pose_at(behind, 0), ground_pose_at(before, len(before) - 1))
    seam = before.seconds
    whole = concatenate(before, behind)
    around = min(SEAM, before.seconds / 2, behind.seconds / 2)
    span = (seam - around, min(seam + around, whole.seconds))
    return sampler.edit(Edit(motion=whole, between=(span,)), seed)


def _looped(sampler: _Sampler, motion: Motion, seed: int) -> Motion:
    """A cycle: its last frame is its first one again, moved on by the way of one cycle."""
    blend = min(1.0, max(motion.seconds / 3, 0.1))
    cycle = sampler.edit(Edit(motion=motion.frames(0, len(motion) - 1), loop=True, blend=blend), seed)
    last = cycle.frames(0, 1)
    step = (cycle.root[1] - cycle.root[0]) * np.array([1.0, 0.0, 1.0])
    place = cycle.root[-1:] + step
    place[:, 1] = last.root[:, 1]
    return concatenate(cycle, replace(last, root=place))


def on_ground(motion: Motion, ground: Array) -> Motion:
    """The motion over a ground of points (x, z, height): planted feet stand on the point under them.

    The body rises and sinks with the feet that stand, in between evenly; the legs are fitted to what is left. A foot
    that no point is under (`NEAR`) is in the air and has no goal.
    """
    positions = motion.positions()
    planted = planted_feet(positions, motion.fps)
    feet = positions[:, list(FEET)]
    away = np.linalg.norm(feet[:, :, None, [0, 2]] - ground[None, None, :, :2], axis=-1)
    near, height = away.min(axis=-1) < NEAR, ground[away.argmin(axis=-1), 2]
    standing = planted & near
    frames = np.flatnonzero(standing.any(axis=1))
    if len(frames) == 0:
        return motion
    level = [float(height[frame][standing[frame]].mean()) for frame in frames]
    rise = np.interp(np.arange(len(motion)), frames, level)
    kernel = np.hanning(9)[1:-1] / np.hanning(9)[1:-1].sum()
    rise = np.convolve(np.pad(rise, 3, mode="edge"), kernel, mode="valid")
    raised = replace(motion, root=motion.root + rise[:, None] * [0.0, 1.0, 0.0])
    goal, joints = Goal.nothing(len(motion)), list(FEET)
    for foot, joint in enumerate(joints):
        at = standing[:, foot]
        goal.positions[at, joint] = feet[at, foot] + height[at, foot, None] * [0.0, 1.0, 0.0]
        goal.mask[at, joint] = True
    return fit(raised, goal)
