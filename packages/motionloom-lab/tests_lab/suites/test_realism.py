"""The realism run: which clips it takes, what it orders, what it says."""

from collections.abc import Sequence

import numpy as np
import pytest

from motionloom_lab.metrics.obedience import CHECKS
from motionloom_lab.metrics.realism import NUMBERS
from motionloom_lab.suites import realism
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.items import RealClip
from motionloom_lab.suites.reference import confusion_table, known, rates, reference
from tests.kinematics.people import FPS, moved, standing, walking


def clip(name: str, *, split: str = "test", seconds: float = 4.0, captions: tuple[str, ...] = ("walks",)) -> RealClip:
    return RealClip(name, "made", split, captions, walking(1.2, seconds))


def test_only_held_out_captioned_clips_of_usable_length_are_taken_and_spread() -> None:
    good = [clip(f"good{k}") for k in range(9)]
    bad = [clip("a", split="train"), clip("b", seconds=1.0), clip("c", seconds=20.0), clip("d", captions=())]
    assert realism.choose([*bad, *good], 99) == good
    assert [c.name for c in realism.choose(good, 3)] == ["good0", "good4", "good8"]


def test_orders_group_equal_lengths_in_batches() -> None:
    clips = [clip(f"{k}", seconds=3.0 if k % 2 else 4.1) for k in range(6)]
    batches = realism.orders(clips, batch=2)
    assert [(o.seconds, len(o.prompts)) for o in batches] == [(3.0, 2), (3.0, 1), (4.0, 2), (4.0, 1)]


def test_seeds_never_repeat_between_orders() -> None:
    seeds: list[int] = []

    def fake(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
        seeds.extend(range(seed, seed + len(prompts)))
        return [standing(seconds)] * len(prompts), FPS

    clips, _ = realism.run(Run(), realism.everyday(40), generate=fake, seed=5)
    assert len(clips) == 40
    assert seeds == list(range(5, 45))


def test_a_copy_of_the_real_clips_passes_and_a_sliding_one_does_not() -> None:
    real = [walking(1.2) for _ in range(3)]
    good = realism.judge(real, FPS, real)
    assert good["passed"] == len(NUMBERS)
    assert good["speed_distance"] == 0
    slid = [moved(p, np.linspace(0, 3, 80)[:, None] * [1.0, 0, 0]) for p in real]
    numbers = realism.judge(slid, FPS, real)["numbers"]
    assert not numbers["skate_ratio"]["passes"]
    assert not numbers["skate_speed"]["passes"]
    assert numbers["bone_error"]["passes"]


def test_the_table_has_a_row_for_each_number() -> None:
    rows = realism.table(realism.judge([walking(1.0)], FPS, known()["realism"]["held_out"]))
    assert [row[0] for row in rows[1:]] == [n.name for n in NUMBERS]


def test_the_reference_counts_examples_and_false_alarms() -> None:
    clips = [clip("w1"), clip("w2", split="train"), RealClip("s", "made", "train", ("nods",), standing())]
    numbers = reference(clips)
    assert numbers["checks"]["walk forward"] == {"held_out": "1/1", "all": "2/2", "related": "0/0", "others": "0/1"}
    assert numbers["checks"]["stand still"]["others"] == "1/3"
    assert numbers["confusion"]["walk forward"]["walk forward"] == 1
    assert len(rates(numbers)) == 21
    assert confusion_table(numbers)[1][0] == "1 walk forward"


def test_the_shipped_reference_belongs_to_these_checks_and_numbers() -> None:
    shipped = known()
    assert list(shipped["checks"]) == [c.name for c in CHECKS]
    assert set(shipped["realism"]["held_out"]) == {n.name for n in NUMBERS}


@pytest.mark.parametrize("one", CHECKS, ids=lambda c: c.name)
def test_nine_in_ten_real_examples_pass_and_one_in_ten_others_at_most(one) -> None:
    counts = known()["checks"][one.name]
    passed, tried = map(int, counts["all"].split("/"))
    wrong, others = map(int, counts["others"].split("/"))
    assert passed >= 0.9 * tried
    assert wrong <= 0.1 * others
