"""Goals that nobody tuned for and that nobody has walked: how well are they met, and what does it cost?

    python benchmarks/user_goals.py --out OUT [--seeds 3] [--only s_curve,letter] [--weights default]

Each goal is met with several seeds and held against the motions of the same seeds and prompt without a goal.

    mean, worst   cm from the asked places, over all asked joints and frames, and the largest
    skate x       frames with a sliding toe (GMD), against the uncontrolled motions; - where those have hardly any
    slide x       mm that a toe in contact goes per frame (Motius), the same way
    jerk x        third derivative of the joints' places, the same way
    s             seconds per motion, its network calls and its fit, and uncontrolled

OUT gets `user_goals.json`, one contact sheet per goal (a row per seed, then one uncontrolled), and the made-up person.
"""

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.files.atomic import atomic_path
from motionloom.core.models.prior import Prior, find_weights
from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import Skeleton
from motionloom.goals.goal_file import read_goal
from motionloom.io import save
from motionloom.kinematics import physics
from motionloom.tasks.control import Controlled, control
from motionloom.tasks.text import generate
from motionloom.viz.video import draw_sheet
from motionloom_lab.metrics.skate import skate
from motionloom_lab.suites.harness import weight_marks

EXAMPLES = Path(__file__).parents[1] / "examples" / "goals"
OWN_POSE = "other_person.bvh"
NUMBERS = {"skate_share": 0.1, "skate_speed": 0.1, "skate_slide": 0.01, "jerk": 0.1}
"""What is measured, and what is too small in uncontrolled motions to be held against: %, cm/s, mm per frame, m/s^3."""


@dataclass(frozen=True)
class Case:
    """A goal, as a file of ``examples/goals`` or, where there is none of that name, as a mapping of the same keys."""

    name: str
    prompt: str
    seconds: float
    inline: Mapping[str, Any]
    example: bool = True


CASES = (
    Case("s_curve", "a person walks", 8.0, {"path": {"curve": "s", "size": 3.0}}),
    Case("figure_eight", "a person walks", 14.0, {"path": {"curve": "eight", "size": 4.0}}),
    Case(
        "letter",
        "a person writes in the air with the right hand",
        5.0,
        {
            "joints": [
                {
                    "joint": "right_wrist",
                    "curve": True,
                    "points": [
                        {"time": 1.0, "position": [-0.35, 1.5, 0.4]},
                        {"time": 1.8, "position": [-0.07, 1.5, 0.42]},
                        {"time": 2.8, "position": [-0.35, 1.25, 0.4]},
                        {"time": 3.6, "position": [-0.05, 1.25, 0.4]},
                    ],
                }
            ]
        },
    ),
    Case(
        "wrist_every_second",
        "a person stretches the left arm",
        5.0,
        {
            "joints": [
                {
                    "joint": "left_wrist",
                    "points": [
                        {"time": 1.0, "position": [0.4, 1.0, 0.3]},
                        {"time": 2.0, "position": [0.3, 1.5, 0.35]},
                        {"time": 3.0, "position": [0.45, 1.7, 0.1]},
                        {"time": 4.0, "position": [0.4, 1.0, 0.3]},
                    ],
                }
            ]
        },
    ),
    Case(
        "stop",
        "a person walks, stops and walks on",
        6.5,
        {"path": {"points": [[0, 0], [0, 2], [0, 2], [1.5, 3.5]], "times": [0, 2, 3.5, 6]}},
    ),
    Case(
        "pose_of_another_skeleton",
        "a person stands up and walks",
        5.0,
        {"start": {"position": [0, 0], "facing": 0}, "poses": [{"time": 0, "from": OWN_POSE, "at": 0}]},
        example=False,
    ),
    Case(
        "six_way_points",
        "a person walks",
        20.0,
        {
            "path": {
                "points": [[0, 0], [0, 4], [3, 6], [6, 4], [5, 0], [2, -2], [-1, -1]],
                "times": [0, 3.3, 6.6, 10.0, 13.3, 16.6, 19.5],
            }
        },
        example=False,
    ),
)

# A made-up person: other names than anybody's, long legs, short arms, three bones of the back, knees a little bent.
_BONES = (
    ("Base", "", (0.0, 1.08, 0.0)),
    ("Back1", "Base", (0.0, 0.16, 0.0)),
    ("Back2", "Back1", (0.0, 0.15, 0.0)),
    ("Back3", "Back2", (0.0, 0.14, 0.0)),
    ("Throat", "Back3", (0.0, 0.12, 0.0)),
    ("Skull", "Throat", (0.0, 0.13, 0.0)),
    ("L_Clav", "Back3", (0.04, 0.08, 0.0)),
    ("L_UpArm", "L_Clav", (0.13, 0.0, 0.0)),
    ("L_LowArm", "L_UpArm", (0.24, 0.0, 0.0)),
    ("L_Palm", "L_LowArm", (0.2, 0.0, 0.0)),
    ("R_Clav", "Back3", (-0.04, 0.08, 0.0)),
    ("R_UpArm", "R_Clav", (-0.13, 0.0, 0.0)),
    ("R_LowArm", "R_UpArm", (-0.24, 0.0, 0.0)),
    ("R_Palm", "R_LowArm", (-0.2, 0.0, 0.0)),
    ("L_UpLeg", "Base", (0.1, -0.06, 0.0)),
    ("L_LowLeg", "L_UpLeg", (0.0, -0.5, 0.0)),
    ("L_Heel", "L_LowLeg", (0.0, -0.45, 0.0)),
    ("L_Ball", "L_Heel", (0.0, -0.06, 0.14)),
    ("R_UpLeg", "Base", (-0.1, -0.06, 0.0)),
    ("R_LowLeg", "R_UpLeg", (0.0, -0.5, 0.0)),
    ("R_Heel", "R_LowLeg", (0.0, -0.45, 0.0)),
    ("R_Ball", "R_Heel", (0.0, -0.06, 0.14)),
)
_BENT = {
    "L_UpLeg": (-0.5, 0, 0),
    "R_UpLeg": (-0.5, 0, 0),
    "L_LowLeg": (0.9, 0, 0),
    "R_LowLeg": (0.9, 0, 0),
    "L_Heel": (-0.4, 0, 0),
    "R_Heel": (-0.4, 0, 0),
    "Back1": (0.2, 0, 0),
    "L_UpArm": (0, 0, -1.2),
    "R_UpArm": (0, 0, 0.6),
}
"""Radians about each joint's own axes: knees bent, one arm down and the other half out."""


def other_person(frames: int = 10) -> Motion:
    """Somebody who stands still on `_BONES`, knees bent, at 20 frames per second."""
    names = tuple(name for name, _, _ in _BONES)
    parents = tuple(names.index(parent) if parent else -1 for _, parent, _ in _BONES)
    skeleton = Skeleton(names, parents, np.array([offset for _, _, offset in _BONES]))
    turned = np.stack([rotvec_to_quat(np.array(_BENT.get(name, (0, 0, 0)), dtype=float)) for name in names])
    root = np.tile(skeleton.offsets[0], (frames, 1))
    pose = Motion(skeleton, FPS, root, np.tile(turned, (frames, 1, 1)))
    return Motion(skeleton, FPS, root - [0, pose.positions()[..., 1].min(), 0], pose.rotations)


def numbers(motions: Sequence[Motion]) -> dict[str, float]:
    """Means of `NUMBERS` over motions: %, cm/s, mm per frame, m/s^3."""
    rows = []
    for motion in motions:
        places = motion.positions()
        found = skate(places, motion.fps)
        rows.append((100 * found.share, found.speed, found.slide, physics.jerk(places, motion.fps).mean))
    return dict(zip(NUMBERS, np.mean(rows, axis=0).tolist(), strict=True))


def measure(case: Case, prior: Prior, out: Path, seeds: Sequence[int]) -> dict[str, Any]:
    """The numbers of one goal; its contact sheet goes to ``out``."""
    file = EXAMPLES / f"{case.name}.json"
    source, folder = (file, EXAMPLES) if case.example and file.is_file() else (case.inline, out)
    goal = read_goal(source, frames=round(case.seconds * FPS), folder=folder)
    made: list[Controlled] = []
    start = time.perf_counter()
    for seed in seeds:
        made += control(prior, case.prompt, goal, seed=seed)
    seconds = (time.perf_counter() - start) / len(seeds)
    start = time.perf_counter()
    plain = [generate(prior, case.prompt, seconds=case.seconds, seed=seed)[0] for seed in seeds]
    alone = (time.perf_counter() - start) / len(seeds)
    own, base = numbers([one.motion for one in made]), numbers(plain)
    rows = [f"{case.name}, seed {seed}: {100 * one.error:.2f} cm" for seed, one in zip(seeds, made, strict=True)]
    sheet = out / f"{case.name}.png"
    draw_sheet([*(one.motion for one in made), plain[0]], sheet, captions=[*rows, f"no goal, seed {seeds[0]}"])
    return {
        "name": case.name,
        "prompt": case.prompt,
        "seconds_of_motion": case.seconds,
        "seeds": list(seeds),
        "from": file.name if folder == EXAMPLES else "this script",
        "asked": int(goal.mask.any(axis=-1).sum()),
        "mean_cm": 100 * float(np.mean([one.error for one in made])),
        "worst_cm": 100 * max(one.worst for one in made),
        "drawn_cm": 100 * float(np.mean([off(one.sampled, goal) for one in made])),
        "controlled": own,
        "uncontrolled": base,
        "ratios": {name: own[name] / base[name] if base[name] > seen else None for name, seen in NUMBERS.items()},
        "seconds": seconds,
        "seconds_uncontrolled": alone,
        "missed": [list(one.missed) for one in made],
        "sheet": sheet.name,
    }


def off(motion: Motion, goal: Any) -> float:
    """Metres from the asked places, mean."""
    from motionloom_lab.metrics.control import distances

    return float(np.nanmean(distances(motion.positions(), goal.positions, goal.mask))) if goal.mask.any() else 0.0


def line(found: Mapping[str, Any]) -> str:
    """One row of the table."""
    ratios = [found["ratios"][name] for name in ("skate_share", "skate_slide", "jerk")]
    said = " ".join(f"{ratio:8.2f}" if ratio is not None else f"{'-':>8}" for ratio in ratios)
    return (
        f"{found['name']:26} {found['mean_cm']:8.2f} {found['worst_cm']:8.2f} {found['drawn_cm']:8.2f} {said} "
        f"{found['seconds']:7.2f} {found['seconds_uncontrolled']:7.2f}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3, help="motions per goal (default 3)")
    parser.add_argument("--only", default="", help="names of goals with commas (default: all)")
    parser.add_argument("--weights", default="default")
    said = parser.parse_args()
    only = {name for name in said.only.split(",") if name}
    unknown = only - {case.name for case in CASES}
    if unknown or said.seeds < 1:
        parser.error(f"no goal {', '.join(sorted(unknown))}; there are {', '.join(case.name for case in CASES)}")
    said.out.mkdir(parents=True, exist_ok=True)
    save(other_person(), said.out / OWN_POSE)
    prior, results, failed = Prior.load(said.weights), [], False
    heads = ("mean cm", "worst", "drawn", "skate x", "slide x", "jerk x")
    print(f"{'':26} {' '.join(f'{head:>8}' for head in heads)} {'s':>7} {'s plain':>7}", flush=True)
    for case in (case for case in CASES if not only or case.name in only):
        try:
            results.append(measure(case, prior, said.out, range(said.seeds)))
        except MotionloomError as error:
            failed = True
            print(f"{case.name:26} failed: {error}", flush=True)
            continue
        print(line(results[-1]), flush=True)
        with atomic_path(said.out / "user_goals.json") as temp:
            temp.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    [(name, mark)] = weight_marks([find_weights(said.weights)]).items()
    print(f"\nWeights: {name} {mark}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
