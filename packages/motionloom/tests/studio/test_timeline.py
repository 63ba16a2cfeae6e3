"""The timeline: blocks of words with keys and the mouse, and undo of all of it."""

import numpy as np
import pytest

from tests.studio.studio import Studio


def test_a_person_is_seen_and_moves(studio: Studio):
    before = studio.picture()
    studio.key("End")
    after = studio.picture()
    assert before.std() > 4, "the stage is blank"
    assert (np.abs(before - after).max(axis=-1) > 40).mean() > 0.002, "nobody moved"
    assert not studio.faults


@pytest.mark.parametrize("begun", ["key", "mouse"])
def test_words_that_are_typed_make_another_motion(studio: Studio, begun: str):
    before = studio.motion()
    if begun == "key":
        studio.key("Enter")
    else:
        studio.page.mouse.dblclick(*studio.middle(".track.words .block"))
    studio.page.keyboard.type("a person jumps")
    studio.key("Enter")
    project = studio.project()
    assert [one["text"] for one in project["segments"]] == ["a person jumps"]
    after = studio.motion(project)
    assert after.shape == before.shape
    assert np.abs(after - before).max() > 0.1


def test_blocks_are_added_split_duplicated_moved_and_deleted_by_keys(studio: Studio):
    studio.key("a")
    studio.page.keyboard.type("a person sits")
    studio.key("Enter")
    assert studio.blocks() == [("a person walks forward", 2), ("a person sits", 3)]
    studio.key("Alt+ArrowLeft")
    assert studio.blocks() == [("a person sits", 3), ("a person walks forward", 2)]
    studio.key("Home", "Shift+ArrowRight", "s")
    assert studio.blocks() == [("a person sits", 1), ("a person sits", 2), ("a person walks forward", 2)]
    studio.key("d", "Delete")
    assert len(studio.blocks()) == 3


def test_undo_and_redo_go_through_everything(studio: Studio):
    first = studio.project()
    studio.key("Home", "s")  # at the beginning there is nothing to split
    for _ in range(4):
        studio.key("d")
    assert len(studio.blocks()) == 5
    for _ in range(4):
        studio.key("Control+z")
    back = studio.project()
    assert back["segments"] == first["segments"]
    assert back["takes"] == first["takes"], "what was drawn comes back without a draw"
    for _ in range(4):
        studio.key("Control+Shift+z")
    assert len(studio.blocks()) == 5


def test_an_edge_is_dragged_to_half_a_second(studio: Studio):
    x, y = studio.middle(".block .edge.to")
    scale = 84
    studio.drag((x, y), (x + 0.97 * scale, y))
    assert studio.blocks() == [("a person walks forward", 3)]
    assert studio.motion().shape[1] == 60
    studio.key("Control+z")
    assert studio.blocks() == [("a person walks forward", 2)], "a drag is one step"


def test_a_block_is_dragged_behind_another_and_a_seam_is_moved(studio: Studio):
    studio.open(("a person walks", 2), ("a person jumps", 2))
    first, second = studio.middle(".track.words .block"), studio.middle(".track.words .block", 1)
    studio.drag(first, (second[0] + 60, second[1]))
    assert [text for text, _ in studio.blocks()] == ["a person jumps", "a person walks"]
    x, y = studio.middle(".block .edge.from")
    studio.drag((x, y), (x - 42, y))
    assert studio.blocks() == [("a person jumps", 1.5), ("a person walks", 2.5)]


def test_the_ruler_scrubs_and_space_plays(studio: Studio):
    box = studio.page.locator(".content .ruler").bounding_box()
    studio.page.mouse.click(box["x"] + 84, box["y"] + 10)
    assert studio.page.locator(".clock").inner_text().startswith("1.00")
    studio.key("Space")
    studio.until("!document.querySelector('.clock').textContent.startsWith('1.00')")


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_keys_are_listed_and_the_theme_changes(studio: Studio, scheme: str):
    studio.page.evaluate("name => document.documentElement.dataset.theme === name || document.body.click()", scheme)
    before = studio.picture().mean()
    studio.key("Shift+D")
    assert abs(studio.picture().mean() - before) > 60
    studio.key("?")
    assert studio.page.locator("#help").is_visible()
    studio.says(studio.page.locator("#help"), "Undo")
    studio.key("Escape")
    assert not studio.page.locator("#help").is_visible()


def test_a_changed_block_is_drawn_alone_and_the_others_keep_their_frames(studio: Studio):
    studio.open(("a person walks forward", 3), ("a person waves with the right hand", 3), ("a person sits", 2))
    before = studio.motion()
    studio.page.mouse.dblclick(*studio.middle(".track.words .block", 2))
    studio.page.keyboard.type("a person jumps")
    studio.key("Enter")
    project = studio.project()
    after = studio.motion(project)
    assert project["takes"][0]["how"] == "changed"
    assert np.array_equal(after[0, :110], before[0, :110])
    assert np.abs(after[0, 120:] - before[0, 120:]).max() > 0.1
    studio.key("Shift+R")
    whole = studio.project()
    assert whole["takes"][0]["how"] == "drawn"
    assert not np.array_equal(studio.motion(whole)[0, :110], before[0, :110])


def test_a_block_says_what_happens_in_it_and_what_is_known_instead_of_its_words(studio: Studio):
    studio.open(("a person walks forward", 3), ("vacuuming the living room", 3))
    assert studio.page.locator(".block .noted").count() == 1
    studio.page.mouse.move(*studio.middle(".track.words .block", 0))
    studio.says(studio.page.locator(".tip"), "forward")
    studio.page.locator(".track.words .block").nth(1).focus()
    studio.says(studio.page.locator(".remark"), "seen nothing like 'vacuuming the living")
    instead = studio.page.locator(".remark button").first
    words = instead.inner_text()
    instead.click()
    project = studio.project()
    assert project["segments"][1]["text"] == words
    assert studio.page.locator(".block .noted, .remark").count() == 0


def test_somebody_stands_in_an_empty_block_and_the_others_are_drawn(studio: Studio):
    before = studio.project()["takes"][0]
    studio.key("a", "Enter")
    studio.drawn()
    assert studio.project()["takes"][0]["seconds"] == pytest.approx(before["seconds"] + 3)
    studio.says(studio.page.locator(".track.words .block").last, "stands still")
    assert studio.page.locator(".block.wrong, .track.words .said").count() == 0


def test_the_sheet_of_keys_is_as_wide_as_the_window_and_no_key_covers_its_words(studio: Studio):
    studio.key("?")
    sheet = studio.page.locator("#help")
    assert sheet.evaluate("one => one.scrollWidth <= one.clientWidth"), "nothing of it is cut"
    assert sheet.evaluate("one => [...one.querySelectorAll('dt')].every(dt => dt.scrollWidth <= dt.clientWidth + 1)")
    assert all(key.strip() for key in sheet.locator("kbd").all_inner_texts())
    studio.key("Escape")
