"""Two people: an answer to a clip, the path of one, words of one that change."""

import numpy as np

from tests.studio.studio import NOTHING, Studio

LINE = {"speed": None, "times": None, "points": [{"x": x, "z": 0.8, "stop": 0, "facing": None} for x in (0.0, 1.2)]}


def test_one_of_two_walks_a_path_and_only_the_second_is_drawn_for_new_words(studio: Studio):
    studio.open(("two people greet each other", 2), people=2, seed=4)
    studio.put({**studio.project(), "people": [NOTHING, {**NOTHING, "path": LINE}], "drawn": ""})
    studio.load()
    project = studio.project()
    before = studio.motion(project)
    assert np.abs(before[1, -1, 0, [0, 2]] - [1.2, 0.8]).max() < 0.3
    studio.key("d")  # two blocks, of which the second changes
    assert studio.motion().shape[1] == 80
    box = studio.page.locator(".content .ruler").bounding_box()
    studio.drag((box["x"] + 2, box["y"] + 12), (box["x"] + 2 * 84, box["y"] + 12), hold="Shift")
    studio.key("z")
    both = studio.motion()
    studio.page.mouse.dblclick(*studio.middle(".track.other .block", 1))
    studio.page.keyboard.type("a person jumps")
    studio.key("Enter")
    after = studio.motion()
    assert np.abs(after[0] - both[0]).max() < 1e-3, "the first person was not drawn"
    assert np.abs(after[1, 50:] - both[1, 50:]).max() > 0.05


def test_a_second_person_answers_a_clip(studio: Studio):
    studio.key("w")
    alone = studio.motion()
    studio.page.locator(".clip select").select_option(label="Answer it with a second person")
    motion = studio.motion()
    assert motion.shape[0] == 2
    assert np.abs(motion[0] - alone[0]).max() < 1e-3
    apart = np.linalg.norm(motion[1, :, 0] - motion[0, :, 0], axis=-1)
    assert apart.mean() > 0.3, apart.mean()  # somebody else, somewhere else


def test_where_hands_meet_is_dragged_for_both_people(studio: Studio):
    page = studio.page
    studio.open(("two people shake hands", 4.0), people=2, seed=4)
    page.wait_for_selector("#canvas[data-meetings]:not([data-meetings='0'])")
    studio.key("Shift+T")
    x, y = studio.at("meeting")
    studio.drag((x, y), (x + 6, y - 30))
    project = studio.project()
    first, second = (person["targets"] for person in project["people"])
    assert (len(first), len(second)) == (1, 1)
    assert first[0]["time"] == second[0]["time"]
    assert all(person["path"] for person in project["people"]), "both go as they went"
    motion = studio.motion(project)
    frame = round(first[0]["time"] * 20) + 1
    wrists = [motion[who, frame, one[0]["joint"]] for who, one in enumerate((first, second))]
    off = [np.linalg.norm(wrist - one[0]["position"]) for wrist, one in zip(wrists, (first, second), strict=True)]
    assert max(off) < 0.05, off
    assert np.linalg.norm(wrists[0] - wrists[1]) < 0.12
    studio.key("PageUp")
    higher = studio.project()["people"]
    for now, one in zip(higher, (first, second), strict=True):
        assert abs(now["targets"][0]["position"][1] - one[0]["position"][1] - 0.05) < 0.002
    studio.key("Control+z", "Control+z")
    assert not any(person["targets"] for person in studio.project()["people"])
