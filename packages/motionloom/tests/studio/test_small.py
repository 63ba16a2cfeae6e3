"""A tablet and a phone: the stage has the whole width, the panel is a sheet, and what a finger presses is large."""

import pytest

from tests.studio.studio import Studio

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
    context.close()
