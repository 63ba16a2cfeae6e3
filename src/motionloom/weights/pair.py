"""`PairBlock`: the weight file of a communication block, for one prior.

One safetensors file: the block's tensors (float16 or float32), and JSON metadata under ``motionloom-pair``: format,
sizes, the prior it belongs to (name and `fingerprint`), licence, provenance. Nothing in it is ever executed.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, Protocol

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from motionloom.diffusion import Schedule
from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path
from motionloom.nets.pair import PairConfig, PairNet, Talk
from motionloom.nets.prior import PriorNet
from motionloom.weights.adapter import origin
from motionloom.weights.container import check, is_signed, shapes

KEY = "motionloom-pair"
FORMAT = 1
MAX_BYTES = 64 << 20
UNKNOWN = "unknown: ask whoever gave you this file"
_TEXTS = ("name", "base", "fingerprint", "licence", "data")


class HasNet(Protocol):
    """A prior, as far as a block looks at it."""

    @property
    def net(self) -> PriorNet: ...
    @property
    def schedule(self) -> Schedule: ...
    @property
    def mean(self) -> Tensor: ...
    @property
    def std(self) -> Tensor: ...


@dataclass(frozen=True, eq=False)
class PairBlock:
    """What makes two people out of one prior."""

    name: str
    config: PairConfig
    tensors: Mapping[str, Tensor]
    """State of a `Talk`."""
    base: str
    """Name of the prior it belongs to."""
    fingerprint: str
    """`fingerprint` of that prior's network."""
    licence: str = UNKNOWN
    data: str = "unknown"
    """What it was trained on, with the acknowledgements that asks for."""
    notes: dict[str, Any] = field(default_factory=dict)
    """How it was made: steps, seed, measured numbers."""

    @staticmethod
    def load(block: str | Path, prior: HasNet) -> "PairBlock":
        """A shipped block by name, or one from a file, for this prior.

        Raises `MotionloomError` for a file that is missing, damaged or too large, and for another prior's block.
        """
        path = blocks().get(str(block)) or Path(block)
        if not path.is_file():
            names = ", ".join(blocks()) or "none"
            raise MotionloomError(
                f"no two-person block {str(block)!r}: there is no such file, and the shipped ones are {names}"
            )
        found = read_block(path)
        if found.fingerprint != origin(prior):
            raise MotionloomError(
                f"the two-person block {path.name} belongs to the weights {found.base!r}, and these are others; "
                "use those weights, or train a block for these"
            )
        with torch.device("meta"):
            check(found.tensors, shapes(Talk(found.config, prior.net.config)), str(path))
        return found

    def save(self, path: Path | str, *, half: bool = True) -> Path:
        """Write it as a .safetensors file and give the path back; the file appears whole or not at all."""
        path = Path(path)
        if path.suffix != ".safetensors":
            raise MotionloomError(f"two-person blocks are written as .safetensors; {path.name} has another suffix")
        kind = torch.float16 if half else torch.float32
        tensors = {k: v.detach().cpu().to(kind).contiguous() for k, v in self.tensors.items()}
        if not all(bool(value.isfinite().all()) for value in tensors.values()):
            raise MotionloomError("the block has weights that are not finite, and is not written; train it again")
        about = {key: getattr(self, key) for key in _TEXTS}
        about |= {"format": FORMAT, "config": asdict(self.config), "notes": self.notes}
        with atomic_path(path) as temp:
            save_file(tensors, temp, metadata={KEY: json.dumps(about)})
        return path

    def net(self, prior: HasNet) -> PairNet:
        """The network of two people, on the prior's device, ready to sample."""
        talk = Talk(self.config, prior.net.config)
        talk.load_state_dict(dict(self.tensors))
        made = PairNet(prior.net, talk.to(prior.mean.device), prior.schedule, mean=prior.mean, std=prior.std)
        return made.eval().requires_grad_(False)


def blocks() -> dict[str, Path]:
    """Names and places of the two-person blocks inside the package, for the prior ``default``."""
    folder = Path(str(resources.files("motionloom"))) / "weights" / "pair"
    return {path.stem: path for path in sorted(folder.glob("*.safetensors"))}


def is_block(path: Path) -> bool:
    """True for a file of `PairBlock.save`, damaged or not, by what its head says."""
    return is_signed(path, KEY)


def read_block(path: Path) -> PairBlock:
    """What a file holds and says, without a prior to fit it to; raises MotionloomError as `PairBlock.load`."""
    return _parse(path, *_read(path))


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Tensor]]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise MotionloomError(f"{path} is larger than a two-person block can be ({MAX_BYTES >> 20} MiB)")
        with safe_open(path, framework="pt") as file:
            about = json.loads((file.metadata() or {})[KEY])
            if not isinstance(about, dict):
                raise ValueError("no description")
            return about, {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except (SafetensorError, KeyError, ValueError, RecursionError, OSError) as error:
        raise MotionloomError(
            f"{path} is not a two-person block of motionloom ({error!r}); fetch or train it again"
        ) from None


def _parse(path: Path, about: dict[str, Any], tensors: dict[str, Tensor]) -> PairBlock:
    if about.get("format") != FORMAT:
        raise MotionloomError(f"{path} has the block format {about.get('format')!r}; this motionloom reads {FORMAT}")
    said, notes, config = {key: about.get(key) for key in _TEXTS}, about.get("notes", {}), about.get("config")
    if (
        not all(isinstance(value, str) for value in said.values())
        or not isinstance(notes, dict)
        or not isinstance(config, dict)
    ):
        raise MotionloomError(f"{path} does not describe a two-person block; fetch or train it again")
    return PairBlock(config=PairConfig.parse(config), tensors=tensors, notes=notes, **said)  # type: ignore[arg-type]
