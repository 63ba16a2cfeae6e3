"""Whether walks differ: the spread of ten seeds of one sentence beside that of recorded people.

    python benchmarks/walks.py SET [--seeds 10] [--weights default]

SET is what `motionloom data build` made. Of each recorded person (the beginning of a clip's name) the first clip whose
caption says "walks", in which somebody goes straight ahead for `FRAMES` frames, is taken. Of generated walks of 4 s the
same stretch in their middle. Printed: mean and standard deviation over people and over seeds, and the ratio of the
deviations.
"""

import argparse
import re
from pathlib import Path

import numpy as np

from motionloom.core.models.prior import Prior, find_weights
from motionloom.kinematics.gestures import torso_inclination
from motionloom.kinematics.physics import ANKLES, WRISTS, Array, J, in_body, speed, turn
from motionloom.tasks.text import generate
from motionloom_lab.suites.harness import weight_marks
from motionloom_lab.suites.items import real_clips

PROMPTS = ("a person walks", "a man is walking forward", "someone takes a walk")
FRAMES, FPS = 40, 20.0
HAND_KEYED = ("animated_drawings", "cat_soulslike", "kaykit", "mesh2motion", "quaternius")
MANNERS = re.compile(
    r"back|side|turn|run|jog|sit|slow|fast|quick|brisk|sneak|march|limp|zombie|circle|carr|box|wav|stair|kick|arms"
    r"|jump|hop|curve|bend|pick|drunk|old|sad|strut|danc|uneven|climb|skip|cart"
)
"""Captions with these say how somebody walks, or do not say that alone."""


def numbers(p: Array) -> dict[str, float]:
    """What is compared, of (frames, 22, 3) metres."""
    body = in_body(p)
    steps = body[:, ANKLES[0], 2] - body[:, ANKLES[1], 2]
    return {
        "pace, m/s": float(np.median(speed(p, FPS))),
        "stride, m": float(np.ptp(steps)),
        "swing of the wrists, cm": float(100 * np.mean([body[:, wrist, 2].std() for wrist in WRISTS])),
        "arms apart, cm": float(100 * np.abs(body[:, WRISTS[0], 0] - body[:, WRISTS[1], 0]).mean()),
        "sway of the trunk, cm": float(100 * (body[:, J["neck"], 0] - body[:, J["neck"], 0].mean()).std()),
        "lean, degrees": float(np.degrees(torso_inclination(p)).mean()),
        "height of the wrists, cm": float(100 * (p[:, list(WRISTS), 1].mean() - p[:, 0, 1].mean())),
    }


def recorded(folder: Path) -> list[dict[str, float]]:
    """The numbers of one walk of each recorded person."""
    people: dict[str, dict[str, float]] = {}
    for clip in real_clips(folder):
        text = " ".join(clip.captions).lower()
        name = clip.name.removeprefix("cmu_")
        person = "_".join(name.split("_")[: 1 if name[0].isdigit() else 2])
        if (
            clip.source.startswith(HAND_KEYED)
            or person in people
            or not re.search(r"\bwalk", text)
            or MANNERS.search(text)
        ):
            continue
        for first in range(0, len(clip.positions) - FRAMES + 1, 10):
            p = np.asarray(clip.positions[first : first + FRAMES], dtype=np.float64)
            paces = speed(p, FPS)
            if paces.min() > 0.5 and paces.max() < 2.2 and abs(turn(p)) < np.radians(15):
                people[person] = numbers(p)
                break
    return list(people.values())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    people = recorded(arguments.set)
    print(
        f"{len(people)} recorded people, {arguments.seeds} seeds of each sentence; mean and deviation, ratio of those\n"
    )
    print("recorded | " + " | ".join(PROMPTS))
    walks = []
    for prompt in PROMPTS:
        places = [one.positions() for one in generate(prior, prompt, seconds=4.0, count=arguments.seeds, seed=700)]
        middle = (len(places[0]) - FRAMES) // 2
        walks.append([numbers(p[middle : middle + FRAMES]) for p in places])
    ratios: list[list[float]] = [[] for _ in PROMPTS]
    for name in people[0]:
        real = np.array([one[name] for one in people])
        line = [f"{real.mean():.2f} {real.std(ddof=1):.2f}"]
        for walk, own in zip(walks, ratios, strict=True):
            values = np.array([one[name] for one in walk])
            own.append(values.std(ddof=1) / real.std(ddof=1))
            line.append(f"{values.mean():.2f} {values.std(ddof=1):.2f} {own[-1]:.2f}")
        print(" | ".join(line), name)
    print("\nmean of the ratios: " + ", ".join(f"{np.mean(own):.2f}" for own in ratios) + " (asked 0.7)")
    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
