"""Published checkpoints: key tables, tolerance, and nothing but plain numbers let in."""

import json
import pickle
import sys
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.published import PublishedText
from motionloom_lab.papers.mdm import describe, from_published, own_name, read_published

State = dict[str, Tensor]


def table(
    features: int = 263, *, flags: bool = False, width: int = 512, layers: int = 8, hidden: int = 1024
) -> dict[str, tuple[int, ...]]:
    """The published table of keys and shapes, written out (sinusoid buffers left out: they are no parameters)."""
    shapes: dict[str, tuple[int, ...]] = {
        "input_process.poseEmbedding.weight": (width, features + 4 * flags),
        "input_process.poseEmbedding.bias": (width,),
        "embed_timestep.time_embed.0.weight": (width, width),
        "embed_timestep.time_embed.0.bias": (width,),
        "embed_timestep.time_embed.2.weight": (width, width),
        "embed_timestep.time_embed.2.bias": (width,),
        "embed_text.weight": (width, 512),
        "embed_text.bias": (width,),
        "output_process.poseFinal.weight": (features, width),
        "output_process.poseFinal.bias": (features,),
    }
    for i in range(layers):
        shapes |= {
            f"seqTransEncoder.layers.{i}.{name}": shape
            for name, shape in {
                "self_attn.in_proj_weight": (3 * width, width),
                "self_attn.in_proj_bias": (3 * width,),
                "self_attn.out_proj.weight": (width, width),
                "self_attn.out_proj.bias": (width,),
                "linear1.weight": (hidden, width),
                "linear1.bias": (hidden,),
                "linear2.weight": (width, hidden),
                "linear2.bias": (width,),
                "norm1.weight": (width,),
                "norm1.bias": (width,),
                "norm2.weight": (width,),
                "norm2.bias": (width,),
            }.items()
        }
    return shapes | ({"emb_trans_or_not.weight": (2, 4)} if flags else {})


def state(features: int = 263, *, flags: bool = False) -> State:
    """A checkpoint of the published form, but narrow."""
    generator = torch.Generator().manual_seed(0)
    shapes = table(features, flags=flags, width=32, layers=2, hidden=16)
    return {key: torch.randn(shape, generator=generator) * 0.1 for key, shape in shapes.items()}


def write(folder: Path, content: object, options: dict | None = None) -> Path:
    path = folder / "model000200000.pt"
    torch.save(content, path)
    if options is not None:
        (folder / "args.json").write_text(json.dumps(options))
    return path


@pytest.mark.parametrize(
    ("features", "flags", "entries", "count"),
    [(263, False, 108, 17_880_327), (135, False, 108, 17_749_127), (135, True, 109, 17_751_183)],
    ids=["HumanML3D", "BABEL", "BABEL with transitions"],
)
def test_published_tables_are_read_whole(features: int, flags: bool, entries: int, count: int) -> None:
    """Every published key finds its place (two of the entries are sinusoid buffers), with the published size."""
    shapes = table(features, flags=flags)
    assert len(shapes) == entries - 2
    net = from_published({key: torch.zeros(shape) for key, shape in shapes.items()})
    assert sum(p.numel() for p in net.parameters()) == count
    assert net.config.features == features


def test_buffers_and_clip_are_neither_wanted_nor_missed() -> None:
    more = state() | {
        "sequence_pos_encoder.pe": torch.zeros(10, 1, 32),
        "embed_timestep.sequence_pos_encoder.pe": torch.zeros(10, 1, 32),
        "t_pos_encoder.pe": torch.zeros(10, 1, 32),
        "clip_model.visual.proj": torch.zeros(3, 3),
    }
    assert own_name("clip_model.visual.proj") is None
    a, b = from_published(state()).state_dict(), from_published(more).state_dict()
    assert a.keys() == b.keys()
    assert all(torch.equal(a[key], b[key]) for key in a)


@pytest.mark.parametrize("key", [*table(width=32, layers=1, hidden=16), "emb_trans_or_not.weight"])
def test_a_missing_or_misshapen_weight_fails(key: str) -> None:
    whole = state(135, flags=True)
    with pytest.raises(MotionloomError):
        from_published({k: v for k, v in whole.items() if k != key})
    with pytest.raises(MotionloomError):
        from_published(whole | {key: torch.zeros(*whole[key].shape, 2)})


@pytest.mark.parametrize(
    "key",
    [
        "embed_action.action_embedding",
        "seqTransDecoder.layers.0.linear1.weight",
        "seqTransEncoder.layers.x",
        "seqTransEncoder.layers.2.linear1.weight",
        "embed_text.scale",
        "weight",
        "",
    ],
)
def test_an_unexpected_weight_fails(key: str) -> None:
    with pytest.raises(MotionloomError):
        from_published(state() | {key: torch.zeros(2, 2)})


def test_numbers_that_are_not_finite_fail() -> None:
    broken = state()
    broken["embed_text.bias"][0] = float("nan")
    with pytest.raises(MotionloomError, match="finite"):
        from_published(broken)


def test_averaged_weights_are_preferred(tmp_path: Path) -> None:
    plain, averaged = state(), {key: value + 1 for key, value in state().items()}
    read = read_published(write(tmp_path, {"model": plain, "model_avg": averaged}))
    assert read.averaged
    assert torch.equal(read.state["embed_text.bias"], averaged["embed_text.bias"])
    read = read_published(write(tmp_path, {"model": plain}))
    assert not read.averaged
    assert torch.equal(read.state["embed_text.bias"], plain["embed_text.bias"])


class Bomb:
    """Unpickling it would create a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.mark.parametrize("inside", ["zip", "bare"])
def test_code_in_a_pickle_is_not_run(tmp_path: Path, inside: str) -> None:
    """The same file, opened carelessly, does create its file: the trap works."""
    trap = tmp_path / "was run"
    path = tmp_path / "model.pt"
    if inside == "zip":
        torch.save({**state(), "x": Bomb(trap)}, path)
    else:
        path.write_bytes(pickle.dumps(Bomb(trap)))
    with pytest.raises(MotionloomError, match="not opened"):
        read_published(path)
    assert not trap.exists()
    if inside == "bare":
        pickle.loads(path.read_bytes())
        assert trap.exists()


def test_damaged_files_fail_in_one_sentence(tmp_path: Path) -> None:
    path = write(tmp_path, state())
    whole = path.read_bytes()
    for damaged in (b"", b"\0" * 100, whole[:100], whole[: len(whole) // 2], whole[:-30]):
        path.write_bytes(damaged)
        with pytest.raises(MotionloomError) as caught:
            from_published(read_published(path).state)
        assert "\n" not in str(caught.value)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_mutated_files_give_one_kind_of_error(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.mktemp("mutated")
    path = write(folder, {"embed_text.weight": torch.zeros(2, 2)})
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    with pytest.raises(MotionloomError):
        from_published(read_published(path).state)


@pytest.mark.parametrize(
    "value",
    [torch.zeros(1).expand(1 << 20, 1 << 20), torch.zeros(4, 4, dtype=torch.long), torch.zeros(4, 4).to_sparse()],
    ids=["one number spread over a tebibyte", "integers", "sparse"],
)
def test_tensors_that_are_not_plain_are_refused(tmp_path: Path, value: Tensor) -> None:
    with pytest.raises(MotionloomError):
        read_published(write(tmp_path, {"embed_text.weight": value}))


@pytest.mark.parametrize("content", [[1], {"model": 3}, {"a": 1}, {1: torch.zeros(2)}, 5, torch.zeros(3)], ids=str)
def test_other_contents_are_refused(tmp_path: Path, content: object) -> None:
    with pytest.raises(MotionloomError):
        from_published(read_published(write(tmp_path, content)).state)


def test_missing_options_are_assumed_aloud_and_unknown_ones_ignored(tmp_path: Path) -> None:
    read = read_published(
        write(tmp_path, state(), {"noise_schedule": "linear", "diffusion_steps": 50, "emb_before_mask": 1})
    )
    about = describe(read, from_published(read.state))
    assert (about.schedule, about.steps) == ("linear", 50)
    assert len(about.warnings) == 1
    assert "arch" in about.warnings[0]


def test_without_options_the_published_defaults_hold(tmp_path: Path) -> None:
    read = read_published(write(tmp_path, state(135)))
    about = describe(read, from_published(read.state))
    assert (about.schedule, about.steps, about.data) == ("cosine", 1000, "babel")
    assert len(about.warnings) == 3


@pytest.mark.parametrize(
    "options",
    [
        {"arch": "trans_dec"},
        {"noise_schedule": "sigmoid"},
        {"noise_schedule": []},
        {"diffusion_steps": 0},
        {"diffusion_steps": 1e3},
        {"diffusion_steps": 10**12},
        {"layers": 8},
        {"latent_dim": 512},
    ],
    ids=str,
)
def test_options_that_contradict_the_weights_are_refused(tmp_path: Path, options: dict) -> None:
    read = read_published(write(tmp_path, state(), options))
    with pytest.raises(MotionloomError):
        describe(read, from_published(read.state))


@pytest.mark.parametrize("text", ["[1]", "{", "\xff", "[" * 100_000], ids=["list", "cut", "bytes", "deep"])
def test_unusable_options_fail(tmp_path: Path, text: str) -> None:
    path = write(tmp_path, state())
    (tmp_path / "args.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(MotionloomError, match=r"args\.json"):
        read_published(path)


def test_clip_is_not_opened_before_a_prompt_is_encoded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where transformers is missing, making the encoder works and encoding says what to install."""
    monkeypatch.setitem(sys.modules, "transformers", None)  # importing it fails
    text = PublishedText("clip-77")
    assert text.width == 512
    with pytest.raises(MotionloomError, match=r"motionloom-train\[clip\]"):
        text.encode(["a"])
