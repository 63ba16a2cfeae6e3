"""The gate of a built set: a clip that does not show its recording stays outside, or has a reason to come in.

Of every take that was compared, ``fidelity/NAME`` of the set holds the figures (`retarget.fidelity`), whatever became
of it; `summary` collects them by source for ``set.json``.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.files.atomic import atomic_path, finished
from motionloom.core.files.text import plain_json
from motionloom.retarget.fidelity import Fidelity, Spread, compare
from motionloom_train.data.clips import Clip
from motionloom_train.data.paths import DAMAGED
from motionloom_train.data.sources import Places

FOLDER = "fidelity"
NO_REASON = "no reason stated"


@dataclass(frozen=True)
class Compared:
    """What `admit` found of one take."""

    source: str
    directions: dict[str, tuple[float, float]]
    """Median and 95th percentile in degrees, by line."""
    places: dict[str, tuple[float, float]]
    """The same in centimetres, by joint, at the person's proportions."""
    by_leg: dict[str, tuple[float, float]]
    """The same, the recording scaled by its legs alone."""
    faults: tuple[str, ...]
    allowed: str = ""
    """Why it came in with faults; empty where it did not, or has none."""

    @property
    def refused(self) -> bool:
        """Whether the take is not in the set."""
        return bool(self.faults) and not self.allowed


def fidelity_of(places: Places, clip: Clip) -> Fidelity:
    """How truly a built clip, whole and not mirrored, shows its recording."""
    positions = clip.positions()
    own = hml.resample_positions(places.own, places.fps)[: len(positions)]
    return compare(own, positions)


def admit(out: Path, take: str, places: Places, clip: Clip, *, allowed: str = "") -> None:
    """Compare a take's clip with its recording and write the figures down.

    Args:
        out: folder of the built set.
        allowed: why the take comes in with faults; empty if it must have none.

    Raises `MotionloomError` for a clip that is off and not allowed.
    """
    fidelity = fidelity_of(places, clip)
    faults = tuple(fidelity.faults())
    compared = Compared(
        source=clip.source,
        directions=_pairs(fidelity.directions),
        places=_pairs(fidelity.places),
        by_leg=_pairs(fidelity.by_leg),
        faults=faults,
        allowed=allowed if faults else "",
    )
    with atomic_path(out / FOLDER / take) as temp:
        temp.write_text(json.dumps(asdict(compared)), encoding="utf-8")
    if compared.refused:
        raise MotionloomError(
            f"its body does not do what was recorded: {', '.join(faults[:4])}; see 'motionloom data look', and let it "
            "in all the same with --allow NAME=REASON"
        )


def _pairs(spreads: Mapping[str, Spread]) -> dict[str, tuple[float, float]]:
    return {name: (spread.median, spread.high) for name, spread in spreads.items()}


def read_compared(out: Path) -> dict[str, Compared]:
    """By take; raises `MotionloomError` for a damaged file."""
    return {path.name: _read(path) for path in finished(out / FOLDER, "*")}


def _read(path: Path) -> Compared:
    try:
        about = plain_json(path.read_text(encoding="utf-8"))
        return Compared(
            source=str(about["source"]),
            directions=_read_pairs(about["directions"]),
            places=_read_pairs(about["places"]),
            by_leg=_read_pairs(about["by_leg"]),
            faults=tuple(map(str, about["faults"])),
            allowed=str(about["allowed"]),
        )
    except DAMAGED as error:
        raise MotionloomError(
            f"{path} does not hold a clip's figures ({error}); delete it and its name in done/, and build again"
        ) from None


def _read_pairs(rows: Mapping[str, Sequence[float]]) -> dict[str, tuple[float, float]]:
    return {str(name): (float(median), float(high)) for name, (median, high) in rows.items()}


def refused(out: Path, take: str) -> bool:
    """Whether an earlier build kept the take out for its body."""
    path = out / FOLDER / take
    return path.exists() and _read(path).refused


def summary(compared: Mapping[str, Compared]) -> dict[str, Any]:
    """By source: how many came in and how many did not, and the errors of those that did.

    Of each line and joint the median over clips of their medians, and the 95th percentile of their 95th percentiles.
    """
    result = {}
    for source in sorted({one.source for one in compared.values()}):
        of = [one for one in compared.values() if one.source == source]
        inside = [one for one in of if not one.refused]
        result[source] = {
            "clips": len(inside),
            "refused": len(of) - len(inside),
            "allowed": sum(bool(one.allowed) for one in inside),
            "degrees": _together([one.directions for one in inside]),
            "cm": _together([one.places for one in inside]),
            "cm by legs alone": _together([one.by_leg for one in inside]),
        }
    return result


def _together(parts: Sequence[dict[str, tuple[float, float]]]) -> dict[str, list[float]]:
    result = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        medians, highs = np.array([part[name] for part in parts if name in part]).T
        result[name] = [round(float(np.median(medians)), 1), round(float(np.percentile(highs, 95)), 1)]
    return result


def lines_of(about: Mapping[str, Any]) -> list[str]:
    """`summary` in words, a line for each source."""
    result = []
    for source, row in about.items():
        line = f"{source}: {row['clips']} clips like their recordings"
        if row["clips"]:
            (median, high), place = row["degrees"]["all"], row["cm"]["all"][0]
            line += f", {median:g} degrees (95 %: {high:g}) and {place:g} cm off"
        line += f", {row['allowed']} of them allowed by name" if row["allowed"] else ""
        result.append(line + (f"; {row['refused']} refused" if row["refused"] else ""))
    return result
