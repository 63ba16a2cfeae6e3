"""Rows are read one after the other, and a shard is the same rows whoever reads."""

import csv
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.bulk.jobs import LARGEST, Jobs, shard_size
from motionloom.core.errors import MotionloomError
from tests.bulk.rows import rows, write_jobs

TEXT = st.text(st.characters(codec="utf-8", exclude_categories=("C",)), min_size=1, max_size=30).filter(str.strip)


def read(jobs: Jobs) -> list[dict]:
    return [json.loads(row) for row in jobs.read()]


def test_json_lines_come_as_they_are_without_blank_ones(folder: Path) -> None:
    (folder / "a.jsonl").write_bytes(b'\xef\xbb\xbf{"prompt": "a"}\n\n  \n{"prompt": "b", "seed": 3}\r\n')
    jobs = Jobs.of("a.jsonl")
    assert read(jobs) == [{"prompt": "a"}, {"prompt": "b", "seed": 3}]
    assert jobs.count() == 2


@given(prompts=st.lists(TEXT, min_size=1, max_size=5), seed=st.integers(0, 2**61))
def test_a_csv_file_gives_the_rows_that_were_written(
    tmp_path_factory: pytest.TempPathFactory, prompts: list[str], seed: int
) -> None:
    path = tmp_path_factory.mktemp("csv") / "jobs.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, ["prompt", "seconds", "seed", "id"])
        table.writeheader()
        table.writerows({"prompt": prompt, "seconds": 2.5, "seed": seed, "id": ""} for prompt in prompts)
    assert read(Jobs.of(path)) == [{"prompt": prompt, "seconds": 2.5, "seed": seed} for prompt in prompts]


@pytest.mark.parametrize("between", [";", "\t"])
def test_a_csv_file_of_a_spreadsheet_may_have_a_mark_at_its_beginning_and_semicolons(
    folder: Path, between: str
) -> None:
    half = "2,5" if between == ";" else "2.5"
    lines = ["prompt;seconds;seed", f'"walks; then sits, slowly";{half};7', ";;"]
    (folder / "a.csv").write_bytes(("\r\n".join(lines) + "\r\n").replace(";", between).encode("utf-8-sig"))
    prompt = f"walks{between} then sits, slowly"
    assert read(Jobs.of("a.csv")) == [{"prompt": prompt, "seconds": 2.5, "seed": 7}, {}]


@pytest.mark.parametrize(
    "text",
    ["prompt,seed,prompt\na,1,b\n", "prompt,seed\na,1,2\n", "prompt,seed\na\n", 'prompt\n"a\n', "prompt\n\udcff\n"],
)
def test_a_csv_file_with_rows_of_other_lengths_or_of_no_text_is_refused(folder: Path, text: str) -> None:
    (folder / "a.csv").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(MotionloomError, match=r"a\.csv"):
        read(Jobs.of("a.csv"))


def test_a_parquet_file_gives_its_rows_without_empty_cells(folder: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(arrow.table({"prompt": ["a", "b"], "seed": [3, None]}), folder / "a.parquet")
    jobs = Jobs.of("a.parquet")
    assert (jobs.count(), read(jobs)) == (2, [{"prompt": "a", "seed": 3}, {"prompt": "b"}])


def test_variants_of_prompts_have_seeds_of_their_own(folder: Path) -> None:
    (folder / "prompts.txt").write_text("a\n\nb\n")
    jobs = Jobs.of_prompts("prompts.txt", variants=3, seed=5)
    assert jobs.count() == 6
    assert [(row["prompt"], row["seed"]) for row in read(jobs)] == [(p, s) for p in "ab" for s in (5, 6, 7)]


def test_a_line_without_end_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom.bulk.jobs.MAX_LINE", 100)
    (folder / "a.jsonl").write_text("x" * 1000)
    with pytest.raises(MotionloomError, match="more than 100 bytes"):
        list(Jobs.of("a.jsonl").read())


@pytest.mark.parametrize("name", ["absent.jsonl", "a.txt", "a"])
def test_what_is_no_file_of_jobs_is_refused(name: str) -> None:
    with pytest.raises(MotionloomError):
        Jobs.of(name)


def test_rows_are_mappings_and_one_is_a_job() -> None:
    assert list(Jobs.of({"prompt": "a"}).read()) == list(Jobs.of([{"prompt": "a"}]).read()) == [b'{"prompt": "a"}']
    for wrong in (["a person walks"], [["prompt", "a"]], [{"prompt": "a"}, None]):
        with pytest.raises(MotionloomError, match="a row is a mapping"):
            Jobs.of(wrong)  # type: ignore[arg-type]


@given(count=st.integers(1, 100_000_000))
def test_shards_are_small_where_jobs_are_and_never_large(count: int) -> None:
    size = shard_size(count)
    assert 1 <= size <= LARGEST
    if count > 8:
        assert -(-count // size) >= 2  # two processes have something to do


@given(count=st.integers(0, 60), size=st.integers(1, 20))
def test_shards_are_all_rows_in_their_order(tmp_path_factory: pytest.TempPathFactory, count: int, size: int) -> None:
    jobs = Jobs.of(write_jobs(tmp_path_factory.mktemp("shards") / "a.jsonl", rows(count)))
    parts = list(jobs.shards(size))
    assert [row for part in parts for row in part] == list(jobs.read())
    assert all(len(part) == size for part in parts[:-1])
