"""The page that plays motions, in a real browser, from the disk and without a network (tests/viz has what is in it)."""

import io
import shutil
import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motionloom.core.motion import Motion
from motionloom.io import save
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from motionloom.viz.notebook import framed
from motionloom.viz.page import MAX_BYTES, Take, write_page
from tests.io.rigged import Hero
from tests.tasks.test_edit import person
from tests.viz.test_page import HOSTILE
from tests.viz.test_video import standing

PATIENCE = 240_000


def two() -> list[Motion]:
    """Two people who glide beside each other."""
    walk = standing(40, speed=1.0)
    return [walk, replace(walk, root=walk.root + np.array([1.0, 0.0, 0.0]))]


class Page:
    """A file in a tab of its own, which has no network and hears what goes wrong."""

    def __init__(self, page, file: Path) -> None:
        self.page, self.faults, self.asked = page, [], []
        page.set_default_timeout(PATIENCE)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        page.on("request", lambda request: self.asked.append(request.url))
        self.address = file.as_uri()
        page.goto(self.address)
        page.wait_for_selector("body[data-ready]")

    def time(self) -> float:
        return float(self.page.locator(".clock").inner_text().split(" ")[0])

    def goes_on(self) -> None:
        """Wait until the time is another one, however slowly pictures are drawn."""
        before = self.time()
        for _ in range(PATIENCE // 100):
            if self.time() != before:
                return
            self.page.wait_for_timeout(100)
        raise AssertionError(f"nothing plays at {before} s")

    def picture(self) -> np.ndarray:
        """The stage as (height, width, 3) numbers of 0 to 255, when it has come to rest."""
        self.page.wait_for_timeout(1500)
        shot = self.page.locator("canvas").screenshot(timeout=PATIENCE)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


@pytest.fixture
def opened(browser, tmp_path: Path) -> Iterator:
    """Opens a file; ``calm``: nothing plays by itself."""
    contexts = []

    def open_page(file: Path, *, calm: bool = True) -> Page:
        motion = "reduce" if calm else "no-preference"
        size = {"width": 480, "height": 360}
        contexts.append(browser.new_context(viewport=size, offline=True, reduced_motion=motion, color_scheme="light"))
        return Page(contexts[-1].new_page(), file)

    yield open_page
    for one in contexts:
        one.close()


def differ(a: np.ndarray, b: np.ndarray) -> float:
    """Share of the pixels that are others."""
    return float((np.abs(a - b).max(axis=-1) > 30).mean())


def test_takes_play_and_are_scrubbed_without_a_network(opened, tmp_path: Path) -> None:
    name = HOSTILE[0]
    file = write_page(
        [Take(name, two()), Take("<b>other</b>", [standing(20, turn=1.0)])], tmp_path / "two takes #1.html"
    )
    assert file.stat().st_size < MAX_BYTES
    shown = opened(file)
    page = shown.page
    assert page.title() == f"{name} | <b>other</b>"
    assert page.locator(".takes button").all_inner_texts() == [name, "<b>other</b>"]
    assert page.locator("body b, body img").count() == 0

    first = shown.picture()
    page.locator(".scrub").fill("1.5")
    assert shown.time() == 1.5
    assert differ(shown.picture(), first) > 0.01, "the people went on, and the floor under them"
    page.keyboard.press("Home")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert shown.time() == pytest.approx(0.15)
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Pause]")
    shown.goes_on()
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Play]")

    page.keyboard.press("g")
    assert page.locator(".plot polyline").count() == 2
    page.keyboard.press("2")
    assert page.locator(".plot polyline").count() == 1
    assert page.locator(".clock").inner_text().endswith("/ 1.00 s")
    before = shown.picture()
    page.keyboard.press("Shift+D")
    assert differ(shown.picture(), before) > 0.5, "light became dark"
    page.keyboard.press("?")
    assert "three.js authors" in page.locator("dialog pre").text_content()
    assert page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'answered', () => 'blocked')") == "blocked"
    assert [fault for fault in shown.faults if "127.0.0.1:9" not in fault] == []
    assert {one for one in shown.asked if not one.startswith(("blob:", "data:", "http://127.0.0.1:9"))} == {
        shown.address
    }


def test_it_plays_by_itself_where_motion_is_not_unwelcome(opened, tmp_path: Path) -> None:
    shown = opened(write_page([Take("", [standing(200)])], tmp_path / "a.html"), calm=False)
    shown.goes_on()
    assert not shown.faults


def test_a_character_plays_in_its_file(opened, tmp_path: Path) -> None:
    character = load_character(Hero().write(tmp_path / "hero.glb"))
    moved = [retarget(one, character.skeleton) for one in two()]
    shown = opened(write_page([Take("both", moved)], tmp_path / "a.html", character=character))
    first = shown.picture()
    assert len({tuple(color) for color in first.reshape(-1, 3).tolist()}) > 50
    shown.page.locator(".scrub").fill("1.5")
    assert differ(shown.picture(), first) > 0.003
    assert not shown.faults
    assert {one for one in shown.asked if not one.startswith(("blob:", "data:"))} == {shown.address}


def test_a_notebook_plays_it_on_a_click(browser, tmp_path: Path) -> None:
    file = tmp_path / "cell.html"
    file.write_text(f"<!doctype html><body>{framed(person(2.0))}</body>", encoding="utf-8")
    page, faults = browser.new_page(), []
    page.on("pageerror", lambda fault: faults.append(fault))
    page.set_default_timeout(PATIENCE)
    try:
        page.goto(file.as_uri())
        inside = page.frame_locator("iframe")
        assert not inside.locator("#stage").is_visible()
        inside.get_by_role("button", name="Play").click()
        stage = inside.locator("#stage")
        stage.wait_for()
        page.wait_for_timeout(200)
        pictures = []
        for _ in range(2):
            pictures.append(np.asarray(Image.open(io.BytesIO(stage.screenshot())).convert("RGB")).astype(int))
            page.wait_for_timeout(300)
        assert (pictures[0] < 100).any(axis=-1).mean() > 0.001
        assert differ(*pictures) > 0.0005
        assert not faults
    finally:
        page.close()


def test_the_web_component_plays_a_file(browser, tmp_path: Path) -> None:
    """`studio/packages/viewer` as its README says, served by anybody."""
    built = Path(__file__).parents[4] / "studio/packages/viewer/dist/motionloom-viewer.js"
    if not built.is_file():
        pytest.skip("the web component is not built (make page)")
    shutil.copy(built, tmp_path)
    save(standing(41, speed=1.0), tmp_path / "walk.glb")
    (tmp_path / "index.html").write_text(
        "<!doctype html><script type=module src=motionloom-viewer.js></script>"
        "<motionloom-viewer src=walk.glb theme=dark paused></motionloom-viewer><motionloom-viewer src=none.glb>"
    )
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = browser.new_page(viewport={"width": 480, "height": 900})
    page.set_default_timeout(PATIENCE)
    try:
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        first, second = page.locator("motionloom-viewer").nth(0), page.locator("motionloom-viewer").nth(1)
        first.locator(".clock").wait_for()
        assert first.evaluate("viewer => viewer.duration") == pytest.approx(2.0, abs=0.1)
        first.evaluate("viewer => { viewer.currentTime = 1.5 }")
        assert first.locator(".clock").inner_text().startswith("1.50 /")
        first.locator("canvas").focus()
        page.keyboard.press("g")
        assert first.locator(".plot polyline").count() == 1
        second.locator("[role=alert]", has_text="answered with 404").wait_for()
        page.set_content(cell(tmp_path))
        page.locator("motionloom-viewer .clock").wait_for()
        assert page.locator("motionloom-viewer").evaluate("viewer => viewer.duration") == pytest.approx(2.0, abs=0.1)
    finally:
        page.close()
        server.shutdown()
        server.server_close()


def cell(folder: Path) -> str:
    """What the notebook cell of docs/view.md shows."""
    text = (Path(__file__).parents[4] / "docs/view.md").read_text()
    [source] = [part.split("```")[0] for part in text.split("```python\n") if "IPython" in part]
    source = source.replace("from IPython.display import HTML", "").replace("HTML(", "found = (")
    names: dict[str, str] = {}
    exec(source.replace('Path("', f'Path("{folder}/'), names)
    return names["found"]


class Quiet(SimpleHTTPRequestHandler):
    """Files of a folder; nothing is printed."""

    def log_message(self, *_: object) -> None:
        """Nothing."""
