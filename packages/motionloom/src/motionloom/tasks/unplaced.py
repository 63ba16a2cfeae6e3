"""Long motion of numbers that nothing here places in the world frame by frame, such as BABEL's."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Unpack

import numpy as np

from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import Sampling, Settings
from motionloom.tasks.long import long_features
from motionloom.tasks.sampling import Moves
from motionloom.tasks.text import check_features, check_humanml, finish


def compose_unplaced(
    prior: Prior,
    segments: Sequence[Segment],
    *,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Moves | None = None,
    **settings: Unpack[Settings],
) -> Iterator[Motion]:
    """As many motions of the same segments as ``count`` says, of any numbers that become a motion, BABEL's too.

    The arguments are those of `compose`. Raises `MotionloomError` for segments with goals: no place is asked for.
    """
    check_features(prior)
    chosen = Sampling.of(sampling, settings)
    if any(segment.goal is not None for segment in segments):
        check_humanml(prior, "goals need")
    pieces = long_features(prior, segments, sampling=chosen, progress=progress)
    for _ in range(chosen.number()):
        yield finish(prior, np.concatenate(list(islice(pieces, len(segments)))), foot_lock=foot_lock)
