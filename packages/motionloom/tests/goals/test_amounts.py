"""Numbers with units in sentences: what is read, what is not, and the goals that come of it."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.goals.amounts import goal_for, is_met, measured, read_amount, read_seconds, seconds_for
from motionloom.goals.seconds import natural_seconds
from motionloom.goals.timeline import timeline_of

READ = {
    "turn left 90 degrees": "a turn of 90 degrees to the left",
    "a person turns left 90 degrees": "a turn of 90 degrees to the left",
    "a person turns 90 degrees to the right": "a turn of 90 degrees to the right",
    "turn right by 45°": "a turn of 45 degrees to the right",
    "she rotates 30 degrees clockwise": "a turn of 30 degrees to the right",
    "he rotates 120 degrees counterclockwise": "a turn of 120 degrees to the left",
    "a man spins 360 degrees": "a turn of 360 degrees to the left",
    "a person turns ninety degrees to their left": "a turn of 90 degrees to the left",
    "a person makes a quarter turn to the left": "a turn of 90 degrees to the left",
    "a person turns, a quarter turn to the right": "a turn of 90 degrees to the right",
    "a person walks 3 meters forward": "3 m forward",
    "walks three metres": "3 m forward",
    "a man walks 10m": "10 m forward",
    "a man runs 10 meters": "10 m forward",
    "a man slowly walks 150 cm backwards": "1.5 m backward",
    "a woman steps back one meter": "1 m backward",
    "a person sidesteps 2 meters to the left": "2 m to the left",
    "a person walks sideways to the right for 2 meters": "2 m to the right",
    "a baby crawls 2 meters forward": "2 m forward",
    "a person walks 10 feet": "3.048 m forward",
    "take three steps forward and stop": "3 steps forward",
    "a person walks five steps": "5 steps forward",
    "a person takes two steps back": "2 steps backward",
    "he takes a step forward": "1 step forward",
    "he takes a small step back": "1 step backward",
    "she takes 4 big steps": "4 steps forward",
    "take two steps to the right": "2 steps to the right",
    "a person walks backwards in a half circle to the right": "an arc of 180 degrees backwards to the right",
    "a person walks in a half circle to the left": "an arc of 180 degrees to the left",
    "someone runs in a quarter circle to the right": "an arc of 90 degrees to the right",
}
UNREAD = [
    "a man of 25 years walks",
    "a 25 year old man walks",
    "two people walk",
    "a person waves with both hands",
    "a person raises one hand",
    "a person walks with two hands up",
    "a person walks on two feet",
    "agent 47 walks",
    "a person walks",
    "a person turns left",
    "a person turns around",
    "a person turns his head 45 degrees to the left",
    "a person raises the arm 90 degrees",
    "a person bends 90 degrees to the left",
    "a person throws a ball 10 meters",
    "a person jumps 2 meters forward",
    "a person jumps and turns 180 degrees to the left",
    "a person does a 360 degree spin kick to the left",
    "a person turns 90 degrees",
    "a person turns left 90 degrees and right 90 degrees",
    "a person walks to a wall 3 meters away",
    "a person walks along a 3 meter wall",
    "a person walks under a pole 2 meters high",
    "a person walks 3 meters to the left",
    "a person walks in a circle of 3 meters",
    "a person walks back and forth 3 meters",
    "a person climbs three steps",
    "a person walks up five steps of stairs",
    "a person dances three steps",
    "a person takes a few steps forward",
    "a person takes several steps",
    "a person walks in a half circle",
    "a person runs 10 kilometers",
    "a person walks 1000 meters",
    "a person takes three steps left and two steps right",
    "a person picks up a box 2 meters in front",
]


@pytest.mark.parametrize("text", READ)
def test_numbers_with_units_are_read(text: str) -> None:
    assert str(read_amount(text)) == READ[text]


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("he turns around", "a turn of 180 degrees to the left"),
        ("turns around to face the other way", "a turn of 180 degrees to the left"),
        ("turn around to the right", "a turn of 180 degrees to the right"),
        ("she turns around the corner", "None"),
        ("turns to the left", "a turn of 90 degrees to the left"),
        ("he turns sharply right", "a turn of 90 degrees to the right"),
        ("he turns right while walking", "None"),
        ("she turns her head to the left", "None"),
        ("he turns around twice", "a turn of 720 degrees to the left"),
    ],
)
def test_between_other_actions_turning_around_is_half_a_turn(text: str, read: str) -> None:
    assert str(read_amount(text, around=True)) == read


@pytest.mark.parametrize("text", UNREAD)
def test_what_may_mean_something_else_is_not(text: str) -> None:
    assert read_amount(text) is None


def test_durations() -> None:
    assert read_seconds("a person waves for ten seconds") == 10
    assert read_seconds("a person waves for half a minute") == 30
    assert read_seconds("a person waits for a minute") == 60
    assert read_seconds("a person sits down for a second") is None
    assert read_seconds("a person sits for one second") == read_seconds("a person sits for a full second") == 1
    assert read_seconds("a person waits for 90 minutes") is None
    assert read_seconds("a person waits for a bus") is None


@pytest.mark.parametrize("text", ["a man of 25 years walks", "a man lifts two hands", "a person walks 10 meters"])
def test_units_are_no_repetitions(text: str) -> None:
    assert natural_seconds(text) <= 4.0
    assert natural_seconds("a person does five squats") > natural_seconds("a person does one squat")


@pytest.mark.parametrize("text", [text for text in READ if read_amount(text)])
@pytest.mark.parametrize("more", [0.0, 20.0])
def test_a_goal_ends_where_the_words_say(text: str, more: float) -> None:
    """Its last frame has the turn or the way, its first the origin, and nobody is faster than a sprinter."""
    amount = read_amount(text)
    assert amount is not None
    goal = goal_for(amount, seconds_for(amount) + more)
    moved = goal.positions[-1, 0] - goal.positions[0, 0]
    side = 1 if amount.direction == "left" else -1
    if amount.kind == "turn":
        assert np.degrees(goal.facing[-1]) == pytest.approx(side * amount.size)
        assert not goal.mask.any()
        return
    if amount.kind != "arc":
        assert np.hypot(moved[0], moved[2]) == pytest.approx(amount.metres)
    assert (moved[0] * side > 0.3) == (amount.direction in ("left", "right"))
    if amount.direction in ("forward", "backward"):
        assert (moved[2] > 0) == (amount.direction == "forward")
    assert np.linalg.norm(np.diff(goal.positions[:, 0], axis=0), axis=-1).max() * 20 < 6


def test_a_motion_that_stands_misses() -> None:
    amount = read_amount("turn left 90 degrees")
    assert amount is not None
    still = np.zeros((10, 22, 3))
    still[:, [2, 17], 0], still[:, [1, 16], 0] = -0.1, 0.1
    assert measured(amount, still) == 0
    assert not is_met(amount, 0)


def test_repetitions_are_strokes_one_after_the_other() -> None:
    """Slow strokes are segments of their own, quick ones follow each other in one; the number is out of their words."""
    squats = timeline_of("a person does three squats", amounts=True)
    assert [segment.text for segment in squats.segments] == ["a person does squats"] * 3
    assert [(one.first, one.end) for one in squats.readings] == [(0, 3)]
    assert len(timeline_of("a person does five jumping jacks", amounts=True).segments) == 1
    two = timeline_of("a person walks 2 meters, then jumps twice", amounts=True)
    assert [(one.first, one.end) for one in two.readings] == [(0, 1), (1, 3)]
    assert sum(segment.seconds for segment in timeline_of("a person kicks twice", 3.0, amounts=True).segments) == 3


def test_a_sentence_becomes_segments_with_goals() -> None:
    text = "a person walks 3 meters forward, then turns right 90 degrees and sits down"
    segments = timeline_of(text, amounts=True).segments
    assert [segment.goal is not None for segment in segments] == [True, True, False]
    assert all(segment.goal is None for segment in timeline_of(text).segments)
    assert timeline_of("a person waves for ten seconds", amounts=True).seconds == 10


def test_ways_that_nobody_goes() -> None:
    """More than a minute of crawling is left to the network; a time in which nobody runs so far is refused."""
    assert timeline_of("a baby crawls 100 meters", amounts=True).segments[0].goal is None
    with pytest.raises(MotionloomError, match="nobody runs faster"):
        timeline_of("a man runs 100 meters", 2.0, amounts=True)
