"""Parts of the body that do something else than the blocks say."""

import json

import numpy as np

from tests.studio.studio import Studio

LEGS = [0, 1, 2, 4, 5, 7, 8, 10, 11]
HEAD, SHOULDER, WRIST = 15, 17, 21


def wrist_over_shoulder(motion: np.ndarray) -> np.ndarray:
    """(frames,) metres of the first person's right hand."""
    return motion[0, :, WRIST, 1] - motion[0, :, SHOULDER, 1]


def test_an_arm_waves_by_words_of_its_own_while_the_legs_walk(studio: Studio):
    studio.open(("a person walks forward", 4.0))
    before = studio.project()
    walk = studio.motion(before)
    assert wrist_over_shoulder(walk).max() < 0
    studio.key("Home", "Shift+ArrowRight", "Shift+A")
    studio.page.keyboard.type("waves with the right hand")
    studio.key("Enter")
    project = studio.project()
    [track] = project["people"][0]["tracks"]
    assert (track["part"], track["from"], track["until"]) == ("right_arm", 1.0, 3.0)
    waving = studio.motion(project)
    assert wrist_over_shoulder(waving)[25:55].max() > 0
    assert np.abs(waving[0, :, LEGS] - walk[0, :, LEGS]).max() < 1e-4
    assert np.abs(waving[0, :20] - walk[0, :20]).max() < 1e-4
    assert studio.page.locator(".own:not(.old)").count() == 1

    studio.key("Control+z", "Control+z")
    assert np.abs(studio.motion() - walk).max() < 1e-4
    studio.key("Control+Shift+z", "Control+Shift+z")
    studio.drawn()
    studio.load()
    assert np.abs(studio.motion() - waving).max() < 1e-4
    assert studio.faults == []


def test_a_stretch_is_dragged_chosen_and_deleted(studio: Studio):
    studio.open(("a person walks forward", 4.0))
    studio.key("Home", "Shift+A")
    studio.page.keyboard.type("waves")
    studio.key("Escape")
    x, y = studio.middle(".own")
    studio.drag((x, y), (x + 84, y), hold="Alt")
    [track] = studio.project()["people"][0]["tracks"]
    assert abs(track["from"] - 1.0) < 0.1
    assert abs(track["until"] - 3.0) < 0.1
    studio.page.locator("#inspector select[aria-label='Which part']").select_option("arms")
    assert studio.project()["people"][0]["tracks"][0]["part"] == "arms"
    studio.page.locator(".own").click()
    studio.key("Delete")
    assert studio.project()["people"][0]["tracks"] == []


def test_what_is_frozen_takes_a_part_and_gives_it_back(studio: Studio):
    """Words over a motion of which everything stays, such as a clip: the rest of it keeps its frames."""
    studio.open(("a person walks forward", 3.0))
    walk = studio.motion()
    studio.key("ArrowDown", "z", "Escape", "Home", "Shift+A")
    studio.page.keyboard.type("waves with the right hand")
    studio.key("Enter")
    waving = studio.motion()
    assert np.abs(waving[0, :, LEGS] - walk[0, :, LEGS]).max() < 1e-4
    assert wrist_over_shoulder(waving).max() > 0
    studio.key("Delete")
    assert np.abs(studio.motion() - walk).max() < 1e-4


def test_a_head_looks_at_a_point_that_is_dragged(studio: Studio):
    studio.open(("a person stands still", 3.0))
    still = studio.motion()[0]
    studio.key("ArrowDown", "Shift+L")
    studio.says(studio.page.locator(".own:not(.old)"), "looks at a point")
    x, y = studio.at("gaze")
    studio.drag((x, y), (x + 40, y), (x + 90, y))
    project = studio.project()
    [track] = project["people"][0]["tracks"]
    assert (track["part"], track["from"], track["until"]) == ("head", 0.0, 3.0)
    [look] = [job["look"] for job in json.loads(project["drawn"]) if "look" in job]
    assert look == track["look"]
    made = studio.motion(project)[0]
    assert np.abs(made[:, LEGS] - still[:, LEGS]).max() < 1e-4
    assert np.linalg.norm(made[:, HEAD] - still[:, HEAD], axis=-1).mean() > 0.002
    inspector = studio.page.locator("#inspector")
    inspector.get_by_label("y, m").fill("0")
    inspector.get_by_label("y, m").press("Enter")
    lower = studio.project()
    assert lower["people"][0]["tracks"][0]["look"][1] == 0
    assert (studio.motion(lower)[0][:, HEAD, 1] < made[:, HEAD, 1]).mean() > 0.9, "looking down"


def test_two_people_look_at_each_other(studio: Studio):
    studio.open(("two people talk", 2.0), people=2)
    studio.key("ArrowDown", "Shift+L", "q", "ArrowDown", "Shift+L")
    project = studio.project()
    jobs = [job for job in json.loads(project["drawn"]) if job["task"] == "edit"]
    assert [(job["person"], job["look_at"]) for job in jobs] == [(0, 1), (1, 0)]
    assert studio.motion(project).shape[0] == 2


def test_an_arm_follows_a_clip_that_was_put_aside(studio: Studio):
    studio.open(("a person waves with the right hand", 2.0))
    waves = studio.motion()
    studio.key("w")
    studio.page.mouse.dblclick(*studio.middle(".track.words .block"))
    studio.page.keyboard.type("a person walks forward")
    studio.key("Enter")
    walk = studio.motion()
    studio.key("Escape", "Home", "Shift+A", "Escape")
    studio.page.locator("#inspector select[aria-label='What it follows']").select_option(index=1)
    project = studio.project()
    assert project["people"][0]["tracks"][0]["clip"]["motion"]
    made = studio.motion(project)
    assert np.abs(made[0, :, LEGS] - walk[0, :, LEGS]).max() < 1e-4
    raised = wrist_over_shoulder(made) - wrist_over_shoulder(waves)
    assert np.abs(raised).mean() < 0.2, "the arm does what it did in the clip, on another back"


def test_a_head_nods_by_words(studio: Studio):
    studio.open(("a person stands still", 3.0))
    still = studio.motion()[0]
    studio.key("ArrowDown", "Shift+A")
    studio.page.keyboard.type("nods")
    studio.key("Enter")
    studio.page.locator("#inspector select[aria-label='Which part']").select_option("head")
    project = studio.project()
    assert [job["prompt"] for job in json.loads(project["drawn"]) if "prompt" in job] == ["nods"]
    made = studio.motion(project)[0]
    assert np.abs(made[:, LEGS] - still[:, LEGS]).max() < 1e-4
    assert 0.005 < (still - made)[:, HEAD, 1].max() < 0.1, "the neck nods, too"
    studio.says(studio.page.locator(".own:not(.old)"), "nods")
