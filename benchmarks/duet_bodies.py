"""How near two people's bodies come: the table of `duet_bodies.txt`.

Five prompts, seeds 0 to 4, six seconds each, with the weights that come with the package.
"""

import numpy as np

from motionloom import Prior
from motionloom.kinematics.capsules import overlap, trunk_distance
from motionloom.kinematics.physics import WRISTS
from motionloom.retarget import joints22
from motionloom.tasks.pair import generate_pair
from motionloom.weights.container import PAIRS, PRIORS, weights_digest
from motionloom.weights.pair import PairBlock

PROMPTS = ("fight", "dance salsa together", "shake hands", "hug", "walk side by side")
SEEDS = range(5)


def main() -> None:
    prior = Prior.load()
    block = PairBlock.load("duet", prior)
    print("seeds 0 to 4 together; cm; inside: share of frames with an overlap above 2 cm")
    print(f"{'two people ...':<22}{'trunks median':>14}{'least':>7}{'deepest':>9}{'inside %':>10}{'wrists least':>14}")
    for words in PROMPTS:
        trunks, depths, wrists = [], [], []
        for seed in SEEDS:
            [duet] = generate_pair(prior, block, f"two people {words}", seed=seed)
            first, second = (joints22(person) for person in duet)
            trunks.append(trunk_distance(first, second))
            depths.append(overlap(first, second))
            hands = [one[:, list(WRISTS)] for one in (first, second)]
            apart = np.linalg.norm(hands[0][:, :, None] - hands[1][:, None], axis=-1)
            wrists.append(apart.min(axis=(1, 2)))
        trunk, depth, hand = (100 * np.concatenate(each) for each in (trunks, depths, wrists))
        print(
            f"{words:<22}{np.median(trunk):>14.0f}{trunk.min():>7.0f}{depth.max():>9.1f}"
            f"{100 * (depth > 2).mean():>10.0f}{hand.min():>14.0f}"
        )
    files = {"default": PRIORS.shipped()["default"], "duet": PAIRS.shipped()["duet"]}
    marks = [f"{name} {weights_digest(path)[:12]}" for name, path in files.items()]
    print(f"\nWeights: {', '.join(marks)}")


if __name__ == "__main__":
    main()
