"""Group `humanmac` and its reference sums: the schedules, the network and the sampler of the published system.

The recorded runs stop at published index 0, which is level 1 here, and index t is level t + 1.
"""

import json
import math

import numpy as np
import pytest
import torch

from motionloom.core.diffusion import SCHEDULES, Dct, NoiseSource, Schedule, from_betas, from_noise
from motionloom.core.methods.humanmac import PARTS, Fixed, Padding, SwitchTarget, padded, published_completion
from motionloom.core.models.networks.predictor import PredictorConfig, PredictorSession
from motionloom_train.modules import predictor_session
from motionloom_train.nets.predictor import TransLinear, waves
from tests.conformance import runner
from tests.conformance.runner import (
    MOTION,
    NOISE,
    TEXT,
    Case,
    Settings,
    cases,
    compare,
    normal,
    recorded,
    stream,
    weights,
)

PADDINGS: dict[str, Padding] = {"LastFrame": "last", "Zero": "zero", "Repeat": "repeat"}


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_schedule"))
def test_schedules_are_the_published_ones(recorded: Case) -> None:
    schedule = SCHEDULES[recorded.config["schedule"].lower()](recorded.config["steps"])
    compare(recorded, "alpha_bar", schedule.alpha_bar[np.array(recorded.config["indices"]) + 1])


def filled(config: Settings) -> PredictorSession:
    """The network of a case with weights by rule; the test of `state_dict` cases compares its names and shapes."""
    net = TransLinear(PredictorConfig(3 * config["joints"], config["coefficients"], config["layers"]))
    shapes = {name: value.shape for name, value in net.state_dict().items()}
    state = weights(shapes, config["seed"], scale=0.03)
    net.load_state_dict({name: torch.from_numpy(array) for name, array in state.items()})
    return predictor_session(net.eval())


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_forward"))
def test_the_network_gives_the_recorded_guess(recorded: Case) -> None:
    config, net = recorded.config, filled(recorded.config)
    shape = config["batch"], config["coefficients"], 3 * config["joints"]
    x, condition = (np.asarray(normal(stream(config["seed"], k), shape)) for k in (MOTION, TEXT))
    compare(recorded, "conditional", net(x, np.array(config["timesteps"]), condition))
    compare(recorded, "unconditional", net(x, np.array(config["timesteps"])))


@pytest.mark.parametrize("recorded", cases("humanmac", kind="state_dict"))
def test_names_and_shapes_of_the_weights_are_the_published_ones(recorded: Case) -> None:
    keys = recorded.lists["keys"]
    layers = {name.split(".")[1] for name in keys if name.startswith("temporal_decoder_blocks.")}
    with torch.device("meta"):
        net = TransLinear(PredictorConfig(keys["out.bias"][0], keys["sequence_embedding"][0], len(layers)))
    shapes = {name: list(value.shape) for name, value in net.state_dict().items()}
    assert shapes == {name: list(shape) for name, shape in keys.items()}
    assert sum(p.numel() for p in net.parameters()) == recorded.lists["n_parameters"]
    assert len(shapes) == recorded.lists["n_entries"]


def counted(draw: NoiseSource) -> tuple[NoiseSource, list[tuple[int, ...]]]:
    shapes: list[tuple[int, ...]] = []

    def drawn(like: np.ndarray) -> np.ndarray:
        shapes.append(tuple(like.shape))
        return draw(like)

    return drawn, shapes


@pytest.mark.parametrize("recorded", cases("humanmac", kind="humanmac_sampling"))
def test_whole_runs_give_the_published_motions(recorded: Case) -> None:
    config, seed, n = recorded.config, recorded.config["seed"], recorded.config["samples"]
    frames, h, mode = config["frames"], config["observed"], config["mode"]
    basis, net = Dct(frames, config["coefficients"]), filled(config)
    schedule, padding = SCHEDULES[config["schedule"].lower()](config["steps"]), PADDINGS[config["padding"]]
    control = mode.startswith("fix")
    steps = 0.05 * normal(stream(seed, MOTION), (1 if control else n, frames, 3 * config["joints"])).astype(np.float64)
    motion = np.asarray(steps.cumsum(axis=1).astype(np.float32))
    spectrum = np.broadcast_to(
        basis.to_spectrum(padded(motion[:, :h], frames, padding)), (n, basis.kept, motion.shape[2])
    )
    condition = None if config["unconditional"] else spectrum

    def noise(x: np.ndarray, level: int) -> np.ndarray:
        b = schedule.at(level)[1]
        return b * x + 0.1 * net(x, np.full((len(x),), level - 1), condition)

    rng = stream(seed, NOISE)
    draw, shapes = counted(lambda like: np.asarray(normal(rng, like.shape)).astype(like.dtype))
    fixed = Fixed(motion, list(PARTS.values())[int(mode[-1])]) if control else None
    target = SwitchTarget(motion[:1, -2 * h :], relax=20) if mode == "switch" else None
    state, result = published_completion(
        from_noise(noise, schedule),
        motion[:, :h],
        n,
        basis=basis,
        schedule=schedule,
        noise=draw,
        steps=config["ddim_steps"],
        padding=padding,
        complete=config["completion"],
        fixed=fixed,
        target=target,
    )
    assert len(shapes) == config["noise_draws"]
    compare(recorded, "coefficients", state)
    compare(recorded, "motion", result)


# The reference sums


SAMPLER = "oracle_sampler_"


def wave(shape: tuple[int, ...], a: float, b: float) -> np.ndarray:
    """sin(a i + b) over the row-major index i, float32."""
    i = np.arange(math.prod(shape), dtype=np.float64).reshape(shape)
    return np.asarray(np.sin(a * i + b).astype(np.float32))


def sums() -> dict:
    return json.loads(recorded("humanmac_reference_sums.json").read_text())


def settings(part: str = "n_params") -> list[tuple[str, str]]:
    """(setting, part) of every published setting in the file that has parts whose names begin like this."""
    if not (runner.FOLDER / "humanmac_reference_sums.json").exists():
        return []
    held = [(name, value) for name, value in sums().items() if isinstance(value, dict)]
    return [(name, key) for name, value in held if "n_params" in value for key in value if key.startswith(part)]


def test_no_part_of_the_file_is_left_aside() -> None:
    """What the tests below and those of `test_prediction_metrics.py` compare."""
    parts = ("forward_mod", "forward_nomod", "n_params", "n_tensors", "dct_pad", SAMPLER)
    assert all(key.startswith(parts) for name, _ in settings() for key in sums()[name])
    others = {"timestep_embedding_500_first4", "timestep_embedding_500_at256", "alpha_hat", "metrics"}
    assert sums().keys() == others | {name for name, _ in settings()}


def sizes(name: str) -> tuple[int, int, int, int]:
    """Channels, kept frequencies, frames and observed frames of a setting: of its recorded results.

    The file does not say how many frames are observed: a fifth in both published settings (its README).
    """
    recorded = sums()[name]
    _, kept, channels = recorded["forward_mod"]["shape"]
    frames = recorded["oracle_sampler_pred"]["x"]["shape"][1]
    return channels, kept, frames, frames // 5


def check(actual: np.ndarray, recorded: dict, *, near: float = 2e-5) -> None:
    """The shape, sums, and the first and last five elements, which are recorded to six decimals."""
    flat = actual.reshape(-1).astype(np.float64)
    assert list(actual.shape) == recorded["shape"]
    assert float(flat.sum()) == pytest.approx(recorded["sum"], abs=near)
    assert float(np.abs(flat).sum()) == pytest.approx(recorded["abs_sum"], abs=near)
    assert flat[:5].tolist() == pytest.approx(recorded["first5"], abs=5e-6)
    assert flat[-5:].tolist() == pytest.approx(recorded["last5"], abs=5e-6)


def float32_cosine(steps: int) -> Schedule:
    """The cosine schedule as the reference accumulates it: cosines, quotients and products in float32.

    The formula in float64 has 4e-4 more noise at the first level (0.99995872 of signal, not 0.99995875).
    """
    shares = torch.cos((torch.linspace(0, steps, steps + 1) / steps + 0.008) / 1.008 * torch.pi / 2) ** 2
    betas = (1 - shares[1:] / shares[:-1]).clamp(0, 0.999)
    schedule = from_betas("cosine in float32", betas.numpy())
    signal = torch.cat([torch.ones(1), torch.cumprod(1 - betas, dim=0)]).numpy()
    schedule.__dict__["alpha_bar"] = signal.astype(np.float64)  # what the cached property would compute in float64
    return schedule


@pytest.mark.parametrize(("name", "count"), settings("n_params"))
def test_networks_filled_with_waves_give_the_reference_sums(name: str, count: str) -> None:
    recorded, (channels, kept, *_) = sums()[name], sizes(name)
    layers = (recorded["n_tensors"] - 11) // 21  # 11 tensors lie outside the layers, 21 in each
    net = TransLinear(PredictorConfig(channels=channels, kept=kept, layers=layers)).eval()
    state = net.state_dict()
    assert (sum(p.numel() for p in net.parameters()), len(state)) == (recorded[count], recorded["n_tensors"])
    for r, key in enumerate(sorted(state)):
        i = np.arange(state[key].numel(), dtype=np.float64)
        values = 0.03 * np.sin(0.37 * i + 0.11 * r) + (1.0 if key.endswith("norm.weight") else 0.0)
        state[key].copy_(torch.from_numpy(values).reshape(state[key].shape))
    shape = (2, kept, channels)
    session = predictor_session(net)
    for key, condition in (("forward_mod", wave(shape, 0.021, 1.0)), ("forward_nomod", None)):
        guess = session(wave(shape, 0.05, 0.2), np.array([1, 500]), condition)
        check(guess, recorded[key], near=1e-3)


def test_the_time_embedding_has_cosines_first() -> None:
    recorded, embedding = sums(), waves(torch.tensor([500]), 512)[0].tolist()
    assert embedding[:4] == pytest.approx(recorded["timestep_embedding_500_first4"], abs=1e-4)
    assert embedding[256:260] == pytest.approx(recorded["timestep_embedding_500_at256"], abs=1e-4)


def test_every_schedule_has_the_reference_anchors() -> None:
    for name, anchors in sums()["alpha_hat"].items():
        schedule = SCHEDULES[name.lower()](1000)
        values = {index: float(schedule.alpha_bar[int(index) + 1]) for index in anchors}
        assert values == pytest.approx(anchors, abs=1e-6), name


def oracle(name: str, case: str) -> tuple[np.ndarray, np.ndarray, int]:
    """The sampler with a perfect guess of another motion: coefficients, motion, draws."""
    channels, kept, frames, h = sizes(name)
    basis, schedule, calls = Dct(frames, kept), float32_cosine(1000), 0

    def draw(like: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        return math.sqrt(2) * wave(tuple(like.shape), 0.7, 1.3 * (calls - 1))

    shape = (2, frames, channels)
    motion, clean = 0.3 * wave(shape, 0.013, 0.4), basis.to_spectrum(0.3 * wave(shape, 0.017, 1.1))
    control = case == "control_lower"
    state, result = published_completion(
        lambda x, level: clean,
        motion[:1, :h] if control else motion[:, :h],
        2,
        basis=basis,
        schedule=schedule,
        noise=draw,
        fixed=Fixed(motion[:1], PARTS["lower"]) if control else None,
        target=SwitchTarget(motion[:1, -2 * h :]) if case == "switch" else None,
    )
    return state, result, calls


@pytest.mark.parametrize(("name", "run"), settings(SAMPLER))
def test_the_sampler_with_a_perfect_guess_gives_the_reference_sums(name: str, run: str) -> None:
    recorded, (channels, kept, frames, h) = sums()[name][run], sizes(name)
    state, result, calls = oracle(name, run.removeprefix(SAMPLER))
    check(state, recorded["y"])
    check(result, recorded["x"])
    assert calls == recorded["randn_calls"]
    basis, shape = Dct(frames, kept), (2, frames, channels)
    motion, aim = 0.3 * wave(shape, 0.013, 0.4), basis.to_time(basis.to_spectrum(0.3 * wave(shape, 0.017, 1.1)))
    errors = {
        "obs_rmse": result[:, :h] - motion[:, :h],
        "fut_rmse_to_oracle": result[:, h:] - aim[:, h:],
        "tgt_rmse": result[:, -2 * h :] - motion[:1, -2 * h :],
    }
    for error in errors.keys() & recorded.keys():
        assert float(np.sqrt((errors[error] ** 2).mean())) == pytest.approx(recorded[error], abs=2e-6), error
    assert recorded.keys() <= errors.keys() | {"y", "x", "randn_calls"}


@pytest.mark.parametrize(("name", "spectrum"), settings("dct_pad"))
def test_the_spectrum_of_the_padded_observation_has_the_reference_sum(name: str, spectrum: str) -> None:
    channels, kept, frames, h = sizes(name)
    motion = 0.3 * wave((2, frames, channels), 0.013, 0.4)
    found = Dct(frames, kept).to_spectrum(padded(motion[:, :h], frames))
    check(found, sums()[name][spectrum])
