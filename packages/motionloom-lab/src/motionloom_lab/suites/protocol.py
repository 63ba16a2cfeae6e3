"""How a prior is measured: every setting that changes a number, in values that are printed into the report.

The published protocol (Guo et al. 2022, as MDM and PriorMDM ran it) in its own words: lengths from the ground truth,
batches of 32, replications with a 95 % interval of 1.96 sigma / sqrt(replications).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from string import Formatter
from typing import Any, Literal, TypedDict

from motionloom.core.diffusion import SOLVERS
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import Representation
from motionloom.core.reading import read_table
from motionloom.tasks.text import GUIDANCE, LARGEST_SEED, SOLVER, SPACING, STEPS

SPLITS = ("train", "val", "test")
RECORDED = ("cmu", "accad", "ui_prmd")
"""Recordings with held-out rows that are free for any use."""
PUBLISHED_CAPTION = 22
"""Tokens: the caption length that MDM before January 2024 and PriorMDM gave their evaluator for generated motions."""
STRIDE = 1 << 32
"""Between the first seeds of two replications; the seeds of a replication stay below it."""
MOST_STEPS, MOST_REPLICATIONS, MOST_ITEMS = 12, 1000, 100_000
GUIDANCES = (-100, 100)
"""Others make no motion; usual values are 1 to 7."""
SEEDS = (0, 2**31 - 1)
"""Of suites that count on from their seed."""


@dataclass(frozen=True)
class Selection:
    """Which stretches of which recordings are the real motions."""

    splits: tuple[str, ...] = ("val", "test")
    sources: tuple[str, ...] = RECORDED
    """Beginnings of the names of sources; empty: all."""
    mirrored: bool = True
    """With their mirror images, whose captions have left and right exchanged, as in HumanML3D's own test set."""
    shortest: int = 40
    """Frames."""
    longest: int = 196
    """Frames; up to four more are cut off, and what is longer is left out: its caption is too coarse for a part."""
    unit: int = 4
    """Lengths are cropped to multiples of it; 1 keeps them."""
    shorter_third: bool = False
    """A third of the lengths is one unit shorter, as the published loader chooses them."""

    def __post_init__(self) -> None:
        if not self.splits or not set(self.splits) <= set(SPLITS):
            raise MotionloomError(f"the splits are train, val and test; got {', '.join(self.splits) or 'none'}")
        if not (1 <= self.unit <= self.shortest <= self.longest <= 10_000):
            raise MotionloomError(
                f"lengths of {self.shortest} to {self.longest} frames in multiples of {self.unit} cannot be taken"
            )

    def described(self) -> dict[str, Any]:
        """For a report."""
        values = {
            "one": self,
            "splits": list(self.splits),
            "sources": list(self.sources) or "all",
            "mirrored": "with" if self.mirrored else "without",
            "third": ", a third of them one unit shorter" if self.shorter_third else "",
        }
        return reported("selection", values)


@dataclass(frozen=True)
class Transitions:
    """Long motions out of several captions, and the stretches around their seams (PriorMDM's protocol)."""

    handshake: int = 20
    """Frames that two neighbours share: 20 for HumanML3D, 30 for BABEL (`Transitions.of`)."""
    margin: int = 40
    """Frames around the handshake that belong to the transition, half on either side."""
    unfoldings: int = 2
    ramp: int = 10
    """Frames on either side of a handshake that DoubleTake's second take may change (b)."""
    soft: float | None = None
    """M_soft, M_hard and T' of DoubleTake (`papers.double_take.TakeSettings`); None: those of its mode."""
    hard: float | None = None
    restart: float | None = None
    rows: str = ""
    """A table of ``tables.toml`` whose rows are measured; empty: none."""
    clip: int = 196
    """Frames of the longest motion that the priors saw."""
    mode: str = "paper"
    """DoubleTake of the rows of a table: as the paper describes it, or ``published`` as the released code has it."""
    intervals: int = 32
    """Captions of one long motion, and of one batch of R-precision."""
    replications: int = 3
    steps: int = STEPS
    guidance: float = GUIDANCE
    seed: int = 0

    def __post_init__(self) -> None:
        frames, several = (0, 100), (1, 1000)
        check_ranges(
            self,
            {"handshake": (1, 100), "margin": frames, "ramp": frames, "unfoldings": several, "intervals": several},
        )
        check_ranges(self, {"replications": (1, MOST_REPLICATIONS), "steps": (1, 1000), "guidance": GUIDANCES})
        known = ("", *tables())
        _need(self.rows in known, f"the tables are {', '.join(known[1:])}; got {self.rows!r}")
        _need(self.mode in ("paper", "published"), f"DoubleTake's modes are paper and published; got {self.mode!r}")
        check_ranges(self, {"seed": (0, LARGEST_SEED - 1 - (self.replications + 1) * STRIDE)})

    @property
    def window(self) -> int:
        """Frames of a transition: 60 for HumanML3D."""
        return self.handshake + self.margin

    @staticmethod
    def of(kind: Representation) -> "Transitions":
        """The usual protocol for a representation: a handshake of one second."""
        return Transitions(handshake=kind.second, clip=kind.longest)

    @property
    def variants(self) -> Mapping[str, Mapping[str, Any]]:
        """Settings of the rows of the table, by their names."""
        return tables()[self.rows] if self.rows else {}

    @property
    def shortest(self) -> int:
        """Visible frames of an interval at least: two handshakes, two ramps and 10 frames in each row."""
        joins = [(self.handshake, self.ramp)]
        joins += [(row.get("handshake", self.handshake), row.get("ramp", self.ramp)) for row in self.variants.values()]
        return max(2 * h + 2 * b + 10 - h // 2 for h, b in joins)

    @property
    def longest(self) -> int:
        """Visible frames at most: with both handshakes a row then has as many as the priors saw."""
        handshakes = (row.get("handshake", self.handshake) for row in self.variants.values())
        return max(self.shortest, self.clip - max(self.handshake, *handshakes, 0))

    @property
    def seams(self) -> int:
        """Transitions of one replication."""
        return self.unfoldings * (self.intervals - 1)

    def first_seed(self, replication: int, unfolding: int) -> int:
        """No two long motions share one, nor do their segments."""
        return self.seed + replication * STRIDE + unfolding * (1 << 16)

    @property
    def drawing(self) -> "LongDrawing":
        """What sampling is asked beside seeds."""
        return {"steps": self.steps, "guidance": self.guidance}

    def sampling(self) -> dict[str, Any]:
        """Everything that changes the motions of one replication: what a resumed run must agree in."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "replications"}

    def described(self) -> dict[str, Any]:
        """For a report."""
        shares = {"M_soft": self.soft, "M_hard": self.hard, "T'": self.restart}
        takes = [f"{name} = {share:g}" for name, share in shares.items() if share is not None]
        takes += [f"the rows of {self.rows} are of its mode {self.mode!r}"] if self.rows else []
        values = {"how": self, "solver": SOLVER, "spacing": SPACING, "guidance": float(self.guidance)}
        values["takes"] = "; ".join(takes) or "M_soft, M_hard and T' of its modes"
        return reported("transitions", values)


@cache
def tables() -> dict[str, dict[str, dict[str, Any]]]:
    """The tables of ``tables.toml``: settings by the names of rows, by the names of tables."""
    return read_table("motionloom_lab.suites", "tables.toml")


class LongDrawing(TypedDict):
    """How long motions are sampled."""

    steps: int
    guidance: float


class Drawing(TypedDict):
    """How motions are sampled, as `tasks.text.sample_features` takes it."""

    steps: int
    guidance: float
    solver: str
    spacing: str


@dataclass(frozen=True)
class Protocol:
    """How motions are generated and judged."""

    count: int | None = None
    """Real items, spread evenly over the set; None: all of them."""
    lengths: Literal["exact", "padded"] = "exact"
    """Generated at the real length, or at 196 frames and cut to it, as published."""
    caption_length: Literal["true", "published"] = "true"
    """``published``: generated motions are matched with captions read as if 22 tokens long (`PUBLISHED_CAPTION`)."""
    batch: int | None = 32
    """Motions that a caption's own one is looked for among; None: the whole set."""
    replications: int = 5
    multimodality: tuple[int, int] = (10, 10)
    """Captions, and motions of each; (0, 0) leaves it out."""
    multimodal_replications: int = 3
    """Only the first so many replications measure it, as published."""
    steps: tuple[int, ...] = (5, 12, STEPS)
    solver: str = SOLVER
    spacing: str = SPACING
    guidance: float = GUIDANCE
    seed: int = 0

    def __post_init__(self) -> None:
        _need(self.lengths in ("exact", "padded"), f"lengths are exact or padded; got {self.lengths!r}")
        _need(
            self.caption_length in ("true", "published"),
            f"the caption length is true or published; got {self.caption_length!r}",
        )
        steps = self.steps
        _need(
            0 < len(steps) <= MOST_STEPS and len(set(steps)) == len(steps) and min(steps) >= 1,
            f"steps are 1 to {MOST_STEPS} different numbers of 1 or more; got {', '.join(map(str, steps)) or 'none'}",
        )
        check_ranges(self, {"replications": (1, MOST_REPLICATIONS), "guidance": GUIDANCES})
        check_ranges(self, {"seed": (0, LARGEST_SEED - 1 - (self.replications + 1) * STRIDE)})
        _need(self.batch is None or 4 <= self.batch <= 4096, f"a batch is 4 to 4096 motions, or all; got {self.batch}")
        least = self.batch or 4
        _need(
            self.count is None or least <= self.count <= MOST_ITEMS,
            f"a count of {self.count} does not fill a batch of {least}, or is too large; take {least} to {MOST_ITEMS}",
        )
        captions, samples = self.multimodality
        _need(
            (captions, samples) == (0, 0) or (1 <= captions <= 1000 and 2 <= samples <= 1000),
            f"multimodality is captions x motions of each, such as 10x10, or 0; got {captions}x{samples}",
        )
        _need(self.solver in SOLVERS, f"no solver {self.solver!r}; there are {', '.join(SOLVERS)}")

    def drawing(self, steps: int) -> Drawing:
        """What sampling is asked beside seeds."""
        return {"steps": steps, "guidance": self.guidance, "solver": self.solver, "spacing": self.spacing}

    def seeds(self, replication: int, rows: int, *, after: int = 0) -> list[int]:
        """One seed per motion of a replication; no two replications share one. ``after``: so many were used before."""
        if after + rows > STRIDE:
            raise ValueError(f"{after + rows} motions in one replication")
        first = self.seed + replication * STRIDE + after
        return list(range(first, first + rows))

    def sampling(self) -> dict[str, Any]:
        """Everything that changes the motions of one replication or their numbers: what a resumed run must agree in."""
        names = (
            "lengths",
            "caption_length",
            "batch",
            "multimodality",
            "solver",
            "spacing",
            "guidance",
            "seed",
            "count",
            "multimodal_replications",
        )
        return {name: getattr(self, name) for name in names}

    def described(self, selection: Selection, *, data: str, items: int, evaluator: str) -> dict[str, Any]:
        """Everything that a reader needs to judge the numbers, as plain data; no place on anybody's disk."""
        captions, samples = self.multimodality
        several = f"{captions} captions x {samples} motions, in the first {self.multimodal_replications} replications"
        exact = self.lengths == "exact"
        values = {
            "how": self,
            "fps": FPS,
            "lengths": "exact, from the ground truth" if exact else "196 frames, cut to the ground truth's",
            "caption_length": "true"
            if self.caption_length == "true"
            else f"{PUBLISHED_CAPTION} for generated motions, as published",
            "batch": self.batch or "the whole set",
            "partial": "dropped" if self.batch else "none",
            "steps": list(self.steps),
            "guidance": float(self.guidance),
            "several": several if captions else "not measured",
        }
        chosen = {"data": data, **selection.described(), "items": items, "evaluator": evaluator}
        return chosen | reported("text", values)


def quick(protocol: Protocol) -> Protocol:
    """The same in about a minute: one batch, two replications, and at most two step counts that are not large."""
    few = tuple(s for s in protocol.steps if s <= STEPS)[:2] or protocol.steps[:1]
    return replace(
        protocol, count=protocol.batch or 32, replications=2, multimodality=(4, 6), multimodal_replications=1, steps=few
    )


def quick_transitions(how: Transitions) -> Transitions:
    """The same in minutes: eight captions, one unfolding, two replications."""
    return replace(how, intervals=min(how.intervals, 8), unfoldings=1, replications=min(how.replications, 2))


def check_ranges(settings: object, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Raise MotionloomError where a setting of that name is not from the first to the second number."""
    for name, (least, most) in ranges.items():
        value = getattr(settings, name)
        if not least <= value <= most:
            raise MotionloomError(f"{name.replace('_', ' ')} must be from {least:,} to {most:,}; got {value}")


def _need(fine: bool, message: str) -> None:
    if not fine:
        raise MotionloomError(message)


VALUE = re.compile(r"\{([\w.]+)\}")
"""A text that is a value and nothing else."""


def reported(table: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """How a report was measured: a table of ``protocols.toml`` with the values that its texts name."""
    result: dict[str, Any] = {}
    for name, text in read_table("motionloom_lab.suites", "protocols.toml")[table].items():
        alone = VALUE.fullmatch(text)
        result[name] = Formatter().get_field(alone[1], (), values)[0] if alone else text.format(**values)
    return result
