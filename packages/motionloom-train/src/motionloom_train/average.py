"""The mean of two priors, the second of which was trained on from the first (as WiSE-FT, Wortsman et al. 2022).

    python -m motionloom_train.average BEFORE.safetensors AFTER.safetensors OUT.safetensors [--share 0.5]

The card of the file, the standardisation, the text encoder and the table of sentences are those of AFTER.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior, save_prior


def averaged(before: Prior, after: Prior, share: float) -> Prior:
    """``share`` of ``after`` and the rest of ``before``. Raises `MotionloomError` where their weights do not fit."""
    same = np.array_equal(before.mean, after.mean) and np.array_equal(before.std, after.std)
    if before.net.config != after.net.config or not same:
        raise MotionloomError(
            "the two are of different networks or standardisations; only stages of one can be averaged"
        )
    if not 0 <= share <= 1:
        raise MotionloomError(f"the share must be from 0 to 1; got {share}")
    old, new = before.net.weights, after.net.weights
    weights = {
        name: ((1 - share) * old[name].astype(np.float64) + share * new[name]).astype(np.float32) for name in new
    }
    notes = {
        **after.card.notes,
        "average": f"{1 - share:g} of the weights it began with, {share:g} of those it ended with",
    }
    return replace(after, net=replace(after.net, weights=weights), card=replace(after.card, notes=notes))


def main() -> int:
    """Average and write."""
    parser = argparse.ArgumentParser(description="The mean of two priors, of which one began with the other.")
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--share", type=float, default=0.5)
    options = parser.parse_args()
    try:
        both = averaged(Prior.load(options.before), Prior.load(options.after), options.share)
        print(save_prior(both, options.out))
    except MotionloomError as error:
        print(f"motionloom: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
