"""Motions inside of a Ray Data pipeline: `map_batches` with a prior in each actor.

Ray Data streams blocks through actors and keeps nothing of a job that died; `motionloom batch --ray` does that part.
This is for pipelines that go on behind the motions: filter, tokenise, train. Needs: pip install 'ray[data]'
"""

import json
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

from motionloom.bulk.maker import Made, Maker, Options
from motionloom.bulk.row import parse
from motionloom.core.errors import MotionloomError


class Motions:
    """Rows with prompt, seconds and seed in; positions (frames, 22, 3) in metres and measures out."""

    def __init__(self) -> None:
        self.maker = Maker(Options(), folder=Path())

    def __call__(self, rows: dict[str, np.ndarray]) -> dict[str, list]:
        """Rows that cannot be made are left out."""
        asked = [dict(zip(rows, values)) for values in zip(*(column.tolist() for column in rows.values()))]
        ready = []
        for row in asked:
            with suppress(MotionloomError):
                ready.append(self.maker.sources.ask(parse(json.dumps(row).encode())))
        made = [(one, found) for one, found in self.maker.make(ready) if isinstance(found, Made)]
        return {
            "id": [one.key for one, _ in made],
            "text": [one.text for one, _ in made],
            "positions": [found.motion.positions().astype(np.float32) for _, found in made],
            "skate": [found.measures["skate"] for _, found in made],
        }


if __name__ == "__main__":
    try:
        import ray
    except ImportError:
        sys.exit(print("this example needs Ray Data: pip install 'ray[data]'"))
    ray.init("local", log_to_driver=False, include_dashboard=False, runtime_env={"env_vars": {"OMP_NUM_THREADS": "1"}})
    prompts = ray.data.from_items([{"prompt": "a person walks", "seconds": 2.0, "seed": i} for i in range(8)])
    motions = prompts.map_batches(Motions, batch_size=8, concurrency=1)
    for row in motions.iter_rows():
        print(row["id"][:8], row["positions"].shape, f"skate {row['skate']:.2f}")
