"""Captions and what a table makes of them; and the table of the shipped prior beside the captions that it is for."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from motionloom_train.data.actions import action_of
from motionloom_train.data.build import build
from motionloom_train.data.corrections import OPEN, Corrections, read_corrections
from motionloom_train.data.sets import read_clips
from motionloom_train.data.words import MAX_CAPTION, mirror_text
from tests.shared import shared
from tests_train.data import people as recordings

SHIPPED = Path(__file__).parents[4] / "recipes" / "shipped" / "captions.toml"
PACKS = ("data", "data_more", "data_third", "data_fourth")

TABLE = """
[words]
toon = "person"
wlaks = "walks"
[captions]
"a man acts" = "a man lifts both arms"
"a person drinks" = ["a person drinks", "a person lifts a hand to the mouth"]
"nothing" = ""
"it is a fine day ..." = "a person stands"
[clips.stroll]
"a man acts" = "a man strolls"
"""


@pytest.fixture
def table(tmp_path: Path) -> Corrections:
    path = tmp_path / "table.toml"
    path.write_text(TABLE)
    return read_corrections(path)


@pytest.mark.parametrize(
    ("caption", "becomes"),
    [
        ("the toon wlaks", ("the person walks",)),
        ("a cartoon is drawn", ("a cartoon is drawn",)),
        ("a man acts", ("a man lifts both arms",)),
        ("a  man\tacts", ("a man lifts both arms",)),
        ("a man acts well", ("a man acts well",)),
        ("a person drinks", ("a person drinks", "a person lifts a hand to the mouth")),
        ("nothing", ()),
        ("it is a fine day and birds sing", ("a person stands",)),
    ],
)
def test_a_caption_becomes_what_its_row_says(table: Corrections, caption: str, becomes: tuple[str, ...]) -> None:
    assert table.corrected("other", [caption]) == becomes


def test_a_row_of_the_clip_comes_first_and_equal_captions_are_one(table: Corrections) -> None:
    assert table.corrected("stroll", ["a man acts", "a man strolls"]) == ("a man strolls",)


@pytest.mark.parametrize(
    "text",
    [
        "[captions]\nx = 3",
        "[captions]\nx = ['']",
        "[captions]\nx = [['a']]",
        "[other]\nx = 'y'",
        "captions = 'x'",
        "[clips]\nx = 'y'",
        "[words]\nx = ''",
        "not toml",
        f"[captions]\nx = '{'y' * (MAX_CAPTION + 1)}'",
    ],
)
def test_what_is_no_table_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "table.toml"
    path.write_text(text)
    with pytest.raises(MotionloomError, match=r"table\.toml is no table of corrections"):
        read_corrections(path)


def test_a_build_learns_the_corrected_captions_and_their_mirror_images(tmp_path: Path) -> None:
    """Of three captions one is replaced, one misspelt, and one dropped; a stretch without captions has no note."""
    clips = {"go": (recordings.walker(), "train", ""), "come": (recordings.walker(0.9), "train", "")}
    captions = {"go": "the toon wlaks to the left", "come": "birds sing"}
    pack = recordings.write_pack(tmp_path / "pack", clips, captions)
    path = tmp_path / "table.toml"
    path.write_text('[words]\ntoon = "person"\nwlaks = "walks"\n[captions]\n"birds sing" = ""\n')
    build([pack], tmp_path / "set", workers=1, mixed=0, corrections=path, progress=lambda line: None)
    human = {c.name: [n.texts for n in c.notes if n.kind == "human"] for c in read_clips(tmp_path / "set")}
    assert human["go"] == [("the person walks to the left",)]
    assert human["Mgo"] == [("the person walks to the right",)]
    assert human["come"] == []


def captioned() -> Iterator[tuple[str, list[str]]]:
    """Clips of the four packs with the captions of each of their stretches."""
    for pack in PACKS:
        for line in (shared(pack) / "captions" / "cmu.jsonl").read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            yield row["clip"], [" ".join(text.split()) for text in row["captions"]]


def _fits(row: str, captions: set[str]) -> bool:
    if row.endswith(OPEN):
        return sum(text.startswith(row.removesuffix(OPEN)) for text in captions) == 1
    return row in captions


def test_every_row_of_the_shipped_table_is_for_a_caption_that_is_there() -> None:
    """A row that begins a caption fits exactly one; a row of a clip is for one of that clip's captions."""
    table, texts = read_corrections(SHIPPED), list(captioned())
    every = {text for _, captions in texts for text in captions}
    assert [row for row in table.captions if not _fits(row, every)] == []
    for clip, rows in table.clips.items():
        said = {text for name, captions in texts if name == clip for text in captions}
        assert [row for row in rows if not _fits(row, said)] == [], clip


def test_no_stretch_of_the_packs_loses_all_its_captions() -> None:
    table = read_corrections(SHIPPED)
    assert [clip for clip, captions in captioned() if captions and not table.corrected(clip, captions)] == []


def test_corrected_captions_speak_of_bodies() -> None:
    """Nothing is left of screens, viewers, drawings of people, and what only fans or relatives would know."""
    table = read_corrections(SHIPPED)
    beyond = r"\b(?:sim|toon|stick (?:figure|man|person)|camera|viewer|screen|video|fans|your son|hockey)\b"
    left = [t for clip, captions in captioned() for t in table.corrected(clip, captions) if re.search(beyond, t)]
    assert left == ["a person takes a photo with a camera"]


def test_correcting_twice_changes_nothing_more() -> None:
    table = read_corrections(SHIPPED)
    for clip, captions in captioned():
        once = table.corrected(clip, captions)
        again = tuple(dict.fromkeys(text for each in once for text in table.corrected("", [each])))
        assert set(once) <= set(again), clip


MISNAMED = {
    *("06_11", "38_01", "127_02", "127_20", "accad_Male2_Extended_2", "accad_Male2_E6_QuickRetreat"),
    "cat_soulslike_heavy_idle",
}
"""Clips whose captions named an action that they do not show: a spin, a turn, a ball game, a stop, a dance, a squat, a
stroke."""


def test_corrected_captions_name_the_actions_that_are_trained() -> None:
    """What is said of a body is still found by the patterns of actions: else the clip would hardly be drawn."""
    table = read_corrections(SHIPPED)
    lost = {
        clip
        for clip, captions in captioned()
        if action_of(captions, clip) and not action_of(table.corrected(clip, captions), clip)
    }
    assert lost <= MISNAMED


def test_a_corrected_caption_keeps_its_mirror_image() -> None:
    """Left and right change places and come back: no row writes a side that the mirror does not know."""
    table = read_corrections(SHIPPED)
    for new in (text for texts in table.captions.values() for text in texts):
        assert mirror_text(mirror_text(new)) == new
