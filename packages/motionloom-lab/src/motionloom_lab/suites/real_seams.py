"""Stretches of real motion as long as a transition: what transitions are compared with.

``transitions_reference.json`` beside this file holds their physical numbers for those who have no recordings; it is
written by ``motionloom evaluate transitions --make-reference FILE --data SET``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import HUMANML3D, of_width
from motionloom.core.files.text import plain_json
from motionloom.core.reading import read_bytes
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Evaluator
from motionloom_lab.metrics.transitions import JERK_HUMANML3D, area_under_jerk, jerk_curve, mean_jerk, peak_jerk
from motionloom_lab.suites.harness import embedded, physical_mean
from motionloom_lab.suites.protocol import Transitions
from motionloom_train.data.paths import DAMAGED

FORMAT = 1
LARGEST_FILE = 1 << 20
COUNTS = (7, 31, 62, 93)
"""Windows whose mean curve the shipped peaks and areas are of: a mean of more windows is flatter."""
REPEATS = 20
NAMES = ("pj", "auj", "auj_humanml3d")
PHYSICAL = {"share": "skate_share", "speed": "skate_speed", "slide": "skate_slide", "jerk": "jerk"}


@dataclass(frozen=True, eq=False)
class SeamWindows:
    """Random windows of real motion."""

    features: tuple[np.ndarray, ...]
    positions: np.ndarray
    """(windows, frames, 22, 3) metres."""

    @property
    def step(self) -> float:
        """Metres: mean over joints of the step between the two middle frames."""
        middle = self.positions.shape[1] // 2
        return float(np.linalg.norm(self.positions[:, middle] - self.positions[:, middle - 1], axis=-1).mean())


@dataclass(frozen=True, eq=False)
class SeamCrops:
    """One random window of each real motion that is long enough, embedded; and the motions to draw others from."""

    motions: tuple[np.ndarray, ...]
    """(frames, numbers) each, at least a window long."""
    window: int
    embeddings: Array
    mean_jerk: float
    """m/frame³ over all windows."""

    @staticmethod
    def of(features: Sequence[np.ndarray], window: int, evaluator: Evaluator | None, *, seed: int = 0) -> "SeamCrops":
        """The windows of these motions; MotionloomError where hardly one is long enough. No judge, no embeddings."""
        motions = tuple(one for one in features if len(one) >= window)
        if len(motions) < 2:
            raise MotionloomError(f"hardly a real motion has {window} frames; name more data")
        chosen = _windows(motions, window, np.random.default_rng((seed, 0)))
        embeddings = np.zeros((len(motions), 0))
        if evaluator is not None:
            embeddings = embedded(evaluator, chosen.features)
        return SeamCrops(motions, window, embeddings, mean_jerk(chosen.positions))

    def again(self, count: int, *, seed: tuple[int, ...]) -> SeamWindows:
        """``count`` windows of as many different motions, new ones each time."""
        rng = np.random.default_rng(seed)
        rows = rng.permutation(len(self.motions))[:count]
        return _windows([self.motions[k] for k in rows], self.window, rng)


def _windows(motions: Sequence[np.ndarray], window: int, rng: np.random.Generator) -> SeamWindows:
    starts = [int(rng.integers(len(one) - window + 1)) for one in motions]
    parts = [one[start : start + window] for one, start in zip(motions, starts, strict=True)]
    return SeamWindows(tuple(parts), np.stack([decoded(part) for part in parts]))


def decoded(features: np.ndarray) -> Array:
    """(frames, 22, 3) metres of features (frames, numbers), not standardised."""
    return of_width(features.shape[1]).decode_positions(features.astype(np.float64))


def jerks(positions: np.ndarray, reference: float, fps: float = HUMANML3D.fps) -> dict[str, float]:
    """Peak jerk and areas of the mean curve of windows (windows, frames, 22, 3); one to HumanML3D's at its rate."""
    curve = jerk_curve(positions)
    found = {"pj": peak_jerk(curve), "auj": area_under_jerk(curve, reference)}
    return found | ({"auj_humanml3d": area_under_jerk(curve, JERK_HUMANML3D)} if fps == HUMANML3D.fps else {})


def averaged(clips: Sequence[np.ndarray], fps: float = HUMANML3D.fps) -> dict[str, float]:
    """`PHYSICAL` of clips (frames, 22, 3), weighted by length."""
    numbers = physical_mean(clips, fps)
    return {short: numbers[name] for short, name in PHYSICAL.items()}


@dataclass(frozen=True)
class Shipped:
    """The numbers of the JSON file."""

    window: int
    mean_jerk: float
    physical: Mapping[str, float]
    """`PHYSICAL` of the windows, and ``step`` in mm."""
    jerks: Mapping[int, Mapping[str, float]]
    """`NAMES` by the count of windows."""

    def row(self, how: Transitions) -> dict[str, float]:
        """What belongs into the real row; peaks and areas only where they were measured for as many windows."""
        if how.window != self.window:
            return {}
        seams = {f"seam_{name}": self.physical[name] for name in PHYSICAL}
        return {**seams, "step": self.physical["step"], **self.jerks.get(how.seams, {})}


def measure_shipped(crops: SeamCrops, *, source: str, seed: int = 0) -> dict[str, Any]:
    """The content of the file: all crops once, and `REPEATS` draws of each of `COUNTS`."""
    every = crops.again(len(crops.motions), seed=(seed, 2))
    by_count: dict[str, Any] = {}
    for count in COUNTS:
        if count <= len(crops.motions):
            draws = [jerks(crops.again(count, seed=(seed, 3, r)).positions, crops.mean_jerk) for r in range(REPEATS)]
            by_count[str(count)] = {name: round(float(np.mean([draw[name] for draw in draws])), 6) for name in NAMES}
    numbers = {**averaged(list(every.positions)), "step": 1000 * every.step}
    return {
        "format": FORMAT,
        "about": "random windows of real motions, 20 frames per second, metres per frame cubed and as named",
        "source": source,
        "window": crops.window,
        "windows": len(crops.motions),
        "mean_jerk": round(crops.mean_jerk, 9),
        "physical": {name: round(value, 6) for name, value in numbers.items()},
        "jerks": by_count,
    }


def shipped_file() -> Path:
    """Where the shipped numbers lie."""
    return Path(str(resources.files("motionloom_lab.suites"))) / "transitions_reference.json"


def load_shipped(path: Path | None = None) -> Shipped | None:
    """The shipped numbers, or those of a file, checked; None where this copy ships none."""
    path = path or shipped_file()
    if not path.is_file():
        return None
    try:
        data = plain_json(read_bytes(path, max_bytes=LARGEST_FILE))
        if data["format"] != FORMAT:
            raise ValueError("it has another format")
        seams = {name: _number(data["physical"][name]) for name in (*PHYSICAL, "step")}
        by_count = {
            int(count): {name: _number(numbers[name]) for name in NAMES} for count, numbers in data["jerks"].items()
        }
        return Shipped(int(data["window"]), _number(data["mean_jerk"]), seams, by_count)
    except DAMAGED as error:
        raise MotionloomError(f"{path} holds no numbers of real transitions ({error!r}); make it again") from None


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < 0:
        raise ValueError("it holds something else than a number of 0 or more")
    return float(value)
