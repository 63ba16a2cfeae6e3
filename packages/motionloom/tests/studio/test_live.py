"""Live mode: steered by keys and the floor, kept with one key."""

import numpy as np
import pytest

from tests.studio.studio import Studio


def done(studio: Studio, words: str) -> None:
    """Wait until this has been done for a second."""
    at = "Number.parseFloat(document.querySelector('#live small').textContent)"
    studio.until(f"/{words}/.test(document.querySelector('#live b').textContent)")
    begun = studio.page.evaluate(at)
    studio.until(f"{at} > {begun + 1.0}")


@pytest.mark.slow
def test_somebody_is_steered_live_and_all_of_it_is_kept(studio: Studio):
    page = studio.page
    before = studio.project()
    studio.key("j")
    studio.until("document.querySelector('#live small')?.textContent > '0.3'")
    page.keyboard.down("w")
    done(studio, "walk")
    page.keyboard.up("w")
    x, y = studio.middle("#canvas")
    page.mouse.click(x + 120, y + 120)
    studio.key("Enter")
    page.keyboard.type("a person jumps up")
    studio.key("Enter")
    done(studio, "jumps")
    studio.key("r")
    page.wait_for_selector("#live", state="hidden")
    studio.until("document.querySelector('#inspector .take small')?.textContent === 'live'")
    project = studio.project()
    words = [one["text"] for one in project["segments"]]
    assert any("walk" in one for one in words)
    assert "a person jumps up" in words
    motion = studio.motion(project)
    assert abs(motion.shape[1] / 20 - sum(one["seconds"] for one in project["segments"])) < 0.06
    assert np.linalg.norm(np.diff(motion[0], axis=0), axis=-1).max() < 0.6, "nobody jumps from place to place"
    studio.key("Control+z")
    assert studio.project()["segments"] == before["segments"]
    assert not studio.faults


PAD = """window.PAD = {axes: [0.1, -0.1], buttons: [{pressed: false}]};
navigator.getGamepads = () => [null, window.PAD]"""
"""A gamepad in the second slot, as browsers give it; its stick is not quite in the middle, as sticks are."""
AWAY, RIGHT = np.array([-2.5, -3.5]) / np.hypot(2.5, 3.5), np.array([3.5, -2.5]) / np.hypot(2.5, 3.5)
"""Where the camera looks when the page opens, and what is at the right of the picture: x and z."""


def shown(studio: Studio, seconds: float) -> None:
    """Wait until so many seconds more were shown."""
    at = "Number.parseFloat(document.querySelector('#live small').textContent)"
    studio.until(f"{at} > {studio.page.evaluate(at) + seconds}")


@pytest.mark.slow
def test_the_stick_of_a_gamepad_steers(studio: Studio):
    page = studio.page
    studio.load()  # the camera is where it begins
    page.evaluate(PAD)
    studio.key("j")
    studio.until("document.querySelector('#live small')?.textContent > '0.3'")
    shown(studio, 1.5)
    page.evaluate("PAD.axes = [0, -0.8]")
    done(studio, "walk")
    shown(studio, 3.0)
    page.evaluate("PAD.axes = [0.8, 0]")
    shown(studio, 6.0)  # a busy machine follows some seconds later
    page.evaluate("PAD.axes = [0, 0]")
    studio.key("r")
    studio.until("document.querySelector('#inspector .take small')?.textContent === 'live'")
    pelvis = studio.motion()[0][:, 0, [0, 2]]
    way = np.diff(pelvis, axis=0) * 20  # metres per second
    assert np.linalg.norm(way[:20], axis=-1).mean() < 0.4, "a stick that nobody holds steers nobody"
    along, across = way @ AWAY, way @ RIGHT
    assert pelvis.shape[0] > 160
    fastest = int(np.convolve(along, np.ones(20), "valid").argmax())
    assert along[fastest : fastest + 20].mean() > 0.6, "away from the camera"
    assert across[-20:].mean() > 0.6, "and then to the right of the picture"
    assert across[-20:].mean() > 3 * abs(along[-20:].mean())
    assert not studio.faults


@pytest.mark.slow
def test_a_server_that_has_no_live_mode_is_said_on_the_page(studio: Studio):
    studio.page.evaluate(
        """() => {
            const plain = WebSocket;
            window.WebSocket = class extends plain { constructor(place) { super(place.replace('/live', '/none')) } };
        }"""
    )
    studio.key("j")
    studio.until("document.querySelector('#live p.unmet')?.textContent.includes('does not answer')")
    studio.key("Escape")
    studio.page.wait_for_selector("#live", state="hidden")
