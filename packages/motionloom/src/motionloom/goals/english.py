"""Whether a prompt is English: the weights have read nothing else.

By letters (another alphabet), and by the small words that every sentence of a language has. Where there is nothing to
go by a prompt counts as English.
"""

import re
import unicodedata

_ENGLISH_WORDS = """the and is are to with his her he she they their of on from while then up down forward walks runs
person someone this that for by into out around back left right hand hands at as it its be was were"""
_OTHER_WORDS = """
der das ein eine einen einem einer und ist nach mit auf sich dann geht läuft springt seine ihre beiden vorwärts
het een naar zijn haar met loopt vooruit iemand och ett sig går springer framåt og fremad hopper mann kvinne
les une et avec puis vers dans qui marche saute homme femme personne
las una con hacia camina salta corre persona hombre mujer luego su
il lo gli che poi cammina avanti uomo donna um uma com para pessoa homem mulher anda
się idzie skacze osoba człowiek jde skáče bir ve adam yürüyor kişi ileri
"""
"""German; Dutch and Scandinavian; French; Spanish; Italian and Portuguese; Polish, Czech and Turkish."""
_SMALL_WORDS = "la le el en y e i du des se na los w z"
"""Words that names and borrowed phrases have too: they count only beside another."""
_ENGLISH, _OTHERS, _SMALL = (frozenset(words.split()) for words in (_ENGLISH_WORDS, _OTHER_WORDS, _SMALL_WORDS))


def is_english(text: str) -> bool:
    """Whether a prompt can be English; False where its letters or its small words are those of another language."""
    letters = [letter for letter in text if letter.isalpha()]
    latin = sum(unicodedata.name(letter, "").startswith("LATIN") for letter in letters)
    if len(letters) >= 2 and latin < 0.7 * len(letters):
        return False
    words = re.findall(r"[^\W\d_]+", text.lower())
    other = sum(word in _OTHERS for word in words)
    small = sum(word in _SMALL for word in words)
    return not (other and other + small >= 2 and other + small > sum(word in _ENGLISH for word in words))
