"""A tablet and a phone: the stage has the whole width, the panel is a sheet, and what a finger presses is large."""

import re

import pytest

from tests.studio.studio import Studio

NAMED_KEY = re.compile(r"\((Shift |Alt |Ctrl )*(.|Del|Space|Esc|Escape)\)$")
SMALL = """() => [...document.querySelectorAll('#top button, #top .menu > summary, #transport button, #tools button,'
    + '#views button')].filter(one => one.checkVisibility() && !one.closest('.sheet'))
    .filter(one => one.offsetWidth < 44 || one.offsetHeight < 44)
    .map(one => one.getAttribute('aria-label') ?? one.textContent)"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (820, 1180)])
def test_fingers_find_large_buttons_and_the_stage_has_the_width(studio: Studio, browser, width: int, height: int):
    context = browser.new_context(viewport={"width": width, "height": height}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(studio.server.page)
    page.wait_for_selector("body[data-ready]")
    assert page.locator("#canvas").bounding_box()["width"] == width
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.evaluate(SMALL) == []
    assert not page.locator("#inspector").is_visible()
    page.locator("#top [data-key=panel]").tap()
    page.locator("#inspector h2").first.wait_for()
    page.wait_for_timeout(600)
    box = page.locator("#inspector").bounding_box()
    assert box["x"] + box["width"] <= width
    page.locator("#top [aria-label='Everything that can be done']").tap()
    page.wait_for_selector("#palette[open]")
    assert page.locator(".hint kbd").count() == 0
    titles = page.locator("[title]").evaluate_all("all => all.map(one => one.title)")
    assert not [one for one in titles if NAMED_KEY.search(one)], "a finger presses no key"
    context.close()


@pytest.mark.parametrize("width", [390, 820, 1024, 1280, 1440])
def test_menus_stay_in_the_window(studio: Studio, width: int):
    page = studio.page
    page.set_viewport_size({"width": width, "height": 600})
    for name in ("Project", "Export"):
        menu = page.locator(f".menu[data-key={name}]")
        menu.locator("summary").click()
        box = menu.locator(".sheet").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= 600
        menu.locator("summary").click()
    page.set_viewport_size({"width": 1280, "height": 720})


def test_an_empty_track_begins_by_a_press(studio: Studio):
    page = studio.page
    page.get_by_role("button", name="Draw a path").last.click()
    assert page.locator("#tools [aria-label='Draw a path']").get_attribute("aria-pressed") == "true"
    studio.key("Escape")
    page.locator(".hint", has_text="Keep this pose").click()
    assert len(studio.project()["people"][0]["poses"]) == 1
