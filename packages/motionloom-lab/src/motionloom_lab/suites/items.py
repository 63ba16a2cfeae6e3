"""Real motion that suites compare with: clips and captioned stretches, and whether data hold what a suite measures.

They come out of a built set, a folder of recordings, or HumanML3D as its authors lay it out (with its tokens).
"""

import csv
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import BABEL, HUMANML3D, Representation, named
from motionloom.core.files.atomic import finished
from motionloom.core.files.text import plain_json, read_utf8
from motionloom.core.reading import read_bytes
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.papers.readers import find_pairs, find_takes
from motionloom_lab.suites.protocol import MOST_ITEMS, Selection
from motionloom_train.data.build import clips_of
from motionloom_train.data.clips import Clip, read_clip
from motionloom_train.data.pairs import Pair
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.sources import Take, listed_names, read_features
from motionloom_train.data.words import check_caption

LONGEST = 30 * FPS
"""Frames: a collection's one line about a longer clip describes too little of any part of it."""
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
    empty = True
    for clip in plain_clips(folder):
        for real in _stretches(clip):
            empty = False
            yield real
    if empty:
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
            continue  # too short or damaged: `data build` reports which


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


SPARE = 4
"""Frames above the longest length that are cut off; a stretch that is longer still is left out."""
_MAX_TEXT = 64 << 20


@dataclass(frozen=True, eq=False)
class Item:
    """A stretch of a recording and its captions."""

    name: str
    source: str
    split: str
    captions: tuple[Caption, ...]
    features: np.ndarray
    """(frames, numbers) float32, not standardised, at the rate of their representation."""


def fitting(folder: Path | str, selection: Selection | None) -> Selection:
    """What is selected by default: HumanML3D's test set, BABEL's validation set, of others `Selection`'s defaults."""
    if built_of(folder) is BABEL:
        chosen = selection or Selection(splits=("val",))
        return replace(chosen, sources=(), shortest=BABEL.shortest, longest=BABEL.longest)
    if not (Path(folder) / "new_joint_vecs").is_dir():
        return selection or Selection()
    return replace(selection or Selection(splits=("test",)), sources=("humanml3d",))


def built_of(folder: Path | str) -> Representation | None:
    """What the numbers of a built set are; None for another folder."""
    place = Path(folder) / "set.json"
    if not place.is_file():
        return None
    about = plain_json(read_bytes(place, max_bytes=_MAX_TEXT))
    return named(str(about.get("features", HUMANML3D.name))) if isinstance(about, dict) else None


def read_items(folder: Path | str, selection: Selection) -> list[Item]:
    """The selected items of a folder, in order of their names.

    Raises MotionloomError for a folder of no known kind and for one that holds none of them.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise MotionloomError(f"there is no folder {folder}; name a built set, recordings or a HumanML3D folder")
    if (folder / "new_joint_vecs").is_dir():
        candidates = _humanml3d(folder, selection)
    else:
        clips = plain_clips(folder, mirrored=selection.mirrored, chosen=lambda take: _selected(take, selection))
        candidates = (item for clip in clips if _selected(clip, selection) for item in _described(clip))
    items = [one for item in candidates if (one := fitted(item, selection)) is not None]
    if len(items) > MOST_ITEMS:
        raise MotionloomError(
            f"{folder} holds {len(items)} items; at most {MOST_ITEMS} can be measured, so select fewer"
        )
    if not items:
        raise MotionloomError(
            f"{folder} holds no captioned stretch of {selection.shortest / FPS:g} to {selection.longest / FPS:g} s of "
            f"source {', '.join(selection.sources) or 'any'} in {', '.join(selection.splits)}; name another --data"
        )
    return items


def fitted(item: Item, selection: Selection) -> Item | None:
    """The item cropped to its length by `cropped`; None where it is too short or too long."""
    frames = len(item.features)
    if not selection.shortest <= frames <= selection.longest + SPARE:
        return None
    length = cropped(min(frames, selection.longest), selection, item.name)
    if length < selection.shortest:
        return None
    return Item(item.name, item.source, item.split, item.captions, item.features[:length])


def cropped(frames: int, selection: Selection, name: str) -> int:
    """The largest multiple of the unit in ``frames``; one unit less for a third of the names, where that is selected.

    (Published: the coin is thrown anew each time; here it belongs to the name, so that real motions stay the same.)
    """
    units = frames // selection.unit
    if selection.shorter_third and sum(name.encode()) % 3 == 0:
        units -= 1
    return units * selection.unit


def spread(count: int, of: int) -> list[int]:
    """``count`` different places among ``of``, evenly spread, first and last among them."""
    if count >= of:
        return list(range(of))
    return [round(k * (of - 1) / max(1, count - 1)) for k in range(count)]


def pick(captions: Sequence[Sequence[Caption]], rng: np.random.Generator) -> list[int]:
    """For each item the number of one of its captions."""
    return [int(rng.integers(len(several))) for several in captions]


def _selected(one: Clip | Take, selection: Selection) -> bool:
    return one.split in selection.splits and one.source.startswith(selection.sources or ("",))


def _described(clip: Clip) -> Iterator[Item]:
    for note in clip.notes:
        captions = tuple(Caption(text.strip()) for text in note.texts if text.strip())
        if note.kind == "human" and captions:
            part = clip.features[note.first : note.last].astype(np.float32)
            fps = clip.representation.fps
            name = f"{clip.name}@{note.first / fps:g}-{note.last / fps:g}"
            yield Item(name, clip.source, clip.split, captions, part)


def _humanml3d(folder: Path, selection: Selection) -> Iterator[Item]:
    """new_joint_vecs/NAME.npy, texts/NAME.txt and a list of names per split; the mirrored ones begin with M."""
    for split, name in listed_names(folder, selection.splits):
        if name.startswith("M") and not selection.mirrored:
            continue
        place = folder / "new_joint_vecs" / f"{name}.npy"
        if place.is_file():  # as published: what the folder lacks is skipped
            yield from _spoken(name, split, read_features(place), _text(folder / "texts" / f"{name}.txt"))


def _spoken(name: str, split: str, features: np.ndarray, text: str) -> Iterator[Item]:
    """One item per stretch that captions speak of: the whole, and each part with a begin and an end in seconds."""
    spans: dict[tuple[int, int], list[Caption]] = {}
    for line in text.splitlines():
        parts = line.split("#")
        if len(parts) != 4 or not parts[0].strip():
            continue
        try:
            start, end = (float(part) if part.strip() not in ("", "nan") else 0.0 for part in parts[2:])
            whole = start == 0 and end == 0
            first, last = (0, len(features)) if whole else (int(start * FPS), min(int(end * FPS), len(features)))
            check_caption(parts[0])
        except (ValueError, OverflowError) as error:
            raise MotionloomError(
                f"the text of {name} has a line that cannot be used ({error}): {line[:60]!r}; mend it"
            ) from None
        if 0 <= first < last:
            spans.setdefault((first, last), []).append(Caption(parts[0].strip(), tuple(parts[1].split())))
    for (first, last), captions in spans.items():
        label = f"{name}@{first / FPS:g}-{last / FPS:g}"
        yield Item(label, "humanml3d", split, tuple(captions), features[first:last])


def _text(path: Path) -> str:
    try:
        return read_utf8(path, max_bytes=_MAX_TEXT, empty=True)
    except (OSError, MotionloomError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise MotionloomError(f"cannot read {path} ({reason}); a HumanML3D folder has lists and texts") from None


class NoData(MotionloomError):
    """The kind of data that a suite needs is not there: nothing is wrong, and there is nothing to measure."""


def pairs_of(data: Path | str | None, *, captions: bool = True, say: Say = silent) -> list[Pair]:
    """`data.pairs.find_pairs`; raises NoData where a folder has no pairs at all, and as it does for pairs that are
    not right."""
    if data is None:
        raise MotionloomError("two people are compared with real pairs, and none are shipped; name some with --data")
    try:
        return find_pairs(data, captions=captions, say=say)
    except MotionloomError as error:
        if Path(data).is_dir() and not has_pairs(Path(data)):
            raise NoData(str(error)) from None
        raise


def has_pairs(folder: Path) -> bool:
    """Whether anything in a folder belongs to a pair, by the layouts of `find_pairs`."""
    from motionloom_lab.papers.threedpw import is_3dpw

    if (folder / "manifest.csv").is_file():
        try:
            with open(folder / "manifest.csv", newline="", encoding="utf-8") as lines:
                return any(row.get("partner") for row in csv.DictReader(lines))
        except (OSError, ValueError, csv.Error):
            return True  # it cannot be read, which is another matter
    if is_3dpw(folder):
        return True
    beside = any(re.fullmatch(r".+_[ab]", path.stem) for path in finished(folder, "*.bvh"))
    return beside or bool(finished(folder, "*/[ab].bvh"))


def need_pairs(data: Path) -> None:
    """Raises NoData where a folder holds no pairs of people."""
    if not has_pairs(data):
        raise NoData(f"{data} holds no recordings of two people together")


def need_captions(data: Path) -> None:
    """Raises NoData where no held-out clip has a caption; MotionloomError where there are no clips."""
    from motionloom_lab.suites.items import real_clips

    if (data / "new_joint_vecs").is_dir():  # HumanML3D: a text for each motion
        return
    if not any(clip.held_out and clip.captions for clip in real_clips(data)):
        raise NoData(f"no held-out clip of {data} has a caption")


def need_recordings(data: Path) -> None:
    """Raises NoData where a built set has no clip of CMU's test subjects; other folders are recognised as they are
    read."""
    from motionloom_lab.suites.prediction_trial import CMU_TEST

    clips = data / "clips"
    if clips.is_dir() and not any(path.stem.split("_")[0] in CMU_TEST for path in finished(clips, "*.safetensors")):
        raise NoData(f"{data} has no recordings of the people whose futures are predicted")
