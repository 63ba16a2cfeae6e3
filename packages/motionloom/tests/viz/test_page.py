"""The page that plays motions: what stands in it, whatever the names are; the browser's side is tests/studio."""

import base64
import json
import struct
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.cli.sampling import places as places_of
from motionloom.cli.skeletons import Target
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.io.character import load_character
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.io.gltf_read import load_glb
from motionloom.retarget import joints22, retarget
from motionloom.viz import page
from tests.io.rigged import Hero
from tests.viz.test_video import standing

TEMPLATE = """<!doctype html><html><head><title>motionloom</title></head><body>
<script type="application/json" id="motion"></script></body></html>"""
HOSTILE = [
    "</script><script>alert(1)</script>",
    "<!-- <script>",
    "]]>&lt;/title></title><img src=x onerror=alert(1)>",
    "half a pair \udc80 and \u2028 a line",
    '"; alert(1); "',
]


@pytest.fixture
def viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A stand-in for the viewer, which needs Node to be built."""
    place = tmp_path / "viewer.html"
    place.write_text(TEMPLATE)
    monkeypatch.setattr(page, "VIEWER", place)
    return place


class Reader(HTMLParser):
    """What a browser would find: elements by their names, the title and the JSON."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.texts: dict[str, str] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.texts[self.tags[-1]] = self.texts.get(self.tags[-1], "") + data

    @property
    def given(self) -> dict:
        return json.loads(self.texts["script"])


def places(given: dict, take: int, person: int) -> np.ndarray:
    """(frames, 22, 3) metres, read as `studio/src/viewer/data.ts` reads them."""
    found = given["takes"][take]["people"][person]
    planes = np.frombuffer(zlib.decompress(base64.b64decode(found["data"])), np.uint8).reshape(4, -1)
    whole = np.ascontiguousarray(planes.T).view("<i4").reshape(66, found["frames"]).T.cumsum(axis=0)
    result = whole.reshape(-1, 22, 3) * given["unit"]
    result[:, 1:] += result[:, :1]
    return result


@pytest.mark.usefixtures("viewer")
def test_a_page_holds_the_places_of_everybody(tmp_path: Path) -> None:
    walk, turn = standing(40, speed=1.2), standing(30, fps=30.0, turn=1.0)
    place = io.save([walk, turn], tmp_path / "two.html", captions=["a walk", "a turn"])
    given = Reader(place.read_text()).given
    assert [(one["name"], one["fps"]) for one in given["takes"]] == [("a walk", 20.0), ("a turn", 30.0)]
    for number, motion in enumerate((walk, turn)):
        assert np.abs(places(given, number, 0) - motion.positions()).max() < 0.0003
    together = Reader(io.save_scene([walk, turn], tmp_path / "scene.html", captions=["both"] * 2).read_text()).given
    [take] = together["takes"]
    assert (take["name"], [one["frames"] for one in take["people"]]) == ("both", [40, 40])
    assert np.abs(places(together, 0, 1)[2] - turn.positions()[3]).max() < 0.0003, "a tenth of a second in"
    assert np.abs(places(together, 0, 1)[30:] - turn.positions()[-1]).max() < 0.0003, "who ended before stays"


@pytest.mark.usefixtures("viewer")
@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text_whatever_stands_in_them(name: str, tmp_path: Path) -> None:
    text = io.save([standing()], tmp_path / "a.html", captions=[name]).read_text()
    found = Reader(text)
    assert found.tags == ["html", "head", "title", "body", "script"]
    assert found.given["takes"][0]["name"] == " ".join(name.split())
    shown = " ".join(name.split()).encode("utf-8", "replace").decode()
    assert found.texts["title"].strip() == shown or found.texts["title"].startswith(shown)


@pytest.mark.usefixtures("viewer")
def test_a_long_motion_is_thinned_and_stays_as_long() -> None:
    still = standing(18_000, fps=60.0, speed=1.0)
    turns = rotvec_to_quat(np.random.default_rng(0).normal(scale=0.3, size=(18_000, 22, 3)))
    motion = Motion(still.skeleton, 60.0, still.root, turns)
    with pytest.warns(UserWarning, match="one frame in .* is kept"):
        text = page.page([page.Take("long", [motion])])
    assert len(text.encode()) < page.MAX_BYTES
    [take] = Reader(text).given["takes"]
    assert take["people"][0]["frames"] / take["fps"] == pytest.approx(300.0, abs=0.2)


def test_without_the_viewer_it_is_said_and_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "VIEWER", tmp_path / "viewer.html")
    with pytest.raises(MotionloomError, match="make page"):
        io.save(standing(), tmp_path / "a.html")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("viewer")
def test_a_viewer_of_another_version_is_refused(viewer: Path) -> None:
    viewer.write_text("<title>motionloom</title>")
    with pytest.raises(MotionloomError, match="not the viewer of this version"):
        page.page([page.Take("", [standing()])])


@pytest.mark.usefixtures("viewer")
def test_view_writes_takes_with_everybody_in_each_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    io.save_scene([standing(20), standing(20, speed=1.0)], "both.glb")
    io.save(standing(20), "alone.bvh")
    assert main(["view", "both.glb", "alone.bvh", "--out", "page.html"]) == 0
    takes = Reader(Path("page.html").read_text()).given["takes"]
    assert [(one["name"], len(one["people"])) for one in takes] == [("both", 2), ("alone", 1)]


@pytest.mark.usefixtures("viewer")
def test_a_character_comes_with_its_motions(tmp_path: Path) -> None:
    hero = Hero(seed=4).write(tmp_path / "hero.glb")
    character = load_character(hero)
    moved = [retarget(standing(20, speed=speed), character.skeleton) for speed in (0.5, 1.0)]
    given = Reader(page.page([page.Take("both", moved)], character=character)).given
    data = zlib.decompress(base64.b64decode(given["character"]))
    (length,) = struct.unpack_from("<I", data, 12)
    assert len(json.loads(data[20 : 20 + length])["animations"]) == 2
    assert np.abs(places(given, 0, 1) - joints22(moved[1])).max() < 0.0003


@pytest.mark.usefixtures("viewer")
def test_a_characters_motion_takes_less_room(tmp_path: Path) -> None:
    """Its numbers are rounded: nothing that is seen moves by a millimetre."""
    character, still = load_character(Hero(seed=4).write(tmp_path / "hero.glb")), standing(200, speed=1.0)
    swing = np.random.default_rng(0).normal(scale=0.02, size=(200, 22, 3)).cumsum(axis=0)
    moved = retarget(Motion(still.skeleton, 20.0, still.root, rotvec_to_quat(swing)), character.skeleton)
    given = Reader(page.page([page.Take("", [moved])], character=character)).given
    shown = tmp_path / "shown.glb"
    shown.write_bytes(zlib.decompress(base64.b64decode(given["character"])))
    exact = character.save_clips([(moved, "motion 0")], tmp_path / "exact.glb", replace=True)
    assert len(given["character"]) < 0.75 * len(page._deflated(exact.read_bytes()))
    assert 0 < np.abs(load_glb(shown).positions() - load_glb(exact).positions()).max() < 0.001


@pytest.mark.usefixtures("viewer")
def test_a_characters_own_animations_take_no_room(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(scale=0.3, size=(2000, 22, 3))
    sizes = []
    for hero in (Hero(seed=4), Hero(seed=4).clip("sway", noise)):
        character = load_character(hero.write(tmp_path / "hero.glb"))
        moved = retarget(standing(20), character.skeleton)
        given = Reader(page.page([page.Take("", [moved])], character=character)).given
        shown = tmp_path / "shown.glb"
        shown.write_bytes(zlib.decompress(base64.b64decode(given["character"])))
        assert np.abs(io.load(shown).positions() - moved.positions()).max() < 1e-3
        corners = [read_surfaces(one)[0].points for one in (load_character(shown), character)]
        assert np.abs(corners[0] - corners[1]).max() < 1e-6
        sizes.append(len(given["character"]))
    assert sizes[1] < sizes[0] + 6000
    assert shown.stat().st_size > sizes[1] + 500_000


@pytest.mark.usefixtures("viewer")
def test_a_character_that_is_packed_is_refused(tmp_path: Path) -> None:
    hero = Hero()
    hero.json["extensionsRequired"] = hero.json["extensionsUsed"] = ["EXT_meshopt_compression"]
    character = load_character(hero.write(tmp_path / "hero.glb"))
    with pytest.raises(MotionloomError, match=r"cannot unpack EXT_meshopt_compression.*hero\.glb"):
        page.page([page.Take("", [retarget(standing(4), character.skeleton)])], character=character)


@pytest.mark.usefixtures("viewer")
def test_view_puts_motions_on_a_character(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    io.save(standing(20), "alone.bvh")
    Hero().write(tmp_path / "hero.glb")
    assert main(["view", "alone.bvh", "--skeleton", "hero.glb", "--out", "page.html"]) == 0
    assert Reader(Path("page.html").read_text()).given["character"]
    assert main(["view", "alone.bvh", "--skeleton", "hero.glb", "--out", "page.png"]) == 2
    assert "--skeleton is for a page" in capsys.readouterr().err


@pytest.mark.usefixtures("viewer")
def test_motions_that_are_made_together_become_one_page_on_the_character(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    character = load_character(Hero().write(tmp_path / "hero.glb"))
    hero = Target("hero.glb", character.skeleton, character=character)
    [files] = places_of([Path("page.html")], 2, hero)
    assert hero.save_all([hero.retarget(standing(8))] * 2, files, ["first", "second"]) == [Path("page.html")]
    given = Reader(Path("page.html").read_text()).given
    assert [take["name"] for take in given["takes"]] == ["first", "second"]
    assert given["character"]


@pytest.mark.usefixtures("viewer")
@pytest.mark.parametrize("count", [0, page.MAX_PEOPLE + 1])
def test_takes_of_nobody_or_a_crowd_are_refused(count: int) -> None:
    with pytest.raises(MotionloomError, match="takes of 1 to 8 people"):
        page.page([page.Take("", [standing(4)] * count)])
