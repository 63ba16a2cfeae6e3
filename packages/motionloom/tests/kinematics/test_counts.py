"""Repetitions and steps of bodies whose number is known."""

import numpy as np
import pytest

from motionloom.kinematics.counts import count, foot_moves
from motionloom.kinematics.physics import ANKLES, TOES, J
from tests.kinematics.people import FPS, jumping, standing, walking


def waves(seconds: float, times: int) -> np.ndarray:
    """(frames,) from 0 up to 1 and down again, ``times`` times, with a rest before and after."""
    t = np.arange(round(seconds * FPS)) / FPS
    share = ((t - 0.5) / (seconds - 1.0)).clip(0, 1)
    return (1 - np.cos(2 * np.pi * times * share)) / 2


@pytest.mark.parametrize("times", [0, 1, 2, 3])
def test_squats_and_bows(times: int) -> None:
    body = standing(6.0)
    low = np.zeros_like(body)
    feet = [*ANKLES, *TOES]
    low[:, [j for j in range(22) if j not in feet], 1] = -0.4 * waves(6.0, times)[:, None]
    assert count("squats", body + low, FPS) == times
    bent = body.copy()
    angle = np.radians(60) * waves(6.0, times)
    over = body[:, [J["neck"]]] - body[:, :1]
    length = np.linalg.norm(over[:, 0], axis=-1)
    bent[:, J["neck"], 1] = body[:, 0, 1] + length * np.cos(angle)
    bent[:, J["neck"], 2] = body[:, 0, 2] + length * np.sin(angle)
    assert count("bows", bent, FPS) == times
    assert count("squats", bent, FPS) == 0


@pytest.mark.parametrize("times", [0, 1, 4])
def test_jumping_jacks_and_claps(times: int) -> None:
    body, up = standing(6.0), waves(6.0, times)
    arms = np.zeros_like(body)
    for side in ("left", "right"):
        arms[:, J[f"{side}_wrist"], 1] = 0.9 * up
    assert count("jumping jacks", body + arms, FPS) == times
    together = body.copy()
    together[:, J["left_wrist"], 0] = 0.25 - 0.22 * up
    together[:, J["right_wrist"], 0] = -0.25 + 0.22 * up
    assert count("claps", together, FPS) == times


def test_a_kick_counts_for_its_leg() -> None:
    body, up = standing(6.0), waves(6.0, 2)
    leg = np.zeros_like(body)
    leg[:, [ANKLES[1], TOES[1]], 1] = 0.5 * up[:, None]
    leg[:, [ANKLES[1], TOES[1]], 2] = 0.6 * up[:, None]
    kicking = body + leg
    assert [count("kicks", kicking, FPS, side=side) for side in ("", "left", "right")] == [2, 0, 2]


def test_a_jump_is_one() -> None:
    assert count("jumps", jumping(0.3), FPS) == 1
    assert count("jumps", walking(1.2), FPS) == 0


def test_steps_are_feet_that_are_put_down_elsewhere() -> None:
    """One foot goes 60 cm, the other follows: two; who stands takes none."""
    body = standing(4.0)
    t = np.arange(len(body)) / FPS
    shift = np.zeros_like(body)
    for side, begin in ((0, 1.0), (1, 2.0)):
        shift[:, [ANKLES[side], TOES[side]], 2] = (0.6 * ((t - begin) / 0.4).clip(0, 1))[:, None]
    assert foot_moves(body + shift, FPS) == (1, 1)
    assert foot_moves(body, FPS) == (0, 0)
