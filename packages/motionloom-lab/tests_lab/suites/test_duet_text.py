"""Duets from words, answers and long duets, all made up, beside made-up recordings; and the command for all of it."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics import pair as mp
from motionloom_lab.report import report as reports
from motionloom_lab.suites import duet_answers, duet_long, duet_text
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.items import NoData
from tests.kinematics.people import FPS, standing
from tests.recorded import tiny
from tests_lab.suites.duets import RECORDED, Person, block_over, couple, pair_of, partners

# From words ----------------------------------------------------------------------------------------------------------


TEXT_HOW = duet_text.DuetSettings(duets=5, seconds=6.0)
TABLE = duet_text.text_table(RECORDED)


def made_at(apart: float, calls: list[tuple[str, int, int]] | None = None) -> duet_text.Make:
    def make(caption: str, count: int, seed: int) -> list:
        if calls is not None:
            calls.append((caption, count, seed))
        people = partners(apart, 6.0)
        return [cast(Any, (Person(people[0]), Person(people[1]))) for _ in range(count)]

    return make


def drawn_apart(caption: str, count: int, seed: int) -> list:
    """Partners who come and go together, every duet in another rhythm."""
    duets = []
    for number in range(count):
        people = partners(1.0, 6.0, 0.0)
        way = np.sin(np.arange(people.shape[1]) / (4 + 3 * number + seed))[:, None, None] * np.array([0.2, 0.0, 0.0])
        duets.append(cast(Any, (Person(people[0] + way), Person(people[1] + way))))
    return duets


def test_partners_are_within_the_spread_and_people_far_apart_are_not() -> None:
    calls: list[tuple[str, int, int]] = []
    results = duet_text.measure(RECORDED, made_at(1.0, calls), made_at(4.0), TEXT_HOW, table=TABLE)
    assert [row.name for row in results.rows] == [
        "real",
        "real, held-out pairs",
        "real, partners shuffled",
        "ours",
        "ours, partners shuffled",
        "prior without communication",
    ]
    assert calls == [("two people dance", 3, 0), ("a couple dances", 2, 1)]
    ours, far = results.row("ours"), results.row("prior without communication")
    assert ours is not None
    assert far is not None
    assert ours.values["distance"].mean == pytest.approx(1.0)
    assert ours.values["distance"].count == 5
    assert ours.values["ratio_distance"].mean < 1.5 < far.values["ratio_distance"].mean
    assert ours.values["looking_away"].mean == pytest.approx(0, abs=1e-4)
    assert any("ours: within 1.5 times" in note for note in results.notes)
    assert "ours: mean penetration 0.00 cm, under 3 cm." in results.notes
    strangers = duet_text.measure(RECORDED, drawn_apart, None, TEXT_HOW, table=TABLE, kinds=("our-strangers",))
    assert [row.name for row in strangers.rows] == ["ours, partners shuffled"]
    assert strangers.rows[0].values["synchrony"].mean < 0.9 < ours.values["synchrony"].mean


def test_the_ratio_of_the_distance_in_closed_form() -> None:
    """Real distances 0.9, 1.0, 1.1, 1.05: Wasserstein distances of each from the others, by hand."""
    results = duet_text.measure(RECORDED, made_at(1.3), None, TEXT_HOW, table=TABLE, kinds=("ours",))
    real = [0.9, 1.0, 1.1, 1.05]
    spread = np.mean([np.mean([abs(one - o) for k, o in enumerate(real) if k != n]) for n, one in enumerate(real)])
    away = np.mean([1.3 - one for one in real])
    assert results.rows[0].values["ratio_distance"].mean == pytest.approx(away / spread, rel=2e-2)


def test_real_pairs_held_out_are_beside_the_others_and_strangers_are_of_other_recordings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The one at 1.05 m from those at 0.9, 1.0 and 1.1; three windows of each recording."""
    shifts, shuffled = [], duet_text.groups.shuffled

    def watched(clips: Any, shift: int = 1, placed: bool = True) -> Any:
        shifts.extend([shift] if placed else [])
        return shuffled(clips, shift=shift, placed=placed)

    monkeypatch.setattr(duet_text.groups, "shuffled", watched)
    kinds = ("held-out", "strangers")
    results = duet_text.measure(RECORDED, made_at(1.0), None, TEXT_HOW, table=TABLE, kinds=kinds)
    away = np.mean([0.15, 0.05, 0.05])
    spread = np.mean([np.mean([0.1, 0.2]), np.mean([0.1, 0.1]), np.mean([0.2, 0.1])])
    assert results.rows[0].values["ratio_distance"].mean == pytest.approx(away / spread, rel=2e-2)
    assert shifts == [3]
    assert [row.name for row in results.rows] == ["real, held-out pairs", "real, partners shuffled"]
    nobody = [replace(pair, split="train") for pair in RECORDED]
    results = duet_text.measure(nobody, made_at(1.0), None, TEXT_HOW, table=TABLE, kinds=kinds)
    assert [row.name for row in results.rows] == ["real, partners shuffled"]
    assert results.protocol["real windows"] == 12


def test_the_columns_have_their_units() -> None:
    """Two side by side who slide forward at 1 m/s, looking ahead, the feet on the floor, 10 cm apart."""
    people = couple(6.0, apart=0.1, speed=0.0)[:, :60]
    people = people + np.arange(60)[:, None, None] / FPS * np.array([0.0, 0.0, 1.0])
    values = {name: value.mean for name, value in duet_text._row("x", [people, people], None).values.items()}
    assert values["distance"] == pytest.approx(0.1)
    assert values["looking_away"] == pytest.approx(90)
    assert (values["skate_share"], values["skate_speed"]) == pytest.approx((100, 100), abs=2)
    assert values["skate_slide"] == pytest.approx(50, abs=1)
    assert 1 < values["penetration"] < 100
    assert values["touch"] == 1
    swing = 0.3 * np.sin(np.arange(60) / 5)[:, None, None] * np.array([0.0, 0.0, 1.0])
    against = couple(6.0, speed=0.0)[:, :60] + np.stack([swing, -swing])
    assert duet_text._row("x", [against], None).values["synchrony"].mean == pytest.approx(1)


def test_duets_are_made_for_captions_of_train_pairs_each_with_seeds_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = [*RECORDED, pair_of(partners(1.0), "other", "test", ["two people fight"])]
    assert duet_text.text_table(pairs).captions == ("two people dance", "a couple dances")
    assert duet_text.turns(("a", "b"), duet_text.DuetSettings(duets=5, seed=2)) == [("a", 3, 4), ("b", 2, 5)]
    times = iter([3.0, 13.0])
    monkeypatch.setattr(duet_text.time, "perf_counter", lambda: next(times))
    results = duet_text.measure(RECORDED, made_at(1.0), None, TEXT_HOW, table=TABLE, kinds=("ours",))
    assert [row.name for row in results.rows] == ["ours"]
    assert results.rows[0].values["seconds"].mean == 2.0
    assert results.rows[0].values["within"].mean == np.mean(
        [results.rows[0].values[f"ratio_{name}"].mean <= 1.5 for name in duet_text.groups.JUDGED]
    )


def test_beginnings_are_of_random_train_windows() -> None:
    def apart(how: duet_text.DuetSettings, seed: int) -> list[float]:
        return [
            round(float(np.hypot(*(two[1] - two[0])[2:])), 3) for two in duet_text.beginnings(RECORDED, how)(40, seed)
        ]

    assert set(apart(TEXT_HOW, 0)) == {0.9, 1.0, 1.1}
    assert apart(TEXT_HOW, 0) == apart(TEXT_HOW, 0)
    assert apart(TEXT_HOW, 0) != apart(TEXT_HOW, 1) != apart(replace(TEXT_HOW, seed=1), 1)


def test_duets_that_cannot_be_compared_are_reported() -> None:
    with pytest.raises(MotionloomError, match="no captions"):
        duet_text.text_table([replace(pair, captions=()) for pair in RECORDED])
    with pytest.raises(MotionloomError, match="fewer than two pairs"):
        duet_text.measure(RECORDED[:1], made_at(1.0), None, TEXT_HOW, table=TABLE)
    with pytest.raises(MotionloomError, match="duets must be from 2"):
        duet_text.DuetSettings(duets=1)


def test_the_prior_without_communication_begins_where_real_partners_stand() -> None:
    prior, how = tiny.prior(), duet_text.DuetSettings(duets=2, seconds=2.0, steps=2, clean=False)
    made = duet_text.beside(prior, RECORDED, how)("two people dance", 2, 0)
    for duo in made:
        places = np.stack([person.positions() for person in duo])
        assert mp.distance(places)[0] == pytest.approx(1.0, abs=0.2)


# Answers -------------------------------------------------------------------------------------------------------------


def answered(pool: duet_answers.Windows, off: float = 0.0) -> duet_text.Make:
    """Whoever is given is answered by the real partner, ``off`` metres aside."""
    aside = np.array([off, 0.0, 0.0])
    return lambda caption, count, seed: [
        cast(Any, (Person(window[0]), Person(window[1] + aside))) for window in pool.draw(caption, count, seed)
    ]


def test_people_of_held_out_pairs_are_given_in_either_order() -> None:
    other = pair_of(couple(12.0), "other", "test", ["two people walk"])
    short = pair_of(couple(4.0), "short", "test", ["two people run"])
    pool = duet_answers.Windows.of([*RECORDED, other, short], TEXT_HOW)
    assert pool.captions() == ("two people dance", "a couple dances", "two people walk")
    some = pool.draw("two people walk", 20, 3)
    assert np.array_equal(some, pool.draw("two people walk", 20, 3))
    assert not np.array_equal(some, pool.draw("two people walk", 20, 4))
    assert len({float(one[0, 0, 0, 2]) for one in some}) > 10
    assert 3 < sum(one[0, 0, 0, 0] < one[1, 0, 0, 0] for one in some) < 17
    assert {one.shape for one in some} == {(2, 120, 22, 3)}
    with pytest.raises(NoData, match="no held-out pair of 120 frames with a caption"):
        duet_answers.Windows.of([*RECORDED[:3], short, replace(other, captions=())], TEXT_HOW)


def test_the_real_partner_is_the_best_answer_and_distances_are_from_them() -> None:
    pool = duet_answers.Windows.of(RECORDED, TEXT_HOW)
    results = duet_text.measure(
        RECORDED, answered(pool), answered(pool, 0.3), TEXT_HOW, table=duet_answers.table(pool, TEXT_HOW)
    )
    assert results.suite == "duet-answers"
    assert [row.name for row in results.rows] == [
        "real",
        "real, held-out pairs",
        "real, partners shuffled",
        "ours",
        "ours, partners shuffled",
        "prior without communication",
    ]
    ours, aside = results.row("ours"), results.row("prior without communication")
    assert ours is not None
    assert aside is not None
    assert [ours.values[f"root_{k}"].mean for k in mp.HORIZONS] == [0, 0, 0]
    assert [aside.values[f"root_{k}"].mean for k in mp.HORIZONS] == pytest.approx([0.3] * 3)
    assert ours.values["distance"].mean == pytest.approx(1.05)
    assert reports.decode(reports.encode(results)).columns == results.columns


def test_the_distance_is_that_at_the_end_of_each_second() -> None:
    """A partner who walks off at 1 m/s is k - 1/20 m away in the last frame of second k."""
    real = couple(6.0, speed=0.0)[:, :60]
    away = real.copy()
    away[1] += np.arange(60)[:, None, None] / FPS * np.array([0.6, 1.0, 0.8])
    distances = duet_answers.apart([away], [real])
    assert [distances[f"root_{k}"].mean for k in (1, 2, 3)] == pytest.approx([0.95, 1.95, 2.95])


def test_somebody_given_stays_whoever_answers() -> None:
    prior, how = tiny.prior(), duet_text.DuetSettings(duets=2, seconds=2.0, steps=2, clean=False)
    pool = duet_answers.Windows.of(RECORDED, how)
    real = pool.draw("two people dance", 2, 5)
    for make in (duet_answers.answers(prior, block_over(prior), pool, how), duet_answers.alone(prior, pool, how)):
        made = make("two people dance", 2, 5)
        for (first, second), window in zip(made, real, strict=True):
            assert (len(first), len(second)) == (40, 40)
            assert np.abs(first.positions() - window[0]).max() < 0.05
        assert not np.allclose(made[0][1].rotations, made[1][1].rotations)


def test_the_silent_partner_begins_where_the_real_one_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A prior that draws somebody standing still draws the real partner, who stands, turned and placed."""
    still = motion_from_positions(standing(2.0), FPS)
    monkeypatch.setattr(duet_answers, "generate", lambda *a, **k: [still])
    how = duet_text.DuetSettings(duets=2, seconds=2.0)
    pool = duet_answers.Windows.of(RECORDED, how)
    made = duet_answers.alone(tiny.prior(), pool, how)("two people dance", 6, 5)
    for (_, second), window in zip(made, pool.draw("two people dance", 6, 5), strict=True):
        assert np.abs(second.positions()[0] - window[1, 0]).max() < 0.05


# For long ------------------------------------------------------------------------------------------------------------


def drifting(rate: float) -> duet_text.Make:
    """Partners 1 m apart who drift apart by ``rate`` metres a second for 18 s."""
    people = partners(1.0, 18.0)
    people[1] += np.arange(people.shape[1])[:, None, None] / FPS * np.array([0.0, 0.0, rate])
    return lambda caption, count, seed: [cast(Any, (Person(people[0]), Person(people[1]))) for _ in range(count)]


def test_partners_who_drift_apart_are_seen_in_the_last_seconds() -> None:
    how = duet_long.LongDuetSettings(duets=3)
    table = duet_long.table(TABLE.captions, how)
    results = duet_text.measure(RECORDED, drifting(0.1), drifting(0.0), how, table=table)
    assert [row.name for row in results.rows[3:]] == [
        "ours, last 6 s",
        "ours, last 6 s, partners shuffled",
        "ours, first 6 s",
        "prior without communication, last 6 s",
    ]
    apart = {row.name: row.values["distance"].mean for row in results.rows}
    middle = 119 / 2 / FPS  # of six seconds
    assert apart["ours, first 6 s"] == pytest.approx(1.0 + 0.1 * middle)
    assert apart["ours, last 6 s"] == pytest.approx(1.0 + 0.1 * (12 + middle))
    assert apart["ours, last 6 s, partners shuffled"] == pytest.approx(apart["ours, last 6 s"], abs=1e-3)
    assert apart["prior without communication, last 6 s"] == pytest.approx(1.0)
    assert any(note.startswith("ours, last 6 s: not within") for note in results.notes)
    assert results.suite == "duet-long"


def test_captions_follow_one_another_and_pieces_are_one_duet() -> None:
    prior, how = tiny.prior(), duet_long.LongDuetSettings(duets=2, seconds=2.0, segments=2, steps=2, clean=False)
    captions = [
        segment.text for segment in duet_long.timeline(("a", "b", "c"), "b", duet_long.LongDuetSettings(segments=4))
    ]
    assert captions == ["b", "c", "a", "b"]
    makes = (
        duet_long.ours(prior, block_over(prior), TABLE.captions, how),
        duet_long.alone(prior, RECORDED, TABLE.captions, how),
    )
    for make in makes:
        ((first, second),) = make("two people dance", 1, 0)
        assert (len(first), len(second)) == (80, 80)
        assert not np.allclose(first.rotations[:, 1:], second.rotations[:, 1:])
    assert mp.distance(np.stack([first.positions(), second.positions()]))[0] == pytest.approx(1.0, abs=0.2)
    with pytest.raises(MotionloomError, match="segments must be from 2 to 100"):
        duet_long.LongDuetSettings(segments=1)


# The command ---------------------------------------------------------------------------------------------------------


def test_every_part_is_made_by_its_own_module_and_told_with_its_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: dict[str, Any] = {}
    modules = {duet_text.parts: "text", duet_answers.parts: "answers", duet_long.parts: "long"}

    def run(run: Run, parts_of: Any, **how: Any) -> reports.Report:
        calls[modules[parts_of]] = {**how, "command": run.command}
        return reports.Report("duet-x", modules[parts_of], run.command, {}, duet_text.COLUMNS, ())

    monkeypatch.setattr(duet_text, "run", run)
    words = ["evaluate", "duet", "--data", str(tmp_path), "--quick", "--duets", "3", "--out", str(tmp_path / "out")]
    for part in ("text", "answers", "long"):
        assert main([*words, "--only", part]) == 0
        how = calls[part]["how"]
        assert (how.duets, how.steps) == (3, 6)
        assert calls[part]["command"] == (
            f"motionloom evaluate duet --weights default --data PACK --only {part} --duets 3 --quick"
        )
        assert (tmp_path / "out" / part / "report.json").is_file()
    assert calls["long"]["how"].segments == 2
    capsys.readouterr()
