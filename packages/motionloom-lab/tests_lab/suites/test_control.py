"""The control suite in a world where every number is known: people who walk, and ways of control that are made up."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT, mask
from motionloom.core.features.representation import HUMANML3D
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.report import report
from motionloom_lab.suites import control, control_kinds
from motionloom_lab.suites.control_kinds import Kind, Target, kind
from motionloom_lab.suites.control_methods import (
    BASE,
    EXPORTED,
    METHODS,
    OURS,
    UNCONTROLLED,
    Track,
    groups,
    of_motion,
)
from motionloom_lab.suites.harness import Parts, Run, physical_mean
from motionloom_lab.suites.items import Item
from motionloom_lab.suites.protocol import Selection
from tests.kinematics.people import FPS, standing, walking

WRIST = SMPL22.names.index("left_wrist")
SMALL = control.settings(count=4, replications=2)


class Judge:
    """Sees how fast somebody is and what number a caption says."""

    name, about, representation = "judge", dict[str, str](), HUMANML3D

    def motions(self, features: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack([[f[:, 2].mean(), f[:, 3].mean(), f[:, 0].std()] for f in features])

    def texts(self, captions: Sequence[Caption]) -> np.ndarray:
        return np.stack([[len(c.text), 0.0, 1.0] for c in captions])


def walker(k: int) -> Item:
    """Somebody who walks, faster with k, and turns while walking."""
    features = humanml.positions_to_features(walking(0.6 + 0.1 * k, 3.0 + 0.2 * (k % 2)), FPS).astype(np.float64)
    features[:, 0] = 0.002 * (1 + k % 3)
    return Item(f"walker{k}", "cmu", "test", (Caption(f"person {k} walks{'.' * k}"),), features)


ITEMS = [walker(k) for k in range(6)]
Way = Callable[[Target, int], Track]


def perfect(target: Target, seed: int) -> Track:
    return Track(humanml.decode_positions(target.known), target.known)


def stubborn(target: Target, seed: int) -> Track:
    """Walks straight ahead whatever is asked, a bit shakily."""
    positions = walking(1.0, len(target) / FPS + 0.2)[: len(target)]
    positions = positions + 0.002 * np.random.default_rng(seed).standard_normal(positions.shape)
    return Track(positions, target.known)


class Fakes:
    """A way of control per row; counts what is made, and stops where it is told to."""

    def __init__(self, *, controlled: Way = perfect, stop_after: int | None = None, refuses: str = "") -> None:
        self.controlled, self.stop_after, self.refuses = controlled, stop_after, refuses
        self.calls: list[tuple[str, str, tuple[int, ...]]] = []

    def __call__(self, one: Kind, name: str):
        if name == self.refuses:
            raise MotionloomError("there is no such adapter")
        way = stubborn if name in BASE.values() else self.controlled

        def draw(targets: Sequence[Target], *, seeds: Sequence[int]) -> list[Track]:
            if self.stop_after is not None and len(self.calls) >= self.stop_after:
                raise KeyboardInterrupt
            self.calls.append((one.name, name, tuple(seeds)))
            return [way(target, seed) for target, seed in zip(targets, seeds, strict=True)]

        return draw


def trial(fakes: Fakes) -> control.ControlTrial:
    return control.prepare(ITEMS, Judge(), fakes, SMALL, scale=np.ones(263), selection=Selection())


def values(results: report.Report, row: str) -> dict[str, float]:
    line = results.row(row)
    assert line is not None, [r.name for r in results.rows]
    return {name: value.mean for name, value in line.values.items()}


@pytest.mark.parametrize("name", control_kinds.DEFAULT)
def test_a_perfect_controller_has_no_error_and_fails_nowhere(name: str) -> None:
    one = kind(name)
    targets = [control_kinds.target_of(one, item.features, "walks") for item in ITEMS]
    errors = control.met([perfect(target, 0) for target in targets], targets, np.ones(263))
    assert errors
    assert max(errors.values()) == pytest.approx(0, abs=1e-6)


def test_who_ignores_the_goal_has_the_error_of_a_loop() -> None:
    targets = [control_kinds.target_of(kind("trajectory+left_wrist"), item.features, "walks") for item in ITEMS]
    tracks = [stubborn(target, 3) for target in targets]
    errors = control.met(tracks, targets, np.ones(263))
    root, joint = [], []
    for one, item in zip(tracks, ITEMS, strict=True):
        real = humanml.decode_positions(item.features)
        for t in range(len(real)):
            root.append(np.hypot(*(one.positions[t, 0] - real[t, 0])[[0, 2]]))
            joint.append(np.linalg.norm(one.positions[t, WRIST] - real[t, WRIST]))
    assert errors["root_error"] == pytest.approx(100 * np.mean(root))
    assert errors["joint_error"] == pytest.approx(100 * np.mean(joint))
    both = np.array(root + joint)
    assert errors["beyond_20"] == pytest.approx((both > 0.2).mean())
    assert errors["beyond_50"] == pytest.approx((both > 0.5).mean())
    assert errors["worst"] == pytest.approx(100 * both.max())


def test_where_a_goal_faces_is_where_its_features_say() -> None:
    """The yaw number is minus half the angle to the left, so 0.002 a frame is 0.004 to the right: atan2 of the body."""
    target = control_kinds.target_of(kind("trajectory"), ITEMS[0].features, "walks")
    angle = ITEMS[0].features[:, 0]
    assert target.goal.facing == pytest.approx(-2 * np.concatenate([[0], np.cumsum(angle)[:-1]]))
    body = physics.heading(target.goal.positions)
    assert np.diff(target.goal.facing).mean() == pytest.approx(np.diff(body).mean(), rel=0.1)


@pytest.mark.parametrize(
    ("name", "pairs", "fixed"),
    [
        ("trajectory", 60, 60 * 3),
        ("left_wrist", 60, 60 * 3),
        ("trajectory+head", 120, 60 * 6),
        ("left_wrist+right_foot", 120, 60 * 6),
        ("keyframes", 2, 2 * 3),
        ("in_between", 30 * 22, 30 * 263),
    ],
)
def test_a_kind_asks_for_so_many_places_and_fixes_so_many_numbers(name: str, pairs: int, fixed: int) -> None:
    features = ITEMS[0].features
    target = control_kinds.target_of(kind(name), np.concatenate([features, features])[:60], "walks")
    assert (target.goal.mask.any(axis=-1).sum(), target.mask.sum()) == (pairs, fixed)


def test_keyframes_are_whole_seconds_and_in_between_leaves_the_middle() -> None:
    assert np.flatnonzero(kind("keyframes").frames(70)).tolist() == [20, 40, 60]
    frames = np.flatnonzero(kind("in_between").frames(100))
    assert frames.tolist() == [*range(20), *range(80, 100)]
    assert np.flatnonzero(kind("in_between").frames(40)).tolist() == [*range(10), *range(30, 40)]


def test_the_published_numbers_are_the_published_masks() -> None:
    target = control_kinds.target_of(kind("trajectory+left_wrist"), ITEMS[0].features, "walks")
    assert (target.mask == (mask("root_horizontal") | mask("left_wrist"))).all()
    assert not target.mask[:, LAYOUT["root_height"]].any()


def test_a_joint_without_the_trajectory_is_asked_in_the_world_and_its_path_is_not() -> None:
    goal = control_kinds.target_of(kind("left_wrist"), ITEMS[2].features, "walks").goal
    assert goal.joints == ("left_wrist",)
    assert not goal.facing_mask.any()
    assert goal.mask[:, WRIST].all()
    assert goal.positions[-1, WRIST, 2] > 0.5


def test_titles_are_those_of_the_published_rows() -> None:
    results = control.measure(
        trial(Fakes()), control_kinds.kinds(["trajectory", "left_wrist", "trajectory+left_wrist"])
    )
    published = {row.name for row in results.rows if row.measured_on}
    here = {row.name for row in results.rows if not row.measured_on}
    assert len(published & here) == 6


def test_one_control_is_fine_tuned_and_several_are_blended() -> None:
    names = [row.name for row in control.measure(trial(Fakes()), control_kinds.kinds(["head", "trajectory+head"])).rows]
    assert "head, fine-tuned" in names
    assert "head, DiffusionBlending" not in names
    assert "head + trajectory, DiffusionBlending" in names
    assert "head + trajectory, fine-tuned" not in names


def test_real_motions_stand_beside_and_ratios_are_to_the_uncontrolled_row() -> None:
    results = control.measure(trial(Fakes()), control_kinds.kinds(["trajectory"]))
    real, plain, ours = (values(results, row) for row in ("real", "trajectory, uncontrolled", "trajectory, ours"))
    for name in ("skate_share", "skate_speed", "skate_slide", "jerk", "penetration", "diversity", "fid", "r3"):
        assert ours[name] == pytest.approx(real[name]), name
    assert plain["jerk_ratio"] == plain["slide_ratio"] == 1
    clips = [
        humanml.decode_positions(item.features)
        for item in control.prepare(ITEMS, Judge(), Fakes(), SMALL, scale=np.ones(263), selection=Selection()).items
    ]
    jerks = np.average([physics.jerk(c, FPS).mean for c in clips], weights=[len(c) for c in clips])
    assert ours["jerk"] == pytest.approx(jerks)
    assert ours["jerk_ratio"] == pytest.approx(ours["jerk"] / plain["jerk"], rel=0.05)
    assert plain["root_error"] > 5
    assert ours["root_error"] == pytest.approx(0, abs=1e-9)
    assert "joint_error" not in ours


def test_exported_motions_are_held_against_exported_ones() -> None:
    """The two uncontrolled rows differ; each controlled row must be a ratio to its own."""
    numbers, plain = {"jerk": 6.0, "skate_share": 1.0, "skate_speed": 1.0, "skate_slide": 1.0}, {"jerk": 3.0}
    zero = {"skate_share": 0.0, "skate_speed": 0.0, "skate_slide": 1e-13}
    (ratios,) = control.against([numbers], [plain | zero])
    assert ratios["jerk_ratio"] == 2
    assert not {"share_ratio", "slide_ratio"} & set(ratios)  # nothing is so many times nothing
    assert control.against([numbers], None) == [numbers]
    assert {BASE[name] for name in ("MDM inpainting", "fine-tuned", "DiffusionBlending")} == {UNCONTROLLED}
    assert {BASE[name] for name in (OURS, "ours without exact fit")} == {EXPORTED}


def test_every_way_has_the_same_seeds_and_no_two_replications_share_one() -> None:
    fakes = Fakes()
    control.measure(trial(fakes), control_kinds.kinds(["trajectory"]))
    seeds = {name: [s for _, n, s in fakes.calls if n == name] for name in METHODS}
    assert seeds[OURS] == seeds[UNCONTROLLED] == seeds["MDM inpainting"]
    first, second = seeds[OURS]
    assert not set(first) & set(second)


def test_uncontrolled_motions_are_made_once_for_all_kinds() -> None:
    fakes = Fakes()
    control.measure(trial(fakes), control_kinds.kinds(["trajectory", "head"]))
    assert sum(name == UNCONTROLLED for _, name, _ in fakes.calls) == SMALL.replications
    assert sum(name == OURS for _, name, _ in fakes.calls) == 2 * SMALL.replications


def test_a_stopped_run_goes_on_and_gives_the_same(tmp_path: Path) -> None:
    parts, kinds = Parts(tmp_path, "same"), control_kinds.kinds(["trajectory", "left_wrist"])
    with pytest.raises(KeyboardInterrupt):
        control.measure(trial(Fakes(stop_after=7)), kinds, parts=parts)
    again = Fakes()
    results = control.measure(trial(again), kinds, parts=parts)
    whole = Fakes()
    plain = control.measure(trial(whole), kinds)
    assert len(again.calls) <= len(whole.calls) - 7 + 4  # uncontrolled motions are made again for the second kind
    for row in plain.rows:
        other = next(r for r in results.rows if (r.name, r.measured_on) == (row.name, row.measured_on))
        assert {k: v.mean for k, v in other.values.items() if k != "seconds"} == pytest.approx(
            {k: v.mean for k, v in row.values.items() if k != "seconds"}
        )
    with pytest.raises(MotionloomError, match="other settings"):
        control.measure(trial(Fakes()), kinds, parts=Parts(tmp_path, "other"))


def test_a_way_that_these_weights_cannot_go_is_reported_and_stops_nothing() -> None:
    results = control.measure(trial(Fakes(refuses="fine-tuned")), control_kinds.kinds(["trajectory"]))
    assert any("fine-tuned: not measured (there is no such adapter)" in note for note in results.notes)
    assert results.row("trajectory, ours")


def test_only_the_asked_ways_and_what_they_are_held_against() -> None:
    results = control.measure(trial(Fakes()), control_kinds.kinds(["head"]), [OURS])
    assert [row.name for row in results.rows if not row.measured_on] == ["real", f"head, {EXPORTED}", "head, ours"]


@pytest.mark.parametrize("fault", ["late", "mirrored", "turned", "centimetres", "short"])
def test_planted_faults_are_seen(fault: str) -> None:
    """One frame late, left and right exchanged, turned away, another unit, a frame too few."""

    def faulty(target: Target, seed: int) -> Track:
        right = perfect(target, seed).positions
        changed = {
            "late": np.concatenate([right[:1], right[:-1]]),
            "mirrored": right * [-1, 1, 1],
            "turned": right[..., [2, 1, 0]] * [1, 1, -1],
            "centimetres": 100 * right,
            "short": right[:-1],
        }
        return Track(changed[fault], target.known)

    results = trial(Fakes(controlled=faulty))
    if fault == "short":
        with pytest.raises(ValueError, match="for a goal of"):
            control.of_method(results, kind("trajectory+left_wrist"), OURS, 0)
        return
    numbers = control.of_method(results, kind("trajectory+left_wrist"), OURS, 0)
    assert min(numbers["root_error"], numbers["joint_error"]) > 1


def test_an_exported_motion_is_encoded_as_it_is() -> None:
    """Features of an exported walk decode to its own places, up to the canonical start, in as many frames."""
    positions = humanml.decode_positions(ITEMS[1].features)
    track = of_motion(motion_from_positions(positions, FPS))
    assert len(track.features) == len(track.positions) == len(positions)
    decoded = humanml.decode_positions(track.features)
    apart = np.linalg.norm(np.diff(decoded[:-1, 0], axis=0), axis=-1) - np.linalg.norm(
        np.diff(track.positions[:-1, 0], axis=0), axis=-1
    )
    assert np.abs(apart).max() < 2e-3


def test_rows_of_one_length_go_together() -> None:
    assert groups([40, 44, 40, 44, 40]) == [[0, 2, 4], [1, 3]]
    assert [len(rows) for rows in groups([40] * 19)] == [8, 8, 3]


@pytest.mark.parametrize("name", ["tail", "trajectory+", "trajectory+trajectory", "", "keyframes+head"])
def test_an_unknown_kind_is_refused_in_one_sentence(name: str) -> None:
    with pytest.raises(MotionloomError, match="there is no control"):
        kind(name)


def test_a_kind_twice_is_refused() -> None:
    with pytest.raises(MotionloomError, match="different kinds"):
        control_kinds.kinds(["trajectory+head", "head+trajectory"])


def test_without_a_set_it_says_what_is_missing() -> None:
    with pytest.raises(MotionloomError, match="name a set with --data"):
        control.run(Run())


def test_an_unknown_way_is_refused() -> None:
    with pytest.raises(MotionloomError, match="the ways of control are"):
        control.run(Run(), methods=["magic"])


def test_the_report_is_kept_as_data_and_told_as_tables() -> None:
    results = control.measure(
        trial(Fakes()), control_kinds.kinds(["in_between"]), run=Run(command="motionloom evaluate control")
    )
    again = report.decode(json.loads(json.dumps(report.encode(results))))
    assert values(again, "in between, ours")["root_error"] == pytest.approx(0, abs=1e-6)
    text = report.markdown(again)
    assert "trajectory failure" in text
    assert "Shafir et al. 2023, Table 4" in text


def test_standing_people_can_be_measured() -> None:
    """Where nothing slides there is no ratio, and nothing breaks."""
    still = humanml.positions_to_features(standing(2.5), FPS).astype(np.float64)
    target = control_kinds.target_of(kind("trajectory"), still, "stands")
    assert control.met([perfect(target, 0)], [target], np.ones(263))["root_error"] == pytest.approx(0, abs=1e-6)
    assert physical_mean([target.goal.positions])["skate_share"] == 0
