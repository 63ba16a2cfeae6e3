"""The windows that predictors are tried on, and one way of predicting scored on all of them in little memory.

A way takes pasts (windows, observed, joints, 3) to futures (windows, samples, frames, joints, 3), metres in the world,
+Y up. Scores are on places from the root, as in the literature; how the root goes through the world is measured apart.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.files.atomic import finished
from motionloom.core.models.predictor import Predictor
from motionloom.kinematics.layout_body import places_on_layout
from motionloom_lab.metrics import prediction as metrics
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT
from motionloom_lab.papers.benchmarks import find_protocol
from motionloom_train.data.clips import read_clip
from motionloom_train.data.prediction import CMU_TEST, Protocol, Recording, checked
from motionloom_train.data.progress import Say, silent

Array = NDArray[np.float64]
Way = Callable[[Array], Array]

ROWS = 512
"""Futures sampled and scored at once: 33 MB of 60 frames of 22 joints."""
OF_REAL = (
    "jerk",
    "jerk_peak",
    "stretch",
    "stretch_rmse",
    "jitter",
    "jitter_rmse",
    "seam_velocity",
    "seam_velocity_worst",
    "seam_acceleration",
    "seam_acceleration_worst",
)
"""What real futures have numbers of; their errors would be 0."""
KNOWN = {*metrics.METRICS, "cmd", "root_ade", "root_fde", "seconds"}
"""Names of everything that `score` gives."""
EVERY = 20.0
"""Seconds between lines of progress."""


@dataclass(frozen=True, eq=False)
class PredictionTrial:
    """Test windows and what came after each of them."""

    protocol: Protocol
    windows: tuple[tuple[Recording, int], ...]
    """Those that are measured: recording and first frame."""
    every: tuple[tuple[Recording, int], ...]
    """All of the test part, out of which futures of similar pasts are taken."""
    alike: tuple[NDArray[np.int32], ...]
    """For each measured window the numbers of those of ``every`` that end their past like it, itself included."""
    limbs: metrics.Limbs
    singles: metrics.Singles
    speeds: dict[str, float]
    """Metres per frame by class, what CMD compares with."""

    @property
    def several(self) -> int:
        """Windows with more than one future."""
        return sum(len(near) > 1 for near in self.alike)

    def pasts(self, first: int, last: int) -> Array:
        """(windows, observed, joints, 3) metres in the world."""
        return np.stack([self._cut(w, 0, self.protocol.observed) for w in self.windows[first:last]])

    def future(self, number: int) -> Array:
        """(frames, joints, 3) metres in the world: what came."""
        return self._cut(self.windows[number], self.protocol.observed, self.protocol.frames)

    def futures(self, number: int) -> Array:
        """(K, frames, joints - 1, 3) metres from the root: what came after similar pasts."""
        own = self.protocol
        return from_root(np.stack([self._cut(self.every[k], own.observed, own.frames) for k in self.alike[number]]))

    def _cut(self, window: tuple[Recording, int], first: int, last: int) -> Array:
        recording, start = window
        return recording.positions[start + first : start + last].astype(np.float64)


def read_test(data: Path | str, name: str | None = None, *, say: Say = silent) -> Protocol:
    """The test part of a data set (`find_protocol`), or of the CMU clips in a built set, which are at 20 fps."""
    clips = Path(data) / "clips"
    if name not in (None, "cmu") or not clips.is_dir():
        return find_protocol(data, name=name, splits=("test",), say=say)
    takes = []
    for path in finished(clips, "*.safetensors"):
        plain = path.stem.split("_")[0] in CMU_TEST and not path.stem.endswith(("_looped", "_reversed"))
        clip = read_clip(path) if plain else None
        if clip and clip.source == "cmu" and clip.way == "plain":
            places = clip.positions()
            action = next((note.texts[0] for note in clip.notes if note.kind == "index" and note.texts), "motion")
            turned = humanml.resample_positions(places, FPS, target=30.0).astype(np.float32)
            takes.append(Recording(clip.name, clip.name.split("_")[0], action, "test", turned))
    return checked(data, Protocol("cmu, built set", 30.0, 30, 60, SMPL_LAYOUT, tuple(takes), "as the set's"))


def prepare(protocol: Protocol, *, count: int | None = None, singles: metrics.Singles = "all") -> PredictionTrial:
    """The test windows of a protocol, ``count`` of them evenly chosen; similar pasts are looked for among all.

    Raises MotionloomError where there is no test window, or none that is left with ``singles``.
    """
    every = tuple(protocol.windows("test"))
    if not every:
        raise MotionloomError(f"the test part of {protocol.name} has no window of {protocol.frames} frames to measure")
    if count is not None and count < 1:
        raise MotionloomError(f"there must be at least one window to measure; got {count}")
    last = np.stack([r.positions[start + protocol.observed - 1] for r, start in every]).astype(np.float64)
    near = metrics.similar_windows(from_root(last).reshape(len(every), -1), protocol.threshold)
    usable = [k for k in range(len(every)) if singles != "skip" or len(near[k]) > 1]
    if not usable:
        raise MotionloomError(f"no test window of {protocol.name} has more than one future; count those with one too")
    places = np.linspace(0, len(usable) - 1, min(count or len(usable), len(usable))).round().astype(int)
    chosen = [usable[k] for k in places]
    h36m = protocol.layout.names == H36M_LAYOUT.names
    limbs = metrics.H36M_LIMBS if h36m else metrics.limbs_of(protocol.layout.parents)
    trial = PredictionTrial(
        protocol, tuple(every[k] for k in chosen), every, tuple(near[k] for k in chosen), limbs, singles, {}
    )
    tally = metrics.CmdTally()
    for number, (recording, _) in enumerate(trial.windows):
        tally.add(recording.action, from_root(trial.future(number))[None])
    return replace(trial, speeds=tally.speeds() | protocol.speeds)


def from_root(positions: np.ndarray) -> Array:
    """(..., joints, 3) to (..., joints - 1, 3): from the root, without it."""
    return positions[..., 1:, :] - positions[..., :1, :]


def check_fit(predictor: Predictor, protocol: Protocol) -> None:
    """Raise MotionloomError for a predictor of other joints, another rate or other windows than the protocol's."""
    mine = predictor.layout.joints, predictor.fps, predictor.observed, predictor.frames
    its = protocol.layout.joints, protocol.fps, protocol.observed, protocol.frames
    if mine != its or predictor.layout.names != protocol.layout.names:
        sizes = [
            f"{joints} joints at {fps:g} fps, {observed} of {frames} frames seen"
            for joints, fps, observed, frames in (mine, its)
        ]
        raise MotionloomError(
            f"these weights are for {sizes[0]}, and {protocol.name} has {sizes[1]}; name weights trained on such data"
        )


def fitted(predictor: Predictor, protocol: Protocol) -> Protocol:
    """A data set as a predictor sees it, so that a network is tried on people that it was not trained on.

    Recordings of the 22 joints become those of a predictor of other joints, at its rate and for its window
    ("zero-shot", Chen et al. 2023, section 5.6): joints by name, left and right as they are, bones not scaled. Other
    data sets are returned as they are. Raises MotionloomError as `check_fit` for what fits in neither way.
    """
    layout = predictor.layout
    if layout.names == protocol.layout.names or protocol.layout.names != SMPL_LAYOUT.names:
        check_fit(predictor, protocol)
        return protocol
    ratio = predictor.fps / protocol.fps
    recordings = tuple(
        replace(r, positions=_places_at(predictor, r.positions, protocol.fps))
        for r in protocol.recordings
        if len(r.positions) > 1
    )
    return replace(
        protocol,
        name=f"{protocol.name}, zero-shot",
        fps=predictor.fps,
        observed=predictor.observed,
        future=predictor.frames - predictor.observed,
        layout=layout,
        recordings=recordings,
        first=round(protocol.first * ratio),
        stride=round(protocol.stride * ratio),
        listed=tuple((name, round(start * ratio)) for name, start in protocol.listed),
        threshold=0.5,
        speeds={},
    )


def _places_at(predictor: Predictor, positions: np.ndarray, fps: float) -> NDArray[np.float32]:
    places = humanml.resample_positions(positions, fps, target=predictor.fps)
    return places_on_layout(predictor.layout, places).astype(np.float32)


def score(
    trial: PredictionTrial,
    way: Way | None,
    *,
    samples: int = 1,
    chunk: int | None = None,
    root: bool = True,
    say: Say = silent,
) -> dict[str, float]:
    """Numbers by name: those of `metrics.METRICS`, ``cmd``, ``root_ade``, ``root_fde`` and ``seconds`` per past.

    ``way`` None: the real futures themselves. ``chunk`` windows at a time; numbers do not depend on it.
    """
    tally, ways, seconds = metrics.Tally(trial.singles), list[tuple[float, float]](), 0.0
    variety: list[float] = []
    for number, motions, took in _predicted(trial, way, chunk or max(1, ROWS // max(samples, 1)), say):
        truth, past = trial.future(number), trial.pasts(number, number + 1)[0]
        near = trial.futures(number)
        scores = metrics.score_window(
            from_root(motions), from_root(truth), near, fps=trial.protocol.fps, past=from_root(past), limbs=trial.limbs
        )
        tally.add(scores, trial.windows[number][0].action)
        off = np.linalg.norm(motions[:, :, 0] - truth[None, :, 0], axis=-1)
        ways.append((off.mean(axis=1).min(), off[:, -1].min()))  # ADE and FDE of the root's way
        seconds += took
        if way is None and len(near) > 1:
            variety.append(metrics.apd(near))
    numbers = {name: average.value for name, average in tally.averages().items() if way or name in OF_REAL}
    numbers["cmd"] = tally.cmd.result(trial.speeds)
    if way is None:
        return numbers | ({"apd": float(np.mean(variety))} if variety else {})
    if root:
        numbers |= zip(("root_ade", "root_fde"), np.mean(ways, axis=0).tolist())
    return numbers | {"seconds": seconds / len(trial.windows)}


def _predicted(trial: PredictionTrial, way: Way | None, chunk: int, say: Say) -> Iterator[tuple[int, Array, float]]:
    """Number of each window, its futures (samples, frames, joints, 3), and the seconds that they took."""
    reported = time.perf_counter()
    for first in range(0, len(trial.windows), chunk):
        last = min(first + chunk, len(trial.windows))
        if way is None:
            for number in range(first, last):
                yield number, trial.future(number)[None], 0.0
            continue
        began = time.perf_counter()
        motions = way(trial.pasts(first, last))
        took = (time.perf_counter() - began) / (last - first)
        for number in range(first, last):
            yield number, motions[number - first], took
        if time.perf_counter() - reported > EVERY:
            reported = time.perf_counter()
            say(f"window {last} of {len(trial.windows)}")
