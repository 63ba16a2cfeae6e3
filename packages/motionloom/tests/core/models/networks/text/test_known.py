"""What a prior knows in words: subjects cut off, tables that cover, nearest sentences, files."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.arrays import unit
from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.known import (
    Known,
    Nearest,
    add_sentences,
    bare,
    known_sentences,
    nearest,
    pack_known,
    unpack_known,
)
from motionloom.core.models.networks.text.protocol import TextEmbedding
from motionloom.core.models.prior import Prior
from motionloom.goals.remarks import nearest_known


class Letters:
    """A text encoder whose vector counts letters: what is spelt alike is near."""

    name, width = "letters", 26

    def encode(self, texts: Any) -> TextEmbedding:
        rows = np.zeros((len(texts), 26), np.float32)
        for row, text in enumerate(texts):
            for letter in text.lower():
                if letter.isascii() and letter.isalpha():
                    rows[row, ord(letter) - 97] += 1
        return TextEmbedding(rows[:, None], np.ones((len(texts), 1), bool), rows)


@pytest.mark.parametrize(
    ("sentence", "action"),
    [
        ("A person walks forward.", "walks forward"),
        ("a person is walking", "walking"),
        ("someone waves", "waves"),
        ("the young man appears to be dancing", "dancing"),
        ("He  kicks", "kicks"),
        ("walks", "walks"),
        ("a person", "a person"),
        ("a personal trainer squats", "a personal trainer squats"),
        ("itches his nose", "itches his nose"),
        ("two people dance", "dance"),
    ],
)
def test_the_subject_is_cut_off(sentence: str, action: str) -> None:
    assert bare(sentence) == action


def test_a_table_covers_what_it_leaves_out() -> None:
    """Farthest first: of two groups of like sentences a table of two has one of each."""
    said = ["aaa", "aaab", "aaaab", "zzz", "zzzy"]
    known = known_sentences(said, {}, Letters(), most=2)  # type: ignore[arg-type]
    assert {sentence[0] for sentence in known.sentences} == {"a", "z"}


def test_sentences_that_must_be_in_are() -> None:
    known = known_sentences(["aaa", "zzz", "mmm"], {}, Letters(), first=["aab"], most=2)  # type: ignore[arg-type]
    assert "aab" in known.sentences
    assert len(known.sentences) == 2


def test_a_table_without_sentences_is_refused() -> None:
    with pytest.raises(MotionloomError, match="no training sentence"):
        known_sentences([" "], {}, Letters())  # type: ignore[arg-type]


def test_the_nearest_sentences_come_first_and_far_ones_get_a_remark() -> None:
    known = known_sentences(["walks", "waves", "zigzags"], {}, Letters())  # type: ignore[arg-type]
    same, far = nearest(known, ["a person walks", "a person hunkered"], Letters(), count=2)  # type: ignore[arg-type]
    assert same.sentences[0] == "walks"
    assert same.similarity == pytest.approx(1, abs=1e-6)
    assert same.near
    assert not far.near
    assert far.remark().startswith("these weights have seen nothing like 'hunkered'; nearest: '")


def test_one_sentence_with_the_same_noun_makes_no_prompt_known() -> None:
    """The mean over the nearest eight decides, unless one says nearly the same."""
    said, asked = np.eye(9, dtype=np.float32)[1:], np.zeros((1, 9), np.float32)
    asked[0, :2] = 0.7

    class Fixed(Letters):
        def encode(self, texts: Any) -> TextEmbedding:
            return TextEmbedding(asked[:, None], np.ones((1, 1), bool), asked)

    def found(known: Known) -> bool:
        return nearest(known, ["plays golf"], Fixed())[0].near  # type: ignore[arg-type]

    names = tuple(f"sentence {number}" for number in range(8))
    assert not found(Known(names, said, {}))  # 0.7 to one, 0 to seven
    assert found(Known(names, np.repeat(said[:1], 8, axis=0), {}))  # 0.7 to all
    assert found(Known(names, np.concatenate([asked / np.linalg.norm(asked), said[1:]]), {}))  # the same as one


def test_more_sentences_make_a_prompt_known() -> None:
    known = known_sentences(["walks"], {"walk": 3.0}, Letters())  # type: ignore[arg-type]
    more = add_sentences(known, ["a zombie hobbles"], Letters())  # type: ignore[arg-type]
    assert not nearest(known, ["a zombie hobbles"], Letters())[0].near  # type: ignore[arg-type]
    assert nearest(more, ["a zombie hobbles"], Letters())[0].similarity == pytest.approx(1, abs=1e-6)  # type: ignore[arg-type]
    assert more.seconds == {"walk": 3.0}


def test_the_weights_that_ship_know_everyday_actions_and_no_golf() -> None:
    """Of each kind most: docs/words.md has the shares."""
    prior = Prior.load("default")
    assert prior.known is not None
    unknown = ["a man plays golf", "a woman rides a bicycle", "a woman irons a shirt", "he drives a car"]
    assert sum(found.near for found in nearest_known(unknown, prior.known, prior.text)) <= 1
    everyday = ["a person walks forward", "someone jumps", "a person sits down", "a man waves with the right hand"]
    assert all(found.near for found in nearest_known(everyday, prior.known, prior.text))


def table() -> Known:
    vectors = unit(np.random.default_rng(1).standard_normal((3, 8), np.float32))
    return Known(("walks", "waves", "sits"), vectors, {"walk": 12.25, "sit": 3.0})


def test_a_table_comes_back_from_its_file() -> None:
    """Eight bits a number: directions move by less than a hundredth, seconds by less than a tenth."""
    known = table()
    again = unpack_known(*pack_known(known), width=8)
    assert again.sentences == known.sentences
    assert again.seconds == pytest.approx(known.seconds, abs=0.051)
    assert (again.vectors * known.vectors).sum(1).min() > 0.999


Change = tuple[str, Any]


@pytest.mark.parametrize(
    "change",
    [
        {"sentences": "walks"},
        {"sentences": []},
        {"sentences": ["walks", "waves", 3]},
        {"sentences": ["walks", "waves"]},
        {"sentences": ["walks", "waves", "s" * 2000]},
        {"sentences": ["s"] * 10_000},
        {"seconds": [1, 2]},
        {"seconds": {"walk": -1}},
        {"seconds": {"walk": float("nan")}},
        {"seconds": {"walk": "long"}},
    ],
)
def test_a_damaged_description_is_refused(change: dict[str, Any]) -> None:
    tensors, about = pack_known(table())
    with pytest.raises(ValueError, match="table of known"):
        unpack_known(tensors, about | change, width=8)


@pytest.mark.parametrize(
    "tensors",
    [
        {},
        {"known.vectors": np.zeros((3, 8), np.float32), "known.scale": np.ones(3, np.float16)},
        {"known.vectors": np.zeros((3, 9), np.int8), "known.scale": np.ones(3, np.float16)},
        {"known.vectors": np.zeros((3, 8), np.int8), "known.scale": np.ones(2, np.float16)},
        {"known.vectors": np.zeros((3, 8), np.int8), "known.scale": np.full(3, np.inf, np.float16)},
    ],
)
def test_damaged_vectors_are_refused(tensors: dict[str, np.ndarray]) -> None:
    with pytest.raises(ValueError, match="table of known"):
        unpack_known(tensors, pack_known(table())[1], width=8)


json_like = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=8,
)


@given(json_like)
@settings(max_examples=80, deadline=None)
def test_whatever_the_description_is_it_is_read_or_refused(about: Any) -> None:
    try:
        known = unpack_known(pack_known(table())[0], about, width=8)
    except ValueError:
        return
    assert len(known.sentences) == len(known.vectors)


def test_a_prompt_of_signs_alone_is_quoted_as_it_is() -> None:
    assert Nearest(" ??? ", ("claps",), 0.1, 0.1).remark().startswith("these weights have seen nothing like '???'; ")
