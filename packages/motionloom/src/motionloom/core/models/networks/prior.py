"""A prior's network as sessions: `bind` once per condition, then one run per call of the sampler's loop.

    session = PriorSession(config, weights, graphs)
    bound = session.bind(condition)
    clean = session(state, level, bound)

A row's answer has the same bits alone and beside other rows, on one thread and on several, whatever pads it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.prior_condition import Bound, Condition, Floats
from motionloom.core.models.networks.session import Session, check_graph
from motionloom.core.models.networks.sizes import NetConfig

HELD = ("shown", "text", "keys", "values", "words", "valid")
"""What does not change from call to call."""


@dataclass(frozen=True, eq=False)
class PriorSession:
    """Guesses clean motion features (rows, frames, features) from a noisy state, its level and a condition."""

    config: NetConfig
    weights: Mapping[str, np.ndarray]
    """By their names in a weight file, ``net.*``."""
    graphs: Mapping[str, bytes]
    """``prior`` and ``bind``."""
    device: str = "cpu"
    control: Floats | None = None
    """(width, patch * 2 * features) with which a control adapter reads what is known: for each frame of a token first
    the known numbers, then the mask; None: nothing can be shown."""

    @property
    def modulated(self) -> bool:
        """Whether text is attended to word by word."""
        return self.config.variant == "modulated"

    def check(self) -> None:
        """Raise MotionloomError where the graphs are not those of such a network."""
        check_graph(self.graphs["prior"], self.weights, ["clean"])
        check_graph(self.graphs["bind"], self.weights, ["text", "keys", "values"] if self.modulated else ["text"])

    def on(self, device: str) -> "PriorSession":
        """The same on another device."""
        return replace(self, device=device)

    @cached_property
    def _network(self) -> Session:
        return Session(self.graphs["prior"], lambda: self.weights, device=self.device)

    @cached_property
    def _binding(self) -> Session:
        return Session(self.graphs["bind"], lambda: self.weights, device=self.device)

    @cached_property
    def _inputs(self) -> "Inputs":
        return Inputs(self.config, self.weights)

    def bind(self, cond: Condition) -> Bound:
        """Everything that depends on the condition alone; raises MotionloomError where it lacks what is read."""
        rows, count = cond.words.shape
        if self.modulated and not count:
            raise MotionloomError(
                "this network attends to word vectors and the condition has none; use its own text encoder"
            )
        config = self.config
        keys = np.zeros((rows, config.layers, config.heads, 0, config.width // config.heads), np.float32)
        values = keys
        if self.modulated:
            text, keys, values = self._binding.run({"pooled": cond.pooled, "tokens": cond.tokens})
        else:
            [text] = self._binding.run({"pooled": cond.pooled})
        words, nothing = cond.words[:, None, None], np.zeros((rows, 0, 0), np.float32)
        return Bound(text, keys, values, words, cond.lengths, cond.flags, nothing)

    def __call__(self, state: Floats, level: int | NDArray[np.int64], bound: Bound) -> Floats:
        """States (rows, frames, features), standardised, at ``level`` (one, or one per row; 1 to T), denoised."""
        feeds = self._inputs.of(state, level, bound)
        [tokens] = self._network.run(feeds, held=HELD)
        return self._inputs.frames(tokens, state.shape[1])

    def show(self, bound: Bound, known: Floats, mask: NDArray[np.bool_]) -> Bound:
        """The condition with what is ``known`` (rows, frames, features), standardised, where the mask is True, if it
        can be shown; elsewhere it may be anything finite."""
        if self.control is None:
            return bound
        numbers = np.concatenate([np.where(mask, known, 0.0), mask], axis=-1, dtype=np.float32)
        if self.config.patch > 1:  # as of the state: a token may be part motion and part padding
            numbers *= valid_frames(bound.lengths, numbers.shape[1])[..., None]
        tokens = patches(numbers, self.config.patch)
        return bound._replace(shown=np.stack([row @ self.control.T for row in tokens]))


@dataclass(frozen=True, eq=False)
class Inputs:
    """What the graph of a prior is fed with."""

    config: NetConfig
    weights: Mapping[str, np.ndarray]
    _masks: dict[str, tuple[Bound, tuple[int, int], dict[str, np.ndarray]]] = field(default_factory=dict)

    def of(self, state: Floats, level: int | NDArray[np.int64], bound: Bound) -> dict[str, np.ndarray]:
        """Arrays by the names of the graph's inputs; those of one condition stay the same arrays."""
        rows, frames, _ = state.shape
        if len(bound.text) != rows:
            raise ValueError(f"there are conditions for {len(bound.text)} rows, and {rows} states")
        fixed = self._fixed(bound, rows, frames)
        state = np.asarray(state, np.float32)
        if self.config.flags:
            flags = bound.flags if bound.flags.shape[1] else np.zeros((rows, frames), np.int64)
            state = np.concatenate([state, np.asarray(self.weights["net.flag.weight"], np.float32)[flags]], axis=-1)
        if self.config.patch > 1 and not fixed["frames"].all():
            state = state * fixed["frames"][:, :frames, None]  # a token may be part motion and part padding
        levels = np.full(rows, level, np.int64) if np.ndim(level) == 0 else np.asarray(level, np.int64)
        return {**fixed, "state": patches(state, self.config.patch), "level": levels}

    def frames(self, tokens: Floats, frames: int) -> Floats:
        """Features (rows, frames, features) of tokens (rows, tokens, patch * features)."""
        return tokens.reshape(len(tokens), -1, self.config.features)[:, :frames]

    def _fixed(self, bound: Bound, rows: int, frames: int) -> dict[str, np.ndarray]:
        before = self._masks.get("last")
        if before is not None and before[0] is bound and before[1] == (rows, frames):
            return before[2]
        patch, width = self.config.patch, self.config.width
        count = -(-frames // patch)
        valid = np.pad(valid_frames(bound.lengths, frames), ((0, 0), (0, count * patch - frames)))
        known = bound.shown if bound.shown.size else np.zeros((rows, count, width), np.float32)
        floats = {"shown": known, "text": bound.text, "keys": bound.keys, "values": bound.values}
        arrays = {name: np.ascontiguousarray(one, np.float32) for name, one in floats.items()} | {
            "words": np.ascontiguousarray(bound.words.reshape(rows, -1)),
            "valid": valid.reshape(rows, count, patch).any(-1),
            "frames": valid,
        }
        self._masks["last"] = bound, (rows, frames), arrays
        return arrays


def valid_frames(lengths: NDArray[np.int64], frames: int) -> NDArray[np.bool_]:
    """(rows, frames) which frames of rows with these lengths are no padding; -1: all."""
    return (np.arange(frames) < lengths[:, None]) | (lengths < 0)[:, None]


def patches(values: Floats, patch: int) -> Floats:
    """(rows, frames, numbers) to (rows, tokens, patch * numbers), padded with zeros."""
    rows, frames, numbers = values.shape
    if frames % patch:
        values = np.pad(values, ((0, 0), (0, -frames % patch), (0, 0)))
    return np.ascontiguousarray(values).reshape(rows, -1, patch * numbers)
