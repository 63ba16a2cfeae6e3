"""What tests of commands share: a tiny prior, and somebody who presses Ctrl-C."""

import signal
from collections.abc import Iterator

import pytest

from motionloom.core.models.prior import save_prior
from motionloom.core.motion import Motion
from motionloom.io import stream
from tests.recorded import tiny


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a tiny prior with random weights."""
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture
def ctrl_c(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Ctrl-C as soon as the first piece of a long motion is written."""
    write = stream.Stream.write

    def interrupted(self: stream.Stream, piece: Motion) -> None:
        write(self, piece)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(stream.Stream, "write", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs are started deaf to it
    yield
    signal.signal(signal.SIGINT, before)
