"""Files of jobs that are no files of jobs are refused at once, in one sentence."""

from pathlib import Path

import pytest

from motionloom.bulk.jobs import MAX_COLUMNS, Jobs
from motionloom.core.errors import MotionloomError


def test_a_table_of_very_many_columns_is_refused_without_comparing_them(tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    table.write_text("prompt" + "," * (MAX_COLUMNS + 1) + "\n")
    with pytest.raises(MotionloomError, match=f"{MAX_COLUMNS + 2} columns"):
        list(Jobs.of(table).read())


def test_rows_in_another_encoding_are_refused_as_a_file_and_not_row_by_row(tmp_path: Path) -> None:
    rows = tmp_path / "a.jsonl"
    rows.write_bytes('{"prompt": "a person walks"}\n\n\n'.encode("utf-16"))
    with pytest.raises(MotionloomError, match="not text in UTF-8"):
        list(Jobs.of(rows).read())
