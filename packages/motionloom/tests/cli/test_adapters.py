"""--adapter, as a stranger types it, on a tiny prior with random weights."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.features import humanml
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.prior import Prior, save_prior
from tests.cli.said import complaint
from tests.kinematics import people
from tests.recorded import tiny
from tests.server.serving import running
from tests.tasks.test_edit import person


@pytest.fixture(scope="module")
def knowing(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a tiny prior around a walking person that says what it knows."""
    features = humanml.motion_to_features(person(2.0))
    std = np.full(263, 0.02, np.float32)
    prior = replace(tiny.prior(), mean=features.mean(0), std=std)
    known = known_sentences(["a person walks", "a person turns left"], {"walk": 90.0, "turn left": 4.0}, prior.text)
    return str(save_prior(replace(prior, known=known), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in a folder of its own that holds two clips."""
    monkeypatch.chdir(tmp_path)
    clips = tmp_path / "clips"
    clips.mkdir()
    for name, speed in (("one", 1.0), ("two", 1.3)):
        io.save(motion_from_positions(people.walking(speed, 2.0), people.FPS), clips / f"{name}.bvh")
    return tmp_path


@pytest.fixture(scope="module")
def zombie(knowing: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """An adapter whose every number matters."""
    return str(tiny.adapter(Prior.load(knowing)).save(tmp_path_factory.mktemp("adapters") / "zombie.safetensors"))


def positions_of(*words: str) -> np.ndarray:
    assert main([*words, "--steps", "2", "--out", "a.npz"]) == 0
    return io.load("a.npz").positions()


def test_every_command_that_draws_takes_adapters(knowing: str, zombie: str, capsys: pytest.CaptureFixture[str]) -> None:
    goal = {"path": {"points": [[0, 0], [0, 1.5]]}}
    Path("goal.json").write_text(json.dumps(goal))
    Path("zombie.safetensors").write_bytes(Path(zombie).read_bytes())
    Path("t.yaml").write_text("segments:\n- {text: a person walks, seconds: 2, adapters: zombie.safetensors:0.5}\n")
    lines = (
        ["generate", "a person walks", "--seconds", "2"],
        ["compose", "a person walks", "a person turns", "--seconds", "2"],
        ["control", "a person walks", "--goal", "goal.json", "--seconds", "2"],
        ["edit", "clips/one.bvh", "a person turns", "--between", "0.5", "1.5"],
    )
    for line in lines:
        plain = positions_of(*line, "--weights", knowing)
        changed = positions_of(*line, "--weights", knowing, "--adapter", f"{zombie}:1")
        assert np.abs(plain - changed).max() > 1e-3
        capsys.readouterr()
        assert np.array_equal(plain, positions_of(*line, "--weights", knowing, "--adapter", zombie))
        assert "is generated without the adapter 'a1', which was taught 'caption 1'" in capsys.readouterr().err
        none = positions_of(*line, "--weights", knowing, "--adapter", f"{zombie}:1", "--adapter", f"{zombie}:-1")
        assert np.abs(plain - none).max() < 1e-2
    half = positions_of("compose", "t.yaml", "--weights", knowing)
    whole = positions_of(
        "compose", "a person walks", "--seconds", "2", "--weights", knowing, "--adapter", f"{zombie}:0.5"
    )
    assert np.abs(half - whole).max() < 1e-3


def test_the_server_draws_with_adapters_as_generate_does(knowing: str, zombie: str) -> None:
    pytest.importorskip("uvicorn", reason="needs the extra 'studio': pip install 'motionloom[studio]'")
    line = ["--weights", knowing, "--adapter", f"{zombie}:1"]
    with running(Path("project"), *line) as server:
        job = server.draw(task="generate", prompt="a person walks", seconds=2.0, seed=0, steps=2)
        Path("served.npz").write_bytes(server.ask("GET", f"/motions/{job['results'][0]['id']}.npz")[2])
    changed = positions_of("generate", "a person walks", "--seconds", "2", *line)
    assert np.abs(io.load("served.npz").positions() - changed).max() < 1e-3
    assert (
        np.abs(changed - positions_of("generate", "a person walks", "--seconds", "2", "--weights", knowing)).max()
        > 2e-3
    )


@pytest.mark.parametrize("command", ["serve", "studio", "mcp"])
def test_servers_refuse_adapters_that_are_not_there(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--adapter", "none.safetensors:0.5"]) == 2
    assert "no adapter none.safetensors" in complaint(capsys)
    assert not Path("motionloom-project").exists()


def test_wrong_adapters_are_one_sentence(knowing: str, weights: str, zombie: str, capsys) -> None:
    for line, reason in (
        (["--adapter", "none.safetensors"], "no adapter"),
        (["--adapter", f"{zombie}:9"], "FILE:FACTOR"),
        (["--adapter", knowing], "is a prior, not an adapter"),
    ):
        assert main(["generate", "a person walks", "--weights", knowing, *line]) == 2
        assert reason in complaint(capsys)
    Path("t.yaml").write_text("segments:\n- {text: a, adapters: [../zombie.safetensors]}\n")
    assert main(["compose", "t.yaml", "--weights", knowing]) == 2
    assert "t.yaml" in complaint(capsys)


def test_actions_are_listed_with_their_seconds(knowing: str, weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["weights", knowing, "--actions"]) == 0
    output = capsys.readouterr().out
    assert "90.0 s  walk\n" in output
    assert output.index("walk") < output.index("turn left")
    assert main(["weights", knowing, "--actions", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sentences"] == ["walks", "turns left"]
    assert main(["weights", weights, "--actions"]) == 2
    assert "do not say what they have learned" in complaint(capsys)


def test_what_is_unknown_is_remarked_on(knowing: str, capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    """The random encoder finds everything near, so what counts as near is set between two sentences."""
    from motionloom.core.models.networks.text import known

    monkeypatch.setattr(known, "NEAR", 2.0)
    monkeypatch.setattr(known, "SAME", 0.9999)
    line = ["--weights", knowing, "--steps", "1", "--seconds", "1", "--json"]
    assert main(["generate", "a person walks", *line]) == 0
    output = capsys.readouterr()
    assert (output.err, json.loads(output.out)["remarks"]) == ("", [])
    assert main(["generate", "a person turns right then jumps", "--as-one", *line]) == 0
    output = capsys.readouterr()
    assert "have seen nothing like 'turns right then jumps'; nearest: " in output.err
    assert len(json.loads(output.out)["remarks"]) == 1


def test_actions_in_a_row_are_parted_unless_they_are_left_whole(
    knowing: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [
        "generate",
        "a person walks, then sits down",
        "--weights",
        knowing,
        "--steps",
        "1",
        "--out",
        "a.npz",
        "--json",
    ]
    assert main(line) == 0
    output = capsys.readouterr()
    assert "one after the other: walks 4.0 s, sits down 3.0 s; --as-one" in output.err
    (motion,) = json.loads(output.out)["motions"]
    assert motion["segments"] == [
        {"begin": 0.0, "end": 4.0, "text": "a person walks"},
        {"begin": 4.0, "end": 7.0, "text": "a person sits down"},
    ]
    assert len(io.load("a.npz")) == 140
    assert main([*line, "--seconds", "5"]) == 0
    assert len(io.load("a.npz")) == 100
    assert main([*line, "--as-one"]) == 0
    assert len(io.load("a.npz")) == 140
    assert main([*line, "--solver", "ddim"]) == 2
