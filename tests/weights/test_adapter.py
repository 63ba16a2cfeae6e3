"""Low-rank adapters: what they add, that nothing is lost between training and file, and which files are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors.numpy import save_file
from torch import Tensor

from motionloom.diffusion import join_rows
from motionloom.errors import MotionloomError
from motionloom.nets.prior import NetConfig, PriorNet, condition
from motionloom.runtime import prior_condition
from motionloom.runtime.prior import PriorSession
from motionloom.train.low_rank import AdapterNet, Controlled, linears, tensors_of
from motionloom.train.modules import prior_module, prior_session
from motionloom.weights.adapter import GIVEN, KEY, Adapter, adapted, adapters, fingerprint, layers, show
from motionloom.weights.prior import Prior
from tests.nets import tiny
from tests.nets.text.tiny import WIDTH

FLAGGED = NetConfig(width=32, layers=1, heads=4, hidden=48, text=WIDTH, features=24, flags=True, dropout=0.0)
NETS = {"modulated": tiny.MODULATED, "published": tiny.PUBLISHED, "flags": FLAGGED}


def asked(config: NetConfig, rows: int = 2, lengths=None) -> dict:
    generator = torch.Generator().manual_seed(7)
    said = [torch.randn(rows, *shape, generator=generator) for shape in ((WIDTH,), (3, WIDTH))]
    flags = torch.randint(0, 2, (rows, 10), generator=generator) if config.flags else None
    return {"pooled": said[0], "tokens": said[1], "lengths": lengths, "flags": flags}


def bound(net: PriorNet, rows: int = 2, lengths=None):
    return net.bind(condition(**asked(net.config, rows, lengths)))


def bound_arrays(net: PriorSession, rows: int = 2, lengths=None) -> prior_condition.Bound:
    said = asked(net.config, rows, lengths)
    arrays = {key: value.numpy() if isinstance(value, Tensor) else value for key, value in said.items()}
    return net.bind(prior_condition.condition(**arrays))


def trained(net: PriorNet, *, given_rank: int = 3, seed: int = 1) -> AdapterNet:
    """An adapter whose every number matters."""
    made = AdapterNet(net, 2, given_rank=given_rank)
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for value in made.parameters():
            value.copy_(0.2 * torch.randn(value.shape, generator=generator))
    return made


def adapter_of(made: AdapterNet, net: PriorNet) -> Adapter:
    return Adapter(
        "tiny",
        "any",
        2,
        tensors_of(made.state_dict()),
        "tiny",
        fingerprint(prior_session(net)),
        "free",
        "numbers",
        {"a": 1},
    )


def sample(net: PriorNet, rows: int = 2) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(3)
    x = torch.randn(rows, 10, net.config.features, generator=generator)
    return x, torch.rand(x.shape, generator=generator) < 0.3


@pytest.mark.parametrize("config", NETS.values(), ids=NETS)
@torch.no_grad()
def test_merged_weights_answer_what_the_trained_adapter_answers(config):
    """Two ways to compute the same network, with patches, flags and padded rows."""
    net = tiny.net(config)
    made, (x, mask) = trained(net), sample(net)
    said = Controlled(bound(net, lengths=[10, 7]), x, mask)
    merged = adapted(prior_session(net), adapter_of(made, net))
    shown = show(merged, bound_arrays(merged, lengths=[10, 7]), x.numpy(), mask.numpy())
    found, wanted = merged(x.numpy(), 5, shown), made(x, 5, said).numpy()
    np.testing.assert_allclose(found[0], wanted[0], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found[1, :7], wanted[1, :7], rtol=1e-4, atol=1e-5)
    assert np.abs(found - net(x, 5, said.bound).numpy()).max() > 0.1


def test_the_change_is_the_product_of_the_thin_matrices():
    """W + U D in every changed layer, computed here from the file's numbers alone."""
    net = tiny.net()
    found, plain = adapter_of(trained(net), net), prior_session(net)
    merged = adapted(plain, found)
    assert layers(plain).keys() == linears(net).keys()
    for name, weight in layers(plain).items():
        down, up = (found.tensors[f"{name}.{part}"] for part in ("down", "up"))
        np.testing.assert_allclose(merged.weights[f"net.{name}.weight"], weight + up @ down, atol=1e-6)
    unchanged = merged.weights.keys() - {f"net.{name}.weight" for name in layers(plain)}
    assert all(np.array_equal(merged.weights[key], plain.weights[key]) for key in unchanged)


def test_what_is_given_is_added_to_each_token():
    """U_g D_g times [given, mask] of the token's frames."""
    net = tiny.net()
    found = adapter_of(trained(net), net)
    merged, (x, mask) = adapted(prior_session(net), found), sample(net)
    added = show(merged, bound_arrays(merged), x.numpy(), mask.numpy()).shown
    shown = torch.cat([torch.where(mask, x, 0), mask.float()], dim=-1).numpy()
    wanted = shown[:, :8].reshape(2, 2, -1) @ (found.tensors[f"{GIVEN}.up"] @ found.tensors[f"{GIVEN}.down"]).T
    np.testing.assert_allclose(added[:, :2], wanted, rtol=1e-4, atol=1e-5)


@torch.no_grad()
def test_a_fresh_adapter_changes_nothing_and_plain_conditions_mean_an_empty_mask():
    net = tiny.net()
    x, mask = sample(net)
    said = bound(net)
    torch.testing.assert_close(AdapterNet(net, 2, given_rank=3)(x, 5, Controlled(said, x, mask)), net(x, 5, said))
    merged = adapted(prior_session(net), adapter_of(trained(net), net))
    plain, given = bound_arrays(merged), x.numpy()
    empty = show(merged, plain, given, np.zeros(mask.shape, bool))
    np.testing.assert_array_equal(merged(given, 5, plain), merged(given, 5, empty))
    seen = show(merged, plain, given, mask.numpy())
    assert np.abs(merged(given, 5, seen) - merged(given, 5, plain)).max() > 1e-3


def test_rows_of_shown_conditions_join():
    """Guidance puts two conditions behind each other: each row keeps its own mask."""
    net = tiny.net()
    merged, (x, mask) = adapted(prior_session(net), adapter_of(trained(net), net)), sample(net)
    given, plain = x.numpy(), bound_arrays(merged)
    first, second = show(merged, plain, given, mask.numpy()), show(merged, plain, given, ~mask.numpy())
    both = merged(np.concatenate([given, given]), 5, join_rows(first, second))
    np.testing.assert_array_equal(both, np.concatenate([merged(given, 5, first), merged(given, 5, second)]))


def test_only_the_adapter_learns_and_only_it_is_in_the_state():
    net = tiny.net(replace(tiny.MODULATED, dropout=0.5))
    before = {k: v.clone() for k, v in net.state_dict().items()}
    made, (x, mask) = trained(net).train(), sample(net)
    said = Controlled(bound(net), x, mask)
    torch.testing.assert_close(made(x, 5, said), made(x, 5, said), rtol=0, atol=0)  # no dropout in what is frozen
    made(x, 5, said).square().mean().backward()
    assert all(p.grad is not None and bool(p.grad.abs().max() > 0) for p in made.parameters())
    assert set(tensors_of(made.state_dict())) == {
        f"{name}.{part}" for name in (*linears(net), GIVEN) for part in ("down", "up")
    }
    assert all(torch.equal(v, before[k]) for k, v in net.state_dict().items())


def test_files_come_back_as_written(tmp_path):
    prior = tiny.prior()
    written = adapter_of(trained(prior_module(prior)), prior_module(prior))
    found = Adapter.load(written.save(tmp_path / "a.safetensors"), prior)
    for part in ("name", "control", "rank", "base", "fingerprint", "licence", "data", "notes", "given_rank"):
        assert getattr(found, part) == getattr(written, part)
    for key, value in written.tensors.items():
        np.testing.assert_array_equal(found.tensors[key], value.astype(np.float16).astype(np.float32))
    bare = adapter_of(trained(prior_module(prior), given_rank=0), prior_module(prior))
    assert not Adapter.load(bare.save(tmp_path / "b.safetensors"), prior).sees_given


def refused(path, prior, words: str) -> None:
    with pytest.raises(MotionloomError, match=words) as caught:
        Adapter.load(path, prior)
    assert "\n" not in str(caught.value)


def test_another_priors_adapter_is_refused(tmp_path):
    prior = tiny.prior()
    path = adapter_of(trained(prior_module(prior)), prior_module(prior)).save(tmp_path / "a.safetensors")
    refused(path, tiny.prior(seed=5), "belongs to the weights 'tiny'")


BAD_TENSORS = {
    "missing": lambda t: t.pop("out.up"),
    "unknown": lambda t: t.update(other=np.zeros(2, np.float32)),
    "shape": lambda t: t.update({"out.up": np.zeros((3, 3), np.float32)}),
    "nan": lambda t: t["embed.down"].fill(np.nan),
    "a number for a matrix": lambda t: t.update({"given.down": np.array(1.0, np.float32)}),
    "half an input": lambda t: t.pop("given.up"),
}
BAD_WORDS = {
    "rank": {"rank": 10**9},
    "rank true": {"rank": True},
    "name": {"name": 7},
    "format": {"format": 2},
    "notes": {"notes": []},
}


@pytest.mark.parametrize("harm", BAD_TENSORS.values(), ids=BAD_TENSORS)
def test_damaged_tensors_are_refused_in_a_sentence(tmp_path, harm):
    prior = tiny.prior()
    written = adapter_of(trained(prior_module(prior)), prior_module(prior))
    tensors = {k: v.copy() for k, v in written.tensors.items()}
    harm(tensors)
    refused(replace(written, tensors=tensors).save(tmp_path / "a.safetensors"), prior, "fetch or train it again")


@pytest.mark.parametrize("change", BAD_WORDS.values(), ids=BAD_WORDS)
def test_descriptions_of_another_kind_are_refused(tmp_path, change):
    prior = tiny.prior()
    written = adapter_of(trained(prior_module(prior)), prior_module(prior))
    about = {k: getattr(written, k) for k in ("name", "control", "base", "fingerprint", "licence", "data", "rank")}
    save_file(
        dict(written.tensors), tmp_path / "a.safetensors", metadata={KEY: json.dumps(about | {"format": 1} | change)}
    )
    refused(tmp_path / "a.safetensors", prior, "adapter")


def test_files_of_another_kind_are_refused(tmp_path):
    prior = tiny.prior()
    (tmp_path / "rubbish.safetensors").write_bytes(b"\x00" * 64)
    save_file({"a": np.zeros(1)}, tmp_path / "other.safetensors")
    refused(tmp_path / "rubbish.safetensors", prior, "not a whole safetensors file")
    refused(tmp_path / "other.safetensors", prior, "something else, not an adapter")
    refused(tmp_path / "none.safetensors", prior, "no adapter")
    with pytest.raises(MotionloomError, match="another suffix"):
        adapter_of(trained(prior_module(prior)), prior_module(prior)).save(tmp_path / "a.pt")


def test_the_shipped_adapters_fit_the_shipped_prior_and_are_small():
    """Every adapter in the package: at most 3 MB, for the weights beside it, with a licence."""
    assert sorted(adapters()) == ["any", "trajectory"]
    prior = Prior.load("default")
    for name, path in adapters().items():
        found = Adapter.load(name, prior)
        assert path.stat().st_size <= 3_000_000
        assert found.name == name
        assert "CMU" in found.licence
