"""Blocks of the timeline, several at a time: selected, copied, moved, laid over others; markers, zoom, panels."""

import pytest

from tests.studio.studio import Studio

FOUR = (("a person walks", 2.0), ("a person jumps", 1.0), ("a person waves", 2.0), ("a person sits", 2.0))


@pytest.fixture
def four(tab: Studio) -> Studio:
    """A project of four blocks."""
    tab.faults.clear()
    tab.open(*FOUR)
    return tab


def chosen(studio: Studio) -> list[int]:
    states = studio.page.locator(".track.words .block").evaluate_all("all => all.map(one => one.matches('.chosen'))")
    return [index for index, is_chosen in enumerate(states) if is_chosen]


def block(studio: Studio, number: int) -> tuple[float, float]:
    return studio.middle(".track.words .block", number)


def click(studio: Studio, number: int, hold: str = "") -> None:
    if hold:
        studio.page.keyboard.down(hold)
    studio.page.mouse.click(*block(studio, number))
    if hold:
        studio.page.keyboard.up(hold)


def words(studio: Studio) -> list[str]:
    return [text.removeprefix("a person ") for text, _ in studio.blocks()]


def test_blocks_are_selected_with_control_shift_and_a_frame(four: Studio):
    click(four, 0)
    click(four, 2, "Control")
    assert chosen(four) == [0, 2]
    click(four, 0, "Control")
    assert chosen(four) == [2]
    click(four, 0, "Shift")
    assert chosen(four) == [0, 1, 2]
    click(four, 3)
    assert chosen(four) == [3]
    left, top = four.middle(".track.path")[0], four.middle(".track.path")[1]
    x = block(four, 1)[0]
    four.drag((x, top), (x + 60, top - 30), (block(four, 2)[0], block(four, 2)[1]))
    assert chosen(four) == [1, 2]
    four.page.mouse.click(left + 300, top)
    assert chosen(four) == []
    four.key("Control+a")
    assert chosen(four) == [0, 1, 2, 3]
    four.key("Escape", "Home", "ArrowDown", "Shift+ArrowDown")
    assert chosen(four) == [0, 1]


def test_blocks_are_copied_cut_pasted_and_deleted(four: Studio):
    click(four, 0)
    click(four, 1, "Shift")
    four.key("Control+c")
    click(four, 3)
    four.key("Control+v")
    assert words(four) == ["walks", "jumps", "waves", "sits", "walks", "jumps"]
    assert chosen(four) == [4, 5]
    four.key("Control+x")
    assert words(four) == ["walks", "jumps", "waves", "sits"]
    click(four, 0)
    four.key("Control+v", "Delete")
    assert words(four) == ["walks", "jumps", "waves", "sits"]
    four.key("Control+a", "Delete")
    assert words(four) == [""]
    four.key("Control+z")
    assert words(four) == ["walks", "jumps", "waves", "sits"]


def test_several_blocks_are_dragged_with_a_mark_where_they_land(four: Studio):
    click(four, 0)
    click(four, 1, "Control")
    start, end = block(four, 0), block(four, 3)
    four.page.mouse.move(*start)
    four.page.mouse.down()
    four.page.mouse.move(end[0] + 60, end[1], steps=5)
    mark = four.page.locator(".landing")
    assert mark.is_visible()
    assert abs(mark.bounding_box()["x"] - (end[0] + 84)) < 4, "behind the last block"
    four.page.mouse.up()
    assert not mark.is_visible()
    assert words(four) == ["waves", "sits", "walks", "jumps"]


def test_a_block_lies_over_others_which_stay_when_they_are(four: Studio):
    four.key("Shift+O")
    x, y = block(four, 1)
    four.drag((x, y), (x + 2 * 84, y))
    assert four.blocks() == [
        ("a person walks", 3),
        ("a person waves", 1),
        ("a person jumps", 1),
        ("a person sits", 2),
    ]
    four.key("Shift+O", "Control+z")
    four.drag((x, y), (x + 2 * 84, y), hold="Shift")
    assert [seconds for _, seconds in four.blocks()] == [3, 1, 1, 2], "Shift is the other way for once"


def test_markers_are_put_named_dragged_gone_to_and_kept(four: Studio):
    page = four.page
    four.key("Home", "Shift+ArrowRight", "Shift+M")
    page.get_by_label("Name of the marker").fill("the jump")
    page.locator(".marker").wait_for()
    _, y = four.middle(".marker")
    left = page.locator(".marker").bounding_box()["x"]
    four.drag((left + 4, y), (left + 4 + 84, y))
    [marker] = four.project()["markers"]
    assert (marker["name"], marker["time"]) == ("the jump", 2)
    four.key("Home", "Control+ArrowRight")
    assert page.locator(".clock").inner_text().startswith("2.00")
    four.load()
    assert page.locator(".marker").inner_text() == "the jump"
    page.locator(".marker").focus()
    four.key("Delete")
    assert page.locator(".marker").count() == 0


def test_the_timeline_zooms_at_the_pointer_and_fits(four: Studio):
    page = four.page
    four.key("f")
    scroll = page.locator(".scroll").bounding_box()
    last = page.locator(".track.words .block").last.bounding_box()
    assert 0 < scroll["x"] + scroll["width"] - (last["x"] + last["width"]) < 60, "all of it, and hardly more"
    x, y = block(four, 2)
    page.mouse.move(x, y)
    page.keyboard.down("Control")
    for _ in range(3):
        page.mouse.wheel(0, -100)
    page.keyboard.up("Control")
    page.wait_for_timeout(200)
    assert abs(block(four, 2)[0] - x) < 3, "what is under the pointer stays there"
    assert page.locator(".track.words .block").nth(2).bounding_box()["width"] > 1.4 * 2 * (last["width"] / 2)


def test_panels_are_resized_by_mouse_and_keys_and_stay_so(four: Studio):
    page = four.page
    height = "document.querySelector('#timeline').offsetHeight"
    before = page.evaluate(height)
    x, y = four.middle("#split-timeline")
    four.drag((x, y), (x, y - 60))
    assert abs(page.evaluate(height) - before - 60) < 3
    page.locator("#split-inspector").focus()
    wide = page.locator("#inspector").bounding_box()["width"]
    four.key("ArrowLeft", "ArrowLeft")
    assert page.locator("#inspector").bounding_box()["width"] == wide + 32
    four.load()
    assert page.locator("#inspector").bounding_box()["width"] == wide + 32
    for name in ("timeline", "inspector"):
        page.mouse.dblclick(*four.middle(f"#split-{name}"))
    assert page.evaluate(height) == before


def test_figures_in_the_blocks_show_the_motion(four: Studio):
    ink = """() => { const canvas = document.querySelector('.figures'), wide = canvas.width / canvas.clientWidth;
        const data = canvas.getContext('2d').getImageData(0, 0, Math.round(588 * wide), canvas.height).data;
        let sum = 0; for (let n = 3; n < data.length; n += 4) sum += data[n] > 128; return sum / (wide * wide) }"""
    four.page.wait_for_timeout(300)
    first = four.page.evaluate(ink)
    assert first > 500, "some twenty figures of thin lines"
    four.key("-", "-", "-", "-", "-")
    four.page.wait_for_timeout(300)
    assert 0 < four.page.evaluate(ink) < first
