"""MuJoCo, when it is needed: nothing imports it before a robot is read."""

import importlib
import os
import sys
from ctypes.util import find_library
from typing import Any


def load_mujoco() -> Any:
    """The module `mujoco`, set to draw without a screen, or not at all: which of them is decided at its import.

    Raises `ModuleNotFoundError` where it is not installed (the extra ``motionloom[robots]``).
    """
    if sys.platform == "linux" and not {"DISPLAY", "MUJOCO_GL"} & set(os.environ):
        os.environ["MUJOCO_GL"] = "egl" if find_library("EGL") else "disabled"
    return importlib.import_module("mujoco")


def posed(model: Any, qpos: Any = None) -> Any:
    """`mujoco.MjData` of a model, whose bodies are where a pose (nq,) puts them, or None the model's own pose."""
    mujoco = load_mujoco()
    data = mujoco.MjData(model)
    data.qpos = data.qpos if qpos is None else qpos
    mujoco.mj_kinematics(model, data)
    return data
