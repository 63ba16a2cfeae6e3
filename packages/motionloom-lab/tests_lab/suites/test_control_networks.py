"""Networks that were trained for control, of any prior: adapters and whole fine-tuned ones, by what they follow."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior, save_prior
from motionloom_lab.suites.control_kinds import kind
from motionloom_lab.suites.control_methods import BLENDING, TUNED, maker, trained_controls
from motionloom_lab.suites.protocol import Drawing
from tests.recorded import tiny

PRIOR = tiny.prior()


def whole(folder: Path, name: str, *, prior: Prior = PRIOR, **notes: str) -> Path:
    """A prior as `train control full=true` writes it, or as it is imported."""
    card = replace(prior.card, name=name, notes={**prior.card.notes, **notes})
    return save_prior(replace(prior, card=card), folder / f"{name}.safetensors")


def test_whole_networks_are_known_by_their_notes_and_by_their_names(tmp_path: Path) -> None:
    trained = whole(tmp_path, "mine", control="head")
    imported = [whole(tmp_path, name) for name in ("left_wrist", "root_horizontal")]
    strange = whole(tmp_path, "model000300")
    found = trained_controls(PRIOR, [trained, *imported, f"right_foot={strange}"])
    assert set(found) == {"head", "left_wrist", "trajectory", "right_foot"}


def test_a_file_of_no_known_control_and_two_of_one_are_refused(tmp_path: Path) -> None:
    strange, head = whole(tmp_path, "model000300"), whole(tmp_path, "head")
    with pytest.raises(MotionloomError, match="write CONTROL=model000300"):
        trained_controls(PRIOR, [strange])
    with pytest.raises(MotionloomError, match="two of the networks were trained for head"):
        trained_controls(PRIOR, [head, f"head={strange}"])
    with pytest.raises(MotionloomError, match="missing"):
        trained_controls(PRIOR, [tmp_path / "missing.safetensors"])
    other = replace(PRIOR, mean=PRIOR.mean + 1)
    with pytest.raises(MotionloomError, match="other numbers than the weights"):
        trained_controls(PRIOR, [whole(tmp_path, "left_foot", prior=other)])


def test_a_control_without_a_network_takes_any_and_is_refused_without_one(tmp_path: Path) -> None:
    found = trained_controls(PRIOR, [whole(tmp_path, "left_wrist"), whole(tmp_path, "trajectory")])
    how: Drawing = {"steps": 2, "guidance": 1.0}  # type: ignore[typeddict-item]
    make = maker(PRIOR, how, found)
    make(kind("left_wrist"), TUNED)
    make(kind("trajectory+left_wrist"), BLENDING)
    with pytest.raises(MotionloomError, match="none of the networks was trained for head"):
        make(kind("head"), TUNED)
    maker(PRIOR, how, {**found, "any": PRIOR.net})(kind("head"), TUNED)
    assert np.array_equal(found["left_wrist"].weights["net.out.weight"], found["trajectory"].weights["net.out.weight"])
