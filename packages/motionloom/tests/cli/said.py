"""What commands say."""

import pytest


def complaint(capsys: pytest.CaptureFixture[str]) -> str:
    """What was said on stderr since the last look, which is one line in the name of the command."""
    line = capsys.readouterr().err
    assert line.startswith("motionloom: ")
    assert line.count("\n") == 1
    return line
