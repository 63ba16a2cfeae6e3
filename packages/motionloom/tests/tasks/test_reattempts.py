"""Blocks of a timeline that are sampled again: which, from which seeds, and that the others keep their frames."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.goals.segment import Segment
from motionloom.goals.timeline import Timeline
from motionloom.requests.sampling import Sampling
from motionloom.requests.tasks import Compose
from motionloom.tasks import reattempts
from motionloom.tasks import run as tasks
from motionloom.tasks.long import compose
from motionloom.tasks.reattempts import Reattempted, attempt_seed, reattempt
from motionloom.tasks.redraw import Run, Timed, resample_runs
from motionloom.tasks.run import Models, Plan, run
from motionloom.tasks.watching import Denoised, watching
from tests.tasks.test_redraw import STEPS, prior, sampled, straight, timed

__all__ = ["prior"]
SEGMENTS = tuple(Segment(text, 2.0) for text in ("a person walks", "a man saunters", "a person sits"))
FRAMES = 40


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[int]]:
    """How many things each look at a text misses; behind the last look the last number stays."""
    numbers: dict[str, list[int]] = {}

    def missing(text: str, positions: np.ndarray, fps: float) -> list[str]:
        left = numbers.get(text, [0])
        number = left.pop(0) if len(left) > 1 else left[0]
        return ["a turn to the left", "a kick"][:number]

    monkeypatch.setattr(reattempts, "missing", missing)
    return numbers


def lines(found: Reattempted) -> list[str]:
    return [one.line for one in found.notes(SEGMENTS)]


def test_a_block_that_shows_its_words_from_another_seed_is_of_that_one(prior: Prior, looks: Any) -> None:
    looks["a man saunters"] = [1, 1, 0]
    timeline = timed(prior, SEGMENTS)
    old, seen = sampled(timeline), []
    with watching(seen.append):
        found = reattempt(timeline, old, range(3))
    assert not seen, "attempts are not watched"
    assert found.again == {1: "a man walks"}
    assert not found.missing
    assert lines(found) == ["the manner of 'saunters' is not shown"]
    plain = timed(prior, [SEGMENTS[0], replace(SEGMENTS[1], text="a man walks"), SEGMENTS[2]])
    expected = resample_runs(plain, old, timeline.blocks, [Run(1, 2, 1, 2)], seed=attempt_seed(1, 2))
    assert np.array_equal(found.motion.rotations, expected.rotations)
    assert np.array_equal(found.motion.root, expected.root)
    first, end = FRAMES - 10, 2 * FRAMES + 10
    assert np.array_equal(found.motion.rotations[:first], old.rotations[:first])
    assert np.array_equal(found.motion.rotations[end:, 1:], old.rotations[end:, 1:])


def test_what_no_attempt_shows_stays_as_it_was_and_is_reported(prior: Prior, looks: Any) -> None:
    looks["a person sits"] = [1]
    timeline = timed(prior, SEGMENTS)
    old = sampled(timeline)
    found = reattempt(timeline, old, range(3))
    assert found.motion is old
    assert found.again == {}
    assert lines(found) == ["'a person sits': not shown: a turn to the left"]


def test_an_attempt_that_spoils_a_neighbour_is_not_kept(prior: Prior, looks: Any) -> None:
    looks["a person walks"], looks["a man saunters"] = [0, 1], [1, 0]
    timeline = timed(prior, SEGMENTS)
    old = sampled(timeline)
    found = reattempt(timeline, old, range(3))
    assert found.motion is old
    assert found.missing == {1: ["a turn to the left"]}


def test_of_one_block_an_attempt_is_the_motion_of_its_seed(prior: Prior, looks: Any) -> None:
    looks["a man saunters"] = [2, 1, 2]
    timeline = timed(prior, SEGMENTS[1:2], seed=5)
    found = reattempt(timeline, sampled(timeline), [0])
    expected = compose(prior, [SEGMENTS[1]], steps=STEPS, seed=attempt_seed(5, 1))
    assert np.array_equal(found.motion.rotations, expected.rotations)
    assert found.missing == {0: ["a turn to the left"]}


def test_goals_paths_and_what_goes_on_from_a_motion_are_left_alone(prior: Prior, looks: Any) -> None:
    for text in ("a person walks", "a man saunters", "a person sits"):
        looks[text] = [1]
    goal = Goal.nothing(FRAMES)
    goal.positions[20, 0], goal.mask[20, 0, ::2] = (0.0, 0.0, 0.4), True
    with_goal = timed(prior, [replace(SEGMENTS[0], goal=goal), *SEGMENTS[1:]])
    plain = timed(prior, SEGMENTS)
    old = sampled(plain)
    assert list(reattempt(with_goal, old, range(3)).missing) == [1, 2]
    assert list(reattempt(replace(plain, path=straight(3 * FRAMES)), old, range(3)).missing) == []
    assert list(reattempt(plain, old, range(3), start=old).missing) == [1, 2]


def test_who_listens_to_the_progress_can_cancel_an_attempt(prior: Prior, looks: Any) -> None:
    looks["a person sits"] = [1]
    timeline = timed(prior, SEGMENTS)
    old = sampled(timeline)

    def cancel(moves: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reattempt(timeline, old, range(3), progress=cancel)


def motion_of(plan: Plan, prior: Prior) -> tuple[Motion, list[str], list[tuple[int, int]]]:
    reports: list[tuple[int, int]] = []
    [result] = run(plan, Models(prior), lambda calls, of: reports.append((calls, of)))
    return result.people[0], result.remarks, reports


def test_a_request_is_held_against_its_words_unless_it_is_literal_or_long(
    prior: Prior, looks: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks["a man saunters"] = [1, 1, 0]
    timeline, sampling = Timeline(SEGMENTS), Sampling(steps=STEPS, count=1)
    plan = Plan(task="compose", values=Compose(timeline=timeline), sampling=sampling, timeline=timeline)
    motion, remarks, reports = motion_of(plan, prior)
    assert remarks == ["the manner of 'saunters' is not shown"]
    assert reports[-1] == (9, 9)
    assert reports.count((9, 9)) > 1
    looks["a man saunters"] = [1, 1, 0]
    literal = replace(plan, values=Compose(timeline=timeline, literal=True))
    first, nothing, _ = motion_of(literal, prior)
    assert nothing == []
    assert np.array_equal(first.rotations, sampled(timed(prior, SEGMENTS)).rotations)
    assert not np.array_equal(first.rotations, motion.rotations)
    monkeypatch.setattr(reattempts, "LONGEST", 5.9)
    too_long, nothing, _ = motion_of(plan, prior)
    assert nothing == []
    assert np.array_equal(too_long.rotations, first.rotations)


def test_only_changed_blocks_are_sampled_again_and_all_are_reported(
    prior: Prior, looks: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampled_runs: list[Run] = []
    resample = reattempts.resample_runs

    def recorded(timeline: Timed, old: Motion, was: Any, runs: Any, *rest: Any, **seed: Any) -> Motion:
        sampled_runs.extend(runs)
        return resample(timeline, old, was, runs, *rest, **seed)

    monkeypatch.setattr(reattempts, "resample_runs", recorded)
    before, sampling = timed(prior, SEGMENTS, count=1), Sampling(steps=STEPS, count=1)
    old = sampled(before)
    segments = (SEGMENTS[0], SEGMENTS[1], replace(SEGMENTS[2], text="a person jumps"))
    for text in ("a person walks", "a man saunters", "a person jumps"):
        looks[text] = [1]
    timeline = Timeline(segments)
    plan = Plan(
        task="compose",
        values=Compose(timeline=timeline),
        sampling=sampling,
        timeline=timeline,
        previous=(old, before.blocks),
    )
    _, remarks, _ = motion_of(plan, prior)
    assert sampled_runs == [Run(2, 3, 2, 3)] * 3
    missed = "not shown: a turn to the left"
    assert remarks == [f"'{one.text}': {missed}" for one in segments]


def test_denoised_poses_of_the_first_attempt_are_watched(prior: Prior, looks: Any) -> None:
    looks["a person sits"] = [1]
    timeline = Timeline(SEGMENTS)
    sampling = Sampling(steps=STEPS, count=1)
    plan = Plan(task="compose", values=Compose(timeline=timeline), sampling=sampling, timeline=timeline)
    seen: list[Denoised] = []
    with watching(seen.append):
        motion_of(plan, prior)
    assert {one.of for one in seen} == {seen[0].of}
    assert len(seen) == seen[-1].move


def test_where_somebody_climbs_nothing_is_kept_and_goals_that_say_heights_are_left_alone(
    prior: Prior, looks: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[bool] = []

    def add_support(motion: Motion, *, stairs: bool) -> Motion:
        steps.append(stairs)
        return motion

    monkeypatch.setattr(tasks, "add_support", add_support)
    monkeypatch.setattr(tasks, "add_support_between", lambda motion, spans: steps.append(spans) or motion)
    before, sampling = timed(prior, SEGMENTS, count=1), Sampling(steps=STEPS, count=1)
    previous = (sampled(before), before.blocks)

    def measured(*segments: Segment) -> dict[str, Any]:
        timeline = Timeline(segments)
        values = Compose(timeline=timeline)
        plan = Plan(task="compose", values=values, sampling=sampling, timeline=timeline, previous=previous)
        [result] = run(plan, Models(prior))
        return result.measures

    assert measured(*SEGMENTS[:2], replace(SEGMENTS[2], text="a person jumps")) == {"redrawn": [2]}
    assert measured(*SEGMENTS[:2], replace(SEGMENTS[2], text="a person climbs the stairs")) == {}
    assert steps == [[(2 * FRAMES - 10, 3 * FRAMES)], True]
    goal = Goal.nothing(FRAMES)
    goal.positions[20, 15], goal.mask[20, 15, 1] = (0.0, 1.6, 0.0), True
    assert measured(*SEGMENTS[:2], replace(SEGMENTS[2], goal=goal)) == {"redrawn": [2]}
    assert len(steps) == 2
