"""The prior's network in both variants: what it must not look at, and what its null condition is."""

from dataclasses import replace

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom_train.nets.prior import Bound, Condition, NetConfig, PriorNet, condition
from tests.recorded import tiny
from tests_train.nets.modules import tiny_net

CLOCKED = replace(tiny.MODULATED, clock=True)
BOTH = pytest.mark.parametrize(
    "config", [tiny.MODULATED, CLOCKED, tiny.PUBLISHED], ids=["modulated", "clocked", "published"]
)
CLOSE = {"rtol": 0, "atol": 2e-5}


def random_condition(rows: int, *, words: int = 5, seed: int = 1, lengths: list[int] | None = None) -> Condition:
    """Random text vectors, the last word of odd rows missing."""
    generator = torch.Generator().manual_seed(seed)
    width = tiny.MODULATED.text
    tokens = torch.randn(rows, words, width, generator=generator)
    mask = torch.ones(rows, words, dtype=torch.bool)
    mask[1::2, -1] = False
    return condition(torch.randn(rows, width, generator=generator), tokens=tokens, words=mask, lengths=lengths)


def noise(rows: int, frames: int, seed: int = 2) -> Tensor:
    return torch.randn(rows, frames, 263, generator=torch.Generator().manual_seed(seed))


def run(net: PriorNet, x: Tensor, cond: Condition, level: int | Tensor = 7) -> Tensor:
    with torch.inference_mode():
        return net(x, level, net.bind(cond))


@BOTH
@settings(max_examples=12, deadline=None)
@given(frames=st.integers(1, 17), more=st.integers(0, 9), fill=st.sampled_from([0.0, 1.0, 1e3]))
def test_valid_frames_do_not_depend_on_padding(config: NetConfig, frames: int, more: int, fill: float) -> None:
    """Neither on what stands in the padded frames nor on how many there are, whatever the length is."""
    net, x = tiny_net(config), noise(1, frames)
    padded = torch.cat([x, torch.full((1, more, 263), fill)], dim=1)
    alone = run(net, x, random_condition(1))
    torch.testing.assert_close(run(net, padded, random_condition(1, lengths=[frames]))[:, :frames], alone, **CLOSE)


@BOTH
def test_without_lengths_every_frame_is_heard(config: NetConfig) -> None:
    """-1 means all frames are valid: a change in the last one reaches the first."""
    net, x = tiny_net(config), noise(1, 9)
    changed = x.clone()
    changed[:, -1] += 3
    assert (run(net, x, random_condition(1)) - run(net, changed, random_condition(1)))[:, 0].abs().max() > 1e-3


@BOTH
def test_rows_are_independent(config: NetConfig) -> None:
    """A row in a batch with other texts, levels and lengths is what it is alone."""
    net, x, cond = tiny_net(config), noise(4, 10), random_condition(4, lengths=[10, 3, 7, -1])
    levels = torch.tensor([1, 5, 30, 50])
    together = run(net, x, cond, levels)
    for row in range(4):
        length = int(cond.lengths[row]) if cond.lengths[row] > 0 else 10
        one = Condition(*(part[row : row + 1] for part in cond))
        alone = run(net, x[row : row + 1], one, levels[row : row + 1])
        torch.testing.assert_close(together[row, :length], alone[0, :length], **CLOSE)


def test_a_clock_tells_time_and_text_without_the_noise() -> None:
    """New, it changes nothing; with weights, what it adds differs by token and by text, and not by the state."""
    plain = tiny_net(tiny.MODULATED)
    fresh = PriorNet(CLOCKED).eval()
    missing = fresh.load_state_dict(plain.state_dict(), strict=False).missing_keys
    assert {key.split(".")[0] for key in missing} == {"place", "clock"}
    x, cond = noise(2, 12), random_condition(2)
    assert torch.equal(run(fresh, x, cond), run(plain, x, cond))
    net = tiny_net(CLOCKED)
    with torch.inference_mode():
        added, other = (net.enter(state, 7, net.bind(cond)).clock for state in (x, noise(2, 12, seed=3)))
    assert torch.equal(added, other)
    assert added.shape == (2, 3, 64)
    assert (added[0] - added[1]).abs().max() > 1e-3
    assert (added[:, 0] - added[:, 2]).abs().max() > 1e-3


@BOTH
def test_bound_once_is_bound_every_time(config: NetConfig) -> None:
    """Binding depends on the condition alone, and rows of bound parts may be chosen."""
    net, x, cond = tiny_net(config), noise(3, 8), random_condition(3)
    with torch.inference_mode():
        once = net.bind(cond)
        for level in (50, 3, 1):
            torch.testing.assert_close(net(x, level, once), net(x, level, net.bind(cond)), rtol=0, atol=0)
        chosen = Bound(*(part[1:] for part in once))
        torch.testing.assert_close(net(x[1:], 3, chosen), net(x, 3, once)[1:], **CLOSE)


@BOTH
@pytest.mark.parametrize("frames", [1, 3, 4, 5, 13])
def test_any_count_of_frames_keeps_its_shape(config: NetConfig, frames: int) -> None:
    assert run(tiny_net(config), noise(2, frames), random_condition(2)).shape == (2, frames, 263)


def test_the_null_text_of_the_published_manner_is_the_bias() -> None:
    """Unconditional input is the zero text vector, so what reaches the network is the bias of the text layer."""
    net = tiny_net(tiny.PUBLISHED)
    torch.testing.assert_close(net.bind(random_condition(2).null()).text, net.text.bias.expand(2, -1), rtol=0, atol=0)


@BOTH
def test_the_null_condition_forgets_the_text(config: NetConfig) -> None:
    """Two texts give two guesses, and one guess once they are taken away."""
    net, x = tiny_net(config), noise(2, 8)
    one, other = random_condition(2, seed=1), random_condition(2, seed=9)
    assert (run(net, x, one) - run(net, x, other)).abs().max() > 1e-3
    torch.testing.assert_close(run(net, x, one.null()), run(net, x, other.null()), rtol=0, atol=0)


@BOTH
def test_dropped_text_is_the_null_condition_in_its_rows(config: NetConfig) -> None:
    net, x, cond = tiny_net(config), noise(2, 8), random_condition(2)
    some = run(net, x, cond.choose(torch.tensor([True, False])))
    torch.testing.assert_close(some[0], run(net, x, cond)[0], **CLOSE)
    torch.testing.assert_close(some[1], run(net, x, cond.null())[1], **CLOSE)


def test_words_behind_the_mask_are_not_heard() -> None:
    net, x, cond = tiny_net(), noise(2, 8), random_condition(2)
    tokens = cond.tokens.clone()
    tokens[~cond.words] = 1e3
    torch.testing.assert_close(run(net, x, cond._replace(tokens=tokens)), run(net, x, cond), **CLOSE)


def test_a_network_that_reads_words_says_so() -> None:
    with pytest.raises(MotionloomError, match="word vectors"):
        tiny_net().bind(condition(torch.zeros(1, tiny.MODULATED.text)))


def test_transition_flags_are_heard_and_zero_by_default() -> None:
    net, x = tiny_net(replace(tiny.PUBLISHED, flags=True)), noise(1, 6)
    pooled = random_condition(1).pooled
    plain = run(net, x, condition(pooled))
    torch.testing.assert_close(run(net, x, condition(pooled, flags=torch.zeros(1, 6, dtype=torch.long))), plain)
    assert (run(net, x, condition(pooled, flags=torch.ones(1, 6, dtype=torch.long))) - plain).abs().max() > 1e-4


@pytest.mark.parametrize(
    ("features", "flags", "count"),
    [(263, False, 17_880_327), (135, False, 17_749_127), (135, True, 17_751_183)],
    ids=["HumanML3D", "BABEL", "BABEL with transitions"],
)
def test_parameter_counts_are_the_published_ones(features: int, flags: bool, count: int) -> None:
    with torch.device("meta"):
        net = PriorNet(NetConfig(features=features, flags=flags))
    assert sum(p.numel() for p in net.parameters()) == count


@pytest.mark.parametrize(
    "values",
    [
        {"width": 10**9},
        {"layers": 10**6},
        {"heads": 0},
        {"width": 33},
        {"features": 2.5},
        {"flags": 7},
        {"dropout": float("nan")},
        {"dropout": "much"},
        {"variant": "other"},
        {"variant": ["published"]},
        {"weight": 3},
    ],
    ids=str,
)
def test_unusable_sizes_are_refused(values: dict) -> None:
    with pytest.raises(MotionloomError):
        NetConfig.parse(values)
