"""A changed timeline: which blocks are sampled, and that the frames of the others stay."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motionloom.core.body.feet import planted_feet
from motionloom.core.features import humanml
from motionloom.core.features.layout import FEET
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import Sampling
from motionloom.tasks.long import compose
from motionloom.tasks.redraw import Block, Run, Timed, blocks_from, changed_runs, resample_runs
from motionloom.tasks.watching import Denoised, watching
from tests.recorded import tiny
from tests.tasks.test_edit import person

WORDS = ("a person walks", "a person jumps", "a person sits", "a person waves", "a person runs")
SEGMENTS = tuple(Segment(text, 2.0) for text in WORDS)
STEPS = 3


@pytest.fixture(scope="module")
def prior() -> Prior:
    """Random weights around a walking person."""
    std = np.full(263, 0.02, np.float32)
    std[:3] = 0.004
    return replace(tiny.prior(), mean=np.asarray(humanml.motion_to_features(person(2.0)).mean(0)), std=std)


def timed(prior: Prior, segments, path: Goal | None = None, **settings: Any) -> Timed:
    return Timed(prior, list(segments), path, Sampling(**{"steps": STEPS, **settings}))


def sampled(timeline: Timed) -> Motion:
    return compose(timeline.prior, timeline.segments, path=timeline.path, sampling=timeline.sampling)


def changed(before: Timed, after: Timed, old: Motion | None = None) -> tuple[Motion, Motion, list[int]]:
    """The motion before, the one after, and how many rows were moved at a time."""
    old, moves = old or sampled(before), []
    runs = changed_runs(before.blocks, after)
    assert runs is not None
    return old, resample_runs(after, old, before.blocks, runs, moves.append), moves


def with_words(number: int, text: str) -> list[Segment]:
    return [replace(one, text=text) if n == number else one for n, one in enumerate(SEGMENTS)]


def straight(frames: int) -> Goal:
    """A path along +Z, a place for every frame."""
    goal = Goal.nothing(frames)
    goal.positions[:, 0, 2], goal.mask[:, 0, ::2] = 0.03 * np.arange(frames), True
    return goal


def test_only_the_changed_block_is_sampled_and_the_others_keep_their_frames(prior: Prior) -> None:
    old, new, moves = changed(timed(prior, SEGMENTS), timed(prior, with_words(2, "a person kicks")))
    assert sum(moves) == STEPS  # one row, where all are five
    assert len(new) == len(old) == 200
    first, end = 80 - 10, 120 + 10
    assert np.array_equal(new.rotations[:first], old.rotations[:first])
    assert np.array_equal(new.root[:first], old.root[:first])
    assert np.array_equal(new.rotations[end:, 1:], old.rotations[end:, 1:])
    assert np.abs(new.rotations[85:115] - old.rotations[85:115]).max() > 1e-3
    steps = [np.linalg.norm(np.diff(one.root[end:], axis=0), axis=1) for one in (old, new)]  # moved as one piece
    np.testing.assert_allclose(*steps, atol=1e-9)


def test_the_motion_goes_through_both_borders_without_a_jump(prior: Prior) -> None:
    old, new, _ = changed(timed(prior, SEGMENTS), timed(prior, with_words(2, "a person kicks")))
    moved, before = (np.linalg.norm(np.diff(one.positions(), axis=0), axis=-1).max(1) for one in (new, old))
    for border in (70, 130):
        assert moved[border - 2 : border + 2].max() < 1.5 * before.max()


def test_feet_stand_still_across_both_borders() -> None:
    """With the shipped weights: planted feet slide less than 3 mm a frame, on average over three changes of words."""
    real, words = Prior.load(), "a person stands still"
    segments = [Segment(text, 2.0) for text in (words, "a person waves with the right hand", words)]
    slides = []
    for text in ("a person claps", "a person bows", "a person raises both arms"):
        other = [segments[0], replace(segments[1], text=text), segments[2]]
        _, new, _ = changed(timed(real, segments, steps=8), timed(real, other, steps=8))
        places = new.positions()
        still = planted_feet(places, 20.0)
        moved = np.linalg.norm(np.diff(places[:, list(FEET)][..., [0, 2]], axis=0), axis=-1)
        for border in (30, 90):
            around = slice(border - 10, border + 10)
            planted = still[1:][around] & still[:-1][around]
            assert planted.sum() > 20
            slides.append(moved[around][planted].mean())
    assert np.mean(slides) < 0.003


def test_the_same_change_of_the_same_motion_is_the_same_bit_for_bit(prior: Prior) -> None:
    before, after = timed(prior, SEGMENTS), timed(prior, with_words(0, "a person kicks"))
    old, one, _ = changed(before, after)
    other = changed(before, after, old)[1]
    assert np.array_equal(one.rotations, other.rotations)
    assert np.array_equal(one.root, other.root)


def test_where_nothing_changed_nothing_is_sampled(prior: Prior) -> None:
    old, new, moves = changed(timed(prior, SEGMENTS), timed(prior, SEGMENTS))
    assert new is old
    assert moves == []


def test_blocks_are_put_in_taken_out_and_moved(prior: Prior) -> None:
    more = Segment("a person bows", 1.5)
    for segments, rows in (
        ([*SEGMENTS[:2], more, *SEGMENTS[2:]], 1),
        ([more, *SEGMENTS], 1),
        ([*SEGMENTS, more], 1),
        ([*SEGMENTS[:2], *SEGMENTS[3:]], 1),
        (SEGMENTS[1:], 1),
        (SEGMENTS[:-1], 1),
        ([SEGMENTS[0], *SEGMENTS[3:], *SEGMENTS[1:3]], 3),
        ([replace(SEGMENTS[0], text="x"), *SEGMENTS[1:4], replace(SEGMENTS[4], text="y")], 2),
    ):
        _, new, moves = changed(timed(prior, SEGMENTS), timed(prior, segments))
        assert len(new) == sum(round(20 * one.seconds) for one in segments)
        assert sum(moves) <= rows * STEPS
        assert np.isfinite(new.positions()).all()


def test_what_has_to_be_sampled_is_told_by_what_is_asked(prior: Prior) -> None:
    """Words, length, guidance, seed, steps and goals; a transition is that of one seam alone."""
    before = timed(prior, SEGMENTS)
    reach = Goal.nothing(40)
    reach.positions[20, 20], reach.mask[20, 20] = (0.2, 1.4, 0.3), True
    one = SEGMENTS[1]
    others = [replace(one, text="a"), replace(one, seconds=1.5), replace(one, guidance=4.0), replace(one, goal=reach)]
    for other in others:
        segments = [SEGMENTS[0], other, *SEGMENTS[2:]]
        assert changed_runs(before.blocks, timed(prior, segments)) == [Run(1, 2, 1, 2)]
    seam = [*SEGMENTS[:1], replace(SEGMENTS[1], transition=0.4), *SEGMENTS[2:]]
    assert changed_runs(before.blocks, timed(prior, seam)) == [Run(2, 2, 2, 2)]
    for another in (timed(prior, SEGMENTS, seed=1), timed(prior, SEGMENTS, guidance=1.0)):
        assert changed_runs(before.blocks, another) is None
    assert changed_runs(before.blocks, timed(prior, SEGMENTS, steps=4)) is None
    assert changed_runs(before.blocks, replace(before, foot_lock=False)) is None
    other = replace(prior, net=tiny.prior(tiny.PUBLISHED).net)
    assert changed_runs(before.blocks, timed(other, SEGMENTS)) is None


def test_a_neighbour_that_is_asked_for_something_at_the_seam_is_sampled_too(prior: Prior) -> None:
    for frame, runs in ((3, [Run(2, 4, 2, 4)]), (25, [Run(2, 3, 2, 3)])):
        reach = Goal.nothing(40)
        reach.positions[frame, 20], reach.mask[frame, 20] = (0.2, 1.4, 0.3), True
        segments = [*SEGMENTS[:3], replace(SEGMENTS[3], goal=reach), SEGMENTS[4]]
        before = timed(prior, segments)
        after = timed(prior, [replace(one, text="a") if n == 2 else one for n, one in enumerate(segments)])
        assert changed_runs(before.blocks, after) == runs


def test_a_goal_of_a_block_is_met_where_it_is_drawn_again(prior: Prior) -> None:
    reach = Goal.nothing(40)
    reach.positions[20, 0], reach.mask[20, 0, ::2] = (0.3, 0.0, 0.4), True
    segments = [*SEGMENTS[:2], replace(SEGMENTS[2], goal=reach), *SEGMENTS[3:]]
    _, new, _ = changed(timed(prior, SEGMENTS), timed(prior, segments))
    away = new.root[100, ::2] - new.root[80, ::2]
    assert np.linalg.norm(away) == pytest.approx(0.5, abs=0.06)


def test_on_a_path_what_lies_behind_stays_in_its_place(prior: Prior) -> None:
    path = straight(200)
    old, new, moves = changed(timed(prior, SEGMENTS, path), timed(prior, with_words(1, "a person kicks"), path))
    assert sum(moves) == STEPS
    assert np.array_equal(new.root[90:], old.root[90:])
    assert np.array_equal(new.rotations[90:], old.rotations[90:])
    off = np.linalg.norm(new.root[:, ::2] - path.positions[:, 0, ::2], axis=1)
    assert off.max() < 0.06
    bent = replace(path, positions=path.positions.copy())
    bent.positions[130:150, 0, 0] += 0.1
    assert changed_runs(timed(prior, SEGMENTS, path).blocks, timed(prior, SEGMENTS, bent)) == [Run(3, 4, 3, 4)]


def test_what_is_sampled_is_seen_at_its_time(prior: Prior) -> None:
    before, after, reports = timed(prior, SEGMENTS), timed(prior, with_words(2, "a person kicks")), list[Denoised]()
    old = sampled(before)
    with watching(reports.append):
        new = changed(before, after, old)[1]
    assert [one.move for one in reports] == [1, 2, 3]
    assert {one.begin for one in reports} == {3.5}
    last = reports[-1].positions()[0, 0]
    assert len(last) == 60
    assert np.abs(last - new.positions()[70:130]).mean() < 0.1


def test_blocks_come_back_from_a_file_if_they_fit_the_motion(prior: Prior) -> None:
    blocks = timed(prior, SEGMENTS).blocks
    values = [list(block) for block in blocks]
    assert blocks_from(values, 200) == blocks
    for wrong in (
        None,
        [],
        {},
        "x",
        [["a"]],
        [["a", "b", "c"]],
        [["a", 200, 0]],
        [[1, 200, 10]],
        [["a", 300, 9], ["b", -100, 9]],
    ):
        assert blocks_from(wrong, 200) == []
    assert blocks_from(values, 199) == []
    assert isinstance(blocks[0], Block)
