"""What a predictor does over long times, with parts held, and on the way to a target: studies of given weights.

Every function takes a `Lab` and a predictor, and gives columns, rows and further settings;
`prediction_studies` writes them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.diffusion import row_seed
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import Layout
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.kinematics import physics
from motionloom.kinematics.layout_body import body_of_places, layout_skeleton, smpl_joints
from motionloom.requests.sampling import PredictionSampling
from motionloom.tasks.completion import Known, WindowSampler, next_frames
from motionloom.tasks.other_joints import sees_person
from motionloom.tasks.predict import predict, switch
from motionloom_lab.metrics import prediction as metrics
from motionloom_lab.metrics.prediction_body import seam
from motionloom_lab.report.report import REAL, Column, Row
from motionloom_lab.report.tables import columns
from motionloom_lab.suites import prediction_trial as trials
from motionloom_lab.suites.harness import plain_row
from motionloom_lab.suites.prediction_trial import Array, PredictionTrial, from_root
from motionloom_train.data.prediction import Protocol
from motionloom_train.data.progress import Say, silent

Findings = tuple[Sequence[Column], list[Row], dict[str, Any]]


@dataclass(frozen=True)
class Budget:
    """How much is measured."""

    windows: int
    samples: int
    train_steps: int = 1000
    seed: int = 0
    seconds: float = 20.0
    """Of a long horizon."""
    walks: tuple[int, ...] = (2, 3, 4, 5, 8, 10, 20, 50, 100)
    """Sampling steps that are compared."""


@dataclass(frozen=True, eq=False)
class Lab:
    """What a study works with."""

    protocol: Protocol
    """Its test part is measured."""
    budget: Budget
    keep: Path
    """Where trained networks lie."""
    net: Mapping[str, Any] = field(default_factory=dict)
    """Sizes of the networks that are trained, other than the usual small ones (``[predictor]`` of a recipe)."""
    values: tuple[Any, ...] = ()
    """What the setting of a study is changed to; empty: its usual values."""
    device: str = "cpu"
    say: Say = silent


POSES = 3000
"""Training poses that others are compared with."""
GROUPS = ("left_arm", "right_arm", "left_leg", "right_leg", "torso", "lower_body", "upper_body")
TRANSITIONS = (0.5, 1.0, 2.0)


def horizon(lab: Lab, predictor: Predictor) -> Findings:
    """Futures that go on from themselves, second by second: do they freeze, do they drift."""
    protocol, budget = lab.protocol, lab.budget
    trial = trials.prepare(protocol, count=budget.windows)
    samples = long_futures(predictor, trial, budget, say=lab.say)
    known = _known_poses(protocol)
    real = np.stack([trial.future(k) for k in range(len(trial.windows))])
    rows = [plain_row(REAL, _lively(real, protocol, known) | {"spread": _spread(real[None], protocol.layout)})]
    second = round(protocol.fps)
    for start in range(0, samples.shape[2] - second + 1, second):
        part = samples[:, :, start : start + second]
        numbers = _lively(part.reshape(-1, *part.shape[2:]), protocol, known)
        spread = {"spread": _spread(part, protocol.layout)} if budget.samples > 1 else {}
        rows.append(plain_row(f"second {start // second + 1}", numbers | spread))
    about = {"weights": predictor.card.name, "seconds": budget.seconds, "training poses": len(known)}
    return columns("study-horizon"), rows, about


def long_futures(predictor: Predictor, trial: PredictionTrial, budget: Budget, say: Say = silent) -> Array:
    """(windows, samples, frames, joints, 3): every future goes on from its own end, as `tasks.predict` does."""
    count, fps = len(trial.windows), predictor.fps
    person = np.repeat(trial.pasts(0, count), budget.samples, axis=0)
    turns, pieces = int(np.ceil(budget.seconds * fps / (predictor.frames - predictor.observed) - 1e-9)), []
    sampler = WindowSampler(predictor, PredictionSampling())
    for turn, new in enumerate(sampler.windows(person, [(budget.seed, i) for i in range(len(person))], None, turns)):
        say(f"window {turn + 1} of {turns}")
        pieces.append(new)
    whole = np.concatenate(pieces, axis=1)[:, : round(budget.seconds * fps)]
    return whole.reshape(count, budget.samples, *whole.shape[1:])


def _lively(motions: Array, protocol: Protocol, known: Array) -> dict[str, float]:
    """Of motions (rows, frames, joints, 3)."""
    body, fps = from_root(motions), protocol.fps
    poses = own_poses(motions[:, ::5].reshape(-1, *motions.shape[2:]), protocol.layout)
    return {
        "speed": float(np.linalg.norm(np.diff(body, axis=1), axis=-1).mean() * fps),
        "root_speed": float(np.linalg.norm(np.diff(motions[:, :, 0, [0, 2]], axis=1), axis=-1).mean() * fps),
        "jerk": float(np.mean([physics.jerk(one, fps).mean for one in body])),
        "height": float(motions[:, :, 0, 1].mean()),
        "nearest": float(_nearest(poses, known).mean()),
    }


def own_poses(positions: Array, layout: Layout) -> Array:
    """(poses, joints, 3) to (poses, 3 (joints - 1)): each from its own root and in its own facing."""
    turned = layout.place(positions).into(positions[:, None])[:, 0]
    return from_root(turned).reshape(len(positions), -1)


def _known_poses(protocol: Protocol) -> Array:
    recordings = protocol.split("train") or protocol.split("test")
    places = np.concatenate([r.positions for r in recordings])
    chosen = np.linspace(0, len(places) - 1, min(POSES, len(places))).round().astype(int)
    return own_poses(places[chosen].astype(np.float64), protocol.layout)


def _nearest(poses: Array, known: Array) -> Array:
    """(poses,) metres per joint, root of the mean square."""
    least = []
    for first in range(0, len(poses), 1000):
        own = poses[first : first + 1000]
        square = np.square(own).sum(1)[:, None] + np.square(known).sum(1) - 2 * own @ known.T
        least.append(np.sqrt(np.maximum(square, 0).min(1)))
    return np.concatenate(least) / np.sqrt(poses.shape[1] / 3)


def _spread(motions: Array, layout: Layout) -> float:
    """Of (pasts, futures, frames, joints, 3): metres per joint between two futures of one past, mean."""
    pasts, count, frames = motions.shape[:3]
    poses = own_poses(motions[:, :, ::5].reshape(-1, *motions.shape[3:]), layout).reshape(
        pasts, count, len(range(0, frames, 5)), -1
    )
    apart = [np.linalg.norm(poses[:, a] - poses[:, b], axis=-1).mean() for a in range(count) for b in range(a)]
    return float(np.mean(apart) / np.sqrt(poses.shape[-1] / 3)) if apart else 0.0


def hold(lab: Lab, predictor: Predictor) -> Findings:
    """Each group of joints given in all of the future: how much nearer the others come, how they vary."""
    trial = trials.prepare(lab.protocol, count=lab.budget.windows)
    rows = []
    for group in GROUPS:
        lab.say(f"hold {group}: {len(trial.windows)} windows")
        numbers = held_numbers(predictor, trial, group, samples=lab.budget.samples, seed=lab.budget.seed)
        rows.append(plain_row(group, numbers))
    return columns("study-hold"), rows, {"weights": predictor.card.name, "given": "as in the real future"}


def held_numbers(
    predictor: Predictor, trial: PredictionTrial, group: str, *, samples: int, seed: int
) -> dict[str, float]:
    """Means over windows, largest errors; the predictor's joints that lie in a group of the 22."""
    layout = predictor.layout
    joints = [j for j, parts in enumerate(smpl_joints(layout)) if set(parts) <= set(SMPL22.groups[group])]
    joints = [j for j in joints if j or layout.root]
    free = [j - 1 for j in range(1, layout.joints) if j not in joints]
    mask = np.zeros((trial.protocol.future, predictor.layout.parts), dtype=np.float32)
    mask[:, [predictor.layout.part(j) for j in joints]] = 1
    seeds = [row_seed(seed, i) for i in range(samples)]
    rows: list[tuple[float, ...]] = []
    for number in range(len(trial.windows)):
        past, truth = trial.pasts(number, number + 1).repeat(samples, 0), trial.future(number)
        without = next_frames(predictor, past, seeds=seeds, exact=False)
        fixed = next_frames(predictor, past, seeds=seeds, known=Known(truth, mask), exact=False)
        real, a, b = from_root(truth), from_root(without), from_root(fixed)
        off = np.abs(b - real)[:, :, [j - 1 for j in joints if j]].max(initial=0.0)
        off = max(off, np.abs(fixed[:, :, 0] - truth[:, 0]).max() if 0 in joints else 0.0)
        rows.append(
            (
                metrics.ade(a[:, :, free], real[:, free]),
                metrics.ade(b[:, :, free], real[:, free]),
                metrics.apd(a[:, :, free]),
                metrics.apd(b[:, :, free]),
                float(off),
                held_rotations(predictor, trial, number, group, seed=seed) if number < 3 else 0.0,
            )
        )
    means, most = np.mean(rows, axis=0), np.max(rows, axis=0)
    return dict(zip(("free", "given", "apd_free", "apd_given"), means.tolist())) | {
        "held": float(most[4]),
        "rotations": float(most[5]),
    }


def held_rotations(predictor: Predictor, trial: PredictionTrial, number: int, group: str, *, seed: int) -> float:
    """Largest difference between a held rotation in the motion that `predict` gives and the one it was held to; 0 for a
    predictor of other joints than the 22, which holds places."""
    if not sees_person(predictor):
        return 0.0
    lead, joints = trial.protocol.observed, [j for j in SMPL22.groups[group] if j]
    whole = _clip(predictor, trial, number)
    source = whole.frames(lead, len(whole))
    held = FixedJoints(source, (FixedPart((group,)),), align=False)
    seconds = len(source) / predictor.fps
    (motion,) = predict(predictor, whole.frames(0, lead), count=1, seconds=seconds, seed=seed, hold=held)
    own, target = motion.rotations[lead:, joints], source.rotations[:, joints]
    return float(np.minimum(np.abs(own - target).max(-1), np.abs(own + target).max(-1)).max())


def _clip(predictor: Predictor, trial: PredictionTrial, number: int) -> Motion:
    """The recorded window of a number as a motion: of the uniform person, or of the predictor's joints."""
    places = np.concatenate([trial.pasts(number, number + 1)[0], trial.future(number)])
    if sees_person(predictor):
        return motion_from_positions(places, predictor.fps)
    first = np.concatenate([trial.pasts(0, 1)[0], trial.future(0)])  # one skeleton for all, as a switch needs
    return body_of_places(places, layout_skeleton(predictor.layout, first), predictor.fps)


def arrive(lab: Lab, predictor: Predictor) -> Findings:
    """The way from one recording to another, for transitions of several lengths."""
    protocol, budget = lab.protocol, lab.budget
    trial = trials.prepare(protocol, count=budget.windows)
    count = len(trial.windows)
    if count < 2:
        raise MotionloomError("a switch leads from one window to another; measure two or more")
    clips = [_clip(predictor, trial, k) for k in range(count)]
    lead, pairs = protocol.observed, [(k, (k + count // 2) % count) for k in range(count)]
    middle = lead + protocol.future // 2
    rows = [plain_row(REAL, _mean([_ends(c.positions(), lead, middle, predictor.fps) for c in clips]))]
    cut = []
    for a, b in pairs:
        p, q = clips[a].positions()[:lead], clips[b].positions()[lead:]
        p, q = protocol.layout.place(p[-1]).into(p), protocol.layout.place(q[0]).into(q)
        cut.append(_seam(np.concatenate([p, q]), lead, predictor.fps, "start"))
    rows.append(plain_row("cut", _mean(cut)))
    for length in TRANSITIONS:
        lab.say(f"switch in {length:g} s: {len(pairs)} pairs")
        numbers = []
        for a, b in pairs:
            past, target = clips[a].frames(0, lead), clips[b].frames(lead, len(clips[b]))
            for i in range(budget.samples):
                numbers.append(switched(predictor, past, target, seconds=length, seed=budget.seed + i))
        rows.append(plain_row(f"{length:g} s", _mean(numbers)))
    return columns("study-switch"), rows, {"weights": predictor.card.name, "pairs": len(pairs)}


def switched(predictor: Predictor, past: Motion, target: Motion, *, seconds: float, seed: int) -> dict[str, float]:
    """Numbers of one transition."""
    (motion,) = switch(predictor, past, target, count=1, seconds=seconds, seed=seed)
    places, first, fps = motion.positions(), len(motion) - len(target), predictor.fps
    own = own_poses(np.stack([places[first], target.positions()[0]]), facing_layout(predictor.layout))
    return _ends(places, len(past), first, fps) | {"target": float(np.abs(own[0] - own[1]).max())}


def facing_layout(layout: Layout) -> Layout:
    """The layout turned to the facing that its hips show, so that poses are compared from where they face."""
    hips = ("left_hip", "right_hip")
    if layout.across or not set(hips) <= set(layout.names):
        return layout
    left, right = (layout.names.index(name) for name in hips)
    return replace(layout, across=((left, right),), z_up=False)


def _ends(places: Array, start: int, end: int, fps: float) -> dict[str, float]:
    between = from_root(places[start - 1 : end + 1])
    speed = float(np.linalg.norm(np.diff(between, axis=0), axis=-1).mean() * fps)
    return _seam(places, start, fps, "start") | _seam(places, end, fps, "end") | {"speed": speed}


def _seam(places: Array, at: int, fps: float, name: str) -> dict[str, float]:
    jump = seam(from_root(places[:at]), from_root(places[at:])[None], fps)
    return {f"{name}_velocity": jump.velocity, f"{name}_acceleration": jump.acceleration}


def _mean(rows: list[dict[str, float]]) -> dict[str, float]:
    return {key: float(np.mean([one[key] for one in rows])) for key in rows[0]}


STUDIES: dict[str, Callable[[Lab, Predictor], Findings]] = {"horizon": horizon, "hold": hold, "switch": arrive}
