"""How sentences are parted, against the table that was written before the code was looked at."""

import re
import tomllib
from pathlib import Path

import pytest

from motionloom.goals.sequence import split_actions
from motionloom.goals.verbs import base_of, subject_of

TABLE = tomllib.loads((Path(__file__).parent / "parts.toml").read_text(encoding="utf-8"))


def bases(text: str) -> list[str]:
    """The words in small letters, verbs as their bases: "sitting down" and "she sits down" end alike."""
    return [base_of(word) or word for word in text.lower().strip(" .,;").split(" ")]


def action(text: str) -> list[str]:
    """The same from the verb on; a noun alone is its last word."""
    words = bases(text)
    subject = subject_of(text)
    return words[len(subject.split()) :] if subject and len(words) > 2 else words


@pytest.mark.parametrize("text", [*TABLE["whole"]["texts"], *TABLE["later"]["texts"]])
def test_one_thing_stays_whole(text: str) -> None:
    assert [part.text for part in split_actions(text)] == [text]


@pytest.mark.parametrize("row", TABLE["row"], ids=[row["text"] for row in TABLE["row"]])
def test_one_after_the_other(row: dict) -> None:
    texts = [part.text for part in split_actions(row["text"])]
    if row.get("stop"):  # the end of the last action, or an action of its own
        assert len(texts) in (1, 2)
        assert len(texts) == 1 or re.search(r"\bstops?\b", texts[1])
        return
    assert len(texts) == len(row["parts"]), texts
    for text, row_part in zip(texts, row["parts"], strict=True):
        expected = action(row_part)
        assert "," not in text
        assert bases(text)[-len(expected) :] == expected, texts
