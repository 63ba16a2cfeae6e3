"""How fast tasks are beside another checkout of the project: both by turns in one run, so that only the ratio counts.

    git worktree add ../old 70151a4      # the last commit that sampled with PyTorch
    python benchmarks/against.py ../old > benchmarks/against.txt

Both use the packages of this environment (PyTorch among them for old commits), the weights that they ship, which have
as many parameters, and as many threads. A process of each measures a task after a first time that does not count;
they take turns, and medians are printed.
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TASKS = {
    "a motion of 9.8 s": "generate(prior, 'a person walks forward', seconds=9.8)",
    "sixteen motions of 9.8 s": "generate(prior, ['a person walks forward'] * 16, seconds=9.8)",
    "two minutes of twelve sentences": "composed([Segment(text, 10.0) for text in TEXTS])",
    "fifty futures of 2 s": "predict(predictor, walk, count=50, seconds=2.0)",
    "a live minute": "live_minute()",
}
CHILD = """
import sys, time
from motionloom import load
from motionloom.goals.segment import Segment
from motionloom.live.live import Live
from motionloom.tasks.long import compose
from motionloom.tasks.predict import predict
from motionloom.tasks.text import generate
from motionloom.core.models.predictor import find_predictor, load_predictor
from motionloom.core.models.prior import Prior
HOW = ("slowly", "fast", "happily", "and turns")
TEXTS = [f"a person {doing} {how}" for doing in ("walks", "runs", "dances") for how in HOW]
prior, walk = Prior.load(), load(sys.argv[2])
predictor = load_predictor(find_predictor("predictor")) if "predictor" in sys.argv[1] else None
def composed(segments):
    made = compose(prior, segments)
    return made if hasattr(made, "root") else list(made)  # blocks, as it once was
def live_minute():
    live = Live(prior, seed=0)
    for text in TEXTS[:6]:
        live.say(text)
        live.take(200)
eval(sys.argv[1])
began = time.perf_counter()
eval(sys.argv[1])
print(time.perf_counter() - began)
"""


def source(checkout: Path) -> Path:
    """The folder of the package in a checkout, as it is now or as it was before there were three packages."""
    now = checkout / "packages" / "motionloom" / "src"
    return now if now.is_dir() else checkout / "src"


def seconds(checkout: Path, task: str) -> float:
    """Wall seconds of a task, the second time that a new process does it."""
    place = {**os.environ, "PYTHONPATH": str(source(checkout).resolve())}
    clip = ROOT / "examples" / "clips" / "walk.bvh"
    done = subprocess.run(
        [sys.executable, "-c", CHILD, task, str(clip)], env=place, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{checkout}: {done.stderr.strip().splitlines()[-1]}")
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start; medians of {given.repeats}, by turns\n")
    print(f"{'task':<32} {'other s':>8} {'this s':>8} {'other/this':>10}")
    for name, task in TASKS.items():
        turns = [(seconds(given.other, task), seconds(ROOT, task)) for _ in range(given.repeats)]
        other, this = (statistics.median(column) for column in zip(*turns, strict=True))
        print(f"{name:<32} {other:>8.2f} {this:>8.2f} {other / this:>10.2f}", flush=True)


if __name__ == "__main__":
    main()
