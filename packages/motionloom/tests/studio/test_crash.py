"""A server that is killed in the middle of a draw, and one that is asked without its token."""

import numpy as np
import pytest

from tests.studio.studio import Studio


@pytest.mark.slow
def test_a_killed_server_comes_back_and_nothing_is_lost(studio: Studio):
    page = studio.page
    studio.open(("a person walks", 2), ("a person waves", 4), ("a person runs", 4))
    before = studio.project()
    studio.key("g")
    studio.until("document.querySelector('progress').value > 0")
    studio.server.kill()
    page.wait_for_selector(".notice.away")
    studio.key("Control+z", "End")  # what is here can be worked on
    studio.key("d")
    studio.server.start()
    page.wait_for_selector(".notice.away", state="detached")
    project = studio.caught_up()
    assert len(project["segments"]) == 4
    assert [one["id"] for one in project["segments"][:3]] == [one["id"] for one in before["segments"]]
    motion = studio.motion(project)
    assert motion.shape[1] == 20 * sum(one["seconds"] for one in project["segments"])
    assert np.isfinite(motion).all()
    assert not studio.faults


def test_without_the_token_the_page_says_so(studio: Studio):
    studio.page.goto(studio.server.address)
    studio.says(studio.page.locator(".notice[role=alert]"), "token")
