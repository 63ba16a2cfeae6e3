"""Ways to make one long motion of many prompts, by name: what the suite `transitions` compares.

Every way has the same prompts and the same visible frames, and gives that many: frames of interval i are
between seam i - 1 and seam i. DoubleTake's rows share h frames, h / 2 on either side of a seam, so its rows are longer
by h / 2 at each seam.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, TypeAlias, Unpack

import numpy as np

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import HUMANML3D, of_width
from motionloom.core.methods.double_take import TakeSettings, double_take_features, rows_of
from motionloom.core.models.prior import Prior
from motionloom.goals.segment import Segment
from motionloom.tasks.long import compose, long_features
from motionloom.tasks.text import sample_features
from motionloom_lab.papers.baselines import BLANK, slerp_joined
from motionloom_lab.suites.protocol import Transitions

Array: TypeAlias = np.ndarray


@dataclass(frozen=True, eq=False)
class Long:
    """One long motion at the frame rate of its representation."""

    features: Array
    """(frames, numbers), not standardised: what the evaluator reads."""
    positions: Array
    """(frames, 22, 3) metres: what the physical numbers read."""


Method: TypeAlias = Callable[[Sequence[str], Sequence[int], int], Long]
"""(prompts, visible frames of each, seed) -> a motion of as many frames in all."""


def methods(prior: Prior, how: Transitions, names: Sequence[str] | None = None) -> dict[str, Method]:
    """The rows of the protocol's table and the named ways, in that order (default `DEFAULT`).

    Raises MotionloomError for a name there is not, and for none.
    """
    rows = {name: partial(_variant, name=name) for name in how.variants}
    only = () if of_width(len(prior.mean)) is HUMANML3D else BODIES
    usual = () if rows else [name for name in DEFAULT if name not in only]
    chosen = list(dict.fromkeys(usual if names is None else names))
    if not chosen and not rows:
        raise MotionloomError(f"no method is named; the methods are {', '.join(_MAKERS)}")
    for name in chosen:
        if name not in _MAKERS:
            raise MotionloomError(f"there is no method {name!r}; the methods are {', '.join(_MAKERS)}")
        if name in only:
            raise MotionloomError(f"the method {name!r} needs weights of {HUMANML3D}; these draw {len(prior.mean)}")

    def method(name: str) -> Method:
        make = rows.get(name) or _MAKERS[name][1]
        return lambda prompts, frames, seed: make(Request(prior, how, prompts, frames, seed))

    return {name: method(name) for name in (*rows, *chosen)}


def from_features(features: np.ndarray) -> Long:
    """Features as the network samples them, decoded once."""
    numbers = features.astype(np.float64)
    return Long(numbers, of_width(numbers.shape[1]).decode_positions(numbers))


def from_positions(positions: Array) -> Long:
    """Positions (frames, 22, 3) with the features they encode to; the last frame, which has no next one, twice."""
    rows = humanml.encode(humanml.canonical(humanml.uniform(positions))).astype(np.float64)
    return Long(np.concatenate([rows, rows[-1:]]), np.asarray(positions, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class Request:
    """What one long motion should be."""

    prior: Prior
    how: Transitions
    prompts: Sequence[str]
    frames: Sequence[int]
    """Visible frames of each prompt."""
    seed: int

    @property
    def segments(self) -> list[Segment]:
        """The prompts with their seconds."""
        return [Segment(text, n / self.prior.fps) for text, n in zip(self.prompts, self.frames, strict=True)]

    def alone(self, frames: Sequence[int]) -> list[np.ndarray]:
        """Every prompt by itself, (frames, numbers) each."""
        seeds = [self.seed + row for row in range(len(self.prompts))]
        return sample_features(self.prior, self.prompts, frames, seeds=seeds, **self.how.drawing)


def _ours(request: Request) -> Long:
    pieces = long_features(request.prior, request.segments, seed=request.seed, **request.how.drawing)
    return from_features(np.concatenate(list(pieces)))


def _exported(request: Request) -> Long:
    """What a user gets: constant bones, planted feet held still."""
    motion = compose(request.prior, request.segments, seed=request.seed, **request.how.drawing)
    return from_positions(motion.positions())


def _double_take(
    request: Request, mode: Literal["published", "paper"] = "published", **more: Unpack[TakeSettings]
) -> Long:
    how = request.how
    shares = {"soft": how.soft, "hard": how.hard, "restart": how.restart}
    chosen = {name: share for name, share in shares.items() if share is not None}
    settings: TakeSettings = {**how.drawing, **chosen, **more}  # type: ignore[typeddict-item]
    rows = rows_of(request.frames, how.handshake)
    joins = {"handshake": how.handshake, "ramp": how.ramp}
    features, _ = double_take_features(
        request.prior, request.prompts, rows, mode=mode, seed=request.seed, **joins, **settings
    )
    return from_features(features)


def _variant(request: Request, *, name: str) -> Long:
    """A row of the protocol's table."""
    changes = dict(request.how.variants[name])
    takes: TakeSettings = {key: changes.pop(key) for key in [*changes] if key.endswith("_take_only")}  # type: ignore[assignment]
    how = replace(request.how, **changes)
    return _double_take(replace(request, how=how), mode=how.mode, **takes)  # type: ignore[arg-type]


def _slerp(request: Request) -> Long:
    """The blank frames belong to the later segment, which is generated so much shorter, as TEACH has it."""
    alone = request.alone([n - (BLANK if row else 0) for row, n in enumerate(request.frames)])
    motions = [motion_from_positions(from_features(features).positions, FPS) for features in alone]
    return from_positions(slerp_joined(motions).positions())


_MAKERS: Mapping[str, tuple[str, Callable[[Request], Long]]] = {
    "ours": ("motionloom compose, as drawn", _ours),
    "ours-exported": ("motionloom compose, as exported", _exported),
    "published": ("DoubleTake, published", _double_take),
    "paper": ("DoubleTake, paper", partial(_double_take, mode="paper")),
    "first-take": ("first take only", partial(_double_take, first_take_only=True)),
    "second-take": ("second take only", partial(_double_take, second_take_only=True)),
    "concatenation": ("concatenation", lambda request: from_features(np.concatenate(request.alone(request.frames)))),
    "slerp": ("segments + SLERP", _slerp),
    "published-1000": ("DoubleTake, published", partial(_double_take, steps=1000)),
    "paper-1000": ("DoubleTake, paper", partial(_double_take, mode="paper", steps=1000)),
}
BODIES = ("ours-exported", "slerp")
"""Ways that place a body by HumanML3D's numbers."""
DEFAULT = ("ours", "ours-exported", "published", "paper", "first-take", "concatenation", "slerp")
"""Without second take only and without the slow ones of 1000 steps."""
TITLES = {name: title for name, (title, _) in _MAKERS.items()}
"""Names of the rows; the number of steps follows them."""


def titled(name: str, steps: int) -> str:
    """A row's name."""
    return f"{TITLES.get(name, name)}, {1000 if name.endswith('-1000') else steps} steps"
