"""Whole bodies: of forty everyday sentences, ten seeds each, how many people are folded or otherwise broken.

Usage: python benchmarks/folded.py [--weights FILE] [--seeds 10] > benchmarks/folded.txt

A person counts as folded where the pelvis is out of line with the trunk in more than a tenth of the frames, and as
broken where any part of the body is (`motionloom.kinematics.wholeness`). Shoulders are low where they rest further
below the neck than any fitted person's; people whose arms hardly hang are not counted. Nothing is drawn again and no
number read: it is what the network draws.
"""

import argparse

import numpy as np

from motionloom.core.models.prior import Prior, find_weights
from motionloom.kinematics.wholeness import ENOUGH, LOWEST_SHOULDERS, broken_frames, shoulders_below, wholeness
from motionloom.tasks.text import generate
from motionloom_lab.suites.harness import weight_marks

FEW = 10
"""Frames with hanging arms that say where shoulders rest."""
SENTENCES = (
    "a person stands still",
    "a person looks around",
    "a person sidesteps to the left",
    "a person sidesteps to the right",
    "someone runs backwards",
    "a person crouches",
    "a person crouches down and stands up again",
    "a person gets up from the floor",
    "a person kicks",
    "a person kicks with the left leg",
    "a person sneaks forward",
    "a person punches with the left hand",
    "a person walks forward",
    "a person walks backwards",
    "a man walks in a circle",
    "a person runs",
    "a woman jogs slowly",
    "a person jumps",
    "a person hops on one leg",
    "a person turns to the left",
    "a person turns around",
    "a person sits down",
    "a person stands up from a chair",
    "a person lies down",
    "a person crawls",
    "a person rolls on the ground",
    "a person waves",
    "a person claps",
    "a person raises both arms",
    "a person bows",
    "a person kneels down",
    "a person touches their toes",
    "a person picks something up from the floor",
    "a person throws a ball",
    "a person dances",
    "a person does squats",
    "a person does a lunge",
    "a person does jumping jacks",
    "a person climbs the stairs",
    "a person waits",
)


def main() -> None:
    """Print a line for each sentence and the sums."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--weights", default="default")
    parser.add_argument("--seeds", type=int, default=10)
    given = parser.parse_args()
    prior = Prior.load(given.weights)
    print(f"sentence | folded, of {given.seeds} | not whole | low shoulders, of those whose arms hang")
    sums = np.zeros(4, int)
    for text in SENTENCES:
        people = [generate(prior, text, seed=seed, literal=True)[0].positions() for seed in range(given.seeds)]
        folded = sum(broken_frames(body)["pelvis"].mean() > 1 - ENOUGH for body in people)
        broken = sum(wholeness(body) < ENOUGH for body in people)
        resting = [seen for body in people if len(seen := shoulders_below(body)) >= FEW]
        low = sum(float(np.median(seen)) > LOWEST_SHOULDERS for seen in resting)
        sums += [folded, broken, low, len(resting)]
        print(f"{text} | {folded} | {broken} | {low} of {len(resting)}", flush=True)
    print(f"all {len(SENTENCES) * given.seeds} | {sums[0]} | {sums[1]} | {sums[2]} of {sums[3]}")
    [(name, mark)] = weight_marks([find_weights(given.weights)]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
