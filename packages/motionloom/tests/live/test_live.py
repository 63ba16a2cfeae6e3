"""Live motion in frames: the same script gives the same motion, what was shown stays, commands come at once."""

from collections.abc import Mapping

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.live.commands import Command, FrameCommand, Path, Pose, Reach, Say, Steer
from motionloom.live.live import Frame, Live, motion_of
from motionloom.live.person import stays
from motionloom.live.settings import Settings
from tests.live import people
from tests.live.people import QUICK
from tests.tasks.test_edit import person

WALK, RUN = "a person walks forward", "a person runs forward"
SCRIPT: dict[int, list[Command]] = {
    0: [Say(WALK)],
    25: [Steer(1.0, 1.3)],
    33: [Say(RUN), Steer(-1.0)],
    34: [Reach("left_wrist", (0.3, 1.2, 1.0))],
    60: [Path(((0.0, 1.0), (1.0, 2.0)))],
}


@pytest.fixture(scope="module")
def prior() -> Prior:
    return people.prior()


@pytest.fixture(scope="module")
def real() -> Prior:
    """The shipped weights."""
    return Prior.load()


def played(live: Live, script: Mapping[int, list[Command]], count: int) -> list[Frame]:
    frames = []
    for number in range(live.number, live.number + count):
        for command in script.get(number, []):
            live.ask(command)
        frames.append(next(live))
    return frames


def asked_at(log: list[FrameCommand]) -> dict[int, list[Command]]:
    """A script of what was taken."""
    script: dict[int, list[Command]] = {}
    for frame, command, _ in log:
        script.setdefault(frame, []).append(command)
    return script


def same(first: list[Frame], second: list[Frame]) -> bool:
    return all(
        np.array_equal(a.root, b.root) and np.array_equal(a.rotations, b.rotations)
        for a, b in zip(first, second, strict=True)
    )


def test_the_same_seed_and_script_make_the_same_motion_and_another_seed_another(prior: Prior) -> None:
    first, again = (played(Live(prior, seed=3, settings=QUICK), SCRIPT, 70) for _ in range(2))
    assert same(first, again)
    assert not same(first, played(Live(prior, seed=4, settings=QUICK), SCRIPT, 70))


def test_frames_before_a_command_do_not_know_of_it_and_those_behind_do(prior: Prior) -> None:
    quiet = played(Live(prior, seed=3, settings=QUICK), {0: [Say(WALK)]}, 60)
    steered = played(Live(prior, seed=3, settings=QUICK), {0: [Say(WALK)], 30: [Steer(2.0, 1.5)]}, 60)
    assert same(quiet[:30], steered[:30])
    assert not same(quiet[30:34], steered[30:34])


def test_a_frame_that_was_handed_out_is_never_changed(prior: Prior) -> None:
    live = Live(prior, seed=1, settings=QUICK)
    frames = played(live, {}, 20)
    copies = [(frame.root.copy(), frame.rotations.copy()) for frame in frames]
    played(live, {k: [Say(WALK if k % 2 else RUN)] for k in range(0, 30, 3)}, 30)
    assert all(np.array_equal(f.root, r) and np.array_equal(f.rotations, q) for f, (r, q) in zip(frames, copies))


def test_windows_are_drawn_where_they_must_be_and_not_more_often(prior: Prior) -> None:
    """One at the beginning, one whenever the used frames are shown; a flood of commands makes one each ``rest``."""
    settings = Settings(steps=2, ahead=40, used=30, rest=5)
    live = Live(prior, seed=1, settings=settings)
    played(live, {}, 90)
    assert live.calls == 2 * 3
    flood = Live(prior, seed=1, settings=settings)
    played(flood, {k: [Steer(k * 0.01, 1.0)] * 50 for k in range(60)}, 60)
    assert flood.calls == 2 * 60 / 5


def test_what_was_taken_up_replays_the_session_at_any_rate_and_spacing(prior: Prior) -> None:
    for fps in (20, 24, 10):
        live = Live(prior, seed=5, fps=fps, settings=QUICK)
        live.stretch(0.6)
        session = played(live, SCRIPT, 80)
        assert same(session, played(Live(prior, seed=5, fps=fps, settings=QUICK), asked_at(live.taken), 80)), fps


@pytest.mark.parametrize("fps", [20, 48])
def test_frames_can_be_made_anew_from_any_on_and_be_as_they_were(prior: Prior, fps: float) -> None:
    """Going back and asking something makes what asking it then would have made; what was taken up since is asked
    again."""
    script: dict[int, list[Command]] = {0: [Say(WALK)], 12: [Path(((0.0, 1.0), (1.0, 2.0)))], 60: [Say(RUN)]}
    live, marks, frames = Live(prior, seed=3, fps=fps, settings=QUICK), [], []
    for _ in range(90):
        marks.append(live.mark())
        frames += played(live, script, 1)
    log = live.taken
    for at in (0, 13, 41, 59, 60, 75, 89):
        before = asked_at([one for one in log if one.frame < at])
        undo = live.back(marks[at])
        assert live.number == at
        live.ask(Steer(2.0, 1.0))
        anew = [next(live) for _ in range(100 - at)]
        again = [one.command for one in log if one.frame >= at]
        expected = played(Live(prior, seed=3, fps=fps, settings=QUICK), {**before, at: [*again, Steer(2.0, 1.0)]}, 100)
        assert same(anew, expected[at:]), at
        live.forth(undo)
        assert live.number == 90
        assert live.taken == log
    frames += [next(live) for _ in range(30)]
    assert same(frames, played(Live(prior, seed=3, fps=fps, settings=QUICK), asked_at(log), 120))


def test_faster_frames_show_the_same_poses_and_what_lies_between(prior: Prior) -> None:
    slow = played(Live(prior, seed=2, settings=QUICK), {}, 50)
    fast = played(Live(prior, seed=2, fps=60, settings=QUICK), {}, 148)
    assert same(slow, fast[::3])
    middle = (slow[10].root + slow[11].root) / 2
    between = (fast[31].root + fast[32].root) / 2
    np.testing.assert_allclose(between, middle, atol=1e-9)
    assert fast[30].time == pytest.approx(slow[10].time)


def test_somebody_goes_on_from_a_motion_in_its_place(prior: Prior) -> None:
    start = person(2.0)
    live = Live(prior, seed=1, start=start, settings=QUICK)
    first = next(live)
    step = start.root[-1] - start.root[-2]
    assert np.linalg.norm((first.root - (start.root[-1] + step))[[0, 2]]) < 0.03


def test_joints_never_jump_when_something_is_asked(real: Prior) -> None:
    """Between frames nothing moves faster than in runs that nobody interrupts: 12 m/s is a foot that runs."""
    live = Live(real, seed=2)
    script = {
        0: [Say(WALK)],
        31: [Say(RUN)],
        66: [Say("a person stands still")],
        83: [Say(WALK)],
        95: [Steer(2.5)],
        104: [Steer(-1.5, 2.0)],
        131: [Say("")],
        140: [Path(((0.0, 0.0),))],
    }
    motion = motion_of(played(live, script, 200), 20)
    steps = np.diff(motion.positions(), axis=0)
    assert np.linalg.norm(steps, axis=-1).max() * 20 < 12.0
    assert np.linalg.norm(np.diff(steps, axis=0), axis=-1).max() * 400 < 200.0


def test_a_standing_foot_stands_on_when_something_is_asked(real: Prior) -> None:
    live = Live(real, seed=1)
    still = played(live, {0: [Say("a person stands still")]}, 60)
    live.say("a person raises both arms")
    places = motion_of([*still[-2:], *(next(live) for _ in range(10))], 20).positions()
    toes = places[:, [10, 11]][..., [0, 2]]
    moved = np.linalg.norm(toes[1:] - toes[:1], axis=-1).max(axis=0)
    assert moved.min() < 0.002  # the other one may make a step


def test_a_steered_person_goes_there_within_a_second_at_the_speed_asked(real: Prior) -> None:
    live = Live(real, seed=1)
    live.steer(0.0, 1.2)
    live.take(50)
    live.steer(np.pi / 2, 1.5)
    live.take(20)
    way = np.diff(live.take(41).root[::20], axis=0) * [1, 0, 1]
    angles = np.degrees(np.arctan2(way[:, 0], way[:, 2]))
    np.testing.assert_allclose(angles, 90, atol=8)
    np.testing.assert_allclose(np.linalg.norm(way, axis=-1), 1.5, atol=0.15)


def test_a_direction_alone_turns_the_way_and_leaves_the_pace_to_the_words(real: Prior) -> None:
    def pace(motion: Motion) -> float:
        return float(np.linalg.norm((motion.root[-1] - motion.root[0])[[0, 2]]))

    live = Live(real, seed=1)
    live.say(WALK)
    before = pace(live.take(100).frames(79, 100))
    live.steer(np.pi / 2)
    live.take(24)
    after = live.take(30)
    way = after.root[-1] - after.root[0]
    assert abs(np.degrees(np.arctan2(way[0], way[2])) - 90) < 15
    assert 0.5 * before < pace(after.frames(0, 21)) < 2 * before


def test_a_path_is_walked_to_its_end_and_there_somebody_stands(real: Prior) -> None:
    live = Live(real, seed=4)
    live.path([(0.5, 2.0), (2.0, 3.0)])
    motion = live.take(180)
    assert np.linalg.norm(motion.root[:, [0, 2]] - [0.5, 2.0], axis=-1).min() < 0.3
    assert np.linalg.norm(motion.root[-20:, [0, 2]] - [2.0, 3.0], axis=-1).max() < 0.5
    assert np.linalg.norm(motion.root[-1] - motion.root[-20]) < 0.1


def test_a_wrist_reaches_its_place_in_time(real: Prior) -> None:
    live = Live(real, seed=1)
    live.say("a person stands still")
    at = live.take(40).positions()[-1]
    target = at[16] + [0.15, 0.1, 0.35]
    live.reach("left_wrist", target, within=0.8)
    places = live.take(22).positions()[:, 20]
    assert np.linalg.norm(places[15:19] - target, axis=-1).min() < 0.06


def fastest(motion: Motion) -> float:
    """Metres per second of the pelvis over the floor at most."""
    return float(np.linalg.norm(np.diff(motion.root[:, [0, 2]], axis=0), axis=-1).max() * motion.fps)


def test_what_is_out_of_reach_is_walked_to_first(real: Prior) -> None:
    target = np.array([3.0, 1.3, 1.0])
    live = Live(real, seed=1)
    live.take(20)
    live.reach("right_wrist", target)
    motion = live.take(160)
    assert np.linalg.norm(motion.positions()[:, 21] - target, axis=-1).min() < 0.12
    assert fastest(motion) < 2.5
    assert fastest(motion.frames(140, 160)) < 0.3, "he stays there"


@pytest.mark.parametrize("words", ["", "a person walks forward"])
def test_nobody_flies_to_what_is_a_hundred_metres_away(real: Prior, words: str) -> None:
    live = Live(real, seed=1)
    live.say(words)
    live.take(20)
    live.reach("right_wrist", (100.0, 1.5, 0.0), within=0.6)
    motion = live.take(120)
    assert fastest(motion) < 2.5
    assert motion.root[-1, 0] > 4.0, "he is on his way"


def test_nobody_flies_back_to_what_he_has_left_behind(real: Prior) -> None:
    """A far time, and a steering away from what is about to be reached."""
    live = Live(real, seed=1)
    live.say("a person walks forward")
    live.reach("left_wrist", (0.3, 1.2, 0.6), within=12.0)
    assert fastest(live.take(300)) < 2.5
    other = Live(real, seed=1)
    other.reach("right_wrist", (0.3, 1.2, 0.5), within=2.0)
    other.take(10)
    other.steer(-1.5, 3.0)
    assert fastest(other.take(80)) < 6.0


def test_two_hands_reach_far_places_one_after_the_other(real: Prior) -> None:
    places = {20: np.array([-1.8, 1.2, 0.5]), 21: np.array([1.8, 1.2, 0.0])}
    live = Live(real, seed=1)
    live.take(20)
    live.reach("right_wrist", places[21])
    live.reach("left_wrist", places[20])
    motion = live.take(240).positions()
    for joint, place in places.items():
        assert np.linalg.norm(motion[:, joint] - place, axis=-1).min() < 0.12


def test_who_is_steered_elsewhere_gives_up_what_he_walked_to(real: Prior) -> None:
    live = Live(real, seed=1)
    live.reach("right_wrist", (5.0, 1.2, 0.0))
    live.take(20)
    live.steer(-np.pi / 2, 1.2)
    motion = live.take(160)
    assert motion.root[-1, 0] < -3.0
    live.steer()
    assert live.take(60).root[-1, 0] < -3.0


def test_words_that_go_nowhere_end_a_steer_and_a_path(real: Prior) -> None:
    for words in ("a person sits down", "a person stands still", "lies down on the floor"):
        live = Live(real, seed=1)
        live.steer(0.0, 3.0)
        live.take(60)
        live.say(words)
        motion = live.take(70)
        end = motion.root[-1] - motion.root[-20]
        assert np.linalg.norm(end[[0, 2]]) < 0.6, words
    live = Live(real, seed=1)
    live.path([(0.0, 8.0)])
    live.take(40)
    live.say("a person sits down")
    assert live.take(120).root[-1, 2] < 5.0


def test_who_is_steered_while_words_go_nowhere_goes_in_other_words(prior: Prior) -> None:
    live = Live(prior, settings=QUICK)
    live.say("a person sits down")
    assert next(live).words == "a person sits down"
    live.steer(0.0, 1.2)
    assert played(live, {}, 6)[-1].words == "a person walks forward"
    live.steer()
    assert played(live, {}, 6)[-1].words == "a person sits down"
    live.say("a person walks like a zombie")
    live.steer(0.0, 1.2)
    assert played(live, {}, 6)[-1].words == "a person walks like a zombie"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("a person sits down", True),
        ("a person stands still", True),
        ("a person stops running", True),
        ("a person walks to a chair and sits down", True),
        ("somebody lies on the floor", True),
        ("a person kneels", True),
        ("a person stands up and walks away", False),
        ("a person walks forward", False),
        ("a person jumps", False),
        ("a person waves", False),
        ("a person crouches and sneaks forward", False),
        ("", False),
    ],
)
def test_words_say_whether_somebody_stays(words: str, expected: bool) -> None:
    assert stays(words) is expected


def test_a_pose_is_taken_where_the_person_is(real: Prior) -> None:
    live = Live(real, seed=1)
    live.say("a person stands still")
    live.take(40)
    other = Live(real, seed=9)
    other.say("a person raises both arms")
    target = other.take(40)
    live.pose(target.frames(30, 31), within=0.8)
    places = live.take(20).positions()[16]
    want = target.positions()[30]
    off = (places[[20, 21]] - places[0])[:, 1] - (want[[20, 21]] - want[0])[:, 1]
    assert np.abs(off).max() < 0.15


def test_what_cannot_be_asked_is_refused_in_a_sentence(prior: Prior) -> None:
    live = Live(prior, settings=QUICK)
    for wrong in (
        lambda: live.say("x" * 501),
        lambda: live.say("a person \ud800 walks"),
        lambda: live.steer(float("nan")),
        lambda: live.steer(0.0, 50.0),
        lambda: live.path([]),
        lambda: live.path([(0.0, 1e9)]),
        lambda: live.reach("tail", (0, 0, 0)),
        lambda: live.reach("left_wrist", (0, 9, 0)),
        lambda: live.reach("left_wrist", (0, 1, 0), within=0.0),
        lambda: live.pose(np.zeros((5, 3))),
        lambda: Live(prior, seed=-1),
        lambda: Live(prior, fps=0.0),
        lambda: Live(prior, settings=Settings(steps=0)),
        lambda: Live(prior, settings=Settings(used=80)),
        lambda: Pose(((0.0, 0.0, 0.0),) * 21),
    ):
        with pytest.raises(MotionloomError):
            wrong()
