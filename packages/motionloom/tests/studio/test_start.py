"""The first minute and the next projects: the first question, New, Open, Recent, Save as."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.studio.studio import Studio

LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_WRIST, RIGHT_WRIST, HEAD = 16, 17, 20, 21, 15
DEEDS = {
    "a person walks, turns around and waves": ("walks", "turns 2", "waves"),
    "a person walks forward, then sits down": ("walks", "ends sitting"),
    "a person picks something up off the floor and walks on": ("bows once", "walks"),
    "a child skips along happily": ("hops on one leg", "forward"),
    "a person is doing jumping jacks": ("does jumping jacks",),
    "a person claps their hands": ("claps",),
}
"""What is measured in the motion of each sentence that the page begins with."""


def names(studio: Studio) -> list[str]:
    return [one["name"] for one in studio.server.ask("/projects")]


def from_menu(studio: Studio, name: str) -> None:
    menu = studio.page.locator(".menu[data-key=Project]")
    menu.locator("summary").click()
    menu.locator(".row").filter(has=studio.page.get_by_text(name, exact=True)).click()


def say(studio: Studio, sentence: str) -> None:
    studio.until("document.activeElement.closest('#start')")
    studio.page.keyboard.type(sentence)
    studio.key("Enter")
    studio.page.wait_for_selector("#start", state="hidden")


def test_a_new_folder_asks_what_the_person_should_do_while_somebody_moves(empty: Studio):
    page = empty.page
    assert page.locator("#start").is_visible()
    assert page.evaluate("document.activeElement.getAttribute('aria-label')") == "What should the person do?"
    assert sorted(page.locator("#start .chip").all_inner_texts()) == sorted(DEEDS)
    empty.until("document.querySelector('.clock').textContent > '0.5'")


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1280, 720), (390, 844)])
def test_nobody_is_hidden_behind_the_first_question(empty: Studio, width: int, height: int):
    """Head and feet are on the stage, above the card, however large the window is."""
    page = empty.page
    page.set_viewport_size({"width": width, "height": height})
    (_, head), (_, foot) = empty.at("head"), empty.at("foot")
    top = page.locator("#stage").bounding_box()["y"]
    card = page.locator("#start").bounding_box()["y"]
    page.set_viewport_size({"width": 1280, "height": 800})
    assert top + 15 < head < foot < card


@pytest.mark.parametrize("sentence", DEEDS)
def test_each_sentence_that_is_offered_is_obeyed(empty: Studio, sentence: str):
    """Measured on the joints, as drawn by a click on it in a new project."""
    if not empty.page.locator("#start").is_visible():
        from_menu(empty, "New project")
    empty.page.locator("#start .chip", has_text=sentence).click()
    empty.page.wait_for_selector("#start", state="hidden")
    project = empty.project()
    texts = [one["text"] for one in project["segments"]]
    assert project["name"].startswith(texts[0][:40]), "it is named after its words"
    told = project["takes"][0]["told"][0]
    assert all(deed in told for deed in DEEDS[sentence]), told
    if "waves" in sentence:
        [body] = empty.motion(project)
        wave = body[-round(project["segments"][-1]["seconds"] * 20) :]
        raised = wave[:, [LEFT_WRIST, RIGHT_WRIST], 1] - wave[:, [LEFT_SHOULDER, RIGHT_SHOULDER], 1]
        assert raised.max() > 0.1, "a hand is above its shoulder"
        hand = wave[:, RIGHT_WRIST] - wave[:, RIGHT_SHOULDER]
        side = wave[:, LEFT_SHOULDER] - wave[:, RIGHT_SHOULDER]
        sway = np.diff(np.sign(np.diff((hand * side).sum(-1)[::4])))
        assert (sway != 0).sum() >= 3, "and goes to and fro"


def test_what_is_typed_becomes_a_block_for_each_action(empty: Studio):
    from_menu(empty, "New project")
    assert empty.page.locator(".notice, .said").count() == 0, "nobody is scolded for what they have not said yet"
    say(empty, "a person jumps, then sits down")
    project = empty.project()
    assert [one["text"] for one in project["segments"]] == ["a person jumps", "a person sits down"]
    assert project["name"] == "a person jumps, sits down"
    assert len(project["takes"]) == 1


def test_other_projects_are_opened_with_their_own_undo_and_none_is_lost(empty: Studio):
    page = empty.page
    before = set(names(empty))
    from_menu(empty, "New project")
    say(empty, "a person kneels down")
    empty.drawn()
    empty.key("Alt+o")
    card = page.locator("#projects .card", has_text="a person jumps, sits down").first
    card.click()
    page.wait_for_selector("#projects", state="hidden")
    empty.says(page.locator(".block"), "a person jumps")
    assert set(names(empty)) == before | {"a person kneels down"}
    empty.key("Control+z")
    assert page.locator(".block .words").all_inner_texts() == ["double-click to write"], "its own first state"
    empty.key("Control+Shift+z")
    empty.drawn()
    assert not empty.faults


def test_save_as_goes_on_in_a_copy(empty: Studio):
    page = empty.page
    empty.drawn()
    old = empty.server.ask("/project")
    from_menu(empty, "Save as another project")
    page.locator("#name input").fill("second version")
    empty.key("Enter")
    page.wait_for_selector("#name", state="hidden")
    empty.key("d")
    project = empty.project()
    assert (project["name"], len(project["segments"])) == ("second version", len(old["segments"]) + 1)
    assert project["id"] != old["id"]
    empty.key("Alt+o")
    page.locator("#projects .card", has_text=old["name"]).first.click()
    page.wait_for_selector("#projects", state="hidden")
    assert empty.project()["segments"] == old["segments"]


def test_a_project_file_is_opened_as_a_project_of_its_own(empty: Studio, tmp_path: Path):
    old = empty.project()
    file = tmp_path / "film.loom.json"
    blocks = [{"id": "a", "text": "a person crawls", "seconds": 2}]
    file.write_text(json.dumps({"version": 2, "name": "From a file", "segments": blocks}))
    empty.drop(file)
    empty.says(empty.page.locator(".block"), "a person crawls")
    project = empty.project()
    assert (project["name"], project["id"] != old["id"]) == ("From a file", True)
    assert old["name"] in names(empty)


def test_undo_goes_on_behind_a_reload(studio: Studio):
    studio.key("d", "d")
    assert len(studio.blocks()) == 3
    studio.page.wait_for_timeout(600)
    studio.load()
    studio.key("Control+z", "Control+z")
    assert len(studio.blocks()) == 1
    studio.load()
    studio.key("Control+Shift+z")
    assert len(studio.blocks()) == 2


def test_history_by_pictures_goes_to_any_state(studio: Studio):
    page = studio.page
    studio.key("d", "d", "d")
    studio.drawn()
    studio.key("Shift+H")
    cards = page.locator("#history .card")
    assert cards.count() >= 4
    studio.until(
        "[...document.querySelectorAll('#history .card')][0].querySelector('canvas')"
        ".getContext('2d').getImageData(0, 0, 300, 150).data.some(one => one > 0)"
    )
    cards.nth(2).click()
    assert len(studio.blocks()) == 2
    studio.key("Control+Shift+z")
    assert len(studio.blocks()) == 3


def test_the_palette_finds_and_does_everything(studio: Studio):
    page = studio.page
    studio.key("Control+k")
    page.keyboard.type("dupl")
    assert page.locator("#palette [role=option]").all_inner_texts()[0].startswith("Duplicate the block")
    studio.key("Enter")
    page.wait_for_selector("#palette", state="hidden")
    assert len(studio.blocks()) == 2
    studio.key("Control+k")
    named = page.locator("#palette [role=option] .grow").all_inner_texts()
    studio.key("Escape")
    page.wait_for_selector("#palette", state="hidden")
    studio.key("?")
    page.wait_for_selector("#help[open]")
    listed = set(page.locator("#help dd").all_inner_texts()) - {"Everything that can be done"}
    missing = {one for one in listed if not any(name.startswith(one) for name in named)}
    idle = {"Redo", "Paste blocks behind the selected one", "To the next meeting of hands of two people, to move it"}
    assert missing <= idle, "which have nothing to do now"
    keys = page.locator("#help dt kbd").all_inner_texts()
    assert sorted(keys) == sorted(set(keys)), "a key has one meaning"
    studio.key("Escape")


def test_words_typed_on_a_project_that_is_opened_again_do_nothing_else(studio: Studio):
    """Letters that are also keys of the page are written into the one field; `Enter` puts them behind what is there."""
    page = studio.page
    before = studio.blocks()
    page.goto(studio.server.page)
    page.wait_for_selector("body[data-ready]")
    page.keyboard.type("a man jumps", delay=5)
    field = page.locator("#prompt input")
    assert field.input_value() == "a man jumps"
    assert studio.blocks() == before
    studio.key("Enter")
    page.locator(".track.words .block").nth(len(before)).wait_for()
    assert [text for text, _ in studio.blocks()] == [text for text, _ in before] + ["a man jumps"]
    assert field.input_value() == ""
    studio.key("d")
    assert len(studio.blocks()) == len(before) + 2, "keys act again"


def test_the_field_begins_a_project_anew_and_the_old_one_stays(studio: Studio):
    page, old = studio.page, studio.project()
    page.locator("#prompt input").fill("a person claps")
    page.get_by_role("button", name="New", exact=True).click()
    studio.says(page.locator(".block"), "a person claps")
    project = studio.project()
    assert [one["text"] for one in project["segments"]] == ["a person claps"]
    assert project["id"] != old["id"]
    assert old["name"] in names(studio)


def test_keys_are_found_by_their_words(studio: Studio):
    page = studio.page
    studio.key("?")
    page.wait_for_selector("#help[open]")
    assert page.locator("#help .eight kbd").count() == 8
    page.locator("#help .search").fill("mirror")
    assert page.locator("#help dd:visible").all_inner_texts() == ["Mirror the pose"]
    studio.key("Escape")


def test_the_palette_knows_other_programs_and_begins_with_what_was_done_last(studio: Studio):
    page = studio.page
    first = page.locator("#palette [role=option]").first
    studio.key("Control+k")
    page.keyboard.type("unity")
    studio.says(first, "Export GLB")
    page.locator("#palette .search").fill("dupl")
    studio.key("Enter")
    page.wait_for_selector("#palette", state="hidden")
    studio.key("Control+k")
    studio.says(first, "Duplicate the block")
    studio.key("Escape")
