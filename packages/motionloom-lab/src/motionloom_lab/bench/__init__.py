"""`motionloom bench`: speed as ratios within one run, so that they mean the same on any machine.

Times are medians of interleaved repeats. Nothing here is a test: on a busy machine it is slower, not wrong.
`speed` has the tools, what `generate` costs and what whole processes take, `long` what `compose` costs, `prediction`
what futures cost.
"""

import os
import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Literal

import onnxruntime

from motionloom.core.models.networks.session import threads
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Prior
from motionloom_lab.bench.long import FULL, QUICK, entries_of, long_motion
from motionloom_lab.bench.prediction import cost_of_futures
from motionloom_lab.bench.speed import (
    Entry,
    Process,
    Sampling,
    commands,
    efficiency,
    linearity,
    process,
    speed_of_default,
    starts,
)
from motionloom_train.data.progress import Say, silent

__all__ = ["Entry", "Process", "Sampling", "bench", "bench_prediction", "machine", "process", "table"]


def bench(
    prior: Prior,
    how: Sampling,
    *,
    what: Literal["short", "long", "all"] = "short",
    quick: bool = False,
    weights: str = "default",
    sizes: Sequence[int] = (1024, 2048),
    run: Callable[[Sequence[str]], Process] = process,
    progress: Say = silent,
) -> dict[str, Any]:
    """Single motions, long motion (minutes, unless ``quick``), or both, as plain data.

    ``sizes``: square matrices whose product is the measure of the machine. ``weights``: those of ``prior``, by name or
    file, for the commands that are run. ``run``: runs `motionloom` with some arguments.
    """
    about = machine(prior)  # before this run itself is load
    repeats, counts = (1, (1, 2, 4)) if quick else (5, (1, 2, 4, 8, 16))
    parts: list[Callable[[], list[Entry]]] = [
        lambda: [speed_of_default(prior, how, seconds=6.0, repeats=min(repeats, 3))],
        lambda: [
            efficiency(prior, how, rows=rows, seconds=9.8, repeats=4 * repeats, sizes=sizes) for rows in (1, counts[-1])
        ],
        lambda: [linearity(prior, how, counts=counts, seconds=6.0, repeats=repeats)],
        lambda: commands(weights, repeats=min(repeats, 3), run=run),
        lambda: starts(weights, repeats=repeats, run=run),
    ]
    results: dict[str, Any] = {"machine": about, "quick": quick, "entries": []}

    def keep(entries: list[Entry]) -> None:
        for entry in entries:
            results["entries"].append(asdict(entry))
            progress(f"{entry.name}: {entry.value:.3g} {entry.unit}")

    for part in parts if what != "long" else []:
        keep(part())
    if what != "short":
        measured = long_motion(prior, how, QUICK if quick else FULL, weights=weights, run=run, progress=progress)
        results["long"] = asdict(measured)
        keep(entries_of(measured))
    return results


def bench_prediction(predictor: Predictor, *, quick: bool = False, progress: Say = silent) -> dict[str, Any]:
    """What futures cost, as plain data."""
    about = machine(predictor)
    entries = cost_of_futures(predictor, repeats=1 if quick else 5, timed_steps=2 if quick else 10, progress=progress)
    return {"machine": about, "quick": quick, "entries": [asdict(entry) for entry in entries]}


def machine(prior: Prior | Predictor) -> dict[str, Any]:
    """What it ran on."""
    return {
        "device": prior.net.device if prior.net.device != "cpu" else platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else 0.0,
        "threads": threads() or os.cpu_count(),
        "onnxruntime": onnxruntime.__version__,
        "python": platform.python_version(),
        "type": "float32",
        "parameters": sum(values.size for values in prior.net.weights.values()),
    }


def table(results: dict[str, Any]) -> list[list[str]]:
    """Rows of text, the heading first."""
    rows = [["what", "measured", "", "target", "", "how"]]
    for entry in results["entries"]:
        verdict = "ok" if entry["passes"] else "MISSED"
        rows.append([entry["name"], f"{entry['value']:.3g}", entry["unit"], entry["target"], verdict, entry["note"]])
    return rows
