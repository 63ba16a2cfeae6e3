"""Anatomical frames measured from positions: bones and the planes in which knees and elbows bend."""

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.retarget.anatomy import ARMS, CHILD, FEET, HEAD, TOES, frame

Array = NDArray[np.float64]


def frames_of_positions(places: Array) -> tuple[Array, Array]:
    """World frames (frames, 22, 4) of the 22 joints (frames, 22, 3) and how sure each is (frames, 22), 0 to 1.

    A straight knee or elbow says nothing about the twist of its limb: its sureness is the sine of the bend.
    """
    hips, shoulders = places[:, 1] - places[:, 2], places[:, 16] - places[:, 17]
    result = np.empty((*places.shape[:2], 4))
    sure = np.ones(places.shape[:2])
    up = places[:, 12] - places[:, 9]
    chest_forward = np.cross(shoulders, up)
    for j, child in enumerate(CHILD):
        bone = places[:, child] - places[:, j] if child is not None else up
        across = {0: hips, 3: 2 * hips + shoulders, 6: hips + 2 * shoulders}.get(
            j, chest_forward if j in ARMS else shoulders
        )
        result[:, j] = frame(bone, across)
    result[:, 0] = rot.multiply(
        frame(hips, places[:, 3] - places[:, 0]), rot.inverse(frame(np.eye(3)[1], np.eye(3)[0]))
    )
    result[:, HEAD] = result[:, 12]
    for upper, lower, end in ((1, 4, 7), (2, 5, 8)):
        a, b = places[:, lower] - places[:, upper], places[:, end] - places[:, lower]
        hinge = np.cross(a, b)
        result[:, upper], result[:, lower] = frame(a, hinge), frame(b, hinge)
        sure[:, upper] = sure[:, lower] = _bend(a, b)
    for upper, lower, end in ((16, 18, 20), (17, 19, 21)):
        a, b = places[:, lower] - places[:, upper], places[:, end] - places[:, lower]
        result[:, upper], result[:, lower] = frame(a, b), frame(b, -a)
        result[:, end] = result[:, lower]
        sure[:, [upper, lower, end]] = _bend(a, b)[:, None]
    for foot, toe in zip(FEET, TOES):
        heading = (places[:, toe] - places[:, foot]) * np.array([1.0, 0.0, 1.0])
        left = np.cross([0.0, 1.0, 0.0], heading)
        result[:, foot] = result[:, toe] = frame(heading, left)
        sure[:, foot] = sure[:, toe] = _flat(places, foot, toe)
    return result, sure


def _bend(a: Array, b: Array) -> Array:
    sine = np.linalg.norm(np.cross(a, b), axis=-1) / np.maximum(
        np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1), 1e-9
    )
    return np.where(sine > 0.15, sine, 0.0)


def _flat(places: Array, foot: int, toe: int) -> Array:
    """1 in frames where ankle and toe are both as low as they get."""
    low = [places[:, j, 1] < np.percentile(places[:, j, 1], 20) + 0.01 for j in (foot, toe)]
    return (low[0] & low[1]).astype(float)


def mean_rotation(q: Array, weight: Array) -> Array:
    """(4,) the weighted mean of quaternions (n, 4): the first eigenvector of sum w q q^T (Markley et al. 2007)."""
    return np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, q, q))[1][:, -1]
