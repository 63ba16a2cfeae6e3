"""Graphs that ONNX Runtime runs. No other module knows it.

A session is created when it is first run, from a graph without weights and the arrays of a weight file. Arrays that
go in stay where they are, and the buffers of its answers are kept from call to call.
"""

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.graph import Outline, outline

THREADS = "MOTIONLOOM_THREADS"
"""The environment variable that says how many threads a session computes with."""
DEVICES = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider"}
_threads: int | None = None

Weights: TypeAlias = Callable[[], Mapping[str, np.ndarray]]
"""Gives arrays by the names of a graph's initialisers."""


def set_threads(count: int | None) -> None:
    """Let sessions that are created afterwards in this process compute with so many threads.

    None: with as many as the environment variable ``MOTIONLOOM_THREADS`` says, else with one per core.
    """
    global _threads
    if count is not None and count < 1:
        raise MotionloomError(f"a session computes with 1 thread or more; got {count}")
    _threads = count


def threads() -> int:
    """Threads of sessions created now; 0: one per core."""
    if _threads is not None:
        return _threads
    text = os.environ.get(THREADS, "")
    if text and not (text.isascii() and text.isdigit() and 0 < int(text) <= 1024):
        raise MotionloomError(f"{THREADS} is a number of threads from 1 on; got {text!r}")
    return int(text or 0)


def find_device(name: str) -> str:
    """The device of that name, "cpu", "cuda" or "cuda:1"; raises MotionloomError where there is none."""
    kind, colon, number = name.partition(":")
    if kind not in DEVICES or (colon and not (kind == "cuda" and number.isascii() and number.isdigit())):
        raise MotionloomError(f"the device {name!r} cannot be used: there are {' and '.join(DEVICES)}")
    if kind != "cpu":
        import onnxruntime

        if DEVICES[kind] not in onnxruntime.get_available_providers():
            raise MotionloomError(
                f"the device {name!r} cannot be used: this ONNX Runtime has no {DEVICES[kind]}, which the package "
                "onnxruntime-gpu brings; cpu always can"
            )
    return name


class Session:
    """A graph and the arrays that are its weights."""

    def __init__(self, graph: bytes, weights: Weights, *, device: str = "cpu", seldom: bool = False) -> None:
        """A session that is created when it is first run.

        weights: called then. seldom: it is run a few times, so that a second copy of its weights, arranged for speed,
        is not worth it; a product of one row may then have other bits than the same row beside others.
        """
        self.device, self.threads, self._seldom = device, threads(), seldom
        self._graph, self._weights = graph, weights
        self._made: tuple[Any, Outline] | None = None
        self._making, self._own = threading.Lock(), threading.local()

    def run(self, feeds: Mapping[str, np.ndarray], *, held: Sequence[str] = ()) -> list[np.ndarray]:
        """The graph's answers, new arrays, in their order.

        feeds: an array for each input; what the graph does not need is left.
        held: names of those that never change once they were given, which are not brought to the device again.
        Several threads may run one session at the same time.
        Raises MotionloomError where the graph cannot be run.
        """
        with self._making:
            self._made = self._made or self._make()
        session, names = self._made
        try:
            if not hasattr(self._own, "io"):
                self._own.io, self._own.held = session.io_binding(), {}
            io = self._own.io
            for name in names.inputs:
                value = self._brought(name, feeds[name], name in held)
                io.bind_ortvalue_input(name, value)
            for name in names.outputs:
                io.bind_output(name, "cpu")
            session.run_with_iobinding(io)
            return io.copy_outputs_to_cpu()
        except Exception as error:
            raise _refused(error) from None

    def _make(self) -> "tuple[Any, Outline]":
        """A session of ONNX Runtime, and the names of its graph."""
        import onnxruntime

        weights = self._weights()
        names = check_graph(self._graph, weights)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = self.threads, 1
        options.log_severity_level = 4
        # threads that wait for the next call in a loop take the processors from NumPy's part between two calls
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        arrays = {name: np.ascontiguousarray(weights[name], np.float32) for name in names.weights}
        values = [onnxruntime.OrtValue.ortvalue_from_numpy(array) for array in arrays.values()]
        options.add_external_initializers(list(arrays), values)  # which copies them when the session is created
        if self._seldom:
            options.add_session_config_entry("session.disable_prepacking", "1")
        kind, _, number = self.device.partition(":")
        try:
            provider = DEVICES[kind] if kind == "cpu" else (DEVICES[kind], {"device_id": int(number or 0)})
            return onnxruntime.InferenceSession(self._graph, options, providers=[provider]), names
        except Exception as error:
            raise _refused(error) from None

    def _brought(self, name: str, array: np.ndarray, held: bool) -> Any:
        """The array as a value on the session's device."""
        import onnxruntime

        cache: dict[str, tuple[np.ndarray, Any]] = self._own.held
        if held and name in cache and cache[name][0] is array:
            return cache[name][1]
        kind, _, number = self.device.partition(":")
        value = onnxruntime.OrtValue.ortvalue_from_numpy(np.ascontiguousarray(array), kind, int(number or 0))
        if held:
            cache[name] = array, value
        return value


def check_graph(graph: bytes, weights: Mapping[str, np.ndarray], outputs: Sequence[str] | None = None) -> Outline:
    """The names of a graph that these weights fill; raises MotionloomError where it is none, or may not be run.

    outputs: what it has to answer; None: anything.
    """
    try:
        names = outline(graph)
        if outputs is not None and names.outputs != tuple(outputs):
            raise ValueError(f"it answers {', '.join(names.outputs) or 'nothing'}, not {', '.join(outputs)}")
        for name, shape in names.weights.items():
            if name not in weights or weights[name].shape != shape:
                there = weights[name].shape if name in weights else "missing"
                raise ValueError(f"its {name} is {shape}, and the weights' is {there}")
    except ValueError as error:
        raise MotionloomError(
            f"the graph in the weights cannot be run ({error}); write another by 'motionloom weights convert'"
        ) from None
    return names


def _refused(error: Exception) -> MotionloomError:
    reason = " ".join(str(error).split())
    return MotionloomError(
        f"the graph in the weights does not run ({reason[:200]}); write another by 'motionloom weights convert'"
    )
