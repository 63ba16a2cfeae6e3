"""Work that a call does, counted instead of timed: how busy the machine is changes nothing."""

import os
import resource
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any


def work(call: Callable[[], object]) -> int:
    """How many lines of Python a call runs in this thread, and how many functions written in C it calls.

    What such a function does inside (an array operation, a regular expression) counts as one.
    """
    count = 0

    def traced(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        count += event == "line"
        return traced

    def profiled(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal count
        count += event == "c_call"

    before = sys.gettrace(), sys.getprofile()
    sys.settrace(traced)
    sys.setprofile(profiled)
    try:
        call()
    finally:
        sys.settrace(before[0])
        sys.setprofile(before[1])
    return count


def ends(call: Callable[[], object], *, seconds: int = 20) -> bool:
    """Whether a call ends within so many seconds of the processor; it runs in a process of its own.

    For what happens inside of one function written in C, such as a search that would take hours.
    """
    child = os.fork()
    if child == 0:
        try:
            most = int(sum(os.times()[:2])) + seconds
            resource.setrlimit(resource.RLIMIT_CPU, (most, most))
            call()
            os._exit(0)
        finally:
            os._exit(1)
    return os.waitpid(child, 0)[1] == 0
