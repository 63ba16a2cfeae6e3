"""The five minutes of `docs/studio.md`, sentence by sentence, where no other test does what the sentence says."""

import numpy as np
import pytest

from tests.studio.studio import Studio

RIGHT_WRIST = 21

pytestmark = pytest.mark.slow


def field(studio: Studio, name: str, value: str) -> None:
    """Fill in a number of the panel, as somebody does who clicks it and types."""
    studio.page.get_by_label(name).first.fill(value, timeout=20_000)
    studio.page.keyboard.press("Enter")


def test_words_are_drawn_soon_after_the_last_letter(studio: Studio):
    before = studio.project()["takes"][0]["motion"]
    studio.page.mouse.dblclick(*studio.middle(".track.words .block"))
    studio.page.keyboard.type("a person jumps")
    studio.page.wait_for_selector("#stage[aria-busy=true]")
    project = studio.project()
    assert project["segments"][0]["text"] == "a person jumps"
    assert project["takes"][0]["motion"] != before
    assert studio.page.locator(".block input.words").count() == 1, "and who types goes on typing"
    studio.key("Escape")


def test_the_hatched_piece_changes_the_transition(studio: Studio):
    studio.open(("a person walks", 4), ("a person waves", 4))
    old = studio.page.locator(".transition").bounding_box()["width"]
    x, y = studio.middle(".transition i")
    studio.drag((x, y), (x + 42, y))
    [first, _] = studio.project()["segments"]
    assert first["transition"] == 2
    assert abs(studio.page.locator(".transition").bounding_box()["width"] - old - 84) < 2
    assert studio.motion().shape[1] == 160


def test_a_path_of_clicks_has_speed_and_stops_and_the_right_button_turns_the_view(studio: Studio):
    studio.open(("a person walks", 5))
    studio.key("x", "p")
    x, y = studio.middle("#canvas")
    for place in ((x, y - 10), (x + 90, y - 40), (x + 90, y - 110)):
        studio.page.mouse.click(*place)
        studio.drawn()
    points = studio.project()["people"][0]["path"]["points"]
    assert len(points) >= 3
    shown = studio.at("path-end")
    studio.page.mouse.move(x - 200, y)
    studio.page.mouse.down(button="right")
    studio.page.mouse.move(x - 120, y, steps=5)
    studio.page.mouse.up(button="right")
    assert np.linalg.norm(np.subtract(studio.at("path-end"), shown)) > 15, "the view was turned"
    assert studio.project()["people"][0]["path"]["points"] == points, "and nothing was drawn"
    studio.page.mouse.click(*studio.at("path-end"))
    field(studio, f"Stop at {len(points)}, s", "1")
    path = studio.project()["people"][0]["path"]
    assert path["points"][-1]["stop"] == 1
    studio.key("Escape")
    field(studio, "Speed, m/s", "0.8")
    project = studio.project()
    assert project["people"][0]["path"]["speed"] == 0.8
    studio.says(studio.page.locator(".way"), "cm")


def test_a_joint_is_clicked_dragged_and_pinned_through_time(studio: Studio):
    studio.open(("a person stands still", 4))
    studio.key("Home", "Shift+ArrowRight", "t")
    studio.drawn()
    x, y = studio.at("gizmo")
    studio.page.mouse.move(x, y - 20)
    studio.drag((x, y - 27), (x, y - 50))
    studio.drawn()
    field(studio, "Hold until, s", "2")
    project = studio.project()
    [target] = project["people"][0]["targets"]
    assert (target["time"], target["until"]) == (1.0, 2.0)
    wrist = studio.motion(project)[0, 20:41, RIGHT_WRIST]
    assert np.linalg.norm(wrist - target["position"], axis=-1).max() < 0.08
    assert studio.page.locator(".key.pinned").count() == 1


def test_only_one_block_is_drawn_anew_where_that_is_asked(studio: Studio):
    studio.open(("a person walks", 3), ("a person waves", 3))
    before = studio.motion()
    studio.page.mouse.click(*studio.middle(".track.words .block", 1))
    studio.page.get_by_role("button", name="Draw only this block").click()
    project = studio.project()
    assert project["frozen"] == [[0, 3]]
    studio.page.mouse.dblclick(*studio.middle(".track.words .block", 1))
    studio.page.keyboard.type("a person jumps")
    studio.key("Enter")
    after = studio.motion()
    assert np.abs(after[0, :50] - before[0, :50]).max() < 0.02
    assert np.abs(after[0, 75:] - before[0, 75:]).max() > 0.05


def test_the_first_line_of_an_exported_timeline_is_the_command_that_runs_it(studio: Studio):
    text = studio.export("Timeline (YAML)").decode()
    assert text.splitlines()[0].startswith("# motionloom compose")
