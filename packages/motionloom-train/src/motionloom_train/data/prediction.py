"""Recordings for motion prediction, and the rules that data sets are evaluated by.

A `Protocol` is a data set as benchmarks use it: recordings of joint places by split, how much is observed and
predicted, and which windows are tested. Here are the CMU part of the mocap pack and folders of a user's own files;
`lab.papers.benchmarks` reads Human3.6M, HumanEva-I and AMASS.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features.humanml import resample_positions
from motionloom.core.features.positions import SMPL_LAYOUT, Layout
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.sources import Take, find_takes

CMU_TEST = ("02", "05", "09", "13", "39")
"""Subjects of the CMU part that no training sees: everyday actions, dances, swordplay, runs, walks."""
CMU_VAL = ("03", "07", "12")


@dataclass(frozen=True, eq=False)
class Recording:
    """One clip of joint places."""

    name: str
    subject: str
    action: str
    """The class that `CMD` is computed for."""
    split: str
    """``train``, ``val`` or ``test``."""
    positions: NDArray[np.float32]
    """(frames, joints, 3) metres, +Y up, joint 0 the root."""


@dataclass(frozen=True, eq=False)
class Protocol:
    """A data set, read, and how prediction is measured on it."""

    name: str
    fps: float
    observed: int
    """Frames shown."""
    future: int
    """Frames to predict."""
    layout: Layout
    """How a predictor trained on it sees the joints; ``layout.root`` False where the benchmark drops the root's way."""
    recordings: tuple[Recording, ...]
    licence: str
    threshold: float = 0.5
    """Metres, over the flattened pose from the root: windows whose last observed poses are nearer share futures."""
    first: int = 0
    """Frame of the first test window in a recording; counted for its first *observed* frame."""
    stride: int = 0
    """Frames between test windows; 0: ``observed``."""
    strict: bool = True
    """Whether a window that ends with its recording's last frame is left out, as published for Human3.6M."""
    listed: tuple[tuple[str, int], ...] = ()
    """Test windows by recording and first frame where the benchmark lists them; empty: by the rule above."""
    speeds: dict[str, float] = field(default_factory=dict)
    """Mean displacement per frame (metres) of each class, which `CMD` compares with; empty: measured on the futures."""

    @property
    def frames(self) -> int:
        """Observed and future frames."""
        return self.observed + self.future

    def split(self, name: str) -> tuple[Recording, ...]:
        """The recordings of a split."""
        return tuple(r for r in self.recordings if r.split == name)

    def windows(self, split: str = "test") -> list[tuple[Recording, int]]:
        """Recording and first frame of every window that is evaluated."""
        if self.listed and split == "test":
            by_name = {r.name: r for r in self.recordings if r.split == split}
            return [(by_name[name], start) for name, start in self.listed if name in by_name]
        step = self.stride or self.observed
        return [
            (r, start)
            for r in self.split(split)
            for start in range(self.first, len(r.positions) - self.frames + (not self.strict), step)
        ]


def read_cmu(
    folder: Path | str,
    *,
    splits: tuple[str, ...] = ("train", "val", "test"),
    say: Say = silent,
) -> Protocol:
    """The CMU part of the mocap pack (or a CMU download), whole subjects held out, as the uniform person at 30 fps.

    One second is observed and two are predicted. Recordings that cannot be read are left out and reported.
    """
    takes = [take for take in find_takes(folder) if take.source == "cmu" and cmu_split(take) in splits]
    recordings = tuple(_read(takes, 30.0, cmu_split, lambda take: take.name.split("_")[0], say))
    return checked(folder, Protocol("cmu", 30.0, 30, 60, SMPL_LAYOUT, recordings, takes[0].licence if takes else ""))


def read_folder(folder: Path | str, *, fps: float = 30.0, say: Say = silent) -> Protocol:
    """Motion files of a user's own (.bvh, .amc with .asf): of every ten the fifth is for validation, the last for
    test."""
    takes = sorted(find_takes(folder), key=lambda take: take.name)
    order = {take.name: number % 10 for number, take in enumerate(takes)}
    names = {9: "test", 4: "val"}
    recordings = tuple(
        _read(takes, fps, lambda take: names.get(order[take.name], "train"), lambda take: take.name, say)
    )
    licence = "; ".join(sorted({take.licence for take in takes}))
    return checked(folder, Protocol("own", fps, round(fps), round(2 * fps), SMPL_LAYOUT, recordings, licence))


def cmu_split(take: Take) -> str:
    """By subject; pairs of dancers go by the subject of the file."""
    subject = take.name.split("_")[0]
    return "test" if subject in CMU_TEST else "val" if subject in CMU_VAL else "train"


def _read(
    takes: list[Take],
    fps: float,
    split: Callable[[Take], str],
    subject: Callable[[Take], str],
    say: Say,
) -> Iterator[Recording]:
    for number, take in enumerate(takes):
        if number % 50 == 0:
            say(f"reading recording {number + 1} of {len(takes)}")
        try:
            recording = take.read()
        except MotionloomError as error:
            say(f"left out {take.name}: {error}")
            continue
        if isinstance(recording, np.ndarray):
            raise MotionloomError(f"{take.name} is kept as features; prediction needs recordings of joints")
        positions = resample_positions(recording.positions, recording.fps, target=fps)
        if not np.isfinite(positions).all():
            say(f"left out {take.name}: its positions are not finite")
            continue
        action = take.spans[-1].texts[0] if take.spans and take.spans[-1].texts else "motion"
        yield Recording(take.name, subject(take), action, split(take), positions.astype(np.float32))


def checked(folder: Path | str, protocol: Protocol) -> Protocol:
    """The protocol; raises MotionloomError where no recording is as long as a window."""
    if not any(len(r.positions) >= protocol.frames for r in protocol.recordings):
        raise MotionloomError(
            f"{folder} has no recording of {protocol.frames / protocol.fps:g} s or more, which a window takes; "
            f"of shorter ones that can be read it has {len(protocol.recordings)}"
        )
    return protocol
