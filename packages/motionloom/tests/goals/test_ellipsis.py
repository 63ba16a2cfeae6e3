"""Parts of a sentence that say only what is different from the part before, or that the part before once more."""

import pytest

from motionloom.goals.sequence import MOST_PARTS, split_actions

PARTS = {
    # the side, the way, the number, the pace
    "a person walks forward then backward": ["a person walks forward", "a person walks backwards"],
    "a person punches twice with the right, then once with the left": [
        "a person punches twice with the right",
        "a person punches with the left once",
    ],
    "the man takes three steps forward, then two back": [
        "the man takes three steps forward",
        "the man takes two steps backwards",
    ],
    "the figure side steps to the left three times, then three times to the right": [
        "the figure sidesteps to the left three times",
        "the figure sidesteps to the right three times",
    ],
    "turn 90 degrees to the left, then 180 to the right": [
        "turn 90 degrees to the left",
        "turn 180 degrees to the right",
    ],
    "walks slowly, then faster": ["walks slowly", "walks faster"],
    "waves with the right hand, then with both": ["waves with the right hand", "waves with both hands"],
    "the person walks up the stairs and then down again": [
        "the person walks up the stairs",
        "the person walks down the stairs",
    ],
    "moves to the right, then left, then right again": [
        "moves to the right",
        "moves to the left",
        "moves to the right",
    ],
    # the other side of all of it
    "a person lunges forward with the left leg, then repeats on the other side": [
        "a person lunges forward with the left leg",
        "a person lunges forward with the right leg",
    ],
    "bends to the left, then does the same on the right": ["bends to the left", "bends to the right"],
    "stands on the left leg, then switches to the right leg": ["stands on the left leg", "stands on the right leg"],
    "a person raises the left knee, then switches legs": [
        "a person raises the left knee",
        "a person raises the right knee",
    ],
    "raises her right hand, then the other one": ["raises her right hand", "raises her left hand"],
    "a person bows, then does it again": ["a person bows", "a person bows"],
    # back to where it began
    "she kneels, then returns to standing": ["she kneels", "she stands up"],
    "he crouches down, then gets up again": ["he crouches down", "he stands up again"],
    "he turns and walks away": ["he turns around", "he walks away"],
    "he lies down on his back and then slowly sits up": ["he lies down on his back", "he sits on the floor"],
    "step forward into a lunge, hold for three seconds, and return to standing": [
        "step forward into a lunge",
        "stand up",
    ],
    "a person does a squat and returns to the starting position": [
        "a person does a squat and returns to the starting position"
    ],
    "step into a lunge with the right foot, hold for three seconds, return to standing. Repeat on the left": [
        "step into a lunge with the right foot",
        "stand up",
        "step into a lunge with the left foot",
        "stand up",
    ],
    "reach your left arm over your head and lean to the right; hold for a count of eight, then the other side": [
        "reach your left arm over your head",
        "lean to the right",
        "lean to the left",
    ],
    "Lunge forward with the left leg, hold for two seconds, and return; repeat three times": [
        "Lunge forward with the left leg",
        "stand up",
    ]
    * 3,
    # again and again
    "raise your right arm, lower it, and repeat three times": ["raise your right arm", "lower your right arm"] * 3,
    "a person sits down and stands up three times": ["a person sits down", "a person stands up"] * 3,
    "he raises both arms, then lowers them, twice": ["he raises both arms", "he lowers both arms"] * 2,
    "leans left, then right, 2 reps": ["leans left", "leans right"] * 2,
    "hops on the right foot three times, then on the left three times": [
        "hops on the right foot three times",
        "hops on the left foot three times",
    ],
    # what comes before the action
    "victory emote: waves, then bows": ["waves", "bows"],
    "he walks, then waves at the end with a smile": ["he walks", "he waves at the end with a smile"],
    "a hiker walks, stops to wipe the forehead and goes on": [
        "a hiker walks",
        "a hiker stops",
        "a hiker wipes the forehead",
        "a hiker goes on",
    ],
    # what was named last is no measure
    "he picks up a box, carries it a few steps and sets it down": [
        "he picks up a box",
        "he carries the box a few steps",
        "he sets the box down",
    ],
    # the end of a bend
    "he bends down to touch his toes, comes up and waves": [
        "he bends down to touch his toes and comes up",
        "he waves",
    ],
    # hands and heads leave nobody standing up
    "he sits down, and puts his head in his hands": ["he sits down", "he sits and puts his head in his hands"],
    # nothing in the part before that could be different
    "a person dances, then up": ["a person dances", "a person up"],
    "a person takes three big and two small steps, then four": [
        "a person takes three big and two small steps",
        "a person four",
    ],
}


@pytest.mark.parametrize("text", PARTS)
def test_a_part_says_all_by_itself(text: str) -> None:
    assert [part.text for part in split_actions(text)] == PARTS[text]


def test_more_repetitions_than_parts_are_left_as_they_are() -> None:
    assert len(split_actions(f"sits down and stands up {MOST_PARTS // 2} times")) == MOST_PARTS
    assert len(split_actions(f"sits down and stands up {MOST_PARTS} times")) == 2
    assert len(split_actions(f"sits down and stands up {10**30} times")) == 2


def test_a_gesture_that_is_repeated_holds_nothing() -> None:
    assert [part.seconds for part in split_actions("raises both arms, then lowers them, twice")] == [2.0] * 4


def test_a_lunge_lasts_as_long_as_it_is_held() -> None:
    parts = split_actions("step forward into a lunge, hold for three seconds, and return to standing")
    assert parts[0].seconds == 7
