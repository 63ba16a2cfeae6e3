"""What a network call costs on ONNX Runtime, against PyTorch and against NumPy's matrix products of the same work.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/runtime.py > benchmarks/runtime.txt

One thread, processor time, everything in turns within one run, so that what else the machine does slows all alike; the
medians' ratios are what counts. Needs PyTorch.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch

from motionloom.core.diffusion import join_rows
from motionloom.core.models.networks import set_threads
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.prior import Prior
from motionloom_train.modules import prior_module
from motionloom_train.nets.prior import Bound

FRAMES = 196
"""9.8 seconds."""
REPEATS = 25
SQUARE = 1024


def products(config: NetConfig, rows: int, frames: int) -> list[tuple[int, int, int]]:
    """(rows, inner, outer) of each matrix product with weights in a call."""
    tokens, width = -(-frames // config.patch), config.width
    numbers = config.patch * config.features
    one = [(width, 3 * width), (width, width), (width, width), (width, width), (width, config.hidden)]
    block = [(rows * tokens, *sizes) for sizes in (*one, (config.hidden, width))]
    clock = [(rows * tokens, width, 2 * width), (tokens, width, width)] if config.clock else []
    level = [(rows, width, outer) for outer in (width, width, 6 * width, 2 * width)]
    return [(rows * tokens, numbers, width), *block * config.layers, (rows * tokens, width, numbers), *clock, *level]


def measured(jobs: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median seconds of processor time of each job, in turns."""
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats + 2):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            spent[name].append(time.process_time() - start)
    return {name: float(np.median(times[2:])) for name, times in spent.items()}


def guided_call(prior: Prior, motions: int, repeats: int) -> str:
    """One line: a guided call of so many motions, which is one call of the network on twice the rows."""
    config, rows = prior.net.config, 2 * motions
    cond = prior.condition(["a person walks forward and waves with the right hand"] * motions)
    net = PriorSession(config, prior.net.weights, prior.net.graphs)
    bound = join_rows(net.bind(cond), net.bind(cond.null()))
    state = np.random.default_rng(0).standard_normal((rows, FRAMES, config.features), np.float32)
    module = prior_module(prior)
    tensors = Bound(*(torch.from_numpy(np.ascontiguousarray(part)) for part in bound[: len(Bound._fields)]))
    x = torch.from_numpy(state)
    sizes = products(config, rows, FRAMES)
    pairs = [(np.ones((a, b), np.float32), np.ones((b, c), np.float32)) for a, b, c in sizes]
    square = np.ones((SQUARE, SQUARE), np.float32)

    def of_torch() -> None:
        with torch.inference_mode():
            module(x, 500, tensors)

    jobs: dict[str, Callable[[], object]] = {
        "ours": lambda: net(state, 500, bound),
        "torch": of_torch,
        "products": lambda: [a @ b for a, b in pairs],
        "square": lambda: square @ square,
    }
    spent = measured(jobs, repeats)
    work = sum(2 * a * b * c for a, b, c in sizes)
    share = work / spent["ours"] / (2 * SQUARE**3 / spent["square"])
    return (
        f"{motions:7}  {1000 * spent['ours']:9.1f}  {1000 * spent['torch']:9.1f}  {spent['torch'] / spent['ours']:9.2f}"
        f"  {spent['products'] / spent['ours']:14.0%}  {share:14.0%}"
    )


def main() -> None:
    set_threads(1)
    torch.set_num_threads(1)
    prior = Prior.load()
    prior = replace(prior, known=None)
    print("One guided call of 9.8 s, one thread, processor time; medians in turns.")
    print("motions   ours (ms)  torch (ms)  torch/ours  products/ours  of a 1024 product")
    for motions in (1, 4, 16):
        print(guided_call(prior, motions, REPEATS if motions < 16 else 7))


if __name__ == "__main__":
    main()
