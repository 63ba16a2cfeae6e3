"""Further two-person blocks for one prior, each a row of `lab.suites.duet`: other depths, other places, other seeds."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motionloom.errors import MotionloomError
from motionloom.weights.pair import PairBlock, blocks
from motionloom.weights.prior import Prior
from motionloom_lab.suites import duet_ways as ways
from motionloom_lab.suites.duet_ways import Way
from motionloom_lab.suites.harness import digest

LONGEST = 60
"""Letters of a block's name in a table, at most."""


@dataclass(frozen=True, eq=False)
class Beside:
    """A block as a row."""

    row: str
    """Its own name, and its sizes."""
    digest: str
    """Of its file."""
    way: Way


def beside(prior: Prior, files: Sequence[str | Path], asked: dict[str, Any]) -> tuple[Beside, ...]:
    """The blocks of files, or shipped ones, all over ``prior``; ``asked``: as of `duet_ways.sampled`.

    Raises MotionloomError for a file that is none, for another prior's block, and for two blocks of one name.
    """
    found: dict[str, Beside] = {}
    for file in files:
        block = PairBlock.load(file, prior)
        name = " ".join(block.name.split())[:LONGEST]
        if name in found:
            raise MotionloomError(f"two of the blocks to stand beside are called {name!r}; give each a name of its own")
        path = blocks().get(str(file)) or Path(file)
        found[name] = Beside(
            f"{name}: {sizes(block)}", digest(path)[:12], ways.sampled(prior, block.net(prior), **asked)
        )
    return tuple(found.values())


def sizes(block: PairBlock) -> str:
    """What tells blocks of one prior apart: 2 layers after layer 6."""
    config = block.config
    unaware = "" if config.aware else ", not aware"
    return f"{config.layers} {'layer' if config.layers == 1 else 'layers'} after layer {config.split}{unaware}"
