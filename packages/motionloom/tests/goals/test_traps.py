"""Sentences that mean something else than their words do one by one, against a table that was written for each kind."""

import tomllib
from pathlib import Path

import pytest

from motionloom.goals.amounts import read_amount, read_seconds, unread_numbers
from motionloom.goals.expected import expectations_of
from motionloom.goals.remarks import numbers_read
from motionloom.goals.roles import tells_of_several
from motionloom.goals.sequence import split_actions
from motionloom.goals.timeline import timeline_of
from motionloom.goals.verbs import in_plainer_words

TABLE = tomllib.loads((Path(__file__).parent / "traps.toml").read_text(encoding="utf-8"))
EXPECTED = [(kind, *row) for kind, rows in TABLE["expected"].items() for row in rows.items()]


@pytest.mark.parametrize(("kind", "text", "names"), EXPECTED)
def test_nothing_is_asked_that_the_words_do_not_say(kind: str, text: str, names: str) -> None:
    parts = [part.text for part in split_actions(text)]
    assert "; ".join(one.name for part in parts for one in expectations_of(part)) == names
    assert [in_plainer_words(part) for part in parts] == parts


@pytest.mark.parametrize("text", [text for texts in TABLE["kept"].values() for text in texts])
def test_names_learned_verbs_and_legs_stay_in_their_words(text: str) -> None:
    assert in_plainer_words(text) == text


@pytest.mark.parametrize(("text", "count"), TABLE["parts"].items())
def test_a_while_is_a_time_and_a_title_ends_no_sentence(text: str, count: int) -> None:
    assert len(split_actions(text)) == count


@pytest.mark.parametrize(("text", "read"), TABLE["numbers"].items())
def test_a_number_is_kept_or_told(text: str, read: str) -> None:
    amount = read_amount(text)
    unread = unread_numbers(text, amount, read_seconds(text))
    told = [str(amount)] * bool(amount) + [f"not kept: {', '.join(unread)}"] * bool(unread)
    assert "; ".join(told) == read
    assert ("not kept" in numbers_read(timeline_of(text, amounts=True))) == bool(unread)


@pytest.mark.parametrize("text", TABLE["several"]["two"])
def test_two_people_are_told_of_duet(text: str) -> None:
    assert tells_of_several(text)


@pytest.mark.parametrize("text", TABLE["several"]["alone"])
def test_one_person_is_not(text: str) -> None:
    assert not tells_of_several(text)
