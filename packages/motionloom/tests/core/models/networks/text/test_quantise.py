"""The eight-bit rows against the bound that rounding to a grid has."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motionloom.core.models.networks.text.quantise import dequantise, quantise


@given(arrays(np.float32, (4, 7), elements=st.floats(-100, 100, width=32)))
def test_no_entry_is_off_by_more_than_half_a_step(matrix: np.ndarray) -> None:
    values, scale = quantise(matrix)
    error = np.abs(dequantise(values, scale) - matrix)
    step = np.maximum(np.abs(matrix).max(1) / 127, 6.2e-5)  # float16 rounds the step itself by up to 1/2048
    assert (error <= 0.5 * step[:, None] * 1.002 + 127 * step[:, None] / 2048 / 2).all()


def test_a_row_on_the_grid_comes_back_exactly() -> None:
    matrix = np.array([[127.0, -64.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]], np.float32) * 0.25
    assert np.array_equal(dequantise(*quantise(matrix)), matrix)


def test_rows_do_not_share_a_step() -> None:
    matrix = np.array([[1000.0, 3.0], [0.1, 0.05]], np.float32)
    error = np.abs(dequantise(*quantise(matrix)) - matrix)
    assert error[1].max() < 0.001
