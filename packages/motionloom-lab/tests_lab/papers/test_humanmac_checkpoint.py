"""HumanMAC's published checkpoints as predictors, and files that are none."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.predictor import Predictor, save_predictor
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT, HUMANEVA_LAYOUT
from motionloom_lab.papers.published_priors import import_humanmac, is_humanmac
from motionloom_train.nets.predictor import TransLinear
from tests_lab.papers.test_mdm import Bomb


def checkpoint(folder: Path, channels: int = 48, kept: int = 20, layers: int = 2, width: int = 16) -> Path:
    """Written as the published code does: a plain state dict."""
    net = TransLinear(PredictorConfig(channels=channels, kept=kept, layers=layers, width=width))
    with torch.no_grad():
        for value in net.parameters():
            value.normal_(0, 0.1)
    torch.save(net.state_dict(), folder / "ckpt_ema_550.pt")
    return folder / "ckpt_ema_550.pt"


@pytest.mark.parametrize(
    ("channels", "kept", "layout", "fps", "observed", "frames"),
    [(48, 20, H36M_LAYOUT, 50, 25, 125), (42, 10, HUMANEVA_LAYOUT, 60, 15, 75)],
    ids=["human3.6m", "humaneva"],
)
def test_a_published_checkpoint_is_a_predictor_of_its_data_set(
    tmp_path: Path, channels: int, kept: int, layout: object, fps: float, observed: int, frames: int
) -> None:
    path = checkpoint(tmp_path, channels, kept)
    predictor = import_humanmac(path, licence="research only")
    assert (predictor.layout, predictor.fps, predictor.observed, predictor.frames, predictor.variant) == (
        layout,
        fps,
        observed,
        frames,
        "published",
    )
    assert (predictor.card.name, predictor.card.licence) == ("ckpt_ema_550", "research only")
    assert (predictor.schedule.name, predictor.schedule.steps) == ("cosine", 1000)
    state = torch.load(path, weights_only=True)
    assert is_humanmac(state)
    assert all(np.array_equal(predictor.net.weights[f"net.{key}"], value.numpy()) for key, value in state.items())
    back = Predictor.load(save_predictor(predictor, tmp_path / "a.safetensors"))
    assert (back.layout, back.frames, back.variant) == (layout, frames, "published")


@pytest.mark.parametrize("how", ["missing", "unknown", "shape", "nan", "channels", "kept", "odd", "flat", "nothing"])
def test_checkpoints_that_are_not_whole_are_refused(tmp_path: Path, how: str) -> None:
    sizes = {"channels": {"channels": 63}, "kept": {"kept": 126}}
    path = checkpoint(tmp_path, **sizes.get(how, {}))
    state = torch.load(path, weights_only=True)
    changes: dict[str, Callable[[], object]] = {
        "missing": lambda: state.pop("time_embed.2.bias"),
        "unknown": lambda: state.update(extra=torch.zeros(2)),
        "shape": lambda: state.update({"out.bias": torch.zeros(47)}),
        "nan": lambda: state["out.bias"].fill_(float("nan")),
        "odd": lambda: [state.pop(key) for key in list(state) if "blocks.1." in key],
        "flat": lambda: state.update({"out.weight": torch.zeros(48)}),
        "nothing": lambda: state.clear(),
    }
    changes.get(how, lambda: None)()
    torch.save(state, path)
    with pytest.raises(MotionloomError) as caught:
        import_humanmac(path)
    assert "\n" not in str(caught.value)


def test_code_in_a_checkpoint_is_not_run(tmp_path: Path) -> None:
    torch.save({"sequence_embedding": Bomb(tmp_path / "was run")}, tmp_path / "a.pt")
    with pytest.raises(MotionloomError, match="not opened"):
        import_humanmac(tmp_path / "a.pt")
    assert not (tmp_path / "was run").exists()
