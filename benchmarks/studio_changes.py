"""How long a changed word takes in the studio: a timeline of 7 s, and one of 200 blocks; a real server and Chromium.

`PYTHONPATH=packages/motionloom:packages/motionloom/src python benchmarks/studio_changes.py` prints the medians from the
last letter to the preview and to the whole motion on the stage, the longest task of the page meanwhile, the same job
without a page, and how many frames stayed bit for bit. The 200 blocks are four that are drawn, again and again.
"""

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.models.prior import Prior, find_weights
from motionloom.core.motion import Motion
from motionloom.goals.timeline import timeline_from
from motionloom.io import load, save
from motionloom.requests.sampling import Sampling
from motionloom.tasks.long import compose
from motionloom.tasks.redraw import Timed
from motionloom.tasks.splice import concatenate
from motionloom_lab.suites.harness import weight_marks
from tests.studio import started
from tests.studio.studio import NOTHING, PROJECT, Studio

WORDS = ("a person walks forward", "a person waves with the right hand", "a person jumps", "a person walks in a circle")
NEW = ("a person kicks", "a person bows", "a person sits down", "a person turns around", "a person stretches")
KEPT = "0123456789abcdef"
"""The id of the motion that is there."""
LONG_TASKS = """() => { window.tasks = [];
    new PerformanceObserver(list => tasks.push(...list.getEntries().map(one => one.duration)))
        .observe({type: 'longtask'}) }"""
MARKS = """() => Object.fromEntries(["draw-asked", "draw-preview", "draw-full"].map(
    name => [name, performance.getEntriesByName(name).at(-1)?.startTime ?? null]))"""


def timeline(blocks: int, seconds: float) -> dict[str, Any]:
    """The timeline of so many blocks, as the page asks for it."""
    shared = round(min(1.0, seconds / 2), 3)
    segments = [{"text": WORDS[n % 4], "seconds": seconds, "transition": shared} for n in range(blocks)]
    del segments[-1]["transition"]
    return {"seed": 3, "segments": segments}


def motion(prior: Prior, asked: dict[str, Any], folder: Path) -> str:
    """The id of a motion of the timeline, kept in a project's folder: its first four blocks, again and again."""
    whole = timeline_from(asked, folder=folder)
    some = len(whole.segments[:4])
    part = compose(prior, whole.segments[:some], seed=3)
    made = concatenate(*[part] * (len(whole.segments) // some))
    blocks = Timed(prior, whole.segments, None, Sampling(count=1, seed=3)).blocks
    assert len(made) == sum(block.frames for block in blocks)
    (folder / "motions").mkdir()
    save(made, folder / "motions" / f"{KEPT}.npz")
    about = {"task": "compose", "people": 1, "blocks": [list(block) for block in blocks]}
    (folder / "motions" / f"{KEPT}.json").write_text(json.dumps(about))
    return KEPT


def project_of(asked: dict[str, Any], kept: str) -> dict[str, Any]:
    """What the page opens."""
    segments = [
        {"id": f"s{n}", "text": one["text"], "other": "", "seconds": one["seconds"], "transition": None}
        for n, one in enumerate(asked["segments"])
    ]
    seconds = sum(one["seconds"] for one in segments)
    take = {"motion": kept, "seed": 3, "seconds": seconds, "people": 1, "how": "drawn", "told": []}
    return {**PROJECT, "segments": segments, "people": [NOTHING], "takes": [take]}


def in_the_page(page: Studio, block: int, rounds: int) -> dict[str, float]:
    """Medians of so many changes of one block's words, and the longest task of the page."""
    page.page.wait_for_timeout(3000)  # for the first picture of a page shaders are linked, which is no drawing
    page.page.evaluate(LONG_TASKS)
    times = []
    for number in range(rounds):
        page.page.locator(f'.track.words [data-id="s{block}"]').first.focus()
        page.key("Enter")
        page.page.locator("input.words").fill(NEW[number % len(NEW)])
        page.drawn()
        marks = page.page.evaluate(MARKS)
        times.append([(marks[name] - marks["draw-asked"]) / 1000 for name in ("draw-preview", "draw-full")])
        page.key("Escape")
    preview, full = (statistics.median(one) for one in zip(*times, strict=True))
    longest = page.page.evaluate("Math.max(0, ...tasks)")
    return {"preview_s": preview, "full_s": full, "longest_task_ms": longest}


def at_the_server(
    server: started.Server, asked: dict[str, Any], kept: str, block: int, rounds: int
) -> dict[str, float]:
    """Median seconds of the same job without a page, of drawing all of it where that is short, and frames that stay."""
    old, times, same = places(server, kept), [], 0.0
    for number in range(rounds):
        segments = [dict(one) for one in asked["segments"]]
        segments[block]["text"] = NEW[number % len(NEW)]
        begin = time.monotonic()
        result = drawn(server, {"timeline": {**asked, "segments": segments}, "kept_from": kept})
        times.append(time.monotonic() - begin)
        new = server.ask(f"/motions/{result['id']}")["about"]["blocks"]
        assert result["measures"]["redrawn"] == [block], new
        same = float(np.mean([np.array_equal(*pair) for pair in zip(local(places(server, result["id"])), local(old))]))
    found = {"job_s": statistics.median(times), "frames_kept": same}
    if len(asked["segments"]) < 10:
        begin = time.monotonic()
        drawn(server, {"timeline": asked, "seed": 77})
        found["job_of_all_s"] = time.monotonic() - begin
    return found


def drawn(server: started.Server, job: dict[str, Any]) -> dict[str, Any]:
    """The first result of a timeline's job."""
    name = server.ask("/jobs", {"task": "compose", "levels": 6, **job}, method="POST")["id"]
    while (state := server.ask(f"/jobs/{name}"))["state"] not in ("done", "failed"):
        time.sleep(0.01)
    assert state["state"] == "done", state["error"]
    return state["results"][0]


def places(server: started.Server, name: str) -> Motion:
    """A motion of the server's folder."""
    return load(server.folder / "motions" / f"{name}.npz")


def local(found: Motion) -> np.ndarray:
    """The turns of all joints but the pelvis, which moves with what lies before it."""
    return found.rotations[:, 1:]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    started.check()
    prior = Prior.load()
    print(f"{'':18}{'7 s':>10}{'200 blocks':>12}")
    table: dict[str, list[float]] = {}
    for asked, block in ((timeline(2, 3.5), 1), (timeline(200, 3.0), 100)):
        with tempfile.TemporaryDirectory() as name, started.browser() as browser:
            kept = motion(prior, asked, Path(name))
            with started.server(Path(name)) as server:
                page = Studio(browser.new_context(viewport={"width": 1280, "height": 720}).new_page(), server)
                page.put(project_of(asked, kept))
                page.load()
                found = in_the_page(page, block, options.rounds)
                page.page.close()
                found |= at_the_server(server, asked, kept, block, options.rounds)
        for key, value in found.items():
            table.setdefault(key, []).append(value)
    for key, values in table.items():
        print(f"{key:18}" + "".join(f"{value:>{width}.3g}" for value, width in zip(values, (10, 12), strict=False)))
    [(name, mark)] = weight_marks([find_weights("default")]).items()
    print(f"\nWeights: {name} {mark}")


if __name__ == "__main__":
    main()
