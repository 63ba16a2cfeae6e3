"""How quick the studio is, on the machine that this runs on.

`python -m tests.studio.speed` starts a server, opens the page and prints: seconds from the command until the server
answers, the prior is loaded and the page can be used; until somebody moves in a new project; medians from letting go of
a path's point, for ten seconds of motion, to the preview and to the full motion on the stage; the same timeline by
`motionloom.compose` and its words by `motionloom.generate` in this process; pictures per second; the page's code.
`--library` measures the last two alone, without a browser, by turns: seconds, and seconds of processors, which say the
same on a busy machine if `OMP_NUM_THREADS` is 1.
"""

import argparse
import gzip
import json
import statistics
import tempfile
import time
from collections.abc import Callable
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
    parser.add_argument("--library", action="store_true")
    options = parser.parse_args()
    if options.library:
        return told(sampling(options.rounds), options.json)
    started.check()
    view = {"width": 1280, "height": 720}
    with tempfile.TemporaryDirectory() as folder, started.server(Path(folder)) as server, started.browser() as browser:
        page = Studio(browser.new_context(viewport=view).new_page(), server)
        found = {"answers_s": server.answered, "prior_warm_s": server.warm, "first_motion_s": first_motion(page)}
        found["page_ready_s"], rounds = measured(page, options.rounds)
        found["command_to_page_s"] = server.answered + found["page_ready_s"]
        found["preview_s"] = statistics.median(first for first, _ in rounds)
        found["full_s"] = statistics.median(full for _, full in rounds)
        found["frames_per_second"] = frames(page)
        found |= sampling(options.rounds)
    found["full_over_compose"] = found["full_s"] / found["compose_s"]
    found["full_over_generate"] = found["full_s"] / found["generate_s"]
    found["code_kb"] = sum(len(gzip.compress(one.read_bytes())) for one in started.page_folder().rglob("*.*")) / 1000
    told(found, options.json)


def told(found: dict[str, float], path: Path | None) -> None:
    """Print what was found, and write it where that is asked."""
    for name, value in found.items():
        print(f"{name:22} {value:8.2f}")
    if path:
        path.write_text(json.dumps(found, indent=1))


def first_motion(page: Studio) -> float:
    """Seconds from the page's address until somebody moves, in a project that is new."""
    page.page.goto(page.server.page)
    page.until("performance.getEntriesByName('draw-preview').length > 0")
    seconds = page.page.evaluate("performance.getEntriesByName('draw-preview')[0].startTime") / 1000
    page.drawn()
    return seconds


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


def sampling(rounds: int) -> dict[str, float]:
    """Seconds of the library's own calls in this process: the same timeline, and its words alone."""
    from motionloom import Prior, compose, generate
    from motionloom.goals.goal_file import read_goal
    from motionloom.goals.segment import Segment

    prior = Prior.load()
    goal = read_goal({"path": {"points": [[p["x"], p["z"]] for p in PATH["points"]]}}, frames=200, folder=Path())

    def composed() -> None:
        compose(prior, [Segment("a person walks", 10.0)], seed=3, path=goal)

    def generated() -> None:
        generate(prior, "a person walks", seconds=10.0, seed=3)

    calls = {"compose": composed, "generate": generated}
    times: dict[str, list[tuple[float, float]]] = {name: [timed(call)] for name, call in calls.items()}
    for _ in range(rounds):
        for name, call in calls.items():
            times[name].append(timed(call))
    found = {}
    for name, both in times.items():
        found[f"{name}_s"], found[f"{name}_cpu_s"] = (statistics.median(column[1:]) for column in zip(*both))
    found["compose_over_generate"] = found["compose_cpu_s"] / found["generate_cpu_s"]
    return found


def timed(call: Callable[[], None]) -> tuple[float, float]:
    """Seconds that a call takes, and seconds of processors."""
    begin, busy = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - begin, time.process_time() - busy


if __name__ == "__main__":
    main()
