"""Weight files: what is written comes back, and a hostile file gives one sentence."""

import json
import pickle
import zipfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.known import Known, known_sentences
from motionloom.core.models.networks.text.published import PublishedText
from motionloom.core.models.prior import Prior, find_weights, load_prior, save_prior
from tests.recorded import tiny
from tests.recorded.graphs import BABEL


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_prior(tiny.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors")


def parts(file: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    with safe_open(file, framework="np") as opened:
        return {k: opened.get_tensor(k) for k in opened.keys()}, json.loads(opened.metadata()["motionloom"])  # noqa: SIM118


def write(path: Path, tensors: dict[str, np.ndarray], about: Any) -> Path:
    text = about if isinstance(about, str) else json.dumps(about)
    save_file(tensors, path, metadata={"motionloom": text})
    return path


def guess(prior: Prior) -> np.ndarray:
    x = np.random.default_rng(5).standard_normal((1, 9, 263), np.float32)
    return prior.net(x, 3, prior.net.bind(prior.condition(["a person walks"])))


def test_a_prior_comes_back_whole(tmp_path: Path) -> None:
    """In float32 bit for bit: weights, statistics, schedule, text encoder, card."""
    prior = tiny.prior()
    again = load_prior(save_prior(prior, tmp_path / "a.safetensors", half=False))
    kept, found = prior.net.weights, again.net.weights
    assert kept.keys() == found.keys()
    assert all(np.array_equal(kept[key], found[key]) for key in kept)
    np.testing.assert_array_equal(guess(again), guess(prior))
    assert again.card == prior.card
    assert (again.schedule.name, again.schedule.steps, again.fps) == ("cosine", 50, 20.0)
    assert np.array_equal(again.mean, prior.mean)
    assert np.array_equal(again.std, prior.std)


def test_half_precision_changes_little(file: Path) -> None:
    """float16 keeps 11 bits: the guess moves by less than a hundredth of its spread."""
    whole, half = guess(tiny.prior()), guess(load_prior(file))
    assert 0 < np.abs(whole - half).max() < 0.01 * whole.std()


def test_an_empty_prompt_asks_for_nothing() -> None:
    prior = tiny.prior()
    some, none = prior.condition(["a person walks", " "]), prior.condition(["a person walks", "a person turns"]).null()
    assert np.array_equal(some.pooled[1], none.pooled[1])
    assert not np.array_equal(some.pooled[0], none.pooled[0])


def test_published_text_is_saved_without_clip(tmp_path: Path) -> None:
    """A prior that wants CLIP is written and read where CLIP is not there; only encoding needs it."""
    mean = np.zeros(135, np.float32)
    prior = Prior(
        tiny.net(BABEL),
        tiny.prior().schedule,
        mean,
        mean + 1,
        PublishedText("clip-77"),
        tiny.prior().card,
        30.0,
    )
    again = load_prior(save_prior(prior, tmp_path / "a.safetensors"))
    assert again.text.name == "clip-77"
    assert (len(again.mean), again.fps) == (135, 30.0)


def test_weights_are_found_by_name_or_path_and_else_the_names_are_listed(file: Path) -> None:
    assert find_weights(file) == file
    with pytest.raises(MotionloomError, match="shipped names"):
        find_weights("no such thing")


@pytest.mark.parametrize(
    "content", [b"", b"\0" * 64, b"\xff" * 64, b"PK\3\4" + bytes(60), b"\x08" + bytes(7) + b'{"a":1}]']
)
def test_other_files_under_this_name_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.safetensors"
    path.write_bytes(content)
    with pytest.raises(MotionloomError):
        load_prior(path)


def test_a_pickle_under_this_name_is_refused_and_import_is_named(tmp_path: Path) -> None:
    """As old PyTorch wrote it, and as newer ones do: in a ZIP file."""
    content, path = pickle.dumps({"a": [0.0] * 3}, protocol=2), tmp_path / "a.safetensors"
    path.write_bytes(content)
    with pytest.raises(MotionloomError, match="motionloom import"):
        load_prior(path)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a/data.pkl", content)
    with pytest.raises(MotionloomError, match="motionloom import"):
        load_prior(path)


def test_truncated_files_are_refused(file: Path, tmp_path: Path) -> None:
    whole = file.read_bytes()
    for size in (1, 8, 100, len(whole) // 2, len(whole) - 1):
        path = tmp_path / "a.safetensors"
        path.write_bytes(whole[:size])
        with pytest.raises(MotionloomError):
            load_prior(path)


@pytest.mark.parametrize(
    "change",
    [
        {"format": 99},
        {"format": None},
        {"net": 3},
        {"net": {"width": 2**40}},
        {"net": {"layers": 10**9}},
        {"net": {"flags": 9}},
        {"net": {"dropout": "x"}},
        {"schedule": {"name": [], "steps": 5}},
        {"schedule": {"name": "cosine", "steps": 10**9}},
        {"schedule": {"name": "cosine", "steps": "5"}},
        {"text": "bert"},
        {"text": 5},
        {"text": "clip"},
        {"fps": -1},
        {"fps": 1e300},
        {"fps": float("nan")},
        {"card": {}},
        {"card": {"name": "x", "notes": []}},
        {"card": {"name": "x", "licence": 1}},
        {"card": [1]},
    ],
    ids=str,
)
def test_descriptions_that_cannot_be_true_are_refused(file: Path, tmp_path: Path, change: dict) -> None:
    """Sizes are compared with the tensors before anything of that size is made."""
    tensors, about = parts(file)
    if isinstance(change.get("net"), dict):
        change = {"net": about["net"] | change["net"]}
    with pytest.raises(MotionloomError):
        load_prior(write(tmp_path / "a.safetensors", tensors, about | change))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "7", "[" * 100_000, '{"format": 1}'], ids=lambda t: t[:12])
def test_metadata_that_is_no_description_is_refused(file: Path, tmp_path: Path, text: str) -> None:
    with pytest.raises(MotionloomError):
        load_prior(write(tmp_path / "a.safetensors", parts(file)[0], text))


def test_weights_of_something_else_are_no_prior(file: Path, tmp_path: Path) -> None:
    """An evaluator's or an adapter's; nothing of Python is in the sentence."""
    save_file(parts(file)[0], tmp_path / "a.safetensors", {"motionloom-adapter": "{}"})
    with pytest.raises(MotionloomError, match=r"a.safetensors is an adapter, not a prior; name"):
        load_prior(tmp_path / "a.safetensors")


@pytest.mark.parametrize("key", ["net.embed.weight", "net.blocks.1.table", "mean", "std"])
@pytest.mark.parametrize("fault", ["missing", "misshapen", "nan", "more"])
def test_tensors_that_do_not_fit_are_refused(file: Path, tmp_path: Path, key: str, fault: str) -> None:
    tensors, about = parts(file)
    value = tensors.pop(key)
    if fault == "misshapen":
        tensors[key] = value[:-1].copy()
    elif fault == "nan":
        tensors[key] = np.full_like(value, np.nan)
    elif fault == "more":
        tensors |= {key: value, "net.surplus": np.zeros(1, np.float32)}
    with pytest.raises(MotionloomError):
        load_prior(write(tmp_path / "a.safetensors", tensors, about))


def test_a_text_encoder_without_words_is_refused(file: Path, tmp_path: Path) -> None:
    tensors, about = parts(file)
    with pytest.raises(MotionloomError, match="text encoder"):
        load_prior(
            write(tmp_path / "a.safetensors", {k: v for k, v in tensors.items() if "vocabulary" not in k}, about)
        )


def test_a_negative_std_is_refused(file: Path, tmp_path: Path) -> None:
    tensors, about = parts(file)
    with pytest.raises(MotionloomError, match="std"):
        load_prior(write(tmp_path / "a.safetensors", tensors | {"std": -tensors["std"]}, about))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_changed_bytes_give_a_prior_or_one_kind_of_error(
    file: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Most changes are drawn in the header, where sizes and places stand."""
    content = bytearray(file.read_bytes())
    header = 8 + int.from_bytes(content[:8], "little")
    for _ in range(data.draw(st.integers(1, 4))):
        last = data.draw(st.sampled_from([8, header, header, len(content)]))
        content[data.draw(st.integers(0, last - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("changed") / "a.safetensors"
    path.write_bytes(content)
    with suppress(MotionloomError):
        load_prior(path)


def test_only_safetensors_are_written_and_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError):
        save_prior(tiny.prior(), tmp_path / "a.pt")
    with pytest.raises(MotionloomError):
        save_prior(tiny.prior(), tmp_path / "absent" / "a.safetensors")
    assert not list(tmp_path.iterdir())


def test_a_file_of_before_graphs_is_refused_and_the_way_named(file: Path, tmp_path: Path) -> None:
    tensors, about = parts(file)
    for lost in ("graph.", "graph.bind", "graph.text"):
        kept = {key: value for key, value in tensors.items() if not key.startswith(lost)}
        path = write(tmp_path / "old.safetensors", kept, about)
        with pytest.raises(MotionloomError, match=r"old.safetensors has no graphs .* 'motionloom weights convert "):
            load_prior(path)


@pytest.mark.parametrize("name", ["graph.prior", "graph.bind", "graph.text"])
@pytest.mark.parametrize(
    "content", [b"x", b"\0" * 90, b"the graph of another network"], ids=["short", "zeros", "other"]
)
def test_graphs_that_are_none_are_refused_when_the_file_is_read(
    file: Path, tmp_path: Path, name: str, content: bytes
) -> None:
    tensors, about = parts(file)
    tensors[name] = np.frombuffer(content, np.uint8)
    with pytest.raises(MotionloomError, match=r"cannot be run \("):
        load_prior(write(tmp_path / "a.safetensors", tensors, about))


def test_the_graph_of_other_sizes_is_refused(file: Path, tmp_path: Path) -> None:
    tensors, about = parts(file)
    other = tiny.net(replace(tiny.MODULATED, hidden=40))
    tensors["graph.prior"] = np.frombuffer(other.graphs["prior"], np.uint8)
    with pytest.raises(MotionloomError, match=r"linear1.* is .*, and the weights' is"):
        load_prior(write(tmp_path / "a.safetensors", tensors, about))


def known() -> Known:
    encoder = tiny.text()
    return known_sentences(["a person walks", "a person turns left"], {"walk": 4.5}, encoder)


def test_what_a_prior_knows_comes_back(tmp_path: Path, file: Path) -> None:
    made = replace(tiny.prior(), known=known())
    again = load_prior(save_prior(made, tmp_path / "a.safetensors")).known
    assert again is not None
    assert again.sentences == ("walks", "turns left")
    assert again.seconds == {"walk": 4.5}
    assert load_prior(file).known is None  # files without the table are read as they were


def test_a_damaged_table_of_what_is_known_is_refused(tmp_path: Path) -> None:
    made = save_prior(replace(tiny.prior(), known=known()), tmp_path / "a.safetensors")
    tensors, about = parts(made)
    del tensors["known.vectors"]
    with pytest.raises(MotionloomError, match="lacks its vectors; fetch the weights again"):
        load_prior(write(tmp_path / "b.safetensors", tensors, about))
