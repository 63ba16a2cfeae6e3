"""Write `studio/src/prior/words.json`, by which the page reads numbers in words, from `motionloom.goals`."""

import json
from pathlib import Path

from motionloom.goals import amounts, numerals, verbs

PLACE = Path(__file__).parents[1] / "studio" / "src" / "prior" / "words.json"
PATTERNS = {
    "way": amounts._WAY,
    "degrees": amounts._DEGREES,
    "part_of_turn": amounts._PART_OF_TURN,
    "turns_often": amounts._TURNS_OFTEN,
    "arc": amounts._ARC,
    "circle": amounts._CIRCLE,
    "steps": amounts._STEPS,
    "steps_often": amounts._STEPS_OFTEN,
    "seconds": amounts._SECONDS,
    "often": amounts._OFTEN,
    "often_kept": amounts._OFTEN_OF_LIMBS,
    "many": amounts._MANY,
    "counts_another": amounts._COUNTS_ANOTHER,
    "ages": amounts._AGES,
    "body": amounts._BODY,
    "held": amounts._HELD,
    "travels": amounts._TRAVELS,
    "on_one_leg": amounts._ON_ONE_LEG,
    "else": amounts._ELSE,
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
