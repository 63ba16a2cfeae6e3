"""Mask files: which parts of a predicted person move as in another motion and when; mistakes name the line.

`docs/predict.md` explains the keys, `motionloom.requests.mask` lists them, `motionloom predict --schema` prints
them as a JSON Schema. JSON is YAML, so both are read.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from motionloom.core.errors import MotionloomError, meant
from motionloom.core.files.text import shown
from motionloom.core.skeleton import SMPL22
from motionloom.goals.fields import LinedFile
from motionloom.goals.hold import FixedPart
from motionloom.goals.schemas import MASK_JOINTS
from motionloom.io.lined_yaml import Lined, read_lined
from motionloom.requests.mask import MASK, MAX_FRAME, PART

MAX_BYTES = 4_000_000
BESIDE = 0.25
"""Of a frame: so far behind a frame a stretch of frames ends, and the next one may begin."""


def read_mask(path: Path | str, *, fps: float) -> tuple[FixedPart, ...]:
    """Read a mask file; its frames are of rate ``fps``, the past's, and become seconds from the end of the past.

    Raises `MotionloomError` with file and line for whatever is wrong.
    """
    path = Path(path)
    return _Reader(path, fps).parts(read_lined(path, max_bytes=MAX_BYTES))


def check_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names, if all are of joints, groups or the root; raises `MotionloomError` that lists what there is."""
    known = tuple(names)
    if not known:
        raise MotionloomError(f"no joint is named; there are {', '.join(MASK_JOINTS)}")
    for name in known:
        if problem := _name_problem(name):
            raise MotionloomError(problem)
    return known


def fixes_everything(parts: Sequence[FixedPart], seconds: float) -> bool:
    """Whether all 22 joints are held at every moment from 0 to ``seconds``, so that nothing is left to predict."""
    spans: dict[int, list[tuple[float, float]]] = {joint: [] for joint in range(len(SMPL22))}
    for part in parts:
        for joint in SMPL22.resolve(name for name in part.joints if name != "root"):
            spans[joint] += part.spans
    return all(_reach(of_one) >= seconds for of_one in spans.values())


def _reach(spans: list[tuple[float, float]]) -> float:
    """How far from 0 the stretches go without a gap."""
    reached = 0.0
    for begin, end in sorted(spans):
        if begin > reached:
            break
        reached = max(reached, end)
    return reached


def _name_problem(name: str) -> str:
    if name in MASK_JOINTS:
        return ""
    return f"no joint or group is called {shown(name)}{meant(name, MASK_JOINTS)}; there are {', '.join(MASK_JOINTS)}"


@dataclass(frozen=True)
class _Reader(LinedFile):
    fps: float

    def parts(self, document: Lined) -> tuple[FixedPart, ...]:
        top = self.mapping(document, tuple(MASK), "a mask")
        if "hold" not in top:
            self.fail(document.line, "there is no 'hold'; list the parts that are held")
        return tuple(self.part(item) for item in self.items(top["hold"], "hold", most=MASK["hold"].many))

    def part(self, item: Lined) -> FixedPart:
        entries = self.mapping(item, tuple(PART), "a held part")
        if "joints" not in entries:
            self.fail(item.line, "a held part has no 'joints'; name joints, groups or root")
        names = tuple(self.joint(one) for one in self.items(entries["joints"], "joints", most=PART["joints"].many))
        if "frames" in entries:
            if "from" in entries or "to" in entries:
                self.fail(entries["frames"].key_line, "a held part has either 'frames' or 'from' and 'to', not both")
            rows = self.items(entries["frames"], "frames", most=PART["frames"].many)
            return FixedPart(names, tuple(self.stretch(row) for row in rows))
        begin, end = (self.field(entries, PART, name) for name in ("from", "to"))
        begin, end = begin or 0.0, math.inf if end is None else end
        if end <= begin:
            self.fail(entries["to"].line, f"'to' must be after 'from', {begin:g} s; got {end:g}")
        return FixedPart(names, ((begin, end),))

    def joint(self, node: Lined) -> str:
        if not isinstance(node.value, str):
            self.fail(node.line, f"a joint is named by a word; got {node.kind}")
        if problem := _name_problem(node.value):
            self.fail(node.line, problem)
        return node.value

    def stretch(self, row: Lined) -> tuple[float, float]:
        """Two frames as seconds: frame k lies (k + 1) / fps behind the past's end; a stretch ends beside a frame."""
        if not isinstance(row.value, list) or len(row.value) != 2:
            self.fail(row.line, f"'frames' lists pairs such as [0, 10]; got {row.kind}")
        first, behind = (self.frame(item) for item in row.value)
        if behind <= first:
            self.fail(row.line, f"frames [{first}, {behind}] end before they begin; the second is the one behind them")
        return (first + BESIDE) / self.fps if first else 0.0, (behind + BESIDE) / self.fps

    def frame(self, node: Lined) -> int:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_FRAME:
            self.fail(node.line, f"a frame is a whole number of 0 to {MAX_FRAME:,}; got {node.kind}")
        return value
