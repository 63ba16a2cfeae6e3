"""Write what a browser needs to draw motion with a prior beside the page that draws it: `python tools/export_tab.py`.

`make tab` calls it once the page is built. Into the folder go `prior.bin` (weights, graphs, vocabulary), `prior.json`
(what lies where in it, and the digest of the weights), the licences of ONNX Runtime, and `sw.js`, the service worker
that keeps all files of the folder for when there is no network. docs/tab.md says how to serve the folder.
"""

import argparse
import hashlib
import json
import shutil
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import weights_digest
from motionloom.core.models.networks.graph import fields, outline
from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom.core.models.networks.text.quantise import dequantise, quantise
from motionloom.core.models.prior import Prior, find_weights, load_prior
from motionloom.requests.sampling import GUIDANCE, LATE_GUIDANCE, SOLVER, SPACING, STEPS

FORMAT = 2
LARGE = 40_000
"""Numbers of a matrix from which on it is stored in eight bits."""
WORKER = Path(__file__).parents[1] / "studio" / "src" / "tab" / "sw.js"
NOTICES = {"LICENSE": "onnxruntime-licence.txt", "ThirdPartyNotices.txt": "onnxruntime-notices.txt"}
"""Files of the Python package of ONNX Runtime that go with its WebAssembly, whose own package has none."""


class Packed:
    """Arrays one behind the other, each at a multiple of eight bytes."""

    def __init__(self) -> None:
        self.bytes = bytearray()

    def add(self, data: bytes) -> int:
        """Put bytes behind the others; gives where they begin."""
        self.bytes += b"\0" * (-len(self.bytes) % 8)
        at = len(self.bytes)
        self.bytes += data
        return at

    def tensor(self, array: np.ndarray, scale: np.ndarray | None = None) -> dict[str, Any]:
        """Put an array and the scales of its rows; gives where they are, as the page reads it."""
        entry = {"type": str(array.dtype), "shape": list(array.shape), "at": self.add(array.tobytes())}
        return entry if scale is None else {**entry, "scale": self.add(scale.tobytes())}


def export(prior: Prior, digest: str, folder: Path, *, precise: bool = False) -> dict[str, Any]:
    """Write `prior.bin` and `prior.json` into a folder that there is, and give what the second one says.

    digest: of the weights, which a link to a motion names. precise: float16 throughout, instead of eight bits for the
    large matrices (40 MB instead of 29). Raises MotionloomError for weights that a page cannot draw with.
    """
    config = prior.net.config
    if not isinstance(prior.text, MiniLM) or config.variant != "modulated" or config.flags or config.features != 263:
        raise MotionloomError(
            "the page draws with weights that make 263 numbers a frame and bring their own text encoder; name others"
        )
    packed, tensors = Packed(), {}
    for name, value in prior.net.weights.items():
        small = precise or value.ndim != 2 or value.size < LARGE
        tensors[name] = packed.tensor(value.astype(np.float16)) if small else packed.tensor(*quantise(value))
    text = prior.text.to_tensors()
    for name in (name for name in text if name != "vocabulary" and not name.endswith(".scale")):
        tensors[f"text.{name}"] = packed.tensor(text[name], text.get(f"{name}.scale"))
    tensors |= {"mean": packed.tensor(prior.mean), "std": packed.tensor(prior.std)}
    graphs = {}
    for name, graph in {**prior.net.graphs, "text": prior.text.graph}.items():
        data, weights = placed(graph)
        graphs[name] = {"at": packed.add(data), "bytes": len(data), "weights": weights}
    vocabulary = text["vocabulary"].tobytes()
    about = {
        "format": FORMAT,
        "weights": digest,
        "name": prior.card.name,
        "licence": prior.card.licence,
        "data": prior.card.data,
        "fps": prior.fps,
        "net": {name: getattr(config, name) for name in ("features", "width", "layers", "heads", "patch")},
        "schedule": {"name": prior.schedule.name, "steps": prior.schedule.steps},
        "sampling": {
            "steps": STEPS,
            "solver": SOLVER,
            "spacing": SPACING,
            "guidance": GUIDANCE,
            "late_guidance": LATE_GUIDANCE,
        },
        "vocabulary": {"at": packed.add(vocabulary), "bytes": len(vocabulary)},
        "tensors": tensors,
        "graphs": graphs,
        "bytes": len(packed.bytes),
        "sha256": hashlib.sha256(packed.bytes).hexdigest(),
    }
    if about["schedule"]["name"] != "cosine" or (SOLVER, SPACING) != ("ddpm", "early"):
        raise MotionloomError("the page samples with the cosine schedule, ddpm and the spacing early alone; got others")
    (folder / "prior.bin").write_bytes(packed.bytes)
    (folder / "prior.json").write_text(json.dumps(about))
    return about


def rounded(prior: Prior) -> dict[str, np.ndarray]:
    """The weights of a prior's network as the page has them unless it is told to be precise."""
    return {
        name: dequantise(*quantise(value)) if value.ndim == 2 and value.size >= LARGE else value
        for name, value in prior.net.weights.items()
    }


def placed(graph: bytes) -> tuple[bytes, list[str]]:
    """A graph whose weights lie one behind the other as float32 in one file, and their names in that order."""
    shapes = outline(graph).weights
    at, order, model = 0, [], bytearray()
    for number, value in fields(memoryview(graph)):
        if number != 7 or isinstance(value, int):
            model += _field(number, value)
            continue
        inside = bytearray()
        for part, content in fields(value):
            data = content if isinstance(content, int) else bytes(content)
            name = bytes(dict(fields(memoryview(data)))[8]).decode() if part == 5 and isinstance(data, bytes) else ""
            if isinstance(data, bytes) and name in shapes:
                size = 4 * int(np.prod(shapes[name]))
                for key, said in (("offset", at), ("length", size)):
                    data += _field(13, _field(1, key.encode()) + _field(2, str(said).encode()))
                at += size
                order.append(name)
            inside += _field(part, data)
        model += _field(7, bytes(inside))
    return bytes(model), order


def _field(number: int, value: "int | bytes | memoryview") -> bytes:
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    return _varint(number << 3 | 2) + _varint(len(value)) + bytes(value)


def _varint(number: int) -> bytes:
    parts = bytearray()
    while number > 127:
        parts.append(number & 127 | 128)
        number >>= 7
    return bytes([*parts, number])


def keep_offline(folder: Path) -> None:
    """Write the service worker, which knows the files of the folder and their digests."""
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    names = [name for name in names if name != "sw.js"]
    digests = [hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names]
    version = hashlib.sha256("".join(digests).encode()).hexdigest()[:16]
    text = WORKER.read_text().replace('"VERSION"', json.dumps(version)).replace('"FILES"', json.dumps(names))
    (folder / "sw.js").write_text(text)


def copy_notices(folder: Path) -> None:
    """Copy the licences of ONNX Runtime and of what it contains."""
    files = {file.name: Path(str(file.locate())) for file in metadata.files("onnxruntime") or []}
    for name, target in NOTICES.items():
        if name not in files:
            raise MotionloomError(
                f"the installed onnxruntime has no {name}, which belongs to the page; install another"
            )
        shutil.copyfile(files[name], folder / target)


def main() -> int:
    parser = argparse.ArgumentParser(description="Write a prior's weights beside the page that draws with them.")
    parser.add_argument("folder", type=Path, help="where the page was built")
    parser.add_argument("--weights", default="default", help="a weight file or the name of one that ships")
    parser.add_argument(
        "--alone", action="store_true", help="prior.bin and prior.json only, into a new folder: docs/javascript.md"
    )
    parser.add_argument("--precise", action="store_true", help="float16 throughout: exact, and a third larger")
    said = parser.parse_args()
    try:
        if said.alone and said.folder.exists():
            raise MotionloomError(f"{said.folder} is there already; name a new folder")
        if not said.alone and not (said.folder / "index.html").is_file():
            raise MotionloomError(f"there is no page in {said.folder}; build it by 'make tab', or say --alone")
        path = find_weights(said.weights)
        prior = load_prior(path)
        said.folder.mkdir(parents=True, exist_ok=True)
        about = export(prior, weights_digest(path), said.folder, precise=said.precise)
        if not said.alone:
            copy_notices(said.folder)
            keep_offline(said.folder)
    except MotionloomError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{said.folder}: weights {about['weights'][:12]}, {about['bytes'] / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
