"""Takes, stretches that stay, what comes next, two people."""

import numpy as np

from tests.studio.studio import Studio

SEEN = """() => {
    window.SEEN = 0;
    const [names, stage] = ["#names", "#stage"].map(one => document.querySelector(one));
    new MutationObserver(() => {
        if (stage.getAttribute("aria-busy") === "true") window.SEEN = Math.max(window.SEEN, names.children.length)
    }).observe(names, {childList: true})
}"""
"""How many takes are named while they are being drawn."""


def test_four_takes_side_by_side_and_one_is_kept(studio: Studio):
    studio.page.evaluate(SEEN)
    studio.key("g")
    project = studio.project()
    assert studio.page.evaluate("SEEN") == 4, "all four were seen on their way"
    assert len(project["takes"]) == 4
    assert len({take["seed"] for take in project["takes"]}) == 4
    assert studio.page.locator("#names span").count() == 4
    box = studio.page.locator("#canvas").bounding_box()
    studio.page.mouse.click(box["x"] + box["width"] * 0.75, box["y"] + box["height"] * 0.75)
    assert studio.project()["kept"] == 3
    studio.key("2")
    assert studio.project()["kept"] == 1


def test_a_frozen_stretch_stays_and_the_rest_is_drawn(studio: Studio):
    studio.open(("a person walks", 3), ("a person waves", 3))
    before = studio.motion()
    box = studio.page.locator(".content .ruler").bounding_box()
    left, y = box["x"], box["y"] + 12
    studio.drag((left + 2, y), (left + 3 * 84, y), hold="Shift")
    studio.key("z", "r")
    project = studio.project()
    assert project["frozen"] == [[0, 3]]
    assert project["takes"][0]["how"] == "redrawn"
    after = studio.motion(project)
    assert np.abs(after[0, :55] - before[0, :55]).max() < 0.02
    assert np.abs(after[0, 75:] - before[0, 75:]).max() > 0.05
    studio.key("Shift+Z")
    assert studio.project()["frozen"] == []


def test_a_stretch_that_is_frozen_during_a_draw_is_of_the_motion_that_comes_of_it(studio: Studio):
    studio.open(("a person walks", 3), ("a person waves", 3))
    old = studio.project()["takes"][0]["motion"]
    box = studio.page.locator(".content .ruler").bounding_box()
    left, y = box["x"], box["y"] + 12
    studio.drag((left + 2, y), (left + 3 * 84, y), hold="Shift")
    studio.key("r", "z")
    studio.page.wait_for_selector(".frozen")
    project = studio.project()
    assert project["base"]["motion"] != old
    assert project["base"]["seed"] == project["seed"]
    assert (
        np.abs(studio.motion(project)[0, :55] - studio.motion({"takes": [project["base"]], "kept": 0})[0, :55]).max()
        < 0.02
    )


def test_a_future_is_chosen(studio: Studio):
    studio.key("n")
    studio.page.wait_for_selector("#inspector >> text=What could come next")
    assert studio.page.locator("#inspector .take").count() == 5
    before = studio.motion()
    studio.key("2")
    project = studio.project()
    assert [one["seconds"] for one in project["segments"]] == [2, 2]
    after = studio.motion(project)
    assert after.shape[1] == 80
    assert np.abs(after[0, :40] - before[0]).max() < 1e-3


def test_a_loop_closes(studio: Studio):
    studio.key("l")
    [person] = studio.motion()
    first, last = person[0] - person[0, :1], person[-1] - person[-1, :1]
    assert studio.project()["takes"][0]["how"] == "looped"
    assert np.linalg.norm(first - last, axis=-1).mean() < 0.15


def test_bodies_that_are_in_each_other_are_red_on_the_ruler(studio: Studio):
    studio.open(("two people stand", 3), people=2)
    project = studio.project()
    overlaps = [{"begin": 1.0, "end": 1.5, "depth": 0.06}]
    studio.put({**project, "takes": [{**project["takes"][0], "overlaps": overlaps}]})
    studio.load()
    assert studio.page.locator(".ruler .overlap").get_attribute("title") == "The two are in each other by up to 6 cm"
    studio.says(studio.page.locator("#inspector"), "up to 6 cm")
    tags = studio.page.locator("#stage .tag")
    for who in (0, 1):
        studio.says(tags.nth(who), "two people stand")
    assert tags.first.bounding_box() != tags.last.bounding_box()
    assert [one.get_attribute("class") for one in studio.page.locator(".labels .asked").all()][:2] == [
        "asked who0",
        "asked who1",
    ]


def test_two_people_from_words(studio: Studio):
    studio.open(("two people shake hands", 3))
    studio.page.get_by_role("button", name="Two").click()
    motion = studio.motion()
    assert motion.shape[0] == 2
    assert np.linalg.norm(motion[0, 0, 0] - motion[1, 0, 0]) > 0.3
    studio.key("q")
    assert studio.page.locator(".track.words").count() >= 2
