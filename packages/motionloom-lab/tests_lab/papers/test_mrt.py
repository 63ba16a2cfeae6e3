"""The multi-range transformer: exchange, places, its spectrum, seconds in a row, training and the file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.fft import idct
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.mrt import RECIPE, Mrt, MrtConfig, MrtFile, Seconds, _nearness, completed, train_mrt
from motionloom_train.data.pairs import Pair
from motionloom_train.loop import Training

TINY = MrtConfig(frames=6, width=16, hidden=24, layers=2, heads=2, key=8, dropout=0.0)


def net_of(seed: int = 0, config: MrtConfig = TINY) -> Mrt:
    torch.manual_seed(seed)
    return Mrt(config).eval().requires_grad_(False)


def past_of(rows: int = 2, people: int = 2, frames: int = 6, seed: int = 1) -> Tensor:
    return torch.randn(rows, people, frames, 22, 3, generator=torch.Generator().manual_seed(seed))


def pair_of(frames: int, seed: int = 0, split: str = "train") -> Pair:
    """Two who glide apart at a metre a second."""
    rng = np.random.default_rng(seed)
    body = rng.normal(0, 0.3, (2, 1, 22, 3)) + np.array([0, 0.9, 0])
    way = np.arange(frames)[None, :, None, None] / 20 * np.array([[[[1.0, 0, 0]]], [[[-1.0, 0, 0]]]])
    return Pair(f"p{seed}", split, (), "own", "do what you like", body + way)


def test_people_who_are_exchanged_give_exchanged_results() -> None:
    net, past = net_of(), past_of(people=3)
    torch.testing.assert_close(net(past.flip(1)), net(past).flip(1), atol=1e-5, rtol=1e-5)


def test_a_row_alone_gives_what_it_gives_in_a_batch() -> None:
    net, past = net_of(), past_of(rows=3)
    torch.testing.assert_close(net(past)[1:2], net(past[1:2]), atol=1e-5, rtol=1e-5)


def test_it_moves_with_the_people_on_the_ground_and_hears_the_other_person() -> None:
    net, past = net_of(), past_of()
    there = torch.tensor([3.0, 0.0, -2.0])
    torch.testing.assert_close(net(past + there), net(past) + there, atol=1e-5, rtol=1e-5)
    other = past.clone()
    other[:, 1, 2:4] += 0.5  # the middle of the last roots stays
    assert (net(other)[:, 0] - net(past)[:, 0]).abs().max() > 1e-4


def test_a_silent_output_keeps_the_last_pose_and_a_constant_spectrum_is_scipys() -> None:
    net, past = net_of(), past_of()
    torch.nn.init.zeros_(net.out.weight)
    torch.nn.init.zeros_(net.out.bias)
    assert torch.equal(net(past), past[:, :, -1:].expand(-1, -1, 6, -1, -1))
    torch.nn.init.ones_(net.out.bias)
    steps = np.cumsum(np.asarray(idct(np.ones(6), norm="ortho")))
    moved = (net(past) - past[:, :, -1:])[0, 0, :, 7, 2]
    torch.testing.assert_close(moved, torch.from_numpy(steps).float(), atol=1e-5, rtol=1e-5)


def test_nearness_is_that_of_a_naive_loop() -> None:
    past = past_of(rows=1, people=2, frames=3)
    nearness = _nearness(past).view(1, 2, 2, 3)
    for query in range(2):
        for person in range(2):
            for frame in range(3):
                squares = ((past[0, query, 2] - past[0, person, frame]) ** 2).sum(-1)
                assert nearness[0, query, person, frame] == pytest.approx(float(torch.exp(-squares.mean())))


def test_longer_futures_are_said_second_by_second() -> None:
    net, past = net_of(), past_of(frames=8).numpy()
    future = completed(net, past, 10)
    assert future.shape == (2, 2, 18, 22, 3)
    assert np.array_equal(future[:, :, :8], past)
    first = net(torch.from_numpy(past[:, :, 2:]))
    np.testing.assert_allclose(future[:, :, 8:14], first, atol=1e-6)
    np.testing.assert_allclose(future[:, :, 14:], net(first)[:, :, :4], atol=1e-5)
    with pytest.raises(MotionloomError, match="completion needs pasts"):
        completed(net, past[:, :, :5], 3)


def test_the_published_sizes() -> None:
    """One layer: four projections 128 x 512 (one with a bias), 128 x 1024 twice with biases, two norms."""
    layer = 4 * 128 * 512 + 128 + 2 * 128 * 1024 + 1024 + 128 + 4 * 128
    ends = 3 * (66 * 128 + 128) + (128 + 1) * 128 * 20 + (128 + 1) * 66
    assert sum(p.numel() for p in Mrt(MrtConfig()).parameters()) == 9 * layer + ends


def test_windows_are_whole_turned_and_of_one_seed() -> None:
    objective = Seconds(net_of(), [pair_of(40)])
    batch = objective.draw(3, 5, 4)
    assert torch.equal(batch, objective.draw(3, 5, 4))
    assert batch.shape == (4, 2, 24, 22, 3)
    gone = batch[:, :, -1, 0] - batch[:, :, 0, 0]
    np.testing.assert_allclose(gone[..., [0, 2]].norm(dim=-1), 23 / 20, atol=1e-5)
    assert (gone[:, 0, 0] - gone[0, 0, 0]).abs().max() > 0.1  # not all the same way


def test_a_network_that_says_the_truth_has_no_loss() -> None:
    """Two who glide go on as in their last step."""

    class Gliding(torch.nn.Module):
        def forward(self, past: Tensor) -> Tensor:
            step = (past[:, :, -1:] - past[:, :, -2:-1]).expand(-1, -1, 6, -1, -1)
            return past[:, :, -1:] + step.cumsum(2)

    objective = Seconds(net_of(), [pair_of(40)])
    assert float(objective.loss(Gliding(), 0, 0, 3)) < 1e-8
    assert float(objective.loss(net_of(), 0, 0, 3)) > 1e-3


def test_training_learns_and_the_file_comes_back(tmp_path: Path) -> None:
    pairs = [pair_of(30), pair_of(30, 1), pair_of(30, 2, "val")]
    lines: list[str] = []
    path = train_mrt(Training(replace(RECIPE, steps=60, batch=4), tmp_path, "cpu", say=lines.append), pairs, TINY)
    copy = MrtFile.load(path)
    objective = Seconds(copy.net, pairs[:1])
    fresh = Seconds(net_of(), pairs[:1])
    assert float(objective.loss(copy.net, 0, 0, 8)) < 0.5 * float(fresh.loss(fresh.net, 0, 0, 8))
    assert copy.data == "2 train pairs of own"
    assert copy.notes["steps"] == 60
    assert "2 pairs and their mirror images" in lines[0]


def test_what_is_no_such_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="--train-mrt"):
        MrtFile.load(tmp_path / "none.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"not weights")
    with pytest.raises(MotionloomError, match="not a whole safetensors file"):
        MrtFile.load(tmp_path / "bad.safetensors")
    with pytest.raises(MotionloomError, match="sizes are not usable"):
        MrtConfig(dropout=1.0)
    with pytest.raises(MotionloomError, match="no pair has the 24 frames"):
        Seconds(net_of(), [pair_of(20)])
