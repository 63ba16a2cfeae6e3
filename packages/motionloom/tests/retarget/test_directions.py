"""Bodies do what was recorded: directions of limbs and trunk and places of joints, frame by frame."""

import csv
import warnings
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.kinematics.wholeness import LOWEST_SHOULDERS, shoulders_below
from motionloom.retarget import from_smpl22, joints22, to_smpl22
from motionloom.retarget.fidelity import compare
from tests.shared import SHARED, shared

TOYS = {
    "gdbot.glb": "a robot with a head as large as its trunk",
    "kaykit_knight.glb": "a toy with hips as wide as its legs are long",
    "robot_expressive.glb": "a robot with hips as wide as its legs are long",
    "sophia.glb": "a figure with a third of a person's legs",
    "pybvh_test3.bvh": "points its toes at rest and never stands flat: nothing shows its soles",
}
"""Bodies on which legs of other shapes reach the same floor, and why their legs may point elsewhere."""
PERSONLESS = ("arm_only.bvh", "chicken.bvh", "elephant.bvh", "kenney.glb", "m2m_fox.glb")
RIGS = sorted(p.name for p in (SHARED / "rigs").glob("*.*") if p.suffix != ".md") or ["rigs"]


def read(path: Path) -> Motion:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = load(path)
    return motion.frames(0, min(len(motion), 400))


LIMITS = {
    **dict.fromkeys(("trunk", "upper arm", "forearm", "shoulder line"), (5, 15)),
    "hip line": (6, 15),  # one character's hip joints are not level at rest
    **dict.fromkeys(
        ("thigh", "shin"), (8, 18)
    ),  # feet stand where they stood, on legs of another ratio of thigh to shin
}
"""Degrees that the median and the 95th percentile over a clip stay under."""


def agree(recording: np.ndarray, body: np.ndarray) -> None:
    """Trunk and limbs (frames, 22, 3) point the same way; a foot's bone slopes as the skeleton has its ankle."""
    seen = compare(recording, body)
    for line, (median, high) in LIMITS.items():
        assert seen.directions[line].median < median, line
        assert seen.directions[line].high < high, line
    assert seen.directions["all"].median < 3
    assert min(seen.places["all"].median, seen.by_leg["all"].median) < 4


@pytest.mark.parametrize("name", [n for n in RIGS if n not in (*TOYS, *PERSONLESS)])
def test_a_clip_of_a_foreign_rig_is_on_the_uniform_person_as_it_was(name: str) -> None:
    if name == "rigs":
        shared("rigs/README.md")
    motion = read(shared(f"rigs/{name}"))
    agree(joints22(motion), to_smpl22(motion).positions())


@pytest.mark.parametrize("name", [n for n in RIGS if n in TOYS])
def test_the_trunk_and_arms_of_toys_do_what_was_recorded(name: str) -> None:
    motion = read(shared(f"rigs/{name}"))
    seen = compare(joints22(motion), to_smpl22(motion).positions()).directions
    for line in ("trunk", "upper arm", "forearm", "shoulder line"):
        assert seen[line].median < 5, line
        assert seen[line].high < 15, line


@pytest.mark.parametrize("name", [n for n in RIGS if n not in (*TOYS, *PERSONLESS)])
def test_a_motion_of_the_uniform_person_is_on_a_foreign_rig_as_it_was(name: str) -> None:
    if name == "rigs":
        shared("rigs/README.md")
    rig = read(shared(f"rigs/{name}")).skeleton
    walk = load(Path(__file__).parents[4] / "examples" / "clips" / "walk.bvh")
    try:
        worn = from_smpl22(walk, rig)
    except MotionloomError as error:  # a rig may lack what a target needs, and says so
        pytest.skip(str(error))
    agree(joints22(walk), joints22(worn))


def takes(pack: str, each: int) -> list[tuple[str, str, float]]:
    """Two takes of every source and skeleton of a pack: path, name and rate."""
    manifest = SHARED / pack / "manifest.csv"
    if not manifest.exists():
        return []
    by: dict[tuple[str, str], list[dict[str, str]]] = {}
    with manifest.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            by.setdefault((row["source"], row["skeleton"]), []).append(row)
    chosen = [rows[k] for rows in by.values() for k in sorted({len(rows) // 3, 2 * len(rows) // 3})[:each]]
    return [(f"{pack}/{row['path']}", row["clip"], float(row["fps"])) for row in chosen]


TAKES = [take for pack in ("data", "data_more", "data_third") for take in takes(pack, 2)]


@pytest.mark.parametrize(("path", "name", "fps"), TAKES, ids=[name for _, name, _ in TAKES])
def test_takes_of_every_source_are_on_the_uniform_person_as_recorded(path: str, name: str, fps: float) -> None:
    place = shared(path)
    motion = load(place, fps=fps) if place.suffix == ".amc" else load(place)
    agree(joints22(motion), to_smpl22(motion).positions())


WITHOUT_COLLARS = ("animated_drawings", "quaternius_robot")
"""Sources whose skeletons have no collar bones: their shoulders are where their arms begin."""


@pytest.mark.parametrize(("path", "name", "fps"), TAKES, ids=[name for _, name, _ in TAKES])
def test_shoulders_that_rest_are_where_a_persons_are(path: str, name: str, fps: float) -> None:
    """Of fitted people (accad, cmu, ui_prmd) they are 0.11 to 0.18 lengths of the spine below the neck."""
    place = shared(path)
    motion = load(place, fps=fps) if place.suffix == ".amc" else load(place)
    seen = shoulders_below(to_smpl22(motion).positions())
    if len(seen) < 10 or name.startswith(WITHOUT_COLLARS):
        pytest.skip("arms never hang, or there are no collar bones")
    assert 0.09 < np.median(seen) < LOWEST_SHOULDERS - 0.02
