"""The page as a test uses it: keys and the mouse, and what came of them."""

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.studio.started import Server

SLOW = 240_000
"""Milliseconds that a draw may take on a busy machine."""
LOOK = 20
"""Milliseconds between two looks at the page."""
PROJECT = {
    "version": 2,
    "name": "Test",
    "seed": 3,
    "count": 1,
    "kept": 0,
    "drawn": "",
    "takes": [],
    "clips": [],
    "frozen": [],
    "base": None,
    "reactTo": None,
    "character": None,
}
FORGET = "if (location.protocol === 'http:' && name !== 'kept') { localStorage.clear(); name = 'kept' }"
"""What the page of an earlier test kept in the browser is gone; what this one keeps stays."""
NOTHING: dict[str, Any] = {"path": None, "targets": [], "poses": []}


class Studio:
    """One tab. Everything that changes something goes through `page.keyboard` and `page.mouse`."""

    def __init__(self, page, server: Server) -> None:
        self.page, self.server = page, server
        self.faults: list[str] = []
        self._drawn: dict[str, dict[str, Any]] = {}
        page.set_default_timeout(SLOW)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("console", self._heard)
        page.add_init_script(FORGET)

    def _heard(self, message: Any) -> None:
        if "Content Security Policy" in message.text:
            self.faults.append(message.text)

    # -- beginnings

    def open(self, *blocks: tuple[str, float], people: int = 1, **more: Any) -> None:
        """Open a project of these blocks, with the motion that was drawn for it before, if it was."""
        segments = [
            {"id": f"s{number}", "text": text, "other": "", "seconds": seconds, "transition": None}
            for number, (text, seconds) in enumerate(blocks)
        ]
        project = {**PROJECT, "segments": segments, "people": [NOTHING] * people, **more}
        known = self._drawn.get(json.dumps(project))
        self.page.goto("about:blank")  # what the page before had not saved is saved before
        self.put(known or project)
        self.page.evaluate("name = ''")
        self.load()
        if known is None:
            self._drawn[json.dumps(project)] = self.project()

    def load(self) -> None:
        """Open the page, and stop what plays."""
        self.page.goto(self.server.page)
        self.page.wait_for_selector("body[data-ready]")
        if self.page.locator("#transport button[aria-label=Pause]").count():
            self.key("Space")
        self.key("Escape")  # the field for words had the keys
        self.drawn()

    def put(self, project: dict[str, Any]) -> None:
        """Save a project over what is there, whatever that is."""
        self.server.put(project)

    def says(self, place, text: str) -> None:
        """Wait until a place of the page, a locator, has the text."""
        place.filter(has_text=text).first.wait_for()

    def until(self, expression: str) -> None:
        """Wait until an expression is true in the page; the driver's own way evaluates text, which the page forbids."""
        for _ in range(SLOW // LOOK):
            if self.page.evaluate(expression):
                return
            self.page.wait_for_timeout(LOOK)
        raise AssertionError(f"it never was so that {expression}")

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

    def at(self, name: str) -> tuple[float, float]:
        """Where a handle of the stage is on the screen: `path-end`, `facing` or `gizmo`."""
        self.page.wait_for_selector(f"#canvas[data-{name}]")
        seen = ""
        for _ in range(40):  # until the camera has come to rest, which a busy machine takes its time for
            self.page.wait_for_timeout(300)
            before, seen = seen, str(self.page.locator("#canvas").get_attribute(f"data-{name}"))
            if seen == before:
                break
        x, y = seen.split(",")
        return float(x), float(y)

    def drop(self, *files: Path) -> None:
        """Let go of files over the stage, as a hand would."""
        data = [{"name": one.name, "data": base64.b64encode(one.read_bytes()).decode()} for one in files]
        self.page.evaluate(
            """files => { const transfer = new DataTransfer();
                for (const {name, data} of files) transfer.items.add(new File(
                    [Uint8Array.from(atob(data), letter => letter.charCodeAt(0))], name));
                for (const type of ["dragover", "drop"]) document.querySelector("#canvas").dispatchEvent(
                    new DragEvent(type, {bubbles: true, cancelable: true, dataTransfer: transfer})); }""",
            data,
        )

    def export(self, name: str) -> bytes:
        """The file that an entry of the export menu gives, by mouse."""
        menu = self.page.locator(".menu[data-key=Export]")
        menu.locator("summary").click()
        with self.page.expect_download() as file:
            menu.locator(".row").filter(has=self.page.get_by_text(name, exact=True)).click()
        return Path(file.value.path()).read_bytes()

    # -- what came of it

    def drawn(self) -> None:
        """Wait until nothing is being drawn and the project is saved."""
        self.page.wait_for_selector("#stage[aria-busy=false]", state="attached")
        self.page.evaluate("dispatchEvent(new Event('pagehide'))")  # saves now, not half a second later
        self.until("document.querySelector('.state').textContent === 'saved'")

    def project(self) -> dict[str, Any]:
        """The project as it was saved, after all draws."""
        self.drawn()
        return self.server.ask("/project")

    def caught_up(self) -> dict[str, Any]:
        """The project once its motion is as long as its blocks: a draw that failed without a server comes again."""
        for _ in range(SLOW // 1000):
            project = self.project()
            whole = sum(one["seconds"] for one in project["segments"])
            if project["takes"] and abs(project["takes"][0]["seconds"] - whole) < 0.01:
                return project
            self.page.wait_for_timeout(200)
        raise AssertionError("the motion never was as long as the blocks")

    def blocks(self) -> list[tuple[str, float]]:
        """Words and seconds of the blocks."""
        return [(one["text"], one["seconds"]) for one in self.project()["segments"]]

    def motion(self, project: dict[str, Any] | None = None) -> np.ndarray:
        """Places (people, frames, 22, 3) of the kept take."""
        project = project or self.project()
        take = project["takes"][project["kept"]]
        people = self.server.ask(f"/motions/{take['motion']}")["people"]
        arrays = [np.frombuffer(base64.b64decode(one["positions"]), "<f4") for one in people]
        return np.stack([array.reshape(-1, 22, 3) for array in arrays])

    def picture(self) -> np.ndarray:
        """The stage as (height, width, 3) numbers of 0 to 255, once it no longer changes; while it plays, after 2 s."""
        from PIL import Image

        shots = [b""]
        for _ in range(6):
            self.page.wait_for_timeout(400)
            shots.append(self.page.locator("#canvas").screenshot())
            if shots[-1] == shots[-2]:
                break
        return np.asarray(Image.open(io.BytesIO(shots[-1])).convert("RGB")).astype(int)

    def download(self, *keys: str) -> bytes:
        """The file that keys make the page write."""
        with self.page.expect_download() as file:
            self.key(*keys)
        with open(file.value.path(), "rb") as stream:
            return stream.read()
