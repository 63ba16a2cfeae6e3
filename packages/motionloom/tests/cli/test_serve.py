"""How many threads `motionloom serve` and `motionloom studio` sample with."""

import os

import pytest

from motionloom.cli import main

pytest.importorskip("uvicorn", reason="the server's packages are not installed")


@pytest.mark.parametrize(("cores", "said", "wanted"), [(4, None, "3"), (2, None, "1"), (1, None, "1"), (4, "4", "4")])
@pytest.mark.parametrize("command", ["serve", "studio"])
def test_a_core_is_left_to_the_page(
    monkeypatch: pytest.MonkeyPatch, command: str, cores: int, said: str | None, wanted: str
) -> None:
    """MOTIONLOOM_THREADS when the server begins; what the user said stays."""
    seen = []
    monkeypatch.setattr(
        "motionloom.server.serving.serve", lambda options: seen.append(os.environ["MOTIONLOOM_THREADS"])
    )
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(cores)), raising=False)
    monkeypatch.setenv("MOTIONLOOM_THREADS", said or "1")  # so that it is as it was behind the test
    if said is None:
        monkeypatch.delenv("MOTIONLOOM_THREADS")
    main([command])
    assert seen == [wanted]
