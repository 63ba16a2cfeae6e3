"""Prompts in other languages are told."""

import pytest

from motionloom.goals.remarks import is_english

OTHERS = [
    "eine Person geht vorwärts",
    "ein Mann springt und dreht sich dann um",
    "der Mann läuft nach links",
    "une personne marche vers la droite",
    "un homme saute avec les deux pieds",
    "una persona camina hacia adelante",
    "el hombre salta y luego corre",
    "un uomo cammina e poi si siede con una mano alzata",
    "uma pessoa anda para frente",
    "een man loopt naar voren",
    "człowiek idzie i skacze",
    "человек идёт вперёд",
    "一个人向前走",
    "人が歩く",
    "شخص يمشي إلى الأمام",
    "bir adam yürüyor",
]
ENGLISH = [
    "walk",
    "tai chi",
    "a man does a plié à la seconde",
    "capoeira",
    "a person dances the macarena in Los Angeles",
    "El Niño walks",
    "he orders a café au lait and sits down",
    "jump!",
    "42",
    "T-pose",
]


@pytest.mark.parametrize("text", OTHERS)
def test_other_languages_are_told(text: str) -> None:
    assert not is_english(text)


@pytest.mark.parametrize("text", ENGLISH)
def test_english_is_english(text: str) -> None:
    assert is_english(text)
