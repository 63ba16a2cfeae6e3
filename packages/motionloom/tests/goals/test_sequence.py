"""Sentences of several actions: what follows each other is parted, what happens at once is not."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.goals.seconds import SHORTEST, natural_seconds
from motionloom.goals.sequence import MOST_PARTS, Part, lengths, split_actions

SEQUENCES = {
    "a person walks forward, then sits down": ["a person walks forward", "a person sits down"],
    "a person walks and then waves": ["a person walks", "a person waves"],
    "a person jumps. Then he kicks": ["a person jumps", "a person kicks"],
    "someone waves and afterwards bows": ["someone waves", "someone bows"],
    "a man runs; after that he lies down": ["a man runs", "a man lies down"],
    "the woman walks, turns around and sits down": ["the woman walks", "the woman turns around", "the woman sits down"],
    "a person walks, jumps, and waves": ["a person walks", "a person jumps", "a person waves"],
    "a person walks to a chair and sits down": ["a person walks to a chair", "a person sits down"],
    "a person stands up and walks away": ["a person stands up", "a person walks away"],
    "a person walks forward and stops": ["a person walks forward", "a person stops"],
    "a person sits down and waves": ["a person sits down", "a person sits and waves"],
    "a person walks forward and turns around": ["a person walks forward", "a person turns around"],
    "a person turns left and walks": ["a person turns left", "a person walks"],
    "a person walks and runs": ["a person walks", "a person runs"],
    "a person runs forward and jumps": ["a person runs forward", "a person jumps"],
    "a person walks, sits down": ["a person walks", "a person sits down"],
    "a person walks before sitting down": ["a person walks", "a person sits down"],
    "before sitting down, a person walks": ["a person walks", "a person sits down"],
    "a person sits down after walking in a circle": ["a person walks in a circle", "a person sits down"],
    "after jumping twice, a man bows": ["a man jumps twice", "a man bows"],
    "a person waves before he turns around": ["a person waves", "a person turns around"],
    "walk forward and then sit down": ["walk forward", "sit down"],
    "walk, turn around and sit down": ["walk", "turn around", "sit down"],
    "a person walked forward then sat down": ["a person walked forward", "a person sat down"],
    "a person walked forward and sat down": ["a person walked forward", "a person sat down"],
    "a tall man slowly walks and then quickly sits": ["a tall man slowly walks", "a tall man quickly sits"],
    "a zombie walks, then falls down": ["a zombie walks", "a zombie falls down"],
    "a person waves with both hands and then jumps up and down": [
        "a person waves with both hands",
        "a person jumps up and down",
    ],
    "a person walks while waving and then sits down": ["a person walks while waving", "a person sits down"],
    "a person picks up a box, walks forward and puts it down": [
        "a person picks up a box",
        "a person walks forward",
        "a person puts the box down",
    ],
    "a person walks forward then does a handstand": ["a person walks forward", "a person does a handstand"],
    "a person walks and waves and then sits down": ["a person walks and waves", "a person sits down"],
    "someone crouches down and stands back up": ["someone crouches down", "someone stands back up"],
    "a person walks in a circle, followed by sitting down": ["a person walks in a circle", "a person sits down"],
    "walking to a chair and sitting down": ["a person walks to a chair", "a person sits down"],
    "a man is walking to a chair and taking a seat": ["a man walks to a chair", "a man takes a seat"],
    "getting out of bed, then stretching": ["a person gets out of bed", "a person stretches"],
    "first he jumps, then he speeds up": ["he jumps", "he speeds up"],
    "crouching down first, then jumping up": ["a person crouches down", "a person jumps up"],
    "a person is directing traffic, then sits down": ["a person is directing traffic", "a person sits down"],
    "walk and stop": ["walk", "stop"],
    "she kicks, and a second later punches": ["she kicks", "she punches"],
    "he raises one hand high, and a moment later bows": ["he raises one hand high", "he bows"],
    "a person jumps. Moments later he sits down": ["a person jumps", "a person sits down"],
    "a man saunters in, then waves": ["a man saunters in", "a man waves"],
    "a person sits down, waits and gets up": ["a person sits down", "a person gets up"],
    "a person stops and waits": ["a person stops", "a person waits"],
    "a man walks to the sofa, lies down and sleeps": ["a man walks to the sofa", "a man lies down"],
    "a man walks, notices something, and runs away": ["a man walks", "a man notices something", "a man runs away"],
    "a person walks in, notices the dog and waves": [
        "a person walks in",
        "a person notices the dog",
        "a person waves",
    ],
    "a person stands next to a wall, then walks": ["a person stands next to a wall", "a person walks"],
    "he leaves after he hits the ball": ["he hits the ball", "he leaves"],
    "they sit down after they walk home": ["they walk home", "they sit down"],
    "he falls, gets up, and runs": ["he falls", "he gets up", "he runs"],
    "a man waits for the bus, then sits down": ["a man waits for the bus", "a man sits down"],
    "a person walks because he is late, then sits down": ["a person walks because he is late", "a person sits down"],
    "a man jumps, next he bows": ["a man jumps", "a man bows"],
    # what the second part leaves out is said again
    "a person kicks with the right foot, then with the left": [
        "a person kicks with the right foot",
        "a person kicks with the left foot",
    ],
    "the left hand goes up, after that the right one": ["the left hand goes up", "the right hand goes up"],
    "someone does a kick followed by a punch": ["someone does a kick", "someone does a punch"],
    "a person walks forward, turns around and walks back": [
        "a person walks forward",
        "a person turns around",
        "a person walks forward",
    ],
    "she sits down on a chair, then gets back up": ["she sits down on a chair", "she stands up again"],
    "a man takes a seat and gets back on his feet": ["a man takes a seat", "a man stands up again"],
    "grandpa gets up out of his chair and walks away": ["grandpa gets up out of his chair", "grandpa walks away"],
    "she sits down on the floor, then comes back up": ["she sits down on the floor", "she stands up from the floor"],
    # what only ends an action stays with it
    "a person bows, straightens up and walks away": ["a person bows and straightens up", "a person walks away"],
}

WHOLES = [
    # clauses of time, place and reason are no actions, and counted steps end by themselves
    "an exhausted soldier drags himself along the road after a long march",
    "take three steps and stop",
    "take three steps forward and stop",
    "a person walks five steps and stops",
    "a person walks until he reaches the wall and stops",
    "a girl skips before the big jump",
    "she stretches after the morning run",
    "he walks through the door that opens and closes",
    "a guard who walks and stops is bored",
    "somebody takes a run-up and leaps",
    "the woman bends down and grabs a coin off the floor",
    "a man stumbles and falls forward",
    "bend over with straight legs and reach your fingers down to your feet",
    "a person stands next to a wall",
    "she walks slowly before the judges sit down",
    "a man jumps because he won the race and cheers",
    "a woman waves when her friend arrives and smiles",
    "a man walks home after work",
    "he sits down because he is tired",
    "he runs as if chased by a bear",
    "a man limps since he fell and hurt his knee",
    "where the road ends, a man turns around",
    "when the music stops, a dancer freezes",
    "after the fight, a boxer raises his arms",
    "a person runs so that he catches the bus",
    "in the evening, a man walks home and rests",
    "a man walks where people sit and drink",
    "if he falls, he gets up",
    "a kid runs before dinner",
    "a person walks to the place where she sat and slept",
    "a tired man yawns after the long walk",
    "a nurse sits down after a hard run",
    "a soldier crawls before the last jump",
    "a person looks at the dog that jumps and runs",
    "a person walks",
    "a person bows, then straightens up",
    "a person ducks and comes right back up",
    "a person crouches and stays there",
    "a person squats once and stands back up",
    "walking and waving",
    "a person standing, stretching the right arm out",
    "a person is dancing, moving around a little",
    "a person is walking and waving",
    "a person waves with both hands",
    "a person jumps up and down",
    "a person walks back and forth",
    "a person walks and waves",
    "a person waves and walks forward",
    "a person runs with arms and legs moving quickly",
    "a person stands and waves",
    "a person sits and claps",
    "a person nods and waves",
    "a person jumps and waves",
    "a person walks forward and turns left",
    "a person punches and kicks",
    "a person throws kicks and punches",
    "a person does squats and lunges",
    "a person dances and spins",
    "a person walks while waving",
    "a person walks, waving the left hand",
    "a person looks left and right",
    "someone sits down on a chair and waits",
    "a man lies down and goes to sleep",
    "a dog sits down and remains seated",
    "sit down, then wait for five seconds",
    "a person stands before a door",
    "a person runs after a ball",
    "a person waves now and then",
    "a person walks slowly, with a limp",
    "a slow, careful walk",
    "someone moves their arms up, down, left and right",
    "a person holds a box and walks",
    "walk and wave",
    "",
    "then",
    "before",
    "and",
]


@pytest.mark.parametrize("text", SEQUENCES)
def test_what_follows_each_other_is_parted(text: str) -> None:
    assert [part.text for part in split_actions(text)] == SEQUENCES[text]


@pytest.mark.parametrize("text", WHOLES)
def test_what_happens_at_once_stays_whole(text: str) -> None:
    assert [part.text for part in split_actions(text)] == [text]


def test_a_whole_sentence_stays_as_it_was_written() -> None:
    assert split_actions("  A person  Waves. ")[0].text == "  A person  Waves. "


def test_a_list_without_end_stays_whole() -> None:
    assert len(split_actions("a person walks" + ", then jumps" * MOST_PARTS)) == 1


@pytest.mark.parametrize(
    ("shorter", "longer"),
    [
        ("a person jumps", "a person jumps three times"),
        ("a person squats", "a person does five squats"),
        ("a person walks", "a person walks slowly"),
        ("a person runs quickly", "a person runs"),
        ("a person takes two steps", "a person takes six steps"),
        ("a person jumps", "a person walks in a circle"),
        ("a person turns around", "a person dances"),
    ],
)
def test_more_takes_longer(shorter: str, longer: str) -> None:
    assert natural_seconds(shorter) < natural_seconds(longer)


def test_seconds_in_words_are_taken() -> None:
    assert natural_seconds("a person waves for 7 seconds") == 7
    assert natural_seconds("a person waves for three seconds") == 3


def test_a_posture_lasts_as_long_as_the_rest_that_follows_it() -> None:
    assert [part.seconds for part in split_actions("a person sits down, waits for 8 seconds and gets up")] == [11, 3]
    assert split_actions("a person sits down and waits")[0].seconds == 6


def test_lengths_add_up_to_what_is_asked() -> None:
    """10 s over 4 and 2.5 s: each keeps its least, 1.2 s, and what is free goes as 2.8 to 1.3."""
    parts = (Part("walks", 4.0), Part("jumps", 2.5))
    first, second = lengths(parts, 10.0)
    assert first + second == pytest.approx(10)
    assert first == pytest.approx(1.2 + 7.6 * 2.8 / 4.1, abs=0.03)


def test_natural_lengths_stay_where_nothing_is_asked() -> None:
    assert lengths((Part("walks", 4.0), Part("jumps", 2.5))) == [4.0, 2.5]


@given(st.lists(st.floats(1.2, 12), min_size=1, max_size=9), st.floats(0.5, 60))
def test_no_part_is_left_without_time(natural: list[float], seconds: float) -> None:
    parts = [Part("x", length) for length in natural]
    seconds_each = lengths(parts, seconds)
    assert sum(seconds_each) == pytest.approx(seconds, abs=0.026)
    assert min(seconds_each) >= min(SHORTEST, seconds / len(parts)) - 0.051


WORDS = (
    "a person walks sits down and then , before after sitting waves . ; while turn 3 times twice left right the other"
    " on leg repeat switches raises lowers arm it hold for seconds return to standing up again back forward lunge"
)
words = st.lists(st.sampled_from(WORDS.split()), max_size=12)


@given(words.map(" ".join) | st.text(max_size=60))
@settings(max_examples=300, deadline=None)
def test_whatever_is_said_has_parts_with_words_and_time(text: str) -> None:
    parts = split_actions(text)
    assert len(parts) >= 1
    assert len(parts) == 1 or all(part.text.strip() for part in parts)
    assert all(SHORTEST <= part.seconds <= 60 for part in parts)
