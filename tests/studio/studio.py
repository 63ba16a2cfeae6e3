"""The page as a test uses it: keys and the mouse, and what came of them."""

import io
import json
import urllib.request
from typing import Any

import numpy as np

SLOW = 240_000
"""Milliseconds that a draw may take on a busy machine."""
PROJECT = {
    "version": 1, "name": "Test", "seed": 3, "count": 1, "kept": 0, "drawn": "", "takes": [], "clips": [],
    "frozen": [], "base": None, "reactTo": None, "character": None,
}  # fmt: skip
NOTHING: dict[str, Any] = {"path": None, "targets": [], "poses": []}


class Studio:
    """One tab. Everything that changes something goes through `page.keyboard` and `page.mouse`."""

    def __init__(self, page, server: str) -> None:
        self.page, self.server = page, server
        self.faults: list[str] = []
        page.set_default_timeout(SLOW)
        page.on("pageerror", lambda error: self.faults.append(str(error)))

    # -- beginnings

    def open(self, *blocks: tuple[str, float], people: int = 1, **more: Any) -> None:
        """Put a project on the server and open it."""
        segments = [
            {"id": f"s{number}", "text": text, "other": "", "seconds": seconds, "transition": None}
            for number, (text, seconds) in enumerate(blocks)
        ]
        self.put({**PROJECT, "segments": segments, "people": [NOTHING] * people, **more})
        self.page.add_init_script("if (!sessionStorage.kept) { localStorage.clear(); sessionStorage.kept = 'yes'; }")
        self.load()

    def load(self) -> None:
        """Open the page, and stop what plays."""
        self.page.goto(self.server)
        self.page.wait_for_selector("body[data-ready]")
        self.drawn()
        if self.page.locator("#transport button[aria-label=Pause]").count():
            self.key("Space")

    def put(self, project: dict[str, Any]) -> None:
        """Save a project as the page would."""
        body = json.dumps(project).encode()
        request = urllib.request.Request(
            f"{self.server}/project", body, {"Content-Type": "application/json"}, method="PUT"
        )
        urllib.request.urlopen(request, timeout=60).close()

    # -- deeds

    def key(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.page.keyboard.press(key)

    def drag(self, start: tuple[float, float], *way: tuple[float, float], hold: str = "") -> None:
        """Press at a place, go over others, and let go."""
        if hold:
            self.page.keyboard.down(hold)
        self.page.mouse.move(*start)
        self.page.mouse.down()
        for place in way:
            self.page.mouse.move(*place, steps=4)
        self.page.mouse.up()
        if hold:
            self.page.keyboard.up(hold)

    def middle(self, selector: str, number: int = 0) -> tuple[float, float]:
        """The middle of an element on the screen."""
        box = self.page.locator(selector).nth(number).bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    # -- what came of it

    def drawn(self) -> None:
        """Wait until nothing is being drawn and the project is saved."""
        self.page.wait_for_timeout(700)
        self.page.wait_for_function(
            "document.querySelector('progress').classList.contains('idle')"
            " && document.querySelector('.state').textContent === 'saved'"
        )

    def project(self) -> dict[str, Any]:
        """The project as it was saved, after all draws."""
        self.drawn()
        with urllib.request.urlopen(f"{self.server}/project", timeout=60) as response:
            return json.load(response)

    def blocks(self) -> list[tuple[str, float]]:
        """Words and seconds of the blocks."""
        return [(one["text"], one["seconds"]) for one in self.project()["segments"]]

    def motion(self, project: dict[str, Any] | None = None) -> np.ndarray:
        """Places (people, frames, 22, 3) of the kept take."""
        import base64

        project = project or self.project()
        take = project["takes"][project["kept"]]
        with urllib.request.urlopen(f"{self.server}/motions/{take['motion']}", timeout=60) as response:
            people = json.load(response)["people"]
        arrays = [np.frombuffer(base64.b64decode(one["positions"]), "<f4") for one in people]
        return np.stack([array.reshape(-1, 22, 3) for array in arrays])

    def picture(self) -> np.ndarray:
        """The stage as (height, width, 3) numbers of 0 to 255."""
        from PIL import Image

        self.page.wait_for_timeout(400)
        return np.asarray(Image.open(io.BytesIO(self.page.locator("#canvas").screenshot())).convert("RGB")).astype(int)

    def download(self, *keys: str) -> bytes:
        """The file that keys make the page write."""
        with self.page.expect_download() as file:
            self.key(*keys)
        with open(file.value.path(), "rb") as stream:
            return stream.read()
