"""Where a robot's feet go: planted ones stay where they are, their soles level on the ground, heel and toe in turn."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import true_spans
from motionloom.core.blending import smoothstep
from motionloom.core.body.feet import bridge

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
EASE = 0.25
"""Seconds over which a correction of a foot comes and goes."""
_DRIFT, _TURN = 0.07, 0.35
"""Metres and radians: a planted foot that strays further from the middle of its stance means to move."""
ROLLING = 0.15
"""Radians: a foot that points down or up by more stands on its toes or its heel."""
_ROLL = 0.08
"""Seconds in which a foot that is flat begins to roll over heel or toes."""


def plant(places: Array, turns: Array, planted: Flags, sole: Array, fps: float) -> tuple[Array, Array, Flags]:
    """Places (frames, 3) and turns (frames, 4) of an ankle whose planted foot does not move; and when that is.

    Args:
        places: Metres, +Z up, the ground at 0.
        turns: World orientations; the ankle's frame is the world's where the foot is flat and faces +X.
        planted: (frames, 2) whether heel and toes are on the ground.
        sole: (4, 3) metres in the ankle's frame: two corners of the heel, two of the toes.
        fps: Frames per second.
    """
    heel, toes = heel_and_toes(sole)
    result, turned, held = places.copy(), turns.copy(), np.zeros_like(planted)
    pieces = list(_stances(places, turns, planted, max(2, round(EASE * fps / 2))))
    for start, stop in pieces:
        some = slice(start, stop)
        yaw, pitch = angles(turns[some])
        flat = planted[some].all(axis=1)
        level = float(np.median(pitch[flat])) if flat.any() else 0.0
        pitch = pitch - level
        flat &= np.abs(pitch) < ROLLING
        on_toes = planted[some, 1] & ~flat & (pitch > 0)
        on_heel = planted[some, 0] & ~flat & (pitch < 0)
        calm = flat if flat.any() else np.ones(stop - start, dtype=bool)
        heading = float(np.arctan2(np.sin(yaw[calm]).mean(), np.cos(yaw[calm]).mean()))
        pitch = np.where(on_toes | on_heel, pitch, 0.0) * _away(flat, max(1, round(_ROLL * fps)))
        turned[some] = orient(heading, pitch)
        pivot = np.where(pitch[:, None] < 0, heel, toes)
        under = rot.rotate(orient(heading, np.zeros(1)), pivot)
        own = places[some] + rot.rotate(turns[some], pivot) - under  # the ankle if the foot were flat on that pivot
        middle = own[calm].mean(axis=0)
        middle[2] = -float(sole[:, 2].min())
        result[some] = middle + under - rot.rotate(turned[some], pivot)
        held[some] = np.stack([pitch <= 0, pitch >= 0], axis=-1) & planted[some].any(axis=1, keepdims=True)
    _ease(result, turned, places, turns, pieces, fps)
    result[:, 2] += np.maximum(-lowest(result, turned, sole), 0.0)
    return result, turned, held


def heel_and_toes(corners: Array) -> Array:
    """(..., 2, 3) the middles of the heel and of the toes of soles (..., 4, 3)."""
    return corners.reshape(*corners.shape[:-2], 2, 2, 3).mean(axis=-2)


def lowest(places: Array, turns: Array, sole: Array) -> Array:
    """(frames,) metres: the height of the lowest corner of a sole."""
    corners = rot.rotate(turns[:, None], sole[None]) + places[:, None]
    return corners[..., 2].min(axis=1)


def _stances(places: Array, turns: Array, planted: Flags, hole: int) -> Iterator[tuple[int, int]]:
    """Frames in which one foot stands, in order; where it strays, it is split at its fastest."""
    yaw = np.unwrap(angles(turns)[0])
    waiting = true_spans(planted.any(axis=1))[::-1]
    while waiting:
        start, stop = waiting.pop()
        if stop - start < 2:
            continue
        flat = planted[start:stop].all(axis=1)
        calm = flat if flat.any() else np.ones(stop - start, dtype=bool)
        place, angle = places[start:stop, :2], yaw[start:stop]
        away = np.linalg.norm(place - place[calm].mean(axis=0), axis=-1)[calm].max() / _DRIFT
        if max(away, np.abs(angle - angle[calm].mean())[calm].max() / _TURN) <= 1:
            yield start, stop
            continue
        speed = np.linalg.norm(np.diff(place, axis=0), axis=-1) / _DRIFT + np.abs(np.diff(angle)) / _TURN
        fastest = start + int(speed.argmax())
        waiting += [(fastest + 1 + hole, stop), (start, fastest + 1 - hole)]


def _away(flat: Flags, ease: int) -> Array:
    """(frames,) 0 where the foot is flat, rising to 1 ``ease`` frames from there; 1 where it never is."""
    if not flat.any():
        return np.ones(len(flat))
    frames, on = np.arange(len(flat)), np.flatnonzero(flat)
    nearest = np.abs(frames[:, None] - on[None]).min(axis=1)
    return smoothstep(np.minimum(nearest / ease, 1.0))


def angles(turns: Array) -> tuple[Array, Array]:
    """Heading to the left and pitch, toes down, in radians, of feet (frames, 4)."""
    ahead = rot.rotate(turns, np.array([1.0, 0.0, 0.0]))
    return np.arctan2(ahead[..., 1], ahead[..., 0]), np.arcsin(np.clip(-ahead[..., 2], -1, 1))


def orient(heading: float, pitch: Array) -> Array:
    """(frames, 4) orientations of feet without roll."""
    about_z = rot.rotvec_to_quat(np.array([0.0, 0.0, heading]))
    return rot.multiply(about_z, rot.rotvec_to_quat(pitch[:, None] * np.array([0.0, 1.0, 0.0])))


def _ease(result: Array, turned: Array, places: Array, turns: Array, pieces: list[tuple[int, int]], fps: float) -> None:
    """Let the correction of planted feet come and go in the frames between."""
    moved = result - places
    angles = rot.quat_to_rotvec(rot.multiply(rot.inverse(turns), turned))
    for values in (moved, angles):
        bridge(values, pieces, max(2, round(EASE * fps)))
    result[:] = places + moved
    turned[:] = rot.normalize(rot.multiply(turns, rot.rotvec_to_quat(angles)))
