"""The suites that need no learned judge, as reports: obedience and realism by physics, speed by the clock."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.features.layout import FPS
from motionloom.kinematics.physics import Array
from motionloom_lab.metrics.obedience import CHECKS, Check
from motionloom_lab.metrics.realism import NUMBERS, average, speed_distance
from motionloom_lab.metrics.realism import realism as numbers_of
from motionloom_lab.report.report import REAL, Column, Report, Row, Value
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import bodies, obey, realism
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.items import real_clips
from motionloom_lab.suites.reference import known

AS_DRAWN, AS_EXPORTED = "generated", "generated, as exported"
RESAMPLES = 400


def obedience_report(
    results: Sequence[obey.Result], checks: Sequence[Check] = CHECKS, *, run: Run, settings: Mapping[str, Any]
) -> Report:
    """One row per prompt and one for all: shares of seeds that obey, beside what real clips of the action pass."""
    by_name, real = {check.name: check for check in checks}, known()["checks"]
    rows = []
    for result in results:
        check = by_name[result.name]
        own = result.of(check.prompt)
        other = [a for a in result.attempts if a.prompt != check.prompt]
        passed, tried = (int(n) for n in real.get(check.name, {}).get("all", "0/0").split("/"))
        rows.append(Row(check.prompt, _shares(own, other) | ({"real": _share(passed, tried)} if tried else {})))
    every = [a for result in results for a in result.attempts]
    prompts = {check.prompt for check in checks}
    total = _shares([a for a in every if a.prompt in prompts], [a for a in every if a.prompt not in prompts])
    totals = obey.totals(results, checks)
    note = f"{totals['prompts_obeyed']} of {totals['prompts']} prompts are obeyed on {obey.ENOUGH:.0%} of their seeds."
    protocol = {"checks": obey.fingerprint(checks), **settings}
    title = "Obedience: does it do what the words say"
    return run.report("obedience", title, protocol, (Row("all prompts", total), *rows), (note,))


def _share(passed: int, tried: int) -> Value:
    return Value(passed / tried, count=tried)


def _shares(own: Sequence[obey.Attempt], other: Sequence[obey.Attempt]) -> dict[str, Value]:
    groups = {"obeyed": own, "reworded": other}
    return {name: _share(sum(a.obeyed for a in group), len(group)) for name, group in groups.items() if group}


def realism_value(clips: Sequence[Array], fps: float) -> dict[str, Value]:
    """The averages of `lab.metrics.realism` with 95 % intervals; ``clips`` (frames, 22, 3) metres each.

    The interval is 1.96 standard errors by the bootstrap over clips (Efron 1979), since the averages are weighted by
    length and one is a median; nan for a single clip.
    """
    means = average(list(clips), fps)
    rows = np.array([[numbers[n.name] for n in NUMBERS] for numbers in (numbers_of(clip, fps) for clip in clips)])
    lengths = np.array([len(clip) for clip in clips], dtype=np.float64)
    picks = np.random.default_rng(0).integers(len(clips), size=(RESAMPLES, len(clips)))
    weighted = np.einsum("rc,rck->rk", lengths[picks], rows[picks]) / lengths[picks].sum(axis=1)[:, None]
    middle = np.median(rows[picks], axis=1)
    samples = np.where([n.typical for n in NUMBERS], middle, weighted)
    spread = 1.96 * samples.std(axis=0, ddof=1) if len(clips) > 1 else np.full(len(NUMBERS), np.nan)
    return {n.name: Value(means[n.name], float(s), len(clips)) for n, s in zip(NUMBERS, spread, strict=True)}


def realism_report(
    groups: Mapping[str, Sequence[Array]],
    fps: float,
    real: Sequence[Array] | Mapping[str, float],
    *,
    run: Run,
    protocol: Mapping[str, Any],
) -> Report:
    """A row of real motion (clips at 20 frames per second, or finished averages) and one per group of motions.

    Bodies are held against recorded people (`bodies.known`), whatever the clips are.
    """
    heads = [
        Column(n.name, n.name.replace("_", " "), "real" if n.both_ways else "down", n.meaning, _digits(n.unseen))
        for n in NUMBERS
    ]
    rows = []
    if isinstance(real, Mapping):
        rows.append(Row(REAL, {n.name: Value(real[n.name]) for n in NUMBERS}))
    else:
        rows.append(Row(REAL, realism_value(real, FPS)))
        meaning = "m/s, Wasserstein-1 distance of the pelvis speeds of all frames to the real ones"
        heads.append(Column("speed_distance", "speed distance", "down", meaning, 3))
    reach, sentences = bodies.known(), []
    people = {f"body_{name}": Value(percentiles[2]) for name, percentiles in reach.items()}
    rows = [Row(row.name, {**row.values, **people}) for row in rows]
    for name, clips in groups.items():
        held = bodies.judge(clips, reach)
        values = realism_value(clips, fps) | body_values(held, len(clips))
        sentences.append(
            f"{name}: {held['passed']} of {held['of']} numbers of the body are within what recorded people do."
        )
        if not isinstance(real, Mapping) and fps == FPS:
            values["speed_distance"] = Value(speed_distance(list(clips), list(real), FPS))
        rows.append(Row(name, values))
    sentences += notes("realism")
    heads += columns("realism-body")
    return run.report(
        "realism", "Realism: does it move like real people", protocol, rows, sentences, columns=tuple(heads)
    )


def body_values(held: Mapping[str, Any], count: int) -> dict[str, Value]:
    """The columns of bodies out of `bodies.judge`'s answer for so many clips."""
    numbers = held["numbers"]
    values = {name: n["median"] for name, n in numbers.items() if "median" in n}
    values |= {"whole": numbers["whole"]["share"], "bones": numbers["bones"]["stretched"]}
    return {f"body_{name}": Value(value, count=count) for name, value in values.items()}


def _digits(unseen: float) -> int:
    """Decimals that show a tenth of what can be seen."""
    return max(0, 1 - math.floor(math.log10(unseen)))


def realism_orders(data: Path | None, count: int) -> tuple[list[realism.Order], Any, dict[str, Any]]:
    """What to generate, the real motion to hold it against, and how both were chosen, for the protocol."""
    if data is None:
        about = {"real": "the shipped averages of held-out clips", "prompts": "the prompts of the obedience checks"}
        return realism.everyday(count), known()["realism"]["held_out"], about
    chosen = realism.choose(list(real_clips(data)), count)
    about = {"real": f"{len(chosen)} held-out captioned clips of 2 to 10 s", "prompts": "their captions and lengths"}
    return realism.orders(chosen), [clip.positions for clip in chosen], about


def speed_report(results: Mapping[str, Any], *, run: Run) -> Report:
    """`motionloom bench`'s numbers as a report of one row, each number with its target."""
    machine = {name: value for name, value in results["machine"].items() if name != "load"}
    heads, values = [], {}
    for k, entry in enumerate(results["entries"]):
        name = "".join(c if c.isalnum() else "_" for c in entry["name"]).strip("_") or f"entry_{k}"
        better = "down" if "<" in entry["target"] else "up"
        digits = 0 if abs(entry["value"]) >= 100 else 1 if abs(entry["value"]) >= 10 else 3
        heads.append(Column(name, f"{entry['name']}, {entry['unit']}", better, f"target {entry['target']}", digits))
        values[name] = Value(entry["value"])
    notes = [f"{entry['name']}: {entry['note']}" for entry in results["entries"] if entry["note"]]
    if results["machine"]["load"] > 0.5:
        notes.append(f"The machine was busy when this began (load {results['machine']['load']}).")
    protocol = {"machine": machine, "repeats": "few" if results["quick"] else "full"}
    title = "Speed: time and memory as ratios within one run"
    return run.report("speed", title, protocol, [Row("this machine", values)], notes, columns=tuple(heads))
