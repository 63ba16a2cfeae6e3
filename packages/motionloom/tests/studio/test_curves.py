"""How high a joint is and how fast, over time."""

import re

import numpy as np

from tests.studio.studio import Studio

RIGHT_WRIST, LEFT_WRIST = 21, 20


def shown(studio: Studio) -> tuple[str, float, float]:
    """The joint, its metres over the floor and its metres per second at the playhead."""
    found = re.fullmatch(r"(.*): ([\d.]+) m high, ([\d.]+) m/s", studio.page.locator(".curves button").inner_text())
    assert found is not None
    return found[1], float(found[2]), float(found[3])


def test_the_curves_of_a_joint_are_those_of_the_motion(studio: Studio):
    motion = studio.motion()[0]
    speed = np.linalg.norm(motion[2:] - motion[:-2], axis=-1) * 10  # of frame 1 and on
    studio.key("Home", "Shift+C")
    for seconds in (1, 2):
        studio.key("Shift+ArrowRight") if seconds == 1 else studio.key("ArrowLeft", "ArrowLeft")
        frame = 20 if seconds == 1 else 18
        name, high, fast = shown(studio)
        assert name == "right wrist"
        assert abs(high - motion[frame, RIGHT_WRIST, 1]) < 0.006
        assert abs(fast - speed[frame - 1, RIGHT_WRIST]) < 0.006
    points = studio.page.locator(".curves polyline.height").get_attribute("points")
    assert len(str(points).split()) == len(motion)
    studio.page.locator(".curves button").click()
    name, high, _ = shown(studio)
    assert name == "left wrist"
    assert abs(high - motion[18, LEFT_WRIST, 1]) < 0.006
    x, y = studio.middle(".curves polyline.height")
    studio.page.mouse.click(x, y)
    assert abs(shown(studio)[1] - motion[19:22, LEFT_WRIST, 1].mean()) < 0.03
    studio.key("Shift+C")
    assert studio.page.locator(".curves").count() == 0
    assert studio.faults == []


def test_a_stretch_is_smoothed_and_the_rest_stays(studio: Studio):
    studio.open(("a person is doing jumping jacks", 4.0))
    before = studio.motion()[0]
    studio.key("Home", "Shift+ArrowRight", "Shift+N")
    project = studio.project()
    [track] = project["people"][0]["tracks"]
    assert (track["part"], track["smooth"], track["from"], track["until"]) == ("body", 0.3, 1.0, 3.0)
    after = studio.motion(project)[0]
    assert np.abs(np.delete(after - before, slice(20, 60), axis=0)).max() < 1e-4
    bend = [np.abs(np.diff(one[24:56, RIGHT_WRIST], 2, axis=0)).mean() for one in (after, before)]
    assert bend[0] < 0.8 * bend[1]
    studio.page.locator("#inspector select[aria-label='Which part']").select_option("left_arm")
    arm = studio.motion()[0]
    assert np.abs(arm[:, RIGHT_WRIST] - before[:, RIGHT_WRIST]).max() < 1e-4
    assert np.abs(arm[24:56, LEFT_WRIST] - before[24:56, LEFT_WRIST]).max() > 0.01
    studio.key("Control+z", "Control+z")
    assert np.abs(studio.motion()[0] - before).max() < 1e-4
    assert studio.faults == []
