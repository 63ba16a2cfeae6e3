"""What goes wrong is said where it happened; a timeline file comes in whole."""

from pathlib import Path

import yaml

from tests.studio.studio import NOTHING, Studio

GIVEN = """# motionloom duet --timeline both.yaml --person 2
seed: 7
guidance: 2.0
segments:
- text: "a person waves :: a person walks"
  seconds: 2.0
  transition: 0.5
- text: "a person claps :: a person claps"
  seconds: 2.0
path:
  path:
    points: [[1.0, 0.0], [1.0, 2.0]]
    times: [0.0, 4.0]
    facing: [0.0, 45.0]
  joints:
  - joint: right_wrist
    points: [{time: 1.0, position: [1.2, 1.4, 0.6]}, {time: 2.0, position: [1.2, 1.3, 1.2]}]
  - joint: head
    points: [{time: 3.0, position: [null, 1.5, null]}]
"""


def high(metres: float, time: float = 1.0) -> dict:
    position = [0.3, metres, 0.6]
    return {**NOTHING, "targets": [{"id": "t", "joint": 21, "time": time, "until": None, "position": position}]}


def test_a_timeline_file_comes_in_whole_and_goes_out_again(studio: Studio, tmp_path: Path):
    file = tmp_path / "both.yaml"
    file.write_text(GIVEN)
    studio.drop(file)
    studio.page.wait_for_selector(".content .track.other")
    project = studio.project()
    assert [one["path"] is not None for one in project["people"]] == [False, True]
    assert [(one["joint"], one["time"]) for one in project["people"][1]["targets"]] == [(21, 1), (21, 2)]
    studio.says(studio.page.locator("#inspector"), "Kept from the file: guidance, joints")
    out = studio.download("Alt+e").decode()
    assert out.startswith("# motionloom duet --timeline both.yaml --person 2\n")
    back, given = yaml.safe_load(out), yaml.safe_load(GIVEN)
    assert sorted(back["path"].pop("joints"), key=str) == sorted(given["path"].pop("joints"), key=str)
    assert back == given | {"seed": 7}


def test_a_target_that_is_out_of_reach_is_said_at_the_target(studio: Studio):
    studio.put({**studio.project(), "people": [high(3.4)], "drawn": ""})
    studio.load()
    said = studio.page.locator(".track.joints .said")
    studio.says(said, "right wrist")
    studio.says(said, "out of anybody's reach")
    assert studio.page.locator(".key.unmet").count() == 1
    assert studio.page.locator("#inspector p.unmet").count() == 1
    assert studio.page.locator(".notice").count() == 0
    box = said.bounding_box()
    assert box["x"] >= 0
    assert box["y"] + box["height"] <= 720
    said.get_by_label("Close").click()
    assert studio.page.locator(".said").count() == 0


def test_a_block_that_asks_for_too_much_is_said_at_the_block(studio: Studio):
    first, second = studio.project()["segments"][0], {"guidance": 1e6}
    blocks = [first, {**first, "id": "other", "given": second}]
    studio.put({**studio.project(), "segments": blocks, "drawn": ""})
    studio.load()
    studio.says(studio.page.locator(".track.words .said"), "'guidance' must be")
    assert studio.page.locator(".block.wrong").get_attribute("data-id") == "other"


def test_a_target_too_high_for_a_standing_person_is_red_with_its_centimetres(studio: Studio):
    studio.put({**studio.project(), "people": [high(2.9)], "drawn": ""})
    studio.load()
    [miss] = studio.page.locator("#inspector .miss.unmet").all_inner_texts()
    assert 30 < float(miss.split()[0]) < 120
    ankles = studio.motion()[0][:, [7, 8], 1].min(axis=1)
    assert ankles.max() - ankles.min() < 0.15, "nobody who walks leaves the floor for it"
    assert studio.page.locator(".key.unmet").count() == 1
