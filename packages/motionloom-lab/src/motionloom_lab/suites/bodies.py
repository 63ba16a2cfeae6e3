"""Recorded people as `lab.metrics.bodies` reads them, and generated bodies beside them.

``bodies.json`` beside this file holds the percentiles of the packs that the project was built with (no motion);
`motionloom evaluate reach` writes it anew.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_table
from motionloom.kinematics.physics import Array
from motionloom.kinematics.wholeness import whole_frames
from motionloom_lab.metrics import bodies
from motionloom_lab.papers.readers import find_takes
from motionloom_train.data.progress import Say, silent

MOST = 200
"""Recordings of each folder: enough for percentiles."""


def known() -> bodies.Reach:
    """The shipped percentiles."""
    return {name: tuple(values) for name, values in read_table("motionloom_lab.suites", "bodies.json")["reach"].items()}


def reach_of(folders: Sequence[Path | str], *, say: Say = silent) -> bodies.Reach:
    """Percentiles of the people recorded in folders, on their own skeletons; what is animated by hand is left out.

    Of each folder `MOST` recordings are read, spread evenly over it.
    Raises `MotionloomError` for folders without recordings of joints.
    """
    return bodies.reach_of(_recordings(folders, say))


def _recordings(folders: Sequence[Path | str], say: Say) -> Iterator[Array]:
    count = 0
    for folder in folders:
        captured = [take for take in find_takes(folder) if take.kind == "capture"]
        takes = [captured[k * len(captured) // MOST] for k in range(MOST)] if len(captured) > MOST else captured
        for number, take in enumerate(takes):
            if number % 100 == 0:
                say(f"{folder}: recording {number + 1} of {len(takes)}")
            try:
                recording = take.read()
            except MotionloomError:
                continue  # `data build` reports which
            if not isinstance(recording, np.ndarray):
                count += 1
                yield recording.own
    if not count:
        raise MotionloomError(
            f"{', '.join(map(str, folders))}: no recordings of joints; name folders of BVH or AMC files"
        )


def judge(clips: Sequence[Array], reach: bodies.Reach) -> dict[str, Any]:
    """How generated bodies are held, as plain data; ``passed`` of ``of``."""
    rows = bodies.compare_bodies(clips, reach)
    whole = float(np.mean([whole_frames(clip).mean() for clip in clips])) if clips else 0.0
    stretched = bodies.stretched(clips)
    numbers: dict[str, Any] = {
        row.name: {"median": row.median, "people": list(row.reach), "outside": row.outside, "passes": row.passes}
        for row in rows
    }
    numbers["whole"] = {"share": round(whole, 4), "passes": whole >= 1 - bodies.OUTSIDE}
    numbers["bones"] = {"stretched": round(stretched, 4), "passes": stretched <= bodies.STRETCHED}
    return {"numbers": numbers, "passed": sum(n["passes"] for n in numbers.values()), "of": len(numbers)}


def table(answer: dict[str, Any]) -> list[list[str]]:
    """Rows of text for `judge`'s answer, the heading first."""
    rows = [["body", "drawn", "people (5 to 95 %)", "outside", "", "what it is"]]
    for name, n in answer["numbers"].items():
        verdict = "ok" if n["passes"] else "FAIL"
        if name in bodies.MEANING:
            people = f"{n['people'][1]:.0f} to {n['people'][3]:.0f}"
            rows.append([name, f"{n['median']:.1f}", people, f"{n['outside']:.1%}", verdict, bodies.MEANING[name]])
    whole, bones = answer["numbers"]["whole"], answer["numbers"]["bones"]
    limits = (f">= {1 - bodies.OUTSIDE:.0%}", f"<= {bodies.STRETCHED:.0%}")
    for name, value, limit, n, meaning in (
        ("whole", whole["share"], limits[0], whole, "frames in which the body is a person's (kinematics/wholeness.py)"),
        ("bones", bones["stretched"], limits[1], bones, "how far the worst bone is from the person's length"),
    ):
        rows.append([name, f"{value:.1%}", limit, "", "ok" if n["passes"] else "FAIL", meaning])
    return rows
