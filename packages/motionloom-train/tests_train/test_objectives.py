"""What a training step minimises."""

from pathlib import Path

import numpy as np
import torch
from torch import nn

from motionloom.diffusion import SCHEDULES
from motionloom.features import humanml as hml
from motionloom.features.layout import FEET, LAYOUT, ric
from motionloom_train.data.batches import Batches
from motionloom_train.data.sets import load_set
from motionloom_train.nets.prior import Condition
from motionloom_train.objectives import PLANTED, CleanError, WordBank, displacement_error, feature_scale
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
