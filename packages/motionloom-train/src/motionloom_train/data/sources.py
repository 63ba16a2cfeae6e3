"""Where takes come from: the mocap pack, a CMU download, a HumanML3D or a BABEL folder. One reader per layout."""

import csv
import gzip
import io
import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import WIDTH
from motionloom.core.files import text
from motionloom.core.files.atomic import finished
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.io.npz import read_array
from motionloom.kinematics.physics import Array
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.upright import AXES
from motionloom_train.data.paths import DAMAGED, inside
from motionloom_train.data.words import check_caption, describe_index

CMU_LICENCE = "CMU mocap: free for research and commercial use; acknowledge mocap.cs.cmu.edu, NSF EIA-0196217"
BANDAI_LICENCE = "Bandai-Namco-Research-Motiondataset, CC BY-NC 4.0: non-commercial use only"
UNKNOWN_LICENCE = "not stated: as the owner of the recordings allows"
HUMANML3D_LICENCE = "HumanML3D / AMASS: research use under the licences of AMASS and its subsets"

LATEST = 1e6
"""Seconds: no label of a recording begins later."""
_MAX_LIST = 64 << 20
MAX_MANIFEST = 64 << 20
"""Bytes of a manifest.csv."""
_MAX_LINE = 1 << 20
_PACKED = 32
"""How many times its size a packed file of captions may unfold to; text packs to a tenth."""


@dataclass(frozen=True)
class Span:
    """A part of a take and its captions."""

    start_s: float
    end_s: float
    texts: tuple[str, ...]
    kind: str
    """``human`` (a caption somebody wrote) or ``index`` (the collection's own description)."""

    def __post_init__(self) -> None:
        if not (0 <= self.start_s <= LATEST and self.end_s >= 0):  # also what is no number; the end may be infinity
            raise ValueError(f"a stretch goes from {self.start_s:g} to {self.end_s:g} seconds")
        for caption in self.texts:
            check_caption(caption)


@dataclass(frozen=True, eq=False)
class Places:
    """Where the 22 joints of a recording are, on two bodies: (frames, 22, 3) metres each."""

    positions: Array
    """Of the uniform person, the floor at y = 0."""
    own: Array
    """Of the recording's own skeleton, in its own world (`joints22`)."""
    fps: float


@dataclass(frozen=True)
class Take:
    """One recorded clip before it is turned into features."""

    name: str
    source: str
    licence: str
    split: str
    spans: tuple[Span, ...]
    read: Callable[[], Places | np.ndarray]
    """What was recorded, or finished features (frames, 263)."""
    kind: str = "capture"
    """``capture`` or ``keyed``: animated by hand, which shows what is done but not how people move."""


def find_takes(folder: Path | str, *, captions: Path | str | None = None) -> list[Take]:
    """The takes of a folder, whose layout is recognised by the files in it."""
    folder = Path(folder)
    if not folder.is_dir():
        raise MotionloomError(
            f"{folder} is not a folder; name the mocap pack, a CMU download, a HumanML3D or a BABEL folder"
        )
    if (folder / "manifest.csv").is_file():
        return list(_pack(folder))
    if (folder / "new_joint_vecs").is_dir():
        return list(_humanml3d(folder))
    takes = list(_cmu(folder, Path(captions) if captions else None))
    if not takes:
        raise MotionloomError(
            f"{folder} has no manifest.csv, no new_joint_vecs, no train.json of BABEL and no .amc or .bvh files; "
            "name the mocap pack, a HumanML3D folder, a BABEL folder or a CMU download"
        )
    return takes


def _pack(folder: Path) -> Iterator[Take]:
    """A manifest.csv with one row per clip; captions/cmu.jsonl holds what people wrote about them, if it is there."""
    spans: dict[str, list[Span]] = {}
    captions = folder / "captions" / "cmu.jsonl"
    manifest = folder / "manifest.csv"
    try:
        for row in _json_lines(captions) if captions.is_file() else ():
            span = Span(float(row["start_s"]), float(row["end_s"]), tuple(map(str, row["captions"])), "human")
            spans.setdefault(row["clip"], []).append(span)
    except DAMAGED as error:
        raise _unusable(captions, error, "mend it") from None
    try:
        lines = io.StringIO(text.read_utf8(manifest, max_bytes=MAX_MANIFEST, empty=True), newline="")
        rows = csv.DictReader(lines)
        for row in rows:
            empty = [name for name in _needed(row) if row[name] is not None and not row[name].strip()]
            yield _unread(manifest, rows.line_num, row, empty) if empty else _pack_take(folder, row, spans)
    except DAMAGED as error:
        raise _unusable(manifest, error, "mend it") from None


def _needed(row: dict[str, str]) -> tuple[str, ...]:
    """The columns that a row must fill; formats that are in metres, and AMC files, need no unit."""
    unit = () if _knows_its_unit(row["path"] or "") else ("metres_per_unit",)
    return ("path", "source", "clip", "fps", "seconds", "split", *unit)


def _knows_its_unit(path: str) -> bool:
    return path.endswith((".amc", ".npz"))


def _unread(manifest: Path, line: int, row: dict[str, str], empty: Sequence[str]) -> Take:
    """The take of a row with empty cells, which cannot be read and says why."""

    def read() -> Places:
        raise MotionloomError(f"line {line} of {manifest} has nothing under {', '.join(empty)}; fill it in")

    return Take(row["clip"].strip() or f"line_{line}", row["source"], UNKNOWN_LICENCE, "train", (), read)


def _pack_take(folder: Path, row: dict[str, str], captions: dict[str, list[Span]]) -> Take:
    path, source = inside(folder, row["path"]), row["source"]
    if row["split"] not in ("train", "val", "test"):
        raise ValueError(f"split {row['split']!r} of {row['clip']} is not train, val or test")
    spans = [] if source.startswith("bandai") else captions.get(row["clip"], [])
    index = describe_index(row["description"])
    if index and (not spans or source.startswith(("cmu", "bandai"))):  # a whole sentence is no entry of an index
        spans = [*spans, Span(0.0, float(row["seconds"]), index, "index")]
    unit = None if path.suffix == ".amc" else float(row["metres_per_unit"] or 1)
    if unit == 1 and _knows_its_unit(row["path"]):
        unit = None
    up = (row.get("up_axis") or "y").lower()
    if up not in AXES:
        raise ValueError(f"up_axis {up!r} of {row['clip']} is not one of {', '.join(AXES)}")
    read = _reader(path, fps=float(row["fps"]), unit=unit, up=up)
    kind = "keyed" if (row.get("kind") or "").startswith("hand-keyed") else "capture"
    return Take(row["clip"], source, row.get("licence") or _licence(source), row["split"], tuple(spans), read, kind)


def _licence(source: str) -> str:
    known = {"cmu": CMU_LICENCE, "bandai": BANDAI_LICENCE}
    return next((text for start, text in known.items() if source.startswith(start)), UNKNOWN_LICENCE)


def _cmu(folder: Path, captions: Path | None) -> Iterator[Take]:
    """A CMU download: NN/NN_MM.amc beside NN/NN.asf (120 frames/s), or BVH files; index text and captions if there."""
    index: dict[str, str] = {}
    for path in finished(folder, "**/*index*.txt"):
        for line in text.read_bytes(path, max_bytes=_MAX_LIST).decode("utf-8", "replace").splitlines():
            if match := re.match(r"\s*(\d+_\d+)\s+(.+)", line):
                index[match.group(1)] = match.group(2).strip()
    spoken: dict[str, list[Span]] = {}
    kinds: dict[str, set[str]] = {}
    try:
        for row in _json_lines(captions) if captions else ():
            if (match := re.search(r"CMU/\d+/(\d+_\d+)_poses", row["amass_path"])) and not row["mirrored"]:
                spoken.setdefault(match.group(1), []).append(_amass_span(row))
                kinds.setdefault(match.group(1), set()).add(str(row["split"]))
    except DAMAGED as error:
        raise _unusable(captions, error, "name HumanML3D's captions") from None
    for path in finished(folder, "**/*.amc", "**/*.bvh"):
        number = "_".join(part.zfill(2) for part in path.stem.split("_"))
        spans = [span for span in spoken.get(number, []) if span.texts]
        phrases = describe_index(index.get(number, index.get(path.stem, "")))
        if phrases:
            spans.append(Span(0.0, float("inf"), phrases, "index"))
        splits = kinds.get(number, set())
        split = next((s for s in ("test", "val") if s in splits), "train")
        source = "cmu" if re.fullmatch(r"\d+_\d+", path.stem) else "own"  # a CMU take is called 02_01
        yield Take(path.stem, source, _licence(source), split, tuple(spans), _reader(path, fps=None, unit=None))


def _amass_span(row: dict) -> Span:
    end = float("inf") if row["end_s"] is None else float(row["end_s"])
    texts = tuple(str(c["text"]) for c in row["captions"] if not c["from_s"] and not c["to_s"])
    start = 0.0 if row["start_s"] is None else float(row["start_s"])
    return Span(start, end, texts, "human")


def _humanml3d(folder: Path) -> Iterator[Take]:
    """HumanML3D as its authors lay it out: new_joint_vecs/*.npy, texts/*.txt, train.txt, val.txt, test.txt."""
    for split, name in listed_names(folder, ("train", "val", "test")):
        if name.startswith("M"):
            continue  # mirrored copies are computed here
        spans = tuple(_texts(folder / "texts" / f"{name}.txt"))
        read = partial(read_features, inside(folder, f"new_joint_vecs/{name}.npy"))
        yield Take(name, "humanml3d", HUMANML3D_LICENCE, split, spans, read)


def listed_names(folder: Path, splits: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The clips that a HumanML3D folder lists, as (split, name).

    folder: with a list ``SPLIT.txt`` for each of ``splits``, a name to a line.
    Raises `MotionloomError` for a list that is missing or holds what is no name, and for a clip that is listed twice:
    it would count twice, or be trained on and tested with.
    """
    lists: dict[str, Path] = {}
    for split in splits:
        path = folder / f"{split}.txt"
        if not path.is_file():
            raise MotionloomError(f"{path} is missing; a HumanML3D folder has train.txt, val.txt and test.txt")
        for name in text.read_utf8(path, max_bytes=_MAX_LIST, empty=True).split():
            if not re.fullmatch(r"[\w.-]{1,80}", name):
                raise MotionloomError(f"{path} lists {name[:40]!r}, which is not a name; mend it")
            if name in lists:
                raise MotionloomError(f"{path} lists {name}, which {lists[name].name} has listed already; mend them")
            lists[name] = path
            yield split, name


def _texts(path: Path) -> Iterator[Span]:
    if not path.is_file():
        return
    for line in text.read_utf8(path, max_bytes=_MAX_LIST, empty=True).splitlines():
        parts = line.split("#")
        if len(parts) != 4:
            continue
        try:
            start, end = (float(p) if p not in ("", "nan") else 0.0 for p in parts[2:])
            span = Span(start, end if end > start else float("inf"), (parts[0].strip(),), "human")
        except ValueError as error:
            raise MotionloomError(f"{path} has a line that cannot be used ({error}): {line[:60]!r}; mend it") from None
        yield span


def places_of(motion: Motion) -> Places:
    """A motion on any humanoid skeleton on both bodies; raises `MotionloomError` if it is no humanoid."""
    return Places(to_smpl22(motion).positions(), joints22(motion), motion.fps)


def _reader(path: Path, *, fps: float | None, unit: float | None, up: str | None = None) -> Callable[[], Places]:
    return lambda: places_of(load(path, fps=fps, unit=unit, up=up))


def read_features(path: Path) -> np.ndarray:
    """An array of features (frames, 263), as float32; raises MotionloomError for any other, and for NaN in it."""
    array = read_array(path)
    if array.ndim != 2 or array.shape[1] != WIDTH or array.dtype.kind != "f" or not np.isfinite(array).all():
        raise MotionloomError(
            f"{path} is not an array of finite features (frames, {WIDTH}), but {array.dtype} of the shape "
            f"{array.shape}; fetch it again"
        )
    return np.array(array, dtype=np.float32)


def _json_lines(path: Path) -> Iterator[dict]:
    if not path.is_file():
        raise MotionloomError(f"there is no caption file {path}")
    packed = path.suffix == ".gz"
    room = max(_MAX_LIST, _PACKED * path.stat().st_size if packed else text.MAX_BYTES)
    try:
        with gzip.open(path, "rb") if packed else path.open("rb") as lines:
            number = 0
            while line := lines.readline(_MAX_LINE):
                number += 1
                room -= len(line)
                if room < 0 or len(line) == _MAX_LINE:
                    raise MotionloomError(f"{path} has a line of 1 MB or more, or unfolds far beyond its size")
                yield text.parse_json(line, f"{path}, line {number}")
    except (OSError, EOFError, zlib.error) as error:  # damaged, cut short
        raise MotionloomError(f"{path} cannot be read ({' '.join(str(error).split())[:120]}); fetch it again") from None


def _unusable(path: Path | None, error: Exception, advice: str) -> MotionloomError:
    """What is wrong with a row, in one short sentence; an error of ours is returned as it is."""
    if isinstance(error, MotionloomError):
        return error
    reason = " ".join(str(error).split())  # of bytes that are no text the repr would hold them all
    return MotionloomError(f"{path} has a row that cannot be used ({type(error).__name__}: {reason[:120]}); {advice}")
