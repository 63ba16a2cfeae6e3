"""What a sentence says of a head."""

import pytest

from motionloom.core.models.prior import Prior
from motionloom.goals.heads import HeadMove, head_said
from motionloom.goals.remarks import remarks_on

AROUND = HeadMove("looks around", 55.0, 0.0)


@pytest.mark.parametrize(
    ("text", "move"),
    [
        ("a man nods twice", HeadMove("nods", 0.0, -20.0, 2)),
        ("she slowly shakes her head no", HeadMove("shakes", 25.0, 0.0, 0, 1.5)),
        ("a person walks and looks around", AROUND),
        ("a guard looks nervously left and right", AROUND),
        ("she looks up at the sky", HeadMove("looks", 0.0, 30.0)),
        ("he looks to the left", HeadMove("looks", 55.0, 0.0)),
        ("a girl turns her head to the right", HeadMove("looks", -55.0, 0.0)),
        # other words of the sentence are not the head's
        ("a person walks to the left and looks up", HeadMove("looks", 0.0, 30.0)),
        # neither a head nor a way to turn it
        ("he nods off", None),
        ("two people shake hands", None),
        ("he looks at his watch", None),
        ("a man looks around for his keys", None),
        ("she looks up the word", None),
        ("a person walks to the left", None),
        ("turns left 90 degrees", None),
    ],
)
def test_a_sentence_says_what_a_head_does(text: str, move: HeadMove | None) -> None:
    assert head_said(text) == move


def test_what_a_head_does_is_no_unknown_word() -> None:
    """Where heads are turned; a sentence that does something else is judged as before."""
    prior = Prior.load("default")
    texts = ["somebody shakes their head no", "a person vacuums and looks around"]
    assert [one.text for one in remarks_on(texts, prior.known, prior.text, heads=True)] == texts[1:]
    assert texts[0] in [one.text for one in remarks_on(texts, prior.known, prior.text)]
