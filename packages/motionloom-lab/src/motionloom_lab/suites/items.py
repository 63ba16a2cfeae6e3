"""Captioned stretches of real motion: what generated motions are asked to show and are measured against.

They come out of a built set, a folder of recordings, or HumanML3D as its authors lay it out (with its tokens).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.features.layout import FPS
from motionloom.io.text import read_utf8
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.suites.clips import plain_clips
from motionloom_lab.suites.protocol import MOST_ITEMS, Selection
from motionloom_train.data.clips import Clip
from motionloom_train.data.sources import Take, listed_names, read_features
from motionloom_train.data.words import check_caption

SPARE = 4
"""Frames above the longest length that are cut off; a stretch that is longer still is left out."""
_MAX_TEXT = 64 << 20


@dataclass(frozen=True, eq=False)
class Item:
    """A stretch of a recording and what people say it shows."""

    name: str
    source: str
    split: str
    captions: tuple[Caption, ...]
    features: np.ndarray
    """(frames, 263) float32, not standardised, 20 frames per second."""


def fitting(folder: Path | str, selection: Selection | None) -> Selection:
    """What is selected where nothing was said: the test set of HumanML3D, of other folders `Selection`'s defaults."""
    if not (Path(folder) / "new_joint_vecs").is_dir():
        return selection or Selection()
    return replace(selection or Selection(splits=("test",)), sources=("humanml3d",))


def read_items(folder: Path | str, selection: Selection) -> list[Item]:
    """The selected items of a folder, in order of their names.

    Raises MotionloomError for a folder of no known kind and for one that holds none of them.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise MotionloomError(f"there is no folder {folder}; name a built set, recordings or a HumanML3D folder")
    if (folder / "new_joint_vecs").is_dir():
        found = _humanml3d(folder, selection)
    else:
        clips = plain_clips(folder, mirrored=selection.mirrored, chosen=lambda take: _selected(take, selection))
        found = (item for clip in clips if _selected(clip, selection) for item in _described(clip))
    kept = [one for item in found if (one := fitted(item, selection)) is not None]
    if len(kept) > MOST_ITEMS:
        raise MotionloomError(
            f"{folder} holds {len(kept)} items; at most {MOST_ITEMS} can be measured, so select fewer"
        )
    if not kept:
        raise MotionloomError(
            f"{folder} holds no captioned stretch of {selection.shortest / FPS:g} to {selection.longest / FPS:g} s of "
            f"source {', '.join(selection.sources) or 'any'} in {', '.join(selection.splits)}; name another --data"
        )
    return kept


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
    """The largest multiple of the unit in ``frames``; one unit less for a third of the names, where that is asked for.

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
            name = f"{clip.name}@{note.first / FPS:g}-{note.last / FPS:g}"
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
        said = getattr(error, "strerror", None) or str(error)
        raise MotionloomError(f"cannot read {path} ({said}); a HumanML3D folder has lists and texts") from None
