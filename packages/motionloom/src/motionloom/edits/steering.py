"""Steering: how a goal bends sampling. Each denoised estimate is changed, as little as it takes, to meet it.

The change is the mean of a Gaussian process given the goal's targets (Rasmussen & Williams 2006, eq. 2.23): the root's
velocity and the joints' places may be off by smooth curves of known size, joints that hang on the same limb together.
Given the heading, places are linear in all of these, so the change is a product with matrices that only depend on
which joints have targets when: nothing is differentiated, and the network does not know. Its next estimate does the
rest. Only a person who jumps leaves the floor, by no more than people do: what is too high becomes as high as they get.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion import Denoiser
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT, WIDTH
from motionloom.core.ground import turned
from motionloom.core.models.prior import Prior
from motionloom.core.motion import heading
from motionloom.core.skeleton import SMPL22
from motionloom.edits.stances import EASE, stilled
from motionloom.goals.goal import Goal, turn_between
from motionloom.kinematics import costs
from motionloom.kinematics.gestures import airborne

Array = NDArray[np.float64]

# Reach: how far a body goes up and down for the targets of its joints, with its feet on the floor

REACH = {j: (costs.beside(j, base), metres) for j, (base, metres) in costs.by_number(costs.REACH).items()}
"""Of the joints of limbs: where the limb begins, and metres that it reaches."""
_TIPTOE, _SHRUG, _JUMP = 0.07, 0.05, 0.38
"""Metres that the ankles of somebody who stands go up, the shoulder of a raised arm, and somebody who jumps."""
_FLYING = 0.1
"""Metres that both feet are above the floor of somebody who jumps."""
_HOPELESS = 1.0
"""Metres down beyond which the body does not go along."""


def _straight(line: Array, reach: float) -> Array:
    """(frames,) metres: how high a limb reaches along these lines (frames, 3) from its base."""
    return np.sqrt((reach**2 - (line[:, [0, 2]] ** 2).sum(-1)).clip((0.3 * reach) ** 2))


def room_above(places: Array) -> Array:
    """(frames,) metres that the body can go up while its feet stay on the floor; more for somebody who jumps at all.

    Args:
        places: (frames, 22, 3) metres, +Y up, of somebody who is on the floor in a fifth of the frames or more.
    """
    room = np.full(len(places), np.inf)
    for _, ankle, _ in costs.LEGS:
        base, reach = REACH[ankle]
        line, height = places[:, base] - places[:, ankle], places[:, ankle, 1]
        above = (height - np.percentile(height, 20)).clip(0)
        room = np.minimum(room, (_straight(line, reach) - line[:, 1]).clip(0) - above)
    most = _TIPTOE + (_JUMP if airborne(places, clearance=_FLYING) else 0.0)
    return (room + most).clip(0)


def lowered(goal: Goal, places: Array, room: Array) -> Goal:
    """The goal with what is too high for a body that goes up by ``room`` as high as it gets.

    Where the goal has the height of the pelvis all stays: then it is the goal that leaves the floor.

    Args:
        goal: in the frame of ``places``.
        places: (frames, 22, 3) metres, +Y up.
        room: (frames,) metres, as of `room_above`.
    """
    above = np.zeros(goal.positions.shape[:2])
    for joint in (np.flatnonzero(goal.mask[:, 1:, 1].any(axis=0)) + 1).tolist():
        base, reach = REACH.get(joint, (joint, costs.TRUNK_SLACK))
        line = np.where(goal.mask[:, joint], goal.positions[:, joint] - places[:, base], 0.0)
        above[:, joint] = (line[:, 1] - _straight(line, reach) - room - _SHRUG).clip(0)
    above[goal.mask[:, 0, 1]] = 0.0
    return replace(goal, positions=goal.positions - above[..., None] * [0, 1, 0]) if above.any() else goal


def out_of_reach(places: Array, goal: Goal) -> Array:
    """(frames,) metres: how far up the body must go so that limbs reach what is above or below them.

    Args:
        places: (frames, 22, 3) metres, +Y up.
        goal: in the same frame.
    """
    need = np.zeros(len(places))
    for joint, (base, reach) in REACH.items():
        mask = goal.mask[:, joint].all(axis=-1, keepdims=True)
        line = np.where(mask, goal.positions[:, joint] - places[:, base], 0.0)
        beyond = np.sign(line[:, 1]) * (np.abs(line[:, 1]) - _straight(line, reach)).clip(0)
        need = np.where(np.abs(beyond) > np.abs(need), beyond, need)
    return np.where(need > -_HOPELESS, need, 0.0)


# Steering

Correction: TypeAlias = Callable[[np.ndarray, int], np.ndarray]
"""(standardised denoised estimate (frames, features) of one row, its level) -> the same, changed."""

EXACT, FEW = 0.002, 0.05
"""Metres: how exactly targets are met, and how exactly the root does the part that is beyond a joint's reach."""
MOST = 4000
"""Targets on one coordinate that are solved for at once; of more, evenly many frames are used."""
_PACE, _YAW = 0.015, 0.03
"""Standard deviations of the root's velocity (metres a frame) and of the heading's (radians a frame)."""
_STILL, _HEIGHT = 0.003, 0.06
"""The same for the root's velocity where a limb can do it (metres a frame), and for its going up and down (metres)."""
_LIFT = 0.3
"""Standard deviation of how far the body goes up or down to bring a target into reach (metres)."""
_WIDTHS = ((0.9, 12.0), (0.5, 8.0), (0.0, 5.0))
"""Frames over which a change is spread, from noises (of the schedule) above the first number of each pair."""
_SWING, _SLACK = costs.by_number(costs.BONE_SWING), costs.by_number(costs.SLACK)
_LONGEST = 0.8
"""Metres that a limb is moved at most: what is out of reach is pointed at."""
_TURN_OVER, _SLOW = 6.0, 0.01
"""Frames over which the body turns with its path; metres a frame below which a path has no direction."""


def toward(goal: Goal, prior: Prior, *, first: int = 0, known: bool = False) -> Correction:
    """The correction of one row's estimate so that it meets ``goal``.

    ``goal`` is in the row's own frame: the root at row frame ``first`` is the origin and faces +Z, and the goal's frame
    k is the row's frame ``first + k``; what lies beyond the row's end is ignored. The corrected estimate is within
    `EXACT` of smooth targets, whatever the estimate was. An empty goal gives the estimate itself. known: the
    frames before ``first`` stay what they are, and a foot that is planted at the last of them stays there.
    """
    if len(prior.mean) != WIDTH:
        raise MotionloomError(f"goals need weights that make HumanML3D's {WIDTH} numbers; these make {len(prior.mean)}")
    if first < 0:
        raise MotionloomError(f"a goal cannot begin at frame {first} of a row; give 0 or more")
    mean, std = prior.mean.astype(np.float64), prior.std.astype(np.float64)
    plans: dict[tuple[int, float], _Plan] = {}

    def correct(denoised: np.ndarray, level: int) -> np.ndarray:
        if goal.empty or first >= len(denoised):
            return denoised
        noise = prior.schedule.at(level)[1]
        key = len(denoised), next(width for least, width in _WIDTHS if noise >= least)
        if key not in plans:
            part = goal.crop(0, min(len(goal), len(denoised) - first))
            plans[key] = _plan(part.padded(first, len(denoised) - first - len(part)), first, key[1])
        features = denoised * std + mean
        changed = (_bent(features, plans[key], first if known else 0) - features) / std
        return denoised + changed.astype(denoised.dtype)

    return correct


def corrected(denoise: Denoiser, corrections: Sequence[Correction | None]) -> Denoiser:
    """The denoiser whose estimate of row i is changed by ``corrections[i]``; None leaves the row alone."""
    if not any(corrections):
        return denoise
    return lambda state, level: corrected_rows(denoise(state, level), corrections, level)


def corrected_rows(denoised: np.ndarray, corrections: Sequence[Correction | None], level: int) -> np.ndarray:
    """Estimates (rows, frames, features) of which row i went through ``corrections[i]``, if there is one."""
    if len(denoised) != len(corrections):
        raise ValueError(f"{len(corrections)} corrections for {len(denoised)} rows: give one, or None, per row")
    rows = [row if change is None else change(row, level) for row, change in zip(denoised, corrections, strict=True)]
    return np.stack(rows)


# What does not depend on the estimate


@dataclass(frozen=True, eq=False)
class _Limbs:
    """How targets on one coordinate move the joints."""

    targets: tuple[NDArray[np.intp], NDArray[np.intp]]
    """Frames and joints."""
    inverse: Array
    """(targets, targets) inverse of their covariance."""
    together: Array
    """(22, 22) covariance of the joints."""


@dataclass(frozen=True, eq=False)
class _Plan:
    goal: Goal
    """In the row's frames."""
    first: int
    moving: NDArray[np.intp]
    """Frames in which the root has a target, its own or through a joint."""
    move: Array
    """(frames + 1, moving): the root's change from its targets; one frame more than the row has."""
    turning: NDArray[np.intp]
    turn: Array
    """The same for the heading."""
    lifting: NDArray[np.intp]
    lift: Array
    """The same for the body's going up and down."""
    limbs: tuple[_Limbs | None, ...]
    """For x, y and z."""
    body: Array
    """(frames, frames) covariance in time of a joint's change, 1 on the diagonal."""
    still: Array
    """(frames + 1, frames) covariance of the root's place where limbs can do it."""


def _plan(goal: Goal, first: int, width: float) -> _Plan:
    frames = len(goal)
    body = 0.8 * _bell(frames, width) + 0.2 * _bell(frames, 2.5)
    total = np.pad(_bell(frames, width).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    pace = total - total[first] - total[:, first : first + 1] + total[first, first]  # summed from ``first`` on and back
    moving = np.flatnonzero(goal.mask[..., [0, 2]].any(axis=(1, 2)))
    noise = np.where(goal.mask[moving, 0][:, [0, 2]].any(axis=-1), EXACT, FEW)
    turning = np.flatnonzero(goal.facing_mask)
    lifting = np.flatnonzero(goal.mask[:, list(REACH)].all(axis=-1).any(axis=-1) & ~goal.mask[:, 0, 1])
    still = _STILL**2 * pace
    x, y = (_limb_plan(goal.mask[..., c], _TOGETHER[c], body, still if c == 0 else None) for c in (0, 1))
    same = np.array_equal(goal.mask[..., 0], goal.mask[..., 2])
    z = x if same else _limb_plan(goal.mask[..., 2], _TOGETHER[2], body, still)
    return _Plan(
        goal,
        first,
        moving,
        _gain(_PACE**2 * pace, moving, noise),
        turning,
        _gain(_YAW**2 * pace, turning, np.full(len(turning), 0.02)),
        lifting,
        _gain(_LIFT**2 * body, lifting, np.full(len(lifting), FEW)),
        (x, y, z),
        body,
        still[:, :frames],
    )


def product(matrix: Array, values: NDArray[Any]) -> NDArray[Any]:
    """A real matrix (rows, n) times values (n,) or (n, columns), real or complex.

    Complex numbers go as two real columns each, so that the matrix stays real.
    """
    if np.iscomplexobj(values):
        columns = values.reshape(len(values), -1).view(np.float64)
        return product(matrix, columns).view(np.complex128).reshape(len(matrix), *values.shape[1:])
    return matrix @ values


def _bell(frames: int, width: float) -> Array:
    lag = np.arange(frames)[:, None] - np.arange(frames)
    return np.exp(-0.5 * (lag / width) ** 2)


def _gain(covariance: Array, at: NDArray[np.intp], noise: Array) -> Array:
    """(rows, n): the posterior mean from observations ``at`` n frames, with noise of these standard deviations."""
    if not len(at):
        return np.zeros((len(covariance), 0))
    inner = covariance[np.ix_(at, at)] + np.diag(noise**2)
    return np.asarray(np.linalg.solve(inner, covariance[at]).T, dtype=np.float64)


def _limb_plan(mask: NDArray[np.bool_], together: Array, body: Array, still: Array | None) -> _Limbs | None:
    if not mask.any():
        return None
    busy, stride = np.flatnonzero(mask.any(axis=1)), 1
    while int(mask[busy[::stride]].sum()) > MOST:
        stride += 1
    t, j = np.nonzero(mask & np.isin(np.arange(len(mask)), busy[::stride])[:, None])
    inner = body[np.ix_(t, t)] * together[np.ix_(j, j)]
    if still is not None:
        inner += still[np.ix_(t, t)]
    inner[np.diag_indices_from(inner)] += EXACT**2
    return _Limbs((t, j), np.asarray(np.linalg.inv(inner), dtype=np.float64), together)


def _offsets() -> Array:
    """(22, 22): metres by which each joint is off when the bones beyond another are, by one standard deviation."""
    lengths, offsets = SMPL22.bone_lengths(), np.zeros((len(SMPL22), len(SMPL22)))
    for joint in range(1, len(SMPL22)):
        at, length = joint, 0.0
        while at:
            length, at = length + lengths[at], SMPL22.parents[at]
            offsets[joint, at] = _SWING[at] * length
    return offsets


_CARRIED = np.ones(len(SMPL22))
"""What goes up and down with the root: the feet stay, the knees bend."""
_CARRIED[list(costs.numbers("knee"))] = 0.5
_CARRIED[[*costs.numbers("ankle"), *costs.numbers("foot")]] = 0.0
_LIMBS_TOGETHER = _offsets() @ _offsets().T
_TOGETHER = _LIMBS_TOGETHER, _LIMBS_TOGETHER + _HEIGHT**2 * np.outer(_CARRIED, _CARRIED), _LIMBS_TOGETHER
"""Covariances (22, 22) of the joints' changes on x, y and z, the root's path left out."""


# The change of one estimate


@dataclass(frozen=True, eq=False)
class _Estimate:
    """A denoised estimate in the goal's frame."""

    facing: Array
    """(frames + 1,) radians; 0 at the goal's first frame."""
    path: Array
    """(frames + 1, 2) metres: x and z of the root; 0 at the goal's first frame."""
    local: Array
    """(frames, 22, 3) metres in the heading frame; x and z from the root."""

    def world(self) -> Array:
        """(frames, 22, 3) metres."""
        places = turned(self.local, self.facing[:-1, None])
        places[..., [0, 2]] += self.path[:-1, None]
        return places


def _bent(features: Array, plan: _Plan, known: int) -> Array:
    """Features (frames, 263), not standardised, changed to meet the goal; of which some are ``known``."""
    denoised = _decoded(features, plan.first)
    error = np.where(plan.goal.mask, plan.goal.positions - denoised.world(), 0.0)
    path = denoised.path + product(plan.move, _root_need(denoised.world(), error, plan.goal)[plan.moving])
    facing = denoised.facing + _turning_with(denoised.path, path, plan.first)
    denoised = replace(denoised, path=path, facing=facing)
    goal = plan.goal
    if goal.mask[:, 1:, 1].any():
        places = denoised.world()
        room, local = room_above(places), denoised.local.copy()
        need = np.minimum(out_of_reach(places, goal), room)[plan.lifting]
        local[..., 1] += np.outer(product(plan.lift, need), _CARRIED)
        goal, denoised = lowered(goal, places, room), replace(denoised, local=local)
    if len(plan.turning):
        off = turn_between(goal.facing[plan.turning], heading(denoised.world())[plan.turning])
        denoised = replace(denoised, facing=facing + product(plan.turn, np.unwrap(off)))
    error = np.where(goal.mask, goal.positions - denoised.world(), 0.0)
    far = np.linalg.norm(error[:, 1:], axis=-1, keepdims=True)
    error[:, 1:] *= np.minimum(1.0, _LONGEST / far.clip(1e-9))
    path, change = denoised.path.copy(), np.zeros_like(denoised.local)
    for c, limbs in enumerate(plan.limbs):
        if limbs is None:
            continue
        pull = np.zeros(error.shape[:2])
        pull[limbs.targets] = product(limbs.inverse, error[..., c][limbs.targets])
        change[..., c] = product(plan.body, product(pull, limbs.together))
        if c != 1:
            path[:, c // 2] += product(plan.still, pull.sum(1))
    local = denoised.local + turned(change, -denoised.facing[:-1, None])
    denoised = replace(denoised, path=path, local=local)
    steps = _standing(denoised.world(), features[:, LAYOUT["contacts"]], plan.goal, known)
    local = local + turned(steps, -denoised.facing[:-1, None])
    return _encoded(features, replace(denoised, local=local))


def standing(features: Array, first: int) -> Array:
    """Features (frames, 263), not standardised, with legs that go so that feet stand still where the contacts say that
    they stand; a foot that stands before frame ``first`` stays in its place."""
    denoised = _decoded(features, first)
    steps = _standing(denoised.world(), features[:, LAYOUT["contacts"]], Goal.nothing(len(features)), first)
    return _encoded(features, replace(denoised, local=denoised.local + turned(steps, -denoised.facing[:-1, None])))


def _standing(places: Array, contacts: Array, goal: Goal, known: int) -> Array:
    """(frames, 22, 3) metres that legs go so that feet stand still where the estimate says that they do.

    A leg with a target stays as it is around then. Feet that stand in the last of the ``known`` frames keep the place
    that they have there.
    """
    change = np.zeros_like(places)
    for side, (knee, ankle, toe) in enumerate(costs.LEGS):
        busy = goal.mask[:, [knee, ankle, toe]].any(axis=(1, 2))
        free = np.convolve(busy, np.ones(4 * EASE + 1))[2 * EASE : -2 * EASE] < 0.5
        planted = (contacts[:, 2 * side : 2 * side + 2] > 0.5) & free[:, None]
        still = stilled(places[:, ankle], places[:, toe], planted, known=known)
        change[:, [ankle, toe]] = still[:, None]
        change[:, knee] = still / 2
    return change


def _decoded(features: Array, first: int) -> _Estimate:
    facing = -2 * np.concatenate([[0.0], np.cumsum(features[:, 0])])
    facing -= facing[first]
    steps = np.zeros((len(features), 3))
    steps[:, [0, 2]] = features[:, 1:3]
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(turned(steps, facing[1:])[:, [0, 2]], axis=0)])
    local = np.zeros((len(features), len(SMPL22), 3))
    local[:, 0, 1] = features[:, 3]
    local[:, 1:] = features[:, LAYOUT["ric"]].reshape(len(features), -1, 3)
    return _Estimate(facing, path - path[first], local)


def _encoded(old: Array, denoised: _Estimate) -> Array:
    """``old`` with the root, the places and the displacements of the joints changed to those of ``denoised``."""
    new = old.copy()
    steps = np.zeros((len(old), 3))
    steps[:, [0, 2]] = np.diff(denoised.path, axis=0)
    new[:, 0] = -np.diff(denoised.facing) / 2
    new[:, 1:3] = turned(steps, -denoised.facing[1:])[:, [0, 2]]
    new[:, 3] = denoised.local[:, 0, 1]
    new[:, LAYOUT["ric"]] = denoised.local[:, 1:].reshape(len(old), -1)
    before, after = (humanml.displacements(part) for part in (old, new))
    new[:-1, LAYOUT["joint_velocity"]] += (after - before).reshape(len(old) - 1, -1)
    return new


def _root_need(places: Array, error: Array, goal: Goal) -> Array:
    """(frames, 2) metres: how far the root must go in each frame, the pelvis's own target first.

    A joint needs what is beyond its slack, or beyond the reach of its limb; several joints need the mean of that.
    """
    far = np.linalg.norm(error, axis=-1, keepdims=True)
    beyond = (error * np.clip(1 - _SLACKS[:, None] / far.clip(1e-9), 0, None))[..., [0, 2]]
    for joint, (base, reach) in REACH.items():
        if not goal.mask[:, joint].any():
            continue
        line = np.where(goal.mask[:, joint], goal.positions[:, joint] - places[:, base], 0.0)
        room = np.sqrt((reach**2 - line[:, 1] ** 2).clip((0.2 * reach) ** 2))
        flat = line[:, [0, 2]]
        flat = flat * (1 - room / np.linalg.norm(flat, axis=-1).clip(1e-9)).clip(0)[:, None]
        more = np.linalg.norm(flat, axis=-1) > np.linalg.norm(beyond[:, joint], axis=-1)
        beyond[:, joint] = np.where(more[:, None], flat, beyond[:, joint])
    mean = beyond.sum(axis=1) / goal.mask.any(axis=-1).sum(axis=1).clip(1)[:, None]
    own = goal.mask[:, 0][:, [0, 2]]
    return np.where(own.any(axis=-1, keepdims=True), np.where(own, error[:, 0][:, [0, 2]], 0.0), mean)


def _turning_with(old: Array, new: Array, first: int) -> Array:
    """(frames + 1,) radians by which the way turned when the path (frames + 1, 2) changed: the body turns with it."""
    ways = [np.diff(path[:, 1] + 1j * path[:, 0]) for path in (old, new)]
    ways = [np.append(way, way[-1]) for way in ways]
    turn = ways[1] * ways[0].conj()
    kernel = _bell(len(turn), _TURN_OVER)
    turn = product(kernel, turn) + kernel.sum(1) * _SLOW**2  # where nobody goes anywhere nothing turns
    angle = np.unwrap(np.angle(turn))
    start = np.arange(len(turn)) - first
    return (angle - 2 * np.pi * np.round(angle[first] / (2 * np.pi))) * (1 - np.exp(-0.5 * (start / _TURN_OVER) ** 2))


_SLACKS = np.array([0.0, *(_SLACK.get(joint, costs.TRUNK_SLACK) for joint in range(1, len(SMPL22)))])
