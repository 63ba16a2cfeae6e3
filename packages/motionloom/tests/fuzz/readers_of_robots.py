"""Models of robots and files of their joint angles, where the extra `robots` is installed."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.reader import reader
from tests.robots import models
from tests.shared import SHARED


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


def urdf(folder: Path) -> None:
    from tests.robots.test_models import as_urdf

    (folder / "tin.urdf").write_text(as_urdf(robot(folder)))


def read_urdf(folder: Path) -> object:
    from motionloom.robots.body import read_robot

    return read_robot(folder / "tin.urdf")


G1 = SHARED / "robots" / "unitree_g1" / "g1_29dof_without_meshes.xml"


def g1(folder: Path) -> None:
    """A robot as its maker publishes it, where it lies beside the repository."""
    (folder / "tin.xml").write_bytes(G1.read_bytes())


if find_spec("mujoco") and find_spec("mink"):
    reader("URDF of a robot", urdf, {"tin.urdf": "svg"}, read_urdf, weight=3)
    reader("model of a robot", model, {"tin.xml": "svg"}, read_model, weight=3)
    reader("joint angles in a CSV", angles(".csv"), {"a.csv": "text"}, read_angles(".csv"), weight=5)
    reader("joint angles in an NPZ", angles(".npz"), {"a.npz": "npz"}, read_angles(".npz"), weight=3)
    if G1.is_file():
        reader("published robot", g1, {"tin.xml": "svg"}, read_model, weight=2)
