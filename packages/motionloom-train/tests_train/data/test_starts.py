"""Where windows may begin: at rest and in a steady gait, not in the air, in a stroke or shortly before a stop."""

import numpy as np
import pytest
import torch

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS, WIDTH
from motionloom_train.data.batches import ABRUPT, Batches
from motionloom_train.data.sets import Item, MotionSet
from motionloom_train.data.starts import may_begin, nearest
from tests.kinematics import people


def encoded(positions: np.ndarray) -> np.ndarray:
    return hml.encode(hml.canonical(hml.uniform(hml.resample_positions(positions, people.FPS))), heading="corrected")


def punching(at: int, frames: int) -> np.ndarray:
    """Somebody who stands and whose right hand shoots out within a fifth of a second."""
    body = np.repeat(hml.uniform(people.standing(1.0))[:1], frames, axis=0)
    out = np.clip((np.arange(frames) - at) / 4, 0, 1)[:, None]
    body[:, 21] = body[:, 21] * (1 - out) + (body[0, 17] + [0.0, 0.0, 0.5]) * out
    return body


def test_one_may_begin_wherever_somebody_stands_and_nowhere_in_a_stroke() -> None:
    allowed = may_begin(hml.encode(hml.canonical(punching(30, 60)), heading="corrected"))
    assert allowed[:28].all()
    assert not allowed[31:33].any()
    assert allowed[36:].all()


def test_one_may_begin_in_a_steady_walk_but_not_right_before_it_ends() -> None:
    walk = hml.uniform(hml.resample_positions(people.walking(1.2, 4.0), people.FPS))
    assert may_begin(hml.encode(hml.canonical(walk), heading="corrected"))[5:-5].mean() > 0.9
    stops = np.concatenate([walk, np.repeat(walk[-1:], 40, axis=0)])
    allowed = may_begin(hml.encode(hml.canonical(stops), heading="corrected"))
    assert not allowed[len(walk) - round(0.8 * FPS) : len(walk) - 4].any()


def test_one_may_not_begin_in_the_air() -> None:
    jump = hml.uniform(hml.resample_positions(people.jumping(0.4), people.FPS))
    features = hml.encode(hml.canonical(jump), heading="corrected")
    feet = jump[: len(features), [7, 8, 10, 11], 1].min(axis=1) - jump[0, [10, 11], 1].min()
    assert (feet > 0.2).any()
    assert not may_begin(features)[feet > 0.2].any()


def test_the_nearest_frames_are_told_on_both_sides() -> None:
    before, behind = nearest(np.array([False, True, False, False, True, False]))
    assert before.tolist() == [-1, 1, 1, 1, 4, 4]
    assert behind.tolist() == [1, 1, 4, 4, 4, 6]


@pytest.fixture
def abrupt() -> MotionSet:
    """Two stretches of 100 frames of one action; frames 20 to 29 of the first alone are at rest."""
    allowed = np.zeros(200, dtype=bool)
    allowed[20:30] = True
    items = tuple(Item(start, 100, "action:kick", (0,)) for start in (0, 100))
    features, one = torch.zeros(200, WIDTH), torch.ones(WIDTH)
    return MotionSet(features, one * 0, one, items, ("a person kicks",), ("free",), 1.0, allowed)


def test_windows_begin_at_rest_where_they_can_and_what_never_rests_is_rare(abrupt: MotionSet) -> None:
    starts = Batches(abrupt, windows=(40,), shares=(1.0,)).pick(0, 0, 2000)[1][0].numpy()
    first = starts[starts < 100]
    assert ((first >= 20) & (first < 30)).all()
    assert len(np.unique(first)) == 10
    assert len(first) / len(starts) == pytest.approx(1 / (1 + ABRUPT), abs=0.04)
    assert len(np.unique(starts[starts >= 100])) > 40
