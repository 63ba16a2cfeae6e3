"""Real motions as one evaluator sees them: enough to measure generated ones where no recording is at hand.

`text_reference.safetensors` beside this file is of ``motionloom evaluate text --make-reference FILE --data SET``:
embeddings (no motion), captions, lengths and physical numbers of held-out recordings.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import safe_open

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import of_width
from motionloom.core.files.atomic import check_place
from motionloom.core.files.tensors import check_head, save_tensors
from motionloom.core.files.text import plain_json
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.suites.harness import CHUNK, PHYSICAL, physical
from motionloom_lab.suites.items import Item, spread
from motionloom_lab.suites.protocol import MOST_ITEMS, RECORDED, Protocol, Selection
from motionloom_train.data.paths import DAMAGED
from motionloom_train.data.progress import Say, silent

FORMAT = 1
LARGEST_FILE = 64 << 20
SOURCE = (
    "derived from mocap.cs.cmu.edu (free for any use), ACCAD / The Ohio State University, Open Motion Project "
    "(CC BY 3.0), UI-PRMD (PDDL) and HumanML3D's captions (MIT, Copyright (c) 2022 Chuan Guo)"
)
_KINDS = {"motions": np.float16, "frames": np.int32, "physical": np.float32, "probe": np.float32}
SENTENCE = Caption("a person walks forward.", ("a/DET", "person/NOUN", "walk/VERB", "forward/ADV"))


@dataclass(frozen=True, eq=False)
class TextReference:
    """Real items: their captions, lengths and points in the evaluator's space."""

    names: tuple[str, ...]
    captions: tuple[tuple[Caption, ...], ...]
    frames: tuple[int, ...]
    motions: Array
    """(items, width) embeddings."""
    physical: Array
    """(items, numbers of `PHYSICAL`)."""
    selection: Selection
    evaluator: str
    probe: Array
    """(2, width): an artificial caption and motion as the evaluator sees them, by which it is recognised."""

    def chosen(self, protocol: Protocol) -> "TextReference":
        """As many items as the protocol counts, spread evenly; MotionloomError where they do not fill a batch."""
        rows = spread(protocol.count or len(self.names), len(self.names))
        least = protocol.batch or 4
        if len(rows) < least:
            raise MotionloomError(
                f"there are {len(rows)} real items and a batch needs {least}; ask for a smaller --batch or more data"
            )
        names, captions, frames = (
            tuple(several[k] for k in rows) for several in (self.names, self.captions, self.frames)
        )
        return replace(
            self,
            names=names,
            captions=captions,
            frames=frames,
            motions=self.motions[rows],
            physical=self.physical[rows],
        )

    @property
    def data(self) -> str:
        """For a report."""
        sources = ", ".join(self.selection.sources) or "all sources"
        return f"{' + '.join(self.selection.splits)} of {sources}, captions that people wrote"


def measure(items: Sequence[Item], evaluator: Evaluator, selection: Selection, progress: Say = silent) -> TextReference:
    """Embed and measure the items of `items.read_items`."""
    motions, physicals = [], []
    for start in range(0, len(items), CHUNK):
        part = items[start : start + CHUNK]
        motions.append(evaluator.motions([item.features for item in part]))
        physicals += [list(of_features(item.features).values()) for item in part]
        progress(f"{start + len(part)} of {len(items)} real motions measured")
    return TextReference(
        tuple(item.name for item in items),
        tuple(item.captions for item in items),
        tuple(len(item.features) for item in items),
        np.concatenate(motions).astype(np.float64),
        np.array(physicals, dtype=np.float64),
        selection,
        evaluator.name,
        probe(evaluator),
    )


def of_features(features: np.ndarray) -> dict[str, float]:
    """`harness.physical` of a motion (frames, numbers), not standardised, as the network samples it."""
    kind = of_width(features.shape[1])
    return physical(kind.decode_positions(np.asarray(features, dtype=np.float64)), kind.fps)


def probe(evaluator: Evaluator) -> Array:
    """(2, width): a caption and a motion that nobody ever recorded, as the evaluator sees them."""
    wave = np.sin(np.arange(48)[:, None] * 0.1 + np.arange(evaluator.representation.width)[None])
    texts = evaluator.texts([SENTENCE])
    return np.concatenate([texts, evaluator.motions([0.1 * wave])]).astype(np.float64)


def made_by(reference: TextReference, evaluator: Evaluator) -> bool:
    """Is this the evaluator of the reference? Up to rounding, which differs between machines."""
    own = probe(evaluator)
    return own.shape == reference.probe.shape and bool(
        np.abs(own - reference.probe).max() <= 1e-3 * max(1e-6, float(np.abs(reference.probe).max()))
    )


def save(reference: TextReference, path: Path | str) -> Path:
    """Write a .safetensors file, whole or not at all; embeddings as float16."""
    path = Path(path)
    check_reference(path)
    values = {
        "motions": reference.motions,
        "frames": np.array(reference.frames),
        "physical": reference.physical,
        "probe": reference.probe,
    }
    tensors = {name: np.ascontiguousarray(value, dtype=_KINDS[name]) for name, value in values.items()}
    if not all(np.isfinite(tensor).all() for tensor in tensors.values()):
        raise MotionloomError("the evaluator gives numbers that float16 cannot hold; a reference cannot be made of it")
    chosen = reference.selection
    about = {
        "format": FORMAT,
        "names": reference.names,
        "captions": [[[c.text, list(c.tokens)] for c in several] for several in reference.captions],
        "selection": {name: getattr(chosen, name) for name in Selection.__dataclass_fields__},
        "evaluator": reference.evaluator,
        "physical": PHYSICAL,
        "source": SOURCE if chosen.sources == RECORDED else "ask whoever gave you this file",
    }
    save_tensors(tensors, path, metadata={"reference": json.dumps(about)})
    return path


def shipped() -> Path:
    """Where the reference of the shipped evaluator lies."""
    return Path(str(resources.files("motionloom_lab.suites"))) / "text_reference.safetensors"


def load_shipped(evaluator: Evaluator, selection: Selection | None) -> TextReference:
    """The shipped numbers, which nobody can select from; MotionloomError where this copy ships none."""
    if selection is not None:
        raise MotionloomError("splits, sources and lengths are selected from real motions; name them with --data")
    if not shipped().is_file():
        raise MotionloomError("this copy ships no reference of real motions; name some with --data")
    return load(shipped(), evaluator)


def load(path: Path | str, evaluator: Evaluator) -> TextReference:
    """The inverse of `save`, every shape and number checked; MotionloomError where it is of another evaluator."""
    path = Path(path)
    if not path.is_file():
        raise MotionloomError(f"there is no reference {path}; name real motions with --data")
    try:
        check_head(path, max_bytes=LARGEST_FILE)
        with safe_open(path, framework="numpy") as file:
            about = plain_json((file.metadata() or {})["reference"])
            if set(file.keys()) != set(_KINDS):
                raise ValueError("its tensors have other names")
            arrays = {name: file.get_tensor(name) for name in _KINDS}
        reference = _decoded(about, arrays)
    except DAMAGED as error:
        reason = " ".join(str(error).split())[:160]
        raise MotionloomError(f"{path} is not a reference of real motions ({reason}); make it again") from None
    if not made_by(reference, evaluator):
        raise MotionloomError(
            f"{path.name} was made with another evaluator ({reference.evaluator!r}) than {evaluator.name!r}; "
            "name real motions with --data"
        )
    return reference


def _decoded(about: dict[str, Any], arrays: dict[str, np.ndarray]) -> TextReference:
    if about["format"] != FORMAT or tuple(about["physical"]) != PHYSICAL:
        raise ValueError("it has another format")
    for name, kind in _KINDS.items():
        if arrays[name].dtype != kind or not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} holds other numbers than finite {np.dtype(kind).name}")
    names = tuple(map(_short_text, about["names"]))
    count, width = len(names), arrays["probe"].shape[-1]
    shapes = {"motions": (count, width), "frames": (count,), "physical": (count, len(PHYSICAL)), "probe": (2, width)}
    if not 1 <= count <= MOST_ITEMS or any(arrays[name].shape != shape for name, shape in shapes.items()):
        raise ValueError("its arrays do not fit one another")
    captions = tuple(tuple(_caption(c) for c in several) for several in about["captions"])
    if len(captions) != count or not all(captions):
        raise ValueError("its captions do not fit its items")
    selection = _selection(about["selection"])
    frames = tuple(int(n) for n in arrays["frames"])
    if not all(selection.shortest <= n <= selection.longest for n in frames):
        raise ValueError("it has lengths that were not selected")
    motions, physicals, probes = (arrays[name].astype(np.float64) for name in ("motions", "physical", "probe"))
    return TextReference(
        names, captions, frames, motions, physicals, selection, _short_text(about["evaluator"]), probes
    )


def _selection(data: dict[str, Any]) -> Selection:
    numbers = [data[name] for name in ("shortest", "longest", "unit")]
    flags = [data[name] for name in ("mirrored", "shorter_third")]
    if not all(type(n) is int for n in numbers) or not all(isinstance(flag, bool) for flag in flags):
        raise ValueError("its selection says what cannot be")
    splits, sources = (tuple(map(_short_text, data[name])) for name in ("splits", "sources"))
    return Selection(splits, sources, flags[0], numbers[0], numbers[1], numbers[2], flags[1])


def _caption(data: Any) -> Caption:
    text, tokens = data
    if not _short_text(text).strip():
        raise ValueError("a caption is empty")
    return Caption(text, tuple(map(_short_text, tokens)))


def _short_text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > 2000:
        raise ValueError("it has something else where a short text belongs")
    return value


def check_reference(path: Path) -> None:
    """Ask before long work whether a reference can be written there."""
    if path.suffix != ".safetensors":
        raise MotionloomError(f"a reference is written as .safetensors; {path.name} has another suffix")
    check_place(path)
