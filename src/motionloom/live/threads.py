"""PyTorch on one thread while a window is sampled.

A window's matrices are so small that a second thread saves little on idle cores; and where anything else runs, such as
the program that shows the motion, two threads wait for each other at every layer and a window takes ten times as long.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import torch

_lock = threading.Lock()
_inside: list[int] = []
"""The number of threads that there was, once for each window that is being sampled."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Compute with one thread inside the block, and with as many as before behind the last of such blocks."""
    with _lock:
        _inside.append(_inside[0] if _inside else torch.get_num_threads())
    torch.set_num_threads(1)  # this is partly the process's, partly the calling thread's own
    try:
        yield
    finally:
        with _lock:
            before = _inside.pop()
            if not _inside:
                torch.set_num_threads(before)
