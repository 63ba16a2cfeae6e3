"""`Predictor`: a network that completes motion from what is known of it, and the weight file it lives in.

It sees a window of ``frames`` joint places (`features.positions`), the first ``observed`` of them usually known, as the
lowest frequencies of their cosine transform. Two variants:

`published`: HumanMAC (Chen et al. 2023). Metres as they are; the network predicts the noise and its condition is the
spectrum of the observation padded with its last pose. Published checkpoints are of this variant.

`masked`: ours. Everything is relative to the last observed pose and standardised frequency by frequency; the network
predicts the clean spectrum (x0), and its condition is what is known, the mask of joints and frames where that is, and
the pose itself.
"""

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from motionloom.core.diffusion import Basis, Dct, Denoiser, Frames, Schedule, State, from_noise
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import Layout
from motionloom.core.models.container import (
    PREDICTORS,
    check,
    check_graphs,
    graph_tensors,
    halved,
    split_graphs,
)
from motionloom.core.models.networks.predictor import PredictorConfig, PredictorSession
from motionloom.core.models.networks.session import check_graph, find_device
from motionloom.core.models.networks.shapes import predictor_shapes
from motionloom.core.models.prior import NET, Card, parse_schedule

Array = np.ndarray

LONGEST_WINDOW = 2000


@dataclass(frozen=True, eq=False)
class Predictor:
    """A diffusion model of short windows of motion, ready to complete them."""

    net: PredictorSession
    schedule: Schedule
    layout: Layout
    basis: Basis
    """From the window's frames to the state's tokens."""
    observed: int
    """Frames at the beginning of the window that are usually known."""
    fps: float
    variant: Literal["published", "masked"]
    mean: Array
    """(kept, channels) of the state; zeros for the published variant."""
    std: Array
    """(kept, channels); ones for the published variant."""
    pose: Array
    """(2, channels) mean and spread of last observed poses."""
    card: Card

    @property
    def frames(self) -> int:
        """Frames of the window."""
        return self.basis.frames

    @staticmethod
    def load(weights: str | Path = "predictor", *, device: str = "cpu") -> "Predictor":
        """Read a weight file: a path, or the name of one that ships with the package (``predictor``).

        Raises `MotionloomError` for a file that is missing, damaged or of another kind, and for a device there is not.
        """
        place = find_device(device)
        return load_predictor(find_predictor(weights)).to(place)

    def to(self, device: str) -> "Predictor":
        """The same predictor with its network on another device."""
        return replace(self, net=self.net.on(device))

    # Between windows of features (rows, frames, channels) and states (rows, kept, channels)

    def to_state(self, features: Array, pose: Array) -> State:
        """Windows as states; ``pose`` (rows, channels) is the last observed one."""
        x = features - pose[:, None] if self.variant == "masked" else features
        return (self.basis.to_spectrum(x) - self.mean) / self.std

    def to_features(self, state: State, pose: Array) -> Array:
        """The inverse of `to_state`, without the frequencies that were dropped."""
        x = self.basis.to_time(state * self.std + self.mean)
        return x + pose[:, None] if self.variant == "masked" else x

    def condition(self, features: Array, mask: Array, pose: Array) -> Array:
        """The condition of windows (rows, frames, channels) known where ``mask`` (rows, frames, parts) is 1.

        Unknown numbers are those of ``pose`` (rows, channels), the last observed one.
        """
        mask = mask.astype(features.dtype)
        each = mask.repeat(3, axis=-1)
        known = each * (features - pose[:, None])
        if self.variant == "published":
            return self.basis.to_spectrum(known + pose[:, None])
        spectrum = self.basis.to_spectrum(known) / self.std
        shares = self.basis.to_spectrum(mask) / math.sqrt(self.frames)
        rows = np.concatenate([spectrum, shares], axis=-1)
        last = np.zeros_like(rows[:, :1])
        last[..., : pose.shape[-1]] = ((pose - self.pose[0]) / self.pose[1])[:, None]
        return np.concatenate([rows, last], axis=1)

    def denoiser(self, condition: Array | None, keep: Array | None = None) -> Denoiser:
        """The network's estimate of the clean state, under a condition or none; ``keep`` (rows,): which rows get it."""

        def estimate(x: State, level: int) -> State:
            return self.net(x, np.full(len(x), level - 1), condition, keep)

        return from_noise(estimate, self.schedule) if self.variant == "published" else estimate


def condition_shape(layout: Layout, kept: int) -> tuple[int, int]:
    """Rows and channels of the condition of a network of the variant `masked`."""
    return kept + 1, layout.channels + layout.parts


def _variant(about: dict[str, Any]) -> Literal["published", "masked"]:
    """What a file says of its variant, which was called ``manner``, and ``masked`` then ``told``."""
    names: dict[str, Literal["published", "masked"]]
    names = {"published": "published", "masked": "masked", "told": "masked"}
    return names[about["variant"] if "variant" in about else about["manner"]]


def shipped_predictors() -> dict[str, Path]:
    """Names and places of the predictors inside the package."""
    return PREDICTORS.shipped()


def find_predictor(weights: str | Path) -> Path:
    """The file for a shipped name or a path."""
    return PREDICTORS.find(weights)


def save_predictor(predictor: Predictor, path: Path | str, *, half: bool = True) -> Path:
    """Write a predictor as a .safetensors file and give the path back; as float16 unless ``half`` is False."""
    tensors = halved(predictor.net.weights, half) | graph_tensors({"predictor": predictor.net.graph})
    tensors |= {name: getattr(predictor, name).astype(np.float32) for name in ("mean", "std", "pose")}
    about = {
        "net": asdict(predictor.net.config),
        "schedule": {"name": predictor.schedule.name, "steps": predictor.schedule.steps},
        "layout": predictor.layout.plain(),
        "frames": predictor.frames,
        "observed": predictor.observed,
        "dct": isinstance(predictor.basis, Dct),
        "fps": predictor.fps,
        "variant": predictor.variant,
        "card": asdict(predictor.card),
    }
    return PREDICTORS.write(path, tensors, about)


def load_predictor(path: Path) -> Predictor:
    """Read a predictor; raises MotionloomError where the file is damaged, of another kind or of a newer format."""
    about, tensors = PREDICTORS.read(path)
    with PREDICTORS.parsing(path):
        config = PredictorConfig.parse(about["net"])
        layout = Layout.parse(about["layout"])
        basis = _basis(config.kept, about["frames"], about["dct"])
        schedule, card = parse_schedule(about["schedule"]), Card.parse(about["card"])
        fps, observed, variant = float(about["fps"]), about["observed"], _variant(about)
        condition = {"masked": condition_shape(layout, config.kept), "published": None}
        if not (math.isfinite(fps) and 1 <= fps <= 1000 and type(observed) is int and 2 <= observed < basis.frames):
            raise ValueError("frames that do not fit together")
        if layout.channels != config.channels or config.condition != condition[variant]:
            raise ValueError("a network that does not fit its layout")
    tensors, graphs = split_graphs(tensors)
    weights = {key: value for key, value in tensors.items() if key.startswith(NET)}
    check({key[len(NET) :]: value for key, value in weights.items()}, predictor_shapes(config), str(path))
    check_graphs(path, graphs, ["predictor"])
    check_graph(graphs["predictor"], weights, PredictorSession.outputs)
    return Predictor(
        PredictorSession(config, weights, graphs["predictor"]),
        schedule,
        layout,
        basis,
        observed,
        fps,
        variant,
        *_statistics(path, tensors, config),
        card,
    )


def _statistics(path: Path, tensors: dict[str, Array], config: PredictorConfig) -> tuple[Array, Array, Array]:
    """Mean and std of the spectra, and the pose's."""
    names = ("mean", "std", "pose")
    mean, std, pose = (tensors.get(name, np.empty(0)).astype(np.float32) for name in names)
    for name, values in zip(names, (mean, std, pose), strict=True):
        if not values.size or not np.isfinite(values).all():
            raise MotionloomError(f"{path} lacks usable statistics ({name}); fetch the weights again")
    shape = (config.kept, config.channels)
    fits = mean.shape == std.shape == shape and pose.shape == (2, config.channels)
    if not fits or std.min() <= 0 or pose[1].min() <= 0:
        raise MotionloomError(f"{path} lacks usable statistics; fetch the weights again")
    return mean, std, pose


def _basis(kept: int, frames: Any, dct: Any) -> Basis:
    if type(frames) is not int or not kept <= frames <= LONGEST_WINDOW or (dct is not True and kept != frames):
        raise ValueError(f"{kept} of {frames!r} frequencies")
    return Dct(frames, kept) if dct is True else Frames(frames)
