"""The representations of a person per frame that priors, training and measuring know, by name and by width."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.features import babel, humanml, layout


@dataclass(frozen=True, eq=False)
class Representation:
    """What the numbers of a frame are, and what those who read any such numbers need to know."""

    name: str
    fps: float
    blocks: Mapping[str, slice]
    """Its blocks, by name, in order."""
    decode_positions: Callable[[Any], Any]
    """(..., frames, width), not standardised, to (..., frames, 22, 3) metres, +Y up; differentiable for tensors."""
    heights: tuple[int, ...]
    """Numbers that are heights over the floor."""
    by_block: bool
    """Whether all numbers of a block are standardised by one deviation, as published, or each by its own."""
    shortest: int
    """Frames of the shortest and of the longest motion that its published priors were trained on."""
    longest: int

    @property
    def width(self) -> int:
        """Numbers per frame."""
        return max(block.stop for block in self.blocks.values())

    @property
    def second(self) -> int:
        """Frames of one second, and of a published handshake."""
        return round(self.fps)

    def __str__(self) -> str:
        return f"{self.width} numbers at {self.fps:g} frames per second ({self.name})"


HUMANML3D = Representation(
    "humanml3d",
    layout.FPS,
    layout.LAYOUT,
    humanml.decode_positions,
    (layout.LAYOUT["root_height"].start, *range(layout.LAYOUT["ric"].start + 1, layout.LAYOUT["ric"].stop, 3)),
    by_block=True,
    shortest=40,
    longest=196,
)
BABEL = Representation(
    "babel",
    babel.FPS,
    babel.LAYOUT,
    babel.decode_positions,
    (babel.LAYOUT["root_height"].start,),
    by_block=False,
    shortest=45,
    longest=250,
)
REPRESENTATIONS: Mapping[str, Representation] = {one.name: one for one in (HUMANML3D, BABEL)}
"""By name."""


def named(name: str) -> Representation:
    """The representation of a name; raises `MotionloomError` for a name that there is not."""
    if name not in REPRESENTATIONS:
        raise MotionloomError(f"there is no representation {name!r}; there are {', '.join(REPRESENTATIONS)}")
    return REPRESENTATIONS[name]


def of_width(width: int) -> Representation:
    """The representation with so many numbers per frame; raises `MotionloomError` where there is none."""
    for one in REPRESENTATIONS.values():
        if one.width == width:
            return one
    known = " or ".join(str(one.width) for one in REPRESENTATIONS.values())
    raise MotionloomError(f"motions with {width} numbers per frame are not known here; {known} are")
