"""BABEL as distributed: label files beside AMASS recordings, to training pairs of the BABEL representation.

BABEL (Punnakkal et al., CVPR 2021) has in ``train.json`` and ``val.json`` what is done from second to second in
recordings of AMASS (Mahmood et al., ICCV 2019), which are .npz files of SMPL-H poses. Both have licences of their own.

A folder holds ``train.json`` and/or ``val.json`` (or the release's own folder with them), and the recordings under
their ``feat_p`` paths, as in ``CMU/CMU/28/28_11_poses.npz``, in the folder itself or in ``amass``; the doubled name of
the collection, which not every way of unpacking gives, may be single.

Pairs are those of PriorMDM's BABEL models ("separate pairs"): see `pairs` and `items`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features.babel import FPS, Y_UP, encode
from motionloom.core.files import text
from motionloom.core.files.atomic import check_place
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import npz
from motionloom_lab.report.files import write_json
from motionloom_train.data.clips import Clip, Note, write_clip
from motionloom_train.data.paths import DAMAGED, inside
from motionloom_train.data.progress import Say
from motionloom_train.data.words import check_caption

SHORTEST, LONGEST = 45, 250
"""Frames of an item: the published limits."""
SLACK = 4
"""Frames by which an item may be too long, and by which items are shortened at random."""
TOUCH = 1 / FPS
"""Seconds between two labels that still count as adjacent: a frame."""
BRIEFEST = 0.5
"""Seconds: shorter recordings are dropped."""
LICENCE = "BABEL / AMASS: non-commercial research under the licences of BABEL, AMASS and its subsets"
SPLITS = ("train", "val")
_RELEASE = "babel_v1.0_release"
_MAX_JSON = 1 << 28
_MAX_LABELS = 1000
_MAX_PAIRS = 20_000
_LATEST = 1e6
_POSES = {"t pose", "a pose", "tpose", "apose"}


@dataclass(frozen=True)
class Segment:
    """A labelled stretch of a recording."""

    text: str
    """The processed label, such as ``walk`` or ``turn left``."""
    acts: tuple[str, ...]
    """BABEL's categories."""
    start: float
    """Seconds."""
    end: float

    @property
    def is_transition(self) -> bool:
        """Whether it is labelled as one action becoming another."""
        return self.text.lower() == "transition" or "transition" in self.acts

    @property
    def is_calibration(self) -> bool:
        """Whether it shows a T-pose or an A-pose, which nobody requests."""
        return any(name.lower().replace("-", " ").strip() in _POSES for name in (self.text, *self.acts))


@dataclass(frozen=True)
class Recording:
    """One entry of a label file."""

    name: str
    """``babel_`` and the sequence's number."""
    split: str
    """``train`` or ``val``."""
    place: str
    """``feat_p``: the recording's path within AMASS."""
    whole: tuple[str, ...]
    """Labels of the recording as a whole."""
    segments: tuple[Segment, ...]
    """Labels of its parts, by start; empty where nobody labelled parts."""


@dataclass(frozen=True)
class Pair:
    """Two actions in a row, in seconds: ``first`` ends where ``between`` starts, ``second`` starts where that ends."""

    texts: tuple[str, str]
    first: tuple[float, float]
    between: tuple[float, float]
    """The transition; of no length where the actions only touch."""
    second: tuple[float, float]


@dataclass(frozen=True, eq=False)
class BabelItem:
    """One training example of the BABEL representation."""

    name: str
    text: str
    features: NDArray[np.float32]
    """(frames, 135) at 30 fps, not standardised, turned as published."""
    flags: NDArray[np.bool_]
    """(frames,) True in the transition."""

    def __len__(self) -> int:
        return len(self.features)


# Label files


def is_babel(folder: Path) -> bool:
    """Whether the folder has BABEL's label files."""
    return bool(_label_files(folder))


def _label_files(folder: Path) -> dict[str, Path]:
    roots = {s: [p for p in (folder, folder / _RELEASE) if (p / f"{s}.json").is_file()] for s in ("train", "val")}
    return {split: places[0] / f"{split}.json" for split, places in roots.items() if places}


def find_recordings(folder: Path | str, *, splits: Sequence[str] = ("train", "val")) -> list[Recording]:
    """The content of a folder's label files; raises MotionloomError where there are none or one is not BABEL's."""
    folder = Path(folder)
    files = _label_files(folder)
    if not any(split in files for split in splits):
        names = " or ".join(f"{split}.json" for split in splits)
        raise MotionloomError(f"{folder} has no {names}; name a folder with BABEL's label files")
    return [recording for split in splits if split in files for recording in read_labels(files[split], split)]


def read_labels(path: Path, split: str) -> list[Recording]:
    """One label file; raises MotionloomError, naming the sequence, for anything but BABEL's form."""
    try:
        whole = text.parse_json(text.read_bytes(path, max_bytes=_MAX_JSON), path)
    except MotionloomError as error:
        raise MotionloomError(f"{error}; fetch BABEL's label files again") from None
    if not isinstance(whole, dict):
        raise MotionloomError(f"{path} must hold an object with one entry per sequence, as BABEL's label files do")
    result = []
    for number, entry in whole.items():
        try:
            result.append(_recording(str(number), split, entry))
        except DAMAGED as error:
            reason = " ".join(str(error).split())[:120]
            raise MotionloomError(
                f"{path}: sequence {text.shown(str(number))} is not as BABEL writes it "
                f"({type(error).__name__}: {reason}); fetch the file again"
            ) from None
    return result


def _recording(number: str, split: str, entry: dict[str, Any]) -> Recording:
    if not number.isalnum() or len(number) > 40:
        raise ValueError("its number has other signs than letters and digits")
    place = entry["feat_p"]
    if not isinstance(place, str) or not place.endswith(".npz") or not place.isprintable():
        raise ValueError("its feat_p is no path of an .npz file")
    parts = [_segment(label) for label in _labels(entry.get("frame_ann"))]
    segments = sorted((s for s in parts if s.end > s.start and s.text), key=lambda s: (s.start, s.end))
    texts = (_text(label) for label in _labels(entry.get("seq_ann")))
    return Recording(f"babel_{number}", split, place, tuple(dict.fromkeys(t for t in texts if t)), tuple(segments))


def _labels(annotation: dict[str, Any] | None) -> list[dict[str, Any]]:
    labels = annotation["labels"] if annotation is not None else []
    if not isinstance(labels, list) or len(labels) > _MAX_LABELS:
        raise ValueError(f"labels is not a list of at most {_MAX_LABELS}")
    return labels


def _text(label: dict[str, Any]) -> str:
    words = label.get("proc_label") or label.get("raw_label") or ""
    if not isinstance(words, str):
        raise ValueError("a label is not text")
    plain = " ".join(words.split())
    check_caption(plain)
    return plain


def _segment(label: dict[str, Any]) -> Segment:
    start, end = float(label["start_t"]), float(label["end_t"])
    if not (0 <= start <= _LATEST and math.isfinite(end)):
        raise ValueError(f"a label goes from {start} to {end} seconds")
    acts = label.get("act_cat") or []
    if not isinstance(acts, list) or not all(isinstance(a, str) for a in acts):
        raise ValueError("act_cat is not a list of categories")
    return Segment(_text(label), tuple(acts), start, end)


# Recordings


def find_motion(folder: Path | str, recording: Recording) -> Path:
    """The .npz file of a recording; raises MotionloomError where it is missing or its path is outside of the folder."""
    folder = Path(folder)
    first, _, rest = recording.place.partition("/")
    single = rest if rest.startswith(f"{first}/") else recording.place
    for base in (folder, folder / "amass"):
        for place in (recording.place, single):
            path = inside(base, place)
            if path.is_file():
                return path
    raise MotionloomError(f"{recording.name}: there is no {recording.place} in {folder} or {folder / 'amass'}")


def read_amass(path: Path | str) -> Motion:
    """A recording of AMASS (SMPL-H, SMPL-X or SMPL poses) as a motion of the 22 body joints at its own frame rate.

    The rotations are kept, +Z up becomes +Y up, and the root is at ``trans``: without the body model, whose
    files have a licence of their own, nobody knows the person's size, so the bones are the uniform person's.
    Reads ``poses`` (frames, 66 or more) rotation vectors, ``trans`` (frames, 3) metres, ``mocap_framerate`` or
    ``mocap_frame_rate``. Raises MotionloomError, naming the file, for anything else.
    """
    arrays = npz.read_arrays(path, only=("poses", "trans", "mocap_framerate", "mocap_frame_rate"))
    rate = next((arrays[name] for name in ("mocap_framerate", "mocap_frame_rate") if name in arrays), None)
    poses, trans = arrays.get("poses"), arrays.get("trans")
    if rate is None or poses is None or trans is None:
        raise MotionloomError(f"{path} lacks poses, trans or mocap_framerate; name a recording of AMASS")
    joints = len(SMPL22)
    shaped = poses.ndim == 2 and len(poses) and poses.shape[1] >= 3 * joints and trans.shape == (len(poses), 3)
    if not shaped or rate.size != 1 or any(a.dtype.kind not in "fiu" for a in (poses, trans, rate)):
        raise MotionloomError(
            f"{path}: poses must be numbers of the shape (frames, {3 * joints} or more), trans (frames, 3), the frame "
            f"rate one number; they are {poses.shape}, {trans.shape} and {rate.shape}"
        )
    vectors, root = poses[:, : 3 * joints].astype(np.float64), trans.astype(np.float64)
    fps = float(rate.reshape(()))
    if not (1 <= fps <= 1000 and (np.abs(vectors) < 1e3).all() and (np.abs(root) < 1e4).all()):
        raise MotionloomError(
            f"{path} has numbers that are not finite or beyond what people do, or a frame rate ({fps:g}) outside 1 to "
            "1000; fetch it again"
        )
    turned = rot.rotvec_to_quat(vectors.reshape(-1, joints, 3))
    turned[:, 0] = rot.multiply(rot.matrix_to_quat(Y_UP), turned[:, 0])
    return Motion(SMPL22, fps, root @ Y_UP.T, rot.unroll(turned))


def at_30(motion: Motion) -> Motion:
    """30 fps by index interpolation, as published: frame k is the recorded frame at (rounded down) its even share.

    ``int(frames * 30 / fps)`` frames, evenly from the first to the last; nothing between two frames is interpolated.
    """
    count = max(int(len(motion) * FPS / motion.fps + 1e-9), 1)
    at = np.linspace(0, len(motion) - 1, count).astype(int)
    return Motion(motion.skeleton, FPS, motion.root[at], motion.rotations[at])


# Pairs


def pairs(segments: Sequence[Segment]) -> list[Pair]:
    """All pairs of actions in a row; T-poses and A-poses are taken out first.

    Two actions make a pair where one ends within the other, or a frame apart: their overlap is the transition. And they
    make one where a stretch labelled as a transition begins at or within the first and ends at or within the second.
    A stretch that lies within another is not followed by it and gives none. Raises MotionloomError for more pairs than
    anybody labels.
    """
    known = [s for s in segments if not s.is_calibration]
    actions = [s for s in known if not s.is_transition]
    result = [
        Pair(
            (a.text, b.text),
            (a.start, min(b.start, a.end)),
            (b.start, max(a.end, b.start)),
            (max(a.end, b.start), b.end),
        )
        for a, b in permutations(actions, 2)
        if a.start < b.start <= a.end + TOUCH and a.end < b.end
    ]
    for t in (s for s in known if s.is_transition):
        before = [a for a in actions if a.start < t.start <= a.end + TOUCH and a.end <= t.end]
        after = [b for b in actions if t.start <= b.start <= t.end + TOUCH and b.end > t.end]
        if len(result) + len(before) * len(after) > _MAX_PAIRS:
            raise MotionloomError(f"a recording's labels make more than {_MAX_PAIRS:,} pairs; fetch the file again")
        result += [
            Pair((a.text, b.text), (a.start, t.start), (t.start, t.end), (t.end, b.end))
            for a, b in product(before, after)
        ]
    return list(dict.fromkeys(result))


def items(
    recording: Recording,
    motion: Motion,
    *,
    shortest: int = SHORTEST,
    longest: int = LONGEST,
    crop: np.random.Generator | None = None,
) -> Iterator[BabelItem]:
    """The examples of one recording, up to four per pair: A; A and transition; B; transition and B; each once.

    ``motion`` at 30 fps. Kept are ``shortest`` to ``longest`` + 4 frames (`trimmed` takes the rest off); with ``crop``
    longer ones are cut at random to ``longest``. The text is the action's label.
    """
    if motion.fps != FPS:
        raise MotionloomError(f"items are cut at {FPS:g} frames per second and {recording.name} has {motion.fps:g}")
    stretches = dict.fromkeys(stretch for pair in pairs(recording.segments) for stretch in _stretches(pair))
    for number, (label, start, stop, *transition) in enumerate(stretches):
        first, last = _frame(start, len(motion)), _frame(stop, len(motion))
        if last - first > longest + SLACK and crop is not None:
            first += int(crop.integers(last - first - longest + 1))
            last = first + longest
        if not shortest <= last - first <= longest + SLACK:
            continue
        flags = np.zeros(len(motion), dtype=bool)
        flags[_frame(transition[0], len(motion)) : _frame(transition[1], len(motion))] = True
        name = f"{recording.name}_{number}"
        yield BabelItem(name, label, encode(motion.frames(first, last)), flags[first:last])


def _stretches(pair: Pair) -> Iterator[tuple[str, float, float, float, float]]:
    """Text, start, end, and start and end of the transition within."""
    start, end = pair.between
    yield pair.texts[0], *pair.first, 0.0, 0.0
    yield pair.texts[1], *pair.second, 0.0, 0.0
    if end > start:
        yield pair.texts[0], pair.first[0], end, start, end
        yield pair.texts[1], start, pair.second[1], start, end


def _frame(seconds: float, frames: int) -> int:
    return round(min(max(seconds, 0.0) * FPS, frames))


def trimmed(
    item: BabelItem, rng: np.random.Generator, *, shortest: int = SHORTEST, longest: int = LONGEST
) -> BabelItem:
    """The item without 0 to 4 of its last frames, at random such that its length is within the limits."""
    least, most = max(len(item) - longest, 0), max(min(SLACK, len(item) - shortest), 0)
    stop = len(item) - int(rng.integers(least, max(most, least) + 1))
    return replace(item, features=item.features[:stop], flags=item.flags[:stop])


def load_items(
    folder: Path | str,
    split: str = "train",
    *,
    shortest: int = SHORTEST,
    longest: int = LONGEST,
    crop: bool = False,
    seed: int = 0,
    dropped: Say | None = None,
) -> list[BabelItem]:
    """All examples of one split of a BABEL folder. ``crop``: cut longer ones at random, by ``seed`` (see `items`).

    ``dropped`` is called with a sentence for each recording that is missing, broken or under half a second; without it
    the first such raises MotionloomError.
    """
    rng, result = np.random.default_rng(seed), []
    for recording in find_recordings(folder, splits=(split,)):
        try:
            motion = read_amass(find_motion(folder, recording))
            if motion.seconds < BRIEFEST:
                raise MotionloomError(f"{recording.place} is only {motion.seconds:.2f} s long; {BRIEFEST} s are needed")
            cropping = rng if crop else None
            result += items(recording, at_30(motion), shortest=shortest, longest=longest, crop=cropping)
        except MotionloomError as error:
            if dropped is None:
                raise
            dropped(str(error))
    return result


def build_set(folders: Sequence[Path | str], out: Path | str, *, seed: int = 0, progress: Say = print) -> Path:
    """The items of BABEL folders as a built set of 135 numbers, which training and measuring read; gives ``set.json``.

    Both splits that a folder has; each item is a clip with its label and its flags, longer ones cut at random by
    ``seed``. Recordings that cannot be used are dropped with a line. Raises MotionloomError where nothing is left.
    """
    out = Path(out)
    check_place(out / "set.json", folders=True)
    if any((out / "clips").glob("*.safetensors")):
        raise MotionloomError(f"{out} holds clips already; build into another folder")
    (out / "clips").mkdir(parents=True, exist_ok=True)
    counts: dict[str, int] = dict.fromkeys(SPLITS, 0)
    dropped = 0

    def drop(reason: str) -> None:
        nonlocal dropped
        dropped += 1
        progress(f"dropped: {reason}")

    for folder in map(Path, folders):
        files = _label_files(folder)
        if not files:
            find_recordings(folder)  # says what is missing
        for split in files:
            for item in load_items(folder, split, crop=True, seed=seed, dropped=drop):
                note = Note(0, len(item), "human", (item.text,))
                clip = Clip(item.name, "babel", LICENCE, split, "plain", (note,), item.features, flags=item.flags)
                write_clip(out / "clips", clip)
                counts[split] += 1
    if not any(counts.values()):
        raise MotionloomError(
            f"no item of {SHORTEST / FPS:g} to {LONGEST / FPS:g} s could be made of {', '.join(map(str, folders))}; "
            "their labels need pairs of actions, and the recordings must lie there"
        )
    write_json(out / "set.json", {"features": "babel", "clips": counts, "licences": [LICENCE], "dropped": dropped})
    progress(f"{counts['train']} items to train on, {counts['val']} to measure with: {out / 'set.json'}")
    return out / "set.json"


def statistics(items: Sequence[BabelItem]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean and standard deviation (135,) of every number over the frames of all items, as published per number."""
    if not items:
        raise MotionloomError("there are no items to take a mean of; is the split empty?")
    frames = np.concatenate([item.features for item in items]).astype(np.float64)
    return frames.mean(0).astype(np.float32), (frames.std(0) + 1e-12).astype(np.float32)
