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
