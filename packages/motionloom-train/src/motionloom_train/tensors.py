"""From arrays, which sampling computes with, to the tensors that training computes with, and what computes them."""

import numpy as np
import torch
from torch import Tensor

from motionloom.core.diffusion import Schedule
from motionloom.core.errors import MotionloomError
from motionloom.core.models import networks
from motionloom.core.models.networks import prior_condition
from motionloom_train.nets.prior import Condition


def tensor(array: np.ndarray, device: str | torch.device = "cpu") -> Tensor:
    """A tensor of its own with the numbers of an array."""
    return torch.from_numpy(np.array(array)).to(device)


def conditions(cond: prior_condition.Condition) -> Condition:
    """A condition for a module."""
    return Condition(*(tensor(part) for part in cond))


def noised(schedule: Schedule, clean: Tensor, level: Tensor, noise: Tensor) -> Tensor:
    """Clean data (rows, ...) taken to levels (rows,), whole numbers: `Schedule.noised` on tensors."""
    shape = (-1,) + (1,) * (clean.ndim - 1)
    tables = (tensor(table).to(clean) for table in (schedule.signal, schedule.noise))
    signal, spread = (table[level.to(clean.device)].view(shape) for table in tables)
    return signal * clean + spread * noise


def number_of(seed: int, step: int) -> int:
    """What the random numbers of a step begin with."""
    return int(np.random.SeedSequence((seed, step, 1)).generate_state(1)[0])


def find_device(name: str) -> torch.device:
    """The device of that name; raises MotionloomError where this machine or this PyTorch has none."""
    try:
        device = torch.device(name)
        torch.empty(1, device=device).cpu()
        return device
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        reason = " ".join(str(error).split())[:80]
        raise MotionloomError(f"the device {name!r} cannot be used ({reason}); cpu always can") from None


def set_threads(count: int) -> None:
    """Modules from now on, and sessions that are opened from now on, compute with so many threads."""
    torch.set_num_threads(count)
    networks.set_threads(count)
