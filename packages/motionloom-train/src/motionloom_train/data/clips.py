"""The clips of a built set: features with captions, one safetensors file each."""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from safetensors import safe_open

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import Representation, of_width
from motionloom.core.files.tensors import check_head, save_tensors
from motionloom.core.files.text import plain_json
from motionloom.kinematics.physics import Array
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.paths import DAMAGED
from motionloom_train.data.words import LABELS, check_caption

MAX_BYTES = 256 << 20
"""Of a clip's file: more than an hour and a half of features."""
SHORTEST = 20
"""Frames of the shortest stretch that is described."""
THEN, GESTURE, MANNER = "then", "made ", "manner "
"""Groups of notes besides those of `data.actions`: one action and then another; gestures of `data.made`; manners of
`data.manners`."""
MEASURED = "measured:"
"""What the kind of a note begins with whose words are measured in its frames (`data.measured`)."""
KINDS = ("capture", "keyed", "made")


@dataclass(frozen=True)
class Note:
    """Frames ``first`` to ``last`` (half-open) of a clip and the words for them."""

    first: int
    last: int
    kind: str
    """``human``, ``index``, ``action:`` or ``measured:`` and the name of an action or a label, or the label."""
    texts: tuple[str, ...] = ()
    """Sentences or verb phrases; empty for measured labels, whose wordings are in `data.words`."""
    core: tuple[int, int] | None = None
    """Frames (first, end) of the clip that a training window must hold whole; None: any part shows the action."""


@dataclass(frozen=True)
class Clip:
    """One entry of a built set."""

    name: str
    source: str
    licence: str
    split: str
    way: str
    """``plain``, ``looped``, ``bent``, ``reversed``, ``held``, ``joined``, ``made`` or ``mixed``; mirrored copies begin
    with M in their name."""
    notes: tuple[Note, ...]
    features: np.ndarray
    """(frames, numbers of its representation) float32, not standardised."""
    kind: str = "capture"
    """``capture``, ``keyed`` (animated by hand) or ``made`` (arms moved by rule on a recorded body)."""

    flags: np.ndarray | None = None
    """(frames,) bool: where one action becomes another; None: nobody said."""

    @property
    def representation(self) -> Representation:
        """What its numbers are."""
        return of_width(self.features.shape[1])

    def positions(self, first: int = 0, last: int | None = None) -> Array:
        """(frames, 22, 3) metres of a stretch of frames, or of all."""
        return self.representation.decode_positions(self.features[first:last].astype(np.float64))


def write_clip(folder: Path, clip: Clip) -> None:
    """One file ``folder/NAME.safetensors``, whole or not at all."""
    about = {k: v for k, v in asdict(clip).items() if k not in ("features", "flags")}
    flags = {} if clip.flags is None else {"flags": np.ascontiguousarray(clip.flags, dtype=np.uint8)}
    save_tensors(
        {"features": np.ascontiguousarray(clip.features), **flags},
        folder / f"{clip.name}.safetensors",
        metadata={"clip": json.dumps(about)},
    )


def read_clip(path: Path) -> Clip:
    """The inverse of `write_clip`; raises MotionloomError for a damaged file."""
    try:
        check_head(path, max_bytes=MAX_BYTES)
        with safe_open(path, framework="numpy") as file:
            about = plain_json(file.metadata()["clip"])
            features = file.get_tensor("features")
            flags = file.get_tensor("flags") if "flags" in file.keys() else None  # noqa: SIM118
        notes = tuple(
            Note(n["first"], n["last"], n["kind"], tuple(n["texts"]), tuple(n["core"]) if n.get("core") else None)
            for n in about.pop("notes")
        )
        clip = Clip(**about, notes=notes, features=features, flags=flags)
        _check_clip(clip)
        clip = clip if flags is None else replace(clip, flags=flags.astype(bool))
        return clip
    except DAMAGED as error:
        raise MotionloomError(
            f"{path} is not a clip of a built set ({error}); delete it and its name in done/, and build again"
        ) from error


def _check_clip(clip: Clip) -> None:
    features = clip.features
    if features.dtype != np.float32 or features.ndim != 2 or not np.isfinite(features).all():
        raise ValueError("its features are not finite float32 numbers of shape (frames, numbers)")
    of_width(features.shape[1])
    if clip.flags is not None and (clip.flags.shape != features.shape[:1] or not np.isin(clip.flags, (0, 1)).all()):
        raise ValueError("its flags are not a 0 or 1 for each frame")
    if not all(isinstance(v, str) for v in (clip.name, clip.source, clip.licence, clip.split, clip.way)):
        raise ValueError("its name, source, licence, split or way is not text")
    if clip.kind not in KINDS:
        raise ValueError(f"its kind {clip.kind!r} is none of {', '.join(KINDS)}")
    for note in clip.notes:
        _check_note(note, len(features))


def _check_note(note: Note, frames: int) -> None:
    if not 0 <= note.first < note.last <= frames:
        raise ValueError(f"a note spans frames {note.first} to {note.last} of {frames}")
    verbal = note.kind in ("human", "index") or note.kind.startswith((PREFIX, MEASURED))
    if note.core and not note.first <= note.core[0] < note.core[1] <= note.last:
        raise ValueError(f"what a window must hold, frames {note.core}, is not within {note.first} to {note.last}")
    if not all(isinstance(t, str) for t in note.texts) or (verbal and not note.texts):
        raise ValueError(f"a note of kind {note.kind} lacks its texts")
    for text in note.texts:
        check_caption(text)
    if not verbal and not all(label in LABELS for label in note.kind.split("+", 1)):
        raise ValueError(f"there is no label {note.kind!r}")
