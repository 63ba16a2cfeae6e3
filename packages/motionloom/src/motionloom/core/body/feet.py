"""Foot clean-up for export: planted feet stay put, no foot is under the floor, knees keep their way.

A correction of each foot is found first, as a smooth path in space; the legs follow by two-bone inverse kinematics.
In the middle of a stance the foot turns about what is planted (heel, whole foot, then toes), as in walking.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import true_spans
from motionloom.core.blending import hermite, shares, smoothstep
from motionloom.core.body.ik import LIMBS, Limb, aim, hinge_frame, reach
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FEET
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

EASE = 0.25
"""Seconds over which a correction of a foot's place comes and goes."""
_TURN_EASE = 0.1
"""The same for its direction; longer would flatten the foot while it still swings."""
_LOW = np.array([0.11, 0.05, 0.11, 0.05])
"""Metres above the level of standing toes below which ankles and toes may be planted."""
_SLOW, _STILL_SLOW, _CONTACT_SLOW = 0.35, 0.5, 0.6
"""Metres per second: what starts a contact, what keeps it, and what a foot said to be planted may have."""
_DRIFT = 0.12
"""Metres: a planted foot that strays further from the middle of its stance means to move; the stance is split."""
_TURNS, _STEP = np.radians(35), np.radians(45)
"""How far a foot may turn while it stands flat, and how far it turns in one step if it turns further."""
_SWING, _LIFT = 0.3, 0.05
"""Seconds that such a step takes, and metres that the foot is lifted in the middle of it."""
_SUNK = 0.002
"""Metres under the floor that are left, as in recordings: lifting every millimetre would leave people afloat."""
_NEAR = 0.01
"""Metres: somebody whose toes rest this near to the floor rests on it, and who is three times as far does not."""
_RESTING, _SLOWLY = (0.02, 0.03), 0.2
"""Metres from there below which planted toes are brought there wholly, and at all, if they rise or sink slower than so
many metres per second."""
_LIFT_EASE = 0.05
"""Seconds over which a foot is lifted out of the floor; longer would lift a stance for the toes that leave it."""
_LENGTHS = SMPL22.bone_lengths()


def clean_feet(motion: Motion, *, contacts: np.ndarray | None = None, floor: float = 0.0, shown: int = 0) -> Motion:
    """Lock planted feet and lift feet out of the floor.

    ``motion`` on the 22-joint skeleton; ``contacts`` (frames or frames - 1, 4), flags or probabilities for left ankle,
    left foot, right ankle, right foot as the 263 features have them, else height and speed decide; ``floor`` metres.
    Changes the legs, and the height of the root where a leg would be too short. Everything else stays as it is. The
    first ``shown`` frames stay too: a foot that stands at the last of them stays where it is.
    """
    if motion.skeleton != SMPL22:
        raise MotionloomError(
            f"feet can be cleaned on the {len(SMPL22)}-joint SMPL person; this motion has "
            f"{len(motion.skeleton)} joints of another one: retarget it first"
        )
    if len(motion) < 4:
        return motion
    places, fps = motion.positions(), motion.fps
    standing = _standing_feet(places, fps, contacts)
    planted = _in_steps(places, standing, fps, shown)
    level = toe_level(places, fps) - floor
    height = floor + level - np.clip(level, -_NEAR, _NEAR) * np.clip((3 * _NEAR - abs(level)) / (2 * _NEAR), 0, 1)
    targets, directions = places[:, [limb.end for limb in LIMBS[:2]]].copy(), np.empty((len(motion), 2, 3))
    free = _coming(len(motion), shown, max(1, round(EASE * fps)))
    for i in (0, 1):
        ankle, toe = FEET[2 * i : 2 * i + 2]
        foot = places[:, toe] - places[:, ankle]
        flags = planted[:, 2 * i : 2 * i + 2]
        flat = flags[:, 0] & flags[:, 1]
        directions[:, i] = _steady_direction(foot, flat, fps, shown)
        tip = directions[:, i] * np.linalg.norm(foot, axis=-1, keepdims=True)
        since = max(shown - 1, 0)
        ends = places[since:, ankle] - [0, height, 0]
        moved = correction(ends, ends + tip[since:], flags[since:], fps, held=shown > 0, level=True)
        targets[since:, i] += moved
        targets[:, i, 1] += free * _lifts(np.asarray(standing[:, 2 * i : 2 * i + 2].any(axis=1) > flags.any(axis=1)))
        stretched = envelope(_overreach(places, targets, i), round(_LIFT_EASE * fps))
        targets[since:, i, 1] += np.minimum(stretched[since:], -np.minimum(moved[:, 1], 0))
        below = floor - targets[:, i, 1] - np.minimum(tip[:, 1], 0)
        targets[:, i, 1] += free * envelope((below - _SUNK).clip(0), round(_LIFT_EASE * fps))
    # the root goes down so that no leg is stretched too far
    need = np.maximum(*(_overreach(places, targets, i) for i in (0, 1)))
    down = free * envelope(need.clip(0, 0.05), round(0.15 * fps))
    return _with_legs(motion, places - down[:, None, None] * [0, 1, 0], targets, directions)


def planted_feet(positions: np.ndarray, fps: float, *, contacts: np.ndarray | None = None) -> Flags:
    """(frames, 4) flags for left ankle, left foot, right ankle, right foot: low, slow, and long enough to be a step.

    ``positions`` (frames, 22, 3) metres; ``contacts`` as for `clean_feet` replaces the strict test of speed. A foot
    that turns while it stands flat does so in steps: it does not stand while it makes one.
    """
    return _in_steps(positions, _standing_feet(positions, fps, contacts), fps)


def _standing_feet(positions: np.ndarray, fps: float, contacts: np.ndarray | None) -> Flags:
    """`planted_feet`, of which some turn."""
    feet = np.asarray(positions)[:, list(FEET)]
    speed = np.linalg.norm(np.gradient(feet, axis=0), axis=-1) * fps
    low = feet[..., 1] < toe_level(positions, fps) + _LOW
    if contacts is None:
        may, sure = low & (speed < _STILL_SLOW), low & (speed < _SLOW)
    else:
        may = low & (speed < _CONTACT_SLOW) & _contact_flags(contacts, len(feet))
        sure = may
    least, gap = max(2, round(0.12 * fps)), max(1, round(0.1 * fps))
    result = np.zeros_like(may)
    for k in range(4):
        runs = [run for run in true_spans(may[:, k]) if sure[slice(*run), k].any()]
        for start, stop in _joined(runs, gap):
            result[start:stop, k] = stop - start >= least
    return result


def _in_steps(positions: np.ndarray, standing: Flags, fps: float, shown: int = 0) -> Flags:
    """Flags (frames, 4) without those of feet that turn: `_STEP` at a time, the foot of that side first.

    Networks turn people like a figure on a turntable. Frames before ``shown`` stay.
    """
    result, half = standing.copy(), max(1, round(_SWING * fps / 2))
    for i in (0, 1):
        foot = np.asarray(positions)[:, FEET[2 * i + 1]] - np.asarray(positions)[:, FEET[2 * i]]
        for start, stop in true_spans(standing[:, 2 * i : 2 * i + 2].all(1)):
            way = np.unwrap(np.arctan2(foot[start:stop, 0], foot[start:stop, 2]))
            if np.ptp(way) < _TURNS:
                continue
            turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(way)))])
            steps = max(1, round(float(np.ptp(way) / _STEP)))
            first = 0.25 if (way[-1] > way[0]) == (i == 0) else 0.75
            for k in range(steps):
                middle = start + int(np.searchsorted(turned, turned[-1] * (k + first) / steps))
                result[max(middle - half, shown) : max(middle + half, shown), 2 * i : 2 * i + 2] = False
    return result


def _lifts(swings: np.ndarray) -> Array:
    """(frames,) metres that a foot is lifted while it makes the steps of a turn."""
    result = np.zeros(len(swings))
    for start, stop in true_spans(swings):
        result[start:stop] = _LIFT * np.sin(np.pi * (np.arange(stop - start) + 1) / (stop - start + 1)) ** 2
    return result


def toe_level(positions: np.ndarray, fps: float) -> float:
    """Height in metres at which toes rest in ``positions`` (frames, 22, 3) metres; that of the lowest where none do."""
    feet = np.asarray(positions)[:, list(FEET)]
    toes = feet[:, [1, 3]]
    resting = np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * fps < _SLOW
    if not resting.any():
        return float(feet[..., 1].min())
    return float(np.percentile(toes[..., 1][resting], 30))


def _contact_flags(contacts: np.ndarray, frames: int) -> Flags:
    contacts = np.asarray(contacts, dtype=np.float64)
    if contacts.ndim != 2 or contacts.shape[1] != 4 or len(contacts) not in (frames, frames - 1):
        raise MotionloomError(f"contacts must be ({frames}, 4) or ({frames - 1}, 4); got {contacts.shape}")
    return np.concatenate([contacts, contacts[-1:]])[:frames] > 0.5


def _joined(runs: list[tuple[int, int]], gap: int) -> list[tuple[int, int]]:
    """Runs with the holes of at most ``gap`` frames between them filled."""
    result: list[tuple[int, int]] = []
    for start, stop in runs:
        if result and start - result[-1][1] <= gap:
            result[-1] = (result[-1][0], stop)
        else:
            result.append((start, stop))
    return result


# Where the feet go


def _coming(frames: int, shown: int, ease: int) -> Array:
    """(frames,) factors: 0 in the frames that were shown, 1 from ``ease`` frames behind them on."""
    return smoothstep((np.arange(frames) - shown + 1) / ease) if shown else np.ones(frames)


def _steady_direction(foot: Array, flat: Flags, fps: float, shown: int = 0) -> Array:
    """Unit directions ankle to toes (frames, 3); one direction while the whole foot is on the floor."""
    unit = foot / np.linalg.norm(foot, axis=-1, keepdims=True).clip(1e-9)
    result, runs, ease = unit.copy(), true_spans(flat), max(1, round(_TURN_EASE * fps))
    frames = np.arange(len(foot))
    for i, (start, stop) in enumerate(runs):
        # the easing never reaches into the neighbouring stance
        before = min(ease, start - runs[i - 1][1] + 1) if i else ease
        after = min(ease, runs[i + 1][0] - stop + 1) if i + 1 < len(runs) else ease
        away = np.maximum((start - frames) / before, (frames - stop + 1) / after)
        weight = 1 - smoothstep(away)
        if start < shown < stop:  # it stays as it was
            steady = unit[shown - 1]
            weight[:shown] = 0
        else:
            steady = unit[start:stop].mean(0)
            weight *= _coming(len(foot), shown, ease)
        result += weight[:, None] * (steady - result)
    return result / np.linalg.norm(result, axis=-1, keepdims=True).clip(1e-9)


def correction(
    ankle: Array, toe: Array, planted: Flags, fps: float, *, held: bool = False, level: bool = False
) -> Array:
    """(frames, 3) metres to add to the foot so that whatever is planted does not move; eased in and out.

    ankle, toe: (frames, 3) metres above the floor; planted: (frames, 2) flags for the two. held: nothing is added to
    frame 0, which was shown; stances that begin soon after it keep near where they begin. level: toes that rest near
    the floor rest on it, as those of `motionloom.core.skeleton.SMPL22` do; else heights stay.
    """
    steps = np.zeros((len(ankle) - 1, 3))
    for place, flags in ((ankle, planted[:, 0]), (toe, planted[:, 1])):
        both = flags[1:] & flags[:-1]
        steps[both] = -np.diff(place, axis=0)[both]  # toes last: they are the pivot when the whole foot stands
    steps[:, 1] = 0
    ease = max(2, round(EASE * fps))
    pieces = list(_pieces(steps, planted[:, 0] | planted[:, 1], max(2, round(EASE * fps / 2))))
    for start, path in pieces if level else ():
        stance = slice(start, start + len(path))
        path[:, 1] = _to_floor(toe[stance, 1], planted[stance, 1], fps)
    if held:
        pieces = [(start, path - max(0.0, 1 - start / ease) * path[0]) for start, path in pieces]
        if not pieces or pieces[0][0] > 0:
            pieces.insert(0, (0, np.zeros((1, 3))))
    result = np.zeros_like(ankle)
    for start, values in pieces:
        result[start : start + len(values)] = values
    bridge(result, [(start, start + len(values)) for start, values in pieces], ease)
    return result


def _to_floor(height: Array, planted: Flags, fps: float) -> Array:
    """(frames,) metres to add in a stance whose toes are ``height`` above the floor; toes that begin to rise may."""
    frames = np.flatnonzero(planted & (np.abs(np.gradient(height)) * fps < _SLOWLY))
    near, far = _RESTING
    down = -height * ((far - np.abs(height)) / (far - near)).clip(0, 1)
    return np.interp(np.arange(len(height)), frames, down[frames]) if len(frames) else np.zeros(len(height))


def _pieces(steps: Array, standing: Flags, hole: int) -> Iterator[tuple[int, Array]]:
    """First frame and correction (frames, 3) of each stance, of mean 0; stances that stray are split at the fastest."""
    waiting = true_spans(standing)[::-1]
    while waiting:
        start, stop = waiting.pop()
        if stop - start < 2:
            continue
        path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps[start : stop - 1], axis=0)])
        path -= path.mean(0)
        if np.linalg.norm(path, axis=-1).max() <= _DRIFT:
            yield start, path
            continue
        fastest = start + int(np.linalg.norm(steps[start : stop - 1], axis=-1).argmax())
        waiting += [(fastest + 1 + hole, stop), (start, fastest + 1 - hole)]


def bridge(values: Array, pieces: list[tuple[int, int]], ease: int) -> None:
    """Fill the frames between pieces of ``values`` (frames, 3), in place: short gaps directly, else by way of zero."""
    frames = len(values)
    ends = [(-ease, -ease), *pieces, (frames + ease, frames + ease)]
    for (first, stop), (start, last) in pairwise(ends):
        if stop == start:
            continue  # one begins where the other ends
        if 0 < stop < start < frames and start - stop < 2 * ease:
            left, right = values[stop - 1], values[start]
            into, out = _slope(values, stop - 1, first), _slope(values, start, last - 1)
            values[stop:start] = _hermite(start - stop + 1, left, right, into, out)
            continue
        if 0 < stop < frames:
            curve = _hermite(ease, values[stop - 1], np.zeros(3), _slope(values, stop - 1, first), np.zeros(3))
            values[stop : stop + ease - 1] = curve[: frames - stop]
        if 0 < start < frames:
            curve = _hermite(ease, np.zeros(3), values[start], np.zeros(3), _slope(values, start, last - 1))
            count = min(start, ease - 1)
            values[start - count : start] = curve[ease - 1 - count :]


def _slope(values: Array, at: int, towards: int) -> Array:
    """Change per frame at the end ``at`` of a piece that lies on the side of ``towards``."""
    inner = at + int(np.sign(towards - at))
    return (values[at] - values[inner]) * np.sign(at - inner)


def _hermite(steps: int, left: Array, right: Array, into: Array, out: Array) -> Array:
    """(steps - 1, 3) values strictly between two ends ``steps`` frames apart, with given changes per frame there."""
    _, leaving, end, coming = hermite(shares(steps - 1)[:, None])
    return left + end * (right - left) + steps * (leaving * into + coming * out)


def envelope(need: Array, radius: int) -> Array:
    """A smooth curve (..., frames) nowhere below ``need``: running maximum, then averages within its window."""
    radius = max(1, radius)
    curve = np.pad(need, [(0, 0)] * (need.ndim - 1) + [(4 * radius, 4 * radius)], mode="edge")
    curve = sliding_window_view(curve, 4 * radius + 1, axis=-1).max(-1)
    for _ in range(2):
        curve = sliding_window_view(curve, 2 * radius + 1, axis=-1).mean(-1)
    return curve


# Legs


def _overreach(places: Array, targets: Array, i: int) -> Array:
    """(frames,) metres that an ankle's target is too low for a leg stretched as far as it was, or to 99.5 %."""
    limb = LIMBS[i]
    before = np.linalg.norm(places[:, limb.end] - places[:, limb.start], axis=-1)
    most = np.maximum(before, 0.995 * (_LENGTHS[limb.middle] + _LENGTHS[limb.end]))
    line = targets[:, i] - places[:, limb.start]
    height = np.sqrt((most**2 - line[:, 0] ** 2 - line[:, 2] ** 2).clip(0))
    return np.where(np.linalg.norm(line, axis=-1) > most, -line[:, 1] - height, 0).clip(0)


def _with_legs(motion: Motion, places: Array, targets: Array, directions: Array) -> Motion:
    """The motion with its root at ``places[:, 0]`` and ankles and feet at these (frames, 2, 3)."""
    world, rotations = motion.world_rotations(), motion.rotations.copy()
    for i, limb in enumerate(LIMBS[:2]):
        a, b, c = limb.start, limb.middle, limb.end
        upper, lower = _solve_leg(limb, world, places, targets[:, i])
        foot = aim(world[:, c], SMPL22.offsets[limb.tip or c], directions[:, i])
        rotations[:, a] = rot.multiply(rot.inverse(world[:, 0]), upper)
        rotations[:, b] = rot.multiply(rot.inverse(upper), lower)
        rotations[:, c] = rot.multiply(rot.inverse(lower), foot)
    return replace(motion, root=places[:, 0], rotations=rot.unroll(rot.normalize(rotations)))


def _solve_leg(limb: Limb, world: Array, places: Array, target: Array) -> tuple[Array, Array]:
    """World orientations (frames, 4) of hip and knee for an ankle at ``target``; those there are where it is there."""
    a, b, c = limb.start, limb.middle, limb.end
    start, lengths = places[:, a], (_LENGTHS[b], _LENGTHS[c])
    old, new = places[:, c] - start, target - start
    # never straighter than it was, unless it stays visibly bent: the knee's angle is wild near full reach
    before, after = np.linalg.norm(old, axis=-1), np.linalg.norm(new, axis=-1)
    bent = np.maximum(before, 0.995 * sum(lengths))
    room = (np.maximum(before, 0.999 * sum(lengths)) - bent).clip(1e-6)
    far = (after - bent).clip(0)
    distance = np.where(far > 0, bent + room * np.tanh(far / room), after)
    target = start + new * (distance / after.clip(1e-9))[:, None]
    leg = places[:, [a, b, c]]
    hinge = np.array(limb.hinge, dtype=np.float64)
    arc = rot.shortest_arc(old, new)
    axes = [rot.rotate(arc, rot.rotate(world[:, j], hinge)) for j in (a, b)]
    knee, ankle = reach(start, target, leg, axes[0], lengths)
    return hinge_frame(limb, b, knee - start, axes[0]), hinge_frame(limb, c, ankle - knee, axes[1])
