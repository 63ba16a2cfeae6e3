"""Numbers in the words of `generate`: what is asked and what is drawn, 12 sentences on 5 seeds.

Usage: python benchmarks/read_words.py > benchmarks/read_words.txt
"""

import numpy as np

from motionloom.goals.amount_goal import measured
from motionloom.goals.amounts import Amount, read_amount
from motionloom.goals.timeline import timeline_of
from motionloom.lab.suites.harness import weight_marks
from motionloom.tasks.control import control
from motionloom.tasks.text import generate
from motionloom.weights.prior import Prior, find_weights

SENTENCES = (
    "turn left 90 degrees",
    "a person turns right 90 degrees",
    "a man rotates 45 degrees clockwise",
    "a person makes a half turn to the left",
    "a person walks 3 meters forward",
    "a woman walks slowly 2 meters backwards",
    "a man runs 10 meters",
    "a person sidesteps 2 meters to the left",
    "take three steps forward and stop",
    "a person walks five steps",
    "a person takes two steps back",
    "a person walks backwards in a half circle to the right",
)
SEEDS = range(5)


def steps_of(positions: np.ndarray) -> int:
    """How often a foot is lifted and put down 15 cm or more from where it stood (frames, 22, 3), metres."""
    count = 0
    for foot in (10, 11):
        place = positions[:, foot][:, [0, 2]]
        still = np.linalg.norm(np.gradient(place, axis=0), axis=-1) * 20 < 0.35
        stood = place[0]
        for frame in np.flatnonzero(still):
            if np.linalg.norm(place[frame] - stood) > 0.15:
                count += 1
                stood = place[frame]
    return count


def kept(amount: Amount, size: float, got: float, steps: int) -> bool:
    """Whether a motion does what was read: a turn within a ninth, a way within a tenth, steps to the number."""
    if amount.kind == "steps":
        return steps == amount.size
    return abs(got / size - 1) <= (1 / 9 if amount.kind in ("turn", "arc") else 0.1)


def main() -> None:
    """Print a line for each sentence: with its goal, and as the network draws it alone."""
    prior = Prior.load("default")
    print("sentence | asked | with the goal, seeds 0 to 4 (steps) | kept | without: 5 s | kept")
    for text in SENTENCES:
        (segment,) = timeline_of(text, amounts=True).segments
        amount = read_amount(text)
        assert amount is not None
        assert segment.goal is not None
        with_goal = [control(prior, text, segment.goal, seed=seed)[0].motion for seed in SEEDS]
        without = [generate(prior, text, seed=seed)[0] for seed in SEEDS]
        size = amount.size if amount.kind in ("turn", "arc") else amount.metres
        cells = []
        for motions in (with_goal, without):
            places = [motion.positions() for motion in motions]
            got = [(measured(amount, one), steps_of(one)) for one in places]
            digits = 0 if amount.kind in ("turn", "arc") else 2
            cells.append(", ".join(f"{value:.{digits}f} ({steps})" for value, steps in got))
            cells.append(f"{sum(kept(amount, size, *one) for one in got)} of {len(got)}")
        print(f"{text} | {amount}: {size:.2f}, {segment.seconds:g} s | {' | '.join(cells)}", flush=True)
    [(name, mark)] = weight_marks([find_weights("default")]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
