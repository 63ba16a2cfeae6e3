"""What a training set teaches, in words: the table that goes into the weight file."""

import numpy as np

from motionloom.features.layout import FPS
from motionloom.runtime.text.known import Known, known_sentences
from motionloom.runtime.text.protocol import TextEncoder
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.sets import MotionSet

WRITTEN = {"human": "captions that people wrote", "index": "descriptions of the collections"}
"""What the table calls the groups of items that are no single action."""


def known_table(motions: MotionSet, encoder: TextEncoder) -> Known:
    """The table of a set's sentences and of the seconds of each of its actions (groups of items).

    A named action and a measured label of one name are one action. Each is in the table with at least one sentence.
    Frames that several items of an action share count once; mirrored and other made copies count as more motion.
    """
    frames: dict[str, list[tuple[int, int]]] = {}
    texts: dict[str, dict[int, None]] = {}
    for item in motions.items:
        name = item.group.removeprefix(PREFIX)
        frames.setdefault(name, []).append((item.start, item.start + item.frames))
        texts.setdefault(name, {}).update(dict.fromkeys(item.texts))
    seconds = {group: _covered(spans) / FPS for group, spans in frames.items()}
    listed = sorted(seconds, key=lambda group: (group in WRITTEN, -seconds[group], group))
    numbers = dict.fromkeys(number for group in listed for number in texts[group])
    return known_sentences(
        [motions.texts[number] for number in numbers],
        {WRITTEN.get(g, g): seconds[g] for g in listed},
        encoder,
        first=[motions.texts[next(iter(texts[group]))] for group in listed if texts[group]],
    )


def _covered(spans: list[tuple[int, int]]) -> int:
    """Frames in the union of half-open spans."""
    covered, reached = 0, 0
    for first, last in np.array(sorted(spans)):
        covered += max(0, int(last) - max(int(first), reached))
        reached = max(reached, int(last))
    return covered
