"""Weights out of files against the network that is to have them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn

from motionloom.errors import MotionloomError


def is_signed(path: Path, key: str) -> bool:
    """Whether the head of a safetensors file, damaged or not, has this key: each kind of weight file has its own."""
    try:
        with safe_open(path, framework="pt") as file:
            return key in (file.metadata() or {})
    except (SafetensorError, OSError):
        return False


def shapes(net: nn.Module) -> dict[str, tuple[int, ...]]:
    """Names and shapes of what a network wants; it may be on the device ``meta`` and hold no memory."""
    return {key: tuple(value.shape) for key, value in net.state_dict().items()}


def check(weights: Mapping[str, Tensor], wanted: Mapping[str, Sequence[int]], what: str) -> None:
    """Raise MotionloomError unless the weights have just these names and shapes and finite floating-point numbers.

    what: how the sentence calls them, such as a path.
    """
    found = {key: tuple(value.shape) for key, value in weights.items()}
    right = {key: tuple(shape) for key, shape in wanted.items()}
    wrong = sorted(key for key in right.keys() | found.keys() if right.get(key) != found.get(key))
    if wrong:
        key = wrong[0]
        raise MotionloomError(
            f"{what} does not hold the weights it should: {key} is {found.get(key, 'missing')}, "
            f"not {right.get(key, 'absent')}; fetch or train it again"
        )
    for key, value in weights.items():
        if not value.is_floating_point() or not _finite(value):
            raise MotionloomError(f"{what} has numbers that are not finite floats, in {key}; fetch or train it again")


def _finite(values: Tensor) -> bool:
    """Whether no number is infinite or NaN, which both ends of the range tell without a mask as large as the tensor."""
    return not values.numel() or all(bool(end.isfinite()) for end in values.aminmax())


def fill(net: nn.Module, weights: Mapping[str, Tensor], what: str) -> None:
    """Put weights into a network after `check`; one on the device ``meta`` takes the tensors themselves."""
    check(weights, shapes(net), what)
    net.load_state_dict(weights, assign=next(net.parameters(), torch.empty(0)).is_meta)
