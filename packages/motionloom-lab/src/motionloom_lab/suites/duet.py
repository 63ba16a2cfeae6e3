"""Prefix completion of two people: the table of Shafir et al. 2024 (priorMDM, table 3) on held-out pairs of one's own.

One second of both is given and three are predicted. Besides the paper's errors every row has what an error cannot see:
how much the completions move, touch and lie in each other, beside the real ones.
"""

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.pair import PairBlock, blocks
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array, foot_skate
from motionloom_lab.metrics import pair as mp
from motionloom_lab.papers.mrt import MrtFile
from motionloom_lab.report.report import REAL, Report, Row, Value
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import duet_ways as ways
from motionloom_lab.suites.duet_ways import FRAMES, GIVEN, CompletionSettings, Crops, Way
from motionloom_lab.suites.harness import Parts, Run, check_names, digest
from motionloom_lab.suites.items import NoData, pairs_of
from motionloom_lab.suites.protocol import reported
from motionloom_train.data.pairs import Pair
from motionloom_train.data.progress import Say

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


def beside_rows(prior: Prior, files: Sequence[str | Path], how: CompletionSettings) -> tuple[Beside, ...]:
    """The blocks of files, or shipped ones, all over ``prior``.

    Raises MotionloomError for a file that is none, for another prior's block, and for two blocks of one name.
    """
    rows: dict[str, Beside] = {}
    for file in files:
        block = PairBlock.load(file, prior)
        name = " ".join(block.name.split())[:LONGEST]
        if name in rows:
            raise MotionloomError(f"two of the blocks to stand beside are called {name!r}; give each a name of its own")
        path = blocks().get(str(file)) or Path(file)
        rows[name] = Beside(f"{name}: {sizes(block)}", digest(path)[:12], ways.sampled(prior, block.net(prior), how))
    return tuple(rows.values())


def sizes(block: PairBlock) -> str:
    """What distinguishes blocks of one prior: 2 layers after layer 6."""
    config = block.config
    unaware = "" if config.aware else ", not aware"
    return f"{config.layers} {'layer' if config.layers == 1 else 'layers'} after layer {config.split}{unaware}"


KINDS = ("real", "zero", "constant", "silent", "communication", "ours", "mrt")
"""Rows of the table; ``silent``: the prior without communication; ``communication``: that alone."""
HELD_OUT = ("val", "test")
ERRORS = tuple(f"{what}_{k}" for what in ("root", "joint") for k in mp.HORIZONS)
LOOKS = ("speed", "hand_contact", "penetration", "skate")
CHUNK = 16
"""Crops of a piece that is kept."""
ZERO, CONSTANT, SILENT, ALONE, MRT = (
    "zero velocity",
    "constant velocity",
    "prior without communication",
    "communication only",
    "multi-range transformer",
)
COLUMNS = columns("duet-completion")


QUICK = CompletionSettings(crops=6, samples=2, steps=6)


def run(
    run: Run,
    *,
    block: str | Path | None = None,
    communication: Path | None = None,
    mrt: Path | None = None,
    beside: Sequence[str | Path] = (),
    how: CompletionSettings | None = None,
    kinds: Sequence[str] = KINDS,
    with_published: bool = True,
) -> Report:
    """Measure a two-person block on the held-out pairs of ``run.data``.

    Args:
        run: the prior, the data, and where pieces are kept.
        block: a shipped name or a file; None: the shipped one.
        communication: a block trained over `duet_ways.bare`; None: no such row.
        mrt: a file of `lab.papers.mrt`; None: no such row.
        beside: other blocks for the same prior, each a row of its own, of one sample.
        how: how completions are measured.
        kinds: the rows, out of `KINDS`.
        with_published: whether the report has what others published.
    """
    how = how or CompletionSettings()
    check_names(kinds, KINDS, "rows")
    prior = Prior.load(run.weights, device=run.device)
    own = PairBlock.load(chosen_block(block), prior) if "ours" in kinds else None
    every = ways_of(prior, own, how, kinds, communication=communication, mrt=mrt, device=run.device)
    others = beside_rows(prior, beside, how)
    crops = draw(held_out(pairs_of(run.data, captions=False, say=run.progress)), how)
    about = {
        "weights": run.label,
        "block": own.name if own else None,
        "device": run.device,
        "files": {str(k): _digest(v) for k, v in (("communication", communication), ("mrt", mrt)) if v},
        "block file": _digest_of(own) if own else None,
    }
    return measure(crops, every, how, run=run, kinds=kinds, beside=others, with_published=with_published, about=about)


def chosen_block(block: str | Path | None) -> str | Path:
    """The named one, or the shipped one; raises MotionloomError where there is none."""
    if block is not None:
        return block
    if not blocks():
        raise MotionloomError("no two-person block is shipped; name a file with --block")
    return next(iter(blocks()))


def held_out(pairs: Sequence[Pair]) -> list[Pair]:
    """Those of validation and test that are long enough for a crop; raises NoData where there is none."""
    chosen = [pair for pair in pairs if pair.split in HELD_OUT and pair.frames > FRAMES]
    if not chosen:
        raise NoData(
            f"there is no held-out pair of {FRAMES + 1} frames or more; ten pairs or more give one for validation"
        )
    return chosen


def draw(pairs: Sequence[Pair], how: CompletionSettings) -> Crops:
    """Random crops, every pair as often as any, either person first."""
    rng, motions = np.random.default_rng(how.seed), [pair.positions for pair in pairs]
    crops = [ways.random_crop(motions, FRAMES + 1, rng) for _ in range(how.crops)]
    return Crops(np.stack(crops), tuple(range(how.crops)))


def ways_of(
    prior: Prior,
    block: PairBlock | None,
    how: CompletionSettings,
    kinds: Sequence[str] = KINDS,
    *,
    communication: Path | None = None,
    mrt: Path | None = None,
    device: str = "cpu",
) -> dict[str, Way]:
    """Every way that there are weights for, by its kind."""
    result: dict[str, Way] = {"zero": ways.standing(), "constant": ways.gliding()}
    result["silent"] = ways.sampled(prior, ways.no_communication_net(prior), how)
    if communication is not None and "communication" in kinds:
        result["communication"] = ways.sampled(*ways.only_communication(prior, communication), how)
    if block is not None:
        result["ours"] = ways.sampled(prior, block.net(prior), how)
    if mrt is not None and "mrt" in kinds:
        result["mrt"] = ways.by_mrt(MrtFile.load(mrt, device=device).net)
    return result


def measure(
    crops: Crops,
    every: Mapping[str, Way],
    how: CompletionSettings,
    *,
    run: Run | None = None,
    kinds: Sequence[str] = KINDS,
    beside: Sequence[Beside] = (),
    with_published: bool = True,
    about: Mapping[str, Any] | None = None,
) -> Report:
    """The report of ways on crops. Pieces of blocks ``beside`` go by their own files: one more changes no other."""
    run = run or Run()
    terms = protocol_of(crops, how) | dict(about or {})
    settings = {**terms, **asdict(how)}
    parts = run.parts(settings)
    names = {"zero": ZERO, "constant": CONSTANT, "silent": SILENT, "communication": ALONE, "ours": "ours", "mrt": MRT}
    rows, errors = [], {}
    if "real" in kinds:
        rows.append(_row(REAL, {name: looks(crops.positions[:, :, :FRAMES])[name] for name in LOOKS}))
    for kind in [kind for kind in KINDS if kind in kinds and kind in every]:
        is_sampled = kind in ("silent", "communication", "ours")
        samples = how.samples if is_sampled else 1
        numbers = _measured(crops, every[kind], samples, parts, name=names[kind], progress=run.progress)
        one = f"{names[kind]}, one sample" if is_sampled else names[kind]
        errors[kind] = (names[kind], numbers)
        rows.append(_row(one, {name: numbers[name] for name in (*ERRORS, *LOOKS, "seconds")}))
        if samples > 1:
            mean = {name: numbers[f"mean_{name}"] for name in (*ERRORS, *LOOKS)}
            rows.append(_row(f"{names[kind]}, mean of {samples} samples", mean))
    for one in beside:
        own = run.parts({**settings, "beside": one.digest})
        numbers = _measured(crops, one.way, 1, own, name=f"beside {one.digest} {one.row}", progress=run.progress)
        errors[one.row] = (one.row, numbers)
        rows.append(_row(one.row, {name: numbers[name] for name in (*ERRORS, *LOOKS, "seconds")}))
    terms |= {"blocks beside": {one.row: one.digest for one in beside}} if beside else {}
    under = (*verdicts(errors), *notes("duet-completion"))
    others = "duet-completion" if with_published else ""
    return run.report("duet-completion", "Two people: three seconds after one", terms, rows, under, beside=others)


def _row(name: str, numbers: Mapping[str, Array]) -> Row:
    return Row(name, {column: Value.of([float(n) for n in values]) for column, values in numbers.items()})


def _measured(crops: Crops, way: Way, samples: int, parts: Parts, *, name: str, progress: Say) -> dict[str, Array]:
    """(crops,) of every number, piece by piece."""
    pieces = []
    for start in range(0, len(crops.numbers), CHUNK):

        def scored(start: int = start) -> dict[str, float]:
            progress(f"{name}: crop {start + 1} of {len(crops.numbers)}")
            numbers = score(crops.part(slice(start, start + CHUNK)), way, samples)
            return {f"{what} {i}": float(v) for what, values in numbers.items() for i, v in enumerate(values)}

        pieces.append(parts.once(f"{name} {start}", scored))
    whats = dict.fromkeys(key.rsplit(" ", 1)[0] for key in pieces[0])
    return {
        what: np.array([piece[f"{what} {i}"] for piece in pieces for i in range(len(piece) // len(whats))])
        for what in whats
    }


def score(crops: Crops, way: Way, samples: int) -> dict[str, Array]:
    """(crops,) each: errors of a sample and looks, averaged over samples; ``mean_``: those of the samples' mean."""
    real = crops.positions[:, :, :FRAMES]
    began = time.perf_counter()
    completions = np.stack([way(crops, sample) for sample in range(samples)])
    spent = (time.perf_counter() - began) / samples / len(real)
    each = [{**errors_of(real, one), **looks(one)} for one in completions]
    numbers = {name: np.mean([one[name] for one in each], axis=0) for name in each[0]}
    if samples > 1:
        mean = completions.mean(axis=0)
        numbers |= {f"mean_{name}": value for name, value in {**errors_of(real, mean), **looks(mean)}.items()}
    return numbers | {"seconds": np.full(len(real), spent)}


def errors_of(real: Array, motions: Array) -> dict[str, Array]:
    """(crops,) metres: the columns `ERRORS`."""
    errors = [mp.completion_errors(r, m) for r, m in zip(real, motions, strict=True)]
    return {
        f"{what}_{k}": np.array([getattr(one[n], what) for one in errors])
        for what in ("root", "joint")
        for n, k in enumerate(mp.HORIZONS)
    }


def looks(motions: Array) -> dict[str, Array]:
    """(crops,) each: the columns `LOOKS` of the frames after the prefix."""
    after = motions[:, :, mp.PREFIX - 1 :]
    ahead = after[:, :, 1:]
    speed = np.linalg.norm(np.diff(after, axis=2), axis=-1).mean(axis=(1, 2, 3)) * mp.FPS
    feet = [np.mean([foot_skate(person, mp.FPS).contact_speed for person in one]) for one in ahead]
    return {
        "speed": np.asarray(speed, dtype=np.float64),
        "hand_contact": np.array([mp.hand_contact(one) for one in ahead]),
        "penetration": 100 * np.array([mp.penetration(one) for one in ahead]),
        "skate": np.array(feet, dtype=np.float64),
    }


def verdicts(errors: Mapping[str, tuple[str, Mapping[str, Array]]]) -> tuple[str, ...]:
    """Ours against each other way, crop by crop."""
    if "ours" not in errors:
        return ()
    notes = []
    for kind, (name, numbers) in errors.items():
        if kind == "ours":
            continue
        apart = [Value.of((errors["ours"][1][f"root_{k}"] - numbers[f"root_{k}"]).tolist()) for k in mp.HORIZONS]
        gaps = ", ".join(f"{value.text()} m at {k} s" for k, value in zip(mp.HORIZONS, apart, strict=True))
        notes.append(
            f"Root error of ours, one sample, less that of {name}, crop by crop (below 0: ours is better): {gaps}."
        )
    return tuple(notes)


def protocol_of(crops: Crops, how: CompletionSettings) -> dict[str, Any]:
    """What is printed with the table."""
    known, true = GIVEN[how.given]
    values = {
        "how": how,
        "crops": len(crops.numbers),
        "fps": mp.FPS,
        "prefix": mp.PREFIX,
        "said": FRAMES - mp.PREFIX,
        "slots": known + 1,
        "known": known,
        "last": "of the real next frame" if true else "as between the last two given ones",
        "prompt": how.prompt or "none",
        "chosen": hashlib.sha256(np.round(crops.positions, 4).astype(np.float32).tobytes()).hexdigest()[:12],
    }
    return reported("duet-completion", values)


def _digest(path: Path) -> str:
    return digest(path)[:12] if path.is_file() else "missing"


def _digest_of(block: PairBlock) -> str:
    sha = hashlib.sha256()
    for key in sorted(block.tensors):
        sha.update(key.encode() + np.ascontiguousarray(block.tensors[key]).tobytes())
    return sha.hexdigest()[:12]
