"""`PairBlock`: the weight file of a communication block, for one prior.

One safetensors file: the block's tensors (float16 or float32), and JSON metadata under ``motionloom-pair``: format,
sizes, the prior it belongs to (name and `fingerprint`), licence, provenance. Nothing in it is ever executed.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import origin
from motionloom.core.models.container import PAIRS, check, check_graphs, finite, graph_tensors, halved, split_graphs
from motionloom.core.models.networks.pair import PairConfig, PairSession
from motionloom.core.models.networks.session import check_graph
from motionloom.core.models.networks.shapes import pair_shapes
from motionloom.core.models.networks.text.known import Known, pack_known, unpack_known
from motionloom.core.models.prior import Prior

UNKNOWN = "unknown: ask whoever gave you this file"
_TEXTS = ("name", "base", "fingerprint", "licence", "data")


@dataclass(frozen=True, eq=False)
class PairBlock:
    """What turns one prior into two people."""

    name: str
    config: PairConfig
    tensors: Mapping[str, np.ndarray]
    """Weights of the block."""
    base: str
    """Name of the prior it belongs to."""
    fingerprint: str
    """`fingerprint` of that prior's network."""
    licence: str = UNKNOWN
    data: str = "unknown"
    """What it was trained on, with the acknowledgements that asks for."""
    notes: dict[str, Any] = field(default_factory=dict)
    """How it was trained: steps, seed, measured numbers."""
    graph: bytes = b""
    """Of prior and block together."""
    known: Known | None = None
    """What pairs it has learned, in words; None: its file does not say."""

    @staticmethod
    def load(block: str | Path, prior: Prior) -> "PairBlock":
        """A shipped block by name, or one from a file, for this prior.

        Raises `MotionloomError` for a file that is missing, damaged or too large, and for another prior's block.
        """
        path = PAIRS.find(block)
        result = read_block(path)
        if result.fingerprint != origin(prior):
            raise MotionloomError(
                f"the two-person block {path.name} belongs to the weights {result.base!r}, and these are others; "
                "use those weights, or train a block for these"
            )
        result.config.check(prior.net.config)
        check(result.tensors, pair_shapes(result.config, prior.net.config), str(path))
        check_graphs(path, {"pair": result.graph}, ["pair"])
        check_graph(result.graph, result.weights(prior), PairSession.outputs)
        return result

    def save(self, path: Path | str, *, half: bool = True) -> Path:
        """Write it as a .safetensors file and give the path back; the file appears whole or not at all."""
        if not all(finite(value) for value in self.tensors.values()):
            raise MotionloomError("the block has weights that are not finite, and is not written; train it again")
        about = {key: getattr(self, key) for key in _TEXTS}
        about |= {"config": asdict(self.config), "notes": self.notes}
        tensors = halved(self.tensors, half) | graph_tensors({"pair": self.graph})
        if self.known is not None:
            table, about["known"] = pack_known(self.known)
            tensors |= table
        return PAIRS.write(path, tensors, about)

    def weights(self, prior: Prior) -> dict[str, np.ndarray]:
        """All that the graph is filled with."""
        return dict(prior.net.weights, **self.tensors, mean=prior.mean, std=prior.std)

    def net(self, prior: Prior) -> PairSession:
        """The network of two people, on the prior's device, ready to sample."""
        return PairSession(self.config, self.tensors, self.graph, prior.net, prior.schedule, prior.mean, prior.std)


def blocks() -> dict[str, Path]:
    """Names and places of the two-person blocks inside the package, for the prior ``default``."""
    return PAIRS.shipped()


def read_block(path: Path) -> PairBlock:
    """What a file holds and says, without a prior to fit it to; raises MotionloomError as `PairBlock.load`."""
    about, tensors = PAIRS.read(path)
    with PAIRS.parsing(path):
        texts, notes, config = {key: about[key] for key in _TEXTS}, about.get("notes", {}), about["config"]
        if (
            not all(isinstance(value, str) for value in texts.values())
            or not isinstance(notes, dict)
            or not isinstance(config, dict)
        ):
            raise ValueError("values of the wrong kind")
        weights, graphs = split_graphs(tensors)
        graph, known = graphs.get("pair", b""), None
        if "known" in about:  # files of before there were tables lack it
            known = unpack_known(weights, about["known"], width=weights["known.vectors"].shape[-1])
            weights = {name: value for name, value in weights.items() if not name.startswith("known.")}
        config = PairConfig.parse(config)
        return PairBlock(config=config, tensors=weights, notes=notes, graph=graph, known=known, **texts)
