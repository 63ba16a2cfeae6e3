"""Guo's evaluator: what it does to motions and captions before the networks, and its file."""

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.torch import load_file, save_file

from motionloom.core.errors import MotionloomError
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.papers.guo import GuoEvaluator, is_guo, load_guo, read_published, save_guo, tokens_of
from motionloom_lab.papers.guo_nets import GuoSizes, from_state_dict
from motionloom_lab.papers.guo_words import TAGS, Words, read_words
from tests_lab.papers.test_guo_nets import Naive, checkpoint, state
from tests_lab.papers.test_guo_words import published

# The sizes of HumanML3D where the preparation has a say, small elsewhere.
JUDGE = GuoSizes(channels=259, snippet=6, text=5, motion=8, width=9, word=4, tags=15)
CAPTIONS = (
    Caption("left hand", ("left/ADJ", "hand/NOUN")),
    Caption("walk", ("walk/VERB",)),
    Caption("long", tuple(["walk/VERB", "hover/VERB"] * 13)),
)


def statistics() -> tuple[np.ndarray, np.ndarray]:
    """Of the evaluator's form: groups as in HumanML3D's Std, the root and the contacts divided by 25."""
    rng = np.random.default_rng(3)
    groups = {
        (0, 1): 0.012826,
        (1, 3): 0.016927,
        (3, 4): 0.153766,
        (4, 67): 0.122244,
        (67, 193): 0.299692,
        (193, 259): 0.019470,
        (259, 263): 0.355933,
    }
    std = np.concatenate([np.full(last - first, value) for (first, last), value in groups.items()])
    std[[0, 1, 2, 3, 259, 260, 261, 262]] /= 25
    return rng.normal(size=263) * 0.1, std


def judge(folder: Path, **other) -> GuoEvaluator:
    words = read_words(published(folder / "words"), lists=folder / "words" / "word_vectorizer.py")
    mean, std = statistics()
    return GuoEvaluator(from_state_dict(state(JUDGE)), mean, std, words, **other)


@pytest.fixture
def guo(tmp_path: Path) -> GuoEvaluator:
    return judge(tmp_path)


def motion(frames: int, seed: int = 0) -> np.ndarray:
    mean, std = statistics()
    return mean + std * np.random.default_rng(seed).normal(size=(frames, 263))


@pytest.mark.parametrize("frames", [4, 61, 120, 192, 195, 196, 199, 240])
def test_a_motion_is_read_as_the_published_loader_shows_it(guo: GuoEvaluator, frames: int) -> None:
    """Standardised by the evaluator's numbers, contacts off, cut to fours, zeros to 196 frames; then a plain loop."""
    clip = motion(frames)
    length = frames // 4 * 4
    padding = np.zeros((max(196, length), 259))
    padding[:length] = ((clip - guo.mean) / guo.std)[:length, :259]
    points = guo.motions([clip])
    assert points.dtype == np.float64
    np.testing.assert_allclose(points[0], Naive(state(JUDGE)).motion(padding, length), atol=2e-4)


def test_contacts_are_not_shown_and_the_root_weighs_25_times(guo: GuoEvaluator) -> None:
    clip = motion(40)
    touched = clip.copy()
    touched[:, 259:] += 1
    assert np.array_equal(guo.motions([touched]), guo.motions([clip]))
    mean, std = statistics()
    plain = std.copy()
    plain[[0, 1, 2, 3, 259, 260, 261, 262]] *= 25
    wide = mean + (clip - mean) * np.where(np.arange(263) < 4, 25, 1)
    np.testing.assert_allclose(replace(guo, std=plain).motions([wide]), guo.motions([clip]), atol=1e-5)
    assert np.abs(replace(guo, std=plain).motions([clip]) - guo.motions([clip])).max() > 0.01


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(4, 230), min_size=1, max_size=8), st.randoms(use_true_random=False))
def test_a_motion_alone_is_that_motion_in_any_company(tmp_path_factory, lengths: list[int], random) -> None:
    guo = judge(tmp_path_factory.mktemp("words"))
    some = [motion(length, seed) for seed, length in enumerate(lengths)]
    points = guo.motions(some)
    for row, one in enumerate(some):
        np.testing.assert_allclose(guo.motions([one])[0], points[row], atol=1e-5)
    order = list(range(len(some)))
    random.shuffle(order)
    np.testing.assert_allclose(guo.motions([some[i] for i in order]), points[order], atol=1e-5)


def test_long_motions_of_other_lengths_put_nothing_after_each_other(guo: GuoEvaluator) -> None:
    some = [motion(length) for length in (240, 196, 192, 236, 240)]
    points = guo.motions(some)
    for row, one in enumerate(some):
        np.testing.assert_allclose(guo.motions([one])[0], points[row], atol=1e-5)


def test_more_motions_than_one_batch_come_back_in_order(guo: GuoEvaluator) -> None:
    some = [motion(4 + 3 * (i % 30), i) for i in range(150)]
    points = guo.motions(some)
    for row in (0, 63, 64, 149):
        np.testing.assert_allclose(points[row], guo.motions([some[row]])[0], atol=1e-5)
    assert guo.motions([]).shape == (0, 9)


@pytest.mark.parametrize("cap_len", ["true", "published"])
def test_a_caption_is_read_as_22_tagged_words_of_its_length(guo: GuoEvaluator, cap_len) -> None:
    """Rows of the made-up vectors: sos 5, eos 4, unk 3, walk 2, left 1, hand 0; ``left`` is Loc_VIP by the lists."""
    rows = {
        0: ([5, 1, 0, 4] + [3] * 18, ["OTHER", "Loc_VIP", "Body_VIP"] + ["OTHER"] * 19, 4),
        1: ([5, 2, 4] + [3] * 19, ["OTHER", "VERB"] + ["OTHER"] * 20, 3),
        2: ([5] + [2, 3] * 10 + [4], ["OTHER"] + ["VERB", "OTHER"] * 10 + ["OTHER"], 22),
    }
    points = guo.with_caption_length(cap_len).texts(CAPTIONS)
    assert points.dtype == np.float64
    for row, (numbers, names, length) in rows.items():
        words = np.repeat(np.array(numbers, dtype=float)[:, None], 4, axis=1)
        tags = np.eye(15)[[TAGS.index(name) for name in names]]
        target = Naive(state(JUDGE)).text(words, tags, 22 if cap_len == "published" else length)
        np.testing.assert_allclose(points[row], target, atol=1e-4)
        np.testing.assert_allclose(guo.with_caption_length(cap_len).texts([CAPTIONS[row]])[0], target, atol=1e-4)


def test_the_published_caption_length_changes_short_captions_only(guo: GuoEvaluator) -> None:
    true, published_ = guo.texts(CAPTIONS), guo.with_caption_length("published").texts(CAPTIONS)
    assert (np.abs(true - published_).max(axis=1) > 1e-3).tolist() == [True, True, False]


def test_it_says_which_way_was_taken(guo: GuoEvaluator) -> None:
    judge: Evaluator = guo
    assert judge.name == "guo"
    assert judge.about["caption length"].startswith("true")
    assert guo.with_caption_length("published").about["caption length"].startswith("published: 22")
    assert "weighs 25 times" in guo.about["statistics"]
    assert "6 vectors of 4; 6 special words" in guo.about["words"]
    bare = GuoEvaluator(guo.nets)
    assert bare.about["statistics"].startswith("none")
    assert bare.about["words"].startswith("none")
    assert json.loads(json.dumps(guo.about)) == guo.about


def test_what_is_missing_is_named(guo: GuoEvaluator) -> None:
    bare = GuoEvaluator(guo.nets)
    with pytest.raises(MotionloomError, match="--mean"):
        bare.motions([motion(40)])
    with pytest.raises(MotionloomError, match="--glove"):
        bare.texts(CAPTIONS)
    with pytest.raises(MotionloomError, match="no tokens"):
        guo.texts([Caption("a person walks")])


@pytest.mark.parametrize(
    ("features", "reason"),
    [
        (motion(3), "4 or more"),
        (motion(40)[:, :259], "263"),
        (motion(40)[None], "263"),
        (np.full((8, 263), np.nan), "finite"),
        (np.full((8, 263), np.inf), "finite"),
        (np.ones((8, 263), dtype=np.int64), "finite"),
    ],
    ids=["short", "narrow", "batched", "nan", "infinite", "integers"],
)
def test_motions_that_cannot_be_judged_are_reported(guo: GuoEvaluator, features: np.ndarray, reason: str) -> None:
    with pytest.raises(MotionloomError, match=reason):
        guo.motions([motion(40), features])


def test_parts_that_do_not_fit_are_reported(guo: GuoEvaluator) -> None:
    mean, std = statistics()
    wrong = Words(("sos", "eos", "unk"), np.ones((3, 5), dtype=np.float32))
    for change, reason in (
        ({"mean": None}, "together"),
        ({"mean": mean[:250], "std": std[:250]}, "259 or 263"),
        ({"std": std * 0}, "above zero"),
        ({"mean": mean * np.nan}, "finite"),
        ({"words": wrong}, "numbers"),
        ({"cap_len": "22"}, "published"),
    ):
        with pytest.raises(MotionloomError, match=reason):
            replace(guo, **change)


def test_babel_is_shown_whole(tmp_path: Path) -> None:
    """135 numbers, no contacts to take off: the last four count."""
    sizes = replace(JUDGE, channels=135)
    guo = GuoEvaluator(from_state_dict(state(sizes)), np.zeros(135), np.ones(135))
    x = np.random.default_rng(0).normal(size=(200, 135))
    np.testing.assert_allclose(guo.motions([x])[0], Naive(state(sizes)).motion(x, 200), atol=2e-4)
    assert guo.about["statistics"] == "135 numbers"


def test_the_tokens_of_a_line() -> None:
    line = "a person walks left.#a/DET person/NOUN walk/VERB left/ADV#0.0#2.5\n"
    assert tokens_of(line) == ("a/DET", "person/NOUN", "walk/VERB", "left/ADV")
    assert tokens_of("x##0.0#0.0") == ()
    for other in ("a person walks", "a#b#c", "a#b#0#1#2", ""):
        with pytest.raises(MotionloomError, match="HumanML3D"):
            tokens_of(other)


def files(folder: Path) -> Path:
    """A checkpoint with everything beside it under its published name."""
    mean, std = statistics()
    np.save(folder / "t2m_mean.npy", mean)
    np.save(folder / "t2m_std.npy", std)
    published(folder)
    torch.save(checkpoint(state(JUDGE)), folder / "finest.tar")
    return folder / "finest.tar"


def test_one_file_is_the_whole_evaluator(tmp_path: Path) -> None:
    """Published files to one safetensors file, to the same numbers, bit for bit."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        evaluator = read_published(files(tmp_path), card={"licence": "research only"})
    save_guo(evaluator, tmp_path / "guo.safetensors")
    copy = load_guo(tmp_path / "guo.safetensors")
    assert copy.about == evaluator.about
    assert copy.about["licence"] == "research only"
    assert np.array_equal(copy.motions([motion(61)]), evaluator.motions([motion(61)]))
    assert np.array_equal(copy.texts(CAPTIONS), evaluator.texts(CAPTIONS))
    assert load_guo(tmp_path / "finest.tar", cap_len="published").cap_len == "published"
    assert is_guo(tmp_path / "guo.safetensors")
    assert is_guo(tmp_path / "finest.tar")
    save_file({"a": torch.zeros(1)}, tmp_path / "other.safetensors")
    (tmp_path / "broken.safetensors").write_bytes(b"\xff" * 20)
    for name in ("other.safetensors", "broken.safetensors", "absent.safetensors", "t2m_mean.npy"):
        assert not is_guo(tmp_path / name)


def test_an_evaluator_without_words_or_statistics_is_kept_as_it_is(tmp_path: Path) -> None:
    torch.save(checkpoint(state(JUDGE)), tmp_path / "finest.tar")
    evaluator = load_guo(save_guo(read_published(tmp_path / "finest.tar"), tmp_path / "guo.safetensors"))
    assert evaluator.mean is None
    assert evaluator.words is None
    with pytest.raises(MotionloomError, match="suffix"):
        save_guo(evaluator, tmp_path / "guo.tar")


def test_the_data_sets_statistics_and_missing_lists_are_warned_of(tmp_path: Path) -> None:
    path = files(tmp_path)
    std = statistics()[1]
    std[[0, 1, 2, 3, 259, 260, 261, 262]] *= 25
    np.save(tmp_path / "Std.npy", std)
    with pytest.warns(UserWarning, match="t2m_std"):
        evaluator = read_published(path, std=tmp_path / "Std.npy")
    assert "weighs 1 times" in evaluator.about["statistics"]
    (tmp_path / "word_vectorizer.py").unlink()
    with pytest.warns(UserWarning, match="special words"):
        assert "not the published input" in read_published(path).about["words"]
    (tmp_path / "our_vab_data.npy").unlink()
    with pytest.raises(MotionloomError, match="--glove"):
        read_published(path, lists=tmp_path / "lists.json")


def change_about(folder: Path, **new: object) -> None:
    path = folder / "guo.safetensors"
    about = {"format": 1, "kind": "guo-evaluator", "card": {}, "special": None, **new}
    save_file(load_file(path), path, metadata={"motionloom": json.dumps(about)})


def change_tensors(folder: Path, **new: torch.Tensor) -> None:
    path = folder / "guo.safetensors"
    about = json.dumps({"format": 1, "kind": "guo-evaluator", "card": {}, "special": None})
    save_file({**load_file(path), **new}, path, metadata={"motionloom": about})


@pytest.mark.parametrize(
    "damage",
    [
        lambda f: change_about(f, format=2),
        lambda f: change_about(f, kind="prior"),
        lambda f: change_about(f, card={"a": 1}),
        lambda f: change_about(f, special={"left": "VERB"}),
        lambda f: change_about(f, special=["left"]),
        lambda f: change_tensors(f, **{"words.text": torch.full((4,), 255, dtype=torch.uint8)}),
        lambda f: change_tensors(f, **{"words.vectors": torch.ones(5, 4)}),
        lambda f: change_tensors(f, mean=torch.ones(7)),
        lambda f: change_tensors(f, **{"net.text_encoder.hidden": torch.ones(2, 1, 6)}),
        lambda f: (f / "guo.safetensors").write_bytes((f / "guo.safetensors").read_bytes()[:-9]),
        lambda f: (f / "guo.safetensors").unlink(),
    ],
)
def test_a_damaged_or_foreign_file_is_reported(tmp_path: Path, damage) -> None:
    save_guo(read_published(files(tmp_path)), tmp_path / "guo.safetensors")
    damage(tmp_path)
    with pytest.raises(MotionloomError):
        load_guo(tmp_path / "guo.safetensors")
