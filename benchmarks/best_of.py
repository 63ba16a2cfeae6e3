"""What choosing the best of several costs: times of `generate(..., best_of=N)` as multiples of the usual one.

    python benchmarks/best_of.py > benchmarks/best_of.txt

Medians of five, each beside the usual one in the same turn, on an idle machine.
"""

import statistics
import time

from motionloom.core.models.prior import Prior, find_weights
from motionloom.tasks.text import generate
from motionloom_lab.suites.harness import weight_marks

TIMES = 5


def seconds(prior: Prior, count: int, best_of: int) -> float:
    """Of making so many motions of 9.8 s."""
    start = time.perf_counter()
    generate(prior, "a person walks", seconds=9.8, count=count, best_of=best_of)
    return time.perf_counter() - start


def main() -> None:
    """Print a line for each."""
    prior = Prior.load()
    seconds(prior, 1, 1)
    print("motions of 9.8 s, seconds in all, as a multiple of best_of=1")
    for count in (1, 8):
        for best_of in (2, 4, 8):
            pairs = [(seconds(prior, count, 1), seconds(prior, count, best_of)) for _ in range(TIMES)]
            usual, best = (statistics.median(times) for times in zip(*pairs, strict=True))
            print(f"{count} motion(s), best of {best_of}: {best:.2f} s, {best / usual:.2f} times")
    [(name, mark)] = weight_marks([find_weights("default")]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
