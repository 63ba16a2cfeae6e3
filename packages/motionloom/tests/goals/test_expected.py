"""What words allow to check, on bodies that do it and bodies that do not."""

import numpy as np
import pytest

from motionloom.goals.expected import asks_for_rest, checks_of, share_met
from tests.kinematics.people import FPS, jumping, spun, standing, walking


@pytest.mark.parametrize(
    ("text", "does", "does_not"),
    [
        ("a person walks forward", walking(1.2), standing()),
        ("a person walks backwards", walking(-1.2), walking(1.2)),
        ("someone walks", walking(1.2), standing()),
        ("a person jumps", jumping(0.3), walking(1.2)),
        (
            "a person turns left",
            spun(standing(), np.linspace(0, 1.5, 80)),
            spun(standing(), np.linspace(0, -1.5, 80)),
        ),
        (
            "a person turns around",
            spun(standing(), np.linspace(0, -3.1, 80)),
            spun(standing(), np.linspace(0, 1.0, 80)),
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_done(text: str, does: np.ndarray, does_not: np.ndarray) -> None:
    assert share_met(text, does, FPS) == 1
    assert share_met(text, does_not, FPS) == 0


@pytest.mark.parametrize("text", ["a person dances", "a zombie", "a person looks at the left hand"])
def test_what_nothing_can_be_checked_of_is_met(text: str) -> None:
    assert checks_of(text) == []
    assert share_met(text, standing(), FPS) == 1


def test_a_side_of_limbs_is_no_way() -> None:
    """A kick with the left leg turns nowhere, and who runs in place goes nowhere."""
    assert len(checks_of("a person kicks with the left leg")) == 1
    assert checks_of("a person runs in place") == []
    assert asks_for_rest("a person stands and waits")
    assert not asks_for_rest("a person jumps")
