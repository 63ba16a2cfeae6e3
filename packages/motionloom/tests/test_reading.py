"""What text may hold, whatever interface it comes through."""

import json
import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json, stored_json
from motionloom.core.reading import check_text, check_texts, mended, whole_number

ANY = st.text(st.characters(exclude_categories=()), max_size=12)
"""Every code point, halves of surrogate pairs included."""


def is_text(text: str) -> bool:
    """Whole Unicode without control characters but tabs and line ends, by the tables of Unicode."""
    return all(one in "\t\n\r" or unicodedata.category(one) not in ("Cc", "Cs") for one in text)


@given(ANY)
@example("a \ud83d")
@example("\x9b31m")
def test_text_is_whole_unicode_without_control_characters(text: str) -> None:
    try:
        accepted = check_text(text, "it") == text
    except MotionloomError:
        accepted = False
    assert accepted == is_text(text)


@given(st.recursive(ANY | st.integers(), lambda inner: st.lists(inner) | st.dictionaries(ANY, inner), max_leaves=8))
def test_what_is_mended_is_text_and_keeps_what_was_text(value: object) -> None:
    result = mended(value)
    check_texts(result, "it")
    json.dumps(result, ensure_ascii=False).encode()
    try:
        check_texts(value, "it")
    except MotionloomError:
        return
    assert result == value


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (r'{"segments": [{"text": "a \ud83d"}]}', r"'text' holds half a character \(a lone surrogate, U\+D83D\)"),
        (r'{"name": "\u0007"}', r"'name' holds the control character U\+0007"),
        (r'{"\udc00": 1}', "a key of it holds half a character"),
        ('{"a": {"seed": 1, "seed": 2}}', "the key 'seed' stands in it twice"),
        ('{"seed": ' + "9" * 5001 + "}", "has 5,001 digits, which is no number that fits"),
    ],
)
def test_json_from_outside_is_refused_in_a_sentence(said: str, sentence: str) -> None:
    for data in (said, said.encode()):
        with pytest.raises(MotionloomError, match=sentence) as refused:
            parse_json(data, "it")
        assert "set_int_max" not in str(refused.value)


def test_json_that_was_stored_is_read_all_the_same() -> None:
    stored = rb'{"name": "film \ud83d", "a": 1, "a": 2, "\u0007": [" \ud83d\ude00 "]}'
    assert stored_json(stored, "it") == {"name": "film \ufffd", "a": 2, "\ufffd": [" \U0001f600 "]}


def test_every_whole_number_that_is_read_fits_into_a_float() -> None:
    assert float(whole_number("-" + "9" * 299)) < -1e298
    with pytest.raises(ValueError, match="301 digits"):
        whole_number("9" * 301)
