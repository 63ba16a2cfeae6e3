"""Group `two_person`: the communication block as published, over the published network, by this package's one loop.

Recorded motions are (batch, channels, 1, 1 + frames); states are rows a0, b0, a1, b1, ... of (1 + frames, channels).
"""

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from torch import Tensor

from motionloom.core.diffusion import DDPM, Denoiser, chain, cosine, inpaint, observe, restart, run
from motionloom_lab.papers.mdm import from_published_pair
from motionloom_train.nets.pair import PairNet
from motionloom_train.nets.prior import condition
from tests.conformance.runner import (
    KNOWN,
    MOTION,
    NOISE,
    TEXT,
    Case,
    Settings,
    case,
    cases,
    compare,
    normal,
    stream,
    weights,
)

GIVEN = 21
"""Slots of a given prefix: the place and one second."""


def table(layers: int, split: int) -> dict[str, list[int]]:
    """Names and shapes of a checkpoint with such a block, from the recorded list for one layer behind all eight."""
    keys = case("two_person", "state_dict_1layer_split8").lists["keys"]
    result = {}
    for name, shape in keys.items():
        head, _, rest = name.partition(".layers.")
        number, _, leaf = rest.partition(".")
        if head == "multi_person.model":
            result |= {f"{head}.layers.{i}.{leaf}": shape for i in range(layers)}
        elif head == "seqTransEncoder_start" and int(number) >= split:
            result[f"seqTransEncoder_end.layers.{int(number) - split}.{leaf}"] = shape
        else:
            result[name] = shape
    return result


def channels_of(recorded: Case) -> int:
    return next(iter(recorded.outputs.values()))["shape"][1]


def net_of(recorded: Case) -> PairNet:
    config, channels = recorded.config, channels_of(recorded)
    filled = weights(table(config["layers"], config["split"]), config["seed"])
    adds = {"in_both_out_cur": "all", "in_both_out_cond": "condition"}[config["function"]]
    state = {name: torch.from_numpy(array) for name, array in filled.items()}
    prior, block = from_published_pair(state, adds=adds)  # type: ignore[arg-type]
    return PairNet(prior, block, cosine(1000), mean=torch.zeros(channels), std=torch.ones(channels)).eval()


def bound_of(net: PairNet, config: Settings):
    text = torch.from_numpy(normal(stream(config["seed"], TEXT), (config["batch"], 512)))
    text = torch.zeros_like(text) if config["unconditional"] else text
    return net.bind(condition(text.repeat_interleave(2, dim=0)))


def pairs(first: np.ndarray, second: np.ndarray) -> Tensor:
    both = np.stack([first, second], axis=1)[:, :, :, 0].swapaxes(2, 3)
    return torch.from_numpy(both.reshape(-1, *both.shape[2:]).copy())


def person(state: Tensor, k: int) -> np.ndarray:
    return state[k::2].numpy().swapaxes(1, 2)[:, :, None]


def noises(recorded: Case, k: int) -> Iterator[Tensor]:
    config = recorded.config
    rng, shape = stream(config["seed"], k), (config["batch"], channels_of(recorded), 1, config["frames"] + 1)
    while True:
        yield pairs(normal(rng, shape), normal(rng, shape))


@pytest.mark.parametrize("recorded", cases("two_person", kind="two_person_forward"))
@torch.inference_mode()
def test_both_answers_of_one_call_are_the_published_ones(recorded: Case):
    config = recorded.config
    net = net_of(recorded)
    state = next(noises(recorded, MOTION))
    level = torch.tensor(config["timesteps"]).repeat_interleave(2) + 1
    guess = net(state, level, bound_of(net, config))
    compare(recorded, "out", person(guess, 0))
    compare(recorded, "out_swapped", person(guess, 1))


@pytest.mark.parametrize("recorded", cases("two_person", kind="state_dict"))
def test_a_block_has_the_published_weights_and_no_others(recorded: Case):
    keys = recorded.lists["keys"]
    prior, block = from_published_pair({k: torch.zeros(v) for k, v in keys.items()})
    counts = [sum(p.numel() for p in net.parameters()) for net in (prior, block)]
    assert sum(counts) == recorded.lists["n_parameters"]
    assert counts[1] == recorded.lists["n_parameters_block"]
    tables = sum(name.endswith(".pe") for name in keys)
    assert len(prior.state_dict()) + len(block.state_dict()) + tables == recorded.lists["n_entries"]


@pytest.mark.parametrize("recorded", cases("two_person", kind="two_person_sampling"))
@torch.inference_mode()
def test_whole_runs_of_two_people_give_the_published_samples(recorded: Case):
    config = recorded.config
    net, schedule = net_of(recorded), cosine(config["steps"])
    bound = bound_of(net, config)
    noise, count = noises(recorded, NOISE), 0

    def draw(like: Tensor) -> Tensor:
        nonlocal count
        count += 2
        return next(noise)

    def denoise(x: Tensor, level: int) -> Tensor:
        return net(x, level, bound)

    denoiser: Denoiser = denoise
    constraints, start = [], None
    if config["prefix"]:
        known = next(noises(recorded, KNOWN))
        mask = torch.zeros_like(known, dtype=torch.bool)
        mask[:, :GIVEN] = True
        denoiser = inpaint(denoise, known, mask)
        constraints.append(observe(known, mask, schedule, torch.zeros_like))
        start = constraints[0](restart(known, schedule, schedule.steps, draw), schedule.steps)
    if start is None:
        start = draw(torch.empty(0))
    walk = range(schedule.steps, -1, -1)
    x = run(denoiser, start, levels=walk, solver=DDPM, schedule=schedule, noise=draw, constrain=chain(*constraints))
    assert count == config["noise_draws"]
    compare(recorded, "person0", person(x, 0))
    compare(recorded, "person1", person(x, 1))
