"""Ctrl-C and the signals with which schedulers and terminals end a program: all of them end it alike.

Each becomes a `KeyboardInterrupt` in the main thread. Where files are being finished it waits until they are in place
(`held_back`), so that what is written is whole, whatever the moment; a second signal does not wait.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
_SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


class _State:
    blocks = 0
    """Blocks of `held_back` that are open."""
    waiting = False
    """A signal came within one."""
    received = False
    """A signal came at all."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Let the signals interrupt the block; one that the parent process has set to be ignored stays ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _State.waiting = _State.received = False
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    ignored = (None, signal.SIG_IGN)
    changed = {number: old for number, old in before.items() if old not in ignored}
    try:
        for number in changed:
            signal.signal(number, _interrupt)
        yield
    finally:
        for number, old in changed.items():
            signal.signal(number, old)


def _interrupt(number: int, frame: object) -> None:
    again, _State.received = _State.waiting, True
    if _State.blocks and not again:
        _State.waiting = True
        return
    _State.waiting = False
    raise KeyboardInterrupt


@contextmanager
def held_back() -> Iterator[None]:
    """Finish the block before a signal that comes within it interrupts; works within `interruptible` alone."""
    _State.blocks += 1
    try:
        yield
    finally:
        _State.blocks -= 1
        if _State.waiting and not _State.blocks:
            _State.waiting = False
            raise KeyboardInterrupt


def was_interrupted() -> bool:
    """Whether a signal came since `interruptible` began: libraries turn the interruption into errors of their own."""
    return _State.received
