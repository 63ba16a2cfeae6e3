"""Sizes of a prior's network, as weight files and recipes say them."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

from motionloom.core.errors import MotionloomError


def are_sizes(*numbers: Any, most: int = 8192) -> bool:
    """Whether all are whole numbers of 1 to ``most``."""
    return all(type(number) is int and 0 < number <= most for number in numbers)


@dataclass(frozen=True)
class NetConfig:
    """Sizes of a prior network; the defaults are the published HumanML3D model."""

    variant: Literal["published", "modulated"] = "published"
    features: int = 263
    """Numbers per frame."""
    width: int = 512
    layers: int = 8
    heads: int = 4
    hidden: int = 1024
    """Width of the feed-forward layers."""
    text: int = 512
    """Width of the text encoder's vectors."""
    patch: int = 1
    """Frames per token."""
    flags: bool = False
    """Published only: a 2 x 4 table for per-frame transition flags, appended to the features (BABEL, DoubleTake)."""
    clock: bool = False
    """Modulated only: every token's time and the text shift every block, beside the noise (`PriorNet.enter`)."""
    dropout: float = 0.1

    def __post_init__(self) -> None:
        numbers = (self.features, self.width, self.layers, self.heads, self.hidden, self.text, self.patch)
        if self.variant not in ("published", "modulated"):
            raise MotionloomError(f"no network variant {self.variant!r}; there are published and modulated")
        flags = isinstance(self.flags, bool) and isinstance(self.clock, bool)
        whole = flags and are_sizes(*numbers, most=65536) and self.layers <= 256
        if not whole or self.width % (2 * self.heads) or not 0 <= self.dropout < 1:
            raise MotionloomError(f"the network's sizes are not usable: {asdict(self)}")

    @staticmethod
    def parse(values: dict[str, Any]) -> "NetConfig":
        """From plain data out of a recipe or a weight file; ``variant`` was called ``manner``."""
        try:
            plain = dict(values)
            return NetConfig(**{{"manner": "variant"}.get(key, key): value for key, value in plain.items()})
        except (TypeError, ValueError) as error:
            raise MotionloomError(f"the network's settings are not usable: {error}") from None
