"""What sentences say of amounts, against the table that was written before the code was looked at."""

import tomllib
from pathlib import Path

import pytest

from motionloom.goals.amounts import Amount, read_amount, read_seconds
from motionloom.goals.sequence import split_actions

ROWS = tomllib.loads((Path(__file__).parent / "amounts.toml").read_text(encoding="utf-8"))["row"]


def read(text: str) -> dict[str, object]:
    """What is read of one action, as the table writes it."""
    amount, seconds = read_amount(text), read_seconds(text)
    options: dict[str, object] = {} if seconds is None else {"seconds": seconds}
    return options | ({} if amount is None else _row(amount))


def _row(amount: Amount) -> dict[str, object]:
    if amount.kind == "count":
        return {"count": amount.size, "of": amount.of}
    if amount.kind in ("turn", "arc"):
        return {amount.kind: amount.size if amount.direction == "left" else -amount.size}
    return {amount.kind: round(amount.size, 2), "toward": amount.direction}


def right(text: str, row: dict[str, object]) -> bool:
    """Whether what is read of a text is what the table says."""
    reading = read(text)
    expected = {key: value for key, value in row.items() if key not in ("text", "either", "nothing")}
    if row.get("either"):
        reading = {key: abs(value) if isinstance(value, float) else value for key, value in reading.items()}
    if "steps" in expected and "toward" not in expected:
        expected["toward"] = "forward"
    return reading == expected


@pytest.mark.parametrize("row", ROWS, ids=[row["text"] for row in ROWS])
def test_amounts_are_read(row: dict) -> None:
    rows = row.get("parts", [row])
    parts = split_actions(row["text"])
    assert len(parts) == len(rows)
    assert all(right(part.text, one) for part, one in zip(parts, rows, strict=True)), [read(p.text) for p in parts]
