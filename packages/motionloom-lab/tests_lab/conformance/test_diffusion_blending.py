"""Group `diffusion_blending`: published networks, each guided by itself, blended, under the union of two controls."""

import numpy as np
import pytest
import torch

from motionloom.core.diffusion import DDPM, Denoiser, cosine
from motionloom.core.features.layout import mask
from motionloom.core.methods.blending import blended
from motionloom.core.methods.edit import Observed, controlled
from motionloom.core.models.networks.prior_condition import condition
from motionloom_lab.papers.mdm import from_published
from motionloom_train.modules import prior_session
from tests.conformance.runner import KNOWN, MOTION, NOISE, TEXT, Case, case, cases, compare, normal, stream, weights
from tests_lab.conformance.test_sampling import to_motion, to_state


def recorded_denoiser(recorded: Case) -> Denoiser:
    config, rows = recorded.config, recorded.config["shape"][0]
    keys = case("mdm_forward", "state_dict_humanml263").lists["keys"]
    nets = []
    for m in range(config["models"]):
        filled = weights(keys, config["seed"], m)
        nets.append(prior_session(from_published({name: torch.from_numpy(array) for name, array in filled.items()})))
    text = np.asarray(normal(stream(config["seed"], TEXT), (rows, 512)))
    flags = np.broadcast_to(mask(config["mask"]), (rows, config["shape"][3], 263))
    return blended(
        nets, condition(text), np.zeros_like(flags), flags, weights=config["weights"], guidance=config["guidance"]
    )


@pytest.mark.parametrize("recorded", cases("diffusion_blending", kind="blending"))
def test_blended_guesses_and_whole_runs_are_the_published_ones(recorded):
    """The guess at one time, and a run of 50 steps from the known motion with its noise masked."""
    config = recorded.config
    denoise, shape = recorded_denoiser(recorded), config["shape"]
    x = to_state(normal(stream(config["seed"], MOTION), shape))
    compare(recorded, "forward", to_motion(denoise(x, config["timesteps"][0] + 1)))
    known, rng = to_state(normal(stream(config["seed"], KNOWN), shape)), stream(config["seed"], NOISE)
    sample = controlled(
        denoise,
        Observed(known, np.broadcast_to(np.asarray(mask(config["mask"])), known.shape), noise_free=True),
        levels=range(config["steps"], -1, -1),
        solver=DDPM,
        schedule=cosine(config["steps"]),
        noise=lambda like: to_state(normal(rng, shape)),
        start=known,
    )
    compare(recorded, "sample", to_motion(sample))
