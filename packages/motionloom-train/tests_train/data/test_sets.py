"""What training is shown of a built set."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from motionloom.core.features import humanml as hml
from motionloom.core.reading import read_table
from motionloom_train.data.actions import ACTIONS
from motionloom_train.data.batches import Batches, _starts
from motionloom_train.data.clips import Clip, Note, write_clip
from motionloom_train.data.made import GESTURES
from motionloom_train.data.sets import Item, load_set, table
from motionloom_train.data.words import LABELS
from tests.kinematics import people


def kicking(folder: Path) -> Path:
    """A built set of one clip of ten seconds: a caption for all of it, and a kick from frame 100 to 150."""
    features = hml.encode(hml.canonical(people.walking(1.0, 10.0)), heading="corrected")
    notes = (
        Note(0, len(features), "human", ("a person walks and kicks",)),
        Note(0, len(features), "walk"),
        Note(100, 150, "kick"),
        Note(20, 70, "punch"),
    )
    (folder / "clips").mkdir(parents=True)
    write_clip(folder / "clips", Clip("one", "cmu", "free", "train", "plain", notes, features))
    (folder / "set.json").write_text("{}")
    return folder


def items_of(batches: Batches, window: int) -> list[Item]:
    """The items that windows of so many frames are taken from."""
    return [batches.data.items[number] for number in batches._pools[window][0].numbers]


def test_a_caption_that_names_an_event_is_shown_with_the_event(tmp_path: Path) -> None:
    batches = Batches(load_set(kicking(tmp_path / "set")), windows=(48,), shares=(1.0,))
    assert {item.start for item in items_of(batches, 48) if item.group == "human"} == {100}


def test_events_are_shown_whole_and_states_in_part(tmp_path: Path) -> None:
    batches = Batches(load_set(jumping(tmp_path / "set")), windows=(32, 48), shares=(0.5, 0.5))
    assert {item.group for item in items_of(batches, 32)} == {"walk"}
    assert {item.start for item in items_of(batches, 48)} == {0, 20, 100}
    lengths = batches.draw(0, 1, 64).lengths
    np.testing.assert_array_equal(np.unique(lengths), [32] if lengths.max() == 32 else [48])


def jumping(folder: Path) -> Path:
    """As `kicking`, with a jump and a hop, which are no strikes."""
    features = hml.encode(hml.canonical(people.walking(1.0, 10.0)), heading="corrected")
    return described(folder, Note(0, len(features), "walk"), Note(100, 150, "jump"), Note(20, 70, "hop"))


def test_windows_of_strikes_hold_the_moment_of_the_strike(tmp_path: Path) -> None:
    """A hand that shoots forward once in eight seconds, at frame 100: every window begins about 1.3 s before."""
    body = people.walking(0.0, 8.0)
    body[:, 21, 2] += 0.5 * np.exp(-(((np.arange(len(body)) - 100) / 2.5) ** 2))
    features = hml.encode(hml.canonical(body), heading="corrected")
    note = Note(0, len(features), "action:punch", ("a person punches",), (0, len(features)))
    folder = described(tmp_path / "set", note)
    write_clip(folder / "clips", Clip("one_capture", "cmu", "free", "train", "plain", (note,), features))
    item = load_set(folder).items[0]
    assert item.core is not None
    assert 80 <= item.core[0] <= 95
    assert 100 <= item.core[1] <= 112
    low, high = _starts(item, 48)
    assert 65 <= low < high <= 85


def test_windows_of_exercises_begin_before_a_repetition(tmp_path: Path) -> None:
    """Squats whose upright moments are 50 frames apart: windows begin 2 to 10 frames before one of them."""
    body = people.walking(0.0, 10.0)
    frames = np.arange(len(body))
    body[..., 1] -= (0.3 * (0.5 - 0.5 * np.cos(2 * np.pi * frames / 50)))[:, None] * (body[..., 1] > 0.5)
    features = hml.encode(hml.canonical(body), heading="corrected")
    note = Note(0, len(features), "action:squat", ("a person squats",))
    folder = described(tmp_path / "set", note)
    write_clip(folder / "clips", Clip("one_capture", "cmu", "free", "train", "plain", (note,), features))
    data = load_set(folder)
    upright = {0, 50, 100, 150, 199}
    assert all(min(abs(rest - u) for u in upright) <= 10 for rest in data.items[0].rests)
    assert {0, 50, 100, 150} <= set(data.items[0].rests)
    marked = replace(data, features=torch.arange(float(len(body)))[:, None].expand(-1, 263))
    begun = Batches(marked, windows=(48,), shares=(1.0,)).draw(0, 0, 400).features[:, 0, 0].tolist()
    assert all(any(rest - 10 <= at <= rest - 2 for rest in data.items[0].rests) or at == 0 for at in begun)
    assert len(set(begun)) > 8


def described(folder: Path, *notes: Note, kind: str = "capture", frames: int = 10) -> Path:
    """A built set of one walk of so many seconds with these notes."""
    features = hml.encode(hml.canonical(people.walking(1.0, float(frames))), heading="corrected")
    (folder / "clips").mkdir(parents=True, exist_ok=True)
    write_clip(folder / "clips", Clip(f"one_{kind}", "cmu", "free", "train", "plain", notes, features, kind))
    (folder / "set.json").write_text("{}")
    return folder


def test_every_window_of_a_change_holds_the_change(tmp_path: Path) -> None:
    note = Note(0, 190, "action:sit down", ("a person sits down",), (90, 120))
    batches = Batches(load_set(described(tmp_path / "set", note)), windows=(48,), shares=(1.0,))
    item = batches.data.items[0]
    low, high = _starts(item, 48)
    assert (low, high) == (90 - 18, 90 - 16 + 2 + 1)  # 16 frames before it, give or take two; 18 are free
    marked = replace(batches.data, features=torch.arange(190.0)[:, None].expand(-1, 263))
    drawn = Batches(marked, windows=(48,), shares=(1.0,)).draw(0, 3, 400).features
    assert set(drawn[:, 0, 0].int().tolist()) == set(range(low, high))


def test_a_change_longer_than_the_window_is_not_shown(tmp_path: Path) -> None:
    note = Note(0, 190, "action:sit down", ("a person sits down",), (10, 120))
    data = load_set(described(tmp_path / "set", note, Note(0, 190, "walk")))
    batches = Batches(data, windows=(48, 120), shares=(0.5, 0.5))
    assert {item.group for item in items_of(batches, 48)} == {"walk"}
    assert {item.group for item in items_of(batches, 120)} == {"walk", "action:sit down"}


def test_actions_are_drawn_evenly_and_captures_more_often_than_keyed_clips(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    described(folder, *[Note(i, i + 100, "action:eat", ("a person eats",)) for i in range(9)])
    described(folder, Note(0, 100, "action:eat", ("an animated person eats",)), kind="keyed")
    described(folder, Note(0, 100, "action:nod", ("a person nods",)), kind="made")
    batches = Batches(load_set(folder), windows=(48,), shares=(1.0,))
    texts = np.array([batches.data.texts[i] for i in batches.draw(0, 0, 40_000).texts.tolist()])
    nods = [batches.data.texts[i] for i in batches.data.items[-1].texts]
    assert abs(np.isin(texts, nods).mean() - 0.5) < 0.02
    keyed = (texts == "an animated person eats").sum() / np.isin(
        texts, ["an animated person eats", "a person eats"]
    ).sum()
    assert abs(keyed - 0.4 / 9.4) < 0.03


def test_a_share_of_each_batch_is_fresh_and_the_rest_is_not(tmp_path: Path) -> None:
    """Fresh by source or by group: the last rows of every batch, whatever is favoured among the others."""
    folder = tmp_path / "set"
    described(folder, Note(0, 100, "action:eat", ("a person eats",)), kind="made")
    described(folder, Note(0, 100, "action:manner limp", ("a person limps",)))
    described(folder, Note(0, 100, "action:nod", ("a person nods",)), kind="keyed")
    data = load_set(folder)
    items = tuple(replace(item, source="pack" if item.group == "action:nod" else "cmu") for item in data.items)
    batches = Batches(
        replace(data, items=items), windows=(48,), shares=(1.0,), fresh=0.25, fresh_of=("manner ", "pack")
    )
    fresh = {number for item in items if item.group != "action:eat" for number in item.texts}
    assert batches.old_rows(8) == 6
    seen: set[int] = set()
    for step in range(12):
        texts = batches.draw(0, step, 8).texts.tolist()
        assert not fresh & set(texts[:6])
        assert fresh >= set(texts[6:])
        seen |= set(texts)
    assert all(seen & set(item.texts) for item in items)


def test_windows_of_a_climb_begin_on_the_floor(tmp_path: Path) -> None:
    """Half a metre a second for ten seconds, of which the end is shown: as a climb from the floor."""
    body = people.standing(10.0)
    body[..., 1] += np.linspace(0, 5, len(body))[:, None]
    features = hml.encode(hml.canonical(body), heading="corrected")
    for group, lowest in (("climb", 0.0), ("descend", 150 * 5 / 199)):
        note = Note(150, 198, group)
        folder = described(tmp_path / group, note)
        write_clip(folder / "clips", Clip("one_capture", "cmu", "free", "train", "plain", (note,), features))
        batches = Batches(load_set(folder), windows=(48,), shares=(1.0,))
        items_of = batches.draw(0, 0, 1).features * batches.data.std + batches.data.mean
        places = hml.decode_positions(items_of[0].numpy().astype(np.float64))
        assert abs(places[0, :, 1].min() - lowest) < 0.05
        np.testing.assert_allclose(places[-1, 0, 1] - places[0, 0, 1], 47 * 5 / 199, atol=0.02)


def texts_of(folder: Path, note: Note) -> tuple[str, ...]:
    """The sentences that the only item of a set is shown with."""
    data = load_set(described(folder, note))
    return tuple(data.texts[number] for number in data.items[0].texts)


def test_a_strike_without_a_side_in_words_is_one_of_the_right_hand(tmp_path: Path) -> None:
    """The average of a punch by either hand would be a guard."""
    texts = {
        side: texts_of(tmp_path / side, Note(0, 190, "action:made punch", (f"he punches with the {side} hand",)))
        for side in ("left", "right")
    }
    assert len(texts["left"]) > 5
    assert all("left" in text for text in texts["left"])
    assert sum("right" not in text for text in texts["right"]) > 5


def test_a_kick_by_nobody_knows_which_foot_keeps_all_its_words(tmp_path: Path) -> None:
    texts = texts_of(tmp_path / "set", Note(0, 190, "action:kick", ("she kicks",)))
    assert "she kicks" in texts
    assert len(texts) > 5


def test_idioms_are_for_what_is_known_and_become_sentences() -> None:
    """Each group is an action, a gesture or a label; a side stays to be filled in only where there is one."""
    known = {"action": ACTIONS, "gesture": GESTURES, "label": LABELS}
    for group, row in read_table("motionloom_train.data", "idioms.toml").items():
        kind, _, name = group.partition(":")
        assert name in known[kind], group
        assert row.keys() <= {"verbs", "sided", "says"}, group
        said = table()[group]
        assert not [text for text in said["says"] if "{" in text], group
        assert all("{side}" in text for text in row.get("sided", ())), group
        assert set(row.get("says", ())) <= set(said["says"]), group
    naps = table()["action:lie down"]["says"]
    assert any(re.search(r"tak\w+ a nap", text) for text in naps)
