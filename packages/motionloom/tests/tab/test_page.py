"""The page that needs no server, in a browser."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import numpy as np
import pytest

from motionloom import load
from motionloom.core.models.prior import Prior
from motionloom.core.skeleton import SMPL22
from motionloom.io.glb import pack_glb
from motionloom.kinematics.counts import foot_moves
from motionloom.tasks.text import sample_features, to_motion
from tests.tab import made
from tests.tab.tab import Tab

pytestmark = pytest.mark.slow


def unpacked(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The content and the binary part of a GLB."""
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length]), data[28 + length :]


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


@pytest.fixture
def graphics(browser, address: str) -> Iterator[Tab]:
    """A tab where processors imitate WebGPU, which the page takes only where its address says so."""
    context = browser.new_context(accept_downloads=True, service_workers="block")
    yield Tab(context.new_page(), address)
    context.close()


def test_a_graphics_processor_draws_the_same(graphics: Tab, prior: Prior, tmp_path: Path):
    graphics.open((0.5, "a person kicks"), seed=3)
    graphics.drawn()
    assert graphics.page.evaluate("document.body.dataset.graphics") == "false"
    assert not any(".jspi-" in url for url in graphics.asked)
    plain = load(graphics.save("bvh", tmp_path))
    graphics.address += "?webgpu=software"
    graphics.open((0.5, "a person kicks"), seed=3)
    graphics.drawn()
    assert graphics.page.evaluate("document.body.dataset.graphics") == "true"
    assert np.abs(load(graphics.save("bvh", tmp_path)).positions() - plain.positions()).max() < 1e-3
    assert not graphics.faults


def test_where_a_graphics_processor_fails_the_processors_draw(graphics: Tab):
    """What it would need cannot be loaded: the page says so, and draws."""
    graphics.page.route("**/*.jspi-*.wasm", lambda route: route.abort())
    graphics.address += "?webgpu=software"
    graphics.open((0.5, "a person kicks"), seed=3)
    graphics.drawn()
    assert graphics.page.evaluate("document.body.dataset.graphics") == "false"
    assert "The graphics processor fails" in graphics.page.locator("#asked").inner_text()


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


def test_a_link_is_the_same_motion_elsewhere(tab: Tab, browser, address: str, tmp_path: Path):
    """Two sentences along a path, opened by somebody whose browser keeps nothing of it."""
    tab.open((2, "a person walks & waves #1"), (2, "100 % jumping"), seed=2**40 - 1, p="1,1 1,2.5 2,3.25")
    tab.drawn()
    first, link = load(tab.save("bvh", tmp_path)), tab.page.url
    assert re.search(r"[&#]w=[0-9a-f]{12}(&|$)", link)
    context = browser.new_context(accept_downloads=True)
    other = Tab(context.new_page(), address)
    other.page.goto(link)
    other.drawn()
    assert other.alert() == ""
    again = load(other.save("bvh", tmp_path))
    assert np.abs(again.positions() - first.positions()).max() < 0.02
    assert np.abs(first.root[0, [0, 2]] - 1.0).max() < 0.05
    context.close()


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
    for name in ("Draw", "Draw a path", "Own character", "BVH", "GLB", "VRMA", "Pause"):
        box = tab.button(name).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390


def test_a_path_is_drawn_by_pointer_and_followed(tab: Tab, tmp_path: Path):
    """A line on the floor becomes the way of the pelvis, and is in the address; without it the link is as before."""
    tab.open((2, "a person walks"), seed=5)
    tab.drawn()
    tab.button("Draw a path").click()
    box = tab.page.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.page.mouse.move(x, y + 80)
    tab.page.mouse.down()
    for step in range(1, 9):
        tab.page.mouse.move(x + 10 * step, y + 80 - 14 * step)
    tab.page.mouse.up()
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    [said] = parse_qs(tab.page.url.partition("#")[2])["p"]
    points = np.array([[float(x) for x in point.split(",")] for point in said.split()])
    walked = load(tab.save("bvh", tmp_path)).positions()[:, 0, [0, 2]]
    assert np.abs(walked[[0, -1]] - points[[0, -1]]).max() < 0.03
    tab.page.get_by_title("Remove the path").click()
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    assert "p=" not in tab.page.url
    assert tab.alert() == ""
    assert not tab.faults


def test_all_of_it_by_keyboard(tab: Tab, tmp_path: Path):
    """Words, a path by arrow keys, playback and a file, without a pointer."""
    tab.open((2, "a person walks"), seed=5)
    tab.drawn()
    keyboard = tab.page.keyboard
    for _ in range(60):
        if tab.page.evaluate("document.activeElement.innerText") == "Draw a path":
            break
        keyboard.press("Tab")
    keyboard.press("Enter")
    for key in ("Enter", "ArrowUp", "ArrowUp", "ArrowUp", "Enter", "ArrowUp", "ArrowUp", "ArrowLeft", "Enter", "Enter"):
        keyboard.press(key)
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    assert "p=0%2C0+0%2C0.75+0.25%2C1.25" in tab.page.url
    before = tab.page.evaluate("document.activeElement.id")
    assert before == "canvas"
    keyboard.press("Space")
    assert tab.button("Play").count() == 1
    tab.button("BVH").focus()
    with tab.page.expect_download() as file:
        keyboard.press("Enter")
    file.value.save_as(tmp_path / "walk.bvh")
    walked = load(tmp_path / "walk.bvh").positions()[:, 0, [0, 2]]
    assert np.abs(walked[-1] - [0.25, 1.25]).max() < 0.03
    assert not tab.faults


def test_an_own_character_moves_and_is_saved(tab: Tab, tmp_path: Path):
    """The figure that the page itself saves, larger and turned, as somebody's own: it goes the same way."""
    tab.open((1, "a person waves"), seed=2)
    tab.drawn()
    plain = load(tab.save("bvh", tmp_path))
    figure = tab.save("glb", tmp_path)
    own = tmp_path / "figure.glb"
    content, binary = unpacked(figure.read_bytes())
    top = content["scenes"][0]["nodes"]
    content["nodes"].append({"name": "all", "scale": [1.2, 1.2, 1.2], "rotation": [0, 1, 0, 0], "children": top})
    content["scenes"][0]["nodes"] = [len(content["nodes"]) - 1]
    own.write_bytes(pack_glb(content, binary))
    with tab.page.expect_file_chooser() as chooser:
        tab.button("Own character").click()
    chooser.value.set_files(own)
    tab.page.wait_for_selector("#canvas[data-character=figure]")
    moved = load(tab.save("glb", tmp_path))
    pairs = [(plain.skeleton.index(name), moved.skeleton.index(name)) for name in SMPL22.names]
    apart = [moved.positions()[:, b] - 1.2 * plain.positions()[:, a] for a, b in pairs]
    assert np.abs(apart).max() < 0.02
    assert played(tab, "On figure", tmp_path)["character"]
    assert tab.alert() == ""
    tab.button("remove").click()
    assert tab.page.locator("#canvas[data-character]").count() == 0
    assert not tab.faults


def played(tab: Tab, button: str, folder: Path) -> dict[str, Any]:
    """What stands in the page that is shared, which plays without a network and asks for nothing."""
    with tab.page.expect_download() as file:
        tab.button(button).click()
    place = folder / "shared" / file.value.suggested_filename
    file.value.save_as(place)
    assert place.stat().st_size < 1_500_000
    alone = tab.page.context.browser.new_context(offline=True)
    other = Tab(alone.new_page(), place.as_uri())
    other.page.goto(other.address)
    other.page.wait_for_selector("body[data-ready=true]")
    assert other.page.locator("[role=alert]").count() == 0
    assert all(url.startswith(("file:", "blob:", "data:")) for url in other.asked)
    assert not other.faults
    found = json.loads(other.page.locator("#motion").inner_text())
    alone.close()
    return found


def test_a_motion_is_shared_as_a_page(tab: Tab, tmp_path: Path):
    """One file, small, whose name and words are those of the sentences, whatever letters they have."""
    tab.open((2, "a person walks </script><b>"), (2, "jumps & waves"), seed=3)
    tab.drawn()
    found = played(tab, "Share", tmp_path)
    assert found["character"] is None
    assert [take["name"] for take in found["takes"]] == ["a person walks </script><b>, jumps & waves"]
    assert found["takes"][0]["people"][0]["frames"] == 80
    assert tab.alert() == ""
    assert not tab.faults


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("chair.glb", b"solid chair", "chair.glb cannot be used: it is no binary glTF; drop a GLB or VRM file."),
        ("cut.vrm", b"glTF\2\0\0\0\0\1\0\0\xff\0\0\0JSON{}", "cut.vrm cannot be used: its end is missing"),
    ],
)
def test_a_dropped_file_that_is_no_character_is_refused(tab: Tab, name: str, content: bytes, says: str):
    """In a sentence, and all else stays as it was."""
    tab.open((0.5, "a person waves"))
    tab.drawn()
    tab.page.evaluate(
        """([name, bytes]) => {
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
            document.body.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
        }""",
        [name, list(content)],
    )
    tab.page.wait_for_selector("#notices [role=alert]")
    assert says in tab.alert()
    assert tab.button("BVH").count() == 1
    assert not tab.faults


def test_a_vrm_animation_holds_the_motion(tab: Tab, tmp_path: Path):
    tab.open((1, "a person kicks"), seed=1)
    tab.drawn()
    plain, found = load(tab.save("bvh", tmp_path)), load(tab.save("vrma", tmp_path))
    pairs = [(plain.skeleton.index(name), found.skeleton.index(name)) for name in SMPL22.names]
    assert max(np.abs(found.positions()[:, b] - plain.positions()[:, a]).max() for a, b in pairs) < 1e-3


def test_a_draw_can_be_stopped(tab: Tab):
    """What was there before is there again, and the next draw is whole; a preview comes after a third of the calls."""
    tab.open((0.5, "a person waves"), seed=1)
    tab.drawn()
    tab.page.get_by_label("Seconds", exact=True).fill("10")
    tab.page.get_by_label("Seconds", exact=True).press("Tab")
    tab.button("Draw").click()
    tab.page.wait_for_selector("body[data-shown=preview]")
    assert "10.0 s" in tab.page.locator("#player").inner_text()
    tab.button("Stop").click()
    tab.page.wait_for_selector("body[data-state=drawn]")
    assert "0.5 s" in tab.page.locator("#player").inner_text()
    assert tab.page.locator("#says").inner_text() == "stopped"
    tab.page.get_by_label("Seconds", exact=True).fill("1")
    tab.page.get_by_label("Seconds", exact=True).press("Tab")
    tab.button("Draw").click()
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    assert "1.0 s" in tab.page.locator("#player").inner_text()
    assert not tab.faults


def test_a_second_tab_draws_beside_the_first(tab: Tab, context, address: str):
    """It has the weights from the browser's store, and leaves the first one alone."""
    tab.open((0.5, "a person waves"), seed=1)
    tab.drawn()
    other = Tab(context.new_page(), address)
    other.open((0.5, "a person jumps"), seed=2)
    other.drawn()
    assert "jumps" in other.page.url
    assert "waves" in tab.page.url
    assert not other.faults
    assert not tab.faults
    other.page.close()


def test_numbers_in_the_words_are_kept(tab: Tab, tmp_path: Path):
    """The way is as long as the words say, and the field follows; what is not read is left to the network."""
    tab.open((4.05, "a person walks 3 meters forward"), n=1)
    tab.drawn()
    walked = load(tab.save("bvh", tmp_path)).positions()[:, 0, [0, 2]]
    assert abs(np.linalg.norm(walked[-1] - walked[0]) - 3) < 0.05
    shown = tab.page.locator("#asked")
    assert "Read as: 3 m forward, 4.05 s" in shown.inner_text()
    tab.button("as numbers").click()
    assert tab.button("as numbers").get_attribute("aria-pressed") == "false"
    tab.button("Draw").click()
    tab.page.wait_for_selector("body[data-state=busy]")
    tab.drawn()
    assert "n=1" not in tab.page.url
    tab.button("as numbers").click()
    tab.page.get_by_label("Sentence 1").fill("turn left 90 degrees")
    assert tab.page.get_by_label("Seconds", exact=True).input_value() == "2.5"
    tab.page.get_by_label("Sentence 1").fill("walks 3 meters, then waves")
    assert '"3 meters" is left to the network' in shown.inner_text()
    assert not tab.faults


def test_steps_are_made_again_until_they_are_as_many(tab: Tab, tmp_path: Path):
    """The first motion of this seed has one."""
    tab.open((2.8, "a person takes three steps to the left"), seed=1, n=1)
    tab.drawn()
    assert "This take:" not in tab.page.locator("#asked").inner_text()
    walked = load(tab.save("bvh", tmp_path))
    places = walked.positions()[:, [walked.skeleton.index(name) for name in SMPL22.names]]
    assert foot_moves(places, 20.0)[0] == 3
    assert not tab.faults
