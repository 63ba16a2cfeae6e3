"""Seconds of whole commands, against those of importing NumPy and ONNX Runtime."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from motionloom_lab.bench.speed import PROMPT, Entry, Process, process

LIBRARIES = ("-c", "import numpy, onnxruntime")
SECONDS = 5
"""Length of the motion that is made, read, written and drawn."""
MOST_MAKING, MOST_READING = 10.0, 3.5
"""Times an import of NumPy and ONNX Runtime."""


def starts(weights: str, *, repeats: int, run: Callable[[Sequence[str]], Process] = process) -> list[Entry]:
    """A sentence to BVH, and `info`, `export` and `view` of it, over an import of the libraries.

    The processes run in turns, after one round that is not measured. ``weights``: name or file. ``run``: runs Python
    with ``-c`` and code, `motionloom` with anything else.
    """
    with tempfile.TemporaryDirectory() as folder:
        clip = str(Path(folder) / "walk.bvh")
        commands = {
            "libraries": LIBRARIES,
            "generate": ("generate", PROMPT, "--weights", weights, "--seconds", str(SECONDS), "--out", clip),
            "info": ("info", clip),
            "export": ("export", clip, str(Path(folder) / "walk.glb")),
            "view": ("view", clip, "--out", str(Path(folder) / "walk.png")),
        }
        rounds = [{name: run(words) for name, words in commands.items()} for _ in range(repeats + 1)][1:]
    taken = {name: median(one[name].seconds for one in rounds) for name in commands}
    busy = {name: median(one[name].processor for one in rounds) for name in commands}
    return [_entry(name, taken, busy) for name in commands if name != "libraries"]


def _entry(name: str, taken: dict[str, float], busy: dict[str, float]) -> Entry:
    most = MOST_MAKING if name == "generate" else MOST_READING
    ratio = taken[name] / taken["libraries"]
    note = (
        f"{taken[name]:.2f} s of {taken['libraries']:.2f}; "
        f"of processor time {busy[name]:.2f} of {busy['libraries']:.2f}, "
        f"{busy[name] / busy['libraries']:.2f} times; {SECONDS} s of motion"
    )
    return Entry(
        f"motionloom {name}, whole process / import numpy, onnxruntime",
        ratio,
        "times",
        f"<= {most}",
        ratio <= most,
        note,
    )
