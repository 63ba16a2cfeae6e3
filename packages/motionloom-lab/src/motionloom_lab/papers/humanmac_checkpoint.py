"""Published checkpoints of HumanMAC (Chen et al. 2023) as a `Predictor`."""

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motionloom.diffusion import SCHEDULES, Dct
from motionloom.errors import MotionloomError
from motionloom.runtime.predictor import PredictorConfig
from motionloom.weights.predictor import Predictor
from motionloom.weights.prior import Card
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT, HUMANEVA_LAYOUT
from motionloom_lab.papers.mdm import read_published
from motionloom_train.modules import fill, predictor_session
from motionloom_train.nets.predictor import TransLinear

_BENCHMARKS = {
    48: ("Human3.6M", H36M_LAYOUT, 50.0, 25, 125),
    42: ("HumanEva-I", HUMANEVA_LAYOUT, 60.0, 15, 75),
}
"""By the channels of published networks: data set, layout, frames per second, observed frames, all frames."""


def is_humanmac(state: dict[str, Tensor]) -> bool:
    """Whether these are the weights of a published HumanMAC network, by what only it has."""
    return {"sequence_embedding", "cond_embed.weight"} <= state.keys()


def import_humanmac(path: Path | str, *, name: str | None = None, licence: str | None = None) -> Predictor:
    """A published HumanMAC checkpoint (a plain state dict, ``.pt``) as a predictor of the variant `published`.

    Its sizes tell the data set: Human3.6M (50 fps, 25 + 100 frames) or HumanEva-I (60 fps, 15 + 60 frames), cosine
    schedule of 1000 levels. Raises MotionloomError for anything but such weights.
    """
    path = Path(path)
    state = read_published(path).state
    embedding, out = (state.get(key, torch.empty(0)) for key in ("sequence_embedding", "out.weight"))
    if not is_humanmac(state) or embedding.ndim != 2 or out.ndim != 2 or out.shape[0] not in _BENCHMARKS:
        raise MotionloomError(
            f"{path} is not a HumanMAC network of Human3.6M (48 channels) or HumanEva-I (42); name one that is"
        )
    data, layout, fps, observed, frames = _BENCHMARKS[out.shape[0]]
    blocks = {key.split(".")[1] for key in state if key.startswith("temporal_decoder_blocks.")}
    kept, width = embedding.shape
    config = PredictorConfig(channels=layout.channels, kept=kept, layers=len(blocks), width=width)
    if kept > frames:
        raise MotionloomError(f"{path} has {kept} frequencies of {frames} frames, which there are not; fetch it again")
    with torch.device("meta"):
        net = TransLinear(config)
    fill(net, {key: value.float() for key, value in state.items()}, str(path))
    zeros, ones = np.zeros((kept, layout.channels), np.float32), np.ones((kept, layout.channels), np.float32)
    card = Card(name or path.stem, licence or Card.licence, f"as published: {data}", {"imported_from": path.name})
    return Predictor(
        predictor_session(net),
        SCHEDULES["cosine"](1000),
        layout,
        Dct(frames, kept),
        observed,
        fps,
        "published",
        zeros,
        ones,
        np.stack([zeros[0], ones[0]]),
        card,
    )
