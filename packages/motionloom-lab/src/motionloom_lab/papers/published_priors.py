"""Published checkpoints of MDM, PriorMDM and ComMDM as a `Prior`, the last with its `PairBlock`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.diffusion import SCHEDULES
from motionloom.errors import MotionloomError
from motionloom.runtime.text.published import PublishedText
from motionloom.weights.adapter import fingerprint
from motionloom.weights.pair import UNKNOWN, PairBlock
from motionloom.weights.prior import Card, Prior
from motionloom_lab.papers.commdm import adds_of, from_published_pair, is_pair
from motionloom_lab.papers.mdm import FRAME_RATES, describe, from_published, read_published
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays, prior_session


def import_published(
    path: Path | str,
    *,
    mean: np.ndarray,
    std: np.ndarray,
    name: str | None = None,
    licence: str | None = None,
    warn: Callable[[str], None] = lambda line: None,
) -> Prior:
    """A published MDM or PriorMDM checkpoint (``model*.pt``, with ``args.json`` beside it) as a `Prior`.

    Of a checkpoint of two people (ComMDM) it is the network of each; `import_block` reads the rest.
    mean, std: (features,) statistics published with the data set. warn: called with what was missing and is assumed.
    Raises MotionloomError for anything but plain weights of MDM's ``trans_enc``.
    """
    path = Path(path)
    published = read_published(path)
    net = from_published_pair(published.state)[0] if is_pair(published.state) else from_published(published.state)
    said = describe(published, net)
    for line in said.warnings:
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
    card = Card(name or path.stem, licence or Card.licence, f"as published: {said.data}", notes)
    text = PublishedText("clip-77" if features == 135 else "clip")
    centre, spread = (np.array(values, dtype=np.float32) for values in (mean, std))
    schedule = SCHEDULES[said.schedule](said.steps)
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
