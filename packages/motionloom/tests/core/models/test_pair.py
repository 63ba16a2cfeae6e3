"""Files of two-person blocks hold what their pairs were called."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import PAIRS
from motionloom.core.models.networks.text.known import known_sentences, nearest
from motionloom.core.models.pair import PairBlock
from tests.recorded import tiny
from tests.tasks.two_people import block as block_of


def test_what_a_block_knows_comes_back(tmp_path: Path) -> None:
    prior = tiny.prior()
    known = known_sentences(["dance salsa together", "waltzes"], {}, prior.text)
    assert known.sentences == ("dance salsa together", "waltzes")
    block = replace(block_of(prior), known=known)
    read = PairBlock.load(block.save(tmp_path / "duet.safetensors"), prior)
    assert read.known is not None
    assert read.known.sentences == known.sentences
    np.testing.assert_allclose(read.known.vectors, known.vectors, atol=0.02)
    [found] = nearest(read.known, ["dance salsa together"], prior.text)
    assert found.near
    assert read.tensors.keys() == block.tensors.keys()


def test_files_without_a_table_are_read_and_say_nothing(tmp_path: Path) -> None:
    prior = tiny.prior()
    assert PairBlock.load(block_of(prior).save(tmp_path / "duet.safetensors"), prior).known is None


def test_a_damaged_table_is_refused(tmp_path: Path) -> None:
    prior = tiny.prior()
    known = known_sentences(["two people dance"], {}, prior.text)
    path = replace(block_of(prior), known=known).save(tmp_path / "duet.safetensors")
    about, tensors = PAIRS.read(path)
    del tensors["known.vectors"]
    PAIRS.write(path, tensors, about)
    with pytest.raises(MotionloomError, match=r"duet\.safetensors"):
        PairBlock.load(path, prior)
