"""A client that a program makes of the OpenAPI document, and what it gets from a running server."""

import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from time import sleep
from types import ModuleType
from typing import Any

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")
pytest.importorskip("openapi_python_client", reason="needs the extra 'dev': it makes the client")

from tests.io.rigged import Hero
from tests.server.serving import Server, decoded

PACKAGE = "a_client_of_motionloom"


class Client:
    """The package that was made, and its operations by their names."""

    def __init__(self, package: ModuleType, server: Server) -> None:
        self.models, self.types = (importlib.import_module(f"{PACKAGE}.{name}") for name in ("models", "types"))
        self._client = package.Client(base_url=f"http://127.0.0.1:{server.port}", timeout=300)

    def __getattr__(self, operation: str) -> Callable[..., Any]:
        """What an operation's answer holds, as the client's own classes."""
        module = importlib.import_module(f"{PACKAGE}.api.default.{operation}")
        return lambda *arguments, **named: module.sync(*arguments, client=self._client, **named)

    def file(self, data: bytes) -> Any:
        return self.types.File(payload=BytesIO(data))


@pytest.fixture(scope="module")
def client(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A client made of what the server says of itself; not one warning is allowed."""
    folder = tmp_path_factory.mktemp("client")
    (folder / "openapi.json").write_bytes(server.ask("GET", "/openapi.json")[2])
    (folder / "config.json").write_text(json.dumps({"post_hooks": []}))
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning"]
    command += ["--path", str(folder / "openapi.json"), "--config", str(folder / "config.json")]
    process = subprocess.run(
        [*command, "--output-path", str(folder / PACKAGE)], capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    sys.path.insert(0, str(folder))
    yield Client(importlib.import_module(PACKAGE), server)
    sys.path.remove(str(folder))
    for name in [name for name in sys.modules if name.split(".")[0] == PACKAGE]:
        del sys.modules[name]


def test_every_module_of_the_client_can_be_imported(client: Client) -> None:
    folder = Path(importlib.import_module(PACKAGE).__file__ or "").parent
    modules = [path.relative_to(folder.parent).with_suffix("") for path in folder.rglob("*.py")]
    assert len(modules) > 40
    for module in modules:
        assert find_spec(".".join(module.parts)) is not None
        importlib.import_module(".".join(module.parts))


def test_the_client_asks_for_motion_and_gets_it(client: Client) -> None:
    models = client.models
    assert client.get_health().ok is True
    assert "generate" in client.get_capabilities().tasks
    body = models.GenerateRequest(task="generate", prompt="a person walks", seconds=1.0, steps=2, seed=3)
    answer = client.create_job(body=body)
    assert isinstance(answer, models.NewJob)
    while (job := client.get_job(answer.id)).state in (models.JobState.QUEUED, models.JobState.RUNNING):
        sleep(0.05)
    assert job.state is models.JobState.DONE
    (result,) = job.results
    assert (result.seed, result.frames, result.people) == (3, 20, 1)
    motion = client.get_motion(result.id)
    assert decoded(motion.people[0].root, 20, 3).shape == (20, 3)
    bvh = client.export_motion(result.id, models.MotionFormat.BVH, skeleton="mixamo")
    assert bvh.payload.read().startswith(b"HIERARCHY")
    assert "event: done" in client.follow_job(answer.id)


def test_the_client_sends_files_and_timelines(client: Client, tmp_path: Path) -> None:
    models = client.models
    hero = Hero(seed=2).write(tmp_path / "hero.glb").read_bytes()
    sent = client.upload_character(body=client.file(hero), name="hero.glb")
    assert isinstance(sent, models.SentCharacter)
    assert client.get_character(sent.id).payload.read() == hero
    timeline = models.Timeline(segments=["a person walks", models.Segment(text="a person jumps", seconds=2.0)], seed=4)
    text = client.timeline_to_yaml(body=timeline)
    assert text.startswith("segments:\n")
    again = client.timeline_to_json(body=client.file(text.encode()))
    assert again.to_dict() == timeline.to_dict()
    answer = client.create_job(body=models.ComposeRequest(task="compose", timeline=timeline, steps=2))
    assert client.cancel_job(answer.id).state is models.JobState.CANCELLED


def test_the_client_gets_sentences_for_mistakes(client: Client) -> None:
    models = client.models
    answer = client.create_job(body=models.GenerateRequest(task="generate", prompt=" "))
    assert isinstance(answer, models.Error)
    assert answer.error == "a prompt is empty; say in words what the person does"
