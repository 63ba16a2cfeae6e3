"""TransLinear: sizes, what it is at the start, who is told what, and the order of its long skips."""

import pytest
import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom_train.nets.predictor import TransLinear, waves

SMALL = PredictorConfig(channels=6, kept=5, layers=4, width=32, heads=2)
BESIDE = PredictorConfig(channels=6, kept=5, layers=4, width=32, heads=2, condition=(6, 8), beside=True)


def awake(config: PredictorConfig, seed: int = 0) -> TransLinear:
    """A network whose every weight matters: none is left at zero."""
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        net = TransLinear(config)
        with torch.no_grad():
            for value in net.parameters():
                value.add_(0.2 * torch.randn_like(value))
    return net.eval().requires_grad_(False)


def inputs(config: PredictorConfig, rows: int = 3) -> tuple[Tensor, Tensor, Tensor]:
    generator = torch.Generator().manual_seed(5)
    x = torch.randn(rows, config.kept, config.channels, generator=generator)
    return x, torch.arange(1, rows + 1) * 100, torch.randn(rows, *config.condition_shape, generator=generator)


@pytest.mark.parametrize(
    ("config", "parameters", "tensors"),
    [(PredictorConfig(), 28_401_712, 179), (PredictorConfig(channels=42, kept=10, layers=4), 14_451_754, 95)],
    ids=["human3.6m", "humaneva"],
)
def test_published_sizes(config: PredictorConfig, parameters: int, tensors: int) -> None:
    with torch.device("meta"):
        net = TransLinear(config)
    assert sum(p.numel() for p in net.parameters()) == parameters
    assert len(net.state_dict()) == tensors


@pytest.mark.parametrize("config", [SMALL, BESIDE], ids=["published", "beside"])
def test_a_new_network_says_nothing_so_its_first_loss_is_one(config: PredictorConfig) -> None:
    """E[eps^2] = 1 for noise eps."""
    net = TransLinear(config).eval()
    x, t, condition = inputs(config)
    assert torch.equal(net(x, t, condition), torch.zeros_like(x))
    noise = torch.randn(400, 5, 6, generator=torch.Generator().manual_seed(1))
    loss = (net(noise, torch.ones(400, dtype=torch.long)) - noise).square().mean()
    assert float(loss.detach()) == pytest.approx(1, abs=4 * (2 / noise.numel()) ** 0.5)


def test_every_block_is_the_identity_at_the_start() -> None:
    """With two layers the second adds what the first was given to its own, so the tokens are doubled."""
    net = TransLinear(SMALL).eval()
    block, h = net.temporal_decoder_blocks[0], torch.randn(2, 5, 32)
    assert torch.equal(block(h, torch.randn(2, 32)), h)


@pytest.mark.parametrize("layers", [1, 3, 7])
def test_odd_layers_are_refused_in_words(layers: int) -> None:
    with pytest.raises(MotionloomError, match="even"):
        PredictorConfig(layers=layers)


@pytest.mark.parametrize("config", [SMALL, BESIDE], ids=["published", "beside"])
def test_rows_do_not_see_each_other(config: PredictorConfig) -> None:
    net, (x, t, condition) = awake(config), inputs(config)
    together = net(x, t, condition)
    alone = torch.cat([net(x[i : i + 1], t[i : i + 1], condition[i : i + 1]) for i in range(3)])
    torch.testing.assert_close(together, alone, atol=1e-5, rtol=1e-5)
    assert not torch.allclose(together[0], together[1], atol=1e-2)


@pytest.mark.parametrize("config", [SMALL, BESIDE], ids=["published", "beside"])
def test_rows_that_are_not_told_are_as_with_nothing_to_tell(config: PredictorConfig) -> None:
    net, (x, t, condition) = awake(config), inputs(config)
    mixed = net(x, t, condition, torch.tensor([True, False, True]))
    torch.testing.assert_close(mixed[1], net(x, t)[1])
    torch.testing.assert_close(mixed[::2], net(x, t, condition)[::2])
    assert not torch.allclose(mixed[0], net(x, t)[0], atol=1e-2)


def test_nothing_told_is_not_zeros_told() -> None:
    """The bias of the condition's layer is absent too."""
    net, (x, t, condition) = awake(SMALL), inputs(SMALL)
    assert not torch.allclose(net(x, t), net(x, t, torch.zeros_like(condition)), atol=1e-3)


def naive(net: TransLinear, x: Tensor, t: Tensor, condition: Tensor) -> Tensor:
    """The published network again, head by head, the skips written as the paper's figure has them."""
    w = net.state_dict()

    def linear(v: Tensor, name: str) -> Tensor:
        waves_ = v @ w[f"{name}.weight"].T
        return waves_ + w[f"{name}.bias"] if f"{name}.bias" in w else waves_

    def norm(v: Tensor, name: str) -> Tensor:
        v = v - v.mean(-1, keepdim=True)
        return v / (v.square().mean(-1, keepdim=True) + 1e-5).sqrt() * w[f"{name}.weight"] + w[f"{name}.bias"]

    def silu(v: Tensor) -> Tensor:
        return v / (1 + (-v).exp())

    def stylised(h: Tensor, emb: Tensor, name: str) -> Tensor:
        both = linear(silu(emb), f"{name}.emb_layers.1")
        scale, shift = both[:, None, : h.shape[-1]], both[:, None, h.shape[-1] :]
        return linear(silu(norm(h, f"{name}.norm") * (1 + scale) + shift), f"{name}.out_layers.2")

    def block(h: Tensor, emb: Tensor, i: int) -> Tensor:
        at = f"temporal_decoder_blocks.{i}"
        z, size = norm(h, f"{at}.sa_block.norm"), h.shape[-1] // net.config.heads
        q, k, v = (linear(z, f"{at}.sa_block.{name}") for name in ("query", "key", "value"))
        heads = []
        for a in range(0, h.shape[-1], size):
            share = q[..., a : a + size] @ k[..., a : a + size].mT / size**0.5
            heads.append(share.softmax(-1) @ v[..., a : a + size])
        h = h + stylised(torch.cat(heads, -1), emb, f"{at}.sa_block.proj_out")
        inner = linear(h, f"{at}.ffn.linear1")
        inner = inner * (1 + torch.erf(inner / 2**0.5)) / 2
        return h + stylised(linear(inner, f"{at}.ffn.linear2"), emb, f"{at}.ffn.proj_out")

    emb = linear(silu(linear(waves(t, net.config.width), "time_embed.0")), "time_embed.2")
    emb = emb + linear(condition.reshape(len(condition), -1), "cond_embed")
    in0 = linear(x, "joint_embed") + w["sequence_embedding"]
    in1 = block(in0, emb, 0)
    out2 = block(block(in1, emb, 1), emb, 2) + in1
    return linear(block(out2, emb, 3) + in0, "out")


def test_four_layers_are_the_published_ones_written_out() -> None:
    net, (x, t, condition) = awake(SMALL), inputs(SMALL)
    torch.testing.assert_close(net(x, t, condition), naive(net, x, t, condition), atol=1e-4, rtol=1e-4)


def test_time_waves_are_cosines_then_sines_of_falling_frequency() -> None:
    waves_ = waves(torch.tensor([500]), 512)[0]
    assert waves_[:4].tolist() == pytest.approx([-0.883849, 0.096189, 0.945946, -0.919424], abs=1e-4)
    assert waves_[256:260].tolist() == pytest.approx([-0.467772, -0.995363, 0.324325, 0.393267], abs=1e-4)


def test_beside_every_token_sees_its_own_row() -> None:
    """With the condition's own layer silent, a row of what is told still matters, the last (tokenless) one not."""
    net, (x, t, condition) = awake(BESIDE), inputs(BESIDE)
    with torch.no_grad():
        net.cond_embed.weight.zero_()
    before = net(x, t, condition)
    row, last = condition.clone(), condition.clone()
    row[:, 2] += 1
    last[:, -1] += 1
    assert not torch.allclose(before, net(x, t, row), atol=1e-3)
    assert torch.equal(before, net(x, t, last))


@pytest.mark.parametrize(
    "values",
    [
        {"channels": 0},
        {"channels": 1 << 20},
        {"layers": 1 << 10},
        {"width": 33},
        {"heads": 7},
        {"kept": 2.0},
        {"kept": True},
        {"dropout": 1.0},
        {"dropout": float("nan")},
        {"dropout": "x"},
        {"condition": 5},
        {"condition": "ab"},
        {"condition": [1]},
        {"condition": [3, 8], "beside": True},
        {"beside": 1000},
        {"breadth": 3},
        {"width": None},
    ],
    ids=str,
)
def test_sizes_that_cannot_be_are_refused(values: dict) -> None:
    with pytest.raises(MotionloomError):
        PredictorConfig.parse(values)


@pytest.mark.parametrize("values", [[1], "ab", 3, None], ids=str)
def test_settings_that_are_no_settings_are_refused(values: object) -> None:
    with pytest.raises(MotionloomError):
        PredictorConfig.parse(values)  # pyright: ignore[reportArgumentType]
