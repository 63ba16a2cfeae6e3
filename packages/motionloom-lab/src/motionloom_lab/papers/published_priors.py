"""Published checkpoints: of MDM, PriorMDM and ComMDM as a `Prior`, the last with its `PairBlock`, and of HumanMAC (Chen
et al. 2023) as a `Predictor`."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from motionloom.core.diffusion import SCHEDULES, Dct
from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.text.published import PublishedText
from motionloom.core.models.pair import UNKNOWN, PairBlock
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Card, Prior
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT, HUMANEVA_LAYOUT
from motionloom_lab.papers.mdm import (
    FRAME_RATES,
    adds_of,
    describe,
    from_published,
    from_published_pair,
    is_pair,
    read_published,
)
from motionloom_train.data.progress import Say, silent
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays, fill, predictor_session, prior_session
from motionloom_train.nets.predictor import TransLinear


def import_published(
    path: Path | str,
    *,
    mean: np.ndarray,
    std: np.ndarray,
    name: str | None = None,
    licence: str | None = None,
    warn: Say = silent,
) -> Prior:
    """A published MDM or PriorMDM checkpoint (``model*.pt``, with ``args.json`` beside it) as a `Prior`.

    Of a checkpoint of two people (ComMDM) it is the network of each; `import_block` reads the rest.
    mean, std: (features,) statistics published with the data set. warn: called with what was missing and is assumed.
    Raises MotionloomError for anything but plain weights of MDM's ``trans_enc``.
    """
    path = Path(path)
    published = read_published(path)
    net = from_published_pair(published.state)[0] if is_pair(published.state) else from_published(published.state)
    about = describe(published, net)
    for line in about.warnings:
        warn(line)
    features = net.config.features
    for label, values in (("mean", mean), ("std", std)):
        if np.shape(values) != (features,) or np.asarray(values).dtype.kind != "f" or not np.isfinite(values).all():
            raise MotionloomError(
                f"the {label} for these weights must be {features} finite numbers; got shape {np.shape(values)}"
            )
    if not (np.asarray(std) >= 0).all():
        raise MotionloomError("the std has negative numbers; name the data set's Std.npy")
    options = _plain_options(published.options)
    notes = {"imported_from": path.name, "averaged_weights": published.averaged, "options": options}
    card = Card(name or path.stem, licence or Card.licence, f"as published: {about.data}", notes)
    text = PublishedText("clip-77" if features == 135 else "clip")
    centre, spread = (np.array(values, dtype=np.float32) for values in (mean, std))
    schedule = SCHEDULES[about.schedule](about.steps)
    return Prior(prior_session(net), schedule, centre, spread, text, card, FRAME_RATES.get(features, 20.0))


def _plain_options(options: dict[str, Any]) -> dict[str, Any]:
    """The options that are single values, without the paths and devices of somebody's machine."""
    dropped = {"data_dir", "save_dir", "resume_checkpoint", "pretrained_path", "device", "cuda"}
    return {k: v for k, v in options.items() if k not in dropped and isinstance(v, str | int | float | bool) and v == v}


def import_block(
    path: Path | str, prior: Prior, *, base: str, name: str | None = None, licence: str | None = None
) -> PairBlock:
    """The block of a published two-person checkpoint, for ``prior``, which is the network of the same file.

    base: the prior's name. Raises `MotionloomError` for a checkpoint without a block, and for another's prior.
    """
    path = Path(path)
    published = read_published(path)
    if not is_pair(published.state):
        raise MotionloomError(f"{path} holds no communication block; name a checkpoint of two people")
    net, talk = from_published_pair(published.state, adds=adds_of(published.options))
    digest = fingerprint(prior_session(net))
    if digest != fingerprint(prior.net):
        raise MotionloomError(f"the block of {path} belongs to the network of the same file; import that as its prior")
    notes = {"imported_from": path.name, "averaged_weights": published.averaged}
    graph = pair_graph(talk.config, net.config)
    about = (base, digest, licence or UNKNOWN, "as published: 3DPW", notes)
    return PairBlock(name or path.stem, talk.config, arrays(talk), *about, graph=graph)


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

    Its sizes show the data set: Human3.6M (50 fps, 25 + 100 frames) or HumanEva-I (60 fps, 15 + 60 frames), cosine
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
    count, width = embedding.shape
    config = PredictorConfig(channels=layout.channels, kept=count, layers=len(blocks), width=width)
    if count > frames:
        raise MotionloomError(f"{path} has {count} frequencies of {frames} frames, which there are not; fetch it again")
    with torch.device("meta"):
        net = TransLinear(config)
    fill(net, {key: value.float() for key, value in state.items()}, str(path))
    zeros, ones = np.zeros((count, layout.channels), np.float32), np.ones((count, layout.channels), np.float32)
    card = Card(name or path.stem, licence or Card.licence, f"as published: {data}", {"imported_from": path.name})
    return Predictor(
        predictor_session(net),
        SCHEDULES["cosine"](1000),
        layout,
        Dct(frames, count),
        observed,
        fps,
        "published",
        zeros,
        ones,
        np.stack([zeros[0], ones[0]]),
        card,
    )
