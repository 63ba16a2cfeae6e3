"""Files out and in, and what survives a crash."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from motionloom import load
from tests.io.rigged import Hero
from tests.studio.studio import Studio


def test_a_bvh_comes_out_and_goes_in_again(studio: Studio, tmp_path: Path):
    data = studio.download("e")
    file = tmp_path / "walk.bvh"
    file.write_bytes(data)
    assert abs(load(file).seconds - 2.0) < 0.11
    studio.page.locator("input[type=file]").set_input_files(str(file))
    studio.page.wait_for_selector(".clip")
    [clip] = studio.project()["clips"]
    assert clip["name"] == "walk.bvh"
    studio.page.locator(".clip select").select_option(index=1)
    project = studio.project()
    assert project["takes"][0]["how"] == "from a file"


def test_a_motion_is_shared_as_a_page(studio: Studio, browser, tmp_path: Path):
    """One file, which plays without a network; with a character of one's own if asked."""
    page = studio.page
    assert page.locator(".sheet .row", has_text="Share with your character").count() == 0, "there is none"
    plain = studio.download("Control+e")
    studio.drop(Hero().write(tmp_path / "hero.glb"))
    page.wait_for_selector("#canvas[data-character]")
    own = studio.export("Share with your character")
    assert len(plain) < 1_500_000
    assert len(own) > len(plain)
    context = browser.new_context(viewport={"width": 480, "height": 360}, offline=True, reduced_motion="reduce")
    for number, data in enumerate((plain, own)):
        file = tmp_path / f"shared {number}.html"
        file.write_bytes(data)
        shown = context.new_page()
        faults: list[str] = []
        shown.on("pageerror", lambda error, faults=faults: faults.append(str(error)))
        shown.goto(file.as_uri())
        shown.wait_for_selector("body[data-ready]", timeout=240_000)
        assert shown.title() == "a person walks forward"
        assert shown.locator(".clock").inner_text() == "0.00 / 2.00 s"
        assert not faults
        shown.close()
    context.close()


def test_the_export_menu_stays_open_while_the_page_changes_behind_it(studio: Studio):
    page, focused = studio.page, "document.activeElement.textContent"
    menu = page.locator(".menu[data-key=Export]")
    old = studio.project()["takes"][0]["motion"]
    studio.key("r")
    menu.locator("summary").focus()
    studio.key("Enter", "ArrowDown", "ArrowDown", "ArrowDown", "ArrowUp")
    assert page.evaluate(focused).startswith("GLB")
    assert studio.project()["takes"][0]["motion"] != old, "the clip came while the menu was open"
    assert menu.get_attribute("open") is not None
    assert page.evaluate(focused).startswith("GLB")
    assert studio.download("Enter")[:4] == b"glTF"
    assert menu.get_attribute("open") is None
    studio.key("Enter", "ArrowDown", "Escape")
    assert menu.get_attribute("open") is None
    assert page.evaluate(focused) == "Export", "the keyboard goes on where the menu was opened"
    menu.locator("summary").click()
    assert menu.get_attribute("open") is not None
    page.mouse.click(*studio.middle("#canvas"))
    assert menu.get_attribute("open") is None
    assert [text for text, _ in studio.blocks()] == ["a person walks forward"], "no key went through to the page"


def test_one_clip_dragged_onto_another_goes_over_into_it(studio: Studio):
    studio.key("w", "r")
    studio.drawn()
    studio.key("w")
    assert len(studio.project()["clips"]) == 2
    studio.page.locator(".clip").nth(1).scroll_into_view_if_needed()
    studio.drag(studio.middle(".clip b"), studio.middle(".clip b", 1))
    project = studio.project()
    assert project["takes"][0]["how"] == "switched"
    assert abs(project["takes"][0]["seconds"] - 5.0) < 0.2


def test_the_timeline_runs_on_the_command_line_to_the_same_motion(studio: Studio, tmp_path: Path):
    studio.open(("a person walks", 2), ("a person waves", 2))
    studio.key("p", "ArrowUp", "ArrowUp", "ArrowUp", "Enter")
    timeline = tmp_path / "timeline.yaml"
    studio.drawn()
    timeline.write_bytes(studio.download("Alt+e"))
    out = tmp_path / "same.npz"
    subprocess.run([sys.executable, "-m", "motionloom", "compose", str(timeline), "--out", str(out)], check=True)
    here, there = studio.motion()[0], load(out).positions()
    assert here.shape == there.shape
    assert np.abs(here - there).max() < 1e-3


def test_a_project_file_is_saved_and_opened(studio: Studio, tmp_path: Path):
    studio.key("d")
    studio.drawn()
    file = tmp_path / "mine.loom.json"
    file.write_bytes(studio.download("Control+s"))
    assert len(json.loads(file.read_text())["segments"]) == 2
    studio.key("Control+z")
    assert len(studio.blocks()) == 1
    studio.page.locator("input[type=file]").set_input_files(str(file))
    studio.page.locator(".track.words .block").nth(1).wait_for()  # the page reads a file in its own time
    assert len(studio.blocks()) == 2


def test_a_file_that_is_no_project_is_reported(studio: Studio, tmp_path: Path):
    file = tmp_path / "broken.json"
    file.write_text('{"version": 1, "segments": [{"id": "a", "text": 5}]}')
    before = studio.blocks()
    studio.page.locator("input[type=file]").set_input_files(str(file))
    studio.says(studio.page.locator(".notice[role=alert]"), "segments[0].text must be text")
    assert studio.blocks() == before


def test_a_tab_that_is_closed_finds_its_project_again(studio: Studio):
    studio.key("d")
    before = studio.project()
    studio.load()
    after = studio.project()
    assert after["segments"] == before["segments"]
    assert after["takes"] == before["takes"]


def test_a_server_that_is_away_is_reported_and_nothing_is_lost(studio: Studio):
    studio.page.route("**/*", lambda route: route.abort())
    studio.key("d")
    studio.page.wait_for_selector(".notice.away")
    studio.page.unroute("**/*")
    studio.page.wait_for_selector(".notice.away", state="detached")
    project = studio.caught_up()
    assert len(project["segments"]) == 2
    assert abs(project["takes"][0]["seconds"] - 4.0) < 0.01
