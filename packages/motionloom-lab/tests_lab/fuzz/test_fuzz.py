"""A short run of the fuzzer over the readers of training and the laboratory."""

import pytest

from tests.fuzz import readers
from tests.fuzz.machine import fuzz
from tests_lab.fuzz.readers import OWN


def test_every_reader_answers_damaged_files_with_a_value_or_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few files of each; `make fuzz` is for longer runs."""
    monkeypatch.setattr(readers, "READERS", OWN)
    result = fuzz(seconds=600.0, files=6 * len(OWN), seed=20)
    assert not result.failures, result.report()
    assert result.tried.keys() == {reader.name for reader in OWN}
