"""Somebody's first minute: from the opened page to a motion on their own character that follows a path, exported.

Once with the mouse alone, once with the keyboard alone, counted in deeds of a hand; what the seconds were is printed
(`pytest -s`). Then: the page has no fault that axe finds.
"""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from motionloom import load
from motionloom.io.character import load_character
from tests.io.rigged import Hero
from tests.studio.studio import Studio

MOST = 14
"""Deeds of a hand that it may take."""
AXE = Path(__file__).parents[4] / "studio/node_modules/axe-core/axe.min.js"


class Hands:
    """Counts what somebody does: a key (held or not), a sentence typed, a click, a drag, a file chosen or dropped."""

    def __init__(self, studio: Studio) -> None:
        self.studio, self.page = studio, studio.page
        self.deeds: list[str] = []
        self.begun = self._now()

    def _now(self) -> float:
        """Seconds on the page's own clock, which are printed and no more."""
        return self.page.evaluate("performance.now()") / 1000

    def key(self, key: str, held: int = 1) -> None:
        """Press a key; ``held``: so often it repeats itself."""
        for _ in range(held - 1):
            self.page.keyboard.down(key)
        self.page.keyboard.press(key)
        self.deeds.append(key)

    def type(self, sentence: str) -> None:
        self.page.keyboard.type(sentence)
        self.deeds.append("type")

    def click(self, selector: str) -> None:
        self.page.mouse.click(*self.studio.middle(selector))
        self.deeds.append("click")

    def told(self, how: str) -> None:
        """Print what it took, which is at most so many deeds."""
        print(f"\n{how} alone: {len(self.deeds)} deeds, {self._now() - self.begun:.0f} s")
        assert len(self.deeds) <= MOST, self.deeds


def check(studio: Studio, exported: Path, hero: Path) -> None:
    """The exported file is the hero, who does two blocks along the path."""
    project = studio.project()
    assert len(project["segments"]) == 2
    seconds = sum(one["seconds"] for one in project["segments"])
    assert load_character(exported).skeleton.names == load_character(hero).skeleton.names
    assert abs(load(exported).seconds - seconds) < 0.11
    points = np.array([[one["x"], one["z"]] for one in project["people"][0]["path"]["points"]])
    way = np.concatenate([a + np.linspace(0, 1, 50)[:, None] * (b - a) for a, b in pairwise(points)])
    [body] = studio.motion(project)
    apart = np.linalg.norm(body[:, None, 0, [0, 2]] - way, axis=-1).min(axis=1)
    assert np.linalg.norm(points[-1] - points[0]) > 1
    assert apart.mean() < 0.25, "metres from the path, on average"
    assert np.linalg.norm(body[-1, 0, [0, 2]] - points[-1]) < 0.6
    assert not studio.faults


def test_with_the_mouse_alone(empty: Studio, tmp_path: Path):
    hands, hero = Hands(empty), Hero().write(tmp_path / "hero.glb")
    page = empty.page
    page.locator("#start").wait_for()
    hands.click("#start .chip:has-text('skips')")
    page.wait_for_selector("#start", state="hidden")
    hands.click("#transport [aria-label='Duplicate the block']")
    empty.drawn()
    hands.click("#tools [aria-label='Draw a path']")
    x, y = empty.middle("#canvas")
    empty.drag((x, y + 20), (x - 120, y + 60), (x - 220, y + 110))
    hands.deeds.append("drag")
    empty.drop(hero)
    hands.deeds.append("drop")
    page.wait_for_selector("#canvas[data-character]")
    empty.drawn()
    hands.click(".menu[data-key=Export] summary")
    with page.expect_download() as file:
        hands.click(".menu[data-key=Export] .row:has-text('GLB')")
    exported = tmp_path / "moving.glb"
    file.value.save_as(exported)
    hands.told("mouse")
    check(empty, exported, hero)


def test_with_the_keyboard_alone(empty: Studio, tmp_path: Path):
    hands, hero = Hands(empty), Hero().write(tmp_path / "hero.glb")
    page = empty.page
    empty.drawn()
    hands.key("Alt+n")
    page.wait_for_selector("#start")
    hands.type("a person walks forward, then runs forward")
    hands.key("Enter")
    page.wait_for_selector("#start", state="hidden")
    empty.drawn()
    hands.key("p")
    hands.key("ArrowUp", held=20)
    hands.key("Enter")
    empty.drawn()
    with page.expect_file_chooser() as chooser:
        hands.key("Control+o")
    chooser.value.set_files(hero)
    hands.deeds.append("choose")
    page.wait_for_selector("#canvas[data-character]")
    empty.drawn()
    with page.expect_download() as file:
        hands.key("Shift+E")
    exported = tmp_path / "moving.glb"
    file.value.save_as(exported)
    hands.told("keyboard")
    check(empty, exported, hero)


def faults(studio: Studio) -> list[str]:
    """What axe finds, in a line each."""
    studio.page.evaluate(AXE.read_text())
    found = studio.page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
    return [f"{one['id']}: {one['nodes'][0]['html'][:160]} ({len(one['nodes'])})" for one in found]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing(empty: Studio, theme: str):
    """In either theme: the page at work, each of its windows, the first question, and a phone."""
    if not AXE.is_file():
        pytest.skip("axe is not installed (make page)")
    page = empty.page
    if page.evaluate("document.documentElement.dataset.theme") != theme:
        empty.key("Shift+D")
    empty.key("Escape", "Escape", "Home", "ArrowDown", "Shift+M", "ArrowDown")
    found = {"work": faults(empty)}
    for key, name in {"?": "help", "Control+k": "palette", "Shift+H": "history", "Alt+o": "projects"}.items():
        empty.key(key)
        page.wait_for_selector(f"#{name}[open]")
        page.wait_for_timeout(300)
        found[name] = faults(empty)
        empty.key("Escape")
        page.wait_for_selector(f"#{name}", state="hidden")
    empty.key("Alt+n")
    page.wait_for_selector("#start")
    found["start"] = faults(empty)
    empty.key("Escape")
    page.set_viewport_size({"width": 390, "height": 844})
    empty.key("Shift+P")
    page.wait_for_timeout(400)
    found["phone"] = faults(empty)
    empty.key("Shift+P")
    page.set_viewport_size({"width": 1280, "height": 800})
    assert not any(found.values()), json.dumps(found, indent=1)
