"""What every text-motion evaluator gives: sentences and motions as points of one Euclidean space.

FID, R-precision and the other numbers of `lab.metrics.retrieval` are distances in that space. They mean
something only within one evaluator: a value from one is never compared with a value from another.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import Representation
from motionloom.kinematics.physics import Array


@dataclass(frozen=True)
class Caption:
    """A sentence as an evaluator reads it."""

    text: str
    tokens: tuple[str, ...] = ()
    """``word/POS`` as HumanML3D's text files have them; empty where unknown."""


class Evaluator(Protocol):
    """A text encoder and a motion encoder into one space."""

    @property
    def name(self) -> str:
        """Short; is in every report."""
        ...

    @property
    def about(self) -> dict[str, str]:
        """Where it comes from and what one may do with it."""
        ...

    @property
    def representation(self) -> Representation:
        """What the numbers are that it reads."""
        ...

    def motions(self, features: Sequence[np.ndarray]) -> Array:
        """Motions, each (frames, numbers) of its representation, unstandardised, as (motions, width) float64."""
        ...

    def texts(self, captions: Sequence[Caption]) -> Array:
        """Captions as (captions, width) float64."""
        ...


def load_evaluator(name_or_path: str) -> Evaluator:
    """``own`` (the shipped one) or a file: one of `motionloom train evaluator`, or Guo's, published or imported.

    Raises MotionloomError for a file that is missing, damaged or of another kind.
    """
    from motionloom_lab.evaluator.net import is_embedder
    from motionloom_lab.evaluator.own import load_own
    from motionloom_lab.papers.guo import is_guo, load_guo  # late: all are written in terms of this module

    if name_or_path == "own":
        return load_own()
    path = Path(name_or_path)
    if not path.is_file():
        raise MotionloomError(f"no evaluator {name_or_path!r}: it is not a file, and the shipped one is called 'own'")
    if is_embedder(path):
        return load_own(path)
    if is_guo(path):
        return load_guo(path)
    raise MotionloomError(f"{path} is not an evaluator that this motionloom reads; name one, or 'own'")
