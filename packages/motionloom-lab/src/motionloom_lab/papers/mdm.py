"""Weights as published: MDM and PriorMDM checkpoints to this project's names, nothing but arrays let in.

Keys and shapes: MDM's ``trans_enc`` (HumanML3D 263, KIT 251, BABEL 135 with or without transition flags). Two-person
checkpoints (PriorMDM's ``pw3d_text``, ``pw3d_prefix``) hold the whole frozen network, its layers in two stacks before
and after the communication block, and the block under ``multi_person``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.features.pair import PUBLISHED_CODE
from motionloom.core.files.text import plain_json, read_bytes
from motionloom_lab.papers.torch_file import is_plain, read_torch_file
from motionloom_train.modules import fill
from motionloom_train.nets.pair import PairConfig, Talk
from motionloom_train.nets.prior import NetConfig, PriorNet

_IGNORED = ("clip_model.", "sequence_pos_encoder.pe", "embed_timestep.sequence_pos_encoder.pe", "t_pos_encoder.pe")
_HEADS = 4
_MAX_OPTIONS = 1 << 20

_NAMES = {
    "input_process.poseEmbedding": "embed",
    "embed_timestep.time_embed.0": "time1",
    "embed_timestep.time_embed.2": "time2",
    "embed_text": "text",
    "output_process.poseFinal": "out",
}
_LAYER = {
    "self_attn.in_proj_weight": "attention.project.weight",
    "self_attn.in_proj_bias": "attention.project.bias",
    "self_attn.out_proj.weight": "attention.out.weight",
    "self_attn.out_proj.bias": "attention.out.bias",
}
_STACK = "seqTransEncoder.layers."


@dataclass(frozen=True)
class Published:
    """A published checkpoint, read."""

    state: dict[str, Tensor]
    options: dict[str, Any]
    """``args.json``; empty where there is none."""
    averaged: bool
    """Whether these are the averaged weights of a file that held both."""


def own_name(key: str) -> str | None:
    """This project's name for a published key; None for keys that are recomputed or stripped. Unknown keys raise."""
    if key.startswith(_IGNORED):
        return None
    if key.startswith(_STACK):
        number, _, rest = key[len(_STACK) :].partition(".")
        return f"blocks.{number}.{_LAYER.get(rest, rest)}"
    if key == "emb_trans_or_not.weight":
        return "flag.weight"
    stem, _, leaf = key.rpartition(".")
    if stem in _NAMES:
        return f"{_NAMES[stem]}.{leaf}"
    raise MotionloomError(f"the checkpoint has a weight {key!r} that MDM's trans_enc does not; name one of those")


def from_published(state: dict[str, Tensor]) -> PriorNet:
    """The published network with published weights; raises MotionloomError for missing, unknown or misshapen ones."""
    renamed = {name: value.float() for key, value in state.items() if (name := own_name(key)) is not None}
    for needed in ("embed.weight", "out.weight", "text.weight", "blocks.0.linear1.weight"):
        if needed not in renamed or renamed[needed].ndim != 2:
            raise MotionloomError(
                f"the checkpoint lacks {needed} (in its own words); it is not an MDM trans_enc checkpoint"
            )
    layers = len({key.split(".")[1] for key in renamed if key.startswith("blocks.")})
    config = NetConfig(
        variant="published",
        features=renamed["out.weight"].shape[0],
        width=renamed["embed.weight"].shape[0],
        layers=layers,
        heads=_HEADS,
        hidden=renamed["blocks.0.linear1.weight"].shape[0],
        text=renamed["text.weight"].shape[1],
        flags="flag.weight" in renamed,
    )
    with torch.device("meta"):
        net = PriorNet(config)
    fill(net, renamed, "the checkpoint")
    return net.eval().requires_grad_(False)


def read_published(path: Path | str) -> Published:
    """Read ``model*.pt`` (as `read_torch_file`), and ``args.json`` beside it if it is there."""
    path = Path(path)
    if not path.is_file():
        raise MotionloomError(f"there is no checkpoint {path}")
    loaded = read_torch_file(path)
    averaged = isinstance(loaded, dict) and "model_avg" in loaded
    state = loaded["model_avg"] if averaged else loaded.get("model", loaded) if isinstance(loaded, dict) else None
    if not isinstance(state, dict) or not all(isinstance(k, str) and isinstance(v, Tensor) for k, v in state.items()):
        raise MotionloomError(f"{path} is not a state dict of tensors; name a published model*.pt file")
    if not all(is_plain(value) for value in state.values()):
        raise MotionloomError(
            f"{path} holds tensors that are sparse, overlap or are not floating point; they are not read"
        )
    return Published(state, _options(path.parent / "args.json"), averaged)


def _options(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        options = plain_json(read_bytes(path, max_bytes=_MAX_OPTIONS))
    except MotionloomError:
        raise
    except (ValueError, RecursionError) as error:
        raise MotionloomError(f"{path} is not JSON ({error}); mend it or move it away") from None
    if not isinstance(options, dict):
        raise MotionloomError(f"{path} must hold an object with the training options")
    return options


@dataclass(frozen=True)
class Described:
    """What sampling needs of `args.json`."""

    schedule: str
    steps: int
    data: str
    warnings: tuple[str, ...]
    """One sentence for each field that is missing and was assumed."""


_ASSUMED: dict[str, Any] = {"arch": "trans_enc", "noise_schedule": "cosine", "diffusion_steps": 1000}
_DATA = {263: "humanml", 251: "kit", 135: "babel"}
FRAME_RATES = {263: 20.0, 251: 12.5, 135: 30.0}
"""Frames per second by the count of features: HumanML3D, KIT-ML, BABEL."""


def describe(published: Published, net: PriorNet) -> Described:
    """Read the options that matter; unknown ones are ignored, missing ones assumed with a warning.

    Raises MotionloomError where an option contradicts the weights or is not usable.
    """
    options, warnings = published.options, []
    for key, value in _ASSUMED.items():
        if key not in options:
            warnings.append(f"args.json does not say {key}; {value} is assumed")
    settings = _ASSUMED | {key: options[key] for key in _ASSUMED if key in options}
    if settings["arch"] != "trans_enc":
        raise MotionloomError(f"args.json says arch {settings['arch']!r}; only trans_enc checkpoints are read")
    if settings["noise_schedule"] not in ("cosine", "linear"):
        raise MotionloomError(
            f"args.json says noise_schedule {settings['noise_schedule']!r}; there are cosine and linear"
        )
    steps = settings["diffusion_steps"]
    if not isinstance(steps, int) or not 1 <= steps <= 100_000:
        raise MotionloomError(f"args.json says diffusion_steps {steps!r}; it must be a whole number from 1 to 100000")
    for key, size in (("layers", net.config.layers), ("latent_dim", net.config.width)):
        if options.get(key, size) != size:
            raise MotionloomError(
                f"args.json says {key} {options[key]!r} where the weights have {size}: it is another file's"
            )
    data = str(options.get("dataset") or _DATA.get(net.config.features, "unknown"))
    return Described(settings["noise_schedule"], steps, data, tuple(warnings))


_START, _END, _WHOLE = "seqTransEncoder_start.layers.", "seqTransEncoder_end.layers.", "seqTransEncoder.layers."
_BLOCK, _LAYERS = "multi_person.", "model.layers."
_PAIR_NAMES = {"canon_agg": "places", "canon_out": "place", "aggregation": "both"}
_ADDS: dict[str, Literal["all", "condition"]] = {"in_both_out_cur": "all", "in_both_out_cond": "condition"}


def is_pair(state: Mapping[str, Tensor]) -> bool:
    """Whether a checkpoint holds a communication block."""
    return any(key.startswith(_BLOCK) for key in state)


def adds_of(options: Mapping[str, Any]) -> Literal["all", "condition"]:
    """What the block corrects, by ``args.json``; raises MotionloomError for a function that is not read."""
    name = options.get("multi_func", "in_both_out_cur")
    if name not in _ADDS:
        raise MotionloomError(f"args.json says multi_func {name!r}; {' and '.join(_ADDS)} are read")
    return _ADDS[name]


def from_published_pair(
    state: Mapping[str, Tensor], *, adds: Literal["all", "condition"] = "all"
) -> tuple[PriorNet, Talk]:
    """The prior and the block of a checkpoint; raises MotionloomError for missing, unknown or misshapen weights."""
    split = len({key[len(_START) :].partition(".")[0] for key in state if key.startswith(_START)})
    base: dict[str, Tensor] = {}
    block: dict[str, Tensor] = {}
    for key, value in state.items():
        if key.startswith(_BLOCK):
            block[_own_name(key[len(_BLOCK) :])] = value.float()
        elif key.startswith(_END):
            number, _, leaf = key[len(_END) :].partition(".")
            base[f"{_WHOLE}{_number(key, number) + split}.{leaf}"] = value
        else:
            base[key.replace(_START, _WHOLE, 1) if key.startswith(_START) else key] = value
    prior = from_published(base)
    return prior, _talk(block, prior, split, adds)


def _talk(block: dict[str, Tensor], prior: PriorNet, split: int, adds: Literal["all", "condition"]) -> Talk:
    hidden = block.get("blocks.0.linear1.weight", torch.empty(0))
    if hidden.ndim != 2:
        raise MotionloomError("the checkpoint lacks the layers of a communication block; it is not one of two people")
    layers = len({key.split(".")[1] for key in block if key.startswith("blocks.")})
    sizes = prior.config
    config = PairConfig(
        layers, split, sizes.width, sizes.heads, hidden.shape[0], sizes.dropout, adds, places=PUBLISHED_CODE
    )
    with torch.device("meta"):
        talk = Talk(config, sizes)
    fill(talk, block, "the checkpoint's communication block")
    return talk.eval().requires_grad_(False)


def _own_name(key: str) -> str:
    if key.startswith(_LAYERS):
        number, _, leaf = key[len(_LAYERS) :].partition(".")
        return str(own_name(f"{_WHOLE}{_number(key, number)}.{leaf}"))  # a layer as those of the network
    stem, _, leaf = key.rpartition(".")
    if stem not in _PAIR_NAMES:
        raise MotionloomError(f"the checkpoint has a weight {_BLOCK + key!r} that a communication block does not")
    return f"{_PAIR_NAMES[stem]}.{leaf}"


def _number(key: str, number: str) -> int:
    if not (number.isascii() and number.isdigit() and len(number) <= 3):
        raise MotionloomError(f"the checkpoint has a weight {key!r} of no layer; it is not one of two people")
    return int(number)
