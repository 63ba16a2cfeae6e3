"""Human3.6M, HumanEva-I and AMASS as prediction is measured on them, out of the files that are usual.

None of the data is here, and each has a licence of its own. Files have +Z up; positions are handed out with +Y up
(x, y, z become y, z, x), which `Layout.encode` of a layout with ``z_up`` undoes. The root keeps its way in the
recordings; the layouts drop it, as published (Yuan and Kitani 2020, DLow; Barquero et al. 2023, BeLFusion for AMASS).

No model is to be chosen on the test part: what the published protocols train on is split further. See `held_out`.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.files import text
from motionloom.core.files.atomic import finished
from motionloom.io import npz
from motionloom_lab.papers.amass import AMASS_LICENCE, is_amass, read_amass
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT, HUMANEVA_LAYOUT, TABLES
from motionloom_lab.papers.plain_pickle import Tables, read_tables
from motionloom_lab.papers.readers import find_takes
from motionloom_train.data.prediction import Protocol, Recording, checked, read_cmu, read_folder
from motionloom_train.data.progress import Say, silent

SPLITS = ("train", "val", "test")
NAMES = ("h36m", "humaneva", "amass", "cmu", "own")
H36M_LICENCE = "Human3.6M: academic use only, under the licence of its owners (Ionescu et al. 2014)"
HUMANEVA_LICENCE = "HumanEva-I: research use only, under the licence of its owners (Sigal et al. 2010)"
H36M_TRAIN, H36M_TEST = ("S1", "S5", "S6", "S7", "S8"), ("S9", "S11")
H36M_JOINTS = (0, 1, 2, 3, 6, 7, 8, 12, 13, 14, 15, 17, 18, 19, 25, 26, 27)
"""The 17 of the file's 32 joints that are kept."""
H36M_SPEEDS: dict[str, float] = TABLES["h36m"]["speeds"]
"""Mean displacement of a joint by action, metres per frame at 50 fps: what CMD compares with (BeLFusion)."""
_ALIASES = {"TakingPhoto": "Photo", "WalkingDog": "WalkDog", "WalkingTogether": "WalkTogether"}
HUMANEVA_DROPPED = {
    ("Train/S3", "Walking 1 chunk0"),
    ("Train/S3", "Walking 1 chunk2"),
    ("Validate/S3", "Walking 1 chunk4"),
}
"""Chunks with a bad head marker."""
H36M_FRAMES = 125
"""Frames of a window of Human3.6M: 25 are observed and 100 predicted."""
RETARGETED = "amass_retargeted.npy"
MAX_RETARGETED = 4 << 30
FARTHEST = 100.0
"""Metres from the middle of the room beyond which numbers are no metres."""


def read_h36m(path: Path | str, *, splits: tuple[str, ...] = SPLITS, say: Say = silent) -> Protocol:
    """Human3.6M out of ``data_3d_h36m.npz``: 17 of 32 joints at 50 Hz, 25 frames observed and 100 predicted.

    Train on S1, S5, S6, S7, S8 less what is held out for validation (`held_out`), test on S9 and S11: windows start at
    frames 0, 25, 50 ... and the one that would end with the last frame is left out, as published (5,168 windows of the
    whole file). A class is an action without its number. ``say`` is called with subjects that are missing.
    Raises MotionloomError for a file that is missing, damaged, or of another form.
    """
    table = _subjects(path, H36M_TRAIN + H36M_TEST, "Human3.6M", say)
    recordings: list[Recording] = []
    for number, subject in enumerate(H36M_TRAIN + H36M_TEST):
        actions = sorted(table.get(subject, {}))
        val = held_out(len(actions), number)
        for order, action in enumerate(actions):
            split = "test" if subject in H36M_TEST else "val" if order in val else "train"
            if split in splits:
                places = _placed(table[subject][action], 32, f"{path}: {subject}, {action}")[:, H36M_JOINTS]
                recordings.append(Recording(f"{subject}/{action}", subject, h36m_class(action), split, places))
    return checked(
        path,
        Protocol("h36m", 50.0, 25, 100, H36M_LAYOUT, tuple(recordings), H36M_LICENCE, speeds=dict(H36M_SPEEDS)),
    )


def read_retargeted(path: Path | str, *, splits: tuple[str, ...] = SPLITS) -> Protocol:
    """``amass_retargeted.npy``: AMASS on the 17 joints of Human3.6M as HumanMAC's zero-shot experiment reads it.

    An array (clips, 125, 17, 3) in metres, +Z up, axes of length 1 anywhere left out: 25 frames are observed and 100
    predicted, and every clip is one test window. There is no other split. Raises MotionloomError for another form.
    """
    array = npz.read_array(path, max_bytes=MAX_RETARGETED)
    joints = H36M_LAYOUT.joints
    clips = array.reshape(tuple(n for n in array.shape if n > 1)) if array.ndim > 4 else array
    clips = clips[None] if clips.ndim == 3 else clips
    if clips.ndim != 4 or not len(clips) or len(clips[0]) < H36M_FRAMES or "test" not in splits:
        raise MotionloomError(
            f"{path} is an array of the shape {array.shape}, and must be (clips, {H36M_FRAMES} or more, {joints}, 3): "
            "it is tested on, and holds nothing to train on"
        )
    width = len(str(len(clips) - 1))
    recordings = tuple(
        Recording(f"amass/{k:0{width}d}", "amass", "amass", "test", _placed(clip, joints, f"{path}: clip {k}"))
        for k, clip in enumerate(clips)
    )
    listed = tuple((recording.name, 0) for recording in recordings)
    name = "amass, retargeted by HumanMAC"
    return Protocol(name, 50.0, 25, 100, H36M_LAYOUT, recordings, AMASS_LICENCE, listed=listed)


def h36m_class(action: str) -> str:
    """``Walking 1`` is ``Walking``; the data set's own longer names are the benchmark's."""
    name = action.rstrip("0123456789")
    name = name[:-1] if name.endswith((" ", "_")) else name
    return _ALIASES.get(name, name)


def read_humaneva(path: Path | str, *, splits: tuple[str, ...] = SPLITS, say: Say = silent) -> Protocol:
    """HumanEva-I out of ``data_3d_humaneva15.npz``: 15 joints at 60 Hz, 15 frames observed and 60 predicted.

    Train on Train/S1 to S3 less what is held out (`held_out`), test on Validate/S1 to S3: the same three people, as
    published. Three chunks with a bad marker and all shorter than 75 frames are dropped; one of exactly 75 is a window
    for training and, as a window that ends with the last frame, none for the test. Raises as `read_h36m`.
    """
    subjects = tuple(f"{part}/S{number}" for part in ("Train", "Validate") for number in (1, 2, 3))
    table = _subjects(path, subjects, "HumanEva-I", say)
    recordings: list[Recording] = []
    for number, subject in enumerate(subjects):
        whole = table.get(subject, {})
        good = sorted(a for a in whole if (subject, a) not in HUMANEVA_DROPPED and whole[a].shape[:1] >= (75,))
        val = held_out(len(good), number)
        for order, action in enumerate(good):
            split = "test" if subject.startswith("Validate") else "val" if order in val else "train"
            if split in splits:
                places = _placed(whole[action], 15, f"{path}: {subject}, {action}")
                label = re.sub(r"( \d+)?( chunk\d+)?$", "", action)
                recordings.append(Recording(f"{subject}/{action}", subject.split("/")[1], label, split, places))
    return checked(path, Protocol("humaneva", 60.0, 15, 60, HUMANEVA_LAYOUT, tuple(recordings), HUMANEVA_LICENCE))


def held_out(actions: int, subject: int) -> set[int]:
    """Which of a training subject's actions, in order of name, are kept for validation: one in ten, at least one of
    two or more, and others for each subject: with 30 actions in 15 pairs, five subjects hold out every class once."""
    count = max(1, actions // 10) if actions > 1 else 0
    return {(2 * subject + 1 + 10 * k) % actions for k in range(count)}


def _subjects(path: Path | str, names: tuple[str, ...], title: str, say: Say) -> Tables:
    table = read_tables(path, "positions_3d")
    missing = [name for name in names if name not in table]
    if len(missing) == len(names):
        has = ", ".join(text.shown(name, 20) for name in list(table)[:8]) or "nobody"
        raise MotionloomError(f"{path} has none of the subjects {', '.join(names)} of {title}; it has {has}")
    if missing:
        say(f"{path} lacks {', '.join(missing)}, so figures on it are not those of the whole of {title}")
    return table


def _placed(array: np.ndarray, joints: int, where: str) -> NDArray[np.float32]:
    """(frames, joints, 3) with +Z up, checked, to +Y up."""
    if array.ndim != 3 or array.shape[1:] != (joints, 3) or not len(array) or array.dtype.kind != "f":
        raise MotionloomError(
            f"{where} is {array.dtype} of the shape {array.shape} and must be numbers of (frames, {joints}, 3)"
        )
    if not (np.abs(array) <= FARTHEST).all():
        raise MotionloomError(
            f"{where} has places that are not finite or over {FARTHEST:g} away; they must be finite and in metres"
        )
    return array.astype(np.float32)[..., [1, 2, 0]]


# Which one it is


def find_protocol(
    path: Path | str,
    *,
    name: str | None = None,
    splits: tuple[str, ...] = SPLITS,
    segments: Path | str | None = None,
    fps: float = 30.0,
    say: Say = silent,
) -> Protocol:
    """The data set that a file or folder holds, recognised by what is in it; ``name`` (one of `NAMES`) wins.

    ``segments``: a list of test windows for AMASS. ``fps``: for a folder of a user's own files.
    Raises MotionloomError where nothing or two data sets are recognised, and as the readers do.
    """
    path = Path(path)
    if name is not None and name not in NAMES:
        raise MotionloomError(f"there is no data set {text.shown(name)} for prediction; name one of {', '.join(NAMES)}")
    kind, place = _recognised(path, name)
    if kind == "amass" and place.suffix == ".npy":
        return read_retargeted(place, splits=splits)
    if segments is not None and kind != "amass":
        raise MotionloomError(f"a list of test segments is for AMASS, and {path} is read as {kind}; leave it out")
    if kind == "amass":
        return read_amass(place, splits=splits, segments=segments, say=say)
    if kind == "own":
        return read_folder(place, fps=fps, say=say)
    return {"h36m": read_h36m, "humaneva": read_humaneva, "cmu": read_cmu}[kind](place, splits=splits, say=say)


def _recognised(path: Path, name: str | None) -> tuple[str, Path]:
    if not path.exists():
        raise MotionloomError(f"there is no {path}; name a file or folder of one of {', '.join(NAMES)}")
    if not path.is_dir():
        if name in (None, "h36m", "humaneva") and path.suffix == ".npz":
            return name or _file_kind(path), path
        if name in (None, "amass") and path.suffix == ".npy":
            return "amass", path
        raise MotionloomError(
            f"{path} is a file and is not data_3d_h36m.npz, data_3d_humaneva15.npz or {RETARGETED}; name one of those "
            "or a folder"
        )
    if name in (None, "amass") and (path / RETARGETED).is_file():
        return "amass", path / RETARGETED
    if name in ("amass", "cmu", "own"):
        return name, path
    files = [
        (kind, place)
        for kind in ("h36m", "humaneva")
        if name in (None, kind)
        for place in finished(path, f"data_3d_{kind}*.npz")
        if not place.stem.endswith("_test")
    ]
    if len(files) > 1:
        names = " and ".join(place.name for _, place in files[:3])
        raise MotionloomError(f"{path} has {names}; name the one that is meant")
    if files:
        return files[0]
    if name is not None:
        raise MotionloomError(f"{path} has no data_3d_{name}*.npz; name the file itself")
    pack = (path / "manifest.csv").is_file()
    if not pack and is_amass(path):
        return "amass", path
    cmu = [take.source == "cmu" for take in find_takes(path)]
    return "cmu" if (any(cmu) if pack else all(cmu)) else "own", path


def _file_kind(path: Path) -> str:
    for kind in ("h36m", "humaneva"):
        if kind in path.name.lower():
            return kind
    subjects = set(read_tables(path, "positions_3d"))
    if any(name.startswith(("Train/", "Validate/")) for name in subjects):
        return "humaneva"
    if subjects & set(H36M_TRAIN + H36M_TEST):
        return "h36m"
    names = ", ".join(text.shown(name, 20) for name in sorted(subjects)[:8]) or "nobody"
    raise MotionloomError(f"{path} has the subjects of neither Human3.6M nor HumanEva-I; it has {names}")
