"""What commands cost from the start of their process to its end, against what importing PyTorch costs."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from motionloom.lab.bench.speed import PROMPT, Entry, Process, process

TORCH = ("-c", "import torch")
SECONDS = 5
"""Length of the motion that is made, read, written and drawn."""
MOST_MAKING, MOST_READING = 1.5, 0.47
"""Times an import of torch; the second is 0.8 s where that import takes 1.7."""


def starts(weights: str, *, repeats: int, run: Callable[[Sequence[str]], Process] = process) -> list[Entry]:
    """A sentence to BVH, and `info`, `export` and `view` of that file: seconds over those of ``import torch``.

    The processes run in turns, after one round that is not measured. ``weights``: name or file. ``run``: runs Python
    with ``-c`` and code, `motionloom` with anything else.
    """
    with tempfile.TemporaryDirectory() as folder:
        clip = str(Path(folder) / "walk.bvh")
        commands = {
            "torch": TORCH,
            "generate": ("generate", PROMPT, "--weights", weights, "--seconds", str(SECONDS), "--out", clip),
            "info": ("info", clip),
            "export": ("export", clip, str(Path(folder) / "walk.glb")),
            "view": ("view", clip, "--out", str(Path(folder) / "walk.png")),
        }
        rounds = [{name: run(words) for name, words in commands.items()} for _ in range(repeats + 1)][1:]
    taken = {name: median(one[name].seconds for one in rounds) for name in commands}
    busy = {name: median(one[name].processor for one in rounds) for name in commands}
    return [_entry(name, taken, busy) for name in commands if name != "torch"]


def _entry(name: str, taken: dict[str, float], busy: dict[str, float]) -> Entry:
    most = MOST_MAKING if name == "generate" else MOST_READING
    ratio = taken[name] / taken["torch"]
    note = (
        f"{taken[name]:.2f} s of {taken['torch']:.2f}; of processor time {busy[name]:.2f} of {busy['torch']:.2f}, "
        f"{busy[name] / busy['torch']:.2f} times; {SECONDS} s of motion"
    )
    return Entry(f"motionloom {name}, whole process / import torch", ratio, "times", f"<= {most}", ratio <= most, note)
