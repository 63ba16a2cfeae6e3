"""Five actions that the weights have not seen, three clips each: what `motionloom teach` makes of them.

    python benchmarks/teach.py PACK [PACK ...] --out OUT [--only flip,windows] [--weights default] [--seeds 10]

PACK is a folder with a manifest.csv, as `motionloom data build` reads it. For each action an adapter is taught from its
first three clips; its prompts are drawn on seeds that no training used, before and after, and judged by a physical
check. So that a check means something it is also tried on all clips of the packs, those of the action and the others.
With --old the twenty prompts of `motionloom evaluate obedience` are drawn before and after too: what was known stays.
With --taught FOLDER the adapters of an earlier run, its OUT, are judged again. Adapters are used as FILE alone, which
changes sentences that are like what was taught; with --everywhere as FILE:1, which changes all of them.

OUT gets NAME.safetensors, NAME.png (the first draws, before and after) and teach.json.
"""

import argparse
import csv
import json
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.tasks.adapting import adapt
from motionloom.tasks.text import generate
from motionloom.viz.video import draw_sheet
from motionloom_lab.suites import obey
from motionloom_lab.suites.harness import Run
from motionloom_train.data.examples import CaptionedClip, make_examples, uniform_positions
from motionloom_train.data.paths import inside
from motionloom_train.data.sources import find_takes
from motionloom_train.teach import Lesson, teach

FIRST_SEED = 7000
CLIPS = 3
OTHERS = 150
"""Clips of other actions that each check is tried on."""


@dataclass(frozen=True)
class Action:
    """Something to teach, and how one sees that it is done."""

    name: str
    caption: str
    """What all its clips are said to show."""
    prompts: tuple[str, ...]
    """What is asked for: the caption's words and others."""
    clips: tuple[str, ...]
    """How the names of the clips begin that show it."""
    words: str
    """Pattern of descriptions of clips that may show it as well."""
    done: Callable[[Array, float], bool]
    """(frames, 22, 3) metres and frames per second."""
    seconds: float = 5.0


def share(held: np.ndarray) -> float:
    """Share of frames in which something is so."""
    return float(np.mean(held))


def arm_back(p: Array, fps: float) -> bool:
    """One hand goes well behind the pelvis and comes forward again while the other stays, and nobody walks."""
    ahead = ph.in_body(p)[:, [20, 21], 2]
    low = ahead.min(axis=0)
    side = int(low.argmin())
    back = int(ahead[:, side].argmin())
    comes = ahead[back:, side].max() > low[side] + 0.25
    return bool(low[side] < -0.25 and low[1 - side] > -0.2 and comes and ph.travel(p, fps) < 0.8)


def forearm(p: Array, fps: float) -> bool:
    """One elbow at the height of its shoulder and out to the side, the forearm turning by 45 degrees, nobody walks."""
    body = ph.in_body(p)
    for shoulder, elbow, wrist in ((16, 18, 20), (17, 19, 21)):
        upper, lower = body[:, elbow] - body[:, shoulder], body[:, wrist] - body[:, elbow]
        lifted = (np.abs(upper[:, 1]) < 0.14) & (np.abs(upper[:, 0]) > 0.15)
        if share(lifted) < 0.5:
            continue
        way = lower[lifted] / np.linalg.norm(lower[lifted], axis=-1, keepdims=True)
        if (way @ way.T).min() < np.cos(np.radians(45)) and ph.travel(p, fps) < 0.8:
            return True
    return False


def charleston(p: Array, fps: float) -> bool:
    """On the spot a foot is swung ahead of the pelvis and one behind it, at least twice each."""
    ankles = ph.in_body(p)[:, [7, 8], 2]
    far = (ankles.max(axis=1) > 0.14, ankles.min(axis=1) < -0.22)
    swings = [int((np.diff(there.astype(int)) == 1).sum()) for there in far]
    gone = np.linalg.norm((p[-1, 0] - p[0, 0])[[0, 2]])
    return bool(min(swings) >= 2 and gone < 0.25 * len(p) / fps)


def wipe(p: Array, fps: float) -> bool:
    """A hand ahead of the chest keeps going round or to and fro there for half of the time, and nobody walks off."""
    body = ph.in_body(p)
    for shoulder, wrist in ((16, 20), (17, 21)):
        high = (body[:, wrist, 1] > body[:, shoulder, 1] - 0.2) & (body[:, wrist, 2] > 0.22)
        pace = np.linalg.norm(ph.velocity(body[:, wrist], fps), axis=-1)
        if share(high) > 0.5 and pace[high].mean() > 0.35 and ph.travel(p, fps) < 0.35 * len(p) / fps:
            return True
    return False


def flip(p: Array, fps: float) -> bool:
    """The head is under the pelvis while nothing touches the floor, and the feet come down again."""
    over = (p[:, 15, 1] < p[:, 0, 1]) & (p[..., 1].min(axis=1) > 0.1)
    return bool(over.any() and p[-3:, [10, 11], 1].min() < 0.2)


ACTIONS = (
    Action(
        "arm_back",
        "a person pulls the right arm back behind the hip",
        ("a person pulls the right arm back behind the hip", "someone pulls an arm backward and brings it forward"),
        ("ui_m08",),
        r"\barms?\b.* (?:back|behind)",
        arm_back,
    ),
    Action(
        "forearm",
        "a person turns the forearm with the elbow lifted to the side",
        ("a person turns the forearm with the elbow lifted to the side", "someone rotates the lifted, bent arm"),
        ("ui_m09",),
        r"rotat|forearm",
        forearm,
    ),
    Action(
        "charleston",
        "a person dances the charleston",
        ("a person dances the charleston", "someone does the charleston"),
        ("93_c", "mesh2motion_dance_charleston"),
        r"danc|charleston",
        charleston,
    ),
    Action(
        "windows",
        "a person washes windows",
        ("a person washes windows", "someone wipes a window pane"),
        ("14_10", "14_12"),
        r"wash|wip|clean|scrub",
        wipe,
    ),
    Action(
        "flip",
        "a person does a flip",
        ("a person does a flip", "someone does a somersault in the air"),
        ("88_01", "87_b1", "90_08"),
        r"flip|spring|somersault",
        flip,
    ),
)
"""``recipes/default.toml`` leaves their clips out of the set that the default prior is trained on."""


def find_clips(packs: Sequence[Path]) -> list[dict[str, Any]]:
    """Rows of the packs' manifests, with the path of each clip and every word that is said of it."""
    rows = []
    for pack in packs:
        takes = {take.name: take for take in find_takes(pack)}
        with open(pack / "manifest.csv", newline="", encoding="utf-8") as lines:
            for row in csv.DictReader(lines):
                take = takes.get(row["clip"])
                said = [row["description"], *(t for span in (take.spans if take else ()) for t in span.texts)]
                rows.append({**row, "file": inside(pack, row["path"]), "said": " | ".join(said).lower()})
    return rows


def of_action(action: Action, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The clips that show the action."""
    return [row for row in rows if row["clip"].startswith(action.clips)]


def read(row: dict[str, Any]) -> Motion:
    """A clip of a pack."""
    unit = None if row["file"].suffix == ".amc" else float(row["metres_per_unit"])
    return load(row["file"], fps=float(row["fps"]), unit=unit)


def tried(action: Action, rows: list[dict[str, Any]]) -> dict[str, str]:
    """How many real clips pass the check: those of the action, and others."""
    own = of_action(action, rows)
    names = {row["clip"] for row in own}
    others = [row for row in rows if row["clip"] not in names and not re.search(action.words, row["said"])]
    others = others[:: max(1, len(others) // OTHERS)][:OTHERS]
    counts = {}
    for label, group in (("real", own), ("others", others)):
        passed, count = 0, 0
        for row in group:
            try:
                passed += action.done(uniform_positions(read(row)), 20.0)
                count += 1
            except MotionloomError:
                continue
        counts[label] = f"{passed}/{count}"
    return counts


def obeyed(prior: Prior, action: Action, seeds: int) -> tuple[dict[str, int], list[Motion]]:
    """How many seeds obey each prompt, and the first draws."""
    counts, firsts = {}, []
    for prompt in action.prompts:
        made = generate(prior, prompt, seconds=action.seconds, count=seeds, seed=FIRST_SEED)
        counts[prompt] = sum(action.done(motion.positions(), motion.fps) for motion in made)
        firsts.append(made[0])
    return counts, firsts


def old_ones(prior: Prior, seeds: int) -> dict[str, int]:
    """How many seeds obey each of the twenty prompts of the obedience suite."""

    def drawn(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        made = generate(prior, list(prompts), seconds=seconds, seed=seed)
        return [motion.positions() for motion in made], made[0].fps

    results = obey.run(Run(), generate=drawn, seeds=seeds, first_seed=FIRST_SEED)
    return {result.name: sum(attempt.obeyed for attempt in result.attempts) for result in results}


def measure(action: Action, rows: list[dict[str, Any]], prior: Prior, arguments: argparse.Namespace) -> dict[str, Any]:
    """Teach one action and say what came of it."""
    chosen = of_action(action, rows)[:CLIPS]
    print(f"{action.name}: {', '.join(row['clip'] for row in chosen)}", flush=True)
    examples = [e for row in chosen for e in make_examples(read(row), CaptionedClip(row["file"], (action.caption,)))]
    before, first = obeyed(prior, action, arguments.seeds)
    began = time.perf_counter()
    settings = {"steps": arguments.steps} if arguments.steps else {}
    if arguments.taught:
        adapter = Adapter.load(arguments.taught / f"{action.name}.safetensors", prior)
    else:
        adapter = teach(prior, examples, Lesson(name=action.name, licence="only to measure", **settings), say=print)
    seconds = time.perf_counter() - began
    place = adapter.save(arguments.out / f"{action.name}.safetensors")
    taught = adapt(prior, [(adapter, 1.0 if arguments.everywhere else None)])
    after, last = obeyed(taught, action, arguments.seeds)
    captions = [f"{when}: {prompt}" for when in ("before", "after") for prompt in action.prompts]
    draw_sheet([*first, *last], arguments.out / f"{action.name}.png", captions=captions)
    result = {
        "clips": [row["clip"] for row in chosen],
        "check": tried(action, rows),
        "before": before,
        "after": after,
        "seeds": arguments.seeds,
        "teaching_seconds": round(seconds),
        "megabytes": round(place.stat().st_size / 1e6, 2),
    }
    if arguments.old:
        result |= {"old_after": old_ones(taught, arguments.old)}
    print(json.dumps(result), flush=True)
    return result


def main() -> None:
    """Measure what the line asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("packs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/teach"))
    parser.add_argument("--only", default="", help="names of actions, with commas between")
    parser.add_argument("--weights", default="default")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--steps", type=int, help="training steps (default: those of the command)")
    parser.add_argument("--old", type=int, default=0, metavar="SEEDS", help="draw the twenty old prompts too")
    parser.add_argument("--everywhere", action="store_true", help="as FILE:1, which changes all sentences")
    parser.add_argument("--taught", type=Path, metavar="FOLDER", help="judge the adapters of an earlier run")
    parser.add_argument("--threads", type=int)
    arguments = parser.parse_args()
    wanted = [a for a in ACTIONS if not arguments.only or a.name in arguments.only.split(",")]
    rows = find_clips(arguments.packs)
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    prior = Prior.load(arguments.weights)
    arguments.out.mkdir(parents=True, exist_ok=True)
    report: dict[str, Any] = {"weights": prior.card.name, "actions": {}}
    if arguments.old:
        report["old_before"] = old_ones(prior, arguments.old)
    for action in wanted:
        report["actions"][action.name] = measure(action, rows, prior, arguments)
        with atomic_path(arguments.out / "teach.json") as temp:
            Path(temp).write_text(json.dumps(report, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
