"""Live mode: steered by keys and the floor, kept with one key."""

import numpy as np
import pytest

from tests.studio.studio import Studio


def done(studio: Studio, words: str) -> None:
    """Wait until this has been done for a second."""
    at = "Number.parseFloat(document.querySelector('#live small').textContent)"
    studio.page.wait_for_function(f"/{words}/.test(document.querySelector('#live b').textContent)")
    begun = studio.page.evaluate(at)
    studio.page.wait_for_function(f"{at} > {begun + 1.0}")


@pytest.mark.slow
def test_somebody_is_steered_live_and_all_of_it_is_kept(studio: Studio):
    page = studio.page
    before = studio.project()
    studio.key("j")
    page.wait_for_function("document.querySelector('#live small')?.textContent > '0.3'")
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
    page.wait_for_function("document.querySelector('#inspector .take small')?.textContent === 'live'")
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
