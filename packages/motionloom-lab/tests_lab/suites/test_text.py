"""The text suite in a world where every number is known (`tests_lab.suites.judged`)."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom_lab.report import report, tables
from motionloom_lab.report.report import Report
from motionloom_lab.suites import text, text_reference
from motionloom_lab.suites.harness import Parts, Run, fingerprint
from motionloom_lab.suites.protocol import Protocol, Selection
from tests_lab.suites.judged import WIDTH, Judge, Painter, item, place

SMALL = Protocol(batch=8, replications=3, multimodality=(3, 4), multimodal_replications=2, steps=(2, 4))
MEASURED = ("r1", "r2", "r3", "r3_same", "fid", "mm_dist", "diversity")


def trial(
    painter: Painter, protocol: Protocol = SMALL, *, people: int = 32, judge: Judge | None = None
) -> text.TextTrial:
    judge = judge or Judge()
    items = [item(k, 40 + 4 * (k % 3)) for k in range(people)]
    return text.prepare(painter, judge, text_reference.measure(items, judge, Selection()), protocol)


def values(results: Report, row: str) -> dict[str, float]:
    line = results.row(row)
    assert line is not None
    return {name: value.mean for name, value in line.values.items()}


def test_real_motions_match_their_words_and_themselves() -> None:
    """A judge who knows everybody finds every caption's own motion, and FID of real against real is 0."""
    real = values(text.measure(trial(Painter())), "real")
    assert (real["r1"], real["r3"], real["r3_same"]) == (1, 1, 1)
    assert real["mm_dist"] == pytest.approx(0, abs=1e-9)
    assert real["fid"] == pytest.approx(0, abs=1e-9)


def test_shuffled_captions_find_their_motion_by_chance() -> None:
    """With captions dealt out anew, k of 8 motions are hit, within four standard errors of 6,400 tries."""
    many = trial(Painter(), replace(SMALL, replications=20), people=320)
    rows = [text.of_real(many, r, shuffled=True) for r in range(20)]
    for k, name in enumerate(("r1", "r2", "r3"), start=1):
        share = np.mean([numbers[name] for numbers in rows])
        assert share == pytest.approx(k / 8, abs=4 * np.sqrt(k / 8 * (1 - k / 8) / 6400))
    apart = np.mean([numbers["mm_dist"] for numbers in rows])
    assert apart == pytest.approx(text.of_chance(many)["mm_dist"], rel=0.03)


def test_chance_is_k_of_the_batch() -> None:
    assert values(text.measure(trial(Painter())), "chance")["r3"] == 3 / 8
    assert text.of_chance(trial(Painter(), replace(SMALL, batch=None)))["r1"] == 1 / 32


def test_a_perfect_generator_scores_as_real() -> None:
    results = text.measure(trial(Painter()))
    real, numbers = values(results, "real"), values(results, "default, 2 steps")
    assert {k: numbers[k] for k in MEASURED} == pytest.approx({k: real[k] for k in MEASURED}, abs=1e-7)
    assert numbers["multimodality"] == 0


def test_a_generator_that_misses_by_sigma_is_off_by_the_length_of_its_noise() -> None:
    """MM-Dist of noise sigma in d dimensions is sigma times the mean of a chi of d; FID adds sigma^2 d and less."""
    sigma, people = 0.2, 400
    numbers = text.of_generated(trial(Painter(sigma), people=people), 0, 4)
    chi = np.linalg.norm(np.random.default_rng(1).standard_normal((200_000, WIDTH)), axis=1).mean()
    assert numbers["mm_dist"] == pytest.approx(sigma * chi, rel=4 / np.sqrt(people * WIDTH))
    assert 0 < numbers["fid"] < 2 * sigma**2 * WIDTH
    assert text.of_generated(trial(Painter(5 * sigma)), 0, 4)["r1"] < numbers["r1"]


def test_multimodality_is_the_distance_of_two_draws() -> None:
    """Two independent draws of noise sigma are sqrt(2) sigma chi_d apart; pairing one with itself would lower it."""
    sigma = 0.5
    distance = text._several(trial(Painter(sigma)), 0, 4, captions=20, samples=20)
    chi = np.linalg.norm(np.random.default_rng(1).standard_normal((200_000, WIDTH)), axis=1).mean()
    assert distance == pytest.approx(np.sqrt(2) * sigma * chi, rel=0.06)
    pairs_of_two = text._several(trial(Painter(sigma)), 0, 4, captions=32, samples=2)
    assert pairs_of_two == pytest.approx(np.sqrt(2) * sigma * chi, rel=0.2)


def test_a_judge_who_sees_nothing_finds_by_chance_and_never_by_equal_words() -> None:
    """Equal embeddings are no hits, whatever order they are sorted in."""
    numbers = text.of_generated(trial(Painter(), judge=Judge(blind=True)), 0, 2)
    assert (numbers["r1"], numbers["r3"], numbers["r3_same"]) == (pytest.approx(1 / 8), pytest.approx(3 / 8), 0)


def test_motions_of_the_same_words_count_as_hits_only_in_their_own_column() -> None:
    """Texts 0 and 1 are alike and their motions lie crosswise: the published count misses both, the other hits both."""
    texts = np.array([[0.0], [0.1], [10.0], [20.0]])
    motions = np.array([[0.1], [0.0], [10.0], [20.0]])
    captions = ["A man walks.", "a man  walks", "sits", "jumps"]
    assert text.r_precision(texts, motions, top=1, batch=4)[0] == 0.5
    assert text.same_words_precision(texts, motions, captions, top=1, batch=4) == 1
    other = ["a man walks", "a man runs", "sits", "jumps"]
    assert text.same_words_precision(texts, motions, other, top=1, batch=4) == 0.5
    assert text.same_words_precision(texts, motions, captions, top=1, batch=2) == 1


def test_no_two_motions_share_a_seed_and_step_counts_share_theirs() -> None:
    """Replications and samples are independent; rows of other steps start from the same noise, so that they pair."""
    painter = Painter()
    text.measure(trial(painter))
    seeds = {steps: [s for n, _, _, row in painter.calls if n == steps for s in row] for steps in (2, 4)}
    assert seeds[2] == seeds[4]
    assert len(set(seeds[2])) == len(seeds[2]) == 3 * 32 + 2 * 3 * 4


def test_each_replication_deals_other_captions_in_another_order() -> None:
    one = trial(Painter())
    first, second = one.shuffle(0), one.shuffle(1)
    assert first[0] != second[0]
    assert list(first[1]) != list(second[1])
    assert (one.shuffle(0)[0], list(one.shuffle(0)[1])) == (first[0], list(first[1]))


@pytest.mark.parametrize("lengths", ["exact", "padded"])
def test_the_judge_sees_the_real_lengths_to_the_frame(lengths: str) -> None:
    judge, painter = Judge(), Painter()
    one = trial(painter, replace(SMALL, lengths=lengths), judge=judge)  # type: ignore[arg-type]
    judge.seen.clear()
    text.of_generated(one, 2, 4)
    assert judge.seen == list(one.real.frames) == [40 + 4 * (k % 3) for k in range(32)]
    assert set(painter.calls[0][2]) == ({196} if lengths == "padded" else {40, 44, 48})


def test_a_generator_of_other_lengths_is_a_programming_error() -> None:
    class Short(Painter):
        def __call__(self, prompts, frames, *, seeds, steps):
            return super().__call__(prompts, [n - 1 for n in frames], seeds=seeds, steps=steps)

    with pytest.raises(ValueError, match="lengths"):
        text.of_generated(trial(Short()), 0, 2)


def test_captions_of_published_length_are_read_beside_generated_motions_only() -> None:
    class Padding(Judge):
        def with_caption_length(self, kind: str) -> Judge:
            assert kind == "published"
            return Judge(blind=True)

    results = text.measure(trial(Painter(), replace(SMALL, caption_length="published"), judge=Padding()))
    assert values(results, "real")["mm_dist"] == pytest.approx(0, abs=1e-9)
    lengths = [np.linalg.norm(place(k)) for k in range(32)]
    assert values(results, "default, 2 steps")["mm_dist"] == pytest.approx(np.mean(lengths))
    assert "22" in results.protocol["caption length"]
    with pytest.raises(MotionloomError, match="caption length"):
        trial(Painter(), replace(SMALL, caption_length="published"))


def test_a_stopped_run_goes_on_and_ends_as_if_it_had_not_stopped(tmp_path: Path) -> None:
    whole = text.measure(trial(Painter(0.3)), memory=lambda steps: 100.0 + steps)
    parts = Parts(tmp_path, fingerprint(SMALL.sampling()))
    with pytest.raises(KeyboardInterrupt):
        text.measure(trial(Painter(0.3, stop_after=3)), parts=parts)
    second = Painter(0.3)
    resumed = text.measure(trial(second), parts=parts, memory=lambda steps: 100.0 + steps)
    assert len(second.calls) == 2 * 3 + 2 * 2 - 2  # both calls of the first replication were done
    assert _timeless(resumed) == _timeless(whole)
    third = Painter(0.3)
    text.measure(trial(third), parts=parts, memory=lambda steps: pytest.fail("measured twice"))
    assert third.calls == []


def _timeless(results: Report) -> str:
    rows = [
        replace(r, values={k: v for k, v in r.values.items() if k not in ("ms", "per_second")}) for r in results.rows
    ]
    return json.dumps(report.encode(replace(results, rows=tuple(rows))))


def test_more_replications_go_on_from_fewer_and_other_settings_do_not(tmp_path: Path) -> None:
    text.measure(trial(Painter()), parts=Parts(tmp_path, fingerprint(SMALL.sampling())))
    more, painter = replace(SMALL, replications=4, steps=(2, 4, 6)), Painter()
    text.measure(trial(painter, more), parts=Parts(tmp_path, fingerprint(more.sampling())))
    assert len(painter.calls) == 2 + 4 + 2
    other = replace(SMALL, seed=1)
    with pytest.raises(MotionloomError, match="other settings"):
        text.measure(trial(Painter(), other), parts=Parts(tmp_path, fingerprint(other.sampling())))


@pytest.mark.parametrize("damage", ["", "[]", "{}", '{"settings": "x", "numbers": {"r1": NaN}}', '{"settings": 3'])
def test_a_damaged_part_is_one_clear_sentence(tmp_path: Path, damage: str) -> None:
    parts = Parts(tmp_path, "x")
    parts.keep("2 steps 0", {"r1": 1.0})
    path = parts.path("2 steps 0")
    assert path is not None
    assert parts.find("2 steps 0") == {"r1": 1.0}
    path.write_text(damage)
    with pytest.raises(MotionloomError, match=path.name):
        parts.find("2 steps 0")


def test_intervals_are_over_replications_and_real_numbers_that_never_change_have_none() -> None:
    results = text.measure(trial(Painter(0.6)))
    numbers, real = results.row("default, 4 steps"), results.row("real")
    assert numbers is not None
    assert real is not None
    assert numbers.values["r1"].count == 3
    assert numbers.values["multimodality"].count == 2
    assert numbers.values["r1"].interval > 0
    assert real.values["jerk"].count == real.values["fid"].count == 1
    assert "multimodality" not in real.values


def test_too_few_items_for_a_batch_is_a_mistake() -> None:
    with pytest.raises(MotionloomError, match="7 real items"):
        trial(Painter(), people=7)


def test_the_report_can_be_read_again_and_its_published_rows_stand_apart() -> None:
    results = text.measure(trial(Painter()), run=Run(command="motionloom evaluate text"))
    plain = json.loads(json.dumps(report.encode(results)))
    assert report.encode(report.decode(plain)) == plain
    page = report.markdown(results)
    assert page.index("default, 4 steps") < page.index("other data") < page.index("DoubleTake, first take only")


def test_published_rows_are_marked_and_possible() -> None:
    """Shares lie in 0..1 and grow with k; none claims to be measured here."""
    rows = tables.published("text", [column.name for column in text.COLUMNS])
    assert len(rows) == 33
    for row in rows:
        shares = [row.values[k].mean for k in ("r1", "r2", "r3") if k in row.values]
        assert "HumanML3D" in row.measured_on
        assert shares == sorted(shares)
        assert all(0 < share < 1 for share in shares)
    assert len({(row.name, row.measured_on) for row in rows}) == len(rows)


def test_numbers_say_what_was_measured_and_how_small_samples_bias_them() -> None:
    results = text.measure(trial(Painter()))
    assert results.protocol["items"] == 32
    expectations = {
        "data",
        "split",
        "items",
        "frames per second",
        "representation",
        "statistics",
        "caption length",
        "seed",
        "generated lengths",
        "sampler",
        "steps",
        "guidance",
        "replications",
        "interval",
        "evaluator",
    }
    assert expectations <= results.protocol.keys()
    assert "16 each" in " ".join(results.notes)


def test_a_run_is_known_again_by_its_items_and_not_by_digits_that_threads_change() -> None:
    real = trial(Painter()).real
    assert text.identity(replace(real, motions=real.motions + 1e-9)) == text.identity(real)
    others = ({"names": real.names[::-1]}, {"frames": real.frames[::-1]}, {"physical": real.physical + 1})
    assert len({text.identity(real), *(text.identity(replace(real, **other)) for other in others)}) == 4
