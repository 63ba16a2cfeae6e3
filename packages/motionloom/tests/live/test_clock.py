"""A player: bounded queues, frames as its `Live` makes them, late frames delay the rest. Time is what the test says."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from motionloom.live import clock
from motionloom.live.clock import Pace, Player
from motionloom.live.commands import Command, Say, Steer
from motionloom.live.live import Frame, Live
from motionloom.live.settings import Settings
from motionloom.tasks.watching import Denoised, watching
from tests.live import people
from tests.live.people import QUICK

PATIENCE = 120.0


def frame(number: int) -> Frame:
    return Frame(number, number / 20, np.zeros(3), np.zeros((22, 4)), "")


def next_frame(player: Player) -> Frame:
    frame = player.take(PATIENCE)
    assert frame is not None
    return frame


def test_frames_are_due_at_their_times_and_a_late_one_delays_what_follows() -> None:
    now = 100.0
    pace = Pace(lambda: now)
    assert (pace.until(frame(5)), pace.late(frame(5))) == (0.0, 0.0)
    assert pace.until(frame(6)) == pytest.approx(0.05)
    now = 100.35
    assert pace.until(frame(6)) == 0.0
    assert pace.late(frame(6)) == pytest.approx(0.3)
    assert pace.until(frame(7)) == pytest.approx(0.05), "the clock waited: nothing is rushed"


def test_frames_that_are_shown_more_slowly_are_as_far_apart_as_that() -> None:
    now, rate = 10.0, 0.5
    pace = Pace(lambda: now, lambda: rate)
    assert pace.late(frame(0)) == 0.0
    assert pace.until(frame(1)) == pytest.approx(0.1)
    now, rate = 10.1, 1.0
    assert pace.late(frame(1)) == pytest.approx(0.05), "it was due at the rate of now"
    assert pace.until(frame(2)) == pytest.approx(0.05)


def test_a_player_gives_the_frames_of_its_live_and_says_how_to_make_them_again() -> None:
    prior = people.prior()
    with Player(Live(prior, seed=2, settings=QUICK)) as player:
        player.ask(Say("a person walks"))
        frames = [next_frame(player) for _ in range(10)]
        player.ask(Steer(1.0, 1.0))
        while len(player.taken) < 2:
            frames.append(next_frame(player))
        frames += [next_frame(player) for _ in range(60)]
        log = player.taken
    assert [one.command for one in log] == [Say("a person walks"), Steer(1.0, 1.0)]
    again = Live(prior, seed=2, settings=QUICK)
    for old in frames:
        for one in log:
            if one.frame == old.number:
                again.ask(one.command, one.person)
        new = next(again)
        assert np.array_equal(old.root, new.root)
        assert np.array_equal(old.rotations, new.rotations)


def test_queues_are_bounded_and_what_is_dropped_is_counted() -> None:
    live = Live(people.prior(), settings=QUICK)
    player = Player(live, now=lambda: 0.0)
    for k in range(1000):
        player.ask(Steer(k * 0.001, 1.0))
    assert player.health.dropped == 1000 - clock.WAITING
    with player:
        first = next_frame(player)
        assert first.number == 0
    assert live.number <= clock.LONGEST * live.fps + 1, "nobody took frames, so none were drawn ahead of the buffer"
    assert player.taken[-1].command == Steer(0.999, 1.0), "the newest is what counts"


LONG = Settings(steps=2, known=6, ahead=50, used=40)


class Simulation:
    """A player by a clock that only network calls move on, and somebody who takes each frame when it is due.

    What would happen in several threads happens in turn, in steps of a hundredth of a second.
    """

    def __init__(self, took: Callable[[int], float], commands: Mapping[float, Command]) -> None:
        """took: seconds of each window by its number; asked: commands by their times."""
        self.clock, self.windows, self.given_up = 0.0, 0, 0
        self.live = Live(people.prior(), seed=2, settings=LONG)
        self.player = Player(self.live, now=lambda: self.clock)
        self.frames: list[Frame] = []
        self.times: list[float] = []
        self.late: list[float] = []
        self._took, self._asked = took, sorted(commands.items(), key=lambda one: one[0])
        self._pace = Pace(lambda: self.clock, lambda: self.player.health.rate)

    def run(self, count: int) -> "Simulation":
        """Until so many frames were shown."""
        with watching(self._call):
            while len(self.frames) < count:
                if task := self.player._task():
                    task()
                else:
                    self._pass(0.01)
                self._take()
        return self

    def _call(self, denoised: Denoised) -> None:
        self.windows += denoised.move == 1
        self._pass(self._took(self.windows) / LONG.steps)
        try:
            self.player._look(denoised)
        except clock._GivenUp:
            self.given_up += 1
            raise

    def _pass(self, seconds: float) -> None:
        end = self.clock + seconds
        while self.clock < end - 1e-9:
            self.clock = min(end, self.clock + 0.01)
            while self._asked and self._asked[0][0] <= self.clock:
                self.player.ask(self._asked.pop(0)[1])
            self._take()

    def _take(self) -> None:
        while (coming := self.player.coming(0.0)) is not None and self._pace.until(coming) <= 1e-9:
            frame = self.player.take(0.0)
            assert frame is not None
            self.late.append(self._pace.late(frame))
            self.frames.append(frame)
            self.times.append(self.clock)

    def replayed(self) -> bool:
        """Whether what was taken makes the same motion again."""
        live, log = Live(people.prior(), seed=2, settings=LONG), self.player.taken
        for old in self.frames:
            for one in log:
                if one.frame == old.number:
                    live.ask(one.command, one.person)
            new = next(live)
            if not (np.array_equal(old.root, new.root) and np.array_equal(old.rotations, new.rotations)):
                return False
        return True


@pytest.mark.parametrize("flood", [False, True])
@pytest.mark.parametrize("each", [0.05, 0.5, 1.2])
def test_windows_that_take_long_make_commands_wait_and_no_frame_late(each: float, flood: bool) -> None:
    commands: dict[float, Command] = {0.03 * k: Steer(0.1 * k, 1.0) for k in range(150)} if flood else {}
    session = Simulation(lambda window: each, commands).run(130)
    assert [frame.number for frame in session.frames] == list(range(len(session.frames)))
    assert max(session.late) <= clock.LATE
    assert session.replayed()


def test_a_machine_that_falls_behind_is_late_twice_and_leaves_nothing_out() -> None:
    """Windows that were quick take three seconds from one moment on, which nobody can know before."""
    session = Simulation(lambda window: 0.2 if window < 12 else 3.0, {}).run(700)
    assert sum(wait > clock.LATE for wait in session.late) == 2, "the clock waits, then all is shown more slowly"
    assert [frame.number for frame in session.frames[:700]] == list(range(700))


def test_a_command_waits_for_one_window_however_long_the_buffer_is() -> None:
    """Whatever the planner does when it comes; windows that nobody asked for are given up for it."""
    times = [2.0 + 1.4 * k + 0.03 * k * k for k in range(8)]
    session = Simulation(lambda window: 0.2, {at: Steer(at, 1.0) for at in times}).run(280)
    waits = [session.times[one.frame] - at for at, one in zip(times, session.player.taken, strict=True)]
    assert max(waits) < 0.2 * clock.SPARE + 0.05 + 0.02 + 0.2 / LONG.steps, "and one call of a window that is given up"
    assert session.given_up > 0
    assert session.player._length == pytest.approx(0.6), "a command waits less than frames do in the buffer"
    assert max(session.late) <= clock.LATE
    assert session.replayed()


def test_a_window_that_comes_too_late_is_sampled_again_and_what_was_shown_stays() -> None:
    """The windows of three commands take three times as long as the last ones let expect."""
    commands: dict[float, Command] = {at: Steer(at, 1.0) for at in (3.02, 6.03, 9.01)}
    slow: list[int] = []

    def took(window: int) -> float:
        if session.player._calm or len(slow) >= 6:
            return 0.15
        slow.append(window)
        return 0.45

    session = Simulation(took, commands)
    session.run(250)
    assert [one.command for one in session.player.taken] == list(commands.values())
    late = [session.times[one.frame] - at for at, one in zip(commands, session.player.taken, strict=True)]
    assert max(late) < 1.2
    assert max(late) > 0.5, "a window came too late"
    assert max(session.late) <= clock.LATE, "and no frame did"
    assert session.replayed()


def test_a_slow_machine_says_so() -> None:
    session = Simulation(lambda window: 0.8, {}).run(100)
    health = session.player.health
    assert health.ahead == pytest.approx(clock.SPARE * 0.8)
    assert "takes 0.80 s for a window" in health.problem
    assert "followed every 1.00 s and 0.84 s late" in health.problem
    assert not Simulation(lambda window: 0.3, {}).run(100).player.health.problem


def test_an_error_of_the_planner_reaches_who_takes_frames() -> None:
    class Broken(Live):
        def __next__(self) -> Frame:
            raise RuntimeError("broken")

    player = Player(Broken(people.prior(), settings=QUICK)).start()
    with pytest.raises(RuntimeError, match="broken"):
        player.take(PATIENCE)
    player.stop()
    assert player.ended


@pytest.mark.parametrize("commands", [{}, {float(k): Say("a person walks") for k in range(2, 100, 3)}])
@pytest.mark.parametrize("seconds", [2.2, 3.0, 5.0])
def test_a_machine_that_is_too_slow_shows_all_more_slowly_and_says_so(
    commands: dict[float, Command], seconds: float
) -> None:
    """Windows of two seconds of motion that take longer: no frame is late, and the player says at what rate it shows
    them and how late it follows."""
    session = Simulation(lambda _: seconds, commands).run(300)
    health = session.player.health
    assert max(session.late[LONG.used :]) < clock.LATE
    assert health.rate == pytest.approx(LONG.used / 20 / (clock.SLOWER * seconds))
    assert f"at {health.rate:.2f} of its speed" in health.problem
    steps = np.diff(session.times[100:])
    assert np.abs(steps - 0.05 / health.rate).max() < 0.03, "evenly"
    assert session.replayed()


def test_a_machine_that_keeps_up_shows_motion_as_it_moves() -> None:
    session = Simulation(lambda _: 0.4, {2.0: Say("a person walks")}).run(200)
    assert session.player.health.rate == 1.0
    assert session.player.health.problem == ""
