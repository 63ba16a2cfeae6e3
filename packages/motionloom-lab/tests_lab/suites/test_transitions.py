"""The suite of long motion in a world where every number is known (`tests_lab.suites.judged`); methods are made up."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.methods.double_take import rows_of
from motionloom.core.skeleton import SMPL22
from motionloom_lab.metrics.transitions import JERK_HUMANML3D
from motionloom_lab.report import report
from motionloom_lab.suites import long_baselines, real_seams, text_reference, transitions
from motionloom_lab.suites.harness import Parts, Run
from motionloom_lab.suites.long_baselines import DEFAULT, Long, methods, titled
from motionloom_lab.suites.protocol import Selection, Transitions, quick_transitions
from motionloom_lab.suites.registry import chosen
from tests.recorded import tiny
from tests_lab.suites.judged import HIDDEN, Judge, features, item, number_in, place

HOW = Transitions(intervals=8, unfoldings=2, replications=2)
SPREAD = np.linspace(0.0, 1.7, 22)[:, None] * np.array([0.0, 1.0, 0.0])
"""A stick of 22 joints; both toes are high above the floor unless put down."""


def standing(frames: int) -> np.ndarray:
    return np.tile(SPREAD + np.array([0.0, 0.2, 0.0]), (frames, 1, 1))


class Maker:
    """A way that draws whom it is told and moves as ``path`` (frames of each) says."""

    def __init__(self, path=lambda frames: standing(sum(frames)), *, stop_after: int | None = None) -> None:
        self.path, self.stop_after = path, stop_after
        self.calls: list[tuple[tuple[str, ...], tuple[int, ...], int]] = []

    def __call__(self, prompts: Sequence[str], frames: Sequence[int], seed: int) -> Long:
        if self.stop_after is not None and len(self.calls) >= self.stop_after:
            raise KeyboardInterrupt
        self.calls.append((tuple(prompts), tuple(frames), seed))
        numbers = np.concatenate([features(place(number_in(p)), n) for p, n in zip(prompts, frames, strict=True)])
        return Long(numbers, self.path(frames))


def trial(how: Transitions = HOW, *, people: int = 40, crops: bool = True) -> transitions.SeamTrial:
    judge = Judge()
    items = [item(k, 64 + 4 * (k % 30)) for k in range(people)]
    real = text_reference.measure(items, judge, Selection())
    cut = real_seams.SeamCrops.of([one.features for one in items], how.window, judge) if crops else None
    short = real_seams.SeamCrops.of([one.features for one in items], how.handshake, judge) if crops else None
    return transitions.prepare(judge, real, how, cut, real_seams.load_shipped(), handshakes=short)


def test_cuts_and_windows_are_the_papers_own() -> None:
    """Segments of 70, 80 and 90 with h = 20: L - h at both ends, L - 2h inside; windows are seam - 30 to seam + 30."""
    assert transitions.cut([70, 80, 90], 10) == [slice(0, 60), slice(80, 140), slice(160, 240)]
    assert transitions.windows([70, 80, 90], 60) == [slice(40, 100), slice(120, 180)]
    rows = rows_of([70, 80, 90], 20)
    assert rows == [80, 100, 100]
    end = rows[0]
    assert (end - 20 - 20, end + 20) == (40, 100)  # e_i - h - M/2 : e_i + M/2


def test_rows_of_double_take_unfold_to_the_visible_frames() -> None:
    """For odd handshakes too."""
    for handshake in (1, 2, 15, 20, 33):
        frames = [97, 60, 131, 80]
        assert sum(rows_of(frames, handshake)) - 3 * handshake == sum(frames)


def test_every_interval_is_long_enough_for_double_take_and_not_beyond_the_data() -> None:
    frames = [60, 60, 176]
    assert (HOW.shortest, HOW.longest) == (60, 176)
    assert min(rows_of(frames, HOW.handshake)) == 70
    assert max(rows_of([100, 176, 100], HOW.handshake)) == 196


def test_perfect_segments_match_their_words_and_lie_where_real_ones_lie() -> None:
    """R@3 is 1, MM-Dist 0; FID is that of the same people among all, as in the real row."""
    world = trial()
    numbers, real = transitions.of_method(world, Maker(), 0), transitions.of_real(world, 0)
    assert numbers["r3"] == 1
    assert numbers["mm_dist"] == pytest.approx(0, abs=1e-9)
    assert numbers["fid"] == pytest.approx(real["fid"])
    assert numbers["diversity"] == pytest.approx(real["diversity"])


def test_a_window_sees_both_its_neighbours() -> None:
    """The judge reads the mean of each window: half of one person and half of the next."""
    world, calls = trial(), []
    judge = world.evaluator
    read = judge.motions
    judge.motions = lambda parts: calls.append(parts) or read(parts)  # type: ignore[method-assign]
    maker = Maker()
    transitions.of_method(world, maker, 0)
    prompts = maker.calls[0][0]
    first = calls[1][0][:, HIDDEN].mean(0)
    frames = maker.calls[0][1]
    assert [len(part) for part in calls[0][:8]] == [frames[0] - 10, *(n - 20 for n in frames[1:7]), frames[7] - 10]
    assert len(calls[1]) == HOW.seams
    assert first == pytest.approx((place(number_in(prompts[0])) + place(number_in(prompts[1]))) / 2)


def test_a_jump_at_the_seam_has_the_jerk_and_the_step_of_a_step_function() -> None:
    """Third differences of a step of s are s, 2s, s: peak 2s, area 4s above a reference of zero; the step itself s."""

    def jumping(frames: Sequence[int]) -> np.ndarray:
        p = standing(sum(frames))
        for seam in np.cumsum(frames)[:-1]:
            p[seam:, :, 0] += 0.25
        return p

    numbers = transitions.of_method(replace(trial(), mean_jerk=0.0), Maker(jumping), 0)
    assert numbers["pj"] == pytest.approx(0.5)
    assert numbers["auj"] == pytest.approx(1.0)
    assert numbers["auj_own"] == pytest.approx(1.0)
    assert numbers["step"] == pytest.approx(250)
    small = JERK_HUMANML3D
    assert numbers["auj_humanml3d"] == pytest.approx(0.25 * 4 - 3 * small + 54 * small)
    assert numbers["seam_jerk"] == pytest.approx(0.25 * 4 / 57 * FPS**3)
    assert numbers["inside_jerk"] == pytest.approx(0, abs=1e-6)


def test_what_shakes_alike_everywhere_has_no_area_of_its_own() -> None:
    """A body that jerks to and fro by 1 cm each frame: third difference 4 cm, in windows and outside."""

    def shaking(frames: Sequence[int]) -> np.ndarray:
        p = standing(sum(frames))
        p[::2, :, 0] += 0.01
        return p

    numbers = transitions.of_method(trial(), Maker(shaking), 0)
    assert numbers["pj"] == pytest.approx(0.04)
    assert numbers["auj_own"] == pytest.approx(0, abs=1e-9)
    assert numbers["auj"] == pytest.approx(57 * abs(0.04 - trial().mean_jerk))


def test_skate_is_counted_on_its_own_side_of_the_window() -> None:
    """Feet on the floor that slide 5 cm a frame inside the windows only, then outside only."""

    def sliding(frames: Sequence[int], *, inside: bool) -> np.ndarray:
        p = standing(sum(frames))
        p[:, [10, 11], 1] = 0.0
        moves = np.full(sum(frames), not inside)
        for part in transitions.windows(frames, 60):
            moves[part] = inside
        p[:, :, 2] += np.concatenate([[0], np.cumsum(moves[:-1] * 0.05)])[:, None]
        return p

    world = trial()
    seam = transitions.of_method(world, Maker(lambda frames: sliding(frames, inside=True)), 0)
    away = transitions.of_method(world, Maker(lambda frames: sliding(frames, inside=False)), 0)
    assert (seam["seam_share"], seam["inside_share"]) == (pytest.approx(100), 0)
    assert (seam["seam_speed"], seam["inside_speed"]) == (pytest.approx(100), 0)
    assert (seam["seam_slide"], seam["inside_slide"]) == (pytest.approx(50), 0)
    assert (away["seam_share"], away["inside_share"]) == (0, pytest.approx(100))


def test_all_ways_get_the_same_prompts_lengths_and_seeds_and_no_item_twice() -> None:
    first, second = Maker(), Maker()
    table = transitions.measure(trial(), {"ours": first, "slerp": second})
    assert first.calls == second.calls
    assert len(first.calls) == HOW.replications * HOW.unfoldings
    assert len({seed for _, _, seed in first.calls}) == 4
    for replication in (0, 1):
        said = [p for prompts, _, _ in first.calls[2 * replication : 2 * replication + 2] for p in prompts]
        assert len({number_in(p) for p in said}) == 16
    lengths = [n for _, frames, _ in first.calls for n in frames]
    assert min(lengths) >= HOW.shortest
    assert max(lengths) <= HOW.longest
    assert [row.name for row in table.rows[:3]] == ["real", titled("ours", 24), titled("slerp", 24)]
    assert table.rows[1].values["auj"].count == 2


def test_a_report_has_the_published_rows_beside_and_can_be_read_again() -> None:
    table = transitions.measure(trial(), {"ours": Maker()}, run=Run(command="motionloom evaluate transitions"))
    again = report.decode(json.loads(json.dumps(report.encode(table))))
    assert again.row("real") is not None
    elsewhere = {row.name for row in again.rows if row.measured_on}
    assert {"TEACH", "DoubleTake", "DoubleTake, first take only"} <= elsewhere
    assert {c.name for c in table.columns} == set(table.rows[1].values)  # nothing is declared that is not measured
    assert "half a handshake at each seam" in report.markdown(table)


def test_a_stopped_run_goes_on_with_the_next_replication(tmp_path: Path) -> None:
    world, parts = trial(), Parts(tmp_path, "settings")
    with pytest.raises(KeyboardInterrupt):
        transitions.measure(world, {"ours": Maker(stop_after=HOW.unfoldings)}, parts=parts)
    rest = Maker()
    table = transitions.measure(world, {"ours": rest}, parts=parts)
    whole = transitions.measure(world, {"ours": Maker()})
    assert len(rest.calls) == HOW.unfoldings
    a, b = (dict(one.rows[1].values) for one in (table, whole))
    assert {k: v.mean for k, v in a.items() if k != "cost"} == {k: v.mean for k, v in b.items() if k != "cost"}


def test_without_recordings_the_shipped_numbers_stand_in_the_real_row() -> None:
    how = replace(HOW, unfoldings=1)  # 7 windows, which were measured
    numbers = transitions.of_real(trial(how, crops=False), 0)
    shipped = json.loads(real_seams.shipped_file().read_text())
    assert numbers["pj"] == shipped["jerks"]["7"]["pj"]
    assert numbers["seam_share"] == shipped["physical"]["share"]
    assert "transition_fid" not in numbers
    assert "transition_fid" not in transitions.of_method(trial(how, crops=False), Maker(), 0)
    other = transitions.of_real(trial(replace(HOW, intervals=6), crops=False), 0)  # of 10 windows nothing was measured
    assert "pj" not in other
    assert "seam_share" in other


def test_shipped_numbers_are_those_of_their_own_windows(tmp_path: Path) -> None:
    """Written, read back, and computed once more by hand on the same windows."""
    moving = [features(place(k), 80) + 0.01 * np.random.default_rng(k).standard_normal((80, 263)) for k in range(9)]
    crops = real_seams.SeamCrops.of(moving, 60, None)
    numbers = real_seams.measure_shipped(crops, source="made up")
    (tmp_path / "r.json").write_text(json.dumps(numbers))
    copy = real_seams.load_shipped(tmp_path / "r.json")
    assert copy is not None
    assert copy.mean_jerk == pytest.approx(crops.mean_jerk)
    assert set(copy.jerks) == {7}
    draws = [crops.again(7, seed=(0, 3, r)).positions for r in range(real_seams.REPEATS)]
    peaks = [np.abs(np.diff(p, n=3, axis=1)).sum(-1).max(-1).mean(0).max() for p in draws]
    assert copy.jerks[7]["pj"] == pytest.approx(np.mean(peaks), abs=1e-6)


@pytest.mark.parametrize("change", ["[]", '{"format": 2}', "not json", '{"format": 1, "physical": {"share": "x"}}'])
def test_damaged_shipped_numbers_are_one_sentence(tmp_path: Path, change: str) -> None:
    (tmp_path / "r.json").write_text(change)
    with pytest.raises(MotionloomError, match="no numbers of real transitions"):
        real_seams.load_shipped(tmp_path / "r.json")


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (replace(HOW, intervals=3), "too few for R@3"),
        (replace(HOW, intervals=32), "need 64 real items and there are 40"),
    ],
)
def test_too_little_real_motion_is_refused(how: Transitions, said: str) -> None:
    with pytest.raises(MotionloomError, match=said):
        trial(how)


@pytest.mark.parametrize(
    "change",
    [
        *({"steps": 0}, {"replications": 0}, {"guidance": float("inf")}, {"seed": -1}, {"margin": 1000}),
        *({"intervals": 0}, {"rows": "table9"}, {"mode": "mine"}, {"ramp": -1}),
    ],
)
def test_settings_that_cannot_be_are_refused(change: dict) -> None:
    with pytest.raises(MotionloomError):
        Transitions(**change)


def test_a_quick_protocol_is_small() -> None:
    assert quick_transitions(Transitions()) == Transitions(intervals=8, unfoldings=1, replications=2)


# ---- the ways themselves, with a tiny prior ---


@pytest.mark.parametrize("name", ["published", "paper", "first-take", "second-take", "concatenation", "slerp"])
def test_ways_give_the_visible_frames(name: str) -> None:
    prior, how = tiny.prior(), replace(HOW, steps=3)
    (method,) = methods(prior, how, [name]).values()
    prompts, frames = ["a person walks", "a person jumps", "a person waves"], [60, 71, 64]
    motion = method(prompts, frames, 5)
    assert motion.features.shape == (195, 263)
    assert motion.positions.shape == (195, 22, 3)
    assert np.isfinite(motion.positions).all()
    assert np.array_equal(motion.positions, method(prompts, frames, 5).positions)


PAPER = [row.split() for row in ("20 10 .1", "20 10 .1", "20 10 .1", "20 0 .1", "20 20 .1", "30 10 .1", "40 10 .1")]
PAPER += [["20", "10", "0"], ["20", "10", ".2"]]
"""h, b and M_soft of the nine rows of DoubleTake in the paper's Table 2, the second without its second take and the
third without joining in its first."""


@pytest.mark.parametrize(("mode", "hard", "restart"), [("paper", None, None), ("published", 0.7, 0.5)])
def test_table_2_has_the_papers_nine_rows(monkeypatch: pytest.MonkeyPatch, mode: str, hard, restart) -> None:
    """All with the settings that the paper names, the same visible frames, and what the command was given besides."""
    calls: list[dict] = []
    real = long_baselines.double_take_features

    def watched(prior, prompts, frames, **named):
        calls.append({"frames": frames, **named})
        return real(prior, prompts, frames, **named)

    monkeypatch.setattr(long_baselines, "double_take_features", watched)
    how = replace(HOW, steps=2, rows="table2", mode=mode, hard=hard, restart=restart)
    ways = methods(tiny.prior(), how)
    frames = [how.shortest, how.longest, how.shortest]
    for method in ways.values():
        assert len(method(["a person walks", "a person jumps", "a person waves"], frames, 5).features) == sum(frames)
    usual = 0.1 if mode == "paper" else 0.0
    for (h, b, soft), call in zip(PAPER, calls, strict=True):
        assert (call["handshake"], call["ramp"], call["mode"]) == (int(h), int(b), mode)
        assert call.get("soft", float(soft) if soft == ".1" else usual) == float(soft)
        assert (call.get("hard"), call.get("restart")) == (hard, restart)
    only = [(call.get("first_take_only", False), call.get("second_take_only", False)) for call in calls]
    assert only == [(False, False), (True, False), (False, True), *[(False, False)] * 6]
    published = {row.name for row in transitions.measure(trial(), {"x": Maker()}).rows if row.measured_on}
    assert set(ways) <= published


def test_rows_of_a_table_and_named_ways_go_together() -> None:
    names = list(methods(tiny.prior(), replace(HOW, rows="table2"), ["slerp"]))
    assert (len(names), names[-1]) == (10, "slerp")


def test_concatenation_is_decoded_once() -> None:
    """Segments drawn alone, one after the other; the root goes on where it was."""
    from motionloom.tasks.text import sample_features

    prior = tiny.prior()
    (method,) = methods(prior, replace(HOW, steps=3), ["concatenation"]).values()
    motion = method(["a person walks", "a person jumps"], [60, 64], 5)
    alone = sample_features(prior, ["a person walks", "a person jumps"], [60, 64], seeds=[5, 6], steps=3)
    assert motion.features == pytest.approx(np.concatenate(alone), abs=1e-6)
    step = np.linalg.norm(motion.positions[60, 0, [0, 2]] - motion.positions[59, 0, [0, 2]])
    assert step == pytest.approx(np.linalg.norm(motion.features[59, 1:3]), abs=1e-5)


def test_ways_by_name() -> None:
    prior = tiny.prior()
    assert tuple(methods(prior, HOW)) == DEFAULT
    assert list(methods(prior, HOW, ["slerp", "ours", "slerp"])) == ["slerp", "ours"]
    with pytest.raises(MotionloomError, match="no method 'magic'"):
        methods(prior, HOW, ["magic"])
    with pytest.raises(MotionloomError, match="no method is named; the methods are ours, "):
        methods(prior, HOW, ())
    assert titled("published-1000", 24) != titled("published", 24)
    assert len({titled(name, 24) for name in long_baselines.TITLES}) == len(long_baselines.TITLES)


# ---- the command and the suite ---


def test_the_command_asks_for_what_was_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys) -> None:
    calls = {}

    def fake(run: Run, **named) -> report.Report:
        calls.update(named, command=run.command)
        return report.Report("transitions", "Long", run.command, {}, transitions.COLUMNS, ())

    monkeypatch.setattr(transitions, "run", fake)
    words = ["--methods", "ours,paper", "--intervals", "16", "--steps", "12", "--split", "test", "--out", str(tmp_path)]
    assert main(["evaluate", "transitions", *words, "--data", "/home/me/set"]) == 0
    assert calls["names"] == ("ours", "paper")
    assert calls["how"] == Transitions(intervals=16, steps=12)
    assert calls["selection"].splits == ("test",)
    assert calls["command"] == (
        "motionloom evaluate transitions --weights default --data SET --methods ours,paper --intervals 16 --steps 12 "
        "--split test"
    )
    assert report.read(tmp_path).suite == "transitions"
    assert "Long" in capsys.readouterr().out


def test_the_suite_runs_the_same_measurement(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from motionloom_lab.suites.registry import Job, Tools

    calls = {}

    def fake(run: Run, **named) -> report.Report:
        calls.update(named, command=run.command)
        return report.Report("transitions", "Long", run.command, {}, transitions.COLUMNS, ())

    monkeypatch.setattr(transitions, "run", fake)
    (suite,) = chosen(["transitions"])
    tools = Tools(*[lambda *_: None] * 4)  # type: ignore[list-item]
    suite.run(Job("default", tools, data=tmp_path, quick=True), suite.settings(True))
    assert calls["how"] == quick_transitions(Transitions())
    assert calls["command"] == "motionloom evaluate all --only transitions --weights default --data SET --quick"


def test_a_skeleton_of_the_world_is_the_bodys() -> None:
    """The stick has as many joints as the body that the metrics read."""
    assert standing(1).shape[1] == len(SMPL22)
