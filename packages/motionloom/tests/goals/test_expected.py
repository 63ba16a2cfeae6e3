"""What words allow to check, on bodies that do it and bodies that do not."""

from collections.abc import Callable

import numpy as np
import pytest

from motionloom.goals.expected import asks_for_rest, expectations_of, missing, share_met
from motionloom.kinematics.physics import J
from tests.kinematics.people import FPS, jumping, spun, standing, walking

LEFT_ARM, RIGHT_ARM = (J["left_elbow"], J["left_wrist"]), (J["right_elbow"], J["right_wrist"])


def turning(degrees: float) -> np.ndarray:
    return spun(standing(), np.linspace(0, np.radians(degrees), 80))


def with_hands(*hands: int, at: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Somebody who stands, some wrists (0 left, 1 right) at places (80, 3) of each second."""
    p = standing()
    for hand in hands:
        p[:, (J["left_wrist"], J["right_wrist"])[hand]] = at(p)
    return p


def waving(*hands: int) -> np.ndarray:
    seconds = np.arange(80) / FPS
    swing = 0.15 * np.sin(2 * np.pi * 2 * seconds)[:, None] * [1, 0, 0]
    return with_hands(*hands, at=lambda p: p[:, J["head"]] + swing + [0.3, 0.2, 0])


def raising(*hands: int) -> np.ndarray:
    return with_hands(*hands, at=lambda p: p[:, J["head"]] + [0.2, 0.4, 0])


def lowered(to: float, *, back_up: bool = True, start_low: bool = False) -> np.ndarray:
    """The body without its ankles and feet goes down to a share of its height, and up again."""
    p = standing()
    seconds = np.arange(80) / FPS
    down = np.clip(np.minimum(seconds - 0.5, (3.5 - seconds) if back_up else 9.0), 0, 1)
    down = 1 - down if start_low else down
    for joint in range(22):
        if joint not in (7, 8, 10, 11):
            p[:, joint, 1] -= down * (1 - to) * p[0, 0, 1]
    return p


def with_leg(side: int, *, knee: float = 0.0, ankle: float = 0.0) -> np.ndarray:
    """Somebody who stands, for a second the knee so far over the hip, or the ankle over the floor."""
    p, name = standing(), ("left", "right")[side]
    if knee:
        p[20:40, J[f"{name}_knee"], 1] = p[20:40, J[f"{name}_hip"], 1] + knee
    p[20:40, J[f"{name}_ankle"], 1] += ankle
    return p


def with_arms_out() -> np.ndarray:
    p = walking(1.2)
    for hand, side in ((J["left_wrist"], 0.6), (J["right_wrist"], -0.6)):
        p[:, hand] = p[:, J["neck"]] + [side, -0.1, 0]
    return p


def at_shoulders() -> np.ndarray:
    return with_hands(0, 1, at=lambda p: p[:, J["neck"]] - [0, 0.1, 0])


def with_crossed_arms() -> np.ndarray:
    p = standing()
    wrists, elbows = [J["left_wrist"], J["right_wrist"]], [J["right_elbow"], J["left_elbow"]]
    p[:, wrists] = p[:, elbows] + [0, 0, 0.1]
    return p


def leaning(degrees: float) -> np.ndarray:
    """Somebody whose trunk leans to the left."""
    p, angle = standing(), np.radians(degrees)
    above = p[..., 1] > p[:, :1, 1]
    height = np.where(above, p[..., 1] - p[:, :1, 1], 0)
    p[..., 0] += height * np.sin(angle)
    p[..., 1] += height * (np.cos(angle) - 1)
    return p


def bent(degrees: float) -> np.ndarray:
    """Somebody whose trunk is bent forward."""
    p, angle = standing(), np.radians(degrees)
    above = p[..., 1] > p[:, :1, 1]
    height = np.where(above, p[..., 1] - p[:, :1, 1], 0)
    p[..., 2] += height * np.sin(angle)
    p[..., 1] += height * (np.cos(angle) - 1)
    return p


def lying(up: int) -> np.ndarray:
    """Somebody who lies on the back (1) or on the belly (-1)."""
    p = standing()
    height, ahead = p[..., 1].copy(), p[..., 2].copy()
    p[..., 1], p[..., 2] = 0.1 + up * ahead, -up * height
    return p


def falling(degrees: float, *, turned: float = 0.0) -> np.ndarray:
    """Somebody who tips over about the feet within a second, to an angle from ahead to the left, and lies there."""
    p = spun(standing(), np.full(80, np.radians(turned)))
    tip = np.radians(85) * np.clip((np.arange(80) - 20) / 20, 0, 1)
    way = np.radians(degrees + turned)
    height = p[..., 1].copy()
    p[..., 0] += height * np.sin(tip)[:, None] * np.sin(way)
    p[..., 2] += height * np.sin(tip)[:, None] * np.cos(way)
    p[..., 1] = height * np.cos(tip)[:, None]
    return p


def rolling(turns: float, axis: int) -> np.ndarray:
    """Somebody who turns about the left (0) or, lying on the back, about the spine (1), in a metre's height."""
    p = standing()
    p = p - p[:, :1]
    angles = np.linspace(0, 2 * np.pi * turns, 80)
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    a, b = ((1, 2), (2, 0))[axis]
    turned = p.copy()
    turned[..., a], turned[..., b] = cos * p[..., a] - sin * p[..., b], sin * p[..., a] + cos * p[..., b]
    if axis == 1:  # laid on the back
        turned = np.stack([turned[..., 0], turned[..., 2], -turned[..., 1]], axis=-1)
    return turned - turned[..., 1].min(axis=1)[:, None, None] * np.array([0.0, 1.0, 0.0])


def rising(p: np.ndarray, metres: float) -> np.ndarray:
    return p + np.linspace(0, metres, len(p))[:, None, None] * [0, 1, 0]


@pytest.mark.parametrize(
    ("text", "does", "does_not"),
    [
        ("a person walks forward", walking(1.2), standing()),
        ("a person walks backwards", walking(-1.2), walking(1.2)),
        ("someone backs up a little", walking(-1.2), walking(1.2)),
        ("someone walks", walking(1.2), standing()),
        ("he walks briskly", walking(1.7), walking(1.0)),
        ("she walks slowly", walking(0.7), walking(1.3)),
        ("an athlete runs", walking(3.0), walking(1.4)),
        ("a person jumps", jumping(0.3), walking(1.2)),
        ("a person turns left", turning(86), turning(-86)),
        ("a person turns around", turning(178), turning(57)),
        ("a person turns around", turning(178), turning(355)),
        ("a dancer spins", turning(360), turning(170)),
        ("a man walks in place", with_leg(0, knee=0.05), walking(1.2)),
        ("a girl waves with her left hand", waving(0), waving(1)),
        ("she waves", waving(1), standing()),
        ("he raises the right arm", raising(1), raising(0, 1)),
        ("he raises both arms", raising(0, 1), raising(1)),
        ("a man crouches", lowered(0.6), standing()),
        ("a man gets up from the floor", lowered(0.4, back_up=False, start_low=True), lowered(0.4, back_up=False)),
        (
            "she picks a coin up from the floor",
            with_hands(1, at=lambda p: p[:, J["right_foot"]] + [0, 0.1, 0]),
            standing(),
        ),
        ("a man lifts his right knee up", with_leg(1, knee=0.05), with_leg(0, knee=0.05)),
        ("she raises the left leg", with_leg(0, ankle=0.3), with_leg(1, ankle=0.3)),
        ("a man walks up the stairs", rising(walking(0.6), 0.5), walking(0.6)),
        ("a man sneaks", walking(0.6), walking(0.2)),
        ("a man falls backwards", falling(180), falling(0)),
        ("he fell on his back", falling(180, turned=120), falling(0, turned=120)),
        ("a boy falls down forwards", falling(0), falling(180)),
        ("she falls flat on her face", falling(0, turned=-90), falling(180, turned=-90)),
        ("he collapses to the left", falling(90, turned=45), falling(-90, turned=45)),
        ("he falls sideways to the right", falling(-90), falling(90)),
        ("a gymnast does a forward roll", rolling(1, 0), rolling(-1, 0)),
        ("she rolls backwards", rolling(-1, 0), rolling(1, 0)),
        ("he rolls on the floor to the left", rolling(0.5, 1), rolling(-0.5, 1)),
        ("he walks with his arms out", with_arms_out(), walking(1.2)),
        ("she lowers the left arm", raising(1), raising(0)),
        ("he raises both arms to shoulder height", at_shoulders(), standing()),
        ("he lies down on his back", lying(1), lying(-1)),
        ("he crosses his arms", with_crossed_arms(), standing()),
        ("a man bends to the left", leaning(20), leaning(-20)),
        ("he bends down", bent(70), standing()),
        ("she puts a hand to her forehead", with_hands(0, at=lambda p: p[:, J["head"]] + [0, 0, 0.15]), standing()),
        ("a man falls", lying(1), np.concatenate([jumping(0.5)[:40], lying(1)[:40]])),
        ("he drinks", with_hands(0, at=lambda p: p[:, J["head"]] + [0, 0, 0.15]), standing()),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_done(text: str, does: np.ndarray, does_not: np.ndarray) -> None:
    assert missing(text, does, FPS) == []
    assert share_met(text, does, FPS) == 1
    assert missing(text, does_not, FPS)
    assert share_met(text, does_not, FPS) < 1


@pytest.mark.parametrize(
    "text",
    [
        "a person dances",
        "a zombie",
        "a man plays chess",
        "go down on your knees",
        "a man does sit-ups",
        "a chef rolls dough and flips a pancake",
        "she picks up the phone",
        "he lays a brick on the wall",
        "a surfer on a wave",
        "a boy plays a rock song",
    ],
)
def test_what_nothing_can_be_checked_of_is_met(text: str) -> None:
    assert expectations_of(text) == []
    assert share_met(text, standing(), FPS) == 1


def test_who_floats_misses_the_floor_unless_the_words_climb() -> None:
    aloft = standing() + np.array([0.0, 0.5, 0.0])
    assert missing("a person waits", aloft, FPS) == ["the floor under the feet"]
    assert missing("a person stands on a ladder", aloft, FPS) == ["a way up"]
    assert missing("a person waits", jumping(0.3), FPS) == []


def test_a_side_of_limbs_is_no_way() -> None:
    """A kick with the left leg turns nowhere, and who runs in place goes nowhere but hops."""
    names = [one.name for one in expectations_of("a person kicks with the left leg")]
    assert names == ["kicks", "kicks of the left side alone"]
    assert [one.name for one in expectations_of("a person runs in place")] == ["staying in place", "hops"]
    assert asks_for_rest("a person stands and waits")
    assert not asks_for_rest("a person jumps")


def test_names_read_as_a_list() -> None:
    """They are printed: "not shown in 4 attempts: a turn to the left"."""
    assert missing("a person turns left", turning(-80), FPS) == ["a turn to the left"]
    assert missing("a person walks forward, slowly", standing(), FPS) == ["a way forward"]
