"""The recipe of the embedded encoder: which pieces it keeps, and that it checks what it is given."""

import gzip
import json
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.minilm import SPECIALS
from tests.recorded.tiny import VOCABULARY
from tools import compress_text_encoder as compress


def chosen(captions: list[str], entries: int) -> list[str]:
    return [VOCABULARY[place] for place in compress.choose_pieces(VOCABULARY, captions, entries)]


def test_pieces_of_the_captions_specials_and_single_characters_are_always_kept() -> None:
    pieces = chosen(["an unaffable person"], 0)
    singles = [piece for piece in VOCABULARY if len(piece.removeprefix("##")) == 1]
    assert set(pieces) == {*SPECIALS, *singles, "un", "##aff", "##able", "person"}


def test_the_rest_is_filled_in_the_order_of_the_vocabulary() -> None:
    few = chosen([], 0)
    more = chosen([], len(few) + 3)
    assert [piece for piece in more if piece not in few] == ["person", "walks", "turns"]
    assert more == [piece for piece in VOCABULARY if piece in set(more)]


def test_captions_are_read_from_both_layouts(tmp_path: Path) -> None:
    rows = [{"captions": ["walk", "jump"]}, {"captions": [{"text": "turn left", "from_s": 0}]}]
    lines = "\n".join(map(json.dumps, rows))
    (tmp_path / "plain.jsonl").write_text(lines, encoding="utf-8")
    (tmp_path / "packed.jsonl.gz").write_bytes(gzip.compress(lines.encode()))
    for name in ("plain.jsonl", "packed.jsonl.gz"):
        assert list(compress.read_captions(tmp_path / name)) == ["walk", "jump", "turn left"]


def test_weights_with_another_checksum_are_refused(tmp_path: Path) -> None:
    (tmp_path / "model.safetensors").write_bytes(b"something else")
    with pytest.raises(MotionloomError, match="SHA-256"):
        compress.read_source(tmp_path)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compress, "PACKAGE", "no-such-package-for-motionloom")
    with pytest.raises(MotionloomError, match="pip install no-such-package"):
        compress.find_source()
