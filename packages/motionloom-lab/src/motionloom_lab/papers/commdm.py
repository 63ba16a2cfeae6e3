"""Published two-person checkpoints (PriorMDM's ``pw3d_text``, ``pw3d_prefix``): a prior and a communication block.

The file holds the whole frozen network, its layers in two stacks before and after the block, and the block under
``multi_person``. `motionloom_lab.papers.mdm` reads files and the network.
"""

from collections.abc import Mapping
from typing import Any, Literal

import torch
from torch import Tensor

from motionloom.errors import MotionloomError
from motionloom.features.pair import PUBLISHED_CODE
from motionloom_lab.papers.mdm import from_published, own_name
from motionloom_train.modules import fill
from motionloom_train.nets.pair import PairConfig, Talk
from motionloom_train.nets.prior import PriorNet

_START, _END, _WHOLE = "seqTransEncoder_start.layers.", "seqTransEncoder_end.layers.", "seqTransEncoder.layers."
_BLOCK, _LAYERS = "multi_person.", "model.layers."
_NAMES = {"canon_agg": "places", "canon_out": "place", "aggregation": "both"}
_ADDS: dict[str, Literal["all", "condition"]] = {"in_both_out_cur": "all", "in_both_out_cond": "condition"}


def is_pair(state: Mapping[str, Tensor]) -> bool:
    """Whether a checkpoint holds a communication block."""
    return any(key.startswith(_BLOCK) for key in state)


def adds_of(options: Mapping[str, Any]) -> Literal["all", "condition"]:
    """What the block corrects, by ``args.json``; raises MotionloomError for a function that is not read."""
    said = options.get("multi_func", "in_both_out_cur")
    if said not in _ADDS:
        raise MotionloomError(f"args.json says multi_func {said!r}; {' and '.join(_ADDS)} are read")
    return _ADDS[said]


def from_published_pair(
    state: Mapping[str, Tensor], *, adds: Literal["all", "condition"] = "all"
) -> tuple[PriorNet, Talk]:
    """The prior and the block of a checkpoint; raises MotionloomError for missing, unknown or misshapen weights."""
    split = _layers(state, _START)
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
    if stem not in _NAMES:
        raise MotionloomError(f"the checkpoint has a weight {_BLOCK + key!r} that a communication block does not")
    return f"{_NAMES[stem]}.{leaf}"


def _layers(state: Mapping[str, Tensor], stack: str) -> int:
    return len({key[len(stack) :].partition(".")[0] for key in state if key.startswith(stack)})


def _number(key: str, number: str) -> int:
    if not (number.isascii() and number.isdigit() and len(number) <= 3):
        raise MotionloomError(f"the checkpoint has a weight {key!r} of no layer; it is not one of two people")
    return int(number)
