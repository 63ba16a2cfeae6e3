"""Five actions that the weights have not seen, three clips each: what `motionloom teach` makes of them.

    python benchmarks/teach.py PACK [PACK ...] --out OUT [--only zombie,crawl] [--weights default] [--seeds 10]
    python benchmarks/teach.py PACK [PACK ...] --names      which clips must not be in the weights' training set

PACK is a folder with a manifest.csv, as `motionloom data build` reads it. For each action an adapter is taught from its
first three clips; its prompts are drawn on seeds that no training used, before and after, and judged by a physical
check. So that a check means something it is also tried on all clips of the packs, those of the action and the others.
With --old the twenty prompts of `motionloom evaluate obedience` are drawn before and after too: what was known stays.

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

from motionloom.data.examples import CaptionedClip, make_examples, uniform_positions
from motionloom.data.paths import inside
from motionloom.data.sources import find_takes
from motionloom.errors import MotionloomError
from motionloom.io import load
from motionloom.io.atomic import atomic_path
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import leg_length
from motionloom.kinematics.physics import Array
from motionloom.lab.suites import obey
from motionloom.motion import Motion
from motionloom.tasks.adapting import adapt
from motionloom.tasks.text import generate
from motionloom.train.teach import Lesson, teach
from motionloom.viz.video import draw_sheet
from motionloom.weights.prior import Prior

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
    words: str
    """Pattern of descriptions of clips that show it."""
    unless: str
    done: Callable[[Array, float], bool]
    """(frames, 22, 3) metres and frames per second."""
    seconds: float = 5.0


def share(held: np.ndarray) -> float:
    """Share of frames in which something is so."""
    return float(np.mean(held))


def zombie(p: Array, fps: float) -> bool:
    """Both hands well in front of the shoulders for most of the time, and somebody goes."""
    body = ph.in_body(p)
    ahead = (body[:, [20, 21], 2] - body[:, [16, 17], 2]).min(axis=1)
    return share(ahead > 0.25) > 0.6 and ph.travel(p, fps) > 0.7


def crawl(p: Array, fps: float) -> bool:
    """The trunk lies level and the hands are down for most of the time, and somebody goes."""
    trunk = p[:, 12] - p[:, 0]
    level = np.abs(trunk[:, 1]) / np.linalg.norm(trunk, axis=-1) < 0.6
    hands = p[:, [20, 21], 1].min(axis=1) < 0.3
    return share(level & hands) > 0.6 and ph.travel(p, fps) > 0.5


def cartwheel(p: Array, fps: float) -> bool:
    """Hands on the floor while the feet are over the head."""
    return bool(((p[:, [7, 8], 1].max(axis=1) > p[:, 15, 1] + 0.2) & (p[:, [20, 21], 1].min(axis=1) < 0.35)).any())


def squat(p: Array, fps: float) -> bool:
    """The pelvis comes down to two thirds of its height over planted feet, the trunk upright, and comes up again."""
    height = (p[:, 0, 1] - p[:, [7, 8], 1].min(axis=1)) / leg_length(p)
    lowest = int(height.argmin())
    tall = min(height[: lowest + 1].max(), height[lowest:].max())
    stays = np.linalg.norm((p[:, 0] - p[0, 0])[:, [0, 2]], axis=-1).max() < 0.8
    return bool(height[lowest] < 0.68 and tall > 0.88 and stays and p[lowest, 15, 1] > p[lowest, 0, 1] + 0.25)


def roll(p: Array, fps: float) -> bool:
    """The head comes down to the height of the pelvis near the floor, and somebody ends elsewhere on the feet."""
    over = (p[:, 15, 1] < p[:, 0, 1] + 0.05) & (p[:, 0, 1] < 0.75)
    risen = (p[-5:, 15, 1] - p[-5:, [7, 8], 1].min(axis=1)).mean() > 0.9
    return bool(over.any() and risen and np.linalg.norm((p[-1, 0] - p[0, 0])[[0, 2]]) > 0.5)


ACTIONS = (
    Action("zombie", "a person walks like a zombie", ("a person walks like a zombie", "a zombie walks"),
           r"zombie", r"turns around like|there and back", zombie),
    Action("crawl", "a person crawls on hands and knees", ("a person crawls on hands and knees", "someone crawls"),
           r"\bcrawl", r"belly|backward|laying", crawl),
    Action("cartwheel", "a person does a cartwheel", ("a person does a cartwheel", "someone turns a cartwheel"),
           r"cartwheel", r"like start|frisbee", cartwheel),
    Action("squat", "a person does deep squats", ("a person does deep squats", "someone squats all the way down"),
           r"\bsquats?\b", r"gate|ready|position with|lunge|crawl|jump", squat),
    Action("roll", "a person does a roll on the ground", ("a person does a roll on the ground", "someone rolls over"),
           r"\bforward roll|rolls (?:sideways|diagonally|forward)|roll on the ground", r"body", roll, 3.0),
)  # fmt: skip


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
    """The clips whose descriptions name the action."""
    shown = [row for row in rows if re.search(action.words, row["description"].lower())]
    return [row for row in shown if not re.search(action.unless, row["description"].lower())]


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

    results = obey.run(drawn, seeds=seeds, first_seed=FIRST_SEED)
    return {result.name: sum(attempt.obeyed for attempt in result.attempts) for result in results}


def measure(action: Action, rows: list[dict[str, Any]], prior: Prior, arguments: argparse.Namespace) -> dict[str, Any]:
    """Teach one action and say what came of it."""
    chosen = of_action(action, rows)[:CLIPS]
    print(f"{action.name}: {', '.join(row['clip'] for row in chosen)}", flush=True)
    examples = [e for row in chosen for e in make_examples(read(row), CaptionedClip(row["file"], (action.caption,)))]
    before, first = obeyed(prior, action, arguments.seeds)
    began = time.perf_counter()
    settings = {"steps": arguments.steps} if arguments.steps else {}
    adapter = teach(prior, examples, Lesson(action.name, "only to measure", **settings), say=print)
    seconds = time.perf_counter() - began
    place = adapter.save(arguments.out / f"{action.name}.safetensors")
    taught = adapt(prior, [(adapter, 1.0)])
    after, last = obeyed(taught, action, arguments.seeds)
    captions = [f"{when}: {prompt}" for when in ("before", "after") for prompt in action.prompts]
    draw_sheet([*first, *last], arguments.out / f"{action.name}.png", captions=captions)
    result = {
        "clips": [row["clip"] for row in chosen], "check": tried(action, rows), "before": before, "after": after,
        "seeds": arguments.seeds, "teaching_seconds": round(seconds), "megabytes": round(place.stat().st_size / 1e6, 2),
    }  # fmt: skip
    if arguments.old:
        result |= {"old_after": old_ones(taught, arguments.old)}
    print(json.dumps(result), flush=True)
    return result


def main() -> None:
    """Measure what the line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("packs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/teach"))
    parser.add_argument("--only", default="", help="names of actions, with commas between")
    parser.add_argument("--weights", default="default")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--steps", type=int, help="training steps (default: those of the command)")
    parser.add_argument("--old", type=int, default=0, metavar="SEEDS", help="draw the twenty old prompts too")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--names", action="store_true", help="only print the names of all clips that show the actions")
    arguments = parser.parse_args()
    wanted = [a for a in ACTIONS if not arguments.only or a.name in arguments.only.split(",")]
    rows = find_clips(arguments.packs)
    if arguments.names:
        names = {row["clip"] for action in wanted for row in rows if re.search(action.words, row["said"])}
        print("\n".join(sorted(names)))
        return
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
