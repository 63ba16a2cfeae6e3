"""Group `humanmac` and its reference sums: the schedules, the network and the sampler of the published system.

The recorded runs stop at published index 0, which is level 1 here, and index t is level t + 1.
"""

import json
import math

import numpy as np
import pytest
import torch
from torch import Tensor

from motionloom.diffusion import SCHEDULES, Dct, Draw, cosine, from_noise
from motionloom.lab.papers.humanmac import PARTS, Fixed, Target, padded, published_completion
from motionloom.nets.predictor import NetConfig, TransLinear, waves
from tests.conformance.runner import MOTION, NOISE, TEXT, Case, case, cases, compare, normal, recorded, stream, weights

SIZES = {"h36m": (48, 20, 8, 125, 25), "humaneva": (42, 10, 4, 75, 15)}
"""Channels, kept frequencies, layers, frames, observed frames."""


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_schedule"))
def test_schedules_are_the_published_ones(recorded: Case) -> None:
    schedule = SCHEDULES[recorded.config["schedule"].lower()](recorded.config["steps"])
    compare(recorded, "alpha_bar", schedule.alpha_bar[torch.tensor(recorded.config["indices"]) + 1])


def filled(seed: int) -> TransLinear:
    """The Human3.6M network with weights by rule, by its recorded names."""
    state = weights(case("humanmac", "state_dict_h36m").lists["keys"], seed, scale=0.03)
    net = TransLinear(NetConfig())
    net.load_state_dict({name: torch.from_numpy(array) for name, array in state.items()})
    return net.eval().requires_grad_(False)


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_forward"))
def test_the_network_gives_the_recorded_guess(recorded: Case) -> None:
    config, net = recorded.config, filled(recorded.config["seed"])
    shape = config["batch"], config["coefficients"], 3 * config["joints"]
    x, told = (torch.from_numpy(normal(stream(config["seed"], k), shape)) for k in (MOTION, TEXT))
    compare(recorded, "conditional", net(x, torch.tensor(config["timesteps"]), told))
    compare(recorded, "unconditional", net(x, torch.tensor(config["timesteps"])))


@pytest.mark.parametrize("recorded", cases("humanmac", kind="state_dict"))
def test_names_and_shapes_of_the_weights_are_the_published_ones(recorded: Case) -> None:
    with torch.device("meta"):
        net = TransLinear(NetConfig())
    found = {name: list(value.shape) for name, value in net.state_dict().items()}
    assert found == {name: list(shape) for name, shape in dict(recorded.lists["keys"]).items()}
    assert sum(p.numel() for p in net.parameters()) == recorded.lists["n_parameters"]
    assert len(found) == recorded.lists["n_entries"]


def counted(draw: Draw) -> tuple[Draw, list[tuple[int, ...]]]:
    shapes: list[tuple[int, ...]] = []

    def drawn(like: Tensor) -> Tensor:
        shapes.append(tuple(like.shape))
        return draw(like)

    return drawn, shapes


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_sampling"))
def test_whole_runs_give_the_published_motions(recorded: Case) -> None:
    config, seed, n = recorded.config, recorded.config["seed"], recorded.config["samples"]
    frames, h, mode = config["frames"], config["observed"], config["mode"]
    basis, schedule, net = Dct(frames, config["coefficients"]), cosine(config["steps"]), filled(seed)
    control = mode.startswith("fix")
    steps = 0.05 * normal(stream(seed, MOTION), (1 if control else n, frames, 3 * config["joints"])).astype(np.float64)
    motion = torch.from_numpy(steps.cumsum(axis=1).astype(np.float32))
    told = basis.to_spectrum(padded(motion[:, :h], frames)).expand(n, -1, -1)

    def noise(x: Tensor, level: int) -> Tensor:
        b = schedule.at(level)[1]
        return b * x + 0.1 * net(x, torch.full((len(x),), level - 1), told)

    rng = stream(seed, NOISE)
    draw, shapes = counted(lambda like: torch.from_numpy(normal(rng, like.shape)).to(like))
    fixed = Fixed(motion, list(PARTS.values())[int(mode[-1])]) if control else None
    target = Target(motion[:1, -2 * h :], relax=20) if mode == "switch" else None
    state, result = published_completion(
        from_noise(noise, schedule), motion[:, :h], n, basis=basis, schedule=schedule, draw=draw,
        steps=config["ddim_steps"], fixed=fixed, target=target,
    )  # fmt: skip
    assert len(shapes) == config["noise_draws"]
    compare(recorded, "coefficients", state)
    compare(recorded, "motion", result)


# The reference sums


def wave(shape: tuple[int, ...], a: float, b: float) -> Tensor:
    i = np.arange(math.prod(shape), dtype=np.float64).reshape(shape)
    return torch.from_numpy(np.sin(a * i + b).astype(np.float32))


def sums() -> dict:
    return json.loads(recorded("humanmac_reference_sums.json").read_text())


def check(actual: Tensor, recorded: dict, *, near: float, element: float) -> None:
    """Sums and the first and last five elements.

    Sums of absolutes of the sampler add up one sign of a known difference: the reference's float32 schedule has 4e-4
    less noise at index 0 than the formula (0.99995875, not 0.99995872).
    """
    flat = actual.reshape(-1).double()
    assert list(actual.shape) == recorded["shape"]
    assert float(flat.sum()) == pytest.approx(recorded["sum"], abs=near)
    assert float(flat.abs().sum()) == pytest.approx(recorded["abs_sum"], abs=4 * near)
    assert flat[:5].tolist() == pytest.approx(recorded["first5"], abs=element)
    assert flat[-5:].tolist() == pytest.approx(recorded["last5"], abs=element)


@pytest.mark.parametrize("name", list(SIZES))
def test_networks_filled_with_waves_give_the_reference_sums(name: str) -> None:
    recorded, (channels, kept, layers, *_) = sums()[name], SIZES[name]
    net = TransLinear(NetConfig(channels=channels, kept=kept, layers=layers)).eval()
    state = net.state_dict()
    assert (sum(p.numel() for p in net.parameters()), len(state)) == (recorded["n_params"], recorded["n_tensors"])
    for r, key in enumerate(sorted(state)):
        i = np.arange(state[key].numel(), dtype=np.float64)
        values = 0.03 * np.sin(0.37 * i + 0.11 * r) + (1.0 if key.endswith("norm.weight") else 0.0)
        state[key].copy_(torch.from_numpy(values).reshape(state[key].shape))
    shape = (2, kept, channels)
    with torch.inference_mode():
        for key, told in (("forward_mod", wave(shape, 0.021, 1.0)), ("forward_nomod", None)):
            guess = net(wave(shape, 0.05, 0.2), torch.tensor([1, 500]), told)
            check(guess, recorded[key], near=1e-3, element=1e-4)


def test_the_time_embedding_has_cosines_first() -> None:
    recorded, made = sums(), waves(torch.tensor([500]), 512)[0].tolist()
    assert made[:4] == pytest.approx(recorded["timestep_embedding_500_first4"], abs=1e-4)
    assert made[256:260] == pytest.approx(recorded["timestep_embedding_500_at256"], abs=1e-4)


def test_every_schedule_has_the_reference_anchors() -> None:
    for name, anchors in sums()["alpha_hat"].items():
        schedule = SCHEDULES[name.lower()](1000)
        found = {index: float(schedule.alpha_bar[int(index) + 1]) for index in anchors}
        assert found == pytest.approx(anchors, abs=1e-6), name


def oracle(name: str, case: str) -> tuple[Tensor, Tensor, int]:
    """The sampler with a perfect guess of another motion: coefficients, motion, draws."""
    channels, kept, _, frames, h = SIZES[name]
    basis, schedule, calls = Dct(frames, kept), cosine(1000), 0

    def draw(like: Tensor) -> Tensor:
        nonlocal calls
        calls += 1
        return math.sqrt(2) * wave(tuple(like.shape), 0.7, 1.3 * (calls - 1))

    shape = (2, frames, channels)
    motion, clean = 0.3 * wave(shape, 0.013, 0.4), basis.to_spectrum(0.3 * wave(shape, 0.017, 1.1))
    control = case == "control_lower"
    state, result = published_completion(
        lambda x, level: clean, motion[:1, :h] if control else motion[:, :h], 2, basis=basis, schedule=schedule,
        draw=draw, fixed=Fixed(motion[:1], PARTS["lower"]) if control else None,
        target=Target(motion[:1, -2 * h :]) if case == "switch" else None,
    )  # fmt: skip
    return state, result, calls


@pytest.mark.parametrize("name", list(SIZES))
@pytest.mark.parametrize("case", ["pred", "control_lower", "switch"])
def test_the_sampler_with_a_perfect_guess_gives_the_reference_sums(name: str, case: str) -> None:
    """Sums depend on how the schedule is accumulated, float32 there; elements less."""
    recorded = sums()[name].get(f"oracle_sampler_{case}")
    if recorded is None:
        return  # HumanEva has the prediction only
    state, result, calls = oracle(name, case)
    check(state, recorded["y"], near=1e-2, element=1e-4)
    check(result, recorded["x"], near=1e-2, element=1e-4)
    assert calls == recorded.get("randn_calls", 101)


@pytest.mark.parametrize("name", list(SIZES))
def test_the_spectrum_of_the_padded_observation_has_the_reference_sum(name: str) -> None:
    channels, kept, _, frames, h = SIZES[name]
    motion = 0.3 * wave((2, frames, channels), 0.013, 0.4)
    found = Dct(frames, kept).to_spectrum(padded(motion[:, :h], frames))
    check(found, sums()[name]["dct_pad"], near=1e-3, element=1e-5)
