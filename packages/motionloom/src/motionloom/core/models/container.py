"""Weight files: one container for all kinds, and weights out of them against the network that is to have them.

A file is a safetensors file with a JSON description under one key of its head, which says of what kind it is. Nothing
in it is ever executed; what it claims is checked before anything of that size is allocated.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import finished
from motionloom.core.files.tensors import check_head, save_tensors
from motionloom.core.files.text import plain_json

FORMAT = 1
MAX_BYTES = 2 << 30
GRAPH = "graph."
"""What names of graphs begin with."""
_BAD = (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError)
"""What comes of descriptions that say something else than was expected."""


@dataclass(frozen=True)
class Container:
    """One kind of weight file."""

    noun: str
    """What it holds, such as "prior"."""
    key: str
    """Of the head, where the description lies; every kind has its own."""
    folder: str = ""
    """Of the shipped files, inside the package's ``weights``."""
    max_bytes: int = MAX_BYTES
    kind: str = ""
    """What the description says it is of, where another kind has the same key."""

    def shipped(self) -> dict[str, Path]:
        """Names and places of the files of this kind inside the package."""
        place = Path(str(resources.files("motionloom"))) / "weights" / self.folder
        return {path.stem: path for path in finished(place, "*.safetensors") if self.folder or self.signed(path)}

    def find(self, weights: str | Path) -> Path:
        """The file for a shipped name or a path; raises MotionloomError where there is none."""
        names = self.shipped()
        path = names.get(str(weights)) or Path(weights)
        if not path.is_file():
            raise MotionloomError(
                f"no {self.noun} {str(weights)!r}: there is no such file, and the shipped names are "
                f"{', '.join(names) or 'none'}"
            )
        return path

    def signed(self, path: Path) -> bool:
        """Whether a file, damaged or not, is of this kind, by what its head says."""
        try:
            check_head(path, max_bytes=self.max_bytes)
            with safe_open(path, framework="np") as file:
                head = file.metadata() or {}
            return self.key in head and (not self.kind or plain_json(head[self.key])["kind"] == self.kind)
        except (SafetensorError, OSError, *_BAD):
            return False

    def read(self, path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """The description and the tensors; raises MotionloomError for a file that is damaged or of another kind."""
        tensors, head = read_tensors(path, self.max_bytes)
        return self.describe(path, head), tensors

    def describe(self, path: Path, head: Mapping[str, str]) -> dict[str, Any]:
        """The description in a file's head."""
        with self.parsing(path):
            if self.key not in head:
                kind = next((_a(other.noun) for other in KINDS if other.key in head), "something else")
                raise MotionloomError(f"{path} is {kind}, not {_a(self.noun)}; name weights of that kind")
            about = plain_json(head[self.key])
            if self.kind and about["kind"] != self.kind:
                raise MotionloomError(f"{path} is {about['kind']!r}, not {_a(self.noun)}; name weights of that kind")
            if about.get("format", FORMAT) != FORMAT:
                raise MotionloomError(
                    f"{path} has the {self.noun} format {about['format']!r}; this motionloom reads {FORMAT}: update it"
                )
            return about

    @contextmanager
    def parsing(self, path: Path) -> Iterator[None]:
        """Inside, whatever is wrong with a description becomes a MotionloomError."""
        try:
            yield
        except MotionloomError:
            raise
        except _BAD as error:
            reason = " ".join(str(error).split())[:160] or "it says something else"
            raise MotionloomError(
                f"{path} does not describe a motionloom {self.noun}; name a file that does, or make it again ({reason})"
            ) from None

    def write(self, path: Path | str, tensors: Mapping[str, np.ndarray], about: Mapping[str, Any]) -> Path:
        """A .safetensors file, whole or not at all; raises MotionloomError for another suffix."""
        path = Path(path)
        if path.suffix != ".safetensors":
            raise MotionloomError(f"weights are written as .safetensors; {path.name} has another suffix")
        kind = {"kind": self.kind} if self.kind else {}
        about = {"format": FORMAT, **kind, **about}
        arrays = {key: np.asarray(value, order="C") for key, value in tensors.items()}
        return save_tensors(arrays, path, metadata={self.key: json.dumps(about, default=dict)})


def _a(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


PRIORS = Container("prior", "motionloom")
PREDICTORS = Container("predictor", "motionloom-predictor", "prediction")
PAIRS = Container("two-person block", "motionloom-pair", "pair", 64 << 20)
ADAPTERS = Container("adapter", "motionloom-adapter", "control", 64 << 20)
KINDS = (PRIORS, PREDICTORS, PAIRS, ADAPTERS)


def read_tensors(path: Path, max_bytes: int = MAX_BYTES) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Tensors and metadata of a safetensors file, sizes checked; pickles are refused by what they are."""
    try:
        check_head(path, max_bytes=max_bytes)
        with safe_open(path, framework="np") as file:
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
            head = dict(file.metadata() or {})
        types = [value.dtype for value in tensors.values()]
        odd = next((one for one in types if one.kind not in "biuf"), None)
        if odd is not None:  # bfloat16 and the like are numbers to NumPy only where ml_dtypes is installed too
            raise ValueError(f"{odd} is no number that NumPy computes with; write float16 or float32")
        return tensors, head
    except (SafetensorError, OSError, *_BAD, RuntimeError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(
            f"{path} is not a whole safetensors file ({error}); fetch or train it again, and bring published .pt files "
            "in through 'motionloom import'"
        ) from None


def halved(weights: Mapping[str, np.ndarray], half: bool = True) -> dict[str, np.ndarray]:
    """Weights as files hold them: float16, or float32 unless ``half``."""
    return {key: value.astype(np.float16 if half else np.float32) for key, value in weights.items()}


def check(weights: Mapping[str, np.ndarray], shapes: Mapping[str, Sequence[int]], what: str) -> None:
    """Raise MotionloomError unless the weights have just these names and shapes and finite floating-point numbers.

    what: how the sentence calls them, such as a path.
    """
    own = {key: tuple(value.shape) for key, value in weights.items()}
    right = {key: tuple(shape) for key, shape in shapes.items()}
    wrong = sorted(key for key in right.keys() | own.keys() if right.get(key) != own.get(key))
    if wrong:
        key = wrong[0]
        raise MotionloomError(
            f"{what} does not hold the weights it should: {key} is {own.get(key, 'missing')}, "
            f"not {right.get(key, 'absent')}; fetch or train it again"
        )
    for key, value in weights.items():
        if value.dtype.kind != "f" or not finite(value):
            raise MotionloomError(f"{what} has numbers that are not finite floats, in {key}; fetch or train it again")


def finite(values: np.ndarray) -> bool:
    """Whether no number is infinite or NaN."""
    if values.dtype == np.float16:  # arithmetic on these is slow
        return not values.size or int((values.view(np.uint16) & 0x7FFF).max()) < 0x7C00
    return bool(np.isfinite(values).all())


# Graphs, which lie beside the weights


def split_graphs(tensors: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, bytes]]:
    """The tensors of a file without its graphs, and these by their names (``prior``, ``bind`` ...)."""
    weights = {k: v for k, v in tensors.items() if not k.startswith(GRAPH)}
    return weights, {k[len(GRAPH) :]: tensors[k].tobytes() for k in tensors.keys() - weights.keys()}


def graph_tensors(graphs: Mapping[str, bytes]) -> dict[str, np.ndarray]:
    """Graphs as a file holds them."""
    return {GRAPH + name: np.frombuffer(graph, np.uint8) for name, graph in graphs.items()}


def check_graphs(path: Path, graphs: Mapping[str, bytes], names: Sequence[str]) -> None:
    """Raise MotionloomError where a file lacks some of the graphs that its networks are run with."""
    if not all(graphs.get(name) for name in names):
        raise MotionloomError(
            f"{path} has no graphs to run its networks with, as files of older versions have not; write a file that "
            f"has them by 'motionloom weights convert {path} NEW.safetensors'"
        )


def weights_digest(path: Path) -> str:
    """The SHA-256 of a weight file as it is without graphs: what figures quote, whoever wrote the graphs.

    Of a file without graphs, of whatever kind, that of its bytes. Raises OSError where it cannot be read.
    """
    if not _has_graphs(path):
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    tensors, head = read_tensors(path)
    return hashlib.sha256(save(split_graphs(tensors)[0], head)).hexdigest()


def _has_graphs(path: Path) -> bool:
    try:
        with safe_open(path, framework="np") as file:
            return any(key.startswith(GRAPH) for key in file.keys())  # noqa: SIM118
    except (SafetensorError, OSError, *_BAD):
        return False
