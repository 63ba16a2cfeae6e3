"""Words as Guo's text encoder reads them: a vector and a part of speech each, from the user's own files.

Nothing of those files ships here. Vectors come as the text-to-motion repository distributes them (``our_vab_data.npy``,
``our_vab_words.pkl``, ``our_vab_idx.pkl``) or as plain GloVe text. The lists of words whose part of speech is
overridden (``Loc_VIP`` and so on) are read from that repository's ``word_vectorizer.py``, parsed and never run,
or from JSON.
"""

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import plain_json
from motionloom.core.reading import read_bytes
from motionloom.io import npz
from motionloom_lab.papers.plain_pickle import read_plain_file
from motionloom_train.data.paths import DAMAGED

TAGS = (
    "VERB",
    "NOUN",
    "DET",
    "ADP",
    "NUM",
    "AUX",
    "PRON",
    "ADJ",
    "ADV",
    "Loc_VIP",
    "Body_VIP",
    "Obj_VIP",
    "Act_VIP",
    "Desc_VIP",
    "OTHER",
)
"""The 15 parts of speech, in the order of the network's one-hot input."""
SPECIAL = TAGS[9:14]
"""Those given by word lists, not by a tagger."""
START, END, UNKNOWN = "sos", "eos", "unk"
LONGEST = 20
"""Words of a caption that are read."""
TOKENS = LONGEST + 2
"""Items of every padded caption: the words with ``sos`` and ``eos``."""
MAX_WORDS = 1 << 19
MAX_BYTES = 1 << 30
_MAX_LIST_BYTES = 16 << 20


@dataclass(frozen=True, eq=False)
class Words:
    """Word vectors and the words whose part of speech is overridden."""

    names: tuple[str, ...]
    vectors: np.ndarray
    """(words, width) float32."""
    special: Mapping[str, str] | None = None
    """Word to its ``.._VIP`` class; None where no lists were given."""

    def __post_init__(self) -> None:
        if self.vectors.ndim != 2 or len(self.names) != len(self.vectors) or not np.isfinite(self.vectors).all():
            raise MotionloomError(
                f"{len(self.names)} words need as many finite vectors; got an array of shape {self.vectors.shape}"
            )
        missing = [word for word in (START, END, UNKNOWN) if word not in self.names]
        if missing:
            raise MotionloomError(
                f"the word vectors lack {missing[0]!r}, which every caption needs; take the published our_vab files"
            )
        if not all(word.isprintable() for word in self.names):
            raise MotionloomError("the word vectors have a word that cannot be printed; fetch them again")

    @cached_property
    def rows(self) -> dict[str, int]:
        """The row of each word."""
        return {word: row for row, word in enumerate(self.names)}

    def look_up(self, token: str) -> tuple[np.ndarray, int]:
        """The vector and the number of the part of speech (in `TAGS`) of a ``word/POS`` token.

        A word without a vector is ``unk`` and OTHER; a listed word has its list's class, whatever its tag is.
        """
        word, slash, tag = token.rpartition("/")
        if not slash:
            raise MotionloomError(f"the token {token!r} has no part of speech; HumanML3D's text files write walk/VERB")
        if word not in self.rows:
            return self.vectors[self.rows[UNKNOWN]], TAGS.index("OTHER")
        tag = (self.special or {}).get(word, tag)
        return self.vectors[self.rows[word]], TAGS.index(tag if tag in TAGS else "OTHER")


def padded(tokens: Sequence[str]) -> tuple[list[str], int]:
    """A caption's tokens as 22 items, and how many of them count: sos, at most 20 words, eos; then unk."""
    items = [f"{START}/OTHER", *tokens[:LONGEST], f"{END}/OTHER"]
    return items + [f"{UNKNOWN}/OTHER"] * (TOKENS - len(items)), len(items)


def read_words(path: Path | str, *, lists: Path | str | None = None) -> Words:
    """Word vectors from a folder with the ``our_vab`` files or from one file of plain GloVe text; ``lists`` as in
    `read_special`. Raises MotionloomError for files that are missing, too large, damaged or of another kind."""
    path = Path(path)
    if not path.exists():
        raise MotionloomError(f"there is no {path}; name the folder with our_vab_data.npy, or a GloVe text file")
    names, vectors = _published(path) if path.is_dir() else _glove(path)
    return Words(names, vectors, None if lists is None else read_special(lists))


def _published(folder: Path) -> tuple[tuple[str, ...], np.ndarray]:
    vectors = read_array(folder / "our_vab_data.npy")
    words, rows = read_flat(folder / "our_vab_words.pkl"), read_flat(folder / "our_vab_idx.pkl")
    if not isinstance(words, list) or not all(isinstance(w, str) for w in words) or not isinstance(rows, dict):
        raise MotionloomError(f"{folder}: our_vab_words.pkl must be a list of words, our_vab_idx.pkl a table of rows")
    places = [rows.get(word) for word in words]
    good = vectors.ndim == 2 and all(type(row) is int and 0 <= row < len(vectors) for row in places)
    if not good or len(words) > MAX_WORDS or len(set(words)) != len(words):
        raise MotionloomError(
            f"{folder}: the {len(words)} words do not each have a row of the {vectors.shape} numbers of "
            "our_vab_data.npy; fetch the three files again"
        )
    return tuple(words), vectors[np.array(places, dtype=np.int64)].astype(np.float32)


def _glove(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    rows: dict[str, np.ndarray] = {}
    try:
        with path.open(encoding="utf-8") as lines:
            while line := lines.readline(1 << 16):
                word, *numbers = line.rstrip("\n").split(" ")
                if len(rows) == MAX_WORDS or not word or len(numbers) > 512:
                    raise ValueError(f"line {len(rows) + 1} is no word with its numbers")
                rows.setdefault(word, np.array(numbers, dtype=np.float32))
        vectors = np.stack(list(rows.values()))
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(f"{path} is not GloVe text, a word and its numbers on each line ({reason})") from None
    return tuple(rows), vectors


def read_special(path: Path | str) -> dict[str, str]:
    """Word to ``.._VIP`` class, from the published ``word_vectorizer.py`` or from JSON: ``{"Loc_VIP": ["left"]}``.

    Of Python only literals are looked at: tuples, lists and sets of strings given to a name, and the dictionary whose
    keys are the five classes. Nothing is run. A word on two lists belongs to the first.
    """
    path = Path(path)
    try:
        text = read_bytes(path, max_bytes=1 << 20).decode("utf-8")
        table = plain_json(text) if path.suffix == ".json" else _literal_lists(text)
        if not isinstance(table, dict) or not set(table) <= set(SPECIAL):
            raise ValueError(f"the classes are {', '.join(SPECIAL)}")
        classes: dict[str, str] = {}
        for name, words in table.items():
            if not isinstance(words, list | tuple | set) or not all(isinstance(word, str) for word in words):
                raise ValueError(f"{name} is no list of words")
            for word in words:
                classes.setdefault(word, name)
        return classes
    except (*DAMAGED, SyntaxError, MemoryError) as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(f"{path} gives no lists of special words ({reason}); name word_vectorizer.py") from None


def _literal_lists(text: str) -> dict[str, object]:
    lists: dict[str, object] = {}
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign) or len(node.targets) != 1 or not isinstance(node.targets[0], ast.Name):
            continue
        value = node.value
        if isinstance(value, ast.Tuple | ast.List | ast.Set):
            lists[node.targets[0].id] = ast.literal_eval(value)
        elif isinstance(value, ast.Dict):
            keys = [key.value if isinstance(key, ast.Constant) else None for key in value.keys]
            if set(keys) == set(SPECIAL):
                return {
                    str(key): lists.get(item.id) if isinstance(item, ast.Name) else ast.literal_eval(item)
                    for key, item in zip(keys, value.values, strict=True)
                }
    raise ValueError("no dictionary has the classes Loc_VIP, Body_VIP, Obj_VIP, Act_VIP and Desc_VIP as its keys")


def read_array(path: Path | str) -> np.ndarray:
    """A .npy array of finite floating-point numbers, without pickle; raises MotionloomError for anything else."""
    values = npz.read_array(path, max_bytes=MAX_BYTES)
    if values.dtype.kind != "f" or not np.isfinite(values).all():
        raise MotionloomError(f"{path} holds something else than finite floating-point numbers; fetch it again")
    return values


def read_flat(path: Path | str) -> list[Any] | dict[Any, Any]:
    """One list or one table of strings and whole numbers, out of a pickle that is read and never run.

    Raises MotionloomError for a file that is missing, larger than 16 MiB, damaged, or holds anything else.
    """
    content = read_plain_file(path, limit=_MAX_LIST_BYTES)
    values = [*content, *content.values()] if isinstance(content, dict) else content
    if not isinstance(values, list) or not all(type(value) in (str, int) for value in values):
        raise MotionloomError(f"{path} is not a plain list or table of words and is not opened; fetch it again")
    return cast(list[Any] | dict[Any, Any], content)
