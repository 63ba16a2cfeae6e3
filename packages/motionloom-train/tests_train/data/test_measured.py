"""Windows described by what is measured in them: on people whose pace, turns and jumps are known by construction."""

import re

import numpy as np
import pytest

from motionloom.core.features import humanml as hml
from motionloom_train.data.actions import ACTIONS
from motionloom_train.data.batches import SHARE, Pool
from motionloom_train.data.build import _with_mirror
from motionloom_train.data.clips import MEASURED, Clip, Note, read_clip, write_clip
from motionloom_train.data.measured import BASES, ROWS, measure_facts, measured_notes, sentences_of
from motionloom_train.data.sets import Item
from motionloom_train.data.starts import nearest
from motionloom_train.data.words import LABELS, mirror_text
from tests.kinematics import people

FPS = 20.0
HASTE = r"\b(?:quick\w*|fast|faster|brisk\w*|in a hurry)\b"
CALM = r"\b(?:slow\w*|leisurely|calmly|unhurriedly|no hurry)\b"


def said(positions: np.ndarray, name: str) -> list[str]:
    """All that is said of a whole motion of that name."""
    notes = measured_notes(positions, FPS, [(0, len(positions), name)])
    return [text for note in notes for text in note.texts]


def turning(degrees: float) -> np.ndarray:
    """Stepping on the spot, + to the left."""
    p = people.walking(0.0, 4.0)
    return people.spun(p, np.radians(degrees) * np.linspace(0, 1, len(p)))


@pytest.mark.parametrize(
    ("speed", "has", "lacks"), [(0.6, CALM, HASTE), (1.7, HASTE, CALM), (1.15, r"\bpace\b|speed", f"{CALM}|{HASTE}")]
)
def test_adverbs_agree_with_the_pace(speed: float, has: str, lacks: str) -> None:
    texts = said(people.walking(speed), "walk")
    assert any(re.search(has, text) for text in texts)
    assert [text for text in texts if re.search(lacks, text)] == []


NOT = r"(?:without|not|n't|never)\b.*\b"


@pytest.mark.parametrize(
    ("positions", "name", "undone", "done"),
    [
        (people.walking(1.2), "walk", r"turn|direction", r"walk"),
        (people.circling(1.2, 1.0), "circle left", r"stop|paus|stand", r"turn"),
        (turning(90), "turn left", r"walk|leav|go", r"turn"),
        (people.standing(), "stand", r"walk|leav|go|step|feet", r"stand"),
        (people.jumping(0.35), "jump", r"leav|mov|turn|direction", r"jump|hop"),
    ],
    ids=["walk", "circle", "turn", "stand", "jump"],
)
def test_negations_name_what_does_not_happen_and_nothing_that_does(
    positions: np.ndarray, name: str, undone: str, done: str
) -> None:
    texts = [text for note in _every(positions, name) for text in note]
    assert any(re.search(NOT + f"(?:{undone})", text) for text in texts)
    assert [text for text in texts if re.search(rf"(?:without|not|n't|never) (?:{done})\w*$", text)] == []


def _every(positions: np.ndarray, name: str) -> list[tuple[str, ...]]:
    """All that rows may say of a motion, not only the few sentences that are taken."""
    measures = measure_facts(positions, FPS)
    return [sentences_of(name, row, 1) for row in ROWS if name in row.of and row.is_so(measures)]


def test_who_stops_is_not_said_never_to_stop() -> None:
    p = people.walking(1.2)
    stopped = np.concatenate([p, np.repeat(p[-1:], 40, axis=0)])
    assert [t for t in said(stopped, "walk") if re.search(NOT + "(?:stop|paus|stand)", t)] == []


def test_counts_are_of_the_whole_window() -> None:
    """Numbers stand in notes whose window must be shown whole; adverbs and negations in others."""
    notes = list(measured_notes(people.walking(1.2), FPS, [(0, 80, "walk")]))
    counted = [n for n in notes if any(re.search(r"\bsteps\b|\bmet(?:re|er)s\b", t) for t in n.texts)]
    assert counted
    assert {n.core for n in counted} == {(0, 80)}
    assert all(n.core is None for n in notes if n not in counted)


def test_metres_are_those_that_were_walked() -> None:
    """1.25 m/s for 4 s is five metres."""
    texts = " ".join(said(people.walking(1.25, 4.05), "walk"))
    numbers = set(re.findall(r"(\w+) met(?:re|er)s", texts))
    assert numbers <= {"five"}


@pytest.mark.parametrize("degrees", [90.0, -90.0])
def test_a_quarter_turn_names_its_side(degrees: float) -> None:
    side, other = ("left", "right") if degrees > 0 else ("right", "left")
    texts = said(turning(degrees), f"turn {side}")
    assert any("90 degrees" in text or "quarter" in text or "ninety" in text for text in texts)
    assert [text for text in texts if other in text] == []


def test_the_mirror_image_says_the_other_side_and_never_none() -> None:
    """Where no side is said, the right hand kicks: "kicks once" is no sentence for the mirror image of that."""
    note = Note(0, 60, MEASURED + "kick right", ("kicks once", "kicks once with the right leg"), (10, 30))
    plain = Clip("x", "s", "l", "train", "plain", (note,), hml.encode(people.walking(1.0), heading="corrected"))
    mirrored = list(_with_mirror(plain))[1]
    assert [(n.kind, n.texts) for n in mirrored.notes] == [(MEASURED + "kick left", ("kicks once with the left leg",))]


def test_the_same_window_is_described_in_the_same_words() -> None:
    windows = [(0, 80, "walk"), (0, 50, "walk")]
    p = people.walking(0.7)
    assert list(measured_notes(p, FPS, windows)) == list(measured_notes(p, FPS, windows))


def test_windows_that_lie_close_are_described_once() -> None:
    windows = [(first, first + 80, "walk") for first in range(0, 80, 10)]
    firsts = {note.first for note in measured_notes(people.walking(1.2, 10.0), FPS, windows)}
    assert firsts == {0, 40}


def test_every_row_is_for_a_label_or_an_action_and_can_be_measured() -> None:
    measures = measure_facts(people.standing(), FPS)
    for row in ROWS:
        row.is_so(measures)  # a measure that is unknown would be a KeyError
        for name in row.of & BASES.keys():
            assert sentences_of(name, row, 2), row
    assert [name for name in BASES if name not in LABELS and name not in ACTIONS] == []


@pytest.mark.parametrize("row", [row for row in ROWS if row.what], ids=lambda row: row.what[0])
def test_negations_are_sentences(row) -> None:
    """Forms of "not" go with bare verbs, "without" with gerunds; sides survive the mirror."""
    for name in sorted(row.of & BASES.keys()):
        for text in sentences_of(name, row):
            assert not re.search(r"(?:not|n't) \w+ing\b(?<!, not \w{4}ing)$", text) or ", not " in text
            assert not re.search(r"without \w+s\b", text)
            assert mirror_text(mirror_text(text)) == text


def test_notes_survive_the_file(tmp_path) -> None:
    p = people.walking(0.7, 5.0)
    features = hml.encode(p, heading="corrected").astype(np.float32)
    notes = tuple(measured_notes(p[: len(features)], FPS, [(0, 80, "walk")]))
    clip = Clip("x", "s", "l", "train", "plain", notes, features)
    write_clip(tmp_path, clip)
    assert read_clip(tmp_path / "x.safetensors").notes == notes


def test_measured_words_are_sampled_as_often_as_they_should() -> None:
    """Beside an action and a label that are always there, by their shares."""
    items = [Item(0, 60, group, (0,)) for group in ("action:bow", "walk", MEASURED + "walk")]
    pool = Pool.of(items, 48, {}, nearest(np.ones(60, dtype=bool)))
    often = dict(zip(pool.numbers.tolist(), np.diff(pool.often, prepend=0.0), strict=True))
    total = SHARE["action"] + SHARE["label"] + SHARE["measured"]
    assert [round(often[k], 6) for k in range(3)] == [
        round(SHARE[kind] / total, 6) for kind in ("action", "label", "measured")
    ]
