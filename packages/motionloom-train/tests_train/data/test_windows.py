"""Labels of made-up motions whose answer is known by construction."""

import numpy as np
import pytest

from motionloom_train.data.made import GESTURES, perform
from motionloom_train.data.windows import label_clip, label_window
from tests.kinematics import people

FPS = 20.0


def glide(x: float = 0.0, z: float = 0.0, seconds: float = 4.0) -> np.ndarray:
    """The walker's legs, but carried sideways (x) or ahead (z) at a constant speed in m/s."""
    p = people.walking(0.0, seconds)
    t = np.arange(len(p)) / FPS
    return people.moved(p, np.stack([x * t, 0 * t, z * t], axis=-1))


def turning(degrees: float, seconds: float = 4.0) -> np.ndarray:
    """Stepping on the spot, + to the left."""
    p = people.walking(0.0, seconds)
    return people.spun(p, np.radians(degrees) * np.linspace(0, 1, len(p)))


@pytest.mark.parametrize(
    ("positions", "label"),
    [
        (people.standing(), "stand"),
        (people.walking(1.2), "walk"),
        (people.walking(0.7), "walk slow"),
        (people.walking(1.65), "walk fast"),
        (glide(z=2.1), "jog"),
        (glide(z=3.2), "run"),
        (glide(z=-1.0), "walk backward"),
        (glide(x=0.8), "sidestep left"),
        (glide(x=-0.8), "sidestep right"),
        (turning(90), "turn left"),
        (turning(-90), "turn right"),
        (turning(180), "turn around"),
        (people.circling(1.2, 1.0), "circle left"),
        (people.circling(1.2, 1.0) * [-1, 1, 1], None),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_paths_are_named(positions: np.ndarray, label: str | None) -> None:
    """A mirrored circle without exchanged limbs is no person: it only must not be called a circle to the left."""
    labels = label_window(positions, FPS, "")
    assert label in labels if label else "circle left" not in labels


def test_gestures_need_the_word_and_the_movement() -> None:
    jump = people.jumping(0.35)
    assert label_window(jump, FPS, "jump") == ["jump"]
    assert "jump" not in label_window(jump, FPS, "")
    assert "jump" not in label_window(people.standing(), FPS, "jump")


def test_windows_cover_a_clip_and_lie_inside_it() -> None:
    clip = people.walking(1.2, 8.0)
    spans = label_clip(clip, FPS, "")
    assert {name for _, _, name in spans} == {"walk"}
    assert min(a for a, _, _ in spans) == 0
    assert all(0 <= a < b <= len(clip) for a, b, _ in spans)
    assert {b - a for a, b, _ in spans} == {50, 80, 120}


def test_a_clip_shorter_than_a_window_is_one_window_and_shorter_than_a_second_none() -> None:
    assert label_clip(people.walking(1.2, 2.0), FPS, "") == [(0, 40, "walk")]
    assert label_clip(people.walking(1.2, 0.9), FPS, "") == []


@pytest.mark.parametrize(("way", "label"), [(1, "climb"), (-1, "climb down"), (0, None)])
def test_who_ends_up_higher_climbs_and_who_ends_up_lower_climbs_down(way: int, label: str | None) -> None:
    up = np.linspace(0, 1.2, 80)
    heights = {1: up, -1: up[::-1], 0: 0.3 - 0.3 * np.cos(up * np.pi / 0.3)}[way]
    ladder = people.standing(4.0) + heights[:, None, None] * [0, 1, 0]
    assert [name for name in label_window(ladder, 20, "climb stairs") if name != "stand"] == ([label] if label else [])


@pytest.mark.parametrize(("way", "label"), [(1, "climb stairs"), (-1, "descend")])
def test_who_goes_forward_meanwhile_takes_the_stairs(way: int, label: str) -> None:
    heights = np.linspace(0, 1.2, 80)[::way]
    stairs = people.walking(0.8, 4.0)[:80] + heights[:, None, None] * [0, 1, 0]
    assert label in label_window(stairs, 20, "climb stairs")


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("climbs stairs", "climb stairs"),
        ("climbs a ladder", "climb"),
        ("climbs up on a playground, steps up on a stair", "climb"),
        ("climbs onto a big box", "climb"),
    ],
)
def test_what_is_climbed_is_in_the_words(text: str, label: str) -> None:
    """Playgrounds and boxes are climbed with bent trunks and on hands; that is no way up the stairs."""
    up = people.walking(0.8, 4.0)[:80] + np.linspace(0, 1.2, 80)[:, None, None] * [0, 1, 0]
    labels = label_window(up, FPS, text)
    assert label in labels
    assert ("climb stairs" in labels) == (label == "climb stairs")


@pytest.mark.parametrize(("name", "label"), [("wave", True), ("wave both", False)])
def test_who_waves_has_one_hand_down(name: str, label: bool) -> None:
    waving = perform(people.standing(), GESTURES[name], "right", fps=FPS, begin=0.4, rng=np.random.default_rng(0))
    assert ("wave" in label_window(waving, FPS, "waves hello")) == label


def test_acrobats_and_dancers_are_no_kickers() -> None:
    kick = people.standing()
    swing = np.clip(np.sin(2 * np.pi * np.arange(len(kick)) / 12), 0, None)
    kick[:, [8, 11]] += swing[:, None, None] * [0.0, 0.8, 1.0]
    assert "kick" in label_window(kick, FPS, "kicks")
    assert "kick ball" in label_window(kick, FPS, "kicks a ball")
    assert "kick" not in label_window(kick, FPS, "does handstand kicks, breakdancing")
    assert "kick ball" not in label_window(kick, FPS, "kicks like a ballerina")
