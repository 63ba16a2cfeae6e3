"""A prior with random weights around a walking person, so that what is drawn has human sizes."""

from dataclasses import replace

import numpy as np

from motionloom.core.features import humanml
from motionloom.core.models.prior import Prior
from motionloom.live.settings import Settings
from tests.recorded import tiny
from tests.tasks.test_edit import person

QUICK = Settings(steps=2, known=6, ahead=24, used=14)


def prior() -> Prior:
    features = humanml.motion_to_features(person(2.0))
    std = np.full(263, 0.02, np.float32)
    std[:3] = 0.004
    return replace(tiny.prior(), mean=features.mean(0), std=std)
