"""Numbers in words as digits: "forty-five", "a hundred and eighty", "half a", "three and a half", "a couple of"."""

import re

_ONES = ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "thirteen"]
_ONES += ["fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"]
_SMALL = {word: number for number, word in enumerate(_ONES, start=1)}
SMALL_NUMBERS = tuple(_ONES)
"""Words of the numbers from one to nineteen."""
_TENS = {"twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90}

NUMBER = r"(\d+(?:\.\d+)?)"
"""A number as `in_digits` writes it."""

_ONE = "|".join(sorted(_SMALL, key=len, reverse=True))
_BELOW_100 = rf"(?:(?:{'|'.join(_TENS)})(?:[ -](?:{'|'.join(_ONES[:9])}))?|{_ONE})"
_WORDS = re.compile(
    rf"\b(?:(?P<hundreds>a|{'|'.join(_ONES[:9])}) hundred(?: and (?P<rest>{_BELOW_100}))?|(?P<plain>{_BELOW_100}))\b"
)
_HALF = re.compile(rf"\b{NUMBER} and a half\b")


def in_digits(text: str, *, lower: bool = True) -> str:
    """A text with its numbers in digits: "walks three and a half meters" becomes "walks 3.5 meters", "1,5 m" "1.5 m".

    In lower case, blanks and commas as single blanks; ``lower`` False leaves both as they are.
    """
    result = re.sub(r"(?<=\d),(?=\d{3}\b)", "", text)
    result = re.sub(r"(?<=\d),(?=\d{1,2}\b)", ".", result)
    result = " ".join(result.lower().replace(",", " ").split()) if lower else result
    result = _WORDS.sub(_value, result)
    result = _HALF.sub(lambda match: f"{float(match[1]) + 0.5:g}", result)
    result = re.sub(r"\bhalf an? (?=m(?:et|in)|second|foot|yard)", "0.5 ", result)
    result = re.sub(r"\ba couple of (?=m(?:et|in)|second|feet|yard|step)|\ba pair of (?=step)", "2 ", result)
    result = re.sub(r"\b(?:about|around|approximately|roughly|exactly|some) (?=\d)", "", result)
    # "for a second" is an idiom; nobody sits down in one
    return re.sub(r"\bfor an? (?=minute\b|(?:full |whole )(?:minute|second)\b)(?:full |whole )?", "for 1 ", result)


def _value(match: re.Match[str]) -> str:
    if match["plain"]:
        return str(_below_100(match["plain"]))
    number = 100 * _SMALL.get(match["hundreds"], 1)
    return str(number + (_below_100(match["rest"]) if match["rest"] else 0))


def _below_100(words: str) -> int:
    return sum(_SMALL.get(word) or _TENS[word] for word in re.split("[ -]", words))
