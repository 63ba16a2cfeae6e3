"""What a run multiplies in: bfloat16 or float32, whichever the processor at hand is quicker with.

A processor without instructions for bfloat16 multiplies in it ten to sixty times slower than in float32, one with them
about twice as fast; so both are tried.
"""

import time

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from motionloom_train.low_rank import AdapterNet

CHOICES = ("auto", "bf16", "float32", "off", "none")
"""The choices of a recipe; ``off`` and ``none`` are ``float32``."""
ROWS = 256
ENOUGH = 0.2
"""Seconds after which a product is not repeated."""
REPEATS = 5
WORTH = 1.2
"""How many times as fast bfloat16 must be to be worth its rounding."""


def choose(net: nn.Module, device: str) -> tuple[str, str]:
    """The quicker precision, ``bf16`` or ``float32``, and one sentence with the reason.

    On a CPU the largest product of the network is measured once in both, with as many threads as are set. A GPU
    multiplies in bfloat16 wherever it has instructions for it.
    """
    if device.startswith("cuda"):
        able = torch.cuda.is_bf16_supported(including_emulation=False)
        return ("bf16", "multiplying in bfloat16") if able else ("float32", "multiplying in float32: no bfloat16 here")
    inner, outer = product_size(net)
    half, full = (product_seconds(inner, outer, half=half) for half in (True, False))
    chosen, name = ("bf16", "bfloat16") if half * WORTH < full else ("float32", "float32")
    why = f"a product takes {half * 1e3:.1f} ms in bfloat16 and {full * 1e3:.1f} ms in float32"
    return chosen, f"multiplying in {name}: {why} on {torch.get_num_threads()} threads"


def product_size(net: nn.Module) -> tuple[int, int]:
    """Numbers that go into and come out of the largest linear layer of a network; (1, 1) if it has none."""
    whole = net.whole if isinstance(net, AdapterNet) else net
    layers = [module for module in whole.modules() if isinstance(module, nn.Linear)]
    largest = max(layers, key=lambda layer: layer.weight.numel(), default=None)
    return (largest.in_features, largest.out_features) if largest else (1, 1)


def product_seconds(inner: int, outer: int, *, half: bool) -> float:
    """Seconds that `ROWS` rows take through a linear layer and back on a CPU, in bfloat16 or in float32."""
    weights, rows = (torch.ones(count, inner, requires_grad=True) for count in (outer, ROWS))
    best, spent = float("inf"), 0.0
    for _ in range(REPEATS):
        began = time.perf_counter()
        _there_and_back(weights, rows, half)
        took = time.perf_counter() - began
        best, spent = min(best, took), spent + took
        if spent > ENOUGH:
            break
    return best


def _there_and_back(weights: Tensor, rows: Tensor, half: bool) -> None:
    with torch.autocast("cpu", torch.bfloat16, enabled=half):
        result = F.linear(rows, weights)
    result.float().sum().backward()
