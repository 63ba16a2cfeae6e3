"""Numbers in the words: what is asked and what is drawn, some sentences on 5 seeds, and the same without reading.

Usage: python benchmarks/read_words.py > benchmarks/read_words.txt
"""

import sys

from motionloom.core.models.prior import Prior, find_weights
from motionloom.goals.amounts import is_met, measured
from motionloom.tasks.text import generate
from motionloom.tasks.worded import generate_timelines, read
from motionloom_lab.suites.harness import weight_marks

SENTENCES = (
    "turn left 90 degrees",
    "a person turns right 90 degrees",
    "a man rotates 45 degrees clockwise",
    "a person makes a half turn to the left",
    "a person walks 3 meters forward",
    "a woman walks slowly 2 meters backwards",
    "a man runs 10 meters",
    "a person sidesteps 2 meters to the left",
    "a person walks backwards in a half circle to the right",
    "take three steps forward and stop",
    "a person walks five steps",
    "a person takes two steps back",
    "a person takes two steps to the left",
    "a person jumps twice",
    "jump three times",
    "hops twice on the right foot",
    "does three squats",
    "kicks twice",
    "a person bows twice",
    "a boxer punches three times",
    "a person does five jumping jacks",
    "claps four times",
)
SEEDS = range(5)


def main() -> None:
    """Print a line for each sentence: what is drawn of it, and what the network draws alone."""
    prior = Prior.load("default")
    print("sentence | asked | drawn, seeds 0 to 4 | kept | without reading: usual length | kept")
    for text in sys.argv[1:] or SENTENCES:
        asked = read(prior, text)
        (reading,) = asked.readings
        amount = reading.amount
        with_it = [next(iter(generate_timelines(prior, [asked], seeds=[seed]))) for seed in SEEDS]
        without = [generate(prior, text, seed=seed, literal=True)[0] for seed in SEEDS]
        alone = [measured(amount, motion.positions(), motion.fps) for motion in without]
        lines = [
            ([one.amounts[0].measured for one in with_it], [one.amounts[0].kept for one in with_it]),
            (alone, [is_met(amount, size) for size in alone]),
        ]
        digits = 2 if amount.unit == "m" else 0
        cells = [
            f"{', '.join(f'{size:.{digits}f}' for size in sizes)} | {sum(good)} of {len(good)}" for sizes, good in lines
        ]
        print(f"{text} | {amount}, {asked.seconds:g} s | {' | '.join(cells)}", flush=True)
    [(name, mark)] = weight_marks([find_weights("default")]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
