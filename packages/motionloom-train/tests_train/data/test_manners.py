"""Manners put on recorded people: each shows in what the literature measures of it, and feet stand where they stand."""

from functools import cache

import numpy as np
import pytest

from motionloom.core.features import humanml as hml
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import true_spans
from motionloom_train.data.augment import loop
from motionloom_train.data.gait import read_gait
from motionloom_train.data.manner_measures import measure
from motionloom_train.data.mannered import shows, words_of
from motionloom_train.data.manners import MANNERS, put_on
from motionloom_train.data.person import uniform_person
from motionloom_train.data.sources import find_takes
from tests.shared import shared

FPS = 20.0
WALKERS = ("35_09", "07_01", "12_01")
HURRIED = "07_01"
"""A person who walks at 1.2 m/s: nobody hurries by walking slowly."""


@cache
def walk(name: str) -> np.ndarray:
    """A recorded walk (frames, 22, 3) of CMU's collection that goes on for eight seconds."""
    place = shared("data/manifest.csv").parent
    take = next(take for take in find_takes(place, captions=None) if take.name == name)
    recording = take.read()
    features = hml.encode(uniform_person(recording.positions, recording.fps), heading="corrected")  # type: ignore[union-attr]
    longer = loop(features, 160)
    assert longer is not None
    return hml.decode_positions(longer.astype(np.float64))


def made(name: str, person: str = "35_09", *, strength: float = 1.0, side: str = "right", seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return put_on(walk(person), MANNERS[name], fps=FPS, rng=rng, strength=strength, side=side)


@pytest.mark.parametrize("person", WALKERS)
@pytest.mark.parametrize("name", MANNERS)
def test_a_walk_in_a_manner_measures_as_the_table_says_and_the_recording_does_not(name: str, person: str) -> None:
    person = HURRIED if name == "hurry" else person
    kept = [shows(MANNERS[name], made(name, person, seed=seed), "walk") for seed in range(4)]
    assert np.mean(kept) >= 0.5  # the build drops the others: some of what is irregular is hardly so
    assert not shows(MANNERS[name], walk("35_09"), "walk")


@pytest.mark.parametrize("name", MANNERS)
def test_feet_stand_still_and_nobody_is_in_the_floor(name: str) -> None:
    source, p = walk("35_09"), made(name)
    toes = p[:, [10, 11]]
    slides = []
    for i, flags in enumerate(read_gait(p, FPS).standing.T):
        for start, stop in true_spans(flags):
            if stop - start > 4:
                inside = toes[start + 1 : stop - 1, i][:, [0, 2]]
                slides.append(np.linalg.norm(inside - inside.mean(0), axis=-1).max())
    assert np.median(slides) < 0.03
    assert ph.penetration(p) < 0.003
    assert p[:, [7, 8, 10, 11], 1].min(axis=1).max() < 0.12
    assert ph.jerk(p, FPS).mean < 4 * ph.jerk(source, FPS).mean


@pytest.mark.parametrize("name", MANNERS)
def test_bones_are_those_of_the_uniform_person(name: str) -> None:
    p = made(name, strength=1.3)
    np.testing.assert_allclose(ph.bone_lengths(p), np.tile(SMPL22.bone_lengths()[1:], (len(p), 1)), atol=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_hurt_leg_carries_for_a_shorter_time_and_is_stiff(side: str) -> None:
    found = measure(made("limp", side=side), FPS)
    hurt, sound = ("l", "r") if side == "left" else ("r", "l")
    assert found[f"stance_{hurt}"] < 0.9 * found[f"stance_{sound}"]
    assert found[f"swing_knee_{hurt}"] < found[f"swing_knee_{sound}"] - 10


@pytest.mark.parametrize("name", ["phone in hand", "on the shoulder"])
def test_one_hand_holds_and_the_other_swings(name: str) -> None:
    right, left = measure(made(name), FPS), measure(made(name, side="left"), FPS)
    assert right["elbow_r"] > 60 > right["elbow_l"]
    assert left["elbow_l"] > 60 > left["elbow_r"]


def test_the_same_seed_makes_the_same_clip_and_another_one_another() -> None:
    for name in ("drunk", "limp", "cold"):
        np.testing.assert_array_equal(made(name, seed=3), made(name, seed=3))
    assert not np.allclose(made("drunk", seed=3)[:80], made("drunk", seed=4)[:80])


def test_more_strength_shows_more() -> None:
    weak, strong = (measure(made("old", strength=s), FPS) for s in (0.5, 1.3))
    assert weak["lean"] < strong["lean"] - 5
    assert weak["step"] > strong["step"] + 0.05


def test_a_manner_of_no_strength_is_the_recorded_walk() -> None:
    """Amounts of 0 and factors of 1 leave where the body goes and how it swings."""
    p, source = made("old", strength=0.0), walk("35_09")
    first = int(np.linalg.norm(source[:, 0] - p[0, 0], axis=-1).argmin())  # it begins with a step
    assert first < 20
    assert len(p) > len(source) - 40
    assert np.median(np.linalg.norm(p - source[first : first + len(p)], axis=-1)) < 0.01


def test_a_left_limp_is_described_by_the_left_leg_alone() -> None:
    texts = words_of(MANNERS["limp"], "walk", "left", np.random.default_rng(0))
    assert len(texts) >= 5
    assert all("left" in text for text in texts)
    for name, manner in MANNERS.items():
        rng = np.random.default_rng(0)
        assert all(len(words_of(manner, on, "right", rng)) >= 3 for on in manner.on), name
        assert len(words_of(manner, "walk", "right", rng)) >= 13, name
