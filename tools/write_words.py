"""Write `studio/src/prior/words.json`, by which the page reads numbers in words, from `motionloom.goals`."""

import json
from pathlib import Path

from motionloom.goals import amounts, numerals, verbs

PLACE = Path(__file__).parents[1] / "studio" / "src" / "prior" / "words.json"
NAMES = """way degrees part_of_turn turns_often arc circle steps steps_often seconds often many counts_another ages body
held travels on_one_leg else"""
PATTERNS = {name: amounts._WORDS[name] for name in NAMES.split()} | {
    "often_kept": amounts._WORDS["often_of_limbs"],
    "number_words": numerals._WORDS,
    "and_a_half": numerals._HALF,
}
"""Regular expressions that JavaScript knows too, but for the way it names groups."""


def words() -> str:
    """The whole file: strings and numbers by name, so that nothing has to be put in order."""
    forms: dict[str, list[str]] = {}
    for word in sorted({word for mood in verbs.MOODS.values() for word in mood}):
        forms.setdefault(verbs.base_of(word), []).append(word)
    fixed = [base for base in forms if verbs.kind_of_verb(base, "") in ("jump", "fight", "dance")]
    tables = {
        "patterns": {name: one.pattern.replace("(?P<", "(?<") for name, one in PATTERNS.items()},
        "verbs": {base: " ".join(each) for base, each in sorted(forms.items())},
        "in_place": " ".join(sorted(fixed)),
        "turning": " ".join(sorted(amounts._TURNS)),
        "running": " ".join(sorted(amounts._RUNS)),
        "going": " ".join(sorted(amounts._GOING)),
        "stepping": " ".join(sorted(amounts._STEPPING)),
        "paces": amounts._PACES,
        "units": amounts._UNITS,
        "small": numerals._SMALL,
        "tens": numerals._TENS,
        "counted": {what: said for said, what in amounts._COUNTED},
        "single": amounts._SINGLE,
        "strokes": amounts.STROKES,
    }
    return json.dumps(tables, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    PLACE.write_text(words(), encoding="utf-8")
    print(PLACE)
