"""Stances on feet that slide at random."""

import numpy as np
import pytest

from motionloom.core.arrays import true_spans
from motionloom.edits.stances import FAR, carried, stilled

RNG = np.random.default_rng(0)
FRAMES = 60
STANDING = np.zeros((FRAMES, 2), dtype=bool)
STANDING[10:20], STANDING[16:24, 1], STANDING[28:35], STANDING[50:] = True, True, True, True


def sliding(size: float) -> tuple[np.ndarray, np.ndarray]:
    toe = np.cumsum(RNG.normal(0, size, (FRAMES, 3)), axis=0)
    return toe + RNG.normal(0, size, (FRAMES, 3)), toe


def test_runs_are_half_open() -> None:
    assert true_spans(np.array([True, False, True, True, False])) == [(0, 1), (2, 4)]
    assert true_spans(np.zeros(3, dtype=bool)) == []


def test_what_stands_does_not_move_and_keeps_its_mean_place() -> None:
    ankle, toe = sliding(0.003)
    change = stilled(ankle, toe, STANDING)
    assert not change[:, 1].any()
    for start, stop in ((10, 24), (28, 35), (50, 60)):
        assert np.ptp((toe + change)[start:stop, [0, 2]], axis=0).max() < 1e-12
        np.testing.assert_allclose(change[start:stop].mean(0), 0, atol=1e-12)
    np.testing.assert_array_equal(change[:4], 0)
    assert np.abs(np.diff(change, axis=0)).max() < 0.02


def test_the_ankle_stands_where_the_toes_do_not() -> None:
    ankle, toe = sliding(0.003)
    flags = np.zeros((FRAMES, 2), dtype=bool)
    flags[10:20, 0] = True
    change = stilled(ankle, toe, flags)
    assert np.ptp((ankle + change)[10:20, [0, 2]], axis=0).max() < 1e-12


def test_a_foot_that_strays_is_held_back_by_so_much_at_most() -> None:
    walk = np.stack([np.linspace(0, 5, FRAMES), *np.zeros((2, FRAMES))], axis=-1)
    assert np.linalg.norm(stilled(walk, walk, np.ones((FRAMES, 2), bool)), axis=-1).max() == pytest.approx(FAR)


def test_a_foot_that_is_carried_goes_by_the_mean_of_each_stance() -> None:
    shift = np.cumsum(RNG.normal(0, 0.01, (FRAMES, 3)), axis=0)
    gone = carried(shift, STANDING[:, 0])
    for start, stop in ((10, 20), (28, 35), (50, 60)):
        np.testing.assert_allclose(gone[start:stop], np.tile(shift[start:stop].mean(0), (stop - start, 1)))
    np.testing.assert_allclose(carried(shift, np.zeros(FRAMES, bool)), shift)


def test_a_foot_that_stands_in_known_frames_keeps_the_place_that_it_has_there() -> None:
    ankle, toe = sliding(0.003)
    change = stilled(ankle, toe, STANDING, known=14)
    np.testing.assert_allclose(change[13], 0, atol=1e-12)
    assert np.ptp((toe + change)[10:24, [0, 2]], axis=0).max() < 1e-12
    np.testing.assert_allclose(change[28:35].mean(0), 0, atol=1e-12)
