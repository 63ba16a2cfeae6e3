"""Ways to make one long motion of many prompts, by name: what the suite `transitions` holds against each other.

Every way is asked for the same prompts and the same visible frames, and gives that many: frames of interval i stand
between seam i - 1 and seam i. DoubleTake's rows share h frames, h / 2 on either side of a seam, so its rows are longer
by h / 2 at each seam.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeAlias

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.features import humanml
from motionloom.features.layout import FPS
from motionloom.kinematics.ik import motion_from_positions
from motionloom.lab.papers.baselines import BLANK, slerp_joined
from motionloom.lab.papers.double_take import double_take_features
from motionloom.lab.suites.protocol import Transitions
from motionloom.tasks.text import sample_features
from motionloom.weights.prior import Prior

Array: TypeAlias = np.ndarray


@dataclass(frozen=True, eq=False)
class Long:
    """One long motion at 20 frames per second."""

    features: Array
    """(frames, 263), not standardised: what the evaluator reads."""
    positions: Array
    """(frames, 22, 3) metres: what the physical numbers read."""


Method: TypeAlias = Callable[[Sequence[str], Sequence[int], int], Long]
"""(prompts, visible frames of each, seed) -> a motion of as many frames in all."""


def methods(prior: Prior, how: Transitions, names: Sequence[str] | None = None) -> dict[str, Method]:
    """The named ways (default `DEFAULT`), in that order; MotionloomError for a name there is not, and for none."""
    made = {name: partial(maker, prior, how) for name, maker in _MAKERS.items()}
    wanted = list(dict.fromkeys(DEFAULT if names is None else names))
    if not wanted:
        raise MotionloomError(f"no method is named; the methods are {', '.join(made)}")
    for name in wanted:
        if name not in made:
            raise MotionloomError(f"there is no method {name!r}; the methods are {', '.join(made)}")
    return {name: made[name] for name in wanted}


def rows_of(frames: Sequence[int], handshake: int) -> list[int]:
    """Row lengths of DoubleTake whose unfolded frames and seams are those of the visible ``frames``."""
    half, last = handshake // 2, len(frames) - 1
    rest = handshake - half
    return [n + (half if i > 0 else 0) + (rest if i < last else 0) for i, n in enumerate(frames)]


def from_features(features: np.ndarray) -> Long:
    """Features as the network draws them, decoded once."""
    numbers = features.astype(np.float64)
    return Long(numbers, humanml.decode_positions(numbers))


def from_positions(positions: Array) -> Long:
    """Positions (frames, 22, 3) with the features they encode to; the last frame, which has no next one, twice."""
    found = humanml.encode(humanml.canonical(humanml.uniform(positions))).astype(np.float64)
    return Long(np.concatenate([found, found[-1:]]), np.asarray(positions, dtype=np.float64))


def _ours(prior: Prior, how: Transitions, prompts: Sequence[str], frames: Sequence[int], seed: int) -> Long:
    from motionloom.goals.segment import Segment
    from motionloom.tasks.long import long_features

    segments = [Segment(text, n / FPS) for text, n in zip(prompts, frames, strict=True)]
    pieces = list(long_features(prior, segments, seed=seed, guidance=how.guidance, steps=how.steps))
    return from_features(np.concatenate(pieces))


def _exported(prior: Prior, how: Transitions, prompts: Sequence[str], frames: Sequence[int], seed: int) -> Long:
    """What a user gets: constant bones, planted feet held still."""
    from motionloom.goals.segment import Segment
    from motionloom.tasks.long import compose

    segments = [Segment(text, n / FPS) for text, n in zip(prompts, frames, strict=True)]
    blocks = compose(prior, segments, seed=seed, guidance=how.guidance, steps=how.steps)
    return from_positions(np.concatenate([block.positions() for block in blocks]))


def _double_take(
    prior: Prior,
    how: Transitions,
    prompts: Sequence[str],
    frames: Sequence[int],
    seed: int,
    *,
    mode: Literal["published", "paper"],
    steps: int | None = None,
    first: bool = False,
    second: bool = False,
) -> Long:
    made, _ = double_take_features(
        prior,
        prompts,
        rows_of(frames, how.handshake),
        mode=mode,
        handshake=how.handshake,
        ramp=how.blend,
        steps=steps or how.steps,
        seed=seed,
        guidance=how.guidance,
        first_take_only=first,
        second_take_only=second,
    )
    return from_features(made)


def _alone(
    prior: Prior, how: Transitions, prompts: Sequence[str], frames: Sequence[int], seed: int
) -> list[np.ndarray]:
    seeds = [seed + row for row in range(len(prompts))]
    return sample_features(prior, prompts, frames, seeds=seeds, guidance=how.guidance, steps=how.steps)


def _concatenated(prior: Prior, how: Transitions, prompts: Sequence[str], frames: Sequence[int], seed: int) -> Long:
    return from_features(np.concatenate(_alone(prior, how, prompts, frames, seed)))


def _slerp(prior: Prior, how: Transitions, prompts: Sequence[str], frames: Sequence[int], seed: int) -> Long:
    """The blank frames belong to the later segment, which is generated so much shorter, as TEACH has it."""
    shorter = [n - (BLANK if row else 0) for row, n in enumerate(frames)]
    alone = _alone(prior, how, prompts, shorter, seed)
    motions = [motion_from_positions(from_features(features).positions, FPS) for features in alone]
    return from_positions(slerp_joined(motions).positions())


_MAKERS: Mapping[str, Callable[..., Long]] = {
    "ours": _ours,
    "ours-exported": _exported,
    "published": partial(_double_take, mode="published"),
    "paper": partial(_double_take, mode="paper"),
    "first-take": partial(_double_take, mode="published", first=True),
    "second-take": partial(_double_take, mode="published", second=True),
    "concatenation": _concatenated,
    "slerp": _slerp,
    "published-1000": partial(_double_take, mode="published", steps=1000),
    "paper-1000": partial(_double_take, mode="paper", steps=1000),
}
DEFAULT = ("ours", "ours-exported", "published", "paper", "first-take", "concatenation", "slerp")
"""Without second take only and without the slow ones of 1000 steps."""
TITLES = {
    "ours": "motionloom compose, as drawn",
    "ours-exported": "motionloom compose, as exported",
    "published": "DoubleTake, published",
    "paper": "DoubleTake, paper",
    "first-take": "first take only",
    "second-take": "second take only",
    "concatenation": "concatenation",
    "slerp": "segments + SLERP",
    "published-1000": "DoubleTake, published",
    "paper-1000": "DoubleTake, paper",
}
"""Names of the rows; the number of steps is said behind them."""


def titled(name: str, steps: int) -> str:
    """A row's name."""
    return f"{TITLES.get(name, name)}, {1000 if name.endswith('-1000') else steps} steps"
