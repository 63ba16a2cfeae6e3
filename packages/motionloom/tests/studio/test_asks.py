"""Paths, targets and poses, made on the stage."""

import numpy as np

from tests.studio.studio import Studio

RIGHT_WRIST = 21


def test_a_path_drawn_by_hand_is_walked(studio: Studio):
    studio.open(("a person walks", 4))
    studio.key("x", "p")
    x, y = studio.middle("#canvas")
    studio.drag((x, y), (x + 60, y - 30), (x + 140, y - 30), (x + 200, y - 60))
    project = studio.project()
    path = project["people"][0]["path"]
    assert len(path["points"]) >= 2
    pelvis = studio.motion(project)[0, :, 0][:, [0, 2]]
    ends = np.array([[path["points"][n]["x"], path["points"][n]["z"]] for n in (0, -1)])
    assert np.linalg.norm(pelvis[0] - ends[0]) < 0.15
    assert np.linalg.norm(pelvis[-1] - ends[1]) < 0.35
    studio.says(studio.page.locator("#inspector"), "Off the path")


def test_points_are_clicked_dragged_and_put_by_keys(studio: Studio):
    studio.key("p", "ArrowUp", "ArrowUp", "Enter")
    points = studio.project()["people"][0]["path"]["points"]
    assert len(points) == 2
    assert abs(points[1]["z"] - points[0]["z"] - 1.0) < 0.02
    studio.key("ArrowLeft", "Enter", "Control+z")
    assert len(studio.project()["people"][0]["path"]["points"]) == 2


def test_a_hand_goes_where_its_target_is(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "t")
    for _ in range(6):
        studio.key("PageUp")
    studio.says(studio.page.locator("#inspector .miss").first, "0.0 cm")
    project = studio.project()
    [target] = project["people"][0]["targets"]
    assert target["joint"] == RIGHT_WRIST
    assert target["time"] == 1.0
    wrist = studio.motion(project)[0, 20, RIGHT_WRIST]
    assert np.linalg.norm(wrist - target["position"]) < 0.05


def test_targets_that_no_body_can_meet_are_red(studio: Studio):
    targets = [
        {"id": str(joint), "joint": joint, "time": 1.0, "until": None, "position": [x, 1.2, 0.2]}
        for joint, x in ((RIGHT_WRIST, -1.5), (RIGHT_WRIST - 1, 1.5))
    ]
    studio.put({**studio.project(), "people": [{"path": None, "targets": targets, "poses": []}], "drawn": ""})
    studio.load()
    assert studio.page.locator(".key.unmet").count() == 2
    assert studio.page.locator("#inspector .miss.unmet").count() == 2


def test_the_gizmo_is_dragged_and_the_pose_it_asks_for_is_shown(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "t")
    before = studio.picture()
    studio.key("PageUp", "PageUp")
    assert (np.abs(studio.picture() - before).max(axis=-1) > 30).sum() > 50
    studio.key("Control+z")
    assert studio.project()["people"][0]["targets"] == []


def test_a_pose_at_hand_is_kept_and_comes_again(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "o")
    asked = np.array(studio.project()["people"][0]["poses"][0]["positions"])
    studio.key("r")
    again = studio.motion()[0, 20]
    assert np.linalg.norm(again - asked, axis=-1).mean() < 0.05
