"""Weights as published: MDM and PriorMDM checkpoints to this project's names, nothing but arrays let in.

Keys and shapes: MDM's ``trans_enc`` (HumanML3D 263, KIT 251, BABEL 135 with or without transition flags).
"""

import json
import pickle
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from motionloom.errors import MotionloomError
from motionloom.nets.prior import NetConfig, PriorNet

MAX_BYTES = 2 << 30
_IGNORED = ("clip_model.", "sequence_pos_encoder.pe", "embed_timestep.sequence_pos_encoder.pe", "t_pos_encoder.pe")
_HEADS = 4

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
        number, rest = key[len(_STACK) :].split(".", 1)
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
        manner="published",
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
    wanted = {key: tuple(value.shape) for key, value in net.state_dict().items()}
    found = {key: tuple(value.shape) for key, value in renamed.items()}
    wrong = sorted(key for key in wanted.keys() | found.keys() if wanted.get(key) != found.get(key))
    if wrong:
        key = wrong[0]
        raise MotionloomError(
            f"the checkpoint does not fit: {key} is {found.get(key, 'missing')}, not {wanted.get(key, 'absent')}"
        )
    if not all(bool(value.isfinite().all()) for value in renamed.values()):
        raise MotionloomError("the checkpoint has numbers that are not finite")
    net.load_state_dict(renamed, assign=True)
    return net.eval().requires_grad_(False)


def read_published(path: Path | str) -> Published:
    """Read ``model*.pt`` with torch's weights-only reader, and ``args.json`` beside it if it is there."""
    path = Path(path)
    if not path.is_file():
        raise MotionloomError(f"there is no checkpoint {path}")
    if path.stat().st_size > MAX_BYTES:
        raise MotionloomError(f"{path} is larger than 2 GiB; published checkpoints are far smaller")
    try:
        loaded = torch.load(path, map_location="cpu", weights_only=True)
    except (
        pickle.UnpicklingError,
        RuntimeError,
        EOFError,
        OSError,
        ValueError,
        zipfile.BadZipFile,
        KeyError,
        TypeError,
    ) as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(f"{path} holds more than tensors or is damaged, and is not opened ({reason})") from None
    averaged = isinstance(loaded, dict) and "model_avg" in loaded
    state = loaded["model_avg"] if averaged else loaded.get("model", loaded) if isinstance(loaded, dict) else None
    if not isinstance(state, dict) or not all(isinstance(k, str) and isinstance(v, Tensor) for k, v in state.items()):
        raise MotionloomError(f"{path} is not a state dict of tensors; name a published model*.pt file")
    return Published(state, _options(path.parent / "args.json"), averaged)


def _options(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        options = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise MotionloomError(f"{path} is not JSON ({error}); mend it or move it away") from None
    if not isinstance(options, dict):
        raise MotionloomError(f"{path} must hold an object with the training options")
    return options
