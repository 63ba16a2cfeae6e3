"""The skeletons of the prediction benchmarks, as published systems see them: from the root, +Z up, no way through
the world; and whatever else ``benchmarks.toml`` has of them."""

from typing import Any

from motionloom.core.features.positions import Layout
from motionloom.core.reading import read_table

TABLES: dict[str, Any] = read_table("motionloom_lab.papers", "benchmarks.toml")


def _layout(name: str) -> Layout:
    names, parents, pairs = (tuple(TABLES[name][part]) for part in ("names", "parents", "pairs"))
    return Layout(names, parents, pairs, root=False, z_up=True)


H36M_LAYOUT, HUMANEVA_LAYOUT = _layout("h36m"), _layout("humaneva")
