"""AMASS as stochastic prediction is measured on it: the protocol of BeLFusion (Barquero et al., ICCV 2023).

Reads AMASS as distributed, or joint places computed from it with the body model; see `read_amass`.
"""

import csv
import io
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.files import text
from motionloom.core.files.atomic import finished
from motionloom.core.files.text import plain_json
from motionloom.io import npz
from motionloom_lab.papers import babel
from motionloom_lab.papers.benchmark_layouts import TABLES
from motionloom_train.data.paths import DAMAGED
from motionloom_train.data.prediction import Protocol, Recording, checked
from motionloom_train.data.progress import Say, silent

AMASS_LAYOUT = replace(SMPL_LAYOUT, across=(), root=False, z_up=True)
"""21 joints from the root, +Z up, no way through the world."""
AMASS_FPS, OBSERVED, FUTURE = 60.0, 30, 120
AMASS_LICENCE = "AMASS: non-commercial research, under its own licence and those of its subsets"
UNIFORM = "joint places are those of the uniform person's bones, not of the body model"
AMASS_SETS: dict[str, list[str]] = TABLES["amass"]["sets"]
"""Whole data sets by split."""
AMASS_SPEEDS: dict[str, float] = TABLES["amass"]["speeds"]
"""Mean displacement of a joint by data set, metres per frame at 60 fps: what CMD compares with (BeLFusion)."""
_SETS = {name.lower(): name for names in AMASS_SETS.values() for name in names} | TABLES["amass"]["old_names"]
_SPLITS = {name: split for split, names in AMASS_SETS.items() for name in names}
_FARTHEST = 1e3
_MAX_LIST = 16 << 20


def set_name(folder: str) -> str | None:
    """The data set that a folder of AMASS is called after, old and new names alike; None for any other name."""
    return _SETS.get("".join(letter for letter in folder.lower() if letter.isalnum()))


def is_amass(folder: Path) -> bool:
    """Whether a folder (or ``amass`` in it) has folders of AMASS's data sets with arrays in them."""
    return any(finished(place, "**/*.np[yz]") for _, place in _set_folders(folder))


def read_amass(
    folder: Path | str,
    *,
    splits: tuple[str, ...] = ("train", "val", "test"),
    segments: Path | str | None = None,
    say: Say = silent,
) -> Protocol:
    """AMASS: 21 joints at 60 Hz, 30 frames observed and 120 predicted; whole data sets for each split; class: data set.

    The folder has AMASS's data sets as distributed (``<data set>/<subject>/<recording>_poses.npz``, SMPL+H G). The body
    model has a licence of its own and is not here, so **these give the joints of the uniform person**, turned as
    recorded: figures on them are not those of published systems, as the protocol's licence line notes. Or it has
    the places computed with the body model, under the same names: ``.npy`` of (frames, 22, 3), or ``.npz``
    with ``positions`` or ``joints`` of that shape and, if it is not 60, ``fps``; metres, +Z up. Where a recording is
    there in both forms the places are read. Every ``round(fps / 60)``-th frame is kept, as published.

    Tests predict from frame 180 on and then every 120 frames (windows begin at 150, 270 ...), a window that would end
    with the last frame left out. ``segments`` names the windows instead: a .csv as published (``dataset``, ``file``,
    ``file_idx``, ``pred_init``, ``pred_end``), a .csv with ``file`` and ``first`` (first observed frame), or a .json
    list of such pairs; windows that are not there are reported and left out. Recordings of the same name in one data
    set (GRAB) take the list's rows in the order of their paths.

    Raises MotionloomError for a folder without data sets and for a list that cannot be used; single recordings that
    cannot be read are left out and reported.
    """
    folder = Path(folder)
    sets = [(name, place) for name, place in _set_folders(folder) if _SPLITS[name] in splits]
    if not sets:
        zarr = next(folder.glob("*/poses.zarr"), None) is not None
        raise MotionloomError(
            f"{folder} has no folder of {', '.join(splits)} called after a data set of AMASS, such as CMU or DanceDB"
            f"{'; .zarr folders are not read, save their arrays as .npy' if zarr else ''}"
        )
    recordings: list[Recording] = []
    uniform = False
    for name, place in sets:
        say(f"reading {name}")
        for recording, modelled in _recordings(name, place, say):
            recordings.append(recording)
            uniform |= not modelled
    licence = f"{AMASS_LICENCE}; {UNIFORM}" if uniform else AMASS_LICENCE
    test = [r for r in recordings if r.split == "test"]
    listed = _listed(Path(segments), test, say) if segments is not None and "test" in splits else ()
    protocol = Protocol(
        "amass",
        AMASS_FPS,
        OBSERVED,
        FUTURE,
        AMASS_LAYOUT,
        tuple(recordings),
        licence,
        threshold=0.4,
        first=150,
        stride=120,
        listed=listed,
        speeds=dict(AMASS_SPEEDS),
    )
    return checked(folder, protocol)


def _set_folders(folder: Path) -> list[tuple[str, Path]]:
    inner = folder / "amass"
    sets = [
        (name, place)
        for base in ((inner, folder) if inner.is_dir() else (folder,))
        for place in sorted(base.iterdir())
        if place.is_dir() and (name := set_name(place.name)) is not None
    ]
    return list({name: (name, place) for name, place in reversed(sets)}.values())[::-1]


# Recordings


def _recordings(name: str, place: Path, say: Say) -> Iterator[tuple[Recording, bool]]:
    files: dict[str, Path] = {}
    for path in sorted(finished(place, "**/*.np[yz]"), key=lambda p: (p.suffix == ".npy", p)):  # .npy last: it wins
        if not path.stem.endswith("_stagei") and path.stem != "shape":  # files of persons, not of motions
            files[path.relative_to(place).with_suffix("").as_posix()] = path
    for key in sorted(files):
        try:
            places, modelled = _places(files[key])
        except MotionloomError as error:
            say(f"left out {name}/{key}: {error}")
            continue
        subject = key.split("/")[-2] if "/" in key else key
        yield Recording(f"{name}/{key}", f"{name}/{subject}", name, _SPLITS[name], places), modelled


def _places(path: Path) -> tuple[NDArray[np.float32], bool]:
    """(frames, 22, 3) metres, +Y up, at 60 Hz, and whether they are of the body model."""
    if path.suffix == ".npz" and "poses" in _members(path):
        motion = babel.read_amass(path)
        step = _step(motion.fps)
        positions = replace(motion, root=motion.root[::step], rotations=motion.rotations[::step]).positions()
        return (positions[..., [2, 1, 0]] * [-1.0, 1.0, 1.0]).astype(
            np.float32
        ), False  # the reader keeps x, this y, z, x
    places, fps = _positions_of(path)
    if places.ndim != 3 or places.shape[1:] != (22, 3) or not len(places) or places.dtype.kind != "f":
        raise MotionloomError(
            f"{path} holds {places.dtype} of the shape {places.shape} and must hold numbers of (frames, 22, 3)"
        )
    if not (1 <= fps <= 1000) or not (np.abs(places) <= _FARTHEST).all():
        raise MotionloomError(f"{path} has a frame rate or places that are not finite or beyond what people do")
    return places[:: _step(fps)].astype(np.float32)[..., [1, 2, 0]], True


def _positions_of(path: Path) -> tuple[np.ndarray, float]:
    if path.suffix == ".npz":
        arrays = npz.read_arrays(path, only=("positions", "joints", "fps", "rotations"))
        places = arrays.get("positions", arrays.get("joints"))
        if places is None or "rotations" in arrays:  # with rotations it is this project's own file, with +Y up
            raise MotionloomError(f"{path} has no positions or joints (frames, 22, 3) alone, with +Z up")
        rate = arrays.get("fps", np.array(AMASS_FPS))
        if rate.size != 1 or rate.dtype.kind not in "fiu":
            raise MotionloomError(f"{path} has a frame rate that is no number")
        return places, float(rate.reshape(()))
    return npz.read_array(path), AMASS_FPS


def _members(path: Path) -> set[str]:
    """The names of an archive's arrays, without reading them; none where it is damaged."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {name.removesuffix(".npy") for name in archive.namelist()}
    except (OSError, ValueError, RuntimeError, NotImplementedError, zipfile.BadZipFile):
        return set()


def _step(fps: float) -> int:
    return max(1, round(fps / AMASS_FPS))


# Lists of test windows


def _listed(path: Path, recordings: Sequence[Recording], say: Say) -> tuple[tuple[str, int], ...]:
    """The windows of a list that there are, by recording and first frame."""
    by_key: dict[str, list[Recording]] = {}
    for r in recordings:
        for key in {r.name, f"{r.action}/{r.name.rsplit('/', 1)[-1]}"}:
            by_key.setdefault(key, []).append(r)
    rows = _rows(path)
    counts: Counter[tuple[str, int]] = Counter()
    windows: list[tuple[str, int]] = []
    for key, first in rows:
        there = [r.name for r in by_key.get(key, ()) if len(r.positions) >= first + OBSERVED + FUTURE]
        if counts[key, first] < len(there):
            windows.append((there[counts[key, first]], first))
        counts[key, first] += 1
    if not windows:
        raise MotionloomError(f"none of the {len(rows)} windows of {path} is in the test data sets that are there")
    if len(windows) < len(rows):
        say(f"{len(rows) - len(windows)} of the {len(rows)} windows of {path.name} are not there and are left out")
    return tuple(windows)


def _rows(path: Path) -> list[tuple[str, int]]:
    """``data set/recording`` and first observed frame of each window that a list names."""
    data = text.read_text(path, max_bytes=_MAX_LIST).decode("utf-8", "replace")
    try:
        pairs = plain_json(data) if path.suffix == ".json" else list(_csv_rows(data))
        rows = [(str(file), int(first)) for file, first in pairs]
        if not rows or any(first < 0 for _, first in rows):
            raise ValueError("it has no windows, or one that begins before its recording")
    except DAMAGED as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(
            f"{path} is no list of test windows ({type(error).__name__}: {reason}); it needs dataset, file and "
            "pred_init, or file and first, of each"
        ) from None
    return [(_key(file), first) for file, first in rows]


def _csv_rows(data: str) -> Iterator[tuple[str, int]]:
    for row in csv.DictReader(io.StringIO(data)):
        if "pred_init" not in row:
            yield row["file"], int(row["first"])
            continue
        first = int(row["pred_init"])
        if row.get("pred_end") and int(row["pred_end"]) != first + FUTURE - 1:
            raise ValueError(f"it predicts frames {first} to {row['pred_end']}, and {FUTURE} are predicted here")
        yield f"{row['dataset']}/{row['file']}", first - OBSERVED


def _key(file: str) -> str:
    first, slash, rest = file.removesuffix(".npz").removesuffix(".npy").partition("/")
    return f"{set_name(first) or first}{slash}{rest}"
