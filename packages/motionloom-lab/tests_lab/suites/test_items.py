"""Which stretches of real motion are measured, what is said of them, and the file that stands for them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.suites import items, text_reference
from motionloom_lab.suites.harness import averaged
from motionloom_lab.suites.protocol import Protocol, Selection
from motionloom_train.data.clips import Clip, Note, write_clip
from tests.kinematics.people import moved, standing, walking
from tests_lab.suites.judged import WIDTH, Judge, item

LINES = (
    "a man walks.#a/DET man/NOUN walk/VERB#0.0#0.0\n"
    "he steps forward#he/PRON step/VERB#0.0#0.0\n"
    "only its middle#only/ADV#1.04#3.59\n"
    "too short#short/ADJ#0.0#1.9\n"
    "not a caption\n"
)


def counting(frames: int) -> np.ndarray:
    """Features that say which frame they are."""
    return np.repeat(np.arange(frames, dtype=np.float32)[:, None], 263, axis=1)


@pytest.fixture
def official(tmp_path: Path) -> Path:
    for folder in ("new_joint_vecs", "texts"):
        (tmp_path / folder).mkdir()
    for name, frames in (("000001", 103), ("M000001", 103), ("long", 201), ("edge", 199), ("tiny", 39)):
        np.save(tmp_path / "new_joint_vecs" / f"{name}.npy", counting(frames))
        (tmp_path / "texts" / f"{name}.txt").write_text(LINES if "1" in name else "walks#walk/VERB#0.0#0.0\n")
    (tmp_path / "test.txt").write_text("000001\nM000001\nlong\nedge\ntiny\nabsent\n")
    (tmp_path / "val.txt").write_text("")
    return tmp_path


def test_a_humanml3d_folder_gives_tokens_spans_and_published_lengths(official: Path) -> None:
    """40 frames or more, at most 200, cropped to multiples of 4; parts at floor(20 s) as published."""
    by_name = {i.name: i for i in items.read_items(official, items.fitting(official, None))}
    assert list(by_name) == ["000001@0-5.15", "000001@1-3.55", "M000001@0-5.15", "M000001@1-3.55", "edge@0-9.95"]
    whole, part = by_name["000001@0-5.15"], by_name["000001@1-3.55"]
    assert [c.text for c in whole.captions] == ["a man walks.", "he steps forward"]
    assert whole.captions[0].tokens == ("a/DET", "man/NOUN", "walk/VERB")
    assert (len(whole.features), len(part.features), len(by_name["edge@0-9.95"].features)) == (100, 48, 196)
    assert (part.features[0, 0], part.features[-1, 0]) == (20, 67)


def test_mirrored_copies_can_be_left_out(official: Path) -> None:
    chosen = Selection(splits=("test",), mirrored=False)
    assert not [i for i in items.read_items(official, chosen) if i.name.startswith("M")]


@pytest.mark.parametrize("damage", ["missing list", "bad name", "times", "shape", "nan", "pickle", "no text"])
def test_a_damaged_humanml3d_folder_is_one_clear_sentence(official: Path, damage: str) -> None:
    vectors, spoken = official / "new_joint_vecs" / "000001.npy", official / "texts" / "000001.txt"
    todo = {
        "missing list": lambda: (official / "test.txt").unlink(),
        "bad name": lambda: (official / "test.txt").write_text("../../etc/passwd"),
        "times": lambda: spoken.write_text("walks#walk/VERB#soon#later"),
        "shape": lambda: np.save(vectors, np.zeros((100, 251), dtype=np.float32)),
        "nan": lambda: np.save(vectors, np.full((100, 263), np.nan)),
        "pickle": lambda: np.save(vectors, np.array([{}], dtype=object)),
        "no text": lambda: spoken.unlink(),
    }
    todo[damage]()
    with pytest.raises(MotionloomError) as caught:
        items.read_items(official, Selection(splits=("test",)))
    assert "\n" not in str(caught.value)


@given(st.text(max_size=80), st.lists(st.text("#0123456789.-einfa/ \n", max_size=40), max_size=4))
@settings(max_examples=100, deadline=None)
def test_any_text_beside_a_motion_is_read_or_refused(caption: str, lines: list[str]) -> None:
    try:
        chosen = list(items._spoken("n", "test", counting(120), f"{caption}#a/DET#0.0#0.0\n" + "\n".join(lines)))
    except MotionloomError:
        return
    assert all(0 < len(one.features) <= 120 and one.captions for one in chosen)


@pytest.fixture
def built(tmp_path: Path) -> Path:
    (tmp_path / "clips").mkdir()
    features = humanml.encode(walking(1.2, 6.0), heading="corrected")
    notes = (
        Note(0, 90, "human", ("walks ahead", " ")),
        Note(0, 110, "index", ("walk",)),
        Note(10, 60, "walk"),
        Note(80, 110, "human", ("too short",)),
    )
    for name, source, split, way in (
        ("a", "cmu", "test", "plain"),
        ("Ma", "cmu", "test", "plain"),
        ("b", "cmu", "train", "plain"),
        ("c", "bandai-1", "val", "plain"),
        ("d_looped", "cmu", "test", "looped"),
    ):
        write_clip(tmp_path / "clips", Clip(name, source, "free", split, way, notes, features))
    return tmp_path


def test_a_built_set_gives_what_people_wrote_about_held_out_recordings_of_the_chosen_sources(built: Path) -> None:
    chosen = items.read_items(built, Selection())
    assert [(i.name, i.split, len(i.features)) for i in chosen] == [
        ("Ma@0-4.5", "test", 88),
        ("a@0-4.5", "test", 88),
    ]
    assert [c.text for c in chosen[0].captions] == ["walks ahead"]
    assert len(items.read_items(built, Selection(sources=()))) == 3
    assert [i.name for i in items.read_items(built, Selection(splits=("train",)))] == ["b@0-4.5"]


def test_a_folder_without_such_items_says_what_was_sought(built: Path, tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="lafan"):
        items.read_items(built, Selection(sources=("lafan",)))
    with pytest.raises(MotionloomError, match="no folder"):
        items.read_items(tmp_path / "nowhere", Selection())


@given(st.integers(40, 200), st.integers(1, 8), st.text(max_size=5))
def test_lengths_are_cropped_down_to_whole_units(frames: int, unit: int, name: str) -> None:
    chosen = Selection(unit=unit)
    assert items.cropped(frames, chosen, name) == frames - frames % unit
    shorter = items.cropped(frames, replace(chosen, shorter_third=True), name)
    assert shorter - (frames - frames % unit) in (0, -unit)


def test_a_third_of_the_lengths_is_one_unit_shorter() -> None:
    chosen = Selection(shorter_third=True)
    lengths = [items.cropped(100, chosen, f"{k:06d}") for k in range(3000)]
    assert set(lengths) == {96, 100}
    assert lengths.count(96) / 3000 == pytest.approx(1 / 3, abs=0.03)


@given(st.integers(1, 50), st.integers(1, 50))
def test_chosen_places_are_spread_from_first_to_last(count: int, of: int) -> None:
    places = items.spread(count, of)
    assert len(set(places)) == len(places) == min(count, of)
    assert places[0] == 0
    if len(places) > 1:
        assert places[-1] == of - 1
        assert max(np.diff(places)) - min(np.diff(places)) <= 1


def test_captions_are_drawn_evenly_and_by_seed() -> None:
    captions = [tuple(Caption(str(k)) for k in range(4))] * 4000
    picks = items.pick(captions, np.random.default_rng(3))
    assert picks == items.pick(captions, np.random.default_rng(3))
    assert np.bincount(picks) == pytest.approx([1000] * 4, abs=120)


# ---- the reference ---------------------------------------------------------------------------------------------------


@pytest.fixture
def reference() -> text_reference.TextReference:
    return text_reference.measure([item(k, 40 + k) for k in range(5)], Judge(), Selection())


def opened(path: Path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    with safe_open(path, framework="numpy") as file:
        names = file.keys()
        return file.metadata(), {name: file.get_tensor(name) for name in names}


def test_a_reference_comes_back_as_it_was_written(reference: text_reference.TextReference, tmp_path: Path) -> None:
    path = text_reference.save(reference, tmp_path / "r.safetensors")
    again = text_reference.load(path, Judge())
    for name in ("names", "captions", "frames", "selection", "evaluator"):
        assert getattr(again, name) == getattr(reference, name)
    np.testing.assert_allclose(again.motions, reference.motions, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(again.physical, reference.physical, rtol=1e-6)


def test_a_reference_of_another_evaluator_is_refused(reference: text_reference.TextReference, tmp_path: Path) -> None:
    path = text_reference.save(reference, tmp_path / "r.safetensors")
    with pytest.raises(MotionloomError, match="another evaluator"):
        text_reference.load(path, Judge(blind=True))


def test_motions_of_a_reference_cannot_be_had_back(reference: text_reference.TextReference, tmp_path: Path) -> None:
    """The file holds a few numbers per item, far fewer than the motion has."""
    path = text_reference.save(reference, tmp_path / "r.safetensors")
    sizes = {name: tensor.size for name, tensor in opened(path)[1].items()}
    assert sizes == {"motions": 5 * WIDTH, "frames": 5, "physical": 5 * 6, "probe": 2 * WIDTH}


@pytest.mark.parametrize(
    "change",
    [
        {"names": ["one"]},
        {"captions": [[]] * 5},
        {"captions": [[["", []]]] * 5},
        {"captions": [[[3, []]]] * 5},
        {"captions": 3},
        {"selection": {}},
        {"format": 99},
        {"evaluator": 3},
        {"physical": ["jerk"]},
    ],
)
def test_a_reference_that_does_not_fit_itself_is_refused(
    reference: text_reference.TextReference, tmp_path: Path, change: dict
) -> None:
    path = text_reference.save(reference, tmp_path / "r.safetensors")
    about, tensors = opened(path)
    save_file(tensors, path, metadata={"reference": json.dumps(json.loads(about["reference"]) | change)})
    with pytest.raises(MotionloomError, match=r"r\.safetensors"):
        text_reference.load(path, Judge())


@pytest.mark.parametrize("name", ["motions", "frames", "physical", "probe"])
@pytest.mark.parametrize("damage", ["shape", "nan", "kind", "gone"])
def test_damaged_tensors_of_a_reference_are_refused(
    reference: text_reference.TextReference, tmp_path: Path, name: str, damage: str
) -> None:
    path = text_reference.save(reference, tmp_path / "r.safetensors")
    about, tensors = opened(path)
    if damage == "gone":
        del tensors[name]
    elif damage == "kind":
        tensors[name] = tensors[name].astype(np.float64)
    elif damage == "shape":
        tensors[name] = tensors[name][:1]
    else:
        tensors[name] = np.full_like(tensors[name], -5 if name == "frames" else np.nan)
    save_file(tensors, path, metadata=about)
    with pytest.raises(MotionloomError):
        text_reference.load(path, Judge())


@given(cut=st.integers(0, 900), flip=st.integers(0, 899))
@settings(max_examples=60, deadline=None)
def test_any_bytes_in_place_of_a_reference_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, cut: int, flip: int
) -> None:
    folder = tmp_path_factory.mktemp("r")
    whole = text_reference.measure([item(k) for k in range(2)], Judge(), Selection())
    data = bytearray(text_reference.save(whole, folder / "r.safetensors").read_bytes()[: cut + 200])
    data[min(flip, len(data) - 1)] ^= 0x15
    (folder / "r.safetensors").write_bytes(data)
    try:
        reference = text_reference.load(folder / "r.safetensors", Judge())
    except MotionloomError:
        return
    assert (
        len(reference.names)
        == len(reference.captions)
        == len(reference.frames)
        == len(reference.motions)
        == len(reference.physical)
    )
    assert np.isfinite(reference.motions).all()
    assert np.isfinite(reference.physical).all()


def test_physical_numbers_of_a_slide_are_its_speed() -> None:
    """Standing and pushed at 1 m/s: 100 % of frames skate, at 100 cm/s and 50 mm a frame; bones stay, nothing sinks."""
    push = np.outer(np.arange(80) / 20, [0.0, 0.0, 1.0])
    numbers = text_reference.of_features(humanml.encode(moved(standing(4.0), push), heading="corrected"))
    limits = {"skate_share": 100, "skate_speed": 100, "skate_slide": 50, "penetration": 0, "bone_error": 0, "jerk": 0}
    assert numbers == pytest.approx(limits, abs=0.1)
    sunk = text_reference.of_features(humanml.encode(standing(4.0) - [0, 0.03, 0], heading="corrected"))
    assert sunk["penetration"] == pytest.approx(3, abs=0.01)


def test_averages_are_weighted_by_length() -> None:
    numbers = np.array([[1.0] * 6, [4.0] * 6])
    assert set(averaged(numbers, [40, 80]).values()) == {3.0}


def test_a_count_takes_evenly_spread_items(reference: text_reference.TextReference) -> None:
    few = reference.chosen(Protocol(count=4, batch=4))
    assert few.names == ("item0000", "item0001", "item0003", "item0004")
    assert few.frames == tuple(reference.frames[k] for k in (0, 1, 3, 4))
    assert len(few.captions) == len(few.motions) == len(few.physical) == 4
