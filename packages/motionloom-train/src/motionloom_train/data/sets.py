"""A built set in memory: its clips end to end, and the captions of each stretch."""

import functools
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import HUMANML3D, Representation
from motionloom.core.files.atomic import finished
from motionloom.core.files.text import parse_json, read_utf8
from motionloom.core.reading import read_table
from motionloom_train.data.actions import ACTIONS, PREFIX, briskness, sentences, side_of, strike
from motionloom_train.data.actions import rests as rests_of
from motionloom_train.data.clips import GESTURE, MANNER, MEASURED, Clip, Note, read_clip
from motionloom_train.data.made import GESTURES
from motionloom_train.data.manners import MANNERS
from motionloom_train.data.starts import may_begin
from motionloom_train.data.words import EVENTS, STATES, phrases, sentence


@functools.cache
def table() -> dict[str, dict[str, list[str]]]:
    """Whole sentences that people type, of more forms than a subject and a verb phrase.

    ``action:NAME``, ``gesture:NAME`` or ``label:NAME`` to ``says``, and ``sided`` with ``{side}``.
    """
    sentences: dict[str, dict[str, list[str]]] = read_table("motionloom_train.data", "sayings.toml")
    for group, idioms in read_table("motionloom_train.data", "idioms.toml").items():
        row = sentences.setdefault(group, {})
        rng = np.random.default_rng(zlib.crc32(group.encode()))
        says = [*row.get("says", []), *idioms.get("says", []), *_worded_idioms(idioms.get("verbs", []), rng)]
        row["says"] = list(dict.fromkeys(says))
        row["sided"] = [*row.get("sided", []), *_worded_idioms(idioms.get("sided", []), rng)]
    return sentences


def _worded_idioms(verbs: Sequence[str], rng: np.random.Generator) -> list[str]:
    return list(dict.fromkeys(sentence(verb, rng) for verb in verbs for _ in range(IDIOM_FORMS)))


IDIOM_FORMS = 3
"""Sentences of each idiom."""


def sayings(note: Note) -> tuple[str, ...]:
    """The table's sentences for a note; none for captions, and for gestures of people who walk or sit."""
    name = note.kind.removeprefix(PREFIX)
    if not note.kind.startswith(PREFIX):
        return tuple(table().get(f"label:{name}", {}).get("says", ()))
    gesture = name.startswith(GESTURE)
    if gesture and any(re.search(r"\b(walk|sit)\w* and ", text) for text in note.texts):
        return ()
    entry = table().get(f"gesture:{name.removeprefix(GESTURE)}" if gesture else f"action:{name}", {})
    side = side_of(note.texts)
    turns_right = name in ACTIONS and ACTIONS[name].turns and side == "right"
    plain = [] if turns_right else entry.get("says", [])
    return (*plain, *(text.replace("{side}", side) for text in entry.get("sided", ()) if side))


WORDINGS = 48
"""Sentences generated per measured label."""
WEIGHT = {"capture": 1.0, "made": 0.7, "keyed": 0.4}
"""How often a stretch is sampled among those of its action: animated by hand it teaches what, not how."""

STRIKES = {"kick": "foot", "punch": "hand"}
"""How the measured labels begin that name a strike, and the limb that strikes."""
LEAST_BRISK = 0.1
"""How often the slowest strike is sampled, against a brisk one."""
_MAX_SUMMARY = 64 << 20
MOMENTS = 3
"""Windows shown for a caption that names an event."""


@dataclass(frozen=True)
class Item:
    """A described stretch of one clip."""

    start: int
    """First frame in `MotionSet.features`."""
    frames: int
    group: str
    """``human``, ``index``, ``action:NAME``, ``measured:NAME`` or the measured label."""
    texts: tuple[int, ...]
    """Numbers of its sentences in `MotionSet.texts`."""
    core: tuple[int, int] | None = None
    """Frames of `MotionSet.features` (first, end) without which a window does not show the action, such as a jump."""
    weight: float = 1.0
    """How often it is sampled among those of its group."""
    rests: tuple[int, ...] = ()
    """Frames of `MotionSet.features` at which a repetition of an exercise begins; windows begin there."""
    source: str = ""
    """Of its clip."""


@dataclass(frozen=True)
class MotionSet:
    """Clips laid end to end, with what they show."""

    features: Tensor
    """(frames of all clips, numbers) float32, standardised."""
    mean: Tensor
    std: Tensor
    items: tuple[Item, ...]
    texts: tuple[str, ...]
    licences: tuple[str, ...]
    minutes: float
    """Minutes of motion as recorded, without mirrored and derived copies."""
    may_begin: np.ndarray | None = None
    """(frames of all clips,) bool: where a window may begin (`data.starts`); None: anywhere."""
    representation: Representation = HUMANML3D
    flags: Tensor | None = None
    """(frames of all clips,) int64: 1 where one action becomes another; None: nobody said."""


def read_clips(folder: Path | str, *, sources: Sequence[str] = (), splits: Sequence[str] = ("train",)) -> list[Clip]:
    """The clips of a built set; ``sources`` keeps those whose source begins with one of the words."""
    folder = Path(folder)
    if not (folder / "set.json").is_file():
        raise MotionloomError(
            f"{folder} is not a built set (it has no set.json); make one with 'motionloom data build'"
        )
    every = (read_clip(path) for path in finished(folder / "clips", "*.safetensors"))
    clips = [c for c in every if c.split in splits and (not sources or c.source.startswith(tuple(sources)))]
    if not clips:
        raise MotionloomError(f"{folder} holds no clips of source {', '.join(sources) or 'any'} in {', '.join(splits)}")
    return clips


def statistics(clips: Sequence[Clip]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (numbers,) as published: HumanML3D's deviations averaged within each block."""
    representation = clips[0].representation
    frames = np.concatenate([c.features for c in clips]).astype(np.float64)
    mean, std = frames.mean(0), frames.std(0)
    for block in representation.blocks.values() if representation.by_block else ():
        std[block] = std[block].mean()
    return mean.astype(np.float32), np.maximum(std, 1e-4).astype(np.float32)


def load_set(
    folder: Path | str, *, sources: Sequence[str] = (), seed: int = 0, only: Representation | None = None
) -> MotionSet:
    """Read the training split of a built set.

    seed: fixes the wordings of measured labels. only: the representation that is needed; None: any.
    Raises MotionloomError where the set is of another, or of several.
    """
    clips = read_clips(folder, sources=sources)
    representation = clips[0].representation
    other = next((clip for clip in clips if clip.representation is not (only or representation)), None)
    if other is not None:
        raise MotionloomError(
            f"{folder}: {other.name} has {other.representation}, and {only or representation} are needed here; build a "
            "set of them, see 'motionloom data build --help'"
        )
    mean, std = statistics(clips)
    rng = np.random.default_rng(seed)
    texts: dict[str, int] = {}
    wordings: dict[str, tuple[int, ...]] = {}
    items, start = [], 0
    for clip in clips:
        for note in (one for each in clip.notes for one in (each, *_general(each))):
            numbers = _worded(note, texts, wordings, rng)
            moments = _moments(clip, note)
            side = side_of([note.kind, *note.texts]) if "punch" in note.kind else ""
            for first, last in ((note.first, note.last), *moments):
                core = note.core or ((first, last) if moments or _is_event(note) else None)
                core, rests = _when(clip, note.kind, core, first, last, side)
                span = (start + core[0], start + core[1]) if core else None
                begins = tuple(start + rest for rest in rests)
                weight = WEIGHT.get(clip.kind, 1.0) * _striking(clip, note.kind, first, last)
                items.append(
                    Item(start + first, last - first, note.kind, numbers, span, weight, begins, source=clip.source)
                )
        start += len(clip.features)
    features = torch.from_numpy(np.concatenate([c.features for c in clips]))
    features = (features - torch.from_numpy(mean)) / torch.from_numpy(std)
    plain = (c for c in clips if c.way == "plain" and not c.name.startswith("M"))
    recorded = sum(len(c.features) for c in plain) / representation.fps / 60
    standing = representation is HUMANML3D  # `may_begin` reads its velocities
    return MotionSet(
        features,
        torch.from_numpy(mean),
        torch.from_numpy(std),
        tuple(items),
        tuple(texts),
        tuple(sorted({c.licence for c in clips})),
        recorded,
        np.concatenate([may_begin(c.features) for c in clips]) if standing else None,
        representation,
        _flags(clips),
    )


def _flags(clips: Sequence[Clip]) -> Tensor | None:
    if any(clip.flags is None for clip in clips):
        return None
    return torch.from_numpy(np.concatenate([np.asarray(clip.flags, dtype=np.int64) for clip in clips]))


def _worded(
    note: Note, texts: dict[str, int], wordings: dict[str, tuple[int, ...]], rng: np.random.Generator
) -> tuple[int, ...]:
    """Numbers of a note's captions in ``texts``, which grows; ``wordings`` are those of the labels met so far."""
    if note.kind == "human" or note.kind.startswith((PREFIX, MEASURED)):
        return tuple(_number(texts, text) for text in _of_its_side(note, (*note.texts, *sayings(note))))
    if note.kind == "index":
        return tuple(dict.fromkeys(_number(texts, sentence(p, rng)) for p in note.texts for _ in range(3)))
    if note.kind not in wordings:
        variants = {sentence(p, rng) for _ in range(WORDINGS) for p in [rng.choice(list(phrases(note.kind)))]}
        wordings[note.kind] = tuple(_number(texts, text) for text in (*sorted(variants), *sayings(note)))
    return wordings[note.kind]


def _of_its_side(note: Note, texts: tuple[str, ...]) -> tuple[str, ...]:
    """The texts for an action of one hand, one leg or to one side; of the left one only what names that side.

    So "a person punches" means the right hand: the average of both would be a body that keeps its guard.
    """
    name = note.kind.removeprefix(PREFIX)
    gesture = GESTURES.get(name.removeprefix(GESTURE))
    action = ACTIONS.get(name)
    one = gesture.hands == "one" or bool(gesture.thrust[2]) if gesture else action and action.sided and not action.turns
    manner = MANNERS.get(name.removeprefix(MANNER)) if name.startswith(MANNER) else None
    one = bool(manner.sided) if manner else one
    if not one or side_of(note.texts) != "left":
        return texts
    return tuple(text for text in texts if side_of([text]) == "left") or texts


def _general(note: Note) -> tuple[Note, ...]:
    """The same stretch as the more general action that its action is, if it is one: a jab is a punch."""
    action = ACTIONS.get(note.kind.removeprefix(PREFIX)) if note.kind.startswith(PREFIX) else None
    if action is None or not action.is_a:
        return ()
    texts = sentences(ACTIONS[action.is_a], side=side_of(note.texts))
    return (replace(note, kind=PREFIX + action.is_a, texts=texts),)


def _limb(kind: str) -> str:
    """The limb that strikes in what a note names, or nothing."""
    action = ACTIONS.get(kind.removeprefix(PREFIX)) if kind.startswith(PREFIX) else None
    return action.limb if action else next((limb for word, limb in STRIKES.items() if kind.startswith(word)), "")


def _striking(clip: Clip, kind: str, first: int, last: int) -> float:
    """How often a strike is sampled by its briskness: slow ones are many, and their average is slower still."""
    limb = _limb(kind)
    return max(briskness(clip.positions(first, last), FPS, limb) ** 2, LEAST_BRISK) if limb else 1.0


def _when(
    clip: Clip, kind: str, core: tuple[int, int] | None, first: int, last: int, side: str
) -> tuple[tuple[int, int] | None, list[int]]:
    """The frames that a window must hold, narrowed to the strike where there is one; and where repetitions begin."""
    action = ACTIONS.get(kind.removeprefix(PREFIX)) if kind.startswith(PREFIX) else None
    limb = _limb(kind)
    repeats = action is not None and action.kind == "repeats"
    if not limb and not repeats:
        return core, []
    positions = clip.positions(first, last)
    if repeats:
        return None, [first + rest for rest in rests_of(positions, FPS)]
    (begin, end), _ = strike(positions, FPS, limb, side=side)
    return (first + begin, first + end), []


def _is_event(note: Note) -> bool:
    named = note.kind.startswith((PREFIX, MEASURED))
    return note.kind not in ("human", "index", *STATES) and "+" not in note.kind and not named


def _moments(clip: Clip, note: Note) -> list[tuple[int, int]]:
    """At most `MOMENTS` windows within a captioned stretch that measurably show the event its caption names.

    A caption for ten seconds says "kicks"; most crops of two or four seconds of it show somebody standing.
    """
    if note.kind not in ("human", "index"):
        return []
    text = " ".join(note.texts).lower()
    named = {label for label, words in EVENTS.items() if re.search(words, text)}
    spans = sorted(
        {
            (n.first, n.last)
            for n in clip.notes
            if n.kind in named
            and _is_event(n)
            and note.first <= n.first
            and n.last <= note.last
            and (n.first, n.last) != (note.first, note.last)
        }
    )
    return [spans[round(k)] for k in np.linspace(0, len(spans) - 1, min(MOMENTS, len(spans)))]


def _number(texts: dict[str, int], text: str) -> int:
    return texts.setdefault(text.strip(), len(texts))


def summary(folder: Path | str) -> dict:
    """The content of ``set.json``; raises MotionloomError where there is none or it is damaged."""
    path = Path(folder) / "set.json"
    about = parse_json(read_utf8(path, max_bytes=_MAX_SUMMARY), path)
    if not isinstance(about, dict):
        raise MotionloomError(f"{path} is not what 'motionloom data build' writes; build the set again")
    return about
