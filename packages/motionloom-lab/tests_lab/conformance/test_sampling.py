"""Group `sampling`: whole ancestral runs on a formula and on the published network, by this package's one loop.

Recorded motions are (batch, channels, 1, frames); states are (rows, tokens, features) = (batch, frames, channels).
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from motionloom.core.diffusion import (
    DDPM,
    Denoiser,
    NoiseSource,
    chain,
    cosine,
    guide,
    handshake,
    inpaint,
    observe,
    restart,
    run,
)
from motionloom.core.models.networks.prior_condition import condition
from motionloom_lab.papers.mdm import from_published
from motionloom_train.modules import prior_session
from tests.conformance.runner import KNOWN, MASK, NOISE, TEXT, Case, case, cases, compare, normal, stream, weights

Net = Callable[[np.ndarray, int, Any], np.ndarray]


def to_state(motion: np.ndarray) -> np.ndarray:
    return np.asarray(motion[:, :, 0].swapaxes(1, 2).copy())


def to_motion(state: np.ndarray) -> np.ndarray:
    return state.swapaxes(1, 2)[:, :, None]


def recorded_draw(recorded: Case) -> NoiseSource:
    """The stream of noise of a run, one array after the other."""
    rng = stream(recorded.config["seed"], NOISE)
    return lambda like: to_state(normal(rng, recorded.config["shape"]))


def dummy(recorded: Case) -> tuple[Net, np.ndarray, np.ndarray]:
    """The formula; a condition is (factor, shift) per row."""
    rows, channels = recorded.config["shape"][:2]
    w = np.linspace(-1, 1, channels)

    def net(x: np.ndarray, level: int, cond: np.ndarray) -> np.ndarray:
        time = (level - 1) / recorded.config["steps"]
        f = np.tanh(w * x) + 0.1 * np.sin(np.roll(x, 1, 1) + time)
        return cond[:, :1, None] * f + cond[:, 1:, None]

    cond = np.array([[1.0, math.sin(row + 1)] for row in range(rows)])
    return net, cond, np.array([[0.7, 0.0]] * rows)


def published_network(recorded: Case) -> tuple[Net, Any, Any]:
    """The published encoder with weights by rule, bound to the text features of the case and to none."""
    seed, rows = recorded.config["seed"], recorded.config["shape"][0]
    filled = weights(case("mdm_forward", "state_dict_humanml263").lists["keys"], seed)
    net = prior_session(from_published({name: torch.from_numpy(array) for name, array in filled.items()}))
    text = np.asarray(normal(stream(seed, TEXT), (rows, 512)))
    return net, net.bind(condition(text)), net.bind(condition(np.zeros_like(text)))


def denoiser_of(recorded: Case) -> Denoiser:
    net, cond, null = {"dummy": dummy, "mdm": published_network}[recorded.config["network"]](recorded)
    scale = recorded.config["guidance"]
    if recorded.config["unconditional"]:
        scale = 0.0
    return guide(net, cond, null, 1.0 if scale is None else np.array(scale))


def mask_of(recorded: Case) -> np.ndarray:
    name, (_, channels, _, frames) = recorded.config["mask"], recorded.config["shape"]
    if name == "soft":
        shape = tuple(recorded.config["shape"])
        return to_state(stream(recorded.config["seed"], MASK).random(shape, dtype=np.float32))
    mask = np.zeros((frames, channels), dtype=np.bool_)
    if name.startswith("frames:"):
        a, b = map(int, name.removeprefix("frames:").split("-"))
        mask[:a], mask[b:] = True, True
    else:
        mask[:, case("control_masks", name).lists["dims"]] = True
    return mask


def start_of(recorded: Case, known: np.ndarray, draw: NoiseSource) -> tuple[np.ndarray, int]:
    """The starting state and its level."""
    schedule, skip = cosine(recorded.config["steps"]), recorded.config["skip"]
    level = schedule.steps - skip
    if recorded.config["init"]:
        return restart(known, schedule, level, draw), level
    if skip:
        return restart(np.zeros_like(known), schedule, level, draw), level
    return draw(known), level


@pytest.mark.parametrize("recorded", cases("sampling", kind="sampling"))
def test_whole_runs_give_the_published_samples(recorded):
    config, schedule = recorded.config, cosine(recorded.config["steps"])
    denoise = denoiser_of(recorded)
    draw, constraints, count = recorded_draw(recorded), [], 0
    known = to_state(normal(stream(config["seed"], KNOWN), config["shape"]))

    def counted(like: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return draw(like)

    if config["mask"]:
        mask = mask_of(recorded)
        denoise = inpaint(denoise, known, mask)
        if config["noise_masked"]:
            constraints.append(observe(known, mask, schedule, np.zeros_like))
    if config["handshake"]:
        constraints.append(handshake(config["handshake"]["lengths"], config["handshake"]["h"]))
    x, level = start_of(recorded, known, counted)
    if config["noise_masked"]:
        x = constraints[0](x, level)
    walk = range(level, -1, -1)
    x = run(denoise, x, levels=walk, solver=DDPM, schedule=schedule, noise=counted, constrain=chain(*constraints))
    assert count == config["noise_draws"]
    compare(recorded, "sample", to_motion(x))
