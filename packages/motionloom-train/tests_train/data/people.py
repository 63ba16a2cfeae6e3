"""Recordings of a made-up person as files of the layouts that `data build` reads."""

import csv
import json
from pathlib import Path

import numpy as np

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.features import humanml as hml
from motionloom.io import save
from tests.kinematics import people

FPS = 20.0


def walker(speed: float = 1.2, seconds: float = 4.0) -> np.ndarray:
    """(frames, 22, 3): a stick person who walks straight ahead and lifts the feet in turn."""
    return people.walking(speed, seconds)


def write_bvh(path: Path, positions: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    save(motion_from_positions(hml.uniform(positions), FPS), path)


COLUMNS = ("path", "source", "clip", "fps", "seconds", "split", "description", "metres_per_unit")


def write_pack(
    folder: Path, clips: dict[str, tuple[np.ndarray, str, str]], captions: dict[str, str] | None = None
) -> Path:
    """A folder with manifest.csv: name -> (positions, split, description); captions span whole clips."""
    (folder / "captions").mkdir(parents=True)
    rows, lines = [], []
    for name, (positions, split, description) in clips.items():
        write_bvh(folder / "bvh" / f"{name}.bvh", positions)
        seconds = len(positions) / FPS
        rows.append((f"bvh/{name}.bvh", "cmu", name, FPS, seconds, split, description, 1.0))
        if captions and name in captions:
            lines.append({"clip": name, "start_s": 0.0, "end_s": seconds, "captions": [captions[name]]})
    write_manifest(folder, rows)
    (folder / "captions" / "cmu.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder


def write_manifest(folder: Path, rows: list[tuple]) -> None:
    with open(folder / "manifest.csv", "w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
