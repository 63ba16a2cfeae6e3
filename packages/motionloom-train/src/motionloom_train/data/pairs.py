"""Two people in one world: pairs of recordings with captions, for learning how people move together.

Readers for the pack's dancing couples and for a user's own pairs of BVH files (`lab.papers.threedpw` is one for 3DPW).
All give the uniform person at 20 frames per second.

**One world for two bodies.** Bones become uniform, so people of other legs take other steps; the ground plane must
shrink or grow alike for both, or the distance between them would mean something else for each. Heights and limbs take
each person's own ratio (the uniform legs over theirs); places on the ground take one common ratio, the uniform legs
over the mean of both people's legs. Where both have equal legs nothing slides; where they differ by a share d of their
mean, each one's planted feet slide by about d / 2 of how fast that person travels.
"""

import io
import re
from collections.abc import Iterator
from csv import DictReader
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import finished
from motionloom.core.files.text import read_utf8
from motionloom.core.reading import read_bytes
from motionloom.core.skeleton import SMPL22
from motionloom.io import load
from motionloom.kinematics.physics import Array
from motionloom.kinematics.shared_world import together
from motionloom_train.data import sources
from motionloom_train.data.paths import DAMAGED, inside
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.words import mirror_text

_MAX_CAPTIONS = 1 << 20
_LONGEST_CAPTION = 1000
_MIRROR = list(SMPL22.mirror_pairs())
_COUPLES = {
    "salsa": (
        "two people dance salsa together",
        "a couple dances salsa",
        "two people dance the salsa with each other",
        "a man and a woman dance salsa holding hands",
        "two dancers perform a salsa",
        "two people dance together",
    )
}
"""What a couple does, by a word of the pack's description: the captions there speak of one person only."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two people in one world on one clock."""

    name: str
    split: str
    """``train``, ``val`` or ``test``."""
    captions: tuple[str, ...]
    """What both do together; empty where nobody described it."""
    source: str
    licence: str
    positions: Array
    """(2, frames, 22, 3) metres at 20 frames per second: uniform people, +Y up, the floor at y = 0."""

    def __post_init__(self) -> None:
        shape = self.positions.shape
        if len(shape) != 4 or shape[0] != 2 or shape[2:] != (22, 3) or not np.isfinite(self.positions).all():
            raise MotionloomError(f"{self.name}: a pair needs finite positions (2, frames, 22, 3); got {shape}")

    @property
    def frames(self) -> int:
        """Frames at 20 per second."""
        return self.positions.shape[1]


def find_pairs(folder: Path | str, *, captions: bool = True, say: Say = silent) -> list[Pair]:
    """The pairs of a folder, whose layout is recognised by the files in it; `captions` as in `read_pair_folder`."""
    folder = Path(folder)
    if not folder.is_dir():
        raise MotionloomError(
            f"{folder} is not a folder; name one with NAME_a.bvh and NAME_b.bvh files, the mocap pack, or 3DPW"
        )
    if (folder / "manifest.csv").is_file():
        return read_pack_pairs(folder, say=say)
    return read_pair_folder(folder, captions=captions)


# The pack ------------------------------------------------------------------------------------------------------------


def read_pack_pairs(folder: Path | str, *, say: Say = silent) -> list[Pair]:
    """The couples of a folder with manifest.csv: rows that name each other as ``partner``, in the manifest's splits."""
    folder = Path(folder)
    manifest = folder / "manifest.csv"
    try:
        lines = io.StringIO(read_utf8(manifest, max_bytes=sources.MAX_MANIFEST, empty=True), newline="")
        rows = {row["path"]: row for row in DictReader(lines)}
        couples = [
            (row, rows[row["partner"]]) for row in rows.values() if row.get("partner") and row["path"] < row["partner"]
        ]
        pairs = []
        for first, second in couples:
            say(f"reading {first['clip']} and {second['clip']}")
            pairs.append(_pack_pair(folder, first, second))
    except DAMAGED as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(f"{manifest} has no pairs that can be read ({type(error).__name__}: {reason})") from None
    if not pairs:
        raise MotionloomError(f"{manifest} has no rows that name each other as partner; it holds no pairs")
    return pairs


def _pack_pair(folder: Path, first: dict[str, str], second: dict[str, str]) -> Pair:
    if first["split"] != second["split"] or first["split"] not in ("train", "val", "test"):
        raise ValueError(f"{first['clip']} and {second['clip']} are in no common split")
    motions = [
        load(inside(folder, row["path"]), fps=float(row["fps"]), unit=float(row["metres_per_unit"]), up="y")
        for row in (first, second)
    ]
    name = f"{first['clip']}+{second['clip']}"
    words = first["description"]
    known = next((texts for word, texts in _COUPLES.items() if word in words.lower()), ())
    captions = known or ((f"two people together: {words}",) if words else ())
    licence = first.get("licence") or (sources.CMU_LICENCE if first["source"] == "cmu" else sources.UNKNOWN_LICENCE)
    return Pair(name, first["split"], captions, first["source"], licence, together(motions[0], motions[1], name=name))


# A user's own --------------------------------------------------------------------------------------------------------


def read_pair_folder(folder: Path | str, *, captions: bool = True) -> list[Pair]:
    """A user's own pairs: ``NAME_a.bvh`` with ``NAME_b.bvh``, or ``NAME/a.bvh`` with ``NAME/b.bvh``.

    ``captions.txt`` beside them has the captions: ``NAME: words`` or NAME, a tab and words on each line, any number
    of lines for a name; blank lines and lines that begin with # are skipped. With ``captions`` every pair needs one;
    without it the file may be absent (completion needs no words). Of ten or more pairs in the order of their names the
    fifth of every ten is for validation and the tenth for test; fewer are all for training.

    Raises MotionloomError with the names of the files: a partner missing, both files the same, other lengths or frame
    rates, people who never come near each other, captions missing or of no pair.
    """
    folder = Path(folder)
    files = _pair_files(folder)
    texts = _captions(folder, set(files), needed=captions)
    splits = {4: "val", 9: "test"} if len(files) >= 10 else {}
    return [
        _own_pair(name, files[name], splits.get(number % 10, "train"), texts.get(name, ()))
        for number, name in enumerate(sorted(files))
    ]


def _pair_files(folder: Path) -> dict[str, tuple[Path, Path]]:
    files: dict[str, dict[str, Path]] = {}
    for path in finished(folder, "*.bvh", "*/*.bvh"):
        if path.parent == folder and (match := re.fullmatch(r"(.+)_([ab])", path.stem)):
            name, person = match.groups()
        elif path.parent != folder and path.stem in ("a", "b"):
            name, person = path.parent.name, path.stem
        else:
            continue
        if person in files.setdefault(name, {}):
            raise MotionloomError(
                f"{folder} has the pair {name} twice, as {name}_{person}.bvh and {name}/{person}.bvh; keep one"
            )
        files[name][person] = path
    for people in files.values():
        if len(people) == 1:
            ((person, path),) = people.items()
            other = path.with_name(path.name.removesuffix(f"{person}.bvh") + ("b" if person == "a" else "a") + ".bvh")
            raise MotionloomError(f"{path} has no partner: {other} is missing; add it or take {path.name} away")
    if not files:
        raise MotionloomError(
            f"{folder} has no pairs; name them NAME_a.bvh and NAME_b.bvh, or NAME/a.bvh and NAME/b.bvh"
        )
    return {name: (people["a"], people["b"]) for name, people in files.items()}


def _captions(folder: Path, names: set[str], *, needed: bool) -> dict[str, tuple[str, ...]]:
    path = folder / "captions.txt"
    if not path.is_file():
        if needed:
            raise MotionloomError(
                f"there is no {path}; it says what each pair does, as in '{min(names)}: two people dance'"
            )
        return {}
    lines = read_utf8(path, max_bytes=_MAX_CAPTIONS, empty=True).splitlines()
    texts: dict[str, tuple[str, ...]] = {}
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            name, words = _caption(line, names, f"{path}, line {number}")
            texts[name] = (*texts.get(name, ()), words)
    silent = sorted(names - set(texts))
    if silent:
        more = f" and {len(silent) - 1} more" if len(silent) > 1 else ""
        raise MotionloomError(f"{path} has no line for the pair {silent[0]}{more}; add '{silent[0]}: what they do'")
    return texts


def _caption(line: str, names: set[str], place: str) -> tuple[str, str]:
    name, mark, words = line.partition("\t") if "\t" in line else line.partition(":")
    name, words = name.strip(), " ".join(words.split())
    if not mark or not words:
        raise MotionloomError(f"{place} has no caption: {line[:60]!r}; write 'NAME: what they do'")
    if len(words) > _LONGEST_CAPTION or not words.isprintable():
        raise MotionloomError(f"{place} has a caption that is no line of at most {_LONGEST_CAPTION} printable letters")
    if name not in names:  # names are looked up only: none is used as a path
        has = ", ".join(sorted(names)[:3]) + (" and others" if len(names) > 3 else "")
        raise MotionloomError(f"{place} names {name[:60]!r}, which is no pair of that folder; it has {has}")
    return name, words


def _own_pair(name: str, files: tuple[Path, Path], split: str, captions: tuple[str, ...]) -> Pair:
    first, second = files
    motions = load(first), load(second)
    label = f"{first} and {second}"
    if read_bytes(first) == read_bytes(second):
        raise MotionloomError(f"{label} are the same file; a pair needs a recording of each person")
    return Pair(name, split, captions, "own", sources.UNKNOWN_LICENCE, together(*motions, name=label))


# Parts and variants --------------------------------------------------------------------------------------------------


def crop(pair: Pair, start: int, frames: int) -> Pair:
    """Frames ``start`` to ``start + frames``; the whole pair is allowed. Places stay in the pair's world."""
    if start < 0 or frames < 1 or start + frames > pair.frames:
        raise MotionloomError(f"{pair.name}: frames {start} to {start + frames} are not in its {pair.frames}")
    return replace(pair, positions=pair.positions[:, start : start + frames])


def windows(pair: Pair, frames: int, stride: int) -> Iterator[Pair]:
    """All crops of ``frames`` that begin every ``stride`` frames; none where the pair is shorter."""
    return (crop(pair, start, frames) for start in range(0, pair.frames - frames + 1, stride))


def mirrored(pair: Pair) -> Pair:
    """Left and right exchanged, in the captions too; its name begins with M."""
    positions = pair.positions[:, :, _MIRROR] * np.array([-1.0, 1.0, 1.0])
    captions = tuple(mirror_text(text) for text in pair.captions)
    return replace(pair, name="M" + pair.name, captions=captions, positions=positions)
