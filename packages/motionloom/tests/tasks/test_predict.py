"""Futures of a clip on its own skeleton and at its own rate; one that arrives at a target."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import turned
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.requests.sampling import PredictionSampling
from motionloom.retarget import from_smpl22, joints22
from motionloom.tasks import predict as task
from motionloom.tasks.completion import Past, WindowSampler
from motionloom.tasks.predict import predict, predict_pieces, switch
from motionloom.tasks.splice import concatenate, ground_pose_at
from tests.recorded import tiny_predictor
from tests.shared import shared
from tests.tasks.small_predictor import small_predictor
from tests.tasks.test_edit import floating, person, rig

PREDICTOR = small_predictor()
FEW = {"count": 1, "steps": 2, "seconds": 0.5}
PAST = person(1.0, 30.0)


def same(a: Motion, b: Motion) -> bool:
    """Bit for bit."""
    moved = (a.translations is None) == (b.translations is None)
    pairs = [(a.root, b.root), (a.rotations, b.rotations)]
    if a.translations is not None and b.translations is not None:
        pairs.append((a.translations, b.translations))
    return moved and a.skeleton == b.skeleton and a.fps == b.fps and all(np.array_equal(x, y) for x, y in pairs)


def close(a: Motion, b: Motion, atol: float = 1e-3) -> None:
    np.testing.assert_allclose(a.positions(), b.positions(), atol=atol)


def on_rig(seconds: float, fps: float = 30.0) -> Motion:
    return from_smpl22(person(seconds, fps), rig())


def on_moving_hips(seconds: float, fps: float = 30.0) -> Motion:
    return floating(on_rig(seconds, fps))


BODIES = {"person": lambda s, fps=30.0: person(s, fps), "rig": on_rig, "hips": on_moving_hips}


# The past comes back, and goes on


@pytest.mark.parametrize(
    ("body", "fps"),
    [("person", 10.0), ("rig", 24.0), ("hips", 25.0), ("person", 29.97), ("rig", 30.0), ("hips", 60.0), ("rig", 120.0)],
)
def test_the_past_comes_back_bit_for_bit_and_goes_on_without_a_seam(body: str, fps: float) -> None:
    past = BODIES[body](1.2, fps)
    n = len(past)
    options = FEW | {"seconds": 1.0, "temperature": 1.0}  # random weights throw people about as much as the noise is
    (motion,) = predict(PREDICTOR, past, **options)
    assert len(motion) == n + round(fps)
    assert same(motion.frames(0, n), past)
    places = joints22(motion)
    speed = np.linalg.norm(np.diff(places, axis=0), axis=-1).max(-1)
    assert speed[n - 1 : n + 3].max() < 1.2 * speed[: n - 1].max()
    bend = np.linalg.norm(np.diff(places, 2, axis=0), axis=-1).max(-1)
    assert bend[n - 2 : n].max() < 2.3 * bend[: n - 2].max(), "random weights stop the person short"


@pytest.mark.parametrize("body", sorted(BODIES))
def test_bones_of_the_future_are_exactly_those_of_the_past(body: str) -> None:
    past = BODIES[body](1.0)
    (motion,) = predict(PREDICTOR, past, **FEW)
    if past.translations is None:
        assert motion.translations is None
        return
    assert motion.translations is not None
    moving = [1]  # the hips, which carry the way
    rest = [j for j in range(1, len(past.skeleton)) if j not in moving]
    last = np.repeat(past.translations[-1:], len(motion) - len(past), axis=0)
    assert np.array_equal(motion.translations[len(past) :, rest], last[:, rest])
    assert np.array_equal(motion.root[len(past) :], np.repeat(past.root[-1:], len(last), axis=0))


FILES = {
    "asf": ("cmu/asf_amc/09/09_01.amc", {"fps": 30}),
    "daz": ("cmu/bvh/13_11.bvh", {}),
    "bandai": ("bandai/dataset-1/dataset-1_walk-back_active_001.bvh", {}),
}


@pytest.mark.parametrize("name", sorted(FILES))
def test_real_clips_of_three_families_go_on(name: str) -> None:
    path, options = FILES[name]
    past = load(shared(f"data/{path}"), **options).frames(0, 30)
    (motion,) = predict(PREDICTOR, past, **FEW)
    assert same(motion.frames(0, 30), past)
    places = joints22(motion)
    bend = np.linalg.norm(np.diff(places, 2, axis=0), axis=-1).max(-1)
    assert bend[28:30].max() < 2.3 * max(bend[:28].max(), 0.02)


def test_a_past_of_two_frames_and_a_long_one_have_futures() -> None:
    long = person(40.0, 30.0)
    last = [predict(PREDICTOR, past, **FEW)[0] for past in (long.frames(1198, 1200), long.frames(1000, 1200), long)]
    assert [len(m) for m in last] == [17, 215, 1215]
    close(last[1].frames(200, 215), last[2].frames(1200, 1215))
    assert np.isfinite(last[0].rotations).all()


def test_head_and_toes_stay_as_they_are_held() -> None:
    """A stiff neck, a bent toe: nothing tells the network, and they stay."""
    past = person(1.0, 30.0)
    turns = past.rotations.copy()
    bent = rot.rotvec_to_quat(np.array([0.6, 0.3, -0.8]))
    turns[:, [15, 10]] = bent
    (motion,) = predict(PREDICTOR, replace(past, rotations=turns), **FEW)
    off = rot.quat_to_rotvec(rot.multiply(motion.rotations[30:, [15, 10]], rot.inverse(bent)))
    assert np.degrees(np.linalg.norm(off, axis=-1)).max() < 25


def test_a_person_takes_what_was_seen_and_then_what_was_drawn_each_at_its_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At the predictor's own rate a frame of the grid is a frame of the result."""
    calls, apply = [], task.continue_motion

    def continued(tail, places, **options):
        calls.append((places, len(tail)))
        return apply(tail, places, **options)

    monkeypatch.setattr(task, "continue_motion", continued)
    predict(PREDICTOR, PAST, count=1, seconds=1.0, steps=1, temperature=1.0)
    ((places, known),) = calls
    person = Past.of(PREDICTOR, PAST).person
    assert known == len(person)
    window = next(
        WindowSampler(PREDICTOR, PredictionSampling(steps=1, temperature=1.0)).windows(person[None], [(0, 0)], None, 1)
    )[0]
    np.testing.assert_allclose(places, np.concatenate([person, window]), atol=1e-5)


def test_frames_that_are_a_rounding_more_than_a_window_are_made_too() -> None:
    """A second is a window; 60 frames of 59.94 fps are a little more than that."""
    past = person(1.0, 59.94)
    motion = predict(PREDICTOR, past, **FEW | {"seconds": 1.0})[0]
    assert len(motion) == len(past) + 60
    assert len(predict(PREDICTOR, past, **FEW | {"seconds": 1 / 59.94})[0]) == len(past) + 1


# Seeds, counts, pieces


def test_future_i_is_the_same_alone_among_others_and_in_pieces() -> None:
    options = {"seconds": 1.3, "seed": 5, "steps": 2}
    many = predict(PREDICTOR, PAST, count=3, **options)
    few = predict(PREDICTOR, PAST, count=2, **options)
    pieces = list(predict_pieces(PREDICTOR, PAST, number=2, **options))
    assert same(pieces[0], PAST)
    close(concatenate(*pieces), many[2])
    for i in (0, 1):
        close(few[i], many[i])
    (last,) = predict(PREDICTOR, PAST, count=1, first=2, **options)
    close(last, many[2])
    again = predict(PREDICTOR, PAST, count=2, **options)
    assert all(same(a, b) for a, b in zip(few, again, strict=True))
    apart = [np.abs(many[i].positions() - many[j].positions()).max() for i in range(3) for j in range(i)]
    assert min(apart) > 0.01
    other = predict(PREDICTOR, PAST, count=1, **options | {"seed": 6})[0]
    assert np.abs(other.positions() - many[0].positions()).max() > 0.01


def test_a_long_future_comes_in_pieces_without_seams_between_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task, "CHUNK", 3.0)
    pieces = list(predict_pieces(PREDICTOR, PAST, seconds=8.5, steps=1))
    assert [len(piece) for piece in pieces] == [30, 90, 90, 75]
    whole = concatenate(*pieces)
    places, at = joints22(whole), np.cumsum([len(p) for p in pieces])[:-1]
    bend = np.linalg.norm(np.diff(places, 2, axis=0), axis=-1).max(-1)
    speed = np.linalg.norm(np.diff(places, axis=0), axis=-1).max(-1)
    for border in at[1:]:
        assert speed[border - 1] < 1.2 * np.delete(speed, at - 1).max()
        assert bend[border - 2 : border].max() < 1.5 * np.delete(bend, np.concatenate([at - 1, at - 2])).max()
    close(whole, predict(PREDICTOR, PAST, count=1, seconds=8.5, steps=1)[0])


def test_minutes_look_back_a_few_seconds_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing that is kept grows with what was made: neither places nor poses."""
    lengths: list[int] = []

    def apply_positions(places, old, **_):
        lengths.append(len(old))
        return old

    def positions_at(grid, at):
        lengths.append(len(grid))
        assert at[0] >= -1e-6
        assert at[-1] <= len(grid) - 1 + 1e-6
        return grid[at.round().astype(int)]

    monkeypatch.setattr(task, "apply_positions", apply_positions)
    monkeypatch.setattr(task, "positions_at", positions_at)
    total = sum(len(piece) for piece in predict_pieces(PREDICTOR, PAST, seconds=60, steps=1, foot_lock=False))
    assert total == 30 + 1800
    assert max(lengths) <= 15 + 30 * (task.CHUNK + 1) + 2 * 15


def test_without_a_temperature_every_seed_makes_the_same() -> None:
    options = {"seconds": 0.5, "steps": 2, "temperature": 0.0}
    first, second = predict(PREDICTOR, PAST, count=2, **options)
    close(first, second)
    close(concatenate(*predict_pieces(PREDICTOR, PAST, seed=7, **options)), first)
    one, other = switch(PREDICTOR, PAST, PAST, count=2, **options | {"seconds": 1.2})
    close(one, other)


def test_progress_is_reported_window_by_window() -> None:
    reports: list[tuple[int, int]] = []
    predict(PREDICTOR, PAST, count=1, seconds=2.5, steps=1, progress=lambda windows, of: reports.append((windows, of)))
    assert reports == [(1, 3), (2, 3), (3, 3)]


def test_without_its_way_a_person_comes_to_a_stop_and_stays_in_place() -> None:
    motion = predict(PREDICTOR, PAST, **FEW | {"seconds": 2.0}, root=False)[0]
    level = motion.root[:, [0, 2]]
    assert np.linalg.norm(level[-1] - level[45]) < 0.05
    assert np.linalg.norm(level[-1] - level[29]) < 0.25
    close(concatenate(*predict_pieces(PREDICTOR, PAST, seconds=2.0, steps=2, root=False)), motion)
    free = predict(PREDICTOR, PAST, **FEW | {"seconds": 2.0})[0]
    assert np.linalg.norm((free.root - motion.root)[-1]) > 0.02


# Switch


@pytest.mark.parametrize(("body", "facing"), [("person", "turned"), ("rig", "kept"), ("hips", "turned")])
def test_a_target_comes_back_bit_for_bit_but_for_a_rigid_move_on_the_ground(body: str, facing: str) -> None:
    past, target = BODIES[body](1.0), BODIES[body](6.0).frames(140, 170)
    (motion,) = switch(PREDICTOR, past, target, seconds=0.5, steps=2, facing=facing)
    assert len(motion) == 30 + 15 + 30
    assert same(motion.frames(0, 30), past)
    tail, mover = motion.frames(45, 75), 0 if past.translations is None else 1
    joints = [j for j in range(len(past.skeleton)) if j != mover]
    assert np.array_equal(tail.rotations[:, joints], target.rotations[:, joints])
    here, there = joints22(tail), joints22(target)
    np.testing.assert_allclose(here[..., 1], there[..., 1], atol=1e-9)
    turn = ground_pose_at(tail, 0).facing - ground_pose_at(target, 0).facing
    np.testing.assert_allclose(here - here[:1, :1], turned(there - there[:1, :1], turn), atol=1e-9)
    pose = ground_pose_at(past, 29) if facing == "turned" else ground_pose_at(target, 0)
    assert ground_pose_at(tail, 0).apart(pose)[1] < (0.35 if facing == "turned" else 1e-9)


@pytest.mark.parametrize(("seconds", "fps"), [(0.1, 24.0), (0.1, 120.0), (0.5, 30.0), (1.0, 24.0), (2.6, 30.0)])
def test_neither_seam_of_a_switch_jumps(seconds: float, fps: float) -> None:
    """Gaps shorter and longer than what one window sees."""
    past, target = person(1.0, fps), person(3.0, fps).frames(round(2.2 * fps), round(3 * fps))
    gap = round(seconds * fps)
    (motion,) = switch(PREDICTOR, past, target, seconds=seconds, steps=2)
    assert len(motion) == len(past) + gap + len(target)
    speed = np.linalg.norm(np.diff(joints22(motion), axis=0), axis=-1).max(-1) * fps
    usual = max(speed[: len(past) - 1].max(), speed[len(past) + gap :].max())
    near = [len(past) - 1, len(past), len(past) + gap - 2, len(past) + gap - 1]
    assert speed[near].max() < (2.0 if seconds >= 0.5 else 5.0) * usual


def test_the_network_sees_the_target_from_the_moment_on_when_it_arrives(monkeypatch: pytest.MonkeyPatch) -> None:
    knowns, draw = [], WindowSampler.window

    def window(self, person, seeds, number, known, **options):
        knowns.append(known)
        return draw(self, person, seeds, number, known, **options)

    monkeypatch.setattr(WindowSampler, "window", window)
    target = person(3.0, 30.0).frames(60, 90)
    switch(PREDICTOR, PAST, target, seconds=0.5, steps=1, facing="kept")
    (known,) = knowns
    assert np.array_equal(known.mask[:, 1] == 1, np.arange(1, len(known.mask) + 1) >= 16)
    assert not known.mask[:, 0].any(), "where it arrives is free"
    places, real = known.positions[15:], joints22(target)[: len(known.positions) - 15]
    assert np.abs((places - places[:, :1]) - (real - real[:, :1])).max() < 0.01


def test_many_switches_differ_and_each_has_its_own_seed() -> None:
    target = person(3.0, 30.0).frames(60, 70)
    many = switch(PREDICTOR, PAST, target, count=2, seconds=0.6, steps=2, seed=3)
    (first,) = switch(PREDICTOR, PAST, target, count=1, seconds=0.6, steps=2, seed=3)
    close(first, many[0])
    (second,) = switch(PREDICTOR, PAST, target, count=1, first=1, seconds=0.6, steps=2, seed=3)
    close(second, many[1])
    (free, beyond) = (
        switch(PREDICTOR, PAST, target, count=number, first=2 - number, seconds=3.0, steps=2, seed=3)[-1]
        for number in (2, 1)
    )
    close(free, beyond)  # longer than what is drawn in sight of the target
    assert np.abs(many[0].positions() - many[1].positions()).max() > 0.005
    assert all(len(motion) == 30 + 18 + 10 for motion in many)


@pytest.mark.parametrize("fps", [10.0, 30.0, 120.0])
def test_two_frames_are_target_enough(fps: float) -> None:
    past, target = person(1.0, fps), person(3.0, fps).frames(round(2 * fps), round(2 * fps) + 2)
    (motion,) = switch(PREDICTOR, past, target, seconds=0.4, steps=2)
    assert np.array_equal(motion.rotations[-2:, 1:], target.rotations[:, 1:])
    speed = np.linalg.norm(np.diff(joints22(motion), axis=0), axis=-1).max(-1)
    assert speed[-3:].max() < 2.0 * speed[: len(past) - 1].max()


# What cannot be asked


MISTAKES = {
    "one frame": {"past": PAST.frames(0, 1)},
    "no time": {"seconds": 0.0},
    "less than a frame": {"seconds": 0.01},
    "backwards": {"seconds": -1.0},
    "nan": {"seconds": float("nan")},
    "an hour at once": {"seconds": 3600.0},
    "too much at once": {"seconds": 500.0, "count": 100},
    "no futures": {"count": 0},
    "ten thousand and one": {"count": 10_001},
    "a negative seed": {"seed": -1},
    "no steps": {"steps": 0},
    "half a step": {"steps": 0.5},
    "too many steps": {"steps": 1001},
    "too hot": {"temperature": 2.01},
    "below zero": {"temperature": -0.1},
    "no temperature": {"temperature": float("nan")},
    "infinite guidance": {"guidance": float("inf")},
    "another predictor": {"predictor": tiny_predictor.predictor()},
    "no predictor": {"predictor": "predictor"},
}


@pytest.mark.parametrize("name", sorted(MISTAKES))
def test_what_cannot_be_predicted_is_reported_in_one_sentence(name: str) -> None:
    options = {"predictor": PREDICTOR, "past": PAST, "count": 1, "seconds": 0.5} | MISTAKES[name]
    predictor, past = options.pop("predictor"), options.pop("past")
    with pytest.raises(MotionloomError) as error:
        predict(predictor, past, **options)
    assert "\n" not in str(error.value)
    assert not str(error.value).endswith(".")


def test_a_day_is_the_most_that_comes_in_pieces() -> None:
    with pytest.raises(MotionloomError, match="86400"):
        next(predict_pieces(PREDICTOR, PAST, seconds=1e6))


TARGETS = {
    "skeleton": (on_rig(1.0), {}),
    "fps": (person(1.0, 25.0), {}),
    "bones": (floating(person(1.0, 30.0)), {}),
    "frame": (PAST.frames(0, 1), {}),
    "facing": (PAST, {"facing": "sideways"}),
    "0 s": (PAST, {"seconds": 0.0}),
}


@pytest.mark.parametrize("word", sorted(TARGETS))
def test_a_target_that_cannot_be_arrived_at_is_reported(word: str) -> None:
    target, options = TARGETS[word]
    with pytest.raises(MotionloomError, match=word):
        switch(PREDICTOR, PAST, target, **options)


def test_a_window_that_sees_a_second_is_enough_to_arrive() -> None:
    """Whatever the window, a switch's target is within sight of its last window."""
    (motion,) = switch(replace(PREDICTOR, fps=60.0), PAST, PAST, seconds=1.4, steps=1)
    assert len(motion) == 30 + 42 + 30
