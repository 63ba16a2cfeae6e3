"""How near two people's bodies come: the table of `duet_bodies.txt`.

Eight prompts, seeds 0 to 2, six seconds each, with the weights that come with the package: as the network alone draws
them, and with bodies kept apart and hands brought together.
"""

from collections.abc import Sequence

import numpy as np

from motionloom import Motion, Prior
from motionloom.core.models.container import PAIRS, PRIORS, weights_digest
from motionloom.core.models.pair import PairBlock
from motionloom.kinematics.capsules import overlap, trunk_distance, wrist_distance
from motionloom.kinematics.physics import foot_skate
from motionloom.tasks.pair import generate_pair

PROMPTS = (
    "two people fight",
    "two people dance salsa together",
    "two people shake hands",
    "two people hug",
    "two people give each other a high five",
    "two people walk holding hands",
    "one person pushes the other",
    "one person bows and the other waves",
)
SEEDS = range(3)
HEAD = ("trunks", "least", "deepest", "inside %", "wrists", "feet")


def main() -> None:
    prior = Prior.load()
    block = PairBlock.load("duet", prior)
    print("seeds 0 to 2 together, cm; trunks: median distance; inside: frames with an overlap above 2 cm;")
    print("wrists: least distance, mean of seeds; feet: speed of toes below 5 cm, cm/s")
    print(f"{'':<50}" + "".join(f"{name:>9}" for name in HEAD))
    for words in PROMPTS:
        for name, bodies in (("alone", False), ("kept apart", True)):
            duets = [generate_pair(prior, block, words, seed=seed, bodies=bodies)[0] for seed in SEEDS]
            row = "".join(f"{value:>9.1f}" for value in measured(duets))
            print(f"{words if not bodies else '':<39}{name:<11}{row}", flush=True)
    files = {"default": PRIORS.shipped()["default"], "duet": PAIRS.shipped()["duet"]}
    marks = [f"{name} {weights_digest(path)[:12]}" for name, path in files.items()]
    print(f"\nWeights: {', '.join(marks)}")


def measured(duets: Sequence[tuple[Motion, Motion]]) -> list[float]:
    """The numbers of `HEAD`."""
    places = [(first.positions(), second.positions()) for first, second in duets]
    trunks = np.concatenate([trunk_distance(*pair) for pair in places])
    depths = np.concatenate([overlap(*pair) for pair in places])
    wrists = np.mean([wrist_distance(*pair).min() for pair in places])
    feet = np.mean([foot_skate(person, duets[0][0].fps).contact_speed for pair in places for person in pair])
    inside = 100 * float((depths > 0.02).mean())
    lengths = [100 * float(value) for value in (np.median(trunks), trunks.min(), depths.max())]
    return [*lengths, inside, 100 * float(wrists), float(feet)]


if __name__ == "__main__":
    main()
