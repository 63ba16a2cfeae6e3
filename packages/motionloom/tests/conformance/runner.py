"""Runs the recorded cases: rebuild the input from a rule, compute, compare.

A test of a group reads

    @pytest.mark.parametrize("case", cases("diffusion", kind="schedule"))
    def test_schedule(case): compare(case, "beta", published(cosine(case.config["steps"])).beta)

The numbers lie in `recorded`; those of another folder are compared where MOTIONLOOM_CONFORMANCE names it, or where
MOTIONLOOM_SHARED names one that has a folder `conformance`: a group it lacks is skipped. Arrays are compared as
`numpy.asarray(array)`, so torch tensors (CPU) and numbers will do.

A test that is given a case must read every setting of it and compare every output of it: `conftest.py` sees to that,
and `test_kinds.py` that every recorded kind has such a test.
"""

import functools
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest


def _folder() -> Path:
    """Where the numbers to compare lie."""
    if "MOTIONLOOM_CONFORMANCE" in os.environ:
        return Path(os.environ["MOTIONLOOM_CONFORMANCE"])
    other = Path(os.environ.get("MOTIONLOOM_SHARED", "")) / "conformance"
    return other if "MOTIONLOOM_SHARED" in os.environ and other.is_dir() else OWN


OWN = Path(__file__).parent / "recorded"
FOLDER = _folder()
"""Of the numbers that are compared."""

# What a stream's numbers are for (rule R1); model m draws its weights from stream WEIGHTS + m.
MOTION, TEXT, NOISE, KNOWN, MASK, WEIGHTS = 1, 2, 3, 4, 5, 10

_UNSCALED = ("emb_trans_or_not.weight", "hidden")
_NORMS = ("norm1.weight", "norm2.weight", "norm.weight", "output_net.1.weight")


class Settings(Mapping[str, Any]):
    """What a case recorded, and which of it was read."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values, self.read = values, set[str]()

    def __getitem__(self, key: str) -> Any:
        self.read.add(key)
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def unread(self) -> list[str]:
        """The names that nobody asked for."""
        return [name for name in self._values if name not in self.read]


@dataclass(frozen=True)
class Case:
    """One recorded run."""

    group: str
    name: str
    config: Settings
    """What was run, and everything needed to rebuild its input."""
    outputs: Mapping[str, Mapping[str, Any]]
    """How each output is stored and how near it must be."""
    lists: Settings
    """What a case without numbers lists: `keys` (names and shapes) and counts, or `dims`."""
    compared: set[str] = field(default_factory=set)
    """The outputs that were."""

    def left(self) -> list[str]:
        """What of the case was neither read nor compared."""
        outputs = [f"output {name}" for name in self.outputs if name not in self.compared]
        settings = [f"config {name}" for name in self.config.unread() if name != "kind"]
        return outputs + settings + [f"list {name}" for name in self.lists.unread() if name != "note"]

    def expected(self, output: str) -> np.ndarray:
        """The stored elements of an output: every `stride`-th one of the flattened array."""
        return _arrays(self.group)[self.outputs[output]["key"]]


def cases(group: str, *, kind: str | None = None) -> list[Any]:
    """The cases of a group (of one `config["kind"]`) for `pytest.mark.parametrize`, named as recorded."""
    path = FOLDER / f"{group}.json"
    if FOLDER != OWN and not path.exists():
        reason = f"there is no {path}"
        return [pytest.param(None, id=f"{group}-absent", marks=pytest.mark.skip(reason=reason))]
    found = [_case(group, record) for record in json.loads(path.read_text())["cases"]]
    return [pytest.param(c, id=c.name) for c in found if kind in (None, c.config["kind"])]


def case(group: str, name: str) -> Case:
    """One case by name, inside a test; skips the test where another folder does not have it."""
    records = json.loads(recorded(f"{group}.json").read_text())["cases"]
    found = [_case(group, record) for record in records if record["name"] == name]
    if not found and FOLDER != OWN:
        pytest.skip(f"there is no case {name} in {FOLDER / group}.json")
    return found[0]


def recorded(file: str) -> Path:
    """A file of recorded numbers, inside a test; skips the test where another folder does not have it."""
    path = FOLDER / file
    if FOLDER != OWN and not path.exists():
        pytest.skip(f"there is no {path}")
    return path


def stream(seed: int, k: int) -> np.random.Generator:
    """The stream of rule R1; `k` is MOTION, TEXT, NOISE, KNOWN, MASK or WEIGHTS + m."""
    return np.random.Generator(np.random.PCG64([seed, k]))


def normal(rng: np.random.Generator, shape: Iterable[int]) -> np.ndarray:
    """The next float32 standard normal array of a stream."""
    return rng.standard_normal(tuple(shape), dtype=np.float32)


def weights(
    names_and_shapes: Mapping[str, Iterable[int]] | Iterable[tuple[str, Iterable[int]]],
    seed: int,
    m: int = 0,
    *,
    scale: float = 0.05,
) -> dict[str, np.ndarray]:
    """Weights of model m by rule R2 (HumanMAC: scale 0.03); sinusoid tables (`.pe`) are left out."""
    rng, result = stream(seed, WEIGHTS + m), {}
    for name, shape in sorted(dict(names_and_shapes).items()):
        if name.endswith(".pe"):
            continue
        drawn = normal(rng, shape)
        result[name] = drawn if name.endswith(_UNSCALED) else drawn * np.float32(scale)
        if name.endswith(_NORMS):
            result[name] = result[name] + np.float32(1)
    return result


def compare(case: Case, output: str, array: Any) -> None:
    """Assert that `array` is the recorded output: shape, stored elements, and mean, std, abs_sum of the whole."""
    case.compared.add(output)
    spec, actual = case.outputs[output], np.asarray(array)
    what = f"{case.group}/{case.name}/{output}"
    assert list(actual.shape) == spec["shape"], f"{what}: shape {list(actual.shape)}, recorded {spec['shape']}"
    assert np.isfinite(actual).all(), f"{what}: not finite"
    whole = actual.astype(np.float64)
    atol, rtol = spec["atol"], spec.get("rtol", 0.0)
    np.testing.assert_allclose(
        whole.reshape(-1)[:: spec["stride"]], case.expected(output).reshape(-1), rtol=rtol, atol=atol, err_msg=what
    )
    _near(f"{what}: mean", whole.mean(), spec["mean"], atol, rtol)
    _near(f"{what}: std", whole.std(), spec["std"], atol, rtol)
    _near(f"{what}: abs_sum", np.abs(whole).sum(), spec["abs_sum"], atol * whole.size, rtol * whole.size)


def _near(what: str, actual: float, expected: float, atol: float, rtol: float) -> None:
    rounding = 1e-12 * max(1.0, abs(expected))  # the order of a float64 sum is not part of the answer
    assert abs(actual - expected) <= atol + rtol * abs(expected) + rounding, f"{what} {actual}, recorded {expected}"


def _case(group: str, record: Mapping[str, Any]) -> Case:
    own = ("name", "config", "outputs")
    lists = Settings({key: value for key, value in record.items() if key not in own})
    return Case(group, record["name"], Settings(record["config"]), dict(record.get("outputs") or {}), lists)


@functools.cache
def _arrays(group: str) -> Mapping[str, np.ndarray]:
    with np.load(recorded(f"{group}.npz"), allow_pickle=False) as stored:
        return dict(stored)
