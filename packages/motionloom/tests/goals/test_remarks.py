"""What is said of words that are not English, or like nothing that was learned."""

import tomllib
from pathlib import Path

import pytest

from motionloom.core.models.networks.text.known import NEAR, Nearest
from motionloom.core.models.prior import Prior
from motionloom.goals.remarks import LINE, nearest_known, remarks_on, verb_words

PHRASES = tomllib.loads((Path(__file__).parents[4] / "benchmarks" / "unknown.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("text", "verb"),
    [
        ("vacuuming the living room", ("vacuuming",)),
        ("a chef stirs soup in a pot", ("stirs",)),
        ("a person plays golf", ("golf",)),
        ("he does a pull-up", ("pull",)),
        ("she slowly knits a scarf", ("knits",)),
        ("a person plays", ()),
        ("", ()),
    ],
)
def test_the_word_that_says_what_is_done(text: str, verb: tuple[str, ...]) -> None:
    assert verb_words(text) == verb


def test_a_verb_that_nobody_said_needs_nearer_sentences() -> None:
    """Sharing its nouns with what was learned makes no prompt known."""
    assert Nearest("a", (), 0.6, NEAR + 0.01).near
    assert not Nearest("a", (), 0.6, NEAR + 0.01, verb_known=False).near
    assert Nearest("a", (), 0.8, NEAR - 0.1, verb_known=False).near


def test_phrases_that_nobody_looked_at() -> None:
    """Of 44 that no recording shows most get a remark, of 56 that one shows few: docs/words.md has the shares."""
    prior = Prior.load("default")
    assert prior.known is not None
    called = {
        kind: [not one.near for one in nearest_known(PHRASES[kind]["judge"], prior.known, prior.text)]
        for kind in PHRASES
    }
    assert sum(called["unknown"]) >= 0.65 * len(called["unknown"])
    assert sum(called["known"]) <= 0.2 * len(called["known"])
    remarks = remarks_on(
        ["eine Person geht vorwärts", "vacuuming the living room", "a person walks"], prior.known, prior.text
    )
    assert [one.text for one in remarks] == ["eine Person geht vorwärts", "vacuuming the living room"]
    assert remarks[0].instead == ()
    assert len(remarks[1].instead) == 3
    assert remarks[1].instead[0][:20] in remarks[1].line
    assert len(remarks[1].line) <= LINE
