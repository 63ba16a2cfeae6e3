"""The named control masks fix the recorded numbers of the 263."""

import numpy as np
import pytest

from motionloom.core.features.layout import mask
from tests.conformance.runner import Case, cases


@pytest.mark.parametrize("case", cases("control_masks"))
def test_mask_fixes_the_recorded_dimensions(case: Case) -> None:
    assert np.flatnonzero(mask(case.name)).tolist() == case.lists["dims"]
