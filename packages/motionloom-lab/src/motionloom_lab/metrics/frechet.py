"""Fréchet distance of two sets of embeddings (FID), and how much of it is only a small sample.

Heusel et al., GANs Trained by a Two Time-Scale Update Rule, NeurIPS 2017, on motion embeddings after Guo et al., 2022.
"""

import numpy as np
from numpy.typing import ArrayLike

from motionloom.errors import MotionloomError
from motionloom_lab.metrics.retrieval import Array, embeddings


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
    rng, found = np.random.default_rng(seed), []
    for _ in range(repeats):
        order = rng.permutation(len(rows))
        found.append(fid(rows[order[:count]], rows[order[count : count + rest]]))
    return float(np.mean(found))


def _spread(rows: Array) -> tuple[Array, Array]:
    """Mean, and rows whose Gram matrix is the sample covariance."""
    mean = rows.mean(axis=0)
    return mean, (rows - mean) / np.sqrt(len(rows) - 1)


def _triangle(rows: Array) -> Array:
    """R (at most d rows) with R^T R = rows^T rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))
