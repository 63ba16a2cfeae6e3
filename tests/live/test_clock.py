"""A player: bounded queues, frames as its `Live` makes them, late frames delay the rest. Time is what the test says."""

import threading

import numpy as np
import pytest

from motionloom.live import clock
from motionloom.live.clock import Pace, Player
from motionloom.live.commands import Say, Steer
from motionloom.live.live import Frame, Live
from motionloom.live.settings import Settings
from tests.live import people
from tests.live.people import QUICK

PATIENCE = 120.0


def frame(number: int) -> Frame:
    return Frame(number, number / 20, np.zeros(3), np.zeros((22, 4)), "")


def taken(player: Player) -> Frame:
    found = player.take(PATIENCE)
    assert found is not None
    return found


def test_frames_are_due_at_their_times_and_a_late_one_delays_what_follows() -> None:
    now = 100.0
    pace = Pace(lambda: now)
    assert (pace.until(frame(5)), pace.late(frame(5))) == (0.0, 0.0)
    assert pace.until(frame(6)) == pytest.approx(0.05)
    now = 100.35
    assert pace.until(frame(6)) == 0.0
    assert pace.late(frame(6)) == pytest.approx(0.3)
    assert pace.until(frame(7)) == pytest.approx(0.05), "the clock waited: nothing is rushed"


def test_a_player_gives_the_frames_of_its_live_and_says_how_to_make_them_again() -> None:
    prior = people.prior()
    with Player(Live(prior, seed=2, settings=QUICK)) as player:
        player.ask(Say("a person walks"))
        made = [taken(player) for _ in range(10)]
        player.ask(Steer(1.0, 1.0))
        made += [taken(player) for _ in range(60)]
        asked = player.taken
    assert [one.command for one in asked] == [Say("a person walks"), Steer(1.0, 1.0)]
    again = Live(prior, seed=2, settings=QUICK)
    for old in made:
        for one in asked:
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
        first = taken(player)
        assert first.number == 0
    assert live.number <= 1 + player._room() + 1, "nobody took frames, so none were drawn ahead of the buffer"
    assert player.taken[-1].command == Steer(0.999, 1.0), "the newest is what counts"


def test_a_slow_machine_says_so_and_a_command_waits_longer() -> None:
    now = 0.0
    lock = threading.Lock()

    def slowly() -> float:
        nonlocal now
        with lock:
            now += 0.5  # each look at the clock: a window seems to take that long
            return now

    live = Live(people.prior(), settings=QUICK)
    with Player(live, now=slowly) as player:
        for _ in range(30):
            taken(player)
        health = player.health
    assert health.ahead == pytest.approx(1.5 * 0.5)
    assert "takes 0.50 s for a window" in health.problem
    assert "followed every 0.65 s and 0.75 s late" in health.problem


class Slowly(Live):
    """Each window takes so many seconds by a clock of its own."""

    clock, each = 0.0, 0.0

    def _windows(self, requests) -> None:
        super()._windows(requests)
        self.clock += self.each


def lateness(live: Slowly, count: int, flood: bool) -> list[float]:
    """Seconds that each frame is late for somebody who shows them at their times, by the clock of the planner: what it
    would make meanwhile is made in turn, without a thread."""
    player, made, late, begun = Player(live, now=lambda: live.clock), [], [], None
    for k in range(count):
        if flood:
            player.ask(Steer(0.1 * k, 1.0))
        due = 0.0 if begun is None else begun + k / 20
        while len(player._buffer) < player._room() and (live.clock <= due or not player._buffer):
            player._make()
            made.append(live.clock)
        full = len(player._buffer) >= player._room()
        assert player.take(0.0) is not None
        begun = made[0] if begun is None else begun
        late.append(max(0.0, made[k] - max(due, begun)))
        begun += late[-1] if late[-1] > clock.LATE else 0.0
        live.clock = max(live.clock, due) if full else live.clock  # it waited for room
    return late


@pytest.mark.parametrize("flood", [False, True])
@pytest.mark.parametrize("each", [0.05, 0.5, 1.2])
def test_windows_that_take_long_make_commands_wait_and_no_frame_late(each: float, flood: bool) -> None:
    live = Slowly(people.prior(), settings=Settings(steps=1, known=6, ahead=50, used=40))
    live.each = each
    assert max(lateness(live, 130, flood)) <= clock.LATE


def test_a_machine_that_cannot_keep_up_is_late_and_leaves_nothing_out() -> None:
    live = Slowly(people.prior(), settings=Settings(steps=1, known=6, ahead=50, used=40))
    live.each = 3.0
    late = lateness(live, 130, flood=False)
    assert sum(wait > clock.LATE for wait in late) == 3, "once for each window: the clock waits, then all is on time"


def test_an_error_of_the_planner_reaches_who_takes_frames() -> None:
    class Broken(Live):
        def __next__(self) -> Frame:
            raise RuntimeError("broken")

    player = Player(Broken(people.prior(), settings=QUICK)).start()
    with pytest.raises(RuntimeError, match="broken"):
        player.take(PATIENCE)
    player.stop()
    assert player.ended
