"""The skeletons of the prediction benchmarks: their channels and sides, and places there and back."""

import numpy as np
import pytest

from motionloom.core.features.positions import SMPL_LAYOUT, Layout
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT, HUMANEVA_LAYOUT
from tests.core.features.test_positions import people


def test_benchmarks_have_the_published_channels_and_sides() -> None:
    assert (H36M_LAYOUT.channels, HUMANEVA_LAYOUT.channels, SMPL_LAYOUT.channels) == (48, 42, 66)
    assert [j for j in range(15) if HUMANEVA_LAYOUT.names[j].startswith("left")] == [2, 3, 4, 8, 9, 10]
    assert [j for j in range(15) if HUMANEVA_LAYOUT.names[j].startswith("right")] == [5, 6, 7, 11, 12, 13]
    for layout in (H36M_LAYOUT, HUMANEVA_LAYOUT, SMPL_LAYOUT):
        for name, pair in zip(layout.names, layout.pairs):
            swapped = name.replace("left", "L").replace("right", "left").replace("L", "right")
            assert layout.names[pair] == swapped


@pytest.mark.parametrize("layout", [H36M_LAYOUT, HUMANEVA_LAYOUT], ids=["human3.6m", "humaneva"])
def test_places_come_back_but_for_the_way(layout: Layout) -> None:
    p = people(layout, 3, 7)
    place = layout.place(p[:, -1])
    expected = p - p[..., :1, :] + p[:, -1:, :1]
    np.testing.assert_allclose(layout.decode(layout.encode(p, place), place), expected, atol=1e-12)
    assert Layout.parse(layout.plain()) == layout
