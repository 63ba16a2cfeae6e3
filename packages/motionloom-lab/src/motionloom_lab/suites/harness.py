"""What all suites share: where and how they measure, what is opened and refused first, rows over replications, and
finished pieces of a long run, each in a small file of its own, so that a run that was stopped goes on.
"""

import hashlib
import json
import math
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import HUMANML3D, Representation
from motionloom.core.files.text import plain_json
from motionloom.core.models.container import weights_digest
from motionloom.core.models.prior import Prior, find_weights
from motionloom.core.reading import read_bytes
from motionloom.kinematics import physics
from motionloom.kinematics.physics import Array
from motionloom.tasks.text import generate, sample_features
from motionloom_lab.evaluator import evaluators, own
from motionloom_lab.evaluator.evaluators import Evaluator
from motionloom_lab.metrics import retrieval
from motionloom_lab.metrics.skate import skate
from motionloom_lab.report import tables
from motionloom_lab.report.files import write_json
from motionloom_lab.report.report import Column, Report, Row, Value
from motionloom_train.data.paths import DAMAGED
from motionloom_train.data.progress import Say, silent

LARGEST = 1 << 20


def fingerprint(settings: Mapping[str, Any]) -> str:
    """Changes whenever a setting does; settings are plain JSON data."""
    said = json.dumps(settings, sort_keys=True, allow_nan=False)
    return hashlib.sha256(said.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Parts:
    """The pieces of one run: ``FOLDER/parts/NAME.json`` holds a piece's numbers and the fingerprint of their settings.

    Without a folder nothing is kept and nothing found.
    """

    folder: Path | None
    settings: str
    """`fingerprint` of everything that changes a piece's numbers."""

    def path(self, name: str) -> Path | None:
        """Where the piece lies; the name is made safe for a file."""
        return self.folder / "parts" / f"{re.sub(r'[^a-z0-9]+', '-', name.lower())}.json" if self.folder else None

    def find(self, name: str) -> dict[str, float] | None:
        """The numbers of a piece that is finished, None otherwise; MotionloomError for one of another run."""
        path = self.path(name)
        if path is None or not path.is_file():
            return None
        try:
            found = plain_json(read_bytes(path, max_bytes=LARGEST))
            settings, numbers = str(found["settings"]), {str(k): float(v) for k, v in found["numbers"].items()}
            if not all(map(math.isfinite, numbers.values())):
                raise ValueError("it holds numbers that are not finite")
        except DAMAGED as error:
            raise MotionloomError(f"{path} is not a part of this run ({error}); delete it to go on") from None
        if settings != self.settings:
            raise MotionloomError(
                f"{path} was made with other settings; name another --out folder or delete {path.parent}"
            )
        return numbers

    def keep(self, name: str, numbers: Mapping[str, float]) -> None:
        """Write a finished piece, whole or not at all."""
        path = self.path(name)
        if path is not None:
            write_json(path, {"settings": self.settings, "numbers": dict(numbers)})

    def once(
        self,
        name: str,
        make: Callable[[], Mapping[str, float]],
        line: Callable[[Mapping[str, float]], str] | None = None,
        progress: Say = silent,
    ) -> dict[str, float]:
        """The numbers of a piece: kept ones, or made and kept now, which ``line`` says in a line for ``progress``."""
        found = self.find(name)
        if found is None:
            found = dict(make())
            self.keep(name, found)
            if line is not None:
                progress(line(found))
        return found


CHUNK = 64
"""Motions embedded at once."""
DIVERSITY_PAIRS = 300
PHYSICAL = ("skate_share", "skate_speed", "skate_slide", "penetration", "jerk", "bone_error")
"""Names of the numbers of `physical`, in order."""


class Generate(Protocol):
    """Motions for prompts, row i from seed ``seed + i``."""

    def __call__(self, prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        """One (frames, 22, 3) array in metres per prompt, and their frames per second."""
        ...


def say(line: str) -> None:
    """Report progress on stderr."""
    print(line, file=sys.stderr, flush=True)


@dataclass(frozen=True)
class Run:
    """Where and how a suite measures. The report is given back, not written."""

    weights: str | Path = "default"
    """A shipped name or a file: a prior, or a predictor for suites of prediction."""
    data: Path | str | None = None
    """Real motion: a built set, recordings, or what a suite says."""
    evaluator: str = "own"
    """Who judges text: the shipped evaluator or a file."""
    folder: Path | None = None
    """Keeps what is done, so that the same run goes on after a stop; None: nothing is kept."""
    device: str = "cpu"
    command: str = ""
    """The command line that measures the same again, for the report."""
    progress: Say = silent

    @property
    def label(self) -> str:
        """The weights in a row's name."""
        return Path(self.weights).stem

    def prior(self, steps: int, kind: Representation = HUMANML3D) -> Prior:
        """The weights; MotionloomError where they do not draw what the evaluator reads, or not in so many steps."""
        return readable(Prior.load(self.weights, device=self.device), steps, kind)

    def judge(self, kind: Representation | None = HUMANML3D) -> Evaluator:
        """The evaluator; MotionloomError for a file that is none, and for one of another representation than ``kind``
        (None: any)."""
        judge = evaluators.load_evaluator(self.evaluator)
        if kind is not None and judge.representation is not kind:
            raise MotionloomError(
                f"{judge.name} reads {judge.representation}, and {kind} are judged here; name another"
            )
        return judge

    def settings(self, judge: Evaluator) -> dict[str, Any]:
        """What the weights, the evaluator and the device change, for `parts`."""
        file = evaluator_file(self.evaluator)
        return {
            "weights": digest(find_weights(self.weights)),
            "evaluator": [judge.name, dict(judge.about), digest(file) if file else ""],
            "device": self.device,
        }

    def parts(self, settings: Mapping[str, Any]) -> Parts:
        """Where pieces of this run are kept."""
        return Parts(self.folder, fingerprint(settings))

    def report(
        self,
        suite: str,
        title: str,
        protocol: Mapping[str, Any],
        rows: Iterable[Row],
        notes: Iterable[str],
        *,
        columns: tuple[Column, ...] | None = None,
        beside: str = "",
    ) -> Report:
        """What a suite measured. columns: None: the suite's. beside: name of published rows that go under ``rows``."""
        shown = columns or tables.columns(suite)
        others = tables.published(beside, [column.name for column in shown]) if beside else ()
        return Report(suite, title, self.command, protocol, shown, (*rows, *others), tuple(notes))


def readable(prior: Prior, steps: int, kind: Representation = HUMANML3D) -> Prior:
    """The prior; MotionloomError unless it draws the representation that is judged, in so many steps."""
    if len(prior.mean) != kind.width or prior.fps != kind.fps:
        raise MotionloomError(
            f"these weights draw {len(prior.mean)} numbers at {prior.fps:g} frames per second; the evaluator reads "
            f"{kind}: name one of theirs with --evaluator"
        )
    check_steps(steps, prior.schedule.steps)
    return prior


def check_steps(steps: int, most: int) -> None:
    """Raise MotionloomError where weights cannot be sampled in so many steps."""
    if not 1 <= steps <= most:
        raise MotionloomError(f"{steps} steps cannot be taken; these weights take 1 to {most}")


def check_names(names: Sequence[str], known: Collection[str], what: str) -> None:
    """Raise MotionloomError for no name and for unknown ones; ``what`` they are, such as "rows"."""
    if not names or not set(names) <= set(known):
        raise MotionloomError(f"the {what} are {', '.join(known)}; got {', '.join(names)[:200] or 'none'}")


def weight_marks(paths: Sequence[Path]) -> dict[str, str]:
    """Name of each weight file and the first 12 digits of its SHA-256, by which pages say what they measured."""
    return {path.stem: digest(path)[:12] for path in paths}


def digest(path: Path) -> str:
    """The beginning of the SHA-256 of a file; of weights without their graphs."""
    return weights_digest(path)[:16]


def evaluator_file(evaluator: str) -> Path | None:
    """Where an evaluator lies, if it is there."""
    path = own.evaluators().get(own.SHIPPED) if evaluator == "own" else Path(evaluator)
    return path if path and path.is_file() else None


def embedded(evaluator: Evaluator, motions: Sequence[np.ndarray]) -> Array:
    """(motions, width) of motions (frames, numbers) each."""
    return np.concatenate([evaluator.motions(motions[k : k + CHUNK]) for k in range(0, len(motions), CHUNK)])


def diversity(motions: Array, replication: int) -> float:
    """Mean distance of random pairs of embedded motions (motions, width), at most `DIVERSITY_PAIRS`."""
    return retrieval.diversity(motions, pairs=min(DIVERSITY_PAIRS, len(motions)), seed=replication)


def plain_words(text: str) -> str:
    """A caption in lower case without punctuation."""
    return " ".join(re.findall(r"\w+", text.lower()))


def physical(positions: np.ndarray, fps: float = FPS) -> dict[str, float]:
    """The numbers of `PHYSICAL` for one motion (frames, 22, 3) metres, the floor at y = 0.

    Skate: share of frames in %, cm/s, mm per frame (`lab.metrics.skate`); cm under the floor; m/s³; mm.
    """
    found = skate(positions, fps)
    return {
        "skate_share": 100 * found.share,
        "skate_speed": found.speed,
        "skate_slide": found.slide,
        "penetration": 100 * physics.penetration(positions),
        "jerk": physics.jerk(positions, fps).mean,
        "bone_error": 1000 * physics.bone_length_error(positions),
    }


def averaged(numbers: Sequence[Sequence[float]] | Array, frames: Sequence[int]) -> dict[str, float]:
    """Means of (motions, numbers of `PHYSICAL`), weighted by length."""
    return dict(zip(PHYSICAL, np.average(np.asarray(numbers), axis=0, weights=frames).tolist(), strict=True))


def physical_mean(clips: Sequence[np.ndarray], fps: float = FPS) -> dict[str, float]:
    """The numbers of `PHYSICAL` of several clips, weighted by length."""
    return averaged([list(physical(clip, fps).values()) for clip in clips], [len(clip) for clip in clips])


def replicated(
    name: str,
    count: int,
    measure: Callable[[int], Mapping[str, float]],
    parts: Parts,
    said: Callable[[Mapping[str, float]], str],
    progress: Say = silent,
) -> list[dict[str, float]]:
    """The numbers of every replication of one row, each kept as it is done.

    Args:
        name: the row, in the names of what is kept and in lines of progress.
        count: replications.
        measure: the numbers of one.
        parts: where they are kept; what is there already is not measured again.
        said: the numbers in a few words.
        progress: called with a line for each that was measured now.
    """
    return [
        parts.once(
            f"{name} {r}",
            lambda r=r: measure(r),
            lambda numbers, r=r: f"{name}, replication {r + 1} of {count}: {said(numbers)}",
            progress,
        )
        for r in range(count)
    ]


def row_of(
    name: str, found: Sequence[Mapping[str, float]], columns: Sequence[Column], constant: Collection[str] = ()
) -> Row:
    """Means and intervals over replications; numbers that are ``constant`` have no interval."""
    samples = {c.name: [numbers[c.name] for numbers in found if c.name in numbers] for c in columns}
    return Row(name, {k: Value(v[0]) if k in constant else Value.of(v) for k, v in samples.items() if v})


def plain_row(name: str, numbers: Mapping[str, float]) -> Row:
    """Numbers that were measured once."""
    return Row(name, {key: Value(value) for key, value in numbers.items()})


def generator(
    prior: Prior,
    *,
    steps: int | None = None,
    guidance: float | None = None,
    solver: str | None = None,
    finished: bool = False,
    best_of: int = 1,
) -> Generate:
    """Text to joint positions; what is None keeps the default of `generate`.

    Without ``finished`` they are the network's own of the words as they are, whose bones may breathe and whose feet may
    slide. ``finished`` are what `motionloom generate` writes: numbers in the words kept, actions one after the other,
    what the words say plainly looked for and generated again, constant bones, planted feet held still.
    """
    said = {"steps": steps, "guidance": guidance, "solver": solver}
    how: dict[str, Any] = {name: value for name, value in said.items() if value is not None} | {"best_of": best_of}

    def make(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        if finished:
            return [one.positions() for one in generate(prior, prompts, seconds=seconds, seed=seed, **how)], prior.fps
        frames, seeds = [round(seconds * prior.fps)] * len(prompts), [seed + i for i in range(len(prompts))]
        sampled = sample_features(prior, prompts, frames, seeds=seeds, **how) if prompts else []
        return [humanml.decode_positions(one.astype(np.float64)) for one in sampled], prior.fps

    return make
