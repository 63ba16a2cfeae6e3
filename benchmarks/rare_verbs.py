"""Verbs and phrases that the weights have seldom read: how often the network shows them, and what `generate` writes.

    python benchmarks/rare_verbs.py [--seeds 10] [--weights default]

Of each verb in `[plainer]` of motionloom/goals/verbs.toml "a person VERBs" is generated for four seconds, with and
without `literal`. `shown`: the share of motions in which nothing is missing of what the common verb says plainly
(`motionloom.goals.expected`, by which `generate` also chooses, so these shares judge the words, not the motion; they
were looked at when verbs were chosen). `at rest`: the share of frames in which no joint is faster than 0.2 m/s. Behind
them the same of a sentence for each of `[phrases]`, without a length.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from lengths import rest

from motionloom.core.models.prior import Prior, find_weights
from motionloom.goals.verbs import MOODS, PLAINER
from motionloom.tasks.worded import generate_worded
from motionloom_lab.suites.harness import weight_marks

OBJECTS = {"throw": " a ball", "punch": " the bag"}
SECONDS, FIRST_SEED = 4.0, 500
PHRASED = (
    "a child sits on the floor",
    "standing on the left leg, he pulls his right knee up to hip height",
    "she draws her left knee up to the chest",
    "walk ahead, then take a right at the corner",
    "a cyclist hangs a left",
    "a guard reverses direction",
    "a sunbather rests motionless on her back",
    "a guy takes a nap",
    "grandpa goes to sleep",
    "the baby falls asleep",
    "he hits the deck",
    "she stretches out on the bed",
    "get out of your seat and stand upright",
    "a man makes his way across the room",
    "she heads to the door",
    "an old man heads for the bus stop",
    "she slams on the brakes and stops walking",
    "toddler crawling backward on her hands and knees",
)
"""Sentences that have a phrase of the table."""


def print_table(
    prior: Prior, lines: Sequence[tuple[str, str]], kind: str, *, seconds: float | None, seeds: int
) -> None:
    """Print a line for each of some names with a sentence, and the means."""
    table = []
    for name, text in lines:
        row, replaced = [], 0.0
        for literal in (True, False):
            motions = generate_worded(prior, text, seconds=seconds, count=seeds, seed=FIRST_SEED, literal=literal)
            row += [np.mean([not one.missing for one in motions])]
            row += [np.mean([rest(one.motion.positions(), one.motion.fps) for one in motions])]
            replaced = np.mean([bool(one.replaced) for one in motions])
        table.append([row[0], row[2], row[1], row[3], replaced])
        print(" ".join(f"{number:.2f}" for number in table[-1]), name, flush=True)
    mean = np.mean(table, axis=0)
    print(f"\n{len(table)} {kind}: shown {mean[0]:.1%} as written, {mean[1]:.1%} by generate")
    print(f"at rest {mean[2]:.0%} as written, {mean[3]:.0%} by generate")
    print(f"replaced in {mean[4]:.0%} of the motions\n")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    third = {base: form for form, base in MOODS["third"].items()}
    print("shown: as written, by generate | at rest: as written, by generate | replaced | verb")
    verbs = [
        (f"{rare} ({common})", f"a person {third[rare]}{OBJECTS.get(common, '')}")
        for rare, common in sorted(PLAINER.items())
    ]
    print_table(prior, verbs, "verbs", seconds=SECONDS, seeds=arguments.seeds)
    print_table(prior, [(text, text) for text in PHRASED], "sentences", seconds=None, seeds=arguments.seeds)
    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    print(f"Weights: {name} {mark}")


if __name__ == "__main__":
    main()
