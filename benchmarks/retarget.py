"""How well motions survive the change of body: the table of docs/retarget.md.

    python benchmarks/retarget.py PACK [PATTERN ...]

PACK is the folder of real clips with its manifest.csv; the patterns pick clips by path (default: the walks and a few
hard ones). Every clip goes to the uniform person and back to its own skeleton.

    pen, float   cm: mean depth of the lowest foot joint under y = 0, and mean height above it (all frames)
    skate        m/s: mean speed along the floor of planted toes (slow and low in the source), source -> uniform person
    ankle        the same of the ankles above planted toes
    arms, legs   degrees: mean error of bone directions, uniform person against source
    back         degrees: mean error of all bone directions after the way back
    bones        largest error of a bone's length, metres
    turn         degrees: largest turn of a joint between two frames, source -> uniform person
"""

import csv
import sys
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.motion import Motion
from motionloom.io.asf import load_asf_amc
from motionloom.io.bvh import load_bvh
from motionloom.retarget import from_smpl22, joints22, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.axes import CHILD
from motionloom.retarget.floor import level

Array = NDArray[np.float64]
DEFAULT = (
    "*02/02_01.amc",
    "*07/07_01.amc",
    "*16/16_15.amc",
    "*35/35_01.amc",
    "*bvh/07_04.bvh",
    "*bvh/10_04.bvh",
    "*bvh/12_01.bvh",
    "*1_walk_normal_001.bvh",
    "*1_walk_old_001.bvh",
    "*1_run_happy_001.bvh",
    "*1_dance-short_normal*",
    "*02/02_03.amc",
    "*49/49_07.amc",
    "*01/01_03.amc",
    "*bvh/13_01.bvh",
)
ARMS, LEGS = (13, 14, 16, 17, 18, 19), (1, 2, 4, 5)


def load(pack: Path, row: dict[str, str]) -> Motion:
    path = pack / row["path"]
    if row["format"].lower().startswith("asf") or path.suffix == ".amc":
        return load_asf_amc(next(path.parent.glob("*.asf")), path, fps=float(row["fps"]))
    return load_bvh(path, unit=float(row["metres_per_unit"]))


def angles(a: Array, b: Array, joints: tuple[int, ...]) -> float:
    """Mean degrees between the bones that start at the joints."""
    errors = []
    for j in joints:
        u, v = a[:, CHILD[j]] - a[:, j], b[:, CHILD[j]] - b[:, j]
        errors.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(u, v), axis=-1), (u * v).sum(-1))).mean())
    return float(np.mean(errors))


def slide(places: Array, joints: list[int], fps: float, planted: NDArray[np.bool_]) -> float:
    """Mean m/s along the floor in planted frames."""
    speed = np.linalg.norm(np.diff(places[:, joints][..., [0, 2]], axis=0), axis=-1) * fps
    both = planted[1:] & planted[:-1]
    return float(speed[both].mean()) if both.any() else float("nan")


def largest_turn(motion: Motion, joints: list[int]) -> float:
    q = motion.world_rotations()[:, joints]
    return float(np.degrees(2 * np.arccos(np.abs((q[1:] * q[:-1]).sum(-1)).clip(0, 1))).max())


def measure(motion: Motion) -> list[float]:
    person = to_smpl22(motion)
    back = from_smpl22(person, motion.skeleton)
    source, places = level(joints22(motion), motion.fps), person.positions()
    toes = source[:, [10, 11]]
    speed = np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * motion.fps
    planted = (speed < 0.5) & (toes[..., 1] < 0.05)
    lowest = places[:, [7, 8, 10, 11], 1].min(axis=1)
    drivers = sorted({d for d in read_body(motion.skeleton).drivers if d is not None})
    bones = [np.abs(_lengths(m) - m.skeleton.bone_lengths()[1:]).max() for m in (person, back)]
    return [
        100 * np.maximum(-lowest, 0).mean(),
        100 * np.maximum(lowest, 0).mean(),
        slide(source, [10, 11], motion.fps, planted),
        slide(places, [10, 11], motion.fps, planted),
        slide(source, [7, 8], motion.fps, planted),
        slide(places, [7, 8], motion.fps, planted),
        angles(joints22(motion), places, ARMS),
        angles(joints22(motion), places, LEGS),
        angles(joints22(motion), joints22(back), tuple(j for j, c in enumerate(CHILD) if c is not None)),
        float(max(bones)),
        largest_turn(motion, drivers),
        largest_turn(person, list(range(22))),
    ]


def _lengths(motion: Motion) -> Array:
    places = motion.positions()
    return np.linalg.norm(places[:, 1:] - places[:, list(motion.skeleton.parents[1:])], axis=-1)


def main(pack: Path, patterns: tuple[str, ...]) -> None:
    with (pack / "manifest.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if any(fnmatch(row["path"], p) for p in patterns)]
    print(f"{'clip':34}  pen float  skate          ankle          arms legs back  bones    turn")
    for row in rows:
        v = measure(load(pack, row))
        slides = f"{v[2]:.3f} -> {v[3]:.3f}  {v[4]:.3f} -> {v[5]:.3f}"
        rest = f"{v[6]:4.2f} {v[7]:4.1f} {v[8]:4.1f}  {v[9]:.0e}  {v[10]:3.0f} -> {v[11]:3.0f}"
        print(f"{Path(row['path']).stem[:34]:34} {v[0]:4.2f} {v[1]:5.2f}  {slides}  {rest}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), tuple(sys.argv[2:]) or DEFAULT)
