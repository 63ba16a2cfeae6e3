"""Two people as a session: a prior's network and a communication block (docs/decisions/0006).

A state has one slot before the frames, whose first four numbers are the person's part of D: their relative ground pose
at frame 0 (`features.pair.PlaceCode`). Rows 2k and 2k + 1 are two people.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion import Schedule
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import WIDTH
from motionloom.core.features.pair import PairMotion, PlaceCode
from motionloom.core.models.networks.prior import HELD, Inputs, PriorSession
from motionloom.core.models.networks.prior_condition import Bound, Condition, Floats
from motionloom.core.models.networks.session import Session
from motionloom.core.models.networks.sizes import NetConfig, are_sizes

PLACE = 4
"""Numbers of D per person."""
SEEN = (15, 20, 21)
"""Joints of the other person that an ``aware`` block sees: head and wrists."""


@dataclass(frozen=True)
class PairConfig:
    """Sizes of a communication block; the defaults are the published ones."""

    layers: int = 1
    split: int = 8
    """It sits after so many layers of the prior; 0: before the first."""
    width: int = 512
    heads: int = 4
    hidden: int = 1024
    dropout: float = 0.1
    adds: Literal["all", "condition"] = "all"
    """What is corrected: all tokens, or the condition token alone (variant ``published`` only)."""
    aware: bool = False
    """Whether its input also says where the other person is, frame by frame, by what the priors alone would make."""
    places: PlaceCode = field(default_factory=PlaceCode)

    def __post_init__(self) -> None:
        whole = are_sizes(self.layers, self.width, self.heads, self.hidden) and self.layers <= 16
        split = type(self.split) is int and 0 <= self.split <= 256
        flags = self.adds in ("all", "condition") and isinstance(self.aware, bool)
        dropout = type(self.dropout) in (int, float) and 0 <= self.dropout < 1
        if not (whole and split and flags and dropout) or self.width % self.heads:
            raise MotionloomError(f"the communication block's sizes are not usable: {asdict(self)}")

    @staticmethod
    def parse(values: dict[str, Any]) -> "PairConfig":
        """From plain data out of a recipe or a weight file."""
        try:
            plain = dict(values)
            plain["places"] = PlaceCode(**plain.get("places", {}))
            return PairConfig(**plain)
        except (TypeError, ValueError) as error:
            raise MotionloomError(f"the communication block's settings are not usable: {error}") from None

    def check(self, prior: NetConfig) -> None:
        """Raise MotionloomError where such a block cannot sit in such a prior."""
        if self.split > prior.layers:
            raise MotionloomError(
                f"the communication block sits after layer {self.split}, and the prior has {prior.layers}; "
                "use the weights it belongs to"
            )
        if prior.flags or prior.features < PLACE:
            raise MotionloomError("two people need weights without transition flags; use others")
        if prior.variant == "published" and self.width != prior.width:
            raise MotionloomError(
                f"a communication block of width {self.width} does not fit a prior of width {prior.width}"
            )
        if self.adds == "condition" and prior.variant != "published":
            raise MotionloomError("this prior has no condition token to correct; let the block add to all tokens")
        if self.aware and (prior.features != WIDTH or self.places.kind != "mutual"):
            raise MotionloomError(f"an aware block needs HumanML3D's {WIDTH} numbers and places of the kind mutual")


@dataclass(frozen=True, eq=False)
class PairSession:
    """Guesses the clean states (2 * pairs, 1 + frames, features) of two people each."""

    block: PairConfig
    tensors: Mapping[str, np.ndarray]
    """The block's weights."""
    graph: bytes
    prior: PriorSession
    schedule: Schedule
    mean: Floats
    std: Floats

    outputs: ClassVar = ("clean", "place")
    """What the graph answers."""

    @property
    def config(self) -> NetConfig:
        """Sizes of the prior's network."""
        return self.prior.config

    @property
    def places(self) -> PlaceCode:
        """How relative ground poses become numbers of a state."""
        return self.block.places

    @cached_property
    def silent(self) -> bool:
        """Whether the estimate of D is zero whatever comes."""
        return not any(self.tensors[f"place.{part}"].any() for part in ("weight", "bias"))

    def over(self, prior: PriorSession) -> "PairSession":
        """The same block over another network of these sizes, such as the prior's with adapters in it."""
        return replace(self, prior=prior)

    def bind(self, cond: Condition) -> Bound:
        """See `PriorSession.bind`; a row for each person."""
        return self.prior.bind(cond)

    def states(self, pairs: PairMotion, frames: int) -> Floats:
        """Pairs (pairs, 2, some frames, features) to standardised states (2 * pairs, 1 + frames, features), with zeros
        behind them."""
        spread = np.where(self.std > 0, self.std, np.float32(1))
        motion = rows((pairs.features.astype(np.float32) - self.mean) / spread)
        missing = [(0, 0), (0, frames - motion.shape[1]), (0, 0)]
        return join(rows(self.places.encode(pairs.poses.astype(np.float32))), np.pad(motion, missing))

    def pairs(self, states: Floats) -> PairMotion:
        """States (2 * pairs, 1 + frames, features) to pairs; the first person of each is at the origin facing +Z, or
        where a code of the kind world says."""
        places, motion = part(states)
        return PairMotion(people(motion * self.std + self.mean), self.places.decode(people(places)))

    @cached_property
    def _network(self) -> Session:
        weights = dict(self.prior.weights, **self.tensors, mean=self.mean, std=self.std)
        return Session(self.graph, lambda: weights, device=self.prior.device)

    @cached_property
    def _inputs(self) -> Inputs:
        return Inputs(self.config, self.prior.weights)

    def __call__(self, state: Floats, level: int | NDArray[np.int64], bound: Bound) -> Floats:
        """States at ``level`` (one, or one per row) to the denoised estimate.

        The slot of D comes back with zeros behind its four numbers. Lengths of the condition count frames, without
        the slot before them.
        """
        if state.shape[0] % 2 or state.shape[1] < 2:
            raise MotionloomError(
                f"two people need an even number of rows, one slot and frames; got {tuple(state.shape)}"
            )
        places, motion = part(state)
        feeds = self._inputs.of(motion, level, bound)
        signal = np.asarray(self.schedule.signal, np.float32)[feeds["level"]]
        feeds |= {"places": np.asarray(places, np.float32), "signal": signal}
        tokens, place = self._network.run(feeds, held=(*HELD, "frames"))
        return join(place, self._inputs.frames(tokens, motion.shape[1]))


def people(rows: np.ndarray) -> np.ndarray:
    """Rows (2 * pairs, ...) of people as (pairs, 2, ...)."""
    return rows.reshape(-1, 2, *rows.shape[1:])


def rows(pairs: np.ndarray) -> np.ndarray:
    """The inverse of `people`."""
    return pairs.reshape(2 * len(pairs), *pairs.shape[2:])


def join(places: Floats, motion: Floats) -> Floats:
    """D (rows, 4) and motion (rows, frames, numbers) to a state (rows, 1 + frames, numbers)."""
    slot = np.zeros((len(motion), 1, motion.shape[-1]), motion.dtype)
    slot[:, 0, :PLACE] = places
    return np.concatenate([slot, motion], axis=1)


def part(state: Floats) -> tuple[Floats, Floats]:
    """D (rows, 4) and the motion (rows, frames, numbers) of a state."""
    return state[:, 0, :PLACE], state[:, 1:]
