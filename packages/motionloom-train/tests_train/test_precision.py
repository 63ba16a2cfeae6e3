"""What a run multiplies in: the quicker one by measured times, which are given here; it is told, and kept."""

import json
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from torch import nn

from motionloom.core.errors import MotionloomError
from motionloom_train import loop, precision
from motionloom_train.low_rank import AdapterNet
from motionloom_train.modules import prior_module
from motionloom_train.precision import choose, product_seconds, product_size
from motionloom_train.teach import Lesson
from tests.recorded import tiny
from tests_train import runs


def times(monkeypatch: pytest.MonkeyPatch, *, half: float, full: float) -> None:
    """Let a product take so many seconds in bfloat16 and in float32."""
    seconds = {True: half, False: full}
    monkeypatch.setattr(precision, "product_seconds", lambda inner, outer, *, half: seconds[half])


class Product:
    """An objective of one product; it remembers the type that came out of it."""

    def __init__(self) -> None:
        self.net = nn.Linear(8, 8)
        self.types: list[torch.dtype] = []

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> torch.Tensor:
        result = net(torch.ones(rows, 8))
        self.types.append(result.dtype)
        return (result.float() ** 2).mean()


def run(folder: Path, *, amp: str, steps: int) -> tuple[set[torch.dtype], list[str]]:
    """The types that products had in a run, and what it said."""
    objective, lines = Product(), []
    loop.train(objective, runs.recipe(steps=steps, amp=amp), folder, say=lines.append)
    return set(objective.types), lines


def saved(folder: Path) -> str:
    """What the state in a folder says that was multiplied in."""
    with safe_open(folder / loop.STATE, framework="pt") as file:
        return json.loads(file.metadata()["recipe"])["amp"]


@pytest.mark.parametrize(
    ("half", "full", "chosen"),
    [(0.001, 0.002, "bf16"), (0.440, 0.0074, "float32"), (0.00195, 0.002, "float32")],
    ids=["has instructions", "has none", "no gain"],
)
def test_the_quicker_one_is_chosen_and_told(
    monkeypatch: pytest.MonkeyPatch, half: float, full: float, chosen: str
) -> None:
    times(monkeypatch, half=half, full=full)
    name, why = choose(prior_module(tiny.prior()), "cpu")
    assert name == chosen
    assert f"{half * 1e3:.1f} ms in bfloat16 and {full * 1e3:.1f} ms in float32" in why


@pytest.mark.parametrize(("half", "name", "kind"), [(1.0, "bf16", torch.bfloat16), (9.0, "float32", torch.float32)])
def test_a_run_takes_it_says_so_and_goes_on_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, half: float, name: str, kind: torch.dtype
) -> None:
    """Resumed where the other one would be quicker, it goes on as it began."""
    times(monkeypatch, half=half, full=3.0)
    types, lines = run(tmp_path, amp="auto", steps=3)
    assert types == {kind}
    assert "ms in bfloat16" in lines[0]
    assert saved(tmp_path) == name
    times(monkeypatch, half=4.0 - half, full=1.0)
    types, lines = run(tmp_path, amp="auto", steps=6)
    assert types == {kind}
    assert not any("multiplying" in line for line in lines)
    assert saved(tmp_path) == name
    assert not [line for line in loop.changed(tmp_path, runs.recipe(steps=6, amp="auto")) if "amp" in line]


@pytest.mark.parametrize(
    ("said", "kind"),
    [("bf16", torch.bfloat16), ("float32", torch.float32), ("off", torch.float32), ("none", torch.float32)],
)
def test_what_a_recipe_says_is_not_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: str, kind: torch.dtype
) -> None:
    monkeypatch.setattr(precision, "product_seconds", None)
    assert run(tmp_path, amp=said, steps=2)[0] == {kind}


def test_a_run_that_goes_on_obeys_what_the_recipe_says_now(tmp_path: Path) -> None:
    run(tmp_path, amp="bf16", steps=2)
    assert any("amp is now 'float32'" in line for line in loop.changed(tmp_path, runs.recipe(amp="float32")))
    assert run(tmp_path, amp="float32", steps=4)[0] == {torch.float32}


def test_the_sizes_are_those_of_the_largest_layer() -> None:
    """Of an adapter's frozen network too, which is no part of it."""
    net = prior_module(tiny.prior())
    assert product_size(nn.Sequential(nn.Linear(3, 5), nn.Linear(5, 7), nn.Conv1d(99, 99, 9))) == (5, 7)
    assert product_size(AdapterNet(net, 2, given_rank=0)) == product_size(net)
    assert product_size(nn.ReLU()) == (1, 1)


def test_measuring_ends_at_once_where_products_are_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both kinds of products are made, and one that takes long only once."""
    calls: list[bool] = []
    now = iter(float(number) for number in range(100))
    monkeypatch.setattr(precision.time, "perf_counter", lambda: next(now))
    monkeypatch.setattr(precision, "_there_and_back", lambda weights, rows, half: calls.append(half))
    assert product_seconds(4, 4, half=True) == 1.0
    assert calls == [True]


@pytest.mark.parametrize("half", [True, False])
def test_a_product_is_made_in_what_is_measured(half: bool) -> None:
    weights, rows = torch.ones(4, 3, requires_grad=True), torch.full((2, 3), 1 + 2**-10, requires_grad=True)
    precision._there_and_back(weights, rows, half)
    assert weights.grad is not None
    assert bool((weights.grad == 2.0).all()) == half  # 2**-10 is lost in bfloat16


def test_how_long_it_will_take_is_said_once_after_the_first_steps() -> None:
    """The first step, in which much is set up, does not count."""
    lines: list[str] = []
    pace = loop.Pace(100, 1400, lines.append)
    for seconds in [9.0, *[0.5] * 40]:
        pace(seconds)
    assert lines == ["1,290 more steps of about 0.5 s: about 11 minutes"]


def test_slow_steps_are_not_waited_for() -> None:
    lines: list[str] = []
    pace = loop.Pace(0, 1300, lines.append)
    for _ in range(20):
        pace(6.0)
    assert lines == ["1,296 more steps of about 6 s: about 2 h 10 min"]


def test_teaching_refuses_another_kind() -> None:
    with pytest.raises(MotionloomError, match="auto, bf16"):
        Lesson(amp="fp8")
