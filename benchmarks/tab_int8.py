"""What eight bits cost the page without a server in obedience: `evaluate obedience --set everyday`, both ways.

    python benchmarks/tab_int8.py > benchmarks/tab_int8.txt         # 10 seeds per prompt: some hours on two cores
    python benchmarks/tab_int8.py --seeds 3                         # rough

The large matrices go through the eight bits that `tools/export_tab.py` stores; a run that stopped goes on.
"""

import argparse
import json
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from motionloom.core.models.prior import find_weights, load_prior, save_prior
from motionloom_lab.suites.harness import weight_marks
from motionloom_lab.suites.obey import in_a_sentence

ROOT = Path(__file__).parents[1]
EXPORT = runpy.run_path(str(ROOT / "tools" / "export_tab.py"))
"""What the page's exporter defines."""


def totals(weights: Path, seeds: int, folder: Path) -> dict[str, float]:
    """Of the everyday prompts."""
    words = ["evaluate", "obedience", "--set", "everyday", "--weights", str(weights), "--seeds", str(seeds)]
    command = [sys.executable, "-m", "motionloom", *words, "--json", "--force", "--out", str(folder)]
    found = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(found.stdout)["totals"])


def main() -> None:
    """Print a sentence for each way to store the weights."""
    parser = argparse.ArgumentParser(description="What eight bits cost in obedience.")
    parser.add_argument("--seeds", type=int, default=10, help="per prompt")
    parser.add_argument("--weights", default="default", help="a weight file or the name of one that ships")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "tab_int8", help="folder for what is kept")
    said = parser.parse_args()
    exact = find_weights(said.weights)
    prior = load_prior(exact)
    said.out.mkdir(parents=True, exist_ok=True)
    [(name, mark)] = weight_marks([exact]).items()
    small = said.out / f"{mark}_eight_bits.safetensors"
    if not small.exists():
        save_prior(replace(prior, net=replace(prior.net, weights=EXPORT["rounded"](prior))), small, half=False)
    for way, file in (("as they ship", exact), ("in eight bits", small)):
        print(f"{way}: {in_a_sentence(totals(file, said.seeds, said.out / f'{mark}_{file.stem}'))}.", flush=True)
    print(f"{said.seeds} seeds per prompt.\n\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
