"""Low-rank adapters: what they add, that nothing is lost in a file, and which files are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import save_file

from motionloom.core.diffusion import join_rows
from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import GIVEN, Adapter, adapted, adapters, layers
from motionloom.core.models.container import ADAPTERS
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Bound, condition
from motionloom.core.models.prior import Prior
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH


def bound(net: PriorSession, rows: int = 2) -> Bound:
    rng = np.random.default_rng(7)
    pooled, tokens = rng.standard_normal((rows, WIDTH), np.float32), rng.standard_normal((rows, 3, WIDTH), np.float32)
    return net.bind(condition(pooled, tokens=tokens))


def control_adapter(prior: Prior, *, given_rank: int = 3) -> Adapter:
    return tiny.adapter(prior, control="any", given_rank=given_rank)


def sample(rows: int = 2) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    x = rng.standard_normal((rows, 10, tiny.MODULATED.features), np.float32)
    return x, rng.random(x.shape) < 0.3


def test_the_change_is_the_product_of_the_thin_matrices():
    """W + U D in every changed layer, computed here from the file's numbers alone."""
    prior = tiny.prior()
    found, plain = control_adapter(prior), prior.net
    merged = adapted(plain, found)
    for name, weight in layers(plain).items():
        down, up = (found.tensors[f"{name}.{part}"] for part in ("down", "up"))
        np.testing.assert_allclose(merged.weights[f"net.{name}.weight"], weight + up @ down, atol=1e-6)
    unchanged = merged.weights.keys() - {f"net.{name}.weight" for name in layers(plain)}
    assert all(np.array_equal(merged.weights[key], plain.weights[key]) for key in unchanged)


def test_what_is_given_is_added_to_each_token():
    """U_g D_g times [given, mask] of the token's frames."""
    prior = tiny.prior()
    found = control_adapter(prior)
    merged, (x, mask) = adapted(prior.net, found), sample()
    added = merged.show(bound(merged), x, mask).shown
    shown = np.concatenate([np.where(mask, x, 0), mask], axis=-1)
    wanted = shown[:, :8].reshape(2, 2, -1) @ (found.tensors[f"{GIVEN}.up"] @ found.tensors[f"{GIVEN}.down"]).T
    np.testing.assert_allclose(added[:, :2], wanted, rtol=1e-4, atol=1e-5)


def test_rows_of_shown_conditions_join():
    """Guidance puts two conditions behind each other: each row keeps its own mask."""
    prior = tiny.prior()
    merged, (x, mask) = adapted(prior.net, control_adapter(prior)), sample()
    plain = bound(merged)
    first, second = merged.show(plain, x, mask), merged.show(plain, x, ~mask)
    both = merged(np.concatenate([x, x]), 5, join_rows(first, second))
    np.testing.assert_array_equal(both, np.concatenate([merged(x, 5, first), merged(x, 5, second)]))


def test_a_plain_condition_means_an_empty_mask():
    prior = tiny.prior()
    merged, (x, mask) = adapted(prior.net, control_adapter(prior)), sample()
    plain = bound(merged)
    empty, seen = merged.show(plain, x, np.zeros(mask.shape, bool)), merged.show(plain, x, mask)
    np.testing.assert_array_equal(merged(x, 5, plain), merged(x, 5, empty))
    assert np.abs(merged(x, 5, seen) - merged(x, 5, plain)).max() > 1e-3


def test_files_come_back_as_written(tmp_path):
    prior = tiny.prior()
    written = control_adapter(prior)
    found = Adapter.load(written.save(tmp_path / "a.safetensors"), prior)
    for part in ("name", "control", "rank", "base", "fingerprint", "licence", "data", "notes", "given_rank"):
        assert getattr(found, part) == getattr(written, part)
    for key, value in written.tensors.items():
        np.testing.assert_array_equal(found.tensors[key], value.astype(np.float16).astype(np.float32))
    bare = control_adapter(prior, given_rank=0)
    assert not Adapter.load(bare.save(tmp_path / "b.safetensors"), prior).sees_given


def refused(path, prior, words: str) -> None:
    with pytest.raises(MotionloomError, match=words) as caught:
        Adapter.load(path, prior)
    assert "\n" not in str(caught.value)


def test_another_priors_adapter_is_refused(tmp_path):
    prior = tiny.prior()
    path = control_adapter(prior).save(tmp_path / "a.safetensors")
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
    written = control_adapter(prior)
    tensors = {k: v.copy() for k, v in written.tensors.items()}
    harm(tensors)
    refused(replace(written, tensors=tensors).save(tmp_path / "a.safetensors"), prior, "fetch or train it again")


@pytest.mark.parametrize("change", BAD_WORDS.values(), ids=BAD_WORDS)
def test_descriptions_of_another_kind_are_refused(tmp_path, change):
    prior = tiny.prior()
    written = control_adapter(prior)
    about = {k: getattr(written, k) for k in ("name", "control", "base", "fingerprint", "licence", "data", "rank")}
    save_file(
        dict(written.tensors),
        tmp_path / "a.safetensors",
        metadata={ADAPTERS.key: json.dumps(about | {"format": 1} | change)},
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
        control_adapter(prior).save(tmp_path / "a.pt")


def test_the_shipped_adapters_fit_the_shipped_prior_and_are_small():
    """Every adapter in the package: at most 3 MB, for the weights beside it, with a licence."""
    assert sorted(adapters()) == ["any", "trajectory"]
    prior = Prior.load("default")
    for name, path in adapters().items():
        found = Adapter.load(name, prior)
        assert path.stat().st_size <= 3_000_000
        assert found.name == name
        assert "CMU" in found.licence
