"""FID of Gaussians whose distance is known, against a matrix root, where covariances are singular, and of few rows."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics.retrieval import fid, fid_bias


def with_moments(mean: np.ndarray, root: np.ndarray, n: int, seed: int = 0) -> np.ndarray:
    """(n, d) rows whose sample mean and covariance (n - 1) are exactly ``mean`` and ``root^T root``."""
    rows = np.random.default_rng(seed).normal(size=(n, len(root)))
    rows -= rows.mean(axis=0)
    white = np.linalg.qr(rows)[0] * np.sqrt(n - 1)
    return white @ root + mean


def by_matrix_root(a: np.ndarray, b: np.ndarray) -> float:
    """The published formula: covariances, a matrix root of their product, its real part."""
    first, second = np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    root = scipy.linalg.sqrtm(first @ second)
    gap = a.mean(axis=0) - b.mean(axis=0)
    return float(gap @ gap + np.trace(first) + np.trace(second) - 2 * np.trace(root).real)


def test_two_gaussians_of_known_moments() -> None:
    """Diagonal covariances: the squared gap of the means and of the standard deviations, 25 + 1 + 4 + 0.25."""
    a = with_moments(np.array([3.0, 0.0, 0.0]), np.diag([1.0, 4.0, 0.5]), 40)
    b = with_moments(np.array([0.0, 0.0, 4.0]), np.diag([2.0, 2.0, 1.0]), 11, seed=1)
    assert fid(a, b) == pytest.approx(25 + 1 + 4 + 0.25)


def test_two_gaussians_whose_covariances_do_not_commute() -> None:
    """[[2,1],[1,1]] and diag(1, 4): the product's root has trace sqrt(tr + 2 sqrt(det)) = sqrt(6 + 4)."""
    root = np.linalg.cholesky(np.array([[2.0, 1.0], [1.0, 1.0]])).T
    a, b = with_moments(np.zeros(2), root, 30), with_moments(np.zeros(2), np.diag([1.0, 2.0]), 30, seed=1)
    assert fid(a, b) == pytest.approx(3 + 5 - 2 * np.sqrt(10))


@given(st.integers(0, 2**32 - 1), st.integers(2, 8), st.integers(20, 40), st.integers(20, 40))
def test_the_published_formula_gives_the_same(seed: int, d: int, n: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = (rng.normal(size=(k, d)) @ rng.normal(size=(d, d)) + rng.normal(size=d) for k in (n, m))
    assert fid(a, b) == pytest.approx(by_matrix_root(a, b), abs=1e-4)
    assert fid(a, b) == pytest.approx(fid(b, a), abs=1e-9)


@pytest.mark.parametrize("shape", [(50, 6), (5, 40), (2, 3)])
def test_a_set_against_itself_is_nothing_however_few_its_rows(shape: tuple[int, int]) -> None:
    a = 100 * np.random.default_rng(0).normal(size=shape)
    assert fid(a, a) == pytest.approx(0, abs=1e-8)
    assert fid(a, a + 1.0) == pytest.approx(shape[1])


def test_dead_dimensions_change_nothing() -> None:
    """A dimension that never moves has no root that could be missed."""
    a, b = (np.random.default_rng(s).normal(size=(60, 4)) for s in (0, 1))
    dead = np.full((60, 3), 7.0)
    assert fid(np.hstack([a, dead]), np.hstack([b, dead])) == pytest.approx(fid(a, b))


def test_a_direction_that_only_one_set_has_counts_whole() -> None:
    """Exactly singular: variance 9 along x against variance 4 along y is 9 + 4, and 1e-6 on both lowers it by 0.01."""
    a = with_moments(np.zeros(2), np.diag([3.0, 0.0]), 20)
    b = with_moments(np.zeros(2), np.diag([0.0, 2.0]), 20)
    assert fid(a, b) == pytest.approx(13)
    eased = [np.diag([9.0, 0.0]) + 1e-6 * np.eye(2), np.diag([0.0, 4.0]) + 1e-6 * np.eye(2)]
    published = sum(map(np.trace, eased)) - 2 * np.trace(scipy.linalg.sqrtm(eased[0] @ eased[1])).real
    assert 0 < 13 - published < 0.002 * (3 + 2)


def test_fewer_rows_than_dimensions_agree_with_the_root_of_the_small_matrices() -> None:
    """The eigenvalues of a product do not depend on its order, so rows by rows say the same as columns by columns."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(6, 30)), rng.normal(size=(9, 30))
    x, y = ((v - v.mean(axis=0)) / np.sqrt(len(v) - 1) for v in (a, b))
    gap = a.mean(axis=0) - b.mean(axis=0)
    eigenvalues = np.linalg.eigvalsh(x @ y.T @ y @ x.T).clip(0)
    assert fid(a, b) == pytest.approx(gap @ gap + (x**2).sum() + (y**2).sum() - 2 * np.sqrt(eigenvalues).sum())


def test_few_rows_cost_and_the_cost_falls_with_their_number() -> None:
    """Real against real is not 0; it falls about as 1 / count."""
    real = np.random.default_rng(0).normal(size=(4000, 16))
    costs = [fid_bias(real, count, repeats=3, seed=0) for count in (50, 200, 800)]
    assert costs[0] > costs[1] > costs[2] > 0
    assert costs[1] / costs[2] == pytest.approx(4, rel=0.4)


def test_a_larger_other_side_costs_less_and_draws_are_apart() -> None:
    """More rows on the other side tell more; rows of a draw are on one side only, so equal sides do not cancel."""
    real = np.random.default_rng(0).normal(size=(600, 8))
    assert fid_bias(real, 50, other=500) < fid_bias(real, 50)
    assert fid_bias(real[:100], 50) > 0.1
    assert fid_bias(real, 50, seed=1) != fid_bias(real, 50, seed=2)
    many = [fid_bias(real, 50, repeats=1, seed=s) for s in range(40)]
    assert fid_bias(real, 50, repeats=40) == pytest.approx(np.mean(many), rel=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_no_row_is_on_both_sides(seed: int) -> None:
    """Four rows in two pairs: the answer is that of one of the three ways to pair them."""
    rows = np.array([[0.0], [1.0], [10.0], [100.0]])
    ways = [fid(rows[[0, k]], rows[[j for j in (1, 2, 3) if j != k]]) for k in (1, 2, 3)]
    assert np.isclose(fid_bias(rows, 2, repeats=1, seed=seed), ways).any()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: fid(np.zeros((1, 3)), np.zeros((5, 3))), "first set has 1 rows"),
        (lambda: fid(np.zeros((5, 3)), np.zeros((1, 3))), "second set has 1 rows"),
        (lambda: fid(np.zeros((5, 3)), np.zeros((5, 4))), "one evaluator"),
        (lambda: fid(np.zeros((5, 3, 2)), np.zeros((5, 3))), "rows, dimensions"),
        (lambda: fid(np.full((5, 3), np.nan), np.zeros((5, 3))), "not finite"),
        (lambda: fid_bias(np.zeros((99, 3)), 50), "99 rows where at least 100"),
        (lambda: fid_bias(np.zeros((99, 3)), 1), "2 rows a side"),
        (lambda: fid_bias(np.zeros((99, 3)), 10, repeats=0), "one draw"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(call, words: str) -> None:
    with pytest.raises(MotionloomError, match=words):
        call()
