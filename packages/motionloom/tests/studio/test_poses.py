"""Poses that are made by hand: joints dragged together, mirrored, copied to another time, and filled in between."""

import numpy as np

from tests.studio.studio import Studio

LEFT_WRIST, RIGHT_WRIST, LEFT_ANKLE, RIGHT_ANKLE, PELVIS = 20, 21, 7, 8, 0


def poses(studio: Studio) -> list[dict]:
    """In time, the places of each as an array."""
    found = studio.project()["people"][0]["poses"]
    return sorted([{**one, "positions": np.array(one["positions"])} for one in found], key=lambda one: one["time"])


def test_joints_of_a_pose_are_dragged_together_and_others_stay(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "t", "o")
    [before] = poses(studio)
    studio.key("PageUp", "PageUp", "ArrowUp")
    [raised] = poses(studio)
    assert studio.project()["people"][0]["targets"] == []
    way = raised["positions"] - before["positions"]
    assert np.abs(way[RIGHT_WRIST] - [0, 0.1, 0.05]).max() < 0.01
    assert np.abs(way[[PELVIS, LEFT_WRIST]]).max() < 0.01
    studio.key("Control+z")
    assert np.array_equal(poses(studio)[0]["positions"], before["positions"])

    x, y = studio.at("gizmo")
    studio.drag((x, y), (x + 30, y - 30))
    dragged = poses(studio)[0]["positions"] - before["positions"]
    assert np.linalg.norm(dragged[RIGHT_WRIST]) > 0.03
    made = studio.motion()[0, 20]
    assert np.linalg.norm(made - poses(studio)[0]["positions"], axis=-1).mean() < 0.05


def test_pinned_feet_stay_while_the_hips_go_down(studio: Studio):
    studio.key("Home", "Shift+ArrowRight", "t", "o")
    [before] = poses(studio)
    choose(studio, RIGHT_ANKLE)
    choose(studio, LEFT_ANKLE, more=True)
    studio.key("Alt+p")
    choose(studio, PELVIS)
    studio.key("PageDown", "PageDown")
    [after] = poses(studio)
    way = after["positions"] - before["positions"]
    assert np.abs(way[PELVIS] - [0, -0.1, 0]).max() < 0.01
    assert np.abs(way[[LEFT_ANKLE, RIGHT_ANKLE]]).max() < 0.01
    choose(studio, RIGHT_WRIST)
    choose(studio, LEFT_WRIST, more=True)
    studio.key("PageUp")
    [both] = poses(studio)
    assert np.abs((both["positions"] - after["positions"])[[LEFT_WRIST, RIGHT_WRIST], 1] - 0.05).max() < 0.01


def test_a_pose_is_mirrored_copied_and_filled_in_between(studio: Studio):
    studio.open(("a person stands still", 3.0))
    studio.key("Home", "t", "o", "PageUp", "PageUp", "PageUp", "PageUp")
    [first] = poses(studio)
    studio.key("Alt+m")
    [mirrored] = poses(studio)
    height = first["positions"][:, 1]
    assert abs(mirrored["positions"][LEFT_WRIST, 1] - height[RIGHT_WRIST]) < 0.002
    assert abs(mirrored["positions"][RIGHT_WRIST, 1] - height[LEFT_WRIST]) < 0.002
    studio.key("Alt+c", "t", "Shift+ArrowRight", "Shift+ArrowRight", "Alt+v")
    both = poses(studio)
    assert [one["time"] for one in both] == [0.0, 2.0]
    assert np.abs(both[1]["positions"][:, 1] - both[0]["positions"][:, 1]).max() < 0.002
    studio.page.locator("#inspector .list .row").filter(has_text="pose at hand").click()
    studio.page.get_by_label("Poses to the next one").fill("3")
    studio.key("Enter")
    assert [one["time"] for one in poses(studio)] == [0.0, 0.5, 1.0, 1.5, 2.0]
    studio.key("Control+z")
    assert len(poses(studio)) == 2
    studio.load()
    assert len(poses(studio)) == 2
    assert studio.faults == []


def choose(studio: Studio, joint: int, *, more: bool = False) -> None:
    """Click a joint of the pose at hand, where it is on the screen."""
    x, y = studio.at(f"joint-{joint}")
    if more:
        studio.page.keyboard.down("Shift")
    studio.page.mouse.click(x, y)
    if more:
        studio.page.keyboard.up("Shift")
