"""`data build` keeps out a clip whose body does not do what was recorded, says so, and lets it in by name."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom_train.cli.data import _reasons
from motionloom_train.data.build import build
from motionloom_train.data.sources import Places, Span, Take
from tests.kinematics import people

FOLDED = {"bent_1": True, "bent_2": True, "sound": False}


def folded(positions: np.ndarray) -> np.ndarray:
    """The hips where they were, everything above them leaning back by 40 degrees."""
    middle = positions[:, [1, 2]].mean(axis=1, keepdims=True)
    above = [0, 3, 6, 9, *range(12, 22)]
    result = positions.copy()
    turn = rot.rotvec_to_quat(np.array([np.radians(-40.0), 0.0, 0.0]))
    result[:, above] = rot.rotate(turn, positions[:, above] - middle) + middle
    return result


def take(name: str) -> Take:
    own = hml.uniform(people.walking(1.2))
    body = folded(own) if FOLDED[name] else own
    return Take(
        name,
        name.split("_")[0],
        "CC0",
        "train",
        (Span(0.0, 4.0, ("a person walks",), "human"),),
        lambda: Places(body, own, people.FPS),
    )


def find(folder: Path | str, *, captions: Path | str | None = None) -> list[Take]:
    return [take(name) for name in FOLDED]


def built(out: Path, **allow: str) -> tuple[dict, list[str]]:
    lines: list[str] = []
    path = build([out.parent], out, workers=1, mixed=0, find=find, allow=allow, progress=lines.append)
    return json.loads(path.read_text()), lines


def test_a_body_that_does_not_do_what_was_recorded_stays_out(tmp_path: Path) -> None:
    about, lines = built(tmp_path / "set")
    assert set(about["dropped"]) == {"bent_1", "bent_2"}
    assert "trunk 40.0 degrees off" in about["dropped"]["bent_1"]
    assert any(line.startswith("dropped bent_1: its body") for line in lines)
    assert not list((tmp_path / "set" / "clips").glob("*bent_[12]*"))
    assert about["fidelity"]["bent"] | {"degrees": 0, "cm": 0, "cm by legs alone": 0} == {
        "clips": 0,
        "refused": 2,
        "allowed": 0,
        "degrees": 0,
        "cm": 0,
        "cm by legs alone": 0,
    }
    sound = about["fidelity"]["sound"]
    assert (sound["clips"], sound["refused"]) == (1, 0)
    assert sound["degrees"]["trunk"][0] < 1
    assert "bent: 0 clips like their recordings; 2 refused" in lines


def test_a_known_case_comes_in_by_name_and_its_reason_stands_in_the_set(tmp_path: Path) -> None:
    """Also into a set that had refused it: that take alone is done again."""
    built(tmp_path / "set")
    about, lines = built(tmp_path / "set", bent_1="the actor wore a corset")
    assert lines[0] == "1 takes to do, 2 already done"
    assert set(about["dropped"]) == {"bent_2"}
    assert about["allowed"]["bent_1"]["reason"] == "the actor wore a corset"
    assert any("trunk 40" in fault for fault in about["allowed"]["bent_1"]["faults"])
    assert (tmp_path / "set" / "clips" / "Mbent_1.safetensors").is_file()
    assert about["fidelity"]["bent"]["allowed"] == 1


def test_a_sound_take_that_is_allowed_needs_no_reason(tmp_path: Path) -> None:
    about, _ = built(tmp_path / "set", sound="just in case", bent="")
    assert set(about["allowed"]) == {"bent_1", "bent_2"}
    assert about["allowed"]["bent_2"]["reason"] == "no reason stated"


def test_a_name_that_no_take_has_cannot_be_allowed(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=r"'bnet', which was to be allowed"):
        built(tmp_path / "set", bnet="oops")
    assert not (tmp_path / "set").exists()


def test_a_set_from_before_bodies_were_looked_at_is_not_gone_on_with(tmp_path: Path) -> None:
    (tmp_path / "set" / "done").mkdir(parents=True)
    with pytest.raises(MotionloomError, match="did not look at bodies"):
        built(tmp_path / "set")


def test_damaged_figures_are_told_with_what_to_do(tmp_path: Path) -> None:
    built(tmp_path / "set")
    (tmp_path / "set" / "fidelity" / "sound").write_text('{"source": 3')
    with pytest.raises(MotionloomError, match=r"fidelity/sound does not hold .* delete it"):
        built(tmp_path / "set")


def test_reasons_are_read_from_the_command_line() -> None:
    assert _reasons(["g1_=a robot = wide hips", "02_01"]) == {"g1_": "a robot = wide hips", "02_01": ""}
