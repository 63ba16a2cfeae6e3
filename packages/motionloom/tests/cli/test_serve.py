"""How `motionloom serve` and `motionloom studio` start, or do not."""

import os
import socket
from pathlib import Path

import pytest

from motionloom.cli import main

pytest.importorskip("uvicorn", reason="the server's packages are not installed")


@pytest.mark.parametrize(
    ("cores", "setting", "expected"), [(4, None, "3"), (2, None, "1"), (1, None, "1"), (4, "4", "4")]
)
@pytest.mark.parametrize("command", ["serve", "studio"])
def test_a_core_is_left_to_the_page(
    monkeypatch: pytest.MonkeyPatch, command: str, cores: int, setting: str | None, expected: str
) -> None:
    """MOTIONLOOM_THREADS when the server begins; what the user said stays."""
    values = []
    monkeypatch.setattr(
        "motionloom.server.serving.serve", lambda options: values.append(os.environ["MOTIONLOOM_THREADS"])
    )
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(cores)), raising=False)
    monkeypatch.setenv("MOTIONLOOM_THREADS", setting or "1")  # so that it is as it was behind the test
    if setting is None:
        monkeypatch.delenv("MOTIONLOOM_THREADS")
    main([command])
    assert values == [expected]


@pytest.mark.parametrize("why", ["port", "host", "token", "robot", "adapter"])
def test_a_server_that_is_refused_leaves_no_folder(
    tmp_path: Path, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        wrong = {
            "port": ["--port", str(taken.getsockname()[1])],
            "host": ["--host", "no.such.host.invalid", "--port", "0"],
            "token": ["--token", "short"],
            "robot": ["--robot", str(tmp_path / "absent.xml"), "--port", "0"],
            "adapter": ["--adapter", str(tmp_path / "absent.safetensors")],
        }[why]
        assert main(["serve", *wrong, "--project", str(tmp_path / "mine" / "project")]) == 2
    assert capsys.readouterr().err.startswith("motionloom")
    assert list(tmp_path.iterdir()) == []
