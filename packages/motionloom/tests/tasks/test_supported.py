"""Nobody hangs in the air or sinks into the floor, on bodies that do."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.expected import climbs, floating
from motionloom.kinematics.physics import WRISTS, J
from motionloom.kinematics.stairs import falls_from_above, hovering, in_the_air, stairs
from motionloom.requests.sampling import Sampling
from motionloom.tasks import run
from motionloom.tasks.run import Models, Plan, Result
from motionloom.tasks.supported import add_support, add_support_between, is_elevated, remarks_on_air

FPS = 20.0


def lifted(height: np.ndarray) -> Motion:
    """Somebody who stands in the rest pose, so many metres (frames,) above the floor."""
    rest = SMPL22.rest_positions()
    root = np.zeros((len(height), 3))
    root[:, 1] = rest[0, 1] - rest[[7, 8, 10, 11], 1].min() + height
    return Motion(SMPL22, FPS, root, np.tile([1.0, 0, 0, 0], (len(height), 22, 1)))


def climbing(*heights: float, seconds: float = 1.0) -> Motion:
    """From one height to the next in a fifth of a second, with a rest on each."""
    times = np.arange(0, seconds * len(heights), 1 / FPS)
    marks = [
        (number * seconds + shift, height) for number, height in enumerate(heights) for shift in (0.0, seconds - 0.2)
    ]
    return lifted(np.interp(times, *np.array(marks).T))


@pytest.mark.parametrize("heights", [(0, 0.2, 0.33, 0.55, 0.66), (0, 0.4, 0.9, 1.3), (0.7, 0.5, 0.36, 0.19, 0)])
def test_feet_come_onto_steps_of_one_height_one_after_the_other(heights: tuple[float, ...]) -> None:
    motion = add_support(climbing(*heights))
    flight = stairs(motion.positions(), FPS)
    assert flight is not None
    assert 0.14 < flight.rise < 0.21
    assert np.abs(np.diff(flight.levels)).max() <= 1
    off = [abs(hold.height - level * flight.rise) for hold, level in zip(flight.holds, flight.levels, strict=True)]
    assert max(off) < 0.03
    assert len(heights) - 2 <= flight.steps < len(heights)  # two that are nearly as high are one


def test_who_hovers_comes_down_and_who_stands_or_sits_high_stays() -> None:
    """Rising without a foothold for longer than a jump; a jump and a seat above the floor are left alone."""
    rising = lifted(np.arange(60) / FPS)
    assert hovering(rising.positions(), FPS)
    assert not hovering(add_support(rising).positions(), FPS)
    t = np.arange(60) / FPS
    jump = lifted(np.maximum(0.0, 2.5 * (t - 1) - 9.81 / 2 * (t - 1) ** 2) * (t > 1))
    for other in (jump, lifted(np.zeros(60)), lifted(np.full(60, 0.3))):
        assert add_support(other) is other


@pytest.mark.parametrize(
    ("heights", "spans"),
    [
        (np.full(60, 0.3), [(0, 60)]),
        (np.repeat([0.0, 0.3, 0.0], [20, 20, 20]), [(20, 40)]),
        (np.repeat([0.0, 0.3, 0.0], [20, 19, 20]), []),  # less than a second
        (np.full(60, 0.09), []),
        (np.zeros(60), []),
    ],
)
def test_who_is_in_the_air_for_a_second_is_found(heights: np.ndarray, spans: list[tuple[int, int]]) -> None:
    assert in_the_air(lifted(heights).positions(), FPS) == spans


def test_steps_are_something_to_stand_on() -> None:
    assert in_the_air(climbing(0, 0.2, 0.4, 0.6, 0.8).positions(), FPS) == []


@pytest.mark.parametrize(
    ("texts", "said"),
    [(["a person sits"], True), (["a person waves", "he jumps high"], False), (["she climbs a ladder"], False)],
)
def test_who_is_in_the_air_is_remarked_where_the_words_are_of_no_climb_or_jump(texts: list[str], said: bool) -> None:
    motion = lifted(np.repeat([0.0, 0.3], [20, 40]))
    remarks = remarks_on_air([motion], texts)
    assert remarks == (
        ["the person is 0.30 m above the floor from 1.0 to 3.0 s with nothing underneath"] if said else []
    )
    assert not remarks_on_air([motion], texts, floor=0.3)
    both = remarks_on_air([lifted(np.zeros(60)), motion], texts, begin_s=2.0)
    assert all("person 2" in one and "from 3.0 to 5.0 s" in one for one in both)
    assert bool(both) == said


@pytest.mark.parametrize("task", ["generate", "control", "edit", "predict", "switch", "duet"])
def test_every_task_says_who_is_in_the_air(task: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the floor y = 0, or over that of the motion that is changed or gone on from."""
    high, low = lifted(np.full(60, 0.3)), lifted(np.zeros(60))

    def sampled(plan: Plan, models: Models, progress: object) -> list[Result]:
        return [Result((high,), remarks=["first"])]

    monkeypatch.setitem(run._TASKS, task, (sampled, 1))
    plan = Plan(task=task, values=object(), sampling=Sampling())
    [result] = run.run(plan, Models())
    assert result.remarks == ["first", *result.aloft]
    assert len(result.aloft) == 1
    for people, count in (((high,), 0), ((low,), 1)):
        [result] = run.run(replace(plan, people=people), Models())
        assert len(result.aloft) == count


def test_who_falls_from_above_the_floor_stood_on_it() -> None:
    """Who stands a quarter of a metre high and then lies on the floor; who sits down up there stays."""
    high = lifted(np.full(60, 0.25))
    flat = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0])
    rotations, root = high.rotations.copy(), high.root.copy()
    rotations[40:, 0] = flat
    root[40:, 1] = 0.12
    falling = replace(high, root=root, rotations=rotations)
    assert falls_from_above(falling.positions(), FPS)
    lowest = add_support(falling).positions()[..., 1].min(axis=1)
    assert np.abs(lowest[:35]).max() < 0.03
    up_again = np.concatenate([root, high.root[:20] + np.array([0.0, 0.1, 0.0])])
    rises = replace(high, root=up_again, rotations=np.concatenate([rotations, high.rotations[:20]]))
    assert falls_from_above(rises.positions(), FPS)
    root[40:, 1] = 0.9
    seated = replace(high, root=root, rotations=rotations)
    assert not falls_from_above(seated.positions(), FPS)
    assert not falls_from_above(high.positions(), FPS)


def test_hands_come_out_of_the_floor() -> None:
    """Face down, an arm through the floor."""
    lying = lifted(np.zeros(40))
    rotations = lying.rotations.copy()
    rotations[:, 0] = rot.rotvec_to_quat(np.array([np.pi / 2, 0.0, 0.0]))
    rotations[:, J["left_shoulder"]] = rot.rotvec_to_quat(np.array([0.0, -0.5, 0.0]))
    root = lying.root.copy()
    root[:, 1] = 0.15
    lying = replace(lying, root=root, rotations=rotations)
    assert lying.positions()[:, WRISTS[0], 1].max() < -0.05
    assert add_support(lying).positions()[:, WRISTS, 1].min() > 0.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("A teenager walks upstairs.", True),
        ("the fireman goes up a ladder", True),
        ("she climbs onto the box", True),
        ("walking down the steps to the basement", True),
        ("he takes two steps back", False),
        ("a person walks", False),
    ],
)
def test_words_of_stairs_ladders_and_climbing(text: str, expected: bool) -> None:
    assert climbs(["a person waves", text]) is expected


def test_steps_come_only_where_they_may_and_other_frames_stay() -> None:
    flight = climbing(0, 0.2, 0.33, 0.55, 0.66)
    level = add_support(flight, stairs=False)
    assert floating(flight.positions(), FPS)
    assert not floating(level.positions(), FPS)
    assert level.positions()[..., 1].min() > -0.05
    rising = lifted(np.arange(60) / FPS)
    part = add_support_between(rising, [(30, 50)])
    whole = add_support(rising)
    assert not np.array_equal(whole.root, rising.root)
    for at, expected in ((slice(0, 30), rising), (slice(30, 50), whole), (slice(50, 60), rising)):
        assert np.array_equal(part.root[at], expected.root[at])
        assert np.array_equal(part.rotations[at], expected.rotations[at])


def test_who_climbed_begins_or_ends_above_the_floor() -> None:
    up, down = (0, 0.2, 0.33, 0.55, 0.66), (0.7, 0.5, 0.36, 0.19, 0)
    assert [is_elevated(add_support(climbing(*heights))) for heights in (up, down)] == [True, True]
    assert not is_elevated(lifted(np.interp(np.arange(60), [20, 30, 40], [0.0, 0.5, 0.0])))


def test_who_goes_up_and_down_again_comes_back_to_the_floor_and_who_falls_at_once_stays_up() -> None:
    back = add_support(climbing(0, 0.21, 0.38, 0.55, 0.35, 0.2, 0, 0))
    flight = stairs(back.positions(), FPS)
    assert flight is not None
    assert flight.steps == 3
    assert (flight.levels[0], flight.levels[-1]) == (0, 0)
    assert np.abs(np.diff(flight.levels)).max() <= 1
    assert not is_elevated(back)
    assert is_elevated(add_support(climbing(0, 0.21, 0.38, 0.55, 0, 0)))
