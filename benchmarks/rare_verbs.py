"""Verbs that the weights have seldom read: how often the network's own motion shows them, and what `generate` writes.

    python benchmarks/rare_verbs.py [--seeds 10] [--weights default]

Of each verb in `[plainer]` of motionloom/goals/verbs.toml "a person VERBs" is generated for four seconds, with and
without `literal`. `shown`: the share of motions in which nothing is missing of what the common verb says plainly
(`motionloom.goals.expected`, by which `generate` also chooses, so these shares judge the words, not the motion; they
were looked at when verbs were chosen). `at rest`: the share of frames in which no joint is faster than 0.2 m/s.
"""

import argparse

import numpy as np
from lengths import rest

from motionloom.goals.expected import missing
from motionloom.goals.verbs import MOODS, PLAINER, in_plainer_words
from motionloom.tasks.worded import generate_worded
from motionloom.weights.prior import Prior, find_weights
from motionloom_lab.suites.harness import weight_marks

OBJECTS = {"throw": " a ball", "punch": " the bag"}
SECONDS, FIRST_SEED = 4.0, 500


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    third = {base: form for form, base in MOODS["third"].items()}
    table = []
    print("shown: as written, by generate | at rest: as written, by generate | replaced | verb")
    for rare, common in sorted(PLAINER.items()):
        text = f"a person {third[rare]}{OBJECTS.get(common, '')}"
        row, replaced = [], 0.0
        for literal in (True, False):
            motions = generate_worded(
                prior, text, seconds=SECONDS, count=arguments.seeds, seed=FIRST_SEED, literal=literal
            )
            places = [(one.motion.positions(), one.motion.fps) for one in motions]
            row += [
                np.mean([not missing(in_plainer_words(text), *one) for one in places]),
                np.mean([rest(*one) for one in places]),
            ]
            replaced = np.mean([bool(one.replaced) for one in motions])
        table.append([row[0], row[2], row[1], row[3], replaced])
        print(" ".join(f"{number:.2f}" for number in table[-1]), f"{rare} ({common})", flush=True)
    mean = np.mean(table, axis=0)
    print(f"\n{len(table)} verbs: shown {mean[0]:.1%} as written, {mean[1]:.1%} by generate")
    print(f"at rest {mean[2]:.0%} as written, {mean[3]:.0%} by generate")
    print(f"replaced in {mean[4]:.0%} of the motions")
    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
