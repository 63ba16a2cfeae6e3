"""Groups `mdm_forward` and `mdm_forward_masked`: the published network, weights by rule, through the importer."""

import numpy as np
import pytest
import torch

from motionloom.lab.papers.mdm import from_published
from motionloom.nets.prior import NetConfig, PriorNet, condition
from tests.conformance.runner import MOTION, TEXT, Case, case, cases, compare, normal, stream, weights

STATES = {263: "state_dict_humanml263", 135: "state_dict_babel135_transemb"}


def forward(recorded: Case) -> np.ndarray:
    config = recorded.config
    rows, channels, frames = config["batch"], config["channels"], config["frames"]
    shapes = case("mdm_forward", STATES[channels]).lists["keys"]
    filled = weights(shapes, config["seed"])
    net = from_published({name: torch.from_numpy(array) for name, array in filled.items()})
    x = torch.from_numpy(normal(stream(config["seed"], MOTION), (rows, channels, 1, frames)))
    text = torch.from_numpy(normal(stream(config["seed"], TEXT), (rows, 512)))
    if config.get("unconditional"):
        text = torch.zeros_like(text)
    flags = None
    if config.get("trans_emb"):
        at = torch.arange(frames)
        flags = torch.stack([((at < s) | (at >= e)).long() for s, e in config["trans_emb"]])
    cond = condition(text, lengths=config.get("mask_lengths"), flags=flags)
    with torch.inference_mode():
        guess = net(x[:, :, 0].mT, torch.tensor(config["timesteps"]) + 1, net.bind(cond))
    return guess.mT[:, :, None].numpy()


@pytest.mark.parametrize("recorded", [*cases("mdm_forward", kind="forward"), *cases("mdm_forward_masked")])
def test_published_network_gives_the_recorded_guess(recorded: Case) -> None:
    compare(recorded, "out", forward(recorded))


@pytest.mark.parametrize("recorded", cases("mdm_forward", kind="state_dict"))
def test_published_names_and_shapes_are_read_whole(recorded: Case) -> None:
    filled = weights(recorded.lists["keys"], 1)
    net = from_published({name: torch.from_numpy(array) for name, array in filled.items()})
    assert sum(p.numel() for p in net.parameters()) == recorded.lists["n_parameters"]


def test_the_default_network_counts_as_many_parameters_as_published() -> None:
    assert sum(p.numel() for p in PriorNet(NetConfig()).parameters()) == 17_880_327
