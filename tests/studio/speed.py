"""How long it takes from letting go of a path's point to the new motion on the stage.

`python -m tests.studio.speed` opens the page on a real server, drags the end of a path for ten seconds of motion again
and again, and prints medians: until the preview is on the stage, until the full motion is, and the server's own
sampling of the same timeline in a fresh call, as `motionloom.compose` makes it.
"""

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path

from tests.studio import started
from tests.studio.studio import Studio

PATH = {"speed": None, "times": None, "points": [{"x": 0, "z": z, "stop": 0, "facing": None} for z in (0, 2, 4, 6)]}
MARKS = """() => Object.fromEntries(["draw-asked", "draw-preview", "draw-full"].map(
    name => [name, performance.getEntriesByName(name).at(-1)?.startTime ?? null]))"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    started.check()
    with tempfile.TemporaryDirectory() as folder, started.server(Path(folder)) as server, started.browser() as browser:
        page = Studio(browser.new_context(viewport={"width": 1280, "height": 720}).new_page(), server)
        ready, rounds = measured(page, options.rounds)
        found = {
            "page_ready_s": ready,
            "preview_s": statistics.median(first for first, _ in rounds),
            "full_s": statistics.median(full for _, full in rounds),
            "frames_per_second": frames(page),
            "sampling_s": sampling(page, options.rounds),
        }
    found["full_over_sampling"] = found["full_s"] / found["sampling_s"]
    for name, value in found.items():
        print(f"{name:22} {value:8.2f}")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


def measured(page: Studio, rounds: int) -> tuple[float, list[tuple[float, float]]]:
    """Seconds until the page answers, and of each drag until preview and full motion are shown."""
    person = {"path": PATH, "targets": [], "poses": []}
    page.open(("a person walks", 10.0))
    page.put({**page.project(), "people": [person], "drawn": ""})
    page.load()
    ready = page.page.evaluate("performance.getEntriesByName('ready')[0].startTime") / 1000
    page.key("x", "p")
    times = []
    for number in range(rounds):
        start = point(page)
        page.drag(start, (start[0] + (30 if number % 2 else -30), start[1] + 12 * (number % 2)))
        page.drawn()
        marks = page.page.evaluate(MARKS)
        asked = marks["draw-asked"]
        times.append(((marks["draw-preview"] - asked) / 1000, (marks["draw-full"] - asked) / 1000))
    return ready, times


def point(page: Studio) -> tuple[float, float]:
    """Where the path's last point is on the screen: the page tells the places of its handles to assistive tools."""
    at = page.page.locator("#canvas").get_attribute("data-path-end")
    x, y = (float(part) for part in (at or "0,0").split(","))
    return x, y


def frames(page: Studio, seconds: float = 3.0) -> float:
    """Pictures per second while the motion plays."""
    page.key("v", "Space")
    count = page.page.evaluate(
        """seconds => new Promise(done => {
            let count = 0; const end = performance.now() + seconds * 1000;
            const step = now => { count += 1; now < end ? requestAnimationFrame(step) : done(count / seconds) };
            requestAnimationFrame(step); })""",
        seconds,
    )
    page.key("Space")
    return count


def sampling(page: Studio, rounds: int) -> float:
    """Seconds of the library's own call for the same timeline, in this process."""
    from motionloom import Prior, compose
    from motionloom.goals.goal_file import read_goal
    from motionloom.goals.segment import Segment

    prior = Prior.load()
    goal = read_goal({"path": {"points": [[p["x"], p["z"]] for p in PATH["points"]]}}, frames=200, folder=Path())
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        for _piece in compose(prior, [Segment("a person walks", 10.0)], seed=3, path=goal):
            pass
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


if __name__ == "__main__":
    main()
