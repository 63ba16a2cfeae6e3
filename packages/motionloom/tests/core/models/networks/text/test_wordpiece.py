"""Splitting into word pieces against splits known from the BERT paper and its published tokenizer."""

from motionloom.core.models.networks.text.minilm import make_tokenizer
from tests.recorded.tiny import VOCABULARY


def split(text: str) -> list[str]:
    return make_tokenizer(VOCABULARY).encode(text, add_special_tokens=False).tokens


def test_longest_pieces_come_first() -> None:
    assert split("unaffable walking walks") == ["un", "##aff", "##able", "walk", "##ing", "walks"]


def test_case_accents_and_punctuation() -> None:
    assert split("A Pérson TURNS.left") == ["a", "person", "turns", ".", "left"]


def test_unknown_characters_are_one_mark_a_word() -> None:
    assert split("a ☃☃ person") == ["a", "[UNK]", "person"]
    assert split("left" * 26) == ["[UNK]"]  # more than 100 characters


def test_control_characters_vanish() -> None:
    assert split("le\x00ft\tright") == ["left", "right"]
