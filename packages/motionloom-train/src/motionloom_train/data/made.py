"""Gestures of the arms added to recorded bodies: what everyday sentences name and recordings lack.

A gesture is a place for one wrist or both, with a swing about it (``gestures.toml``). The recorded person stands, sits
or walks; the wrists go there and back by a smooth path, and the elbows follow in closed form (`limbs.bend`). Everything
else of the recording stays. Such clips are marked (``way`` ``made``) and used in training only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.retarget import limbs
from motionloom_train.data.words import sentence

_ARMS = {"left": (16, 18, 20, 1.0), "right": (17, 19, 21, -1.0)}
"""Shoulder, elbow, wrist, and the sign of outward along +X."""
_MOVE = 0.5
"""Seconds in which a wrist goes to its place."""
_STROKE = 0.11
"""Seconds of the thrust of a fist, which is 4 to 7 m/s at its fastest in 20 frames a second."""


@dataclass(frozen=True)
class Gesture:
    """One entry of ``gestures.toml``, which explains each part."""

    name: str
    hands: str
    place: tuple[float, float, float]
    says: tuple[str, ...]
    sided: tuple[str, ...] = ()
    swing: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rate: tuple[float, float] = (1.0, 1.0)
    pole: tuple[float, float, float] = (0.45, -1.0, -0.35)
    times: int = 0
    """So often the hands go to the place and back; 0: once, and as often as not they stay."""
    thrust: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the hand of ``side`` strikes from the place, fast and once. The other hand stays at its place."""
    on: str = ""
    """What the body does meanwhile, where the words imply it: ``walk``."""
    hips: bool = False
    """The place is seen from the pelvis, not from between the shoulders."""


def _read() -> dict[str, Gesture]:
    table: dict[str, dict[str, Any]] = read_table("motionloom_train.data", "gestures.toml")
    values: dict[str, dict[str, Any]] = {
        name: {key: tuple(part) if isinstance(part, list) else part for key, part in entry.items()}
        for name, entry in table.items()
    }
    return {name: Gesture(name, **entry) for name, entry in values.items()}


GESTURES: dict[str, Gesture] = _read()


def perform(body: Array, gesture: Gesture, side: str, *, fps: float, begin: float, rng: np.random.Generator) -> Array:
    """``body`` (frames, 22, 3) metres with the arms of a gesture; ``side``: the hand of a gesture of one hand.

    The hands leave after ``begin`` seconds, and a swing has the same phase then: were it random, the average over what
    a sentence may show would be a hand that is held still.
    """
    result = body.copy()
    time = np.arange(len(body)) / fps - begin
    amount = _amount(gesture, time, rng)
    swing = -np.cos(2 * np.pi * rng.uniform(*gesture.rate) * time)
    shift = rng.normal(0, 0.015, 3)
    struck = _ease((time - _MOVE - 0.1) / _STROKE) - _ease((time - _MOVE - 0.36) / 0.35)
    if gesture.thrust[2]:
        _turn_chest(result, struck * rng.uniform(15, 30) * _ARMS[side][3])
    for name in ("left", "right") if gesture.hands == "both" else (side,):
        place = shift + (struck if name == side else 0 * struck)[:, None] * np.array(gesture.thrust)
        _move_arm(result, gesture, _ARMS[name], amount, swing, place)
    return result


def _amount(gesture: Gesture, time: Array, rng: np.random.Generator) -> Array:
    """How far (0 to 1) the hands are on their way to the place at each time, in seconds since they leave."""
    if gesture.times:
        period = rng.uniform(1.35, 1.5)
        moving = (time >= 0) & (time < gesture.times * period)
        return np.where(moving, _there_and_back(time % period, 0.65), 0.0)
    end = time[-1] - rng.uniform(0.2, 0.8) if rng.random() < 0.5 and not gesture.on else np.inf
    return _there_and_back(time, end - _MOVE)


def _there_and_back(time: Array, leave: float) -> Array:
    return np.minimum(_ease(time / _MOVE), 1 - _ease((time - leave) / _MOVE))


def _turn_chest(body: Array, degrees: Array) -> None:
    """Turn chest, head and arms about the upright through the spine; the left shoulder comes forward where positive."""
    centre = body[:, 6:7] * [1, 0, 1]
    for joint in (9, *range(12, 22)):
        body[:, joint] = ph.turned(body[:, joint] - centre[:, 0], np.radians(degrees)) + centre[:, 0]


def _move_arm(
    body: Array, gesture: Gesture, arm: tuple[int, int, int, float], amount: Array, swing: Array, shift: Array
) -> None:
    shoulder, elbow, wrist, outward = arm
    own = np.array([outward, 1.0, 1.0])
    angle = -ph.heading(body)[:, None]
    middle = body[:, 0] if gesture.hips else (body[:, 16] + body[:, 17]) / 2
    local = (
        np.array(gesture.place) + shift + swing[:, None] * np.array(gesture.swing)
    ) * own  # shift: one, or by frame
    target = middle + ph.turned(local, angle[:, 0])
    pole = ph.turned(np.broadcast_to(np.array(gesture.pole) * own, local.shape), angle[:, 0])
    upper = float(np.linalg.norm(body[0, elbow] - body[0, shoulder]))
    lower = float(np.linalg.norm(body[0, wrist] - body[0, elbow]))
    weight = amount[:, None]
    # the elbow's way out is blended as well, so that it does not jump where the gesture begins
    along = (body[:, shoulder] + body[:, wrist]) / 2
    pole = weight * pole + (1 - weight) * (body[:, elbow] - along) / 0.1
    # a hand that goes far swings round in front instead of through its own shoulder
    far = np.clip(np.linalg.norm(target - body[:, wrist], axis=-1, keepdims=True) - 0.35, 0, 0.6)
    round_it = ph.turned(np.broadcast_to(np.array([0.12, 0.0, 0.5]) * own, local.shape), angle[:, 0])
    target = weight * target + (1 - weight) * body[:, wrist] + 4 * weight * (1 - weight) * far * round_it
    body[:, elbow], body[:, wrist] = limbs.bend(body[:, shoulder], target, pole, upper=upper, lower=lower)


def hands_up(positions: Array) -> bool:
    """True where both hands of (frames, 22, 3) are above the chest most of the time."""
    return bool((positions[:, 20:22, 1].min(axis=1) > positions[:, 9, 1]).mean() > 0.6)


def lower_arms(positions: Array) -> Array:
    """The same body with its arms hanging, hands on the thighs while it sits: (frames, 22, 3) metres to the same."""
    result = positions.copy()
    seated = 1 - np.clip((positions[:, 0, 1] - 0.55) / 0.3, 0, 1)
    still = np.zeros(len(positions))
    hanging, resting = np.array([0.24, -0.49, 0.04]), np.array([0.14, -0.36, 0.27])
    place = (1 - seated)[:, None] * hanging + seated[:, None] * resting
    for arm in _ARMS.values():
        _move_arm(result, Gesture("", "both", (0.0, 0.0, 0.0), ()), arm, still + 1, still, place)
    return result


def _ease(x: Array) -> Array:
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


def words_for(gesture: Gesture, side: str, lead: str, rng: np.random.Generator) -> tuple[str, ...]:
    """Up to 8 sentences for a gesture; ``lead``: what the body does meanwhile, such as ``walks``, or empty."""
    phrases = [*gesture.says, *(phrase.format(side=side) for phrase in gesture.sided)]
    if lead:
        phrases = [f"{lead} and {phrase}" for phrase in phrases]
    return tuple(dict.fromkeys(sentence(phrases[i % len(phrases)], rng) for i in range(8)))
