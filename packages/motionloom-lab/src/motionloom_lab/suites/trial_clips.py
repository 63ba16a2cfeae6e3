"""Which real clips show what, for the trial of the everyday checks: `trial_clips.toml` as `Examples`."""

from typing import Any

from motionloom.reading import read_table
from motionloom_lab.suites.trial import NOTHING, Examples


def trials() -> dict[str, Examples]:
    """How to find examples, by the name of the check."""
    found = read_table("motionloom_lab.suites", "trial_clips.toml")
    words = {f"@{name}": "|".join(items) for name, items in found.pop("words").items()}
    return {name: _trial(entry, words) for name, entry in found.items()}


def _trial(entry: dict[str, Any], words: dict[str, str]) -> Examples:
    def pattern(items: list[str]) -> str:
        return "|".join(_expanded(item, words) for item in items) or NOTHING

    cut = entry.get("cut")
    return Examples(
        **{name: pattern(entry.get(name, [])) for name in ("shows", "unless", "like", "backwards")},
        sided=entry.get("sided", False),
        cut=None if cut is None else (cut[0], cut[1]),
        joined=tuple(pattern(item.split(" or ")) for item in entry.get("joined", [])),
    )


def _expanded(item: str, words: dict[str, str]) -> str:
    return words.get(item, item)
