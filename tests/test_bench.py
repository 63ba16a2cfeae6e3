"""The structure of `motionloom bench` on a tiny network; never how fast anything is."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
import torch

from motionloom import bench
from motionloom.checkpoint import Card, Prior
from motionloom.cli import main
from motionloom.diffusion import DDPM, DpmSolver2M, cosine
from motionloom.errors import MotionloomError
from motionloom.nets.prior import NetConfig, PriorNet
from motionloom.nets.text import TextEmbedding


class Words:
    """A text encoder that says the same about everything."""

    name, width = "same", 8

    def encode(self, texts: Sequence[str]) -> TextEmbedding:
        rows = len(texts)
        return TextEmbedding(torch.ones(rows, 3, 8), torch.ones(rows, 3, dtype=torch.bool), torch.ones(rows, 8))


@pytest.fixture(params=["published", "modulated"])
def prior(request: pytest.FixtureRequest) -> Prior:
    sizes = {"features": 12, "width": 16, "layers": 2, "heads": 2, "hidden": 32, "text": 8}
    net = PriorNet(NetConfig(manner=request.param, **sizes)).eval().requires_grad_(False)
    return Prior(net, cosine(50), torch.zeros(12), torch.ones(12), Words(), Card("tiny"))


@pytest.fixture(autouse=True)
def _one_thread():
    """Two threads that wait for each other on a busy machine take a hundred times longer on networks this small."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def fake_process(arguments: Sequence[str]) -> bench.Process:
    return bench.Process(0.25 if arguments[0] == "--help" else 3.0, 800.0)


def test_every_number_has_a_target_and_an_explanation(prior: Prior) -> None:
    found = bench.bench(prior, bench.Sampling(steps=5), quick=True, sizes=(64,), run=fake_process)
    names = [entry["name"] for entry in found["entries"]]
    assert len(names) == len(set(names)) == 7
    assert all(e["value"] > 0 and e["target"] and e["note"] and e["unit"] for e in found["entries"])
    assert len(bench.table(found)) == 8
    assert json.loads(json.dumps(found)) == found


def test_commands_compare_seconds_and_megabytes_with_their_targets() -> None:
    good = bench.commands("default", repeats=1, run=fake_process)
    assert [(e.value, e.passes) for e in good] == [(0.25, True), (3.0, True), (800.0, True)]
    bad = bench.commands("default", repeats=1, run=lambda arguments: bench.Process(9.0, 1501.0))
    assert not any(e.passes for e in bad)


def test_flops_of_a_product_are_two_per_multiplication() -> None:
    a, b = torch.randn(3, 5), torch.randn(5, 7)
    assert bench.flops(lambda: a @ b) == 2 * 3 * 5 * 7


def test_flops_count_attention_too() -> None:
    q = torch.randn(1, 2, 10, 4)
    products = 2 * (2 * 10 * 10 * 4) * 2  # scores and values, for two heads
    assert bench.flops(lambda: torch.nn.functional.scaled_dot_product_attention(q, q, q)) == products


def test_a_straight_line_is_found_exactly_and_noise_lowers_r2() -> None:
    assert bench.fit([1, 2, 4], [3.0, 5.0, 9.0]) == pytest.approx((2, 1, 1))
    assert bench.fit([1, 2, 3, 4], [1.0, 3.0, 1.0, 3.0])[2] < 0.5


def test_jobs_are_timed_in_turns_after_a_warm_up() -> None:
    order: list[str] = []
    times = bench.timed([lambda: order.append("a"), lambda: order.append("b")], 2)
    assert order == ["a", "b"] * 3
    assert len(times) == 2


def test_the_long_walk_stops_after_the_timed_steps(prior: Prior) -> None:
    calls: list[int] = []

    def denoise(x: torch.Tensor, level: int) -> torch.Tensor:
        calls.append(level)
        return x

    bench._walk(prior, denoise, torch.zeros(1, 4, 12), list(range(50, -1, -1)), solver=DDPM, stop=20)
    assert len(calls) == 20


def test_the_defaults_are_read_from_generates_signature() -> None:
    def generate(prior, prompts, *, seconds=6.0, steps: int = 11, guidance: float = 3.5, solver: str = "2m"):
        raise NotImplementedError

    generate.__kwdefaults__["solver"] = next(n for n, s in bench.SOLVERS.items() if isinstance(s, DpmSolver2M))
    how = bench.defaults(generate)
    assert (how.steps, how.guidance) == (11, 3.5)
    assert isinstance(how.solver, DpmSolver2M)


def test_a_real_process_is_timed_and_weighed() -> None:
    used = bench.process(["--help"])
    assert 0 < used.seconds < 60
    assert 5 < used.peak_mb < 2000


def test_a_process_that_fails_says_why() -> None:
    with pytest.raises(MotionloomError, match="nonsense"):
        bench.process(["--nonsense"])


def test_weights_that_are_not_there_are_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--weights", str(tmp_path / "none.safetensors")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
