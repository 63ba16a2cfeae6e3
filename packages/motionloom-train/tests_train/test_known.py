"""The table of what a training set teaches."""

import torch

from motionloom_train.data.sets import Item, MotionSet
from motionloom_train.prior import known_table
from tests.recorded import tiny


def motions(*items: Item, texts: tuple[str, ...]) -> MotionSet:
    empty = torch.zeros(400, 263)
    return MotionSet(empty, empty[0], empty[0], items, texts, ("free",), 1.0)


def test_seconds_are_those_of_frames_not_of_items() -> None:
    """Frames 0 to 60 and 40 to 100 of one action are 100 frames, 5 s at 20 a second."""
    items = (Item(0, 60, "walk", (0,)), Item(40, 60, "walk", (0,)), Item(200, 20, "sit", (1,)))
    known = known_table(motions(*items, texts=("a person walks", "a person turns")), tiny.text())
    assert known.seconds == {"walk": 5.0, "sit": 1.0}
    assert list(known.seconds) == ["walk", "sit"]  # the most seen action first


def test_captions_are_listed_last_and_by_what_they_are() -> None:
    items = (Item(0, 300, "human", (0,)), Item(0, 20, "sit", (1,)))
    known = known_table(motions(*items, texts=("a person walks", "a person turns")), tiny.text())
    assert list(known.seconds) == ["sit", "captions that people wrote"]


def test_every_action_has_a_sentence() -> None:
    items = tuple(Item(20 * i, 20, f"action {i}", (i,)) for i in range(4))
    texts = ("walks", "turns left", "turns right", "stands")
    known = known_table(motions(*items, texts=texts), tiny.text())
    assert set(known.sentences) == set(texts)
