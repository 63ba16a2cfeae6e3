"""Words for Guo's text encoder: the user's files, read without running anything in them."""

import collections
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.guo_words import SPECIAL, TAGS, Words, padded, read_flat, read_special, read_words
from tests_lab.papers.test_mdm import Bomb

NAMES = ["sos", "eos", "unk", "walk", "left", "hand"]

# Of the form of the published file: names given to tuples, a dictionary of them, and code that must not run.
VECTORIZER = """
import numpy as np
open("was run", "w")
POS_enumerator = {"VERB": 0, "NOUN": 1}
Loc_list = ("left", "right")
Body_list = ("hand", "left")
Act_list = ["wave"]
VIP_dict = {
    "Loc_VIP": Loc_list, "Body_VIP": Body_list, "Obj_VIP": ("chair",), "Act_VIP": Act_list, "Desc_VIP": {"slowly"},
}
class WordVectorizer(object):
    pass
"""


def vectors(width: int = 4) -> np.ndarray:
    """A row of its own number for each word, in another order than the list's: row of word i is 5 - i."""
    return np.repeat(np.arange(6.0)[:, None], width, axis=1)


def published(folder: Path, *, width: int = 4, protocol: int = 3) -> Path:
    """The three files as the authors lay them out, and the file with the lists."""
    folder.mkdir(exist_ok=True)
    np.save(folder / "our_vab_data.npy", vectors(width))
    (folder / "our_vab_words.pkl").write_bytes(pickle.dumps(NAMES, protocol=protocol))
    rows = {word: 5 - i for i, word in enumerate(NAMES)}
    (folder / "our_vab_idx.pkl").write_bytes(pickle.dumps(rows, protocol=protocol))
    (folder / "word_vectorizer.py").write_text(VECTORIZER)
    return folder


@pytest.fixture
def words(tmp_path: Path) -> Words:
    return read_words(published(tmp_path), lists=tmp_path / "word_vectorizer.py")


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_each_word_has_the_vector_that_the_index_gives_it(tmp_path: Path, protocol: int) -> None:
    words = read_words(published(tmp_path, protocol=protocol))
    assert words.names == tuple(NAMES)
    assert words.vectors.dtype == np.float32
    assert words.vectors[:, 0].tolist() == [5, 4, 3, 2, 1, 0]
    assert words.special is None


@pytest.mark.parametrize(
    ("token", "row", "tag"),
    [
        ("walk/VERB", 2, "VERB"),
        ("walk/NOUN", 2, "NOUN"),
        ("walk/PUNCT", 2, "OTHER"),
        ("left/ADJ", 1, "Loc_VIP"),
        ("hand/NOUN", 0, "Body_VIP"),
        ("hover/VERB", 3, "OTHER"),
        ("chair/NOUN", 3, "OTHER"),
        ("sos/OTHER", 5, "OTHER"),
    ],
)
def test_lists_override_the_tag_and_an_unknown_word_is_unk(words: Words, token: str, row: int, tag: str) -> None:
    """``left`` is on two lists and belongs to the first; ``chair`` is listed but has no vector."""
    vector, number = words.look_up(token)
    assert vector.tolist() == [row] * 4
    assert TAGS[number] == tag


def test_without_lists_the_tag_stays(tmp_path: Path) -> None:
    assert TAGS[read_words(published(tmp_path)).look_up("left/ADJ")[1]] == "ADJ"


def test_a_token_without_its_part_of_speech_is_reported(words: Words) -> None:
    with pytest.raises(MotionloomError, match="part of speech"):
        words.look_up("walk")


@pytest.mark.parametrize(("count", "length"), [(0, 2), (3, 5), (19, 21), (20, 22), (21, 22), (60, 22)])
def test_a_caption_is_22_items_of_which_sos_and_eos_count(count: int, length: int) -> None:
    tokens = [f"w{i}/NOUN" for i in range(count)]
    items, found = padded(tokens)
    assert (len(items), found) == (22, length)
    assert items[0] == "sos/OTHER"
    assert items[1 : length - 1] == tokens[:20]
    assert items[length - 1] == "eos/OTHER"
    assert set(items[length:]) <= {"unk/OTHER"}


def test_the_parts_of_speech_are_in_the_published_order() -> None:
    assert len(TAGS) == 15
    assert (TAGS.index("VERB"), TAGS.index("ADV"), TAGS.index("Loc_VIP"), TAGS.index("OTHER")) == (0, 8, 9, 14)
    assert SPECIAL == ("Loc_VIP", "Body_VIP", "Obj_VIP", "Act_VIP", "Desc_VIP")


def test_plain_glove_text_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "glove.6B.3d.txt"
    path.write_text("".join(f"{word} {i} 0.5 -1e-2\n" for i, word in enumerate(NAMES)), encoding="utf-8")
    words = read_words(path)
    assert words.look_up("left/ADJ")[0].tolist() == pytest.approx([4, 0.5, -0.01])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("walk 1 2\nrun 1\n", "GloVe"),
        ("walk a b\n", "GloVe"),
        ("", "GloVe"),
        ("walk 1 2\n", "sos"),
        ("sos 1 nan\neos 1 1\nunk 1 1\n", "finite"),
        ("\x00\n", "sos"),
    ],
)
def test_other_text_is_not_taken_for_glove(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "glove.txt").write_text(text)
    with pytest.raises(MotionloomError, match=reason):
        read_words(tmp_path / "glove.txt")


def test_the_lists_are_parsed_and_the_file_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = published(tmp_path) / "word_vectorizer.py"
    table = {"left": "Loc_VIP", "right": "Loc_VIP", "hand": "Body_VIP", "chair": "Obj_VIP", "wave": "Act_VIP"}
    assert read_special(path) == {**table, "slowly": "Desc_VIP"}
    assert not Path("was run").exists()
    Path("lists.json").write_text(json.dumps({"Loc_VIP": ["left"], "Body_VIP": ["hand", "left"]}))
    assert read_special("lists.json") == {"left": "Loc_VIP", "hand": "Body_VIP"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.py", "x = 1"),
        ("a.py", "def ("),
        ("a.py", "(" * 5000),
        ("a.py", "\x00"),
        ("a.py", VECTORIZER.replace("Loc_list = (", "Loc_list = tuple(")),
        ("a.py", VECTORIZER.replace('"right"', "right")),
        ("a.py", VECTORIZER.replace('"right"', "3")),
        ("a.json", "[1]"),
        ("a.json", "[" * 100_000),
        ("a.json", '{"Loc_VIP": "left"}'),
        ("a.json", '{"Loc": ["left"]}'),
        ("a.json", "{"),
    ],
)
def test_other_files_give_no_lists(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(MotionloomError, match="lists of special words"):
        read_special(tmp_path / name)
    with pytest.raises(MotionloomError):
        read_special(tmp_path / "absent.py")


word = st.text(st.characters(exclude_categories=["Cs"]), max_size=300)
whole = st.integers(-(2**63), 2**63 - 1)
values = st.one_of(st.lists(word | whole), st.dictionaries(word, whole))


@given(values, st.integers(2, 5))
def test_plain_values_come_back_as_they_were(tmp_path_factory: pytest.TempPathFactory, value, protocol: int) -> None:
    path = tmp_path_factory.mktemp("plain") / "a.pkl"
    path.write_bytes(pickle.dumps(value, protocol=protocol))
    assert read_flat(path) == value


def test_a_long_list_and_a_repeated_word_come_back(tmp_path: Path) -> None:
    """More than one batch of a thousand items, and words that the pickle refers back to."""
    value = [f"word{i % 1500}" for i in range(4000)]
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(value, protocol=3))
    assert read_flat(tmp_path / "a.pkl") == value


@given(st.binary(max_size=60), st.integers(0, 80), st.integers(0, 255))
def test_damaged_bytes_are_a_mistake_and_nothing_else(
    tmp_path_factory: pytest.TempPathFactory, more: bytes, at: int, new: int
) -> None:
    data = bytearray(pickle.dumps(dict.fromkeys(NAMES, 3), protocol=3))
    data[at % len(data)] = new
    for attempt in (bytes(data), bytes(data[:at]), more, b"\x80\x03" + more + b"."):
        path = tmp_path_factory.mktemp("damaged") / "a.pkl"
        path.write_bytes(attempt)
        try:
            value = read_flat(path)
        except MotionloomError:
            continue
        assert isinstance(value, list | dict)


def itself() -> list:
    result: list = []
    result.append(result)
    return result


@pytest.mark.parametrize(
    "value",
    [
        Bomb(Path("was run")),
        [Bomb(Path("was run"))],
        {"a": Bomb(Path("was run"))},
        print,
        [["a"]],
        {"a": ["b"]},
        itself(),
        collections.OrderedDict(a=1),
        {1, 2},
        ("a",),
        {"a": True},
        {1.5: 2},
        np.ones(2),
        [1.5],
        [b"a"],
        [None],
        "a",
        7,
        np.int64(3),
        [np.int64(3)],
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize("protocol", [2, 4])
def test_anything_that_is_not_plain_is_refused_and_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value, protocol: int
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.pkl").write_bytes(pickle.dumps(value, protocol=protocol))
    with pytest.raises(MotionloomError, match="not opened"):
        read_flat("a.pkl")
    assert not Path("was run").exists()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda f: (f / "our_vab_idx.pkl").write_bytes(pickle.dumps(dict.fromkeys(NAMES, 6))), "row"),
        (lambda f: (f / "our_vab_idx.pkl").write_bytes(pickle.dumps(dict.fromkeys(NAMES, -1))), "row"),
        (lambda f: (f / "our_vab_idx.pkl").write_bytes(pickle.dumps(dict.fromkeys(NAMES, "1"))), "row"),
        (lambda f: (f / "our_vab_idx.pkl").write_bytes(pickle.dumps({"walk": 1})), "row"),
        (lambda f: (f / "our_vab_idx.pkl").unlink(), "our_vab_idx"),
        (lambda f: (f / "our_vab_words.pkl").write_bytes(pickle.dumps([*NAMES, "walk"])), "row"),
        (lambda f: (f / "our_vab_words.pkl").write_bytes(pickle.dumps({"a": 1})), "list of words"),
        (lambda f: (f / "our_vab_words.pkl").write_bytes(pickle.dumps(NAMES[1:])), "sos"),
        (lambda f: np.save(f / "our_vab_data.npy", np.full((6, 4), np.nan)), "finite"),
        (lambda f: np.save(f / "our_vab_data.npy", np.ones(6)), "row"),
        (lambda f: np.save(f / "our_vab_data.npy", np.array([Bomb(f / "was run")]), allow_pickle=True), "npy"),
    ],
)
def test_published_files_that_do_not_fit_are_reported(tmp_path: Path, change, reason: str) -> None:
    change(published(tmp_path))
    with pytest.raises(MotionloomError, match=reason):
        read_words(tmp_path)
    assert not (tmp_path / "was run").exists()
