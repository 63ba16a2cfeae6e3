"""How well motions go with texts, and how much they differ among themselves and from real ones, on embeddings.

Rows are embeddings of a text-motion evaluator (512 numbers in the published one), distances are Euclidean and have no
unit; text i belongs to motion i. Definitions: Guo et al., Generating Diverse and Natural 3D Human Motions from Text,
CVPR 2022, section 5. Everything is computed in float64; what cannot be measured raises `MotionloomError`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionloom.core.errors import MotionloomError

Array = NDArray[np.float64]
_CELLS = 4_000_000
"""Distances held at once (32 MB each way): 50,000 texts against 50,000 motions would be 20 GB."""
_ROUNDING = 1e-12
"""Squared distances nearer to one another than this share of the squared lengths are the same number."""
_LARGEST = 1e100
"""Beyond this squares overflow."""


def embeddings(values: ArrayLike, name: str, *, rows: int = 1) -> Array:
    """``values`` as (n, d) float64 with at least ``rows`` rows of usable numbers; ``name`` is for the complaint."""
    points = np.asarray(values)
    if points.ndim != 2 or points.shape[1] == 0 or points.dtype.kind not in "fiu":
        raise MotionloomError(f"{name} must be numbers (rows, dimensions), not {points.dtype} {points.shape}.")
    if len(points) < rows:
        raise MotionloomError(f"{name} has {len(points)} rows where at least {rows} are needed: measure more motions.")
    points = points.astype(np.float64)
    if not (np.abs(points) < _LARGEST).all():
        raise MotionloomError(f"{name} holds numbers that are not finite or beyond {_LARGEST:g}: check the evaluator.")
    return points


def r_precision(texts: ArrayLike, motions: ArrayLike, *, top: int = 3, batch: int | None = 32) -> Array:
    """(top,) shares of texts whose own motion is among the 1, 2, .. ``top`` nearest motions of its batch; up is better.

    ``texts`` and ``motions`` are (n, d). Batches are consecutive rows, the last partial one is dropped; ``batch=None``
    takes the whole set as one. The number depends on the batch size: chance is k / batch.
    Motions exactly as near as the own one (within rounding) count as in random order among themselves: of s nearer
    ones and e as near, the own one is in the first k with chance (k - s) / (e + 1). Without ties that is the published
    count; with equal embeddings it is chance, where sorting alone could give anything up to 100 %.
    """
    t, m = _pairs(texts, motions, batch)
    size = len(t) if batch is None else batch
    if not 1 <= top <= size:
        raise MotionloomError(f"R-precision counts the top {top} of {size} motions: choose 1 to {size}.")
    shares = [_hit_chances(t[i : i + size], m[i : i + size], top) for i in range(0, len(t), size)]
    return np.concatenate(shares).mean(axis=0)


def matching_distance(texts: ArrayLike, motions: ArrayLike, *, batch: int | None = None) -> float:
    """Mean distance of a text to its own motion (MM-Dist, matching score); down is better.

    ``texts`` and ``motions`` are (n, d); with ``batch`` the rows of a last partial batch are dropped, as `r_precision`
    drops them.
    """
    t, m = _pairs(texts, motions, batch)
    return float(np.linalg.norm(t - m, axis=1).mean())


def diversity(motions: ArrayLike, *, pairs: int = 300, seed: int = 0) -> float:
    """Mean distance of ``pairs`` random pairs of (n, d) motions; good where it is near that of real motions.

    Both members are sampled without repetition, each for itself, so that a motion may meet itself (as published).
    """
    m = embeddings(motions, "the motions", rows=max(2, pairs))
    return diversity_of(m, *_draws(len(m), pairs, seed))


def diversity_of(motions: ArrayLike, first: Sequence[int] | NDArray, second: Sequence[int] | NDArray) -> float:
    """Mean distance between rows ``first[i]`` and ``second[i]`` of (n, d) motions."""
    m = embeddings(motions, "the motions")
    a, b = _indices(first, second, len(m))
    return float(np.linalg.norm(m[a] - m[b], axis=1).mean())


def multimodality(motions: ArrayLike, *, pairs: int = 10, seed: int = 0) -> float:
    """Mean distance of ``pairs`` random pairs of motions of the same caption; up is better, after everything else.

    ``motions`` is (captions, samples, d); the sampled pairs are the same for every caption (as published).
    """
    samples = _captions(motions).shape[1]
    if samples < max(2, pairs):
        raise MotionloomError(f"multimodality draws {pairs} pairs of {samples} samples a caption: take more samples.")
    return multimodality_of(motions, *_draws(samples, pairs, seed))


def multimodality_of(motions: ArrayLike, first: Sequence[int] | NDArray, second: Sequence[int] | NDArray) -> float:
    """Mean distance between samples ``first[i]`` and ``second[i]`` over all captions of (captions, samples, d)."""
    m = _captions(motions)
    a, b = _indices(first, second, m.shape[1])
    return float(np.linalg.norm(m[:, a] - m[:, b], axis=2).mean())


def _pairs(texts: ArrayLike, motions: ArrayLike, batch: int | None) -> tuple[Array, Array]:
    if batch is not None and batch < 1:
        raise MotionloomError(f"a batch has at least one row, not {batch}: the published size is 32.")
    t, m = (embeddings(v, name, rows=batch or 1) for v, name in ((texts, "the texts"), (motions, "the motions")))
    if t.shape != m.shape:
        raise MotionloomError(f"texts {t.shape} and motions {m.shape} must have one row each of the same dimensions.")
    used = len(t) if batch is None else len(t) // batch * batch
    return t[:used], m[:used]


def _hit_chances(texts: Array, motions: Array, top: int) -> Array:
    """(n, top) chance that the own motion is among the k nearest, rows in chunks of `_CELLS` distances."""
    centre = motions.mean(axis=0)  # distances stay, and cancellation goes
    t, m = texts - centre, motions - centre
    lengths, widths = (t**2).sum(axis=1), (m**2).sum(axis=1)
    rows = max(1, _CELLS // len(m))
    result = np.empty((len(t), top))
    for start in range(0, len(t), rows):
        part = slice(start, start + rows)
        scale = lengths[part, None] + widths
        # less its own entry: negative where a motion is nearer than the own one
        lead = scale - 2 * t[part] @ m.T
        own = np.arange(start, start + len(lead))
        lead -= lead[np.arange(len(lead)), own][:, None]
        nearer = (lead < -_ROUNDING * scale).sum(axis=1)
        alike = (np.abs(lead) <= _ROUNDING * scale).sum(axis=1)  # the own one among them
        result[part] = np.clip((np.arange(1, top + 1) - nearer[:, None]) / alike[:, None], 0.0, 1.0)
    return result


def _captions(motions: ArrayLike) -> Array:
    m = np.asarray(motions)
    if m.ndim != 3 or 0 in m.shape:
        raise MotionloomError(f"multimodality needs motions (captions, samples, dimensions), not {m.shape}.")
    return embeddings(m.reshape(-1, m.shape[2]), "the motions").reshape(m.shape)


def _draws(count: int, pairs: int, seed: int) -> tuple[NDArray, NDArray]:
    if pairs < 1:
        raise MotionloomError(f"at least one pair must be drawn, not {pairs}.")
    rng = np.random.default_rng(seed)
    return rng.choice(count, pairs, replace=False), rng.choice(count, pairs, replace=False)


def _indices(first: Sequence[int] | NDArray, second: Sequence[int] | NDArray, count: int) -> tuple[NDArray, NDArray]:
    a, b = np.asarray(first), np.asarray(second)
    both = np.concatenate([a.ravel(), b.ravel()])
    if a.ndim != 1 or a.shape != b.shape or a.size == 0 or both.dtype.kind not in "iu":
        raise MotionloomError(f"pairs are two equally long lists of row numbers, not {a.shape} and {b.shape}.")
    if both.min() < 0 or both.max() >= count:
        raise MotionloomError(f"pairs name rows {both.min()} to {both.max()} where there are 0 to {count - 1}.")
    return a, b


def fid(a: ArrayLike, b: ArrayLike) -> float:
    """|mean_a - mean_b|^2 + Tr(C_a + C_b - 2 (C_a C_b)^(1/2)) of (n, d) and (m, d) embeddings; down is better.

    C are sample covariances (n - 1). With centred rows X/sqrt(n - 1) = Q_a R_a and Y/sqrt(m - 1) = Q_b R_b the trace of
    the root is the sum of the singular values of R_a R_b^T: no root of a rounded matrix is taken, so singular
    covariances (fewer rows than dimensions, dead dimensions) need nothing added and a set against itself gives 0.
    The published code takes a matrix root of C_a C_b, drops its imaginary part, and only where the root is not finite
    adds 1e-6 to both diagonals. Where its root is exact the two agree; what it adds lowers FID by up to
    0.002 standard deviations of one set along each direction that the other does not have.
    """
    x, y = embeddings(a, "the first set", rows=2), embeddings(b, "the second set", rows=2)
    if x.shape[1] != y.shape[1]:
        raise MotionloomError(f"FID compares sets of one evaluator, not of {x.shape[1]} and {y.shape[1]} dimensions.")
    (mean_x, x), (mean_y, y) = _spread(x), _spread(y)
    root = np.linalg.svd(_triangle(x) @ _triangle(y).T, compute_uv=False).sum()
    return max(0.0, float(((mean_x - mean_y) ** 2).sum() + (x**2).sum() + (y**2).sum() - 2 * root))


def fid_bias(real: ArrayLike, count: int, *, other: int | None = None, repeats: int = 5, seed: int = 0) -> float:
    """FID of ``count`` of the (n, d) real rows against ``other`` different ones (``count`` where None): what a perfect
    generator would score, because few rows know their covariance badly. Mean over ``repeats`` draws.

    Falls about as 1 / count; an FID is worth comparing only with others of the same counts.
    """
    rest = count if other is None else other
    if min(count, rest) < 2 or repeats < 1:
        raise MotionloomError(f"a bias needs 2 rows a side and one draw, not {count}, {rest} and {repeats}.")
    rows = embeddings(real, "the real set", rows=count + rest)
    rng, values = np.random.default_rng(seed), []
    for _ in range(repeats):
        order = rng.permutation(len(rows))
        values.append(fid(rows[order[:count]], rows[order[count : count + rest]]))
    return float(np.mean(values))


def _spread(rows: Array) -> tuple[Array, Array]:
    """Mean, and rows whose Gram matrix is the sample covariance."""
    mean = rows.mean(axis=0)
    return mean, (rows - mean) / np.sqrt(len(rows) - 1)


def _triangle(rows: Array) -> Array:
    """R (at most d rows) with R^T R = rows^T rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))
