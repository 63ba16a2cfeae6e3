"""Recordings and drawn clips on humanoid robots: figures of each, limits that a table states, and how fast it is.

python benchmarks/robots.py g1.xml t1.xml --recordings FOLDER [--count 30] [--drawn 100] [--weights default]
    [--source-fps 30] [--out benchmarks/robots.txt]

FOLDER holds motion files (.bvh, .amc), of which every so many-th is taken, at most 8 s of each; AMC files state no rate
(--source-fps, else 120). Drawn clips are of
twenty kinds, by seed, 4 s each. Times are processor seconds of one core, reading the robot not counted.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import weights_digest
from motionloom.core.models.prior import find_weights
from motionloom.core.motion import Motion
from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import Clip, put_on_robot
from motionloom.robots.figures import Figures, measure

KINDS = (
    "a person walks forward",
    "a person walks backwards",
    "a person runs",
    "a person turns around",
    "a person walks in a circle",
    "a person sidesteps to the left",
    "a person jumps",
    "a person waves with the right hand",
    "a person kicks with the right leg",
    "a person punches",
    "a person dances",
    "a person squats",
    "a person bows",
    "a person claps",
    "a person raises both arms",
    "a person picks something up",
    "a person stands on one leg",
    "a person throws a ball",
    "a person points ahead",
    "a person stretches",
)
LONGEST = 8.0
"""Seconds of a recording."""


def recordings(folder: Path, count: int, fps: float | None) -> Iterator[tuple[str, Motion]]:
    """Every so many-th motion file below a folder; fps: of AMC files."""
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".bvh", ".amc"))
    for path in files[:: max(1, len(files) // count)][:count]:
        motion = io.load(path, fps=fps if path.suffix.lower() == ".amc" else None)
        yield path.stem, motion.frames(0, min(len(motion), round(LONGEST * motion.fps)))


def drawn(count: int, weights: str) -> Iterator[tuple[str, Motion]]:
    """Clips of `KINDS` by seed."""
    from motionloom.core.models.prior import Prior
    from motionloom.tasks.text import generate

    prior = Prior.load(weights)
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        [motion] = generate(prior, [kind], seconds=4.0, seed=number)
        yield f"{kind} {number}", motion


def row(name: str, robot: Robot, figures: Figures, clip: Clip, times: float) -> str:
    """A line of the table."""
    touches = "-" if figures.collision_frames is None else f"{figures.collision_frames / figures.frames:.2f}"
    return (
        f"{name[:34]:34} {robot.name[:9]:9} {figures.limits_broken:6} {figures.float_cm:6.2f} {figures.slide_cm:6.2f} "
        f"{figures.sunk_cm:5.2f} {figures.largest_step:5.2f} {figures.effector_cm or 0:6.2f} "
        f"{100 * np.percentile(clip.errors if clip.errors is not None else 0, 95):6.2f} "
        f"{np.abs(np.diff(clip.qpos[:, :3], axis=0)).max(initial=0.0) * clip.fps:6.1f} "
        f"{figures.at_limit_share:6.2f} {figures.outside_support_share:8.2f} {touches:>7} {times:6.1f}"
    )


HEAD = (
    f"{'clip':34} {'robot':9} {'broken':>6} {'float':>6} {'slide':>6} {'sunk':>5} {'step':>5} {'hands':>6} {'95 %':>6} "
    f"{'root':>6} {'limit':>6} {'unheld':>8} {'touches':>7} {'times':>6}"
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+", type=Path)
    parser.add_argument("--recordings", type=Path)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--source-fps", type=float)
    parser.add_argument("--drawn", type=int, default=0)
    parser.add_argument("--weights", default="default")
    parser.add_argument("--avoid-collisions", action="store_true")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    robots = [read_robot(path) for path in arguments.robots]
    put_on_robot(Motion(robots[0].skeleton, 50.0, *_still(robots[0])), robots[0])  # what is loaded once
    lines, found = [HEAD], {"recordings": [], "drawn": []}
    sources = {
        "recordings": recordings(arguments.recordings, arguments.count, arguments.source_fps)
        if arguments.recordings
        else (),
        "drawn": drawn(arguments.drawn, arguments.weights) if arguments.drawn else (),
    }
    for kind, clips in sources.items():
        for name, motion in clips:
            for robot in robots:
                begin = time.process_time()
                try:
                    clip = put_on_robot(motion, robot, avoid_collisions=arguments.avoid_collisions)
                except MotionloomError as error:
                    lines.append(f"{name[:34]:34} {robot.name[:9]:9} {error}")
                    continue
                spent = time.process_time() - begin
                figures = measure(clip, robot)
                found[kind].append((robot, figures, motion.seconds / spent))
                lines.append(row(name, robot, figures, clip, motion.seconds / spent))
                print(lines[-1], flush=True)
    lines += ["", *summary(found)]
    print("\n".join(["", *summary(found)]))
    if arguments.out is not None:
        found_weights = f"{arguments.weights} {weights_digest(find_weights(arguments.weights))[:12]}"
        arguments.out.write_text("\n".join([*lines, "", f"Weights: {found_weights}"]) + "\n")
    return 0


def _still(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    joints = len(robot.skeleton)
    root = np.tile(robot.skeleton.offsets[0], (10, 1))
    return root, np.tile([1.0, 0.0, 0.0, 0.0], (10, joints, 1))


def summary(found: dict[str, list[tuple[Robot, Figures, float]]]) -> Iterator[str]:
    """A line for each robot and kind: how many clips keep each limit, and the worst."""
    for kind, rows in found.items():
        for name in dict.fromkeys(robot.name for robot, _, _ in rows):
            own = [(figures, times) for robot, figures, times in rows if robot.name == name]
            figures = [one for one, _ in own]
            kept = {
                "limits broken": sum(one.limits_broken == 0 for one in figures),
                "float to 1 cm": sum(one.float_cm <= 1 for one in figures),
                "slide to 0.3 cm a frame": sum(one.slide_cm <= 0.3 for one in figures),
                "hands and feet to 6 cm": sum((one.effector_cm or 0) <= 6 for one in figures),
                "steps to 0.3 rad": sum(one.largest_step <= 0.3001 for one in figures),
            }
            text = ", ".join(f"{what} {count}" for what, count in kept.items())
            worst = (
                f"worst float {max(one.float_cm for one in figures):.2f} cm, slide "
                f"{max(one.slide_cm for one in figures):.2f} cm, hands and feet "
                f"{max(one.effector_cm or 0 for one in figures):.2f} cm"
            )
            rate = f"times real time: median {np.median([t for _, t in own]):.1f}, least {min(t for _, t in own):.1f}"
            yield f"{kind}, {name}, {len(own)} clips; clips that keep: {text}; {worst}; {rate}"


if __name__ == "__main__":
    sys.exit(main())
