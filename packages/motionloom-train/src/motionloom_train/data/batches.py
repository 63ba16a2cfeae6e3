"""Training batches: which windows of a set are sampled, and how often."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_table
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.clips import GESTURE, MEASURED
from motionloom_train.data.sets import Item, MotionSet
from motionloom_train.data.starts import nearest

SHARE = {"action": 0.66, "human": 0.06, "index": 0.02, "label": 0.14, "measured": 0.12}
"""How often a training sample shows a named action, a written caption, an index description, a measured label, and
adverbs, counts and negations of what was measured (`data.measured`)."""

_ROWS = read_table("motionloom_train.data", "favour.toml")
FAVOUR: dict[str, float] = _ROWS["labels"] | {f"action:{name}": often for name, often in _ROWS["actions"].items()}
"""Groups sampled more or less often than the others: what came out last, and what is requested most. A mixture of two
labels is sampled 0.4 times as often, a generated gesture `GESTURE_SHARE` times."""
GESTURE_SHARE = 0.6


@dataclass(frozen=True)
class Batch:
    """Windows of motion with their sentences."""

    features: Tensor
    """(rows, frames, numbers) standardised; zeros behind each row's length; on the device of the set's features."""
    lengths: Tensor
    """(rows,) valid frames."""
    texts: Tensor
    """(rows,) numbers of sentences."""
    flags: Tensor | None = None
    """(rows, frames) int64: 1 where one action becomes another; None where the set does not say."""


class Batches:
    """Draws batches; the draw of a step depends on the seed and the step alone, so that training resumes exactly.

    All rows of a batch share a window (one of ``windows`` frames, sampled by ``shares``); items shorter than the window
    but at least 60 % of it are whole and padded. What an item needs to show what its texts name (`Item.core`) is
    always within the window. Batches lie on the device of the set's features; random numbers are generated on the CPU.

    ``fresh``: share of each batch, its last rows, that shows items which are fresh by ``fresh_of`` (`is_fresh`); the
    other rows show the other items.
    """

    def __init__(
        self,
        data: MotionSet,
        *,
        windows: Sequence[int] = (48, 80, 120, 196),
        shares: Sequence[float] = (0.2, 0.3, 0.35, 0.15),
        favour: Mapping[str, float] = FAVOUR,
        fresh: float = 0.0,
        fresh_of: Sequence[str] = (),
    ) -> None:
        self.data, self.windows = data, tuple(windows)
        self.shares = np.array(shares) / np.sum(shares)
        place = data.features.device
        self._mean, self._std = data.mean.to(place), data.std.to(place)
        self._heights = torch.zeros(len(data.mean), dtype=torch.bool)
        self._heights[list(data.representation.heights)] = True
        self._heights = self._heights.to(place)
        self.flagged = data.flags is not None
        self._flags = torch.zeros(0, dtype=torch.long) if data.flags is None else data.flags.to(place)
        allowed = data.may_begin if data.may_begin is not None else np.ones(len(data.features), dtype=bool)
        starts = nearest(allowed)
        self._fresh = fresh
        parts = {"": [item for item in data.items if not is_fresh(item, fresh_of)]}
        if fresh:
            parts["fresh "] = [item for item in data.items if is_fresh(item, fresh_of)]
        self._pools = {w: [Pool.of(items, w, favour, starts) for items in parts.values()] for w in self.windows}
        for window, share in zip(self.windows, self.shares, strict=True):
            for part, pool in zip(parts, self._pools[window], strict=True):
                if share > 0 and not len(pool.numbers):
                    raise MotionloomError(
                        f"no described {part}stretch of the set is long enough for windows of {window} frames (60 % is "
                        "needed); give the recipe shorter windows"
                    )

    def old_rows(self, rows: int) -> int:
        """How many rows of a batch, its first ones, show what is not fresh; at least one."""
        return max(1, rows - round(self._fresh * rows))

    def draw(self, seed: int, step: int, rows: int) -> Batch:
        """The batch of one step."""
        window, picked = self.pick(seed, step, rows)
        return self.show(window, picked.to(self.data.features.device))

    def pick(self, seed: int, step: int, rows: int) -> tuple[int, Tensor]:
        """The window of a step, in frames, and what its rows show: (4, rows) int64 on the CPU, with each row's first
        frame in the set, valid frames, number of its sentence, and 1 where it is lowered to the floor."""
        rng = np.random.default_rng((seed, step))
        window = int(rng.choice(self.windows, p=self.shares))
        old = self.old_rows(rows)
        counts = (old, rows - old)[: len(self._pools[window])]
        parts = [np.stack(pool.draw(rng, count)) for pool, count in zip(self._pools[window], counts, strict=True)]
        return window, torch.from_numpy(np.concatenate(parts, axis=1).astype(np.int64))

    def show(self, window: int, picked: Tensor) -> Batch:
        """The windows that `pick` names; ``picked`` on the device of the set's features. A GPU never waits for it."""
        features = self.data.features
        starts, lengths, texts, climbs = picked
        frames = torch.arange(window, device=picked.device)
        crops = features[(starts[:, None] + frames).clamp(max=len(features) - 1)]
        if picked.is_cuda or bool(climbs.any()):
            crops = torch.where(climbs.bool()[:, None, None], crops - self._above_floor(crops), crops)
        valid = frames < lengths[:, None]
        flags = self._flags[(starts[:, None] + frames).clamp(max=len(features) - 1)] * valid if self.flagged else None
        return Batch(crops * valid[..., None], lengths, texts, flags)

    def _above_floor(self, crops: Tensor) -> Tensor:
        """How much windows (rows, frames, 263), standardised, are lowered so that their first frames touch the floor.

        Windows begin anywhere in a climb. Were they as high as they are in the recording, some would begin four metres
        up, and a motion of the same words would be generated up to there.
        """
        heights = crops[:, 0] * self._std + self._mean
        lowest = heights.masked_fill(~self._heights, float("inf")).amin(-1, keepdim=True).clamp(min=0)
        return (lowest / self._std * self._heights)[:, None]


def is_fresh(item: Item, fresh_of: Sequence[str]) -> bool:
    """Whether an item's source, or its group without ``action:``, begins with one of the words."""
    return any(name.startswith(tuple(fresh_of)) for name in (item.source, item.group.removeprefix(PREFIX)))


class Pool(NamedTuple):
    """The items that windows of one length may show, and how often each of them is sampled."""

    numbers: np.ndarray
    """(items,) their places in `MotionSet.items`."""
    often: np.ndarray
    """(items,) cumulative share of the draws."""
    lengths: np.ndarray
    """(items,) frames that a window shows of them."""
    spans: np.ndarray
    """(items, 2) the frames at which a window may begin, half-open."""
    rests: "Ragged"
    """Frames of repetitions at which a window may begin instead, a little before."""
    texts: "Ragged"
    climbs: np.ndarray
    """(items,) bool: lowered to the floor."""
    allowed: tuple[np.ndarray, np.ndarray]
    """`nearest` frames of the set at which a window may begin."""

    @staticmethod
    def of(
        items: Sequence[Item], window: int, favour: Mapping[str, float], allowed: tuple[np.ndarray, np.ndarray]
    ) -> "Pool":
        """The kind of text is sampled first (`SHARE`), then, but for captions and descriptions, the group, evenly but
        for ``favour``, then the item by its weight: rare actions are seen as often as walks.

        allowed: `nearest` frames at which windows may begin; an item that has none of them is sampled `ABRUPT` times
        as often."""
        fitting: dict[str, dict[str, list[int]]] = {}
        for number, item in enumerate(items):
            kind = _kind(item.group)
            if item.frames >= 0.6 * window and (item.core is None or item.core[1] - item.core[0] <= 1.05 * window):
                fitting.setdefault(kind, {}).setdefault(item.group, []).append(number)
        weights = {
            number: items[number].weight * _begins_well(items[number], window, allowed)
            for groups in fitting.values()
            for inside in groups.values()
            for number in inside
        }
        often: dict[int, float] = {}
        for kind, groups in fitting.items():
            kinds = SHARE[kind] / sum(SHARE[each] for each in fitting)
            favoured = {name: _favour(name, favour) for name in groups}
            for name, inside in groups.items():
                share = kinds * favoured[name] / (sum(favoured.values()) * sum(weights[n] for n in inside))
                often |= {n: share * weights[n] for n in inside}
        members = [items[number] for number in often]
        lengths = [min(item.frames, window) for item in members]
        spans = [_starts(item, length) for item, length in zip(members, lengths)]
        return Pool(
            np.array(list(often), dtype=np.int64),
            np.cumsum(list(often.values())),
            np.array(lengths, dtype=np.int64),
            np.array(spans, dtype=np.int64).reshape(-1, 2),
            Ragged.of([_rests(item, length) for item, length in zip(members, lengths)]),
            Ragged.of([item.texts for item in members]),
            np.array([item.group in CLIMBS for item in members], dtype=bool),
            allowed,
        )

    def draw(self, rng: np.random.Generator, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """First frames, lengths, sentences, and whether they are lowered to the floor, (rows,) each."""
        chosen = np.minimum(
            np.searchsorted(self.often, rng.random(rows) * self.often[-1], "right"), len(self.often) - 1
        )
        first, end = self.spans[chosen].T
        starts = first + (rng.random(rows) * (end - first)).astype(np.int64)
        before = rng.integers(2, 11, rows)
        rest, repeats = self.rests.draw(rng, chosen)
        starts = np.where(repeats, np.maximum(first, rest - before), self._allowed(starts, first, end))
        return starts, self.lengths[chosen], self.texts.draw(rng, chosen)[0], self.climbs[chosen]

    def _allowed(self, starts: np.ndarray, first: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The nearest frames within [first, end) at which windows may begin; where there are none, those of before."""
        before, behind = (frames[starts] for frames in self.allowed)
        before, behind = np.where(before >= first, before, -1), np.where(behind < end, behind, -1)
        nearer = np.where((behind < 0) | ((before >= 0) & (starts - before < behind - starts)), before, behind)
        return np.where(nearer >= 0, nearer, starts)


class Ragged(NamedTuple):
    """Rows of whole numbers of different lengths, end to end."""

    values: np.ndarray
    begins: np.ndarray
    """(rows + 1,) where each row begins in ``values``."""

    @staticmethod
    def of(rows: Sequence[Sequence[int]]) -> "Ragged":
        """The rows in one."""
        values = np.array([value for row in rows for value in row] or [0], dtype=np.int64)
        return Ragged(values, np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64))

    def draw(self, rng: np.random.Generator, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One value of each of some rows, and whether a row has any."""
        first, count = self.begins[rows], self.begins[rows + 1] - self.begins[rows]
        at = first + (rng.random(len(rows)) * count).astype(np.int64)
        return self.values[np.minimum(at, len(self.values) - 1)], count > 0


def _kind(group: str) -> str:
    """The entry of `SHARE` that a group of items belongs to."""
    starts = {PREFIX: "action", MEASURED: "measured"}
    named = next((kind for start, kind in starts.items() if group.startswith(start)), "label")
    return group if group in SHARE else named


def _begins_well(item: Item, length: int, allowed: tuple[np.ndarray, np.ndarray]) -> float:
    """1 for an item with a window of so many frames that may begin where it does, else `ABRUPT`."""
    first, end = _starts(item, min(item.frames, length))
    return 1.0 if allowed[1][first] < end else ABRUPT


def _favour(name: str, favour: Mapping[str, float]) -> float:
    usual = 0.4 if "+" in name else GESTURE_SHARE if name.startswith(PREFIX + GESTURE) else 1.0
    return favour.get(name, usual)


CLIMBS = {"climb", "climb stairs", f"{PREFIX}climb ladder", f"{PREFIX}stairs"}
"""Groups of items that go up."""
ABRUPT = 0.3
"""How often an item is sampled whose windows all begin in full motion, among those of its group."""
BEFORE, ABOUT = 16, 2
"""Frames of a window before a change begins (people begin soon after a command), give or take so many."""


def _rests(item: Item, length: int) -> list[int]:
    """The repetitions before which a window of so many frames may begin."""
    low, high = item.start, item.start + item.frames - length
    return [rest for rest in item.rests if low <= rest - 2 <= high]


def _starts(item: Item, length: int) -> tuple[int, int]:
    """Where a window of so many frames may begin, half-open: within the item, with its core inside.

    The core begins at about the same time in every window (`BEFORE`, give or take `ABOUT`): were it anywhere, the
    average over what a window may show would be a person who stays halfway, and a small network under much noise
    generates averages.
    """
    low, high = item.start, item.start + item.frames - length
    if item.core is None:
        return low, high + 1
    first, end = item.core
    low, high = max(low, min(end - length, high)), min(high, max(first, low))
    begin, last = max(low, min(first - BEFORE - ABOUT, high)), min(high, max(first - BEFORE + ABOUT, low))
    return begin, max(begin, last) + 1
