"""What a row may ask, and the id that follows from all of it."""

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.bulk.row import Sources, parse
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import save
from tests.work import work

COMMON = {"weights": "w", "steps": 24}


def key(row: dict[str, Any], folder: Path = Path(), common: dict[str, Any] = COMMON, **more: Any) -> str:
    return Sources(folder, common, **more).ask(parse(json.dumps(row).encode())).key


@pytest.mark.parametrize(
    "change",
    [{"prompt": "a person runs"}, {"seconds": 4.0}, {"seed": 8}, {"goal": {"path": {"points": [[0, 0], [0, 2]]}}}],
    ids=str,
)
def test_the_id_changes_with_everything_a_row_asks(change: dict[str, Any]) -> None:
    row = {"prompt": "a person walks", "seconds": 3.0, "seed": 7}
    assert key(row) != key(row | change)


def test_the_id_changes_with_weights_settings_and_what_rows_do_not_say() -> None:
    row = {"prompt": "a person walks"}
    keys = [
        key(row),
        key(row, common={**COMMON, "weights": "v"}),
        key(row, common={**COMMON, "steps": 12}),
        key(row, seconds=4.0),
        key(row, seed=1),
    ]
    assert len(set(keys)) == 5


def test_the_id_does_not_change_with_how_the_same_is_said() -> None:
    assert key({"prompt": "walk"}) == key({"seed": 0, "prompt": "walk", "seconds": 5, "task": "generate", "id": "a"})
    assert key({"prompt": "walk", "seconds": 5.0}) == key({"prompt": "walk", "seconds": 5.001})  # as many frames


def test_numbers_in_a_prompt_are_read_unless_they_are_left_literal() -> None:
    """The row is as long as they need, or as it says itself; the ids of prompts without numbers are what they were."""
    row = {"prompt": "a person walks 2 meters", "seed": 1}
    order = Sources(Path(), COMMON).ask(parse(json.dumps(row).encode()))
    assert order.timeline is not None
    assert order.text == "a person walks 2 meters"
    assert order.frames == round(20 * order.timeline.seconds) < 100
    assert Sources(Path(), COMMON).ask(parse(json.dumps(row | {"seconds": 4}).encode())).frames == 80
    assert Sources(Path(), COMMON, literal=True).ask(parse(json.dumps(row).encode())).timeline is None
    assert key(row) != key(row, literal=True)
    assert key({"prompt": "a person walks"}) == key({"prompt": "a person walks"}, literal=True)


@pytest.mark.parametrize(
    "row",
    [
        {"prompt": "a person walks 2 meters, then sits down and waves"},
        {"prompt": "a person walks", "goal": {"path": {"points": [[0, 0], [0, 2]]}}},
        {"timeline": "damaged.yaml"},
    ],
    ids=["words", "goal", "refused file"],
)
def test_what_rows_have_in_common_is_read_once(row: dict[str, Any], tmp_path: Path) -> None:
    """Forty thousand rows of one sentence take seconds, not minutes; so do those that name one damaged file."""
    (tmp_path / "damaged.yaml").write_text("segments:\n" + "- {text: a person walks}\n" * 50 + "- {text: 7}\n")
    texts = []

    def ask(sources: Sources, seed: int) -> None:
        try:
            texts.append(sources.ask(parse(json.dumps({"seed": seed} | row).encode())).text)
        except MotionloomError as error:
            texts.append(str(error))

    ask(Sources(tmp_path, COMMON), 0)  # what is imported and compiled once
    sources = Sources(tmp_path, COMMON)
    first = work(lambda: ask(sources, 0))
    assert work(lambda: ask(sources, 1)) < first / 2
    assert texts[0] == texts[1] == texts[2]


def test_the_id_of_a_row_without_the_best_of_several_is_as_it_was() -> None:
    row = {"prompt": "a person walks", "seed": 7}
    assert key(row) == "e8bbc60dcbb26cb823371c1c56e4c869"  # recorded before rows had it
    assert key(row | {"best_of": 1}) == key(row, best_of=1) == key(row)
    assert key(row | {"best_of": 4}) == key(row, best_of=4) != key(row)
    with pytest.raises(MotionloomError, match="a row with a motion draws nothing"):
        parse(json.dumps({"motion": "a.bvh", "best_of": 2}).encode())


def test_the_id_changes_with_what_a_named_file_holds(folder: Path) -> None:
    row = {"prompt": "a person walks", "goal": "goal.json"}
    keys = set()
    for z in (1.0, 2.0, 1.0):
        (folder / "goal.json").write_text(json.dumps({"path": {"points": [[0, 0], [0, z]]}}))
        keys.add(key(row, folder))
    assert len(keys) == 2


def test_the_id_changes_with_a_timeline_and_with_a_skeleton(folder: Path) -> None:
    (folder / "a.yaml").write_text("segments: [a person walks, a person jumps]\n")
    before = key({"timeline": "a.yaml"}, folder)
    (folder / "a.yaml").write_text("segments: [a person walks, a person sits]\n")
    assert key({"timeline": "a.yaml"}, folder) != before
    turns = np.tile([1.0, 0, 0, 0], (2, 22, 1))
    save(Motion(replace(SMPL22, offsets=2 * SMPL22.offsets), 20.0, np.zeros((2, 3)), turns), folder / "rig.npz")
    assert key({"prompt": "a", "skeleton": "rig.npz"}, folder) != key({"prompt": "a"}, folder)
    assert key({"prompt": "a", "skeleton": "rig.npz"}, folder) == key({"prompt": "a"}, folder, skeleton="rig.npz")
    assert key({"prompt": "a", "skeleton": "smpl22"}, folder) == key({"prompt": "a"}, folder)


@pytest.mark.parametrize(
    "row",
    [
        {},
        {"prompt": ""},
        {"prompt": "  "},
        {"prompt": 3},
        {"prompt": "a", "secs": 3},
        {"prompt": "a", "seconds": "x"},
        {"prompt": "a", "seconds": True},
        {"prompt": "a", "seed": -1},
        {"prompt": "a", "seed": 1.5},
        {"prompt": "a", "seed": 2**62},
        {"prompt": "a", "best_of": 17},
        {"prompt": "a", "id": "../b"},
        {"prompt": "a", "id": "a.b"},
        {"prompt": "a", "id": ""},
        {"prompt": "a", "task": "dance"},
        {"prompt": "a", "task": "control"},
        {"prompt": "a", "timeline": "b.yaml"},
        {"goal": {}, "timeline": "b.yaml"},
        {"prompt": "a", "goal": 3},
        {"prompt": "a" * 20_001},
    ],
    ids=lambda row: str(row)[:40],
)
def test_what_a_row_cannot_ask_is_reported_in_a_sentence(row: dict[str, Any]) -> None:
    with pytest.raises(MotionloomError):
        parse(json.dumps(row).encode())


@pytest.mark.parametrize("name", ["../goal.json", "/etc/passwd", "absent.json", "C:\\goal.json"])
def test_rows_name_no_files_outside_of_their_folder(folder: Path, name: str) -> None:
    (folder.parent / "goal.json").write_text("{}")
    with pytest.raises(MotionloomError, match="goal"):
        key({"prompt": "a", "goal": name}, folder)


@pytest.mark.parametrize("seconds", [0, -1, 61, float("nan"), float("inf")])
def test_lengths_that_cannot_be_made_are_refused(seconds: float) -> None:
    with pytest.raises(MotionloomError):
        key({"prompt": "a", "seconds": seconds})


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
COLUMNS = ("task", "prompt", "seconds", "seed", "timeline", "goal", "skeleton", "id", "other")


@given(row=st.dictionaries(st.sampled_from(COLUMNS), VALUES))
def test_whatever_a_row_holds_it_is_read_or_refused(row: dict[str, Any]) -> None:
    with suppress(MotionloomError):
        Sources(Path(), COMMON).ask(parse(json.dumps(row).encode()))


@given(raw=st.binary(max_size=40))
def test_whatever_a_line_holds_it_is_read_or_refused(raw: bytes) -> None:
    with suppress(MotionloomError):
        parse(raw)
