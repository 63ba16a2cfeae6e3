"""The page that needs no server, in a browser."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import load
from motionloom.skeleton import SMPL22
from motionloom.tasks.text import sample_features, to_motion
from motionloom.weights.prior import Prior
from tests.tab import made
from tests.tab.tab import Tab

pytestmark = pytest.mark.slow


def test_a_link_is_drawn_on_one_thread_and_again_without_a_network(tab: Tab, prior: Prior, tmp_path: Path):
    """A host that sends no headers gives one thread; the page's own worker brings threads, and itself offline."""
    tab.open((1, "a person kicks"), seed=3)
    tab.drawn()
    assert tab.threads == 1
    assert all(url.startswith((tab.address, "blob:", "data:")) for url in tab.asked)
    net = replace(prior.net, weights=made.EXPORT["rounded"](prior))
    [features] = sample_features(replace(prior, net=net), ["a person kicks"], [20], seeds=[3])
    wanted = to_motion(features.astype(np.float64), 20.0).positions()
    first = load(tab.save("bvh", tmp_path))
    assert first.skeleton.names[:3] == ("pelvis", "left_hip", "left_knee")
    found = {name: first.positions()[:, joint] for joint, name in enumerate(first.skeleton.names)}
    apart = [np.abs(found[name] - wanted[:, joint]).max() for joint, name in enumerate(SMPL22.names)]
    assert max(apart) < 0.02
    glb = load(tab.save("glb", tmp_path))
    same = [glb.positions()[:, glb.skeleton.index(name)] - found[name] for name in SMPL22.names]
    assert np.abs(same).max() < 1e-3

    tab.page.wait_for_selector("body[data-offline=true]")
    tab.page.context.set_offline(True)
    tab.page.reload()
    tab.drawn()
    assert tab.threads == tab.page.evaluate("Math.min(navigator.hardwareConcurrency, 4)")
    again = load(tab.save("bvh", tmp_path))
    assert np.abs(again.positions() - first.positions()).max() < 1e-3
    assert tab.alert() == ""
    assert not tab.faults


@pytest.mark.parametrize(
    ("link", "says"),
    [
        ("v=2&seed=1&takes=1&s=1+walks", 'its version is "2", not 1'),
        ("v=1&seed=-1&takes=1&s=1+walks", 'seed is "-1"'),
        ("v=1&seed=1&takes=9&s=1+walks", 'takes is "9"'),
        ("v=1&seed=1&takes=1&s=99+walks", "a length is 99 s"),
        ("v=1&seed=1&takes=1", "it has 0 sentences"),
        ("v=%3Cimg+src=x+onerror=alert(1)%3E", 'its version is "<img'),
    ],
)
def test_a_bad_link_is_refused_in_a_sentence(tab: Tab, link: str, says: str):
    tab.page.goto(f"{tab.address}#{link}")
    tab.page.wait_for_selector("#notices [role=alert]")
    assert says in tab.alert()
    assert "ask for it again" in tab.alert()
    assert tab.page.locator("#notices img").count() == 0
    assert not tab.faults


def test_words_takes_and_what_comes_next_by_keyboard(tab: Tab):
    """Enter draws; the address says what was drawn; four takes can be seen one by one."""
    tab.open((0.5, "a person waves"), takes=4)
    tab.drawn()
    tab.button("3").focus()
    tab.page.keyboard.press("Enter")
    assert tab.button("3").get_attribute("aria-pressed") == "true"
    tab.button("one").click()
    tab.button("+ what comes next").focus()
    tab.page.keyboard.press("Enter")
    assert tab.page.evaluate("document.activeElement.getAttribute('aria-label')") == "Sentence 2"
    tab.button("Draw").click()
    assert "A sentence is empty" in tab.alert()
    tab.page.get_by_label("Sentence 2").fill("a person jumps")
    tab.page.get_by_label("Seconds").nth(1).fill("2")
    tab.page.get_by_label("Seconds").nth(1).press("Tab")
    tab.page.get_by_label("Sentence 2").press("Enter")
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    assert "s=2+a+person+waves&s=2+a+person+jumps" in tab.page.url
    assert "4.0 s" in tab.page.locator("#player").inner_text()
    assert not tab.faults


def test_other_weights_are_told(tab: Tab):
    """A link that names weights which are not those of the page draws, and says so."""
    tab.open((0.5, "a person waves"), w="0123456789ab")
    tab.drawn()
    assert "made with other weights" in tab.alert()


def test_a_phone_shows_all_of_it(tab: Tab):
    tab.page.set_viewport_size({"width": 390, "height": 780})
    tab.open((0.5, "a person waves"))
    tab.drawn()
    assert tab.page.evaluate("document.documentElement.scrollWidth") <= 390
    for name in ("Draw", "BVH", "GLB", "Pause"):
        box = tab.button(name).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
