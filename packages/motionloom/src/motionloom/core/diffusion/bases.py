"""Where the state lives when it is not frames: its first few frequencies in time.

HumanMAC (Chen et al. 2023, section 3.1) denoises the first L coefficients of the discrete cosine transform of a motion,
so that a state's tokens are frequencies; what is known about single frames is inserted by going to time and back.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .schedule import State


@dataclass(frozen=True)
class Dct:
    """The orthonormal DCT-II over ``frames``, of which the ``kept`` lowest frequencies are the state."""

    frames: int
    kept: int

    def __post_init__(self) -> None:
        if not 1 <= self.kept <= self.frames:
            raise ValueError(f"of {self.frames} frames 1 to {self.frames} frequencies can be kept, not {self.kept}")

    @cached_property
    def matrix(self) -> np.ndarray:
        """(kept, frames) float64, orthonormal rows: its transpose is the way back."""
        k, i = np.arange(self.kept)[:, None], np.arange(self.frames) + 0.5
        rows = math.sqrt(2 / self.frames) * np.cos(math.pi * i * k / self.frames)
        rows[0] = math.sqrt(1 / self.frames)
        return rows

    def to_spectrum(self, x: np.ndarray) -> State:
        """(..., frames, features) to (..., kept, features)."""
        return self.matrix.astype(x.dtype) @ x

    def to_time(self, y: State) -> np.ndarray:
        """(..., kept, features) to (..., frames, features), without what the dropped frequencies would add."""
        return self.matrix.astype(y.dtype).T @ y


@dataclass(frozen=True)
class Frames:
    """No change of basis: the state's tokens are the frames themselves."""

    frames: int

    @property
    def kept(self) -> int:
        """All frames."""
        return self.frames

    def to_spectrum(self, x: np.ndarray) -> State:
        """(..., frames, features) as it is."""
        return x

    def to_time(self, y: State) -> np.ndarray:
        """(..., frames, features) as it is."""
        return y


Basis = Dct | Frames
