"""Common verbs for rare ones."""

import pytest

from motionloom.goals.expected import expectations_of
from motionloom.goals.verbs import MOODS, PLAINER, base_of, in_plainer_words, kind_of_verb


@pytest.mark.parametrize(
    ("text", "plainer"),
    [
        ("a soldier saunters home through the snow", "a soldier walks home through the snow"),
        ("Saunter over to the bar", "Walk over to the bar"),
        ("he is swaggering, and then waves", "he is walking, and then waves"),
        ("she waddled to the door", "she walked to the door"),
        ("kids scurried away", "kids ran away"),
        ("an old lady hobbles along", "an old lady walks slowly along"),
        ("he moonwalks", "he walks backwards"),
        ("she topples over", "she falls down and lies there"),
        ("a man faints", "a man falls down and lies there"),
        ("he crumples", "he falls down and lies there"),
        # phrases
        ("a child sits on the floor", "a child sits on the floor with crossed legs"),
        (
            "Sitting down there on the ground, she sings",
            "Sitting down there on the ground with crossed legs, she sings",
        ),
        ("he sat quietly on the rug with crossed legs", "he sat quietly on the rug with crossed legs"),
        ("she sits on the chair", "she sits on the chair"),
        ("standing on one leg, he pulls his knee up", "he lifts his knee up"),
        ("she is drawing the left knee to her chest", "she is lifting the left knee to her chest"),
        ("walk ahead, then take a right at the corner", "walk ahead, then turn right at the corner"),
        ("he takes a left hook", "he takes a left hook"),
        ("Hang a left", "Turn left"),
        ("she reversed direction", "she turned around"),
        ("a man rests motionless on his back", "a man lies motionless on his back"),
        ("a man went to sleep", "a man lay down"),
        ("getting out of her seat", "standing up from her seat"),
        ("a man makes his way to the bar", "a man walks to the bar"),
        ("she heads for the door", "she walks to the door"),
        ("he turns his head to the left", "he turns his head to the left"),
        ("slams on the brakes", "stops"),
        ("crawling backward on her hands and knees", "crawling backwards on all fours"),
        ("a backward roll", "a backward roll"),
        ("a soldier falls backward", "a soldier falls backwards and lies there"),
        ("he stumbles and falls to the ground", "he stumbles and falls down and lies there"),
        ("she fell flat on her face", "she collapsed slowly forward"),
        ("swaying and nearly falling over", "swaying and nearly falling over"),
        ("he almost falls, then falls asleep", "he almost falls, then falls asleep"),
        ("a man drops to the floor", "a man falls down and lies there"),
        ("he drops to one knee", "he kneels down"),
        ("he falls to his knees", "he falls to his knees"),
        ("tired walk, shoulders slumped", "tired walk, shoulders slumped"),
        ("she jogs on the spot, happily", "she hops from one foot to the other, happily"),
        ("walks along a tightrope", "walks along a line"),
        ("she walks on a narrow beam", "she walks along a line"),
        ("he pushes the door open", "he pushes the door open"),
        ("someone slowly lowers both arms again", "someone slowly stands"),
        # nouns, and what is common already
        ("a guard on patrol walks", "a guard on patrol walks"),
        ("the march home", "the march home"),
        ("he is on a trek", "he is on a trek"),
        ("a person walks", "a person walks"),
        ("", ""),
    ],
)
def test_a_rare_verb_is_replaced_in_its_form(text: str, plainer: str) -> None:
    assert in_plainer_words(text) == plainer
    assert in_plainer_words(plainer) == plainer


@pytest.mark.parametrize("rare", sorted(PLAINER))
def test_what_replaces_a_verb_is_of_its_kind_and_is_looked_for(rare: str) -> None:
    """So that the first motion is kept where it shows the action already."""
    verb, _, rest = PLAINER[rare].partition(" ")
    assert kind_of_verb(rare, rare) == kind_of_verb(verb, verb)
    assert verb not in PLAINER
    third = next(form for form, base in MOODS["third"].items() if base == rare)
    sentence = in_plainer_words(f"a person {third} to the left")
    assert sentence.startswith(f"a person {next(form for form, base in MOODS['third'].items() if base == verb)} {rest}")
    assert base_of(third) == rare
    assert expectations_of(sentence), sentence
