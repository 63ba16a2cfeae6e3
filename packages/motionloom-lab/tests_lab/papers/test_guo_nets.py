"""Guo's evaluator networks: against a plain loop, by what padding and order must not change, and as files."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.guo_nets import GuoNets, GuoSizes, from_state_dict, published_order, read_guo
from tests_lab.papers.test_mdm import Bomb

SMALL = GuoSizes(channels=7, snippet=6, text=5, motion=8, width=9, word=4, tags=3)


def table(sizes: GuoSizes = SMALL) -> dict[str, tuple[int, ...]]:
    """The published table of names and shapes, written out."""
    s = sizes
    shapes: dict[str, tuple[int, ...]] = {
        "movement_encoder.main.0.weight": (s.snippet, s.channels, 4),
        "movement_encoder.main.0.bias": (s.snippet,),
        "movement_encoder.main.3.weight": (s.snippet, s.snippet, 4),
        "movement_encoder.main.3.bias": (s.snippet,),
        "movement_encoder.out_net.weight": (s.snippet, s.snippet),
        "movement_encoder.out_net.bias": (s.snippet,),
        "text_encoder.pos_emb.weight": (s.word, s.tags),
        "text_encoder.pos_emb.bias": (s.word,),
    }
    for part, width, inner in (("text", s.word, s.text), ("motion", s.snippet, s.motion)):
        own: dict[str, tuple[int, ...]] = {
            "hidden": (2, 1, inner),
            "input_emb.weight": (inner, width),
            "input_emb.bias": (inner,),
            "output_net.0.weight": (inner, 2 * inner),
            "output_net.0.bias": (inner,),
            "output_net.1.weight": (inner,),
            "output_net.1.bias": (inner,),
            "output_net.3.weight": (s.width, inner),
            "output_net.3.bias": (s.width,),
        }
        for way in ("", "_reverse"):
            own |= {f"gru.weight_{k}_l0{way}": (3 * inner, inner) for k in ("ih", "hh")}
            own |= {f"gru.bias_{k}_l0{way}": (3 * inner,) for k in ("ih", "hh")}
        shapes |= {f"{part}_encoder.{key}": shape for key, shape in own.items()}
    return shapes


def state(sizes: GuoSizes = SMALL, seed: int = 0) -> dict[str, Tensor]:
    """Weights of the published form; every one matters, and each sum stays near one, so that rounding stays small."""
    generator = torch.Generator().manual_seed(seed)
    tensors = {}
    for key, shape in table(sizes).items():
        summed = math.prod(shape[1:]) if key.endswith("weight") and len(shape) > 1 else 4
        tensors[key] = torch.randn(shape, generator=generator) / summed**0.5
        if key.endswith("output_net.1.weight"):
            tensors[key] += 1
    return tensors


class Naive:
    """The same networks as loops over time and frames, in float64 numpy."""

    def __init__(self, weights: dict[str, Tensor]) -> None:
        self.w = {key: value.double().numpy() for key, value in weights.items()}

    def movement(self, frames: np.ndarray) -> np.ndarray:
        for key in ("movement_encoder.main.0", "movement_encoder.main.3"):
            padded = np.pad(frames, ((1, 1), (0, 0)))
            taps, bias = self.w[f"{key}.weight"], self.w[f"{key}.bias"]
            frames = np.array(
                [
                    sum(taps[:, :, k] @ padded[2 * i + k] for k in range(4)) + bias
                    for i in range((len(padded) - 4) // 2 + 1)
                ]
            )
            frames = np.where(frames > 0, frames, 0.2 * frames)
        return frames @ self.w["movement_encoder.out_net.weight"].T + self.w["movement_encoder.out_net.bias"]

    def _way(self, part: str, items: np.ndarray, way: str, first: np.ndarray) -> np.ndarray:
        size, h = len(first), first
        w_in, w_own, b_in, b_own = (
            self.w[f"{part}.gru.{k}_l0{way}"] for k in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
        )
        for x in items:
            a, b = w_in @ x + b_in, w_own @ h + b_own
            reset = 1 / (1 + np.exp(-(a[:size] + b[:size])))
            keep = 1 / (1 + np.exp(-(a[size : 2 * size] + b[size : 2 * size])))
            h = (1 - keep) * np.tanh(a[2 * size :] + reset * b[2 * size :]) + keep * h
        return h

    def sequence(self, part: str, items: np.ndarray) -> np.ndarray:
        w = {key.removeprefix(f"{part}."): value for key, value in self.w.items() if key.startswith(part)}
        items = items @ w["input_emb.weight"].T + w["input_emb.bias"]
        there = self._way(part, items, "", w["hidden"][0, 0])
        back = self._way(part, items[::-1], "_reverse", w["hidden"][1, 0])
        y = w["output_net.0.weight"] @ np.concatenate([there, back]) + w["output_net.0.bias"]
        y = (y - y.mean()) / np.sqrt(y.var() + 1e-5) * w["output_net.1.weight"] + w["output_net.1.bias"]
        y = np.where(y > 0, y, 0.2 * y)
        return w["output_net.3.weight"] @ y + w["output_net.3.bias"]

    def motion(self, frames: np.ndarray, length: int) -> np.ndarray:
        return self.sequence("motion_encoder", self.movement(frames)[: length // 4])

    def text(self, words: np.ndarray, tags: np.ndarray, length: int) -> np.ndarray:
        tagged = words + tags @ self.w["text_encoder.pos_emb.weight"].T + self.w["text_encoder.pos_emb.bias"]
        return self.sequence("text_encoder", tagged[:length])


def random_inputs(rows: int, frames: int, seed: int) -> tuple[Tensor, Tensor, Tensor]:
    """Frames, word vectors and one-hot parts of speech."""
    generator = torch.Generator().manual_seed(seed)
    return (
        torch.randn(rows, frames, SMALL.channels, generator=generator),
        torch.randn(rows, 22, SMALL.word, generator=generator),
        torch.eye(SMALL.tags)[torch.randint(SMALL.tags, (rows, 22), generator=generator)],
    )


@pytest.mark.parametrize("seed", range(4))
def test_both_encoders_are_the_loop_over_time(seed: int) -> None:
    weights, (frames, words, tags) = state(seed=seed), random_inputs(5, 44, seed)
    nets, naive = from_state_dict(weights), Naive(weights)
    lengths, counts = [44, 7, 20, 43, 4], [22, 1, 5, 9, 22]
    points = nets.motions(frames, lengths), nets.texts(words, tags, counts)
    for row in range(5):
        moved = naive.motion(frames[row].double().numpy(), lengths[row])
        sentences = naive.text(words[row].double().numpy(), tags[row].double().numpy(), counts[row])
        np.testing.assert_allclose(points[0][row].numpy(), moved, atol=2e-5)
        np.testing.assert_allclose(points[1][row].numpy(), sentences, atol=2e-5)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.permutations(range(4)), st.lists(st.integers(4, 40), min_size=4, max_size=4))
def test_order_company_and_padding_change_no_row(seed: int, order: list[int], lengths: list[int]) -> None:
    """A row alone, in any place of a batch, and with other items after its end (frames: from the fourth on)."""
    frames, words, tags = random_inputs(4, 48, seed)
    nets, counts = from_state_dict(state()), [min(n, 22) for n in lengths]
    moved, sentences = nets.motions(frames, lengths), nets.texts(words, tags, counts)
    assert torch.allclose(nets.motions(frames[order], [lengths[i] for i in order]), moved[order], atol=1e-5)
    for row, (length, count) in enumerate(zip(lengths, counts, strict=True)):
        one, sentence = frames[row : row + 1].clone(), words[row : row + 1].clone()
        one[:, length // 4 * 4 + 3 :] = 1e3
        sentence[:, count:] = 1e3
        assert torch.allclose(nets.motions(one, [length])[0], moved[row], atol=1e-5)
        assert torch.allclose(nets.texts(sentence, tags[row : row + 1], [count])[0], sentences[row], atol=1e-5)


def test_lengths_are_whole_snippets_and_every_item_before_the_end_counts() -> None:
    frames, words, tags = random_inputs(1, 40, 0)
    nets = from_state_dict(state())
    moved, sentences = nets.motions(frames, [23]), nets.texts(words, tags, [9])
    assert torch.equal(nets.motions(frames, [20]), moved)
    assert not torch.allclose(nets.motions(frames, [24]), moved, atol=1e-3)
    assert not torch.allclose(nets.texts(words, tags, [10]), sentences, atol=1e-3)
    for at in (0, 19):
        other = frames.clone()
        other[:, at] += 1
        assert not torch.allclose(nets.motions(other, [20]), moved, atol=1e-4)
    with pytest.raises(ValueError, match="lengths"):
        nets.motions(frames, [44])
    with pytest.raises(ValueError, match="lengths"):
        nets.motions(frames, [3])


def test_the_published_order_is_by_falling_length() -> None:
    assert published_order([120, 196, 61, 44]).tolist() == [1, 0, 2, 3]


@pytest.mark.parametrize(
    ("channels", "counts"),
    [(259, (1_842_688, 4_100_288, 15_747_584)), (135, (1_588_736, 4_100_288, 15_747_584))],
    ids=["HumanML3D", "BABEL"],
)
def test_the_published_sizes(channels: int, counts: tuple[int, ...]) -> None:
    with torch.device("meta"):
        nets = GuoNets(GuoSizes(channels))
    parts = (nets.movement_encoder, nets.text_encoder, nets.motion_encoder)
    assert tuple(sum(p.numel() for p in part.parameters()) for part in parts) == counts
    assert {k: tuple(v.shape) for k, v in nets.state_dict().items()} == table(GuoSizes(channels))
    assert nets.movement_encoder(torch.empty(1, 196, channels, device="meta")).shape == (1, 49, 512)


def test_sizes_are_those_of_the_weights() -> None:
    assert from_state_dict(state()).sizes == SMALL


@pytest.mark.parametrize("key", table())
def test_a_missing_misshapen_or_infinite_weight_fails_by_name(key: str) -> None:
    whole = state()
    stem = key.rsplit(".", 2)[0]
    with pytest.raises(MotionloomError, match=stem):
        from_state_dict({k: v for k, v in whole.items() if k != key})
    with pytest.raises(MotionloomError):
        from_state_dict(whole | {key: torch.zeros(*whole[key].shape, 2)})
    with pytest.raises(MotionloomError, match="finite"):
        from_state_dict(whole | {key: torch.full_like(whole[key], torch.nan)})


def test_an_unknown_weight_fails_by_name() -> None:
    with pytest.raises(MotionloomError, match=r"text_encoder\.extra.*absent"):
        from_state_dict(state() | {"text_encoder.extra": torch.zeros(2)})
    with pytest.raises(MotionloomError, match="usable"):
        from_state_dict(state() | {"text_encoder.hidden": torch.zeros(2, 1, 0)})


def checkpoint(weights: dict[str, Tensor] | None = None) -> dict[str, object]:
    """What a finest.tar holds: the three networks, optimisers and counters."""
    parts: dict[str, dict[str, Tensor]] = {}
    for key, value in (state() if weights is None else weights).items():
        part, _, name = key.partition(".")
        parts.setdefault(part, {})[name] = value
    layer = torch.nn.Linear(2, 2)
    optimiser = torch.optim.Adam(layer.parameters())
    layer(torch.ones(2)).sum().backward()
    optimiser.step()
    return {**parts, "opt_text_encoder": optimiser.state_dict(), "epoch": 3, "iter": 40}


@pytest.mark.parametrize("zipped", [True, False], ids=["new torch file", "old torch file"])
def test_a_checkpoint_is_read_whole_and_without_its_optimisers(tmp_path: Path, zipped: bool) -> None:
    path = tmp_path / "finest.tar"
    torch.save(checkpoint(), path, _use_new_zipfile_serialization=zipped)
    weights = read_guo(path)
    assert weights.keys() == state().keys()
    assert all(torch.equal(weights[key], value) for key, value in state().items())


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ({"movement_encoder": {}, "text_encoder": {}}, "motion_encoder"),
        ([1, 2], "movement_encoder"),
        (checkpoint({**state(), "text_encoder.hidden": torch.zeros(1).expand(2, 1, 5)}), "ordinary"),
        (checkpoint({**state(), "text_encoder.hidden": torch.zeros(2, 1, 5, dtype=torch.int64)}), "ordinary"),
        (checkpoint({**state(), "text_encoder.hidden": torch.zeros(2, 1, 5).to_sparse()}), "not opened"),
    ],
    ids=["a part is missing", "a list", "expanded", "integers", "sparse"],
)
def test_another_file_is_refused_in_one_sentence(tmp_path: Path, content: object, reason: str) -> None:
    torch.save(content, tmp_path / "finest.tar")
    with pytest.raises(MotionloomError, match=reason):
        read_guo(tmp_path / "finest.tar")


def test_code_and_bombs_are_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "finest.tar"
    torch.save({**checkpoint(), "more": Bomb(tmp_path / "was run")}, path)
    with pytest.raises(MotionloomError, match="not opened"):
        read_guo(path)
    path.write_bytes(pickle.dumps(Bomb(tmp_path / "was run"), protocol=2))
    with pytest.raises(MotionloomError, match="not opened"):
        read_guo(path)
    assert not (tmp_path / "was run").exists()
    with pytest.raises(MotionloomError, match="no checkpoint"):
        read_guo(tmp_path / "absent.tar")
