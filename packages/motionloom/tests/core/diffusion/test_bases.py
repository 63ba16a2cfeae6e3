"""The cosine basis, and what it is to know frames while the state is frequencies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from motionloom.core.diffusion import SCHEDULES, Dct, Frames, cosine, observe, row_noise
from tests.core.diffusion.exact import shared_draw

SCHEDULE = cosine(40)


def some(*shape: int, seed: int = 0) -> np.ndarray:
    return shared_draw(seed)(np.empty(shape, dtype=np.float64))


sizes = st.integers(1, 60).flatmap(lambda frames: st.tuples(st.just(frames), st.integers(1, frames)))


@given(size=sizes)
def test_rows_are_orthonormal(size: tuple[int, int]) -> None:
    matrix = Dct(*size).matrix
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(size[1], dtype=np.float64), atol=1e-12, rtol=0)


@given(size=sizes)
def test_the_spectrum_is_scipys(size: tuple[int, int]) -> None:
    x = some(2, size[0], 3)
    expected = dct(x, type=2, norm="ortho", axis=1)[:, : size[1]]
    np.testing.assert_allclose(Dct(*size).to_spectrum(np.asarray(x)), expected, atol=1e-12)


@given(size=sizes)
def test_what_the_basis_holds_comes_back(size: tuple[int, int]) -> None:
    basis, y = Dct(*size), some(3, size[1], 2)
    np.testing.assert_allclose(basis.to_spectrum(basis.to_time(y)), y, atol=1e-12, rtol=0)


@pytest.mark.parametrize("basis", [Dct(30, 30), Frames(30)], ids=["all frequencies", "frames"])
def test_with_everything_kept_motion_comes_back(basis: Dct | Frames) -> None:
    x = some(2, 30, 4)
    assert basis.kept == 30
    np.testing.assert_allclose(basis.to_time(basis.to_spectrum(x)), x, atol=1e-12, rtol=0)


def test_dropping_frequencies_gives_the_nearest_motion_that_is_left() -> None:
    basis, x = Dct(30, 7), some(1, 30, 2)
    near = basis.to_time(basis.to_spectrum(x))
    for seed in range(1, 6):
        other = near + 0.1 * basis.to_time(some(1, 7, 2, seed=seed))
        assert np.linalg.norm(x - near) < np.linalg.norm(x - other)


def test_a_pose_that_does_not_move_is_its_first_coefficient() -> None:
    spectrum = Dct(25, 4).to_spectrum(np.full((1, 25, 1), 2.0, dtype=np.float64))
    np.testing.assert_allclose(spectrum.flatten(), np.array([10.0, 0, 0, 0], dtype=np.float64), atol=1e-5)


@pytest.mark.parametrize("kept", [0, -1, 11])
def test_there_are_as_many_frequencies_as_frames(kept: int) -> None:
    with pytest.raises(ValueError, match="kept"):
        Dct(10, kept)


def test_type_and_leading_axes_are_the_callers() -> None:
    assert Dct(10, 3).to_spectrum(np.zeros((2, 5, 10, 4), np.float32)).shape == (2, 5, 3, 4)
    assert Dct(10, 3).to_time(np.zeros((3, 4), dtype=np.float32)).dtype == np.float32


@pytest.mark.parametrize("soft", [False, True], ids=["hard", "soft"])
@pytest.mark.parametrize("level", [0, 1, 17, 40])
def test_knowing_frames_is_equation_7_written_out(level: int, soft: bool) -> None:
    """Both halves to time by loops over frames and frequencies, mixed frame by frame, and back."""
    frames, kept = 9, 4
    x, known, noise = some(2, kept, 3), some(2, kept, 3, seed=1), some(2, kept, 3, seed=2)
    mask = np.zeros((frames, 3), dtype=np.float64)
    mask[:4] = 1
    mask[4] = 0.3 if soft else 1
    held = observe(known, mask if soft else mask.astype(bool), SCHEDULE, lambda like: noise, basis=Dct(frames, kept))
    made = held(x, level)
    a, b = np.sqrt(float(SCHEDULE.alpha_bar[level])), np.sqrt(1 - float(SCHEDULE.alpha_bar[level]))
    waves = [
        [np.sqrt((1 if k == 0 else 2) / frames) * np.cos(np.pi * (i + 0.5) * k / frames) for i in range(frames)]
        for k in range(kept)
    ]
    expected = np.zeros((2, kept, 3))
    for row, c in np.ndindex(2, 3):
        for i in range(frames):
            free = sum(waves[k][i] * float(x[row, k, c]) for k in range(kept))
            given_ = sum(waves[k][i] * (a * float(known[row, k, c]) + b * float(noise[row, k, c])) for k in range(kept))
            mixed = float(mask[i, c]) * given_ + (1 - float(mask[i, c])) * free
            for k in range(kept):
                expected[row, k, c] += waves[k][i] * mixed
    np.testing.assert_allclose(made, expected, atol=1e-12)


def test_in_the_basis_of_frames_knowing_is_as_without_a_basis() -> None:
    x, known = some(2, 5, 3), some(2, 5, 3, seed=1)
    mask = np.array([True, True, False, False, False])[:, None]
    plain = observe(known, mask, SCHEDULE, row_noise([1, 2]))(x, 9)
    framed = observe(known, mask, SCHEDULE, row_noise([1, 2]), basis=Frames(5))(x, 9)
    assert np.array_equal(plain, framed)


# Published shares of signal at published index i (level i + 1) of 1000, float32 there.
ANCHORS = {
    "cosine": {0: 0.99995875, 11: 0.99918431, 101: 0.97105426, 501: 0.49072707, 991: 0.00015543, 999: 0.0},
    "sqrt": {0: 0.97659975, 1: 0.96381235, 11: 0.8989898, 501: 0.29435334, 991: 0.00399779, 999: 4.5e-7},
    "sigmoid": {0: 0.99988151, 1: 0.99976206, 251: 0.90435761, 501: 0.49559486, 991: 0.00097613, 999: 1.2e-7},
    "linear": {0: 0.99989998, 101: 0.89325094, 501: 0.07701247, 981: 5.788e-5, 999: 4.036e-5},
}


@pytest.mark.parametrize("name", list(ANCHORS))
def test_schedules_have_the_published_shares_of_signal(name: str) -> None:
    schedule = SCHEDULES[name](1000)
    found = {index: float(schedule.alpha_bar[index + 1]) for index in ANCHORS[name]}
    assert found == pytest.approx(ANCHORS[name], abs=4e-7)


@pytest.mark.parametrize("name", ["sqrt", "sigmoid"])
@pytest.mark.parametrize("steps", [1, 2, 10, 4000])
def test_schedules_of_any_length_fall_from_clean_to_noise(name: str, steps: int) -> None:
    schedule = SCHEDULES[name](steps)
    assert schedule.steps == steps
    assert (np.diff(schedule.alpha_bar) < 0).all()
    assert float(schedule.alpha_bar[-1]) < 2e-3
