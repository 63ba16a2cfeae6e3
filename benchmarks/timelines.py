"""Timelines of three blocks: how many blocks obey their words as sampled, and after attempts at those that do not.

    python benchmarks/timelines.py [--words benchmarks/everyday_fifth.toml] [--takes 2] [--weights default]

The sentences of a wording of the everyday checks that are one action are shuffled and composed, three by three. A block
is judged alone by the laboratory's check of its sentence (`motionloom evaluate obedience`), which the attempts do not
know; they are kept or not by `motionloom.goals.expected`. `others` are the blocks that were not sampled again: their
seams were, where a neighbour was. `m/s` is the largest speed of a joint within 0.1 s of a seam, averaged over seams.
"""

import argparse
import random
import time
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np

from motionloom.core.models.prior import Prior, find_weights
from motionloom.core.motion import Motion
from motionloom.goals.segment import Segment
from motionloom.goals.sequence import split_actions, usual_seconds
from motionloom.kinematics.physics import Array
from motionloom.requests.sampling import Sampling
from motionloom.tasks.long import compose_takes
from motionloom.tasks.reattempts import reattempt
from motionloom.tasks.redraw import Timed
from motionloom_lab.metrics.obedience import Check, chosen, in_words
from motionloom_lab.suites.harness import weight_marks

BLOCKS, FIRST_SEED, SHUFFLED = 3, 300, 7


def timelines(path: Path) -> list[list[tuple[Check, Segment]]]:
    """Sentences of one action and their checks, in threes."""
    blocks = []
    for check in in_words(chosen("everyday"), path):
        text = check.prompt
        if len(split_actions(text)) == 1:
            seconds = max(round(usual_seconds(text) * 20) / 20, 2.0)
            blocks.append((check, Segment(text, seconds)))
    random.Random(SHUFFLED).shuffle(blocks)
    return [blocks[i : i + BLOCKS] for i in range(0, len(blocks) - BLOCKS + 1, BLOCKS)]


def cut(motion: Motion, segments: list[Segment]) -> list[Array]:
    """The positions in each block."""
    ends = list(accumulate(round(one.seconds * motion.fps) for one in segments))
    return np.split(motion.positions(), ends[:-1])


def at_seams(parts: list[Array], fps: float) -> list[float]:
    """The largest speed of a joint around each seam, m/s."""
    near = [np.concatenate([one[-2:], other[:2]]) for one, other in pairwise(parts)]
    return [float(np.linalg.norm(np.diff(one, axis=0), axis=-1).max() * fps) for one in near]


def main() -> None:
    """Print a line for each timeline, and the means."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--words", type=Path, default=Path(__file__).with_name("everyday_fifth.toml"))
    parser.add_argument("--takes", type=int, default=2)
    parser.add_argument("--weights", default="default")
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    rows, seams = [], []
    sampling_seconds = attempt_seconds = 0.0
    for blocks in timelines(arguments.words):
        checks, segments = [check for check, _ in blocks], [segment for _, segment in blocks]
        sampling = Sampling(seed=FIRST_SEED, count=arguments.takes)
        began = time.perf_counter()
        motions = list(compose_takes(prior, segments, sampling=sampling))
        sampling_seconds += time.perf_counter() - began
        for own, motion in zip(sampling.each(), motions, strict=True):
            began = time.perf_counter()
            found = reattempt(Timed(prior, segments, None, own), motion, range(len(segments)))
            attempt_seconds += time.perf_counter() - began
            parts = [cut(one, segments) for one in (motion, found.motion)]
            for i, (check, before, after) in enumerate(zip(checks, *parts, strict=True)):
                obeyed = [check.obeyed(check.measured(one, motion.fps)) for one in (before, after)]
                rows.append((*obeyed, i in found.again))
                marks = ["obeyed" if one else "-" for one in obeyed]
                print(*marks, "again" if i in found.again else "", check.prompt, sep="\t", flush=True)
            seams.append([np.mean(at_seams(one, motion.fps)) for one in parts])
    table, joints = np.array(rows, dtype=float), np.mean(seams, axis=0)
    again = table[:, 2] > 0
    print(f"\n{len(table)} blocks: obeyed {table[:, 0].mean():.1%} as sampled, {table[:, 1].mean():.1%} after attempts")
    print(f"{again.sum()} sampled again: {table[again, 0].mean():.1%}, {table[again, 1].mean():.1%}")
    print(f"{(~again).sum()} others: {table[~again, 0].mean():.1%}, {table[~again, 1].mean():.1%}")
    print(f"at seams {joints[0]:.2f} m/s, {joints[1]:.2f} m/s")
    print(f"attempts took {attempt_seconds / sampling_seconds:.1f} times as long as sampling did")
    [(name, mark)] = weight_marks([find_weights(arguments.weights)]).items()
    print(f"Weights: {name} {mark}")


if __name__ == "__main__":
    main()
