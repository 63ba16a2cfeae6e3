"""The trial of the everyday checks: on made-up clips with known answers, and on a few real ones where the packs are."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core.features import humanml
from motionloom.kinematics import physics as ph
from motionloom_lab.metrics.obedience import EVERYDAY
from motionloom_lab.suites import trial
from motionloom_lab.suites.items import RealClip
from motionloom_lab.suites.trial import Examples, trials
from motionloom_train.data.build import clips_of
from motionloom_train.data.sources import find_takes
from tests.kinematics.people import standing, walking
from tests.shared import shared
from tests_lab.metrics.test_everyday import PEOPLE, mirrored

BY_NAME = {check.name: check for check in EVERYDAY}


def clip(name: str, positions: np.ndarray, *captions: str) -> RealClip:
    return RealClip(f"{name}@0", "made", "train", captions or ("somebody moves",), positions)


CLIPS = [
    clip("left_up", PEOPLE["raise the left arm"], "raises the left arm"),
    clip("right_up", PEOPLE["raise the right hand"], "raises the right arm"),
    clip("stroll", walking(1.2, 5), "a person walks"),
    clip("sitting", PEOPLE["sit down from standing"], "sits down"),
    clip("acf_stand", standing(3), "stands"),
    clip("35_01", walking(1.3, 4), "walks"),
    clip("unnamed", PEOPLE["raise the left arm"]),
]


def test_examples_others_and_the_other_side_are_counted_apart() -> None:
    check = BY_NAME["raise the left arm"]
    tally = trial.tried([check], {check.name: Examples(r"raises the left", like="unnamed", sided=True)}, CLIPS)[
        check.name
    ]
    assert tally.shown == (2, 2)  # the left arm, and the right one mirrored
    assert tally.opposite == (0, 2)
    assert tally.others == (0, 4)
    assert not tally.doubts()


def test_a_check_that_lets_everybody_pass_is_doubted() -> None:
    check = BY_NAME["sit down from standing"]
    tally = trial.tried([check], {check.name: Examples(r"walks", like="up|stand")}, CLIPS)[check.name]
    assert tally.shown == (0, 2)
    assert tally.slipped == ["sitting@0"]
    assert len(tally.missed) == 2
    assert "seat" in tally.missed[0]
    assert [doubt.split()[0] for doubt in tally.doubts()] == ["misses", "50.0%"]
    assert "no example" in trial.tried([check], {check.name: Examples()}, CLIPS)[check.name].doubts()


def test_examples_are_made_backwards_cut_and_joined() -> None:
    up = BY_NAME["stand up"]
    assert trial.tried([up], {up.name: Examples(backwards="sits down")}, CLIPS)[up.name].made == (1, 1)
    both = BY_NAME["walk, then sit"]
    assert trial.tried([both], {both.name: Examples(joined=("stroll", "sitting"))}, CLIPS)[both.name].made == (1, 1)
    assert len(next(trial.examples(Examples("stroll", cut=(0.2, 0.7)), CLIPS))[2]) == 50


def test_joined_clips_go_on_where_and_whither_the_first_one_ends() -> None:
    turned = trial.joined([PEOPLE["turn around"], walking(1.0, 2)])
    assert turned[-1, 0, 2] == pytest.approx(-2.0, abs=0.2)
    assert ph.heading(turned)[-1] == pytest.approx(np.pi, abs=0.05)
    assert np.abs(np.diff(turned, axis=0)).max() < 0.5


def test_left_and_right_are_exchanged_in_patterns_and_people() -> None:
    assert trial.exchanged(r"raise-left|(right)arm|_bright") == r"raise-right|(left)arm|_bleft"
    assert np.allclose(mirrored(trial.mirrored(CLIPS[0].positions)), CLIPS[0].positions)


def test_a_clip_that_lies_below_the_floor_is_lifted_and_no_other() -> None:
    low = trial.on_the_floor(standing() - [0.0, 0.17, 0.0])
    assert low[..., 1].min() == pytest.approx(0.0, abs=1e-6)
    high = standing() - np.array([0.0, -0.5, 0.0])
    assert np.array_equal(trial.on_the_floor(high), high)


def test_every_check_has_a_trial_and_every_trial_a_check() -> None:
    known = trials()
    assert set(known) == set(BY_NAME)
    assert all(t.shows != trial.NOTHING or t.joined for t in known.values())


def test_the_tables_have_a_row_per_check() -> None:
    checks = [BY_NAME["stand up"], BY_NAME["bow"]]
    tallies = trial.tried(checks, {c.name: Examples("sits") for c in checks}, CLIPS)
    assert [row[0] for row in trial.table(tallies)] == ["check", "stand up", "bow"]
    assert trial.summary(tallies)["bow"]["shown"] == (0, 1)


# ---- real people -----------------------------------------------------------------------------------------------------

REAL = {
    "stand up": "ui_m05_s01_r08_up",
    "sit down from standing": "ui_m05_s04_r05_down",
    "crawl": "accad_Male2_A11_Crawl",
    "crawl backwards": "accad_Male2_A12_CrawlBackwards",
    "bow": "mesh2motion_bow",
    "push-ups": "mesh2motion_pushups",
    "clap": "quaternius_men_clapping",
    "forward roll": "cat_soulslike_roll",
    "climb a ladder": "cat_soulslike_ladder_climb",
    "kick left": "accad_Male2_G8_RoundhouseLeft",
    "kick right": "accad_Male2_G18_PushKickRight",
    "punch left": "accad_Male2_E1_JabLeft",
    "punch right": "accad_Male2_E2_JabRight",
    "sidestep left": "accad_Male1_B22_SideStepLeft",
    "sidestep right": "accad_Male1_B23_SideStepRight",
    "run and stop": "accad_Male2_C2_RunToStand",
    "walk then run": "accad_Male2_C5_WalkToRun",
    "there and back": "accad_Male2_B15_WalkTurnAround",
    "backflip": "87_b1",
    "throw": "mesh2motion_throw_ball",
}
"""A take of the second pack that must pass each of these checks, and none of the others."""
BOTH = {("run and stop", "run fast"), ("there and back", "turn around"), ("walk then run", "run fast")}


@pytest.fixture(scope="module")
def people() -> dict[str, np.ndarray]:
    """Joints of the takes of `REAL`."""
    pack: Path = shared("data_more/manifest.csv").parent
    takes = {take.name: take for take in find_takes(pack)}
    missing = sorted(set(REAL.values()) - set(takes))
    assert not missing, missing
    clips = {}
    for name in REAL.values():
        features = next(clips_of(takes[name])).features.astype(float)
        clips[name] = trial.on_the_floor(humanml.decode_positions(features))
    return clips


@pytest.mark.parametrize("name", REAL)
def test_a_real_person_passes_the_check_of_what_they_do_and_no_other(people, name: str) -> None:
    positions = people[REAL[name]]
    passes = {n for n in REAL if BY_NAME[n].obeyed(BY_NAME[n].measured(positions, 20.0))}
    assert passes - {other for mine, other in BOTH if mine == name} == {name}
