"""Who of two people does what."""

import pytest

from motionloom.core.errors import MotionloomError
from motionloom.goals.roles import prompts_of, without_two


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("one person bows and the other waves", ("a person bows", "a person waves")),
        ("one throws a ball, the other catches it", ("a person throws a ball", "a person catches it")),
        ("The first person sits down while the second one claps.", ("a person sits down", "a person claps")),
        ("a man dances and another man claps", ("a man dances", "a man claps")),
        ("one of them kneels; the other stands still", ("a person kneels", "a person stands still")),
        ("one person pushes the other and the other falls", ("a person pushes the other", "a person falls")),
        ("a person walks :: another: waits", ("a person walks", "another: waits")),
    ],
)
def test_each_has_words(words: str, expected: tuple[str, str]) -> None:
    assert prompts_of(words) == expected


@pytest.mark.parametrize(
    "words",
    [
        "two people dance",
        "a person pushes another person",
        "one hand up and the other hand down",
        "a person lifts one leg and the other leg",
        "one bows and the other does the same",
        "one after the other",
    ],
)
def test_what_is_for_both(words: str) -> None:
    assert prompts_of(words) == (words, words)


@pytest.mark.parametrize("wrong", ["a ::", ":: b", "a :: b :: c", "::"])
def test_a_part_without_words_is_refused(wrong: str) -> None:
    with pytest.raises(MotionloomError, match="around one ::"):
        prompts_of(wrong)


def test_what_two_do_without_who_they_are() -> None:
    sentences = (
        "two people dance salsa",
        "A couple dances salsa",
        "both wave",
        "two dancers perform a salsa",
        "a person waves",
    )
    expected = ["dance salsa", "dances salsa", "wave", "perform a salsa", "a person waves"]
    assert [without_two(text) for text in sentences] == expected
