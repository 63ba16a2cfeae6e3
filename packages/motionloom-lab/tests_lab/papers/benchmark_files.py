"""Small made-up files of Human3.6M, HumanEva-I and AMASS in their usual layouts."""

from pathlib import Path
from typing import Any

import numpy as np

from motionloom_train.data.prediction import Protocol


def person(frames: int, joints: int = 32) -> np.ndarray:
    """(frames, joints, 3) +Z up: each number says its frame, joint and axis; nobody in particular."""
    frame, joint, axis = np.meshgrid(range(frames), range(joints), range(3), indexing="ij")
    return (frame * 0.001 + joint * 0.01 + axis * 0.1).astype(np.float32)


def write(path: Path, table: Any, **more: Any) -> Path:
    np.savez_compressed(path, positions_3d=np.array(table, dtype=object), **more)
    return path


def h36m(folder: Path, frames: int = 151) -> Path:
    names = [f"{a}{n}" for a in ("Directions", "Eating", "WalkTogether") for n in ("", " 1")]
    table = {s: {a: person(frames) for a in names} for s in ("S1", "S5", "S6", "S7", "S8", "S9", "S11")}
    table["S9"] = {"Photo 1": person(200), "Walking 2": person(126), "Sitting": person(125), "Posing": person(40)}
    del table["S11"]["Directions"]
    return write(folder / "data_3d_h36m.npz", table)


def humaneva(folder: Path, **changes: dict[str, np.ndarray]) -> Path:
    chunks = {"Walking 1 chunk0": 80, "Walking 1 chunk2": 80, "Walking 1 chunk4": 80, "Box 1 chunk0": 75, "Jog 2": 74}
    table = {
        f"{part}/S{n}": {name: person(frames, 15) for name, frames in chunks.items()}
        for part in ("Train", "Validate")
        for n in (1, 2, 3)
    }
    return write(folder / "data_3d_humaneva15.npz", table | changes | {"Unlabeled/S4": {"x": person(90, 15)}})


def starts(protocol: Protocol) -> dict[str, list[int]]:
    result: dict[str, list[int]] = {}
    for recording, start in protocol.windows():
        result.setdefault(recording.name, []).append(start)
    return result


def z_up(frames: int) -> np.ndarray:
    return person(frames, 22).astype(np.float32)


def amass_folder(root: Path) -> Path:
    """Places of several data sets, old and new names, as .npy at 60 Hz."""
    frames = {
        "CMU/01/a_poses": 200,
        "SFU/x/b_poses": 160,
        "SSM_synced/p/c_poses": 421,
        "DanceDB/q/d_poses": 420,
        "GRAB/s1/lift_poses": 301,
        "GRAB/s2/lift_poses": 540,
        "Unknown/z/e": 900,
    }
    for name, count in frames.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        np.save(root / f"{name}.npy", z_up(count))
    return root
