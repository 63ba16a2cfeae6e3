"""Watching: every network call is reported, the poses end up as the motion, and an exception ends the drawing."""

import numpy as np
import pytest

from motionloom import Predictor, Prior, Redraw, Segment, compose, edit, generate, predict
from motionloom.core.models.pair import PairBlock
from motionloom.tasks.duet import compose_pair
from motionloom.tasks.pair import generate_pair
from motionloom.tasks.watching import Denoised, watching


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior.load()


def test_each_network_call_of_generate_is_reported_with_all_its_rows(prior: Prior) -> None:
    reports: list[Denoised] = []
    with watching(reports.append):
        generate(prior, "a person jumps", seconds=2.0, count=2, seed=3, steps=6)
    assert [(one.move, one.of, one.rows) for one in reports] == [(i, 6, (0, 1)) for i in range(1, 7)]


def test_the_last_poses_are_those_of_the_motion_but_for_bones_and_feet(prior: Prior) -> None:
    reports: list[Denoised] = []
    with watching(reports.append):
        (motion,) = generate(prior, "a person walks", seconds=2.0, seed=3, steps=6)
    first, last = reports[0].positions(), reports[-1].positions()
    assert last.shape == (1, 1, 40, 22, 3)
    far = [np.linalg.norm(poses[0, 0] - motion.positions(), axis=-1).mean() for poses in (first, last)]
    assert far[1] < 0.05 < far[0]


def test_nothing_is_reported_outside_of_the_block(prior: Prior) -> None:
    reports: list[Denoised] = []
    with watching(reports.append):
        pass
    generate(prior, "a person walks", seconds=1.0, steps=2)
    assert not reports


def test_a_long_motion_is_shown_from_end_to_end(prior: Prior) -> None:
    reports: list[Denoised] = []
    with watching(reports.append):
        motion = compose(prior, [Segment("a person walks", 2.0), Segment("a person jumps", 1.5)], steps=6)
    assert [one.move for one in reports] == list(range(1, 7))
    poses = reports[-1].positions()
    assert poses.shape == (1, 1, 70, 22, 3)
    assert np.linalg.norm(poses[0, 0] - motion.positions(), axis=-1).mean() < 0.1


def test_an_edit_shows_its_window_where_the_clip_stands(prior: Prior) -> None:
    (clip,) = generate(prior, "a person walks", seconds=3.0, seed=1, steps=6)
    reports: list[Denoised] = []
    with watching(reports.append):
        (edited,) = edit(prior, clip, "a person waves", Redraw([(1.0, 2.0)]), steps=6)
    poses = reports[-1].positions()[0, 0]
    assert len(poses) == 60
    assert np.linalg.norm(poses[:15] - edited.positions()[:15], axis=-1).max() < 0.05


def test_every_future_is_shown_behind_the_past(prior: Prior) -> None:
    (clip,) = generate(prior, "a person walks", seconds=2.0, seed=1, steps=6)
    reports: list[Denoised] = []
    with watching(reports.append):
        futures = predict(Predictor.load(), clip, count=3, seconds=1.0)
    assert reports[0].rows == (0, 1, 2)
    for poses, future in zip(reports[-1].positions(), futures, strict=True):
        assert np.linalg.norm(poses[0, 0, 0] - future.positions()[len(clip), 0]) < 0.3


def test_two_people_are_shown_as_one_motion_in_every_batch(prior: Prior) -> None:
    reports: list[Denoised] = []
    with watching(reports.append):
        duets = generate_pair(
            prior, PairBlock.load("duet", prior), "two people dance", seconds=1.0, count=3, batch_size=2, steps=6
        )
    assert [one.rows for one in reports] == [(0, 1)] * 6 + [(2,)] * 6
    poses = np.concatenate([reports[5].positions(), reports[-1].positions()])
    assert poses.shape == (3, 2, 20, 22, 3)
    for pose_pair, duet in zip(poses, duets, strict=True):
        for places, motion in zip(pose_pair, duet, strict=True):
            assert np.linalg.norm(places - motion.positions(), axis=-1).mean() < 0.1


def test_a_long_duet_is_shown_from_end_to_end_in_one_world(prior: Prior) -> None:
    reports: list[Denoised] = []
    segments = [Segment("two people dance", 1.5), Segment("two people shake hands", 1.5)]
    with watching(reports.append):
        duet = compose_pair(prior, PairBlock.load("duet", prior), segments, steps=6)
    poses = reports[-1].positions()
    assert [one.move for one in reports] == list(range(1, 7))
    assert poses.shape == (1, 2, 60, 22, 3)
    for person, motion in zip(poses[0], duet, strict=True):  # 6 steps: hands are still on their way
        assert np.linalg.norm(person - motion.positions(), axis=-1).mean() < 0.2


def test_an_exception_of_the_callback_ends_the_drawing_at_that_network_call(prior: Prior) -> None:
    calls = 0

    class Enough(Exception):
        pass

    def stop(denoised: Denoised) -> None:
        nonlocal calls
        calls += 1
        if denoised.move == 2:
            raise Enough

    with pytest.raises(Enough), watching(stop):
        generate(prior, "a person jumps", seconds=2.0, steps=6)
    assert calls == 2
