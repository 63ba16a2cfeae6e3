"""Handles of the stage, dragged by mouse."""

import numpy as np

from tests.studio.studio import NOTHING, Studio

RIGHT_WRIST, LEFT_WRIST = 21, 20
LINE = {"speed": None, "times": None, "points": [{"x": 0, "z": z, "stop": 0, "facing": None} for z in (0, 1.5)]}


def test_a_point_and_its_facing_are_dragged(studio: Studio):
    studio.open(("a person walks", 2), people=1)
    studio.put({**studio.project(), "people": [{**NOTHING, "path": LINE}], "drawn": ""})
    studio.load()
    studio.key("x", "p")
    x, y = studio.at("path-end")
    studio.drag((x, y), (x + 40, y), (x + 80, y))
    [_, end] = studio.project()["people"][0]["path"]["points"]
    assert abs(end["x"]) > 0.3
    assert abs(end["z"] - 1.5) < 0.3
    tip, (px, py) = studio.at("facing"), studio.at("path-end")
    studio.drag(tip, (px + 20, py + 20), (px + 40, py))
    project = studio.project()
    assert project["people"][0]["path"]["points"][1]["facing"] is not None
    assert np.linalg.norm(studio.motion(project)[0, -1, 0, [0, 2]] - [end["x"], end["z"]]) < 0.3
    studio.key("Control+z", "Control+z")
    assert studio.project()["people"][0]["path"]["points"] == LINE["points"]


def test_the_gizmo_is_pulled_up_and_the_wrist_follows(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "t")
    before = studio.motion()[0, 20]
    x, y = studio.at("gizmo")
    studio.page.mouse.move(x, y - 20)
    studio.drag((x, y - 27), (x, y - 60), (x, y - 90))
    project = studio.project()
    [target] = project["people"][0]["targets"]
    assert (target["joint"], target["time"]) == (RIGHT_WRIST, 1.0)
    up = np.array(target["position"]) - before[RIGHT_WRIST]
    assert up[1] > 0.2
    assert np.abs(up[[0, 2]]).max() < 0.02, "the arrow that points up moves nothing sideways"
    assert np.linalg.norm(studio.motion(project)[0, 20, RIGHT_WRIST] - target["position"]) < 0.05
