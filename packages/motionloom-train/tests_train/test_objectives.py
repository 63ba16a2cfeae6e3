"""What a training step minimises."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FEET, LAYOUT, ric
from motionloom.core.features.representation import BABEL
from motionloom_train.data.batches import Batches
from motionloom_train.data.sets import load_set
from motionloom_train.nets.prior import Condition
from motionloom_train.objectives import (
    PLANTED,
    CleanError,
    WordBank,
    displacement_error,
    feature_scale,
    geometric_error,
)
from tests.kinematics.people import walking
from tests.recorded import tiny
from tests_train import runs

MEAN, STD = torch.full((263,), 0.1), torch.full((263,), 0.5)


def walk() -> torch.Tensor:
    features = hml.encode(hml.canonical(walking(1.2, 2.0)), heading="corrected")
    return ((torch.from_numpy(features) - MEAN) / STD)[None]


def lengths(x: torch.Tensor) -> torch.Tensor:
    return torch.tensor([x.shape[1]])


def moved(x: torch.Tensor, block: slice, by: float, frames: slice = slice(None)) -> torch.Tensor:
    """A copy with metres added to a block."""
    y = x.clone()
    y[:, frames, block] += by / 0.5
    return y


def test_a_perfect_guess_costs_nothing() -> None:
    x = walk()
    assert displacement_error(x, x, lengths(x), MEAN, STD) < 1e-8


def test_a_joint_that_is_always_off_by_the_same_amount_goes_the_right_way() -> None:
    x = walk()
    assert displacement_error(moved(x, ric(15), 0.2), x, lengths(x), MEAN, STD) < 1e-8


def test_one_jump_of_a_head_is_paid_in_two_displacements() -> None:
    x = walk()
    jump = displacement_error(moved(x, ric(15), 0.2, slice(10, 11)), x, lengths(x), MEAN, STD)
    target = 2 * (3 * 0.2**2) / (3 * 0.5**2) / 22 / (x.shape[1] - 1)
    np.testing.assert_allclose(jump, target, rtol=1e-3)


def test_planted_feet_cost_more() -> None:
    x = walk()
    x[..., LAYOUT["contacts"]] = (1 - MEAN[0]) / STD[0]
    foot = displacement_error(moved(x, ric(FEET[1]), 0.1, slice(10, 11)), x, lengths(x), MEAN, STD)
    head = displacement_error(moved(x, ric(15), 0.1, slice(10, 11)), x, lengths(x), MEAN, STD)
    np.testing.assert_allclose(foot / head, PLANTED, rtol=1e-3)


def test_padding_is_not_looked_at() -> None:
    x = walk()
    rubbish = moved(x, slice(0, 263), 3.0, slice(30, None))
    assert displacement_error(rubbish, x, torch.tensor([30]), MEAN, STD) < 1e-8
    assert displacement_error(rubbish, x, torch.tensor([31]), MEAN, STD) > 0.1


def test_heights_count_more_and_nothing_else_does() -> None:
    """The root's height and every joint's second number, relative to the rest; the mean stays 1."""
    plain, raised = feature_scale(), feature_scale(3.0)
    ratio = (raised / plain) / (raised / plain)[LAYOUT["rot6d"]][0]
    target = torch.ones(263)
    target[LAYOUT["root_height"]] = 3.0
    for joint in range(1, 22):
        target[ric(joint).start + 1] = 3.0
    torch.testing.assert_close(ratio, target)
    torch.testing.assert_close(raised.mean(), torch.tensor(1.0))


class Constant(nn.Module):
    """Estimates that are one number everywhere."""

    def __init__(self, value: float) -> None:
        super().__init__()
        self.value = nn.Parameter(torch.tensor(value))

    def forward(self, x: torch.Tensor, level: torch.Tensor, cond: Condition) -> torch.Tensor:
        return self.value.expand_as(x)


def test_only_rows_that_are_not_fresh_are_kept_near_the_teacher(tmp_path: Path) -> None:
    """Estimates of 3 beside a teacher's of 1: (3 - 1)^2 on three quarters of the rows, whatever the data."""
    data = load_set(runs.write_set(tmp_path / "set"))
    batches = Batches(data, windows=(20,), shares=(1.0,), fresh=0.25, fresh_of=("walk fast",))
    words = WordBank(tiny.text(), data.texts, progress=lambda line: None)
    net, teacher = Constant(3.0), Constant(1.0)

    def loss(keep: float) -> torch.Tensor:
        recipe = runs.recipe(keep=keep)
        objective = CleanError(net, SCHEDULES["cosine"](50), batches, words, recipe, teacher=teacher)
        return objective.loss(net, 0, 0, 8)

    added = loss(2.0) - loss(0.0)
    np.testing.assert_allclose(added.item(), 2.0 * 4.0 * 0.75, rtol=1e-4)
    added.backward()
    assert net.value.grad is not None
    np.testing.assert_allclose(net.value.grad.item(), 2.0 * 2 * 2.0 * 0.75, rtol=1e-4)
    assert teacher.value.grad is None


def standing_babel(frames: int) -> torch.Tensor:
    """(1, frames, 135) of somebody in the T-pose who stands still."""
    x = torch.zeros(1, frames, 135)
    x[..., 0] = 0.95
    x[..., 3:] = torch.tensor([1.0, 0, 0, 0, 1.0, 0]).repeat(22)
    return x


def geometric(denoised: torch.Tensor, clean: torch.Tensor, length: int) -> float:
    mean, std = torch.zeros(135), torch.ones(135)
    return float(geometric_error(denoised, clean, torch.tensor([length]), mean, std, kind=BABEL))


def test_a_body_too_high_costs_its_places_alone() -> None:
    """By hand: 0.3 m in one of three coordinates of every joint, and no change from frame to frame."""
    clean = standing_babel(20)
    denoised = clean.clone()
    denoised[..., 0] += 0.3
    assert geometric(clean, clean, 20) == 0
    assert geometric(denoised, clean, 20) == pytest.approx(0.3**2 / 3, rel=1e-5)


def test_standing_feet_that_slide_cost_their_steps_and_walking_feet_do_not() -> None:
    """By hand: 0.2 m a frame along x, so place k is off by 0.2 k; four feet step 0.2 m in one of three coordinates. The
    root's own numbers are no rotation, so that their differences cost nothing."""
    clean = standing_babel(6)
    denoised = clean.clone()
    denoised[..., 1] = 0.2
    places = np.mean([(0.2 * k) ** 2 / 3 for k in range(6)])
    assert geometric(denoised, clean, 6) == pytest.approx(places + 0.2**2 / 3, rel=1e-5)
    faster = clean.clone()
    faster[..., 1] = 0.4
    assert geometric(faster, denoised, 6) == pytest.approx(places, rel=1e-5)  # whose feet move in the data


def test_rotations_that_jump_cost_their_differences() -> None:
    """The first column of a hand's rotation scaled: no joint moves, and of 132 numbers one differs by 1 twice."""
    clean = standing_babel(5)
    denoised = clean.clone()
    denoised[:, 2, 3 + 6 * 20] += 1.0
    assert geometric(denoised, clean, 5) == pytest.approx(2 / 132 / 4, rel=1e-4)


def test_geometric_losses_do_not_look_at_padding() -> None:
    clean = standing_babel(12)
    rubbish = clean.clone()
    rubbish[:, 8:] = torch.randn(1, 4, 135, generator=torch.Generator().manual_seed(0))
    assert geometric(rubbish, clean, 8) == pytest.approx(0, abs=1e-9)
    assert geometric(rubbish, clean, 9) > 0.01
