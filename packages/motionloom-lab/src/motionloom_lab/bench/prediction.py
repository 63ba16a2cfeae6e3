"""What fifty futures of one past cost, beside the published recipe for the same: 50 rows, 100 steps, a call a step."""

from collections.abc import Callable
from typing import Any

import numpy as np

from motionloom.core.methods.humanmac import published_futures
from motionloom.core.models.predictor import Predictor
from motionloom.core.skeleton import SMPL22
from motionloom.tasks.completion import STEPS, futures
from motionloom_lab.bench.speed import Entry, timed
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT
from motionloom_train.data.prediction import Protocol, Recording
from motionloom_train.data.progress import Say, silent
from motionloom_train.predictor import Settings, Windows, new_predictor

COUNT, PUBLISHED_STEPS = 50, 100


def cost_of_futures(
    predictor: Predictor, *, repeats: int, timed_steps: int = 10, progress: Say = silent
) -> list[Entry]:
    """Seconds of our default, and how often it fits into the published recipe: of these weights, of the published net.

    The published network has its published size (28,401,712) and untrained weights, which cost the same. Its recipe is
    run for ``timed_steps`` steps and reckoned from them. All three are timed in turns.
    """
    past = _standing(predictor.observed, 22)
    published = _published()
    other = _standing(published.observed, 17)
    rest = predictor.frames - predictor.observed
    progress(f"{COUNT} futures of {rest / predictor.fps:g} s, and {timed_steps} of {PUBLISHED_STEPS} published steps")
    jobs: list[Callable[[], Any]] = [
        lambda: futures(predictor, past[None], count=COUNT),
        lambda: published_futures(predictor, past[None], count=COUNT, steps=timed_steps),
        lambda: published_futures(published, other[None], count=COUNT, steps=timed_steps),
    ]
    ours, same, theirs = timed(jobs, repeats, warm=3)
    same, theirs = (seconds * PUBLISHED_STEPS / timed_steps for seconds in (same, theirs))
    size = sum(values.size for values in predictor.net.weights.values())
    how = f"{STEPS} steps: {ours:.2f} s; {PUBLISHED_STEPS} published steps reckoned from {timed_steps} timed ones"
    return [
        Entry(f"{COUNT} futures of {rest / predictor.fps:g} s", ours, "s", "< 2 on 2 cores", ours < 2, how),
        _times("published network and recipe / ours", theirs, ours, "28,401,712 parameters"),
        _times("published recipe of these weights / ours", same, ours, f"{size:,} parameters"),
    ]


def _times(name: str, theirs: float, ours: float, what: str) -> Entry:
    ratio = theirs / ours
    return Entry(name, ratio, "times", ">= 20", ratio >= 20, f"{what}: {theirs:.1f} s")


def _standing(frames: int, joints: int) -> np.ndarray:
    """(frames, joints, 3) of a person who slides forward; what is seen does not change the cost."""
    places = np.repeat(SMPL22.rest_positions()[None, :joints], frames, axis=0)
    return places + np.arange(frames)[:, None, None] * np.array([0.0, 0.0, 0.01])


def _published() -> Predictor:
    standing = Recording("standing", "", "", "train", _standing(200, 17).astype(np.float32))
    protocol = Protocol("h36m", 50.0, 25, 100, H36M_LAYOUT, (standing,), "none")
    windows = Windows(protocol.recordings, protocol, variant="published")
    settings = Settings("published", 20, width=512)
    return new_predictor(protocol, settings, windows, schedule="cosine", levels=1000)
