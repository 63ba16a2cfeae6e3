"""Whole steps of training as CUDA graphs.

A step of a small network is a thousand short kernels, and starting them one by one takes several times as long as they
run. A graph starts all of them at once. There is one graph for every shape of a batch; it reads what the step shows
from memory that is filled before each launch.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import Protocol

import torch
from torch import Tensor, nn

from motionloom_train.objectives import Objective


class Capturable(Objective, Protocol):
    """An objective whose step is computed from an array of numbers alone, without a look at the CPU."""

    def pick(self, seed: int, step: int, rows: int) -> tuple[int, Tensor]:
        """The shape of a step, by a number, and what it shows: whole numbers, on the CPU, of one size for all steps."""
        ...

    def shown_loss(self, net: nn.Module, shape: int, picked: Tensor, generator: torch.Generator) -> Tensor:
        """The loss of what was picked, on the device of ``picked``."""
        ...

    def number(self, seed: int, step: int) -> int:
        """What the random numbers of a step begin with."""
        ...


class Captured:
    """The forward and backward pass and the optimiser's update of a step, launched at once.

    The first step of a shape runs as usual, which sets up what its kernels need; the second one is captured. Both give
    what `motionloom_train.loop` would compute, within rounding.
    """

    def __init__(
        self,
        objective: Capturable,
        net: nn.Module,
        optimizer: torch.optim.Optimizer,
        *,
        clip: float,
        context: Callable[[], AbstractContextManager[object]],
    ) -> None:
        """``clip``: the largest norm of the gradient. ``context``: entered for the forward pass."""
        self.objective, self.net, self.optimizer, self.clip, self.context = objective, net, optimizer, clip, context
        self.device = next(net.parameters()).device
        self._graphs: dict[int, Graph | None] = {}
        self._picked: Tensor | None = None
        for group in optimizer.param_groups:
            group["lr"] = torch.tensor(float(group["lr"]), device=self.device)
            group["capturable"] = self.device.type == "cuda"

    def step(self, seed: int, step: int, rows: int, rate: float) -> Tensor:
        """One step at a learning rate; returns its loss, on the device."""
        shape, picked = self.objective.pick(seed, step, rows)
        if self._picked is None:
            self._picked = picked.to(self.device, copy=True)
        self._picked.copy_(picked, non_blocking=True)
        generator = default_generator(self.device).manual_seed(self.objective.number(seed, step))
        for group in self.optimizer.param_groups:
            group["lr"].fill_(rate)
        work = partial(self._whole, shape, self._picked, generator)
        if shape not in self._graphs:
            self._graphs[shape] = None
            return work()
        graph = self._graphs[shape]
        if graph is None:
            self.optimizer.zero_grad(set_to_none=True)
            beside = next(filter(None, self._graphs.values()), None)
            graph = self._graphs[shape] = Graph(work, beside=beside)
            generator.manual_seed(self.objective.number(seed, step))
        return graph.replay().clone()

    def _whole(self, shape: int, picked: Tensor, generator: torch.Generator) -> Tensor:
        self.optimizer.zero_grad(set_to_none=True)
        with self.context():
            loss = self.objective.shown_loss(self.net, shape, picked, generator)
        loss.backward()
        nn.utils.clip_grad_norm_(self.net.parameters(), self.clip)
        self.optimizer.step()
        return loss.detach()


class Graph:
    """A CUDA graph of some work."""

    def __init__(self, work: Callable[[], Tensor], *, beside: "Graph | None" = None) -> None:
        """Record ``work`` without running it. ``beside``: a graph whose memory it shares; one runs at a time."""
        self._graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(self._graph, pool=beside._graph.pool() if beside else None):
            self._result = work()

    def replay(self) -> Tensor:
        """Run the work; its result is overwritten by the next run."""
        self._graph.replay()
        return self._result


def default_generator(device: torch.device | str) -> torch.Generator:
    """The device's own source of random numbers, the only one that graphs take by themselves."""
    device = torch.device(device)
    if device.type != "cuda":
        return torch.default_generator
    torch.cuda.init()
    return torch.cuda.default_generators[device.index if device.index is not None else torch.cuda.current_device()]
