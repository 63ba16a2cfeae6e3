"""Corrections of captions: a table says what a caption of a recording becomes before anything is learned from it.

A table is TOML of three parts. ``[words]`` replaces words in every caption; ``[captions]`` replaces whole captions, and
``[clips.NAME]`` those of one clip, before the words are looked at. A caption becomes one caption, several (a list), or
none (an empty string); a row whose caption ends with " ..." is for captions that begin so.
"""

import functools
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import read_utf8
from motionloom_train.data.sources import Take
from motionloom_train.data.words import check_caption

MAX_BYTES = 4 << 20
"""Of a table's file."""
OPEN = " ..."
"""Ends a row's caption of which only the beginning is written."""

Captions = Mapping[str, tuple[str, ...]]
"""Captions, each with those that it becomes."""


@dataclass(frozen=True)
class Corrections:
    """What captions become."""

    words: Mapping[str, str] = field(default_factory=dict)
    """Words in lower case, each with the words that replace it."""
    captions: Captions = field(default_factory=dict)
    clips: Mapping[str, Captions] = field(default_factory=dict)
    """By the name of the clip; a clip's rows come before those of `captions`."""

    def corrected(self, clip: str, texts: Sequence[str]) -> tuple[str, ...]:
        """The captions of a stretch of a clip.

        clip: its name. texts: captions as recorded. Returns captions without repetitions, in order; perhaps none.
        """
        rows = {**self.captions, **self.clips.get(clip, {})}
        changed = (new for text in texts for new in _row(rows, " ".join(text.split())))
        return tuple(dict.fromkeys(self._reworded(text) for text in changed))

    def take(self, take: Take) -> Take:
        """A take with its captions corrected; stretches that lose all of them lose their description."""
        written = {span: self.corrected(take.name, span.texts) for span in take.spans if span.kind == "human"}
        spans = (replace(span, texts=written.get(span, span.texts)) for span in take.spans)
        return replace(take, spans=tuple(span for span in spans if span.texts))

    def _reworded(self, text: str) -> str:
        return re.sub(r"[A-Za-z']+", lambda match: self.words.get(match[0].lower(), match[0]), " ".join(text.split()))


@functools.cache
def read_corrections(path: Path | str) -> Corrections:
    """A table of corrections from a TOML file; raises MotionloomError for what is none."""
    text = read_utf8(path, max_bytes=MAX_BYTES)
    try:
        table = tomllib.loads(text)
        if unknown := table.keys() - {"words", "captions", "clips"}:
            raise ValueError(f"there is no part {sorted(unknown)[0]!r}")
        words = {word.lower(): _text(new) for word, new in table.get("words", {}).items()}
        clips = {clip: _captions(rows) for clip, rows in table.get("clips", {}).items()}
        return Corrections(words, _captions(table.get("captions", {})), clips)
    except (AttributeError, TypeError, ValueError) as error:
        raise MotionloomError(
            f"{path} is no table of corrections ({error}); write [words], [captions] and [clips.NAME] with rows "
            '"caption" = "better caption"'
        ) from None


def _row(rows: Captions, text: str) -> tuple[str, ...]:
    """What a caption becomes: by the row of its whole text, else by the one of how it begins, else itself."""
    begins = (new for old, new in rows.items() if old.endswith(OPEN) and text.startswith(old.removesuffix(OPEN)))
    return rows[text] if text in rows else next(begins, (text,))


def _captions(rows: Mapping[str, Any]) -> Captions:
    return {old: tuple(map(_text, new if isinstance(new, list) else [new] if new else [])) for old, new in rows.items()}


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"{value!r} is no text")
    check_caption(value)
    return value
