"""Jobs for tests, and what came of them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.bulk.maker import Options
from motionloom.bulk.metadata import read_batch
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22

WORDS = ("a person walks", "a person turns", "a person jumps and waves")


def rows(count: int) -> list[dict[str, Any]]:
    """Rows of a few prompts and lengths, each with a seed of its own."""
    return [{"prompt": WORDS[i % 3], "seconds": (0.6, 1.0, 0.8)[i % 3], "seed": i} for i in range(count)]


def write_jobs(path: Path, job: list[dict[str, Any]]) -> Path:
    """Rows as a file of JSON lines."""
    path.write_text("".join(json.dumps(row) + "\n" for row in job), encoding="utf-8")
    return path


def options(weights: str, **more: Any) -> Options:
    """Options of the tiny prior, few steps."""
    return Options(weights=weights, steps=2, **more)


def positions(out: Path) -> dict[tuple[str, int], np.ndarray]:
    """Where every joint of every motion of a batch is, by words and seed."""
    return {
        (one.about["text"], one.about["seed"]): one.motion.positions()[:, _order(one.motion)]
        for one in read_batch(out)
        if one.motion is not None
    }


def _order(motion: Motion) -> list[int]:
    """Joints in the order of the uniform person; a BVH file has its own."""
    return [motion.skeleton.names.index(name) for name in SMPL22.names]


def apart(a: dict[Any, np.ndarray], b: dict[Any, np.ndarray]) -> float:
    """Metres: the largest distance of any joint in any frame between batches of the same rows."""
    assert a.keys() == b.keys()
    return max(float(np.abs(a[key] - b[key]).max()) for key in a)
