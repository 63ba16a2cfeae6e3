"""Words that bring hands together, and those that do not."""

import pytest

from motionloom.goals.contact import read_contact


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("two people shake hands", "shake hands"),
        ("They shake each other's hands, then part.", "shake hands"),
        ("a friendly handshake", "shake hands"),
        ("two friends high-five", "give a high five"),
        ("give each other a high five", "give a high five"),
        ("two people give a high ten", "give a high ten"),
        ("they bump fists", "bump fists"),
        ("two people are hugging", "hug"),
        ("one embraces the other", "hug"),
        ("two people push each other", "touch as the first pushes"),
        ("a person pushes another person", "touch as the first pushes"),
        ("a couple walks hand in hand", "hold hands"),
        ("two people dance together", "hold hands"),
        ("two people fight", "are near"),
    ],
)
def test_what_is_read(words: str, name: str) -> None:
    contact = read_contact((words, words))
    assert contact is not None
    assert contact.name == name
    assert name in str(contact)


@pytest.mark.parametrize(
    "words",
    [
        "two people push a car",
        "they bow without shaking hands",
        "two people clap their hands",
        "they do not hug",
        "two people walk side by side",
        "one waves with the right hand",
        "they raise their hands high five times",
    ],
)
def test_what_is_not_read(words: str) -> None:
    assert read_contact((words, words)) is None


def test_whoever_pushes_has_the_hands() -> None:
    pushes, falls = "a person pushes the other", "a person falls"
    for prompts, person in (((pushes, falls), 0), ((falls, pushes), 1)):
        contact = read_contact(prompts)
        assert contact is not None
        assert {touch.person for way in contact.ways for touch in way} == {person}


def test_people_who_walk_hold_hands_side_by_side() -> None:
    walking, dancing = (read_contact((words, words)) for words in ("they walk holding hands", "they dance together"))
    assert walking is not None
    assert dancing is not None
    assert (walking.turn, dancing.turn) == ("beside", "any")
