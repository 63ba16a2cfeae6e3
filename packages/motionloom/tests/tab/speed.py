"""How fast the page without a server is: from the address to the first motion, and later ones, in Chromium, no GPU.

    make tab && PYTHONPATH=packages/motionloom python -m tests.tab.speed > benchmarks/tab.txt

On an idle machine. The page says when it is asked, when the preview is there and when the motion (`performance.mark`);
medians, a new browser profile for each empty cache. Served on localhost, with the headers for threads and without.
"""

import argparse
import json
import statistics
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from tests.studio import started

ROOT = Path(__file__).parents[4]
TIMES = 3
LINK = "#v=1&seed=1&takes=1&s=5+a+person+walks+forward+and+waves"
HEADERS = {"Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp"}
MARKS = "Object.fromEntries(performance.getEntriesByType('mark').map((one) => [one.name, one.startTime / 1000]))"


@contextmanager
def served(folder: Path, headers: dict[str, str]) -> Iterator[str]:
    """The address at which a folder is served with headers."""

    class Handler(SimpleHTTPRequestHandler):
        def end_headers(self) -> None:
            for header in headers.items():
                self.send_header(*header)
            super().end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/{LINK}"
    server.shutdown()


def opened(page: Any, address: str) -> dict[str, float]:
    """Seconds from the address to what the page marks, and the threads that it has."""
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("body[data-state=drawn]")
    return {**page.evaluate(MARKS), "threads": float(page.evaluate("document.body.dataset.threads"))}


def later(page: Any) -> dict[str, float]:
    """Seconds from the button to the preview and the next motion."""
    page.evaluate("performance.clearMarks()")
    page.get_by_role("button", name="other", exact=True).last.click()
    while "drawn" not in (found := page.evaluate(MARKS)):
        page.wait_for_timeout(20)
    return {name: found[name] - found["asked"] for name in ("preview", "drawn")}


def median(rows: list[dict[str, float]], name: str) -> float:
    """Of one number."""
    return statistics.median(row[name] for row in rows)


def measured(address: str) -> dict[str, list[dict[str, float]]]:
    """The rows of `TIMES` tries each."""
    found: dict[str, list[dict[str, float]]] = {"empty cache": [], "with a cache": [], "later": []}
    with started.browser() as browser:
        for _ in range(TIMES):
            context = browser.new_context(viewport={"width": 1280, "height": 720})
            page = context.new_page()
            page.set_default_timeout(600_000)
            found["empty cache"].append(opened(page, address))
            page.wait_for_selector("body[data-offline=true]")
            found["with a cache"].append(opened(page, address))
            found["later"] += [later(page) for _ in range(TIMES)]
            context.close()
    return found


def main() -> int:
    """Print a line for each case."""
    parser = argparse.ArgumentParser(description="How fast the page without a server is.")
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "out" / "tab", help="what make tab built")
    folder = parser.parse_args().folder
    if not (folder / "prior.json").is_file():
        print(f"error: there is no page in {folder}; build it by 'make tab'", file=sys.stderr)
        return 2
    about = json.loads((folder / "prior.json").read_text())
    print("a motion of 5 s in Chromium without a GPU; seconds, medians\n")
    print(f"{'headers':<10}{'case':<16}{'threads':>8}{'preview':>9}{'motion':>8}")
    for name, headers in (("sent", HEADERS), ("none", {})):
        with served(folder, headers) as address:
            found = measured(address)
        for case, rows in found.items():
            threads = f"{median(rows, 'threads'):.0f}" if case != "later" else ""
            print(f"{name:<10}{case:<16}{threads:>8}{median(rows, 'preview'):>9.1f}{median(rows, 'drawn'):>8.1f}")
    print(f"\nWeights: {about['name']} {about['weights'][:12]}, {about['bytes'] / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
