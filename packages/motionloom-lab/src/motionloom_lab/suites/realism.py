"""The realism run: generated motions beside real held-out clips of the same words and length."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from motionloom.core.features.layout import FPS
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array
from motionloom_lab.metrics.obedience import CHECKS
from motionloom_lab.metrics.realism import NUMBERS, average, compare, speed_distance
from motionloom_lab.suites.harness import Generate, Run, generator
from motionloom_lab.suites.items import RealClip

SHORTEST, LONGEST = 2.0, 9.8
"""Seconds of the real stretches that are compared with."""


@dataclass(frozen=True)
class Order:
    """Motions to generate in one call."""

    prompts: tuple[str, ...]
    seconds: float


def choose(clips: Sequence[RealClip], count: int) -> list[RealClip]:
    """At most ``count`` held-out captioned clips of usable length, spread evenly over the list."""
    usable = [c for c in clips if c.held_out and c.captions and SHORTEST <= len(c.positions) / FPS <= LONGEST + 0.2]
    if len(usable) <= count:
        return usable
    return [usable[round(k * (len(usable) - 1) / max(1, count - 1))] for k in range(count)]


def orders(clips: Sequence[RealClip], *, batch: int = 8) -> list[Order]:
    """The first caption of each clip at the clip's length in half seconds, in batches of equal length."""
    groups: dict[float, list[str]] = defaultdict(list)
    for clip in clips:
        groups[min(LONGEST, round(2 * len(clip.positions) / FPS) / 2)].append(clip.captions[0])
    return [
        Order(tuple(prompts[k : k + batch]), seconds)
        for seconds, prompts in sorted(groups.items())
        for k in range(0, len(prompts), batch)
    ]


def everyday(count: int) -> list[Order]:
    """Orders from the prompts of the obedience checks, for when there are no real clips at hand."""
    return [Order((check.prompt,) * max(1, count // len(CHECKS)), check.seconds) for check in CHECKS]


def run(
    run: Run, batches: Sequence[Order], *, generate: Generate | None = None, seed: int = 0
) -> tuple[list[Array], float]:
    """Generate all orders from seeds ``seed`` on: motions (frames, 22, 3) in metres, and their frames per second.

    generate: generates the motions; None: the run's weights with their usual settings.
    """
    generate = generate or generator(Prior.load(run.weights, device=run.device))
    clips: list[Array] = []
    fps = float(FPS)
    for order in batches:
        motions, fps = generate(order.prompts, seconds=order.seconds, seed=seed + len(clips))
        clips += motions
        run.progress(f"{len(clips)} of {sum(len(o.prompts) for o in batches)} motions")
    return clips, fps


def judge(clips: Sequence[Array], fps: float, real: Sequence[Array] | dict[str, float]) -> dict[str, Any]:
    """Comparison as plain data; ``real`` is clips at 20 frames per second or finished averages."""
    finished = real if isinstance(real, dict) else average(list(real), FPS)
    rows = compare(average(list(clips), fps), finished)
    data: dict[str, Any] = {
        "generated_clips": len(clips),
        "real_clips": None if isinstance(real, dict) else len(real),
        "numbers": {
            row.number.name: {
                "generated": round(row.generated, 4),
                "real": round(row.real, 4),
                "ratio": None if row.ratio == float("inf") else round(row.ratio, 3),
                "passes": row.passes,
            }
            for row in rows
        },
    }
    if not isinstance(real, dict) and fps == FPS and clips and len(real):
        data["speed_distance"] = round(speed_distance(list(clips), list(real), FPS), 4)
    data["passed"] = sum(row.passes for row in rows)
    return data


def table(data: dict[str, Any]) -> list[list[str]]:
    """Rows of text for `judge`'s answer, the heading first."""
    rows = [["number", "generated", "real", "ratio", "", "what it is"]]
    for number in NUMBERS:
        n = data["numbers"][number.name]
        ratio = "-" if n["ratio"] is None else f"{n['ratio']:.2f}"
        verdict = "ok" if n["passes"] else "FAIL"
        rows.append([number.name, f"{n['generated']:.3f}", f"{n['real']:.3f}", ratio, verdict, number.meaning])
    return rows
