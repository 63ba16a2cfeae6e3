"""What training is shown of a built set."""

from pathlib import Path

import numpy as np

from motionloom.data.build import Clip, Note, write_clip
from motionloom.data.sets import Batches, load_set
from motionloom.features import humanml as hml
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


def starts(batches: Batches, kind: str) -> set[int]:
    """Where the items of a kind begin that a window of 48 frames is taken from."""
    data = batches.data
    return {data.items[i].start for group in batches._pools[48][kind].values() for i in group}


def test_a_caption_that_names_an_event_is_shown_with_the_event(tmp_path: Path) -> None:
    batches = Batches(load_set(kicking(tmp_path / "set")), windows=(48,), shares=(1.0,))
    assert starts(batches, "human") == {100}


def test_events_are_shown_whole_and_states_in_part(tmp_path: Path) -> None:
    batches = Batches(load_set(kicking(tmp_path / "set")), windows=(32, 48), shares=(0.5, 0.5))
    small = {batches.data.items[i].group for group in batches._pools[32]["label"].values() for i in group}
    assert small == {"walk"}
    assert starts(batches, "label") == {0, 20, 100}
    lengths = batches.draw(0, 1, 64).lengths
    np.testing.assert_array_equal(np.unique(lengths), [32] if lengths.max() == 32 else [48])
