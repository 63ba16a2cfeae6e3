"""Groups `mdm_forward` and `mdm_forward_masked`: the published network, weights by rule, through the importer."""

import numpy as np
import pytest
import torch

from motionloom_lab.papers.mdm import from_published
from motionloom_train.nets.prior import NetConfig, PriorNet, condition
from tests.conformance.runner import MOTION, TEXT, Case, case, cases, compare, normal, stream, weights


def shapes_of(channels: int, *, flagged: bool) -> dict[str, list[int]]:
    """Names and shapes of the recorded network of so many channels, with or without an embedding of transitions."""
    for record in (param.values[0] for param in cases("mdm_forward", kind="state_dict")):
        keys = record.lists["keys"] if record else {}
        wide = keys.get("output_process.poseFinal.weight", [0])[0] == channels
        if wide and flagged == ("emb_trans_or_not.weight" in keys):
            return keys
    pytest.skip(f"no network of {channels} channels is recorded")


def forward(recorded: Case) -> np.ndarray:
    config = recorded.config
    rows, channels, frames = config["batch"], config["channels"], config["frames"]
    filled = weights(shapes_of(channels, flagged=bool(config["trans_emb"])), config["seed"])
    net = from_published({name: torch.from_numpy(array) for name, array in filled.items()})
    x = torch.from_numpy(normal(stream(config["seed"], MOTION), (rows, channels, 1, frames)))
    text = torch.from_numpy(normal(stream(config["seed"], TEXT), (rows, 512)))
    if config["unconditional"]:
        text = torch.zeros_like(text)
    flags = None
    if config["trans_emb"]:
        at = torch.arange(frames)
        flags = torch.stack([((at < s) | (at >= e)).long() for s, e in config["trans_emb"]])
    cond = condition(text, lengths=config["mask_lengths"], flags=flags)
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
    tables = sum(name.endswith(".pe") for name in recorded.lists["keys"])
    assert len(net.state_dict()) + tables == recorded.lists["n_entries"]


def test_the_default_network_counts_as_many_parameters_as_published() -> None:
    recorded = case("mdm_forward", "state_dict_humanml263").lists["n_parameters"]
    assert sum(p.numel() for p in PriorNet(NetConfig()).parameters()) == recorded
