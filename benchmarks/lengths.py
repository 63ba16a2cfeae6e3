"""How long a sentence should be that says no length: obedience and rest at 5 s and at its usual length, and of people.

    python benchmarks/lengths.py SET [--seeds 6] [--weights default]

SET is what `motionloom data build` made. The 87 everyday prompts and their other words are generated (`generate`, from
seed 100 on) at 5 s and without a length. `obeyed` is the share that obeys, `at rest` the share of frames in which no
joint is faster than 0.2 m/s. Recordings of the same actions (those that the checks are tried on, 20 s at most) have
theirs beside it where there are three or more.
"""

import argparse
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from motionloom.core.models.prior import Prior, find_weights
from motionloom.goals.sequence import split_actions, usual_seconds
from motionloom.goals.verbs import base_of, kind_of_verb
from motionloom.kinematics.physics import Array, smooth, velocity
from motionloom.tasks.text import generate
from motionloom_lab.metrics.obedience import EVERYDAY
from motionloom_lab.suites.harness import weight_marks
from motionloom_lab.suites.items import real_clips
from motionloom_lab.suites.trial import text_of, trials

FIXED, LEAST, LONGEST = 5.0, 3, 400
SLOW = 0.2


def rest(positions: Array, fps: float) -> float:
    """The share of frames in which no joint is faster than `SLOW` metres per second."""
    speed = np.linalg.norm(smooth(velocity(positions, fps), 3), axis=-1)
    return float((speed.max(axis=1) < SLOW).mean())


def of_recordings(folder: Path) -> dict[str, float]:
    """The mean share of rest per check, of the recordings that show its action."""
    shares, tried = defaultdict(list), trials()
    for clip in real_clips(folder):
        if not clip.captions or not 20 <= len(clip.positions) <= LONGEST:
            continue
        text = text_of(clip)
        for name, one in tried.items():
            if re.search(one.shows, text) and not re.search(one.unless, text):
                first, last = (round(share * len(clip.positions)) for share in one.cut or (0.0, 1.0))
                shares[name].append(rest(np.asarray(clip.positions[first:last], dtype=np.float64), 20.0))
    return {name: float(np.mean(each)) for name, each in shares.items() if len(each) >= LEAST}


def kind(text: str) -> str:
    """What is in the sentence: several actions, or the kind of its first verb."""
    if len(split_actions(text)) > 1:
        return "several"
    words = text.lower()
    return next((kind_of_verb(word, words) for word in re.findall("[a-z]+", words) if base_of(word)), "other")


def rows(prior: Prior, seeds: int, real: dict[str, float]) -> Iterator[tuple[str, list[float]]]:
    """The kind of each sentence, and obeyed and at rest at both lengths, seconds, and rest of recordings or nan."""
    for check in EVERYDAY:
        for text in (check.prompt, *check.paraphrases):
            numbers = []
            for seconds in (FIXED, None):
                motions = [
                    (one.positions(), one.fps) for one in generate(prior, text, seconds=seconds, count=seeds, seed=100)
                ]
                numbers += [np.mean([check.obeyed(check.measured(*one)) for one in motions])]
                numbers += [np.mean([rest(*one) for one in motions])]
            numbers += [usual_seconds(text), real.get(check.name, np.nan)]
            print(" ".join(f"{number:.2f}" for number in numbers), text, flush=True)
            yield kind(text), numbers


def main() -> None:
    """Measure what the line asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    measured = list(rows(prior, arguments.seeds, of_recordings(arguments.set)))
    print("\nsentences of | number | obeyed at 5 s, usual | at rest at 5 s, usual")
    for name in (*sorted({kind for kind, _ in measured}), "all"):
        some = np.array([numbers for kind, numbers in measured if name in (kind, "all")])
        fixed, still, usual, still_usual = some[:, :4].mean(axis=0)
        print(f"{name} | {len(some)} | {fixed:.1%}, {usual:.1%} | {still:.1%}, {still_usual:.1%}")
    known = np.array([numbers for _, numbers in measured if np.isfinite(numbers[-1])])
    print(
        f"\nat rest where recordings are known ({len(known)} sentences): recordings {known[:, 5].mean():.1%}, "
        f"at 5 s {known[:, 1].mean():.1%}, usual {known[:, 3].mean():.1%}"
    )
    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
