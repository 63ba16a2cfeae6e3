"""Rows of two people: files of every format, measures of both, goals and timelines, and what is refused."""

import csv
import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.bulk.folder import Store
from motionloom.bulk.jobs import Jobs
from motionloom.bulk.maker import Made, Maker
from motionloom.bulk.metadata import read_batch, write_table
from motionloom.bulk.row import parse
from motionloom.core.errors import MotionloomError
from motionloom.goals.goal_file import read_goal
from motionloom.tasks.pair import generate_pair
from tests.bulk.rows import options, write_jobs
from tests.bulk.test_shard import OUT, make

DUET = {"task": "duet", "prompt": "a person waves :: a person bows", "seconds": 1, "seed": 3}
TIMELINE = "segments: [{text: two people walk, seconds: 1}, {text: 'a person sits :: a person waves', seconds: 1}]\n"
GOAL = {"path": {"points": [[0, 0], [0, 0.5]]}}


@pytest.fixture(scope="module")
def ready(weights: str, pair_weights: str) -> Maker:
    return Maker(options(weights, pair_weights=pair_weights), folder=Path())


def takes(maker: Maker, *rows: dict[str, Any]) -> list[Made]:
    maker.sources._files.clear()
    results = [one for _, one in maker.make([ask(maker, row) for row in rows])]
    assert all(isinstance(one, Made) for one in results), results
    return results  # type: ignore[return-value]


def ask(maker: Maker, row: dict[str, Any]) -> Any:
    return maker.sources.ask(parse(json.dumps(row).encode()))


def apart(a: Any, b: Any) -> float:
    return max(float(np.abs(x.positions() - y.positions()).max()) for x, y in zip(a, b, strict=True))


def test_a_duet_is_that_of_the_single_task_whatever_is_beside_it(ready: Maker) -> None:
    other = DUET | {"seed": 4}
    (alone,) = takes(ready, DUET)
    single = generate_pair(ready.prior, ready.models.block, DUET["prompt"], seconds=1.0, seed=3, steps=2)[0]
    assert apart(alone.people, single) == 0
    both = takes(ready, other, {"prompt": "a person walks", "seconds": 1}, DUET)
    assert [len(one.people) for one in both] == [1, 2, 2]
    assert apart(both[2].people, single) == 0
    assert apart(both[1].people, single) > 0.01


def test_motions_of_one_and_of_two_loop_where_that_is_asked(weights: str, pair_weights: str, ready: Maker) -> None:
    """The last half second is another, and it goes over into the first frame; rows of less than that are refused."""
    looping = Maker(options(weights, pair_weights=pair_weights, loop=0.5), folder=Path())
    assert looping.options.of_motions("") != ready.options.of_motions("")
    rows = (DUET | {"seconds": 2}, {"prompt": "a person walks", "seconds": 2})
    for plain, loop in zip(takes(ready, *rows), takes(looping, *rows), strict=True):
        assert len(plain.people) == len(loop.people)
        for one, other in zip(plain.people, loop.people, strict=True):
            assert np.array_equal(one.rotations[:-10], other.rotations[:-10])
            seam, open_seam = (np.abs((m.rotations[-1] * m.rotations[0]).sum(-1)).mean() for m in (other, one))
            assert seam > open_seam  # mean cosine of half a joint's turn from the last frame to the first
    ((_, refused),) = looping.make([ask(looping, {"prompt": "a person walks", "seconds": 0.5})])
    assert "a loop of a clip of 0.50 s" in str(refused)


@pytest.mark.parametrize(
    ("kind", "files"),
    [
        ("npz", ["a.first.npz", "a.second.npz", "b.npz"]),
        ("bvh", ["a.first.bvh", "a.second.bvh", "b.bvh"]),
        ("glb", ["a.glb", "b.glb"]),
        ("webdataset", None),
        ("parquet", None),
    ],
)
def test_both_people_are_written_read_back_and_carried_over(ready: Maker, kind: str, files: list[str] | None) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    settings = replace(ready.options, format=kind)
    job = [DUET | {"id": "a"}, {"prompt": "a person walks", "seconds": 1, "id": "b"}]
    exact = takes(ready, *job[:1])[0].people
    assert make(ready, job, settings).counts == {"made": 2}
    if files:
        assert sorted(path.name for path in (OUT / "shard-000000").iterdir()) == files
    for more in (0, 1):  # once made, once carried over into a larger shard
        if more:
            assert make(ready, [*job, job[1] | {"seed": 1, "id": "c"}], settings).new_rows == 1
        duet, single = list(read_batch(OUT))[:2]
        assert (len(duet.people), len(single.people)) == (2, 1)
        hips = [
            [motion.positions()[:, motion.skeleton.names.index("pelvis")] for motion in people]
            for people in (exact, duet.people)
        ]
        assert np.abs(np.array(hips[0]) - np.array(hips[1])).max() < 2e-3


def test_every_task_comes_from_every_kind_of_file(ready: Maker, folder: Path) -> None:
    """As JSON lines, CSV and Parquet the same rows ask for the same motions."""
    (folder / "two.yaml").write_text(TIMELINE)
    (folder / "one.yaml").write_text(TIMELINE.replace(" :: a person waves", ""))
    columns = ("task", "prompt", "seconds", "seed", "timeline", "goal", "person")
    table = [
        ("generate", "a person walks", 1.0, 3, None, None, None),
        ("control", "a person walks", 1.0, 3, None, json.dumps(GOAL), None),
        ("compose", None, None, 3, "one.yaml", None, None),
        ("duet", "a :: b", 1.0, 3, None, json.dumps(GOAL), 2),
        ("duet", None, None, None, "two.yaml", None, None),
    ]
    job: list[dict[str, Any]] = [dict(zip(columns, row, strict=True)) for row in table]
    write_jobs(folder / "a.jsonl", job)
    with (folder / "a.csv").open("w", newline="") as file:
        csv.writer(file).writerows([columns, *table])
    keys = {"a.jsonl": [], "a.csv": []}
    with suppress(ImportError):
        import pyarrow
        from pyarrow import parquet

        parquet.write_table(pyarrow.Table.from_pylist(job), folder / "a.parquet")
        keys["a.parquet"] = []
    for name in keys:
        orders = [ready.sources.ask(parse(row)) for row in Jobs.of(name).read()]
        assert [one.row.task for one in orders] == [row[0] for row in table]
        keys[name] = [one.key for one in orders]
    assert len({tuple(job) for job in keys.values()}) == 1
    assert len(set(keys["a.csv"])) == len(table)


def test_both_people_are_measured_and_both_must_pass(ready: Maker) -> None:
    (one,) = takes(ready, DUET)
    first, second = (dict[str, Any](person) for person in one.measured)
    together: dict[str, Any] = one.measures
    hips = np.linalg.norm(one.people[0].positions()[:, 0] - one.people[1].positions()[:, 0], axis=-1)
    assert together["apart"] == pytest.approx(float(hips.mean()), abs=1e-3)
    assert 0 <= together["nearest"] <= hips.min() + 1e-3
    assert (together["travel"], together["second_travel"]) == (first["travel"], second["travel"])
    assert first["travel"] != second["travel"]
    low, high = sorted((first["travel"], second["travel"]))
    for limit, state in ((low - 0.001, "dropped"), ((low + high) / 2, "dropped"), (high + 0.001, "made")):
        report = make(ready, [DUET], replace(ready.options, filter=f"travel < {limit}"))
        assert report.counts == {state: 1}
        OUT.rename(f"{limit}")


def test_the_table_has_a_line_for_a_duet(ready: Maker) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    make(ready, [DUET, {"prompt": "a person walks", "seconds": 1}])
    write_table(Store(OUT, "npz"), 1)
    duet, single = parquet.read_table(OUT / "metadata.parquet").to_pylist()
    assert (duet["people"], single["people"]) == (2, 1)
    assert duet["second_skate"] is not None
    assert (single["second_skate"], single["apart"]) == (None, None)


def test_goals_and_timelines_of_two_people(ready: Maker, folder: Path) -> None:
    (folder / "two.yaml").write_text(TIMELINE)
    long, first, second = takes(
        ready, {"task": "duet", "timeline": "two.yaml"}, DUET | {"goal": GOAL}, DUET | {"goal": GOAL, "person": 2}
    )
    assert [len(one.people[0]) for one in (long, first, second)] == [40, 20, 20]
    goal = read_goal(GOAL, frames=20, folder=folder)
    for one, person in ((first, 0), (second, 1)):
        assert (
            apart(
                one.people,
                generate_pair(
                    ready.prior,
                    ready.models.block,
                    DUET["prompt"],
                    goals=(None, goal) if person else (goal, None),
                    seed=3,
                    steps=2,
                )[0],
            )
            == 0
        )
        assert one.measured[person]["error"] is not None
        assert one.measured[1 - person]["error"] is None


def test_everything_that_determines_a_duet_changes_its_key_and_no_other(weights: str, pair_weights: str) -> None:
    alone = {"prompt": "a person waves", "seconds": 1, "seed": 3}

    def keys(row: dict[str, Any], **more: Any) -> str:
        return ask(Maker(options(weights, **{"pair_weights": pair_weights, **more}), folder=Path()), row).key

    assert keys(DUET) == keys(DUET)
    changed = [
        DUET | {"seed": 4},
        DUET | {"prompt": "a person bows :: a person waves"},
        DUET | {"goal": GOAL},
        DUET | {"goal": GOAL, "person": 2},
    ]
    distinct = {keys(DUET), keys(DUET, pair_guidance=0.5), keys(DUET, pair_weights="duet"), *map(keys, changed)}
    assert len(distinct) == 7
    assert keys(alone) == keys(alone, pair_guidance=0.5) == keys(alone, pair_weights="duet")


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ({"prompt": "a waves :: b bows"}, "give the row the task duet"),
        ({"task": "duet", "prompt": "a :: b :: c"}, "words for each person"),
        ({"task": "duet"}, "no prompt"),
        ({"task": "duet", "prompt": "a", "person": 2}, "'person' says whose"),
        (
            {"task": "duet", "prompt": "a", "goal": GOAL, "person": 3},
            "whole number from 1 to 2; got 3",
        ),
        ({"prompt": "a", "goal": GOAL, "person": 2}, "'person' says whose"),
        ({"task": "edit", "prompt": "a"}, "'motionloom edit --count'"),
        ({"task": "predict", "prompt": "a"}, "'motionloom predict --count'"),
        ({"task": "duet", "timeline": "start.yaml"}, "do not go on from one 'start'"),
        ({"timeline": "two.yaml"}, "give the row the task duet"),
        ({"task": "duet", "prompt": "a", "seconds": 1000}, "1000"),
    ],
)
def test_what_two_people_cannot_do_is_refused_before_anything_is_drawn(
    ready: Maker, folder: Path, row: dict[str, Any], sentence: str
) -> None:
    (folder / "two.yaml").write_text(TIMELINE)
    (folder / "walk.bvh").write_bytes((Path(__file__).parents[4] / "examples/clips/walk.bvh").read_bytes())
    (folder / "start.yaml").write_text(f"start: walk.bvh\n{TIMELINE}")
    with pytest.raises(MotionloomError, match=sentence):
        ask(ready, row)


def test_a_block_of_other_weights_fails_its_rows_alone(weights: str) -> None:
    maker = Maker(options(weights, pair_weights="duet"), folder=Path())
    (_, alone), (_, duet) = maker.make([ask(maker, {"prompt": "a person walks", "seconds": 1}), ask(maker, DUET)])
    assert isinstance(alone, Made)
    assert "belongs to the weights" in str(duet)
