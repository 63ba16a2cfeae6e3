"""What commands say."""

import pytest


def complaint(capsys: pytest.CaptureFixture[str]) -> str:
    """What was said on stderr since the last look, which is one line in the name of the command."""
    said = capsys.readouterr().err
    assert said.startswith("motionloom: ")
    assert said.count("\n") == 1
    return said
