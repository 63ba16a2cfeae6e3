"""Weights of a file go into a module only if they are its own, each by name."""

import pytest
import torch
from torch import nn

from motionloom.core.errors import MotionloomError
from motionloom_train.modules import fill, shapes


def good() -> dict[str, torch.Tensor]:
    return {"weight": torch.arange(6.0).reshape(2, 3), "bias": torch.ones(2)}


@pytest.mark.parametrize("device", ["cpu", "meta"])
def test_a_network_gets_its_weights(device: str) -> None:
    with torch.device(device):
        net = nn.Linear(3, 2)
    fill(net, good(), "a.safetensors")
    assert net(torch.tensor([1.0, 0.0, 2.0])).tolist() == [5.0, 14.0]  # by hand: 0 + 4 + 1 and 3 + 10 + 1
    assert shapes(net) == {"weight": (2, 3), "bias": (2,)}


@pytest.mark.parametrize(
    ("change", "said"),
    [({"weight": torch.ones(3, 2)}, r"weight is \(3, 2\), not \(2, 3\)"), ({"more": torch.ones(1)}, "more is")],
    ids=["turned", "unknown"],
)
def test_weights_that_do_not_fit_leave_it_as_it_was(change: dict, said: str) -> None:
    net = nn.Linear(3, 2)
    before = net.weight.clone()
    with pytest.raises(MotionloomError, match=f"a.safetensors .*{said}"):
        fill(net, good() | change, "a.safetensors")
    assert torch.equal(net.weight, before)
