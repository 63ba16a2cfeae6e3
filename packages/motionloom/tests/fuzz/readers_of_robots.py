"""Models of robots and files of their joint angles, where the extra `robots` is installed."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.reader import reader
from tests.robots import models


def model(folder: Path) -> None:
    (folder / "tin.xml").write_text(models.humanoid())


def read_model(folder: Path) -> object:
    from motionloom.robots.body import read_robot

    return read_robot(folder / "tin.xml")


_ROBOT: list[Any] = []


def robot(folder: Path) -> Any:
    """A sound one, read once: what is damaged is the file of its angles."""
    if not _ROBOT:
        model(folder)
        _ROBOT.append(read_model(folder))
        (folder / "tin.xml").unlink()
    return _ROBOT[0]


def angles(suffix: str) -> Any:
    def make(folder: Path) -> None:
        from motionloom.robots.clip import Clip
        from motionloom.robots.files import save_clip

        own = robot(folder)
        clip = Clip(50.0, np.tile(own.home, (6, 1)), np.ones((6, 2, 2), dtype=bool))
        save_clip(clip, own, folder / f"a{suffix}")

    return make


def read_angles(suffix: str) -> Any:
    def read(folder: Path) -> object:
        from motionloom.robots.figures import measure
        from motionloom.robots.files import load_clip

        return measure(load_clip(folder / f"a{suffix}", robot(folder)), robot(folder))

    return read


if find_spec("mujoco") and find_spec("mink"):
    reader("model of a robot", model, {"tin.xml": "svg"}, read_model, weight=3)
    reader("joint angles in a CSV", angles(".csv"), {"a.csv": "text"}, read_angles(".csv"), weight=5)
    reader("joint angles in an NPZ", angles(".npz"), {"a.npz": "npz"}, read_angles(".npz"), weight=3)
