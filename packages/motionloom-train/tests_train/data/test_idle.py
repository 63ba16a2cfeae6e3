"""Recordings of people who stand, and actions that go on with them."""

import numpy as np
import pytest

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS
from motionloom.kinematics import physics as ph
from motionloom_train.data import augment
from motionloom_train.data.augment import SHORTEST, Idle, extended, find_idle
from motionloom_train.data.clips import Clip
from tests.kinematics import people


def living(seconds: float = 4.0, *, turned: float = 0.0) -> np.ndarray:
    """Somebody who stands, sways by five centimetres and lets the hands hang."""
    body = people.standing(seconds)
    wave = np.sin(2 * np.pi * np.arange(len(body)) / (FPS * 1.2))
    high = np.clip(body[..., 1:2] - 0.1, 0, 1)
    body = body + 0.05 * wave[:, None, None] * high * np.array([1.0, 0.0, 0.0])
    return ph.turned(body, np.full((len(body), 1), turned)) + np.array([1.0, 0.0, 2.0])


def clip(positions: np.ndarray, **other: str) -> Clip:
    features = hml.encode(hml.canonical(hml.uniform(positions)), heading="corrected")
    about = {"name": "a", "source": "s", "licence": "l", "split": "train", "way": "plain", "kind": "capture"} | other
    return Clip(**about, notes=(), features=features)  # type: ignore[arg-type]


def test_a_recording_of_somebody_who_stands_is_found_and_one_who_walks_is_not() -> None:
    stretches = find_idle([clip(living()), clip(people.walking(1.2, 4.0))]).stretches
    assert len(stretches) == 1
    assert len(stretches[0]) >= SHORTEST


@pytest.mark.parametrize("other", [{"split": "test"}, {"kind": "keyed"}, {"way": "made"}, {"name": "Ma"}])
def test_only_recordings_for_training_are_taken(other: dict[str, str]) -> None:
    assert not find_idle([clip(living(), **other)]).stretches


def test_a_stretch_is_played_back_and_forth_without_a_jump() -> None:
    stretch = living()
    longer = extended(stretch, 3 * len(stretch))
    assert len(longer) == 3 * len(stretch)
    most = np.abs(np.diff(stretch, axis=0)).max()
    assert np.abs(np.diff(longer, axis=0)).max() <= most + 1e-12


def test_a_standing_end_goes_on_with_a_recording_in_its_place_and_direction() -> None:
    body, idle = people.standing(2.0), Idle((living(turned=1.3),))
    longer = augment.with_pauses(body, 20, 60, fps=FPS, seed=1, idle=idle)
    assert len(longer) == len(body) + 80
    np.testing.assert_array_equal(longer[20 : 20 + len(body)], body)
    assert np.linalg.norm(longer[:, [7, 8], ::2] - body[0, [7, 8], ::2], axis=-1).max() < 0.05
    assert np.abs(np.diff(longer, axis=0)).max() * FPS < 0.5
    head = longer[20 + len(body) + 16 :, 15, 0]
    assert np.ptp(head) > 0.02, "the recording's sway is seen"


def test_a_pose_in_which_nobody_stands_is_held_and_sways_as_recorded() -> None:
    sitting, idle = people.standing(2.0), Idle((living(),))
    sitting[:, [k for k in range(22) if k not in (7, 8, 10, 11)], 1] -= 0.45
    assert not augment.stands_on(sitting[-1], idle)
    longer = augment.with_pauses(sitting, 0, 60, fps=FPS, seed=1, idle=idle)
    tail = longer[len(sitting) :]
    assert np.abs(tail - sitting[-1]).max() < 0.12
    assert np.ptp(tail[:, 15, 0]) > 0.01
    np.testing.assert_allclose(tail[:, [10, 11]], np.broadcast_to(sitting[-1, [10, 11]], (60, 2, 3)), atol=5e-3)
