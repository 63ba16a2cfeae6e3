"""Does who is asked to limp limp? A classifier of manners, and the share of generated motions it sees the manner in.

Windows of four seconds become numbers (`data.manner_measures`), of which left and right are exchanged where the right
side moves less, so that a limp is a limp whichever leg it is; a softmax regression over the numbers and their squares
learns the manners from the made clips of a built set, and *plain* from its recordings. People whose numbers it never
saw say how often it is right.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.reading import read_table
from motionloom.kinematics.physics import Array
from motionloom_lab.suites.harness import Generate
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.clips import MANNER, Clip
from motionloom_train.data.manner_measures import measure
from motionloom_train.data.mannered import BODIES, is_plain, person_of
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.sets import read_clips

PLAIN = "plain"
KEPT_OUT = ("07", "16", "35", "accad_Male2")
"""People whose clips are not learned from."""
WINDOW, EVERY, SHORTEST = 80, 40, 50
"""Frames of a window, from one to the next, and of a clip that is shorter."""
STEPS, RATE, DECAY = 600, 0.03, 3e-3
"""Of the optimiser (Adam over all windows at once), and how weights are kept small."""
_ANGLE_OF_SIDE = ("elbow", "hand_up", "hand_ahead", "hand_out", "swing", "hand_moves")
_LEG = ("stance", "toe_lift", "ankle_lift", "thigh", "heel", "swing_knee", "stance_knee")
ALIKE = {"stagger": "drunk", "drunk": "stagger", "strut": "proud", "proud": "strut", "sad": "trudge", "trudge": "sad"}
"""Manners that people confuse too: the report counts them apart."""


def numbers_of(places: Array) -> Array:
    """(measures,) of one window (frames, 22, 3) metres at 20 frames per second; the same for its mirror image."""
    found = measure(places, FPS)
    for names, first in (
        (_LEG, found["stance_l"] > found["stance_r"]),
        (_ANGLE_OF_SIDE, found["elbow_l"] > found["elbow_r"]),
    ):
        for name in names:
            pair = (found.pop(f"{name}_l"), found.pop(f"{name}_r"))
            found[f"{name}_1"], found[f"{name}_2"] = pair if first else pair[::-1]
    for name in ("roll", "knee_gap"):
        found[name] = abs(found[name])
    found["stance_ratio"] = found["stance_short"]
    return np.array([found[name] for name in sorted(found)])


def windows_of(places: Array) -> list[Array]:
    """The stretches of a motion that are judged."""
    if len(places) < WINDOW:
        return [places] if len(places) >= SHORTEST else []
    return [places[k : k + WINDOW] for k in range(0, len(places) - WINDOW + 1, EVERY)]


@dataclass(frozen=True, eq=False)
class Classifier:
    """A softmax regression over standardised numbers and their squares."""

    names: tuple[str, ...]
    """Manners, and `PLAIN`."""
    mean: Array
    std: Array
    weights: Array
    """(1 + 2 measures, names)."""

    def chances(self, numbers: Array) -> Array:
        """(windows, names) of (windows, measures)."""
        return _softmax(_inputs(numbers, self.mean, self.std) @ self.weights)

    def name(self, places: Array) -> str:
        """The manner of a motion (frames, 22, 3) metres at 20 frames per second: the likeliest over its windows."""
        numbers = np.stack([numbers_of(window) for window in windows_of(places) or [places]])
        return self.names[int(np.log(self.chances(numbers) + 1e-6).mean(axis=0).argmax())]


def _inputs(numbers: Array, mean: Array, std: Array) -> Array:
    z = ((numbers - mean) / std).clip(-4, 4)
    return np.concatenate([np.ones((len(z), 1)), z, z**2 / 4], axis=1)


def _softmax(logits: Array) -> Array:
    raised = np.exp(logits - logits.max(axis=1, keepdims=True))
    return raised / raised.sum(axis=1, keepdims=True)


def learn(numbers: Array, names: Sequence[str]) -> Classifier:
    """The classifier of windows (windows, measures) with their manners; every manner counts the same."""
    known = tuple(sorted(set(names)))
    labels = np.array([known.index(name) for name in names])
    mean, std = numbers.mean(axis=0), numbers.std(axis=0).clip(1e-6)
    x, target = _inputs(numbers, mean, std), np.eye(len(known))[labels]
    share = (1 / np.bincount(labels))[labels] / len(known)
    weights = np.zeros((x.shape[1], len(known)))
    first, second = np.zeros_like(weights), np.zeros_like(weights)
    for step in range(1, STEPS + 1):
        slope = x.T @ (share[:, None] * (_softmax(x @ weights) - target)) + DECAY * weights
        first, second = 0.9 * first + 0.1 * slope, 0.99 * second + 0.01 * slope**2
        weights = weights - RATE * first / (1 - 0.9**step) / (np.sqrt(second / (1 - 0.99**step)) + 1e-8)
    return Classifier(known, mean, std, weights)


@dataclass(frozen=True, eq=False)
class Example:
    """A window whose manner is known."""

    name: str
    person: str
    clip: str
    numbers: Array


def examples(clips: Sequence[Clip]) -> list[Example]:
    """Windows of made clips and of recordings in no manner."""
    result = []
    for clip in clips:
        name = next(
            (n.kind.removeprefix(PREFIX + MANNER) for n in clip.notes if n.kind.startswith(PREFIX + MANNER)), ""
        )
        if name:
            spans = [(0, len(clip.features))]
        elif clip.way == "plain" and clip.split == "train" and is_plain(clip):
            kinds = {kind for labels in BODIES.values() for kind in labels} | {"stand"}
            spans = [(n.first, min(n.last, n.first + 160)) for n in clip.notes if n.kind in kinds]
        else:
            continue
        for first, last in spans:
            for window in windows_of(clip.positions(first, last)):
                result.append(Example(name or PLAIN, person_of(clip.name), clip.name, numbers_of(window)))
    return result


def trained(folder: Path | str, progress: Say = silent) -> tuple[Classifier, dict[str, Any]]:
    """The classifier of a built set, and what it says of people it did not see; MotionloomError without manners."""
    found = examples(read_clips(folder))
    if len({one.name for one in found}) < 2:
        raise MotionloomError(f"{folder} has no made manners; build it again with `motionloom data build`")
    seen = [one for one in found if one.person not in KEPT_OUT]
    others = [one for one in found if one.person in KEPT_OUT]
    progress(f"{len(seen)} windows to learn from, {len(others)} of people who are kept out")
    classifier = learn(np.stack([one.numbers for one in seen]), [one.name for one in seen])
    return classifier, judged(classifier, others)


def judged(classifier: Classifier, some: Sequence[Example]) -> dict[str, Any]:
    """How often clips are called what they are: by manner, in total, and what they are called."""
    clips: dict[str, list[Example]] = {}
    for one in some:
        clips.setdefault(one.clip, []).append(one)
    table: dict[str, Counter[str]] = {}
    for windows in clips.values():
        chances = classifier.chances(np.stack([one.numbers for one in windows]))
        said = classifier.names[int(np.log(chances + 1e-6).mean(axis=0).argmax())]
        table.setdefault(windows[0].name, Counter())[said] += 1
    return summary(table)


def summary(table: dict[str, Counter[str]]) -> dict[str, Any]:
    """Counts by what was asked and what was seen, with the shares that are right."""
    tried = sum(sum(row.values()) for row in table.values())
    right = sum(row[name] for name, row in table.items())
    near = right + sum(row[ALIKE[name]] for name, row in table.items() if name in ALIKE)
    return {
        "tried": tried,
        "right": right,
        "right_or_alike": near,
        "table": {name: dict(row.most_common()) for name, row in sorted(table.items())},
    }


def sentences() -> dict[str, list[str]]:
    """Sentences by the manner that they ask for; none of them is a caption."""
    return read_table("motionloom_lab.suites", "manners.toml")


def judge_motions(
    generate: Generate,
    classifier: Classifier,
    *,
    seeds: int,
    seed: int = 0,
    only: Sequence[str] = (),
    progress: Say = silent,
) -> dict[str, Any]:
    """What is seen in motions of every sentence on so many seeds, as `summary` says it."""
    table: dict[str, Counter[str]] = {}
    for name, prompts in sentences().items():
        if only and name not in only:
            continue
        row = table.setdefault(name, Counter())
        motions, fps = generate([text for text in prompts for _ in range(seeds)], seconds=6.0, seed=seed)
        if round(fps) != FPS:
            raise MotionloomError(f"manners are judged at {FPS} frames per second; these weights draw {fps:g}")
        row.update(classifier.name(motion) for motion in motions)
        progress(f"{name}: {row[name]} of {sum(row.values())}")
    return summary(table)


def rows(found: dict[str, Any]) -> list[list[str]]:
    """Table of text: the manner, how often it is seen, and what is seen instead; the heading first."""
    result = [["manner", "seen", "instead"]]
    for name, row in found["table"].items():
        others = ", ".join(f"{other} {count}" for other, count in row.items() if other != name)
        result.append([name, f"{row.get(name, 0)} of {sum(row.values())}", others])
    return result


def line(found: dict[str, Any]) -> str:
    """The shares in words."""
    tried = max(found["tried"], 1)
    return f"{found['right'] / tried:.0%} of {found['tried']} ({found['right_or_alike'] / tried:.0%} with alike ones)"
