"""A predictor's network as a session, and its sizes."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.prior_condition import Floats
from motionloom.core.models.networks.session import Session
from motionloom.core.models.networks.sizes import are_sizes


@dataclass(frozen=True)
class PredictorConfig:
    """Sizes; the defaults are the published Human3.6M network of 28,401,712 parameters."""

    channels: int = 48
    """Numbers per token: 3 per joint."""
    kept: int = 20
    """Tokens: frequencies, the lowest first."""
    layers: int = 8
    """Even: the first half hands what it was given to the second half."""
    width: int = 512
    heads: int = 8
    dropout: float = 0.2
    condition: tuple[int, int] | None = None
    """Rows and channels of the condition; None: the spectrum of the observation, (kept, channels)."""
    beside: bool = False
    """Whether every token also sees its own row of the condition (the first ``kept`` rows). Not published."""

    def __post_init__(self) -> None:
        sizes = (self.channels, self.kept, self.layers, self.width, self.heads, *self.condition_shape)
        whole = are_sizes(*sizes) and isinstance(self.beside, bool) and self.layers <= 128
        if not whole or self.width % (2 * self.heads) or not 0 <= self.dropout < 1:
            raise MotionloomError(f"the network's sizes are not usable: {asdict(self)}")
        if self.layers % 2:
            raise MotionloomError(
                f"the number of layers must be even, for the first half feeds the second; got {self.layers}"
            )
        if self.beside and self.condition_shape[0] < self.kept:
            raise MotionloomError(f"{self.kept} tokens cannot each see one of {self.condition_shape[0]} rows")

    @property
    def condition_shape(self) -> tuple[int, int]:
        """Rows and channels of the condition."""
        return self.condition or (self.kept, self.channels)

    @staticmethod
    def parse(values: dict[str, Any]) -> "PredictorConfig":
        """From plain data out of a recipe or a weight file, where ``condition`` was ``told``.

        Raises MotionloomError.
        """
        try:
            settings = dict(values)
            condition = settings.pop("condition", settings.pop("told", None))
            shape = None if condition is None else (condition[0], condition[1])
            return PredictorConfig(**settings, condition=shape)
        except (TypeError, ValueError, IndexError, KeyError) as error:
            raise MotionloomError(f"the network's settings are not usable: {error}") from None


@dataclass(frozen=True, eq=False)
class PredictorSession:
    """The estimate of the noise (published) or of the clean spectrum (x0) of states (rows, kept, channels)."""

    config: PredictorConfig
    weights: Mapping[str, np.ndarray]
    """By their names in a weight file, ``net.*``."""
    graph: bytes
    device: str = "cpu"
    outputs: ClassVar = ("answer",)
    """What the graph answers."""

    def on(self, device: str) -> "PredictorSession":
        """The same on another device."""
        return replace(self, device=device)

    @cached_property
    def _network(self) -> Session:
        return Session(self.graph, lambda: self.weights, device=self.device)

    def __call__(
        self,
        state: Floats,
        level: NDArray[np.int64],
        condition: Floats | None = None,
        keep: NDArray[np.bool_] | None = None,
    ) -> Floats:
        """The estimate, of the state's shape.

        Args:
            state: (rows, kept, channels).
            level: (rows,) in the published counting of noise levels, 0 the first noisy one.
            condition: (rows, *config.condition_shape), or None.
            keep: (rows,) the rows that get the condition; the others go without.
        """
        rows = len(state)
        share = np.ones(rows, np.float32) if keep is None else np.asarray(keep, np.float32)
        if condition is None:
            condition = np.zeros((rows, *self.config.condition_shape), np.float32)
            share = np.zeros(rows, np.float32)
        feeds = {
            "state": np.asarray(state, np.float32),
            "level": np.asarray(level, np.int64),
            "condition": np.asarray(condition, np.float32),
            "keep": share,
        }
        return self._network.run(feeds, held=("condition", "keep"))[0]
