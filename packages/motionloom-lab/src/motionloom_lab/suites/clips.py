"""Real clips to compare with, from a built training set or straight from recordings."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.features.layout import FPS
from motionloom.io.atomic import finished
from motionloom.kinematics.physics import Array
from motionloom_lab.papers.readers import find_takes
from motionloom_train.data.build import clips_of
from motionloom_train.data.clips import Clip, read_clip
from motionloom_train.data.sources import Take

LONGEST = 30 * FPS
"""Frames: a collection's one line about a longer clip says too little about any part of it."""
SHORTEST = 0.8 * FPS


@dataclass(frozen=True)
class RealClip:
    """A recorded stretch and the words people have for it, on the uniform person at 20 frames per second."""

    name: str
    source: str
    split: str
    captions: tuple[str, ...]
    """Empty where nobody described it."""
    positions: Array
    """(frames, 22, 3) metres."""

    @property
    def held_out(self) -> bool:
        """True outside the training split."""
        return self.split != "train"


def real_clips(folder: Path | str) -> Iterator[RealClip]:
    """The plain (not mirrored, not augmented) clips of a built set or of a folder of recordings, by captioned stretch.

    A caption that somebody wrote for a stretch of a take goes before the collection's one line for the whole take.
    """
    folder = Path(folder)
    found = False
    for clip in plain_clips(folder):
        for real in _stretches(clip):
            found = True
            yield real
    if not found:
        raise MotionloomError(f"{folder} has no clips to compare with; make a set with 'motionloom data build'")


def plain_clips(
    folder: Path, *, mirrored: bool = False, chosen: Callable[[Take], bool] = lambda take: True
) -> Iterator[Clip]:
    """The clips of a built set, or of the ``chosen`` recordings of a folder, that show what was recorded as it was.

    ``mirrored``: their mirror images too.
    """
    if (folder / "clips").is_dir():
        for path in finished(folder / "clips", "*.safetensors"):
            derived = path.stem.endswith(("_looped", "_reversed")) or path.stem.startswith("mixed_")
            if not derived and (mirrored or not path.stem.startswith("M")):
                clip = read_clip(path)
                if clip.way == "plain":
                    yield clip
        return
    for take in filter(chosen, find_takes(folder)):
        try:
            yield from islice(clips_of(take), 1 + mirrored)
        except MotionloomError:
            continue  # too short or damaged: `data build` says which


def _stretches(clip: Clip) -> Iterator[RealClip]:
    positions = clip.positions()
    notes = [note for note in clip.notes if note.kind == "human"]
    if not notes and len(positions) <= LONGEST:
        notes = [note for note in clip.notes if note.kind == "index"]
    if not notes:
        yield RealClip(clip.name, clip.source, clip.split, (), positions)
    for note in notes:
        part = positions[note.first : note.last]
        if len(part) >= SHORTEST:
            yield RealClip(f"{clip.name}@{note.first / FPS:g}", clip.source, clip.split, note.texts, part)
