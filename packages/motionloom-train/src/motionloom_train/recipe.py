"""Recipes: what to train, on what, how. A recipe is a small TOML file; unknown keys are errors."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar, get_origin, get_type_hints

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import read_utf8
from motionloom_train.nets.prior import NetConfig
from motionloom_train.precision import CHOICES

MAX_BYTES = 1 << 16
MAX_DOTS = 200
"""Of one line."""


@dataclass(frozen=True)
class Recipe:
    """One training run."""

    name: str = "prior"
    licence: str = ""
    """What one may do with the weights; empty: the licences of the training data, listed."""
    sources: list[str] = field(default_factory=list)
    """Sources of the built set to use, by the beginning of their names; empty: all."""
    steps: int = 20_000
    """Steps of the whole run."""
    batch: int = 64
    """Windows per step and process."""
    windows: list[int] = field(default_factory=lambda: [48, 80, 120, 196])
    """Lengths of windows in frames, one sampled per step."""
    shares: list[float] = field(default_factory=lambda: [0.2, 0.3, 0.35, 0.15])
    """How often each length is sampled."""
    favour: dict[str, Any] = field(default_factory=dict)
    """How often groups are sampled, 1 being usual, over `motionloom_train.data.batches.FAVOUR`."""
    fresh: float = 0.0
    """Share of each batch that shows only what ``fresh_of`` names; the rest shows only the rest of the set."""
    fresh_of: list[str] = field(default_factory=list)
    """Beginnings of sources (``sl_internal``) and of groups (``manner ``): what counts as fresh."""
    rate: float = 8e-4
    """Learning rate after the warm-up."""
    warmup: int = 300
    cooldown: float = 0.3
    """Last share of the run in which the rate falls linearly to zero."""
    decay: float = 0.01
    """Weight decay of matrices."""
    clip: float = 1.0
    """Largest norm of the gradient."""
    ema: float = 0.999
    """Decay of the averaged weights that are sampled from."""
    amp: str = "auto"
    """What is multiplied in: ``bf16``, ``float32``, or whichever is quicker here; see `motionloom_train.precision`."""
    compile: bool = False
    """Compile the network with torch.compile, on a CPU; launch whole steps of a prior as graphs, on a GPU."""
    displacement: float = 0.0
    """Weight of `objectives.displacement_error` in the loss; 0: the published loss alone."""
    geometric: float = 0.0
    """Weight of MDM's geometric losses, `objectives.geometric_error`, for sets of BABEL's numbers; 0: without."""
    early: float = 0.0
    """Share of the samples whose noise level is drawn as the sampler's spacing ``early`` goes; the rest evenly."""
    heights: float = 1.0
    """How much more the heights of the joints and of the root count in the loss: sitting down, lying, getting up."""
    drop_text: float = 0.1
    """Share of samples trained without their text."""
    schedule: str = "cosine"
    levels: int = 1000
    seed: int = 0
    save_every: int = 500
    """Steps between checkpoints."""
    show_every: int = 0
    """Steps between sample pictures; 0: none."""
    prompts: list[str] = field(default_factory=lambda: ["a person walks forward", "a person jumps", "someone waves"])
    """What the sample pictures show."""
    start: str = ""
    """Weights to go on from: a shipped name or a path; empty: random ones."""
    start_sha256: str = ""
    """SHA-256 of the file that ``start`` names; another file is refused. Empty: any."""
    keep: float = 0.0
    """Weight of the squared distance between the estimates of the network and of ``start``, on what is not fresh."""
    control: str = ""
    """Control training: what is given, see `motionloom_train.control.CONTROLS`."""
    full: bool = False
    """Control training: change all weights, as published, instead of making an adapter."""
    rank: int = 12
    """Rank of an adapter."""
    given_rank: int = 64
    """Rank of an adapter's input for what is given; 0: the network does not see it, as published."""
    spacing: str = "index"
    """Control training: levels evenly drawn (``index``, as published), or as often as samplers go there (``early``)."""
    adapter: str = ""
    """Adapter to go on from: a shipped name or a path; empty: none."""
    net: dict[str, Any] = field(default_factory=dict)
    """Sizes of the network, see `motionloom_train.nets.prior.NetConfig`."""
    predictor: dict[str, Any] = field(default_factory=dict)
    """Training a predictor: see `motionloom_train.predictor.Settings`."""
    pair: dict[str, Any] = field(default_factory=dict)
    """Training a two-person block: see `motionloom_train.pair.Settings`."""


def load_recipe(path: Path | str, changes: dict[str, Any] | None = None) -> Recipe:
    """Read a recipe; ``changes`` replace entries. Raises MotionloomError for unknown keys and unusable values."""
    path = Path(path)
    if not path.exists():
        raise MotionloomError(f"there is no recipe {path}")
    try:
        values = _parsed(read_utf8(path, max_bytes=MAX_BYTES))
    except MotionloomError:
        raise
    except (ValueError, RecursionError) as error:  # not TOML, or a number of thousands of digits
        raise MotionloomError(f"{path} is not TOML: {error}") from None
    values = _merged(values, changes or {})
    _check_whole_numbers(path, values)
    recipe = parse_table(Recipe, f"{path}:", values)
    _check(path, recipe)
    return recipe


Table = TypeVar("Table")


def parse_table(kind: type[Table], place: str, values: Mapping[str, Any]) -> Table:
    """Settings of a dataclass from a recipe or one of its tables; ``place``: its name in messages, such as ``[net]``.

    Raises MotionloomError for a setting there is not, and for a value of the wrong kind; words are checked by whoever
    knows which there are.
    """
    hints, settings = get_type_hints(kind), dict(values)
    for key, value in values.items():
        if key not in hints:
            raise MotionloomError(f"{place} no setting {key!r}; the settings are {', '.join(hints)}")
        origin = get_origin(hints[key])
        expected = str if origin is Literal else origin or hints[key]
        fits = isinstance(value, (int, float) if expected is float else expected)
        if not fits or (expected is not bool and isinstance(value, bool)):
            raise MotionloomError(f"{place} {key} must be of kind {expected.__name__}; got {_repr(value)}")
        settings[key] = float(value) if expected is float else value
    return kind(**settings)


LIMITS: Mapping[str, float] = {
    "steps": 10**9,
    "batch": 65536,
    "levels": 100_000,
    "seed": 2**31,
    "rate": 10.0,
    "decay": 10.0,
    "displacement": 1000.0,
    "geometric": 1000.0,
    "keep": 1000.0,
    "rank": 512,
    "given_rank": 512,
    "save_every": 10**9,
}
"""The most that a setting may be; all of them are at least 0."""


def _check(path: Path, recipe: Recipe) -> None:
    lists = {"sources": str, "prompts": str, "windows": int, "shares": int | float, "fresh_of": str}
    for key, kind in lists.items():
        if not all(isinstance(value, kind) and not isinstance(value, bool) for value in getattr(recipe, key)):
            raise MotionloomError(f"{path}: an entry of {key} is of the wrong kind: {_repr(getattr(recipe, key))}")
    for label, value in recipe.favour.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not 0 <= value <= 1e6:
            raise MotionloomError(f"{path}: favour.{label} must be a number from 0 to 1e6; got {_repr(value)}")
    if not re.fullmatch(r"\w[\w.-]{0,63}", recipe.name):
        raise MotionloomError(f"{path}: the name {recipe.name!r} becomes a file's; use letters, digits, _ - .")
    for key, limit in LIMITS.items():
        if not 0 <= getattr(recipe, key) <= limit:
            raise MotionloomError(f"{path}: {key} must be from 0 to {limit:g}; got {_repr(getattr(recipe, key))}")
    if not all(_in_range(recipe)):
        raise MotionloomError(
            f"{path}: a number or a choice is out of its range; see the comments of recipes/default.toml"
        )
    NetConfig.parse(recipe.net)


def _in_range(recipe: Recipe) -> Iterator[bool]:
    """Beyond `LIMITS`."""
    above_zero = (recipe.steps, recipe.batch, recipe.rank, recipe.rate, recipe.clip, recipe.save_every)
    yield all(value > 0 for value in above_zero)
    yield 0 <= recipe.ema < 1
    yield 0 <= recipe.drop_text < 1
    yield 0 <= recipe.early <= 1
    yield 0 <= recipe.fresh < 1
    yield bool(recipe.fresh) == bool(recipe.fresh_of)
    yield not recipe.keep or bool(recipe.start)
    yield 0 < recipe.heights <= 100
    yield 0 <= recipe.cooldown <= 1
    yield 0 <= recipe.warmup <= 10**9
    yield recipe.clip <= 1e6
    yield recipe.levels > 1
    yield recipe.amp in CHOICES
    yield recipe.schedule in SCHEDULES
    yield recipe.spacing in ("index", "early")
    yield len(recipe.windows) == len(recipe.shares) > 0
    yield all(0 < frames <= 10_000 for frames in recipe.windows)
    yield all(0 <= share <= 1e6 for share in recipe.shares)
    yield sum(recipe.shares) > 0


def changes(pairs: list[str]) -> dict[str, Any]:
    """``KEY=VALUE`` words as recipe entries, the values written as in TOML (text needs no quotes)."""
    result: dict[str, Any] = {}
    for pair in pairs:
        key, mark, value = pair.partition("=")
        if not mark:
            raise MotionloomError(f"{pair!r} is not of the form KEY=VALUE, such as steps=20000")
        try:
            result = _merged(result, _parsed(f"{key} = {value}"))
        except (ValueError, RecursionError):
            result[key] = value
    return result


def _parsed(text: str) -> dict[str, Any]:
    """TOML as a dictionary; raises ValueError or RecursionError for anything else.

    Keys of keys are counted first: the time that the parser takes grows with the square of their number.
    """
    if any(line.count(".") > MAX_DOTS for line in text.splitlines()):
        raise ValueError(f"a line has more than {MAX_DOTS} dots")
    return tomllib.loads(text)


def _check_whole_numbers(path: Path, values: dict[str, Any]) -> None:
    """Refuse whole numbers beyond TOML's own 64 bits, wherever they are: tomllib reads any, and no float holds them."""
    inside: list[Any] = [values]
    while inside:
        value = inside.pop()
        if isinstance(value, dict | list):
            inside += value.values() if isinstance(value, dict) else value
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise MotionloomError(f"{path}: a number of TOML has at most 64 bits; got {_repr(value)}")


def _repr(value: object) -> str:
    """A value as messages write it; a number of thousands of digits has no decimal text at all."""
    try:
        return repr(value)[:80]
    except ValueError:
        return "a number beyond all bounds"


def _merged(values: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """``changes`` over ``values``; tables entry by entry, so that net.width=64 leaves the other sizes alone."""
    result = dict(values)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = old | value if isinstance(old, dict) and isinstance(value, dict) else value
    return result
