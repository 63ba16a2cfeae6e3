"""How many threads networks compute with where there are both kinds: PyTorch's modules and the sessions."""

import torch

from motionloom import runtime


def set_threads(count: int) -> None:
    """Modules from now on, and sessions that are opened from now on, compute with so many threads."""
    torch.set_num_threads(count)
    runtime.set_threads(count)
