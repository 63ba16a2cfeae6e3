"""Tools that time and weigh, what `generate` costs, and what whole commands take beside imports of their libraries."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import torch
from torch.nn.attention import SDPBackend, sdpa_kernel
from torch.utils.flop_counter import FlopCounterMode

from motionloom.core.diffusion import DDPM, SOLVERS, Denoiser, Solver, guide, levels, row_noise, sample
from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS
from motionloom_train.modules import prior_module
from motionloom_train.tensors import conditions, tensor

LONG = 1000
"""Steps of the sampler that the default is compared with."""
TIMED = 20
"""Steps of it that are timed; they all cost the same."""
PROMPT = "a person walks forward and waves"


@dataclass(frozen=True)
class Entry:
    """One measured number against its target."""

    name: str
    value: float
    unit: str
    target: str
    passes: bool
    note: str = ""


@dataclass(frozen=True)
class Sampling:
    """How `generate` samples by default."""

    steps: int = STEPS
    guidance: float = GUIDANCE
    solver: Solver = SOLVERS[SOLVER]


def guided(prior: Prior, rows: int, *, guidance: float) -> Denoiser:
    """The guided network for ``rows`` copies of one prompt, its text encoded once."""
    cond = prior.condition([PROMPT] * rows)
    return guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)


def noise(prior: Prior, rows: int, seconds: float) -> np.ndarray:
    """Where a walk of ``rows`` motions starts."""
    shape = (rows, round(seconds * prior.fps), len(prior.mean))
    return row_noise(range(rows))(np.empty(shape, np.float32))


def timed(jobs: Sequence[Callable[[], Any]], repeats: int, *, warm: int | None = None) -> list[float]:
    """Median seconds of each job, taken in turns after one unmeasured round, so that a slow moment hits all alike.

    warm: how many of the jobs, the first ones, are in the unmeasured round; None: all.
    """
    times: list[list[float]] = [[] for _ in jobs]
    for turn in range(repeats + 1):
        for job, seconds in zip(jobs, times, strict=True) if turn else zip(jobs[:warm], times):
            start = time.perf_counter()
            job()
            if turn:
                seconds.append(time.perf_counter() - start)
    return [median(seconds) for seconds in times]


def _walk(
    prior: Prior, denoise: Denoiser, x: np.ndarray, way: Sequence[int], *, solver: Solver, stop: int | None
) -> None:
    walk = sample(denoise, x, levels=way, solver=solver, schedule=prior.schedule, noise=row_noise(range(len(x))))
    for number, _ in enumerate(walk, start=1):
        if number == stop:
            return


def speed_of_default(prior: Prior, how: Sampling, *, seconds: float, repeats: int) -> Entry:
    """Time of the 1000-step walk over the time of the default walk."""
    denoise, x = guided(prior, 1, guidance=how.guidance), noise(prior, 1, seconds)
    steps = min(how.steps, prior.schedule.steps)
    few, long = levels(prior.schedule, steps, spacing=SPACING), levels(prior.schedule, min(LONG, prior.schedule.steps))
    stop = min(TIMED, len(long) - 1)
    fast, slow = timed(
        [
            lambda: _walk(prior, denoise, x, few, solver=how.solver, stop=None),
            lambda: _walk(prior, denoise, x, long, solver=DDPM, stop=stop),
        ],
        repeats,
    )
    ratio = slow * LONG / stop / fast
    note = f"{steps} steps: {fast:.2f} s; {LONG} of DDPM: {slow * LONG / stop:.1f} s, reckoned from {stop} timed ones"
    return Entry("1000 steps / default", ratio, "times", ">= 40", ratio >= 40, note)


def flops(call: Callable[[], Any]) -> int:
    """Floating-point operations of the matrix products in a call of PyTorch, two per multiplication and addition."""
    with torch.inference_mode(), sdpa_kernel(SDPBackend.MATH), FlopCounterMode(display=False) as counter:
        call()
    return counter.get_total_flops()


def guided_flops(prior: Prior, x: np.ndarray, level: int) -> int:
    """`flops` of a guided call, counted in the module of the same network."""
    net, both = prior_module(prior), tensor(np.concatenate([x, x]))
    bound = net.bind(conditions(prior.condition([PROMPT] * len(both))))
    return flops(lambda: net(both, level, bound))


def efficiency(
    prior: Prior, how: Sampling, *, rows: int, seconds: float, repeats: int, sizes: Sequence[int] = (1024, 2048)
) -> Entry:
    """Operations per second of one guided call over those of a plain matrix product in NumPy."""
    denoise, x = guided(prior, rows, guidance=how.guidance), noise(prior, rows, seconds)
    level = max(1, prior.schedule.steps // 2)

    squares = [np.random.default_rng(0).standard_normal((n, n), np.float32) for n in sizes]
    work = guided_flops(prior, x, level)
    spent, *products = timed([partial(denoise, x, level), *(partial(np.matmul, a, a) for a in squares)], repeats)
    best = max(2 * n**3 / t for n, t in zip(sizes, products, strict=True))
    share = 100 * work / spent / best
    note = (
        f"{work / 1e9:.2f} GFLOP in {1000 * spent:.1f} ms = {work / spent / 1e9:.0f} GFLOP/s of {best / 1e9:.0f}; "
        f"{rows} motion(s) of {seconds:g} s"
    )
    return Entry(f"guided call, {rows} motion(s)", share, "% of a matrix product", ">= 70", share >= 70, note)


def linearity(prior: Prior, how: Sampling, *, counts: Sequence[int], seconds: float, repeats: int) -> Entry:
    """Time of a guided call by the number of motions: does each further one cost the same?"""
    jobs = []
    for count in counts:
        denoise, x = guided(prior, count, guidance=how.guidance), noise(prior, count, seconds)
        jobs.append(partial(denoise, x, max(1, prior.schedule.steps // 2)))
    times = timed(jobs, repeats)
    slope, start, r2 = fit(counts, times)
    each = times[-1] / counts[-1] / (times[0] / counts[0])
    note = (
        ", ".join(f"{n}: {1000 * t:.0f} ms" for n, t in zip(counts, times, strict=True))
        + f"; {1000 * slope:.1f} ms for each and {1000 * start:.1f} ms once; "
        f"one of {counts[-1]} costs {each:.2f} of one alone"
    )
    return Entry(
        "time is linear in motions", r2, "r^2", ">= 0.99, none dearer than 1.1", r2 >= 0.99 and each <= 1.1, note
    )


def fit(counts: Sequence[float], times: Sequence[float]) -> tuple[float, float, float]:
    """Least-squares line: slope, value at 0, and the share of variance it explains."""
    slope, start = np.polyfit(counts, times, 1)
    spread = np.var(times)
    rest = np.var(np.asarray(times) - slope * np.asarray(counts))
    return float(slope), float(start), float(1.0 - rest / spread) if spread else 1.0


@dataclass(frozen=True)
class Process:
    """What a command cost from its start to its end."""

    seconds: float
    peak_mb: float
    """Greatest resident memory, 2^20 bytes."""
    processor: float
    """Seconds of all processors together, which other work on the machine changes little."""


_COMMAND = """import os, sys
from motionloom.cli import main
try:
    sys.exit(main())
finally:
    if os.path.exists("/proc/self/status"):
        print(*(line for line in open("/proc/self/status") if line.startswith("VmHWM")), file=sys.stderr)
"""
"""A command that prints its own peak at the end: what Linux reports to the parent includes the parent's memory."""


def process(arguments: Sequence[str]) -> Process:
    """Run `motionloom ARGUMENTS` in a fresh interpreter, or ``-c CODE`` in it as Python does.

    Raises MotionloomError with its last line if it fails.
    """
    if not hasattr(os, "wait4"):
        raise MotionloomError("this system does not tell what a process used; run bench on Linux or macOS")
    words = arguments if arguments[:1] == ("-c",) else ("-c", _COMMAND, *arguments)
    with tempfile.TemporaryFile() as log:
        start = time.perf_counter()
        child = subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL, stderr=log)
        _, status, used = os.wait4(child.pid, 0)
        seconds = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        lines = log.read().decode(errors="replace").strip().splitlines()
        match = re.fullmatch(r"VmHWM:\s*(\d+) kB", lines.pop().strip()) if lines and "VmHWM" in lines[-1] else None
        if child.returncode:
            raise MotionloomError(f"motionloom {' '.join(arguments)} failed: {lines[-1] if lines else 'no message'}")
    peak = int(match[1]) if match else used.ru_maxrss / (2**10 if sys.platform == "darwin" else 1)
    return Process(seconds, peak / 2**10, used.ru_utime + used.ru_stime)


def commands(weights: str, *, repeats: int, run: Callable[[Sequence[str]], Process] = process) -> list[Entry]:
    """`--help`, and the memory of a 10-second generation; `starts` has what other commands take."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "walk.bvh")
        make = ["generate", PROMPT, "--weights", weights, "--seed", "0", "--out", out]
        run(["--help"])
        help_s = median(run(["--help"]).seconds for _ in range(repeats))
        memory = run([*make, "--seconds", "10"]).peak_mb
    return [
        Entry("motionloom --help", help_s, "s", "< 0.5", help_s < 0.5, f"median of {repeats}"),
        Entry(
            "memory of a 10-second generation", memory, "MB", "< 1500", memory < 1500, "peak resident, whole process"
        ),
    ]


LIBRARIES = ("-c", "import numpy, onnxruntime")
SECONDS = 5
"""Length of the motion that is generated, read, written and shown."""
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
    times = {name: median(one[name].seconds for one in rounds) for name in commands}
    busy = {name: median(one[name].processor for one in rounds) for name in commands}
    return [_entry(name, times, busy) for name in commands if name != "libraries"]


def _entry(name: str, times: dict[str, float], busy: dict[str, float]) -> Entry:
    most = MOST_MAKING if name == "generate" else MOST_READING
    ratio = times[name] / times["libraries"]
    note = (
        f"{times[name]:.2f} s of {times['libraries']:.2f}; "
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
