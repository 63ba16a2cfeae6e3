"""The structure of `motionloom bench` on a tiny network; never how fast anything is."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom.cli import main
from motionloom.core.diffusion import DDPM, cosine
from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.protocol import TextEmbedding
from motionloom.core.models.prior import Card, Prior
from motionloom_lab import bench
from motionloom_lab.bench import long, prediction, speed
from motionloom_train.modules import prior_session
from motionloom_train.nets.prior import NetConfig, PriorNet
from tests.tasks.small_predictor import small_predictor


class Words:
    """A text encoder that says the same about everything."""

    name, width = "same", 8

    def encode(self, texts: Sequence[str]) -> TextEmbedding:
        rows = len(texts)
        return TextEmbedding(
            np.ones((rows, 3, 8), np.float32), np.ones((rows, 3), bool), np.ones((rows, 8), np.float32)
        )


@pytest.fixture(params=["published", "modulated"])
def prior(request: pytest.FixtureRequest) -> Prior:
    sizes = {"features": 12, "width": 16, "layers": 2, "heads": 2, "hidden": 32, "text": 8}
    net = prior_session(PriorNet(NetConfig(variant=request.param, **sizes)))
    return Prior(net, cosine(50), np.zeros(12, np.float32), np.ones(12, np.float32), Words(), Card("tiny"))


def fake_process(arguments: Sequence[str]) -> bench.Process:
    return bench.Process(0.25 if arguments[0] == "--help" else 3.0, 800.0, 4.0)


def test_every_number_has_a_target_and_an_explanation(prior: Prior) -> None:
    results = bench.bench(prior, bench.Sampling(steps=5), quick=True, sizes=(64,), run=fake_process)
    names = [entry["name"] for entry in results["entries"]]
    assert len(names) == len(set(names)) == 10
    assert all(e["value"] > 0 and e["target"] and e["note"] and e["unit"] for e in results["entries"])
    assert len(bench.table(results)) == 11
    assert json.loads(json.dumps(results)) == results


def test_commands_compare_seconds_and_megabytes_with_their_targets() -> None:
    good = speed.commands("default", repeats=1, run=fake_process)
    assert [(e.value, e.passes) for e in good] == [(0.25, True), (800.0, True)]
    bad = speed.commands("default", repeats=1, run=lambda arguments: bench.Process(9.0, 1501.0, 9.0))
    assert not any(e.passes for e in bad)


def test_starts_are_medians_over_an_import_of_the_libraries_without_the_first_round() -> None:
    """Rounds of 2, 2, 4 s and generate 20, 20, 30 s after a slow one: 20 / 2; the others 0.5 / 2."""
    calls: list[str] = []
    took = {"-c": [50.0, 2.0, 2.0, 4.0], "generate": [90.0, 20.0, 20.0, 30.0]}

    def run(arguments: Sequence[str]) -> bench.Process:
        calls.append(arguments[0])
        times = took.get(arguments[0], [9.0, 0.5, 0.5, 1.0])
        return bench.Process(times[calls.count(arguments[0]) - 1], 1.0, 1.0)

    entries = speed.starts("default", repeats=3, run=run)
    assert calls == ["-c", "generate", "info", "export", "view"] * 4
    assert [(e.value, e.passes) for e in entries] == [(10.0, True), (0.25, True), (0.25, True), (0.25, True)]
    took["generate"] = took["info"] = took["view"] = [9.0, 40.0, 40.0, 40.0]
    calls.clear()
    assert [e.passes for e in speed.starts("default", repeats=3, run=run)] == [False, False, True, False]


def test_python_itself_can_be_timed() -> None:
    assert bench.process(("-c", "print(1)")).processor > 0
    with pytest.raises(MotionloomError, match="ZeroDivisionError"):
        bench.process(("-c", "1 / 0"))


def test_flops_of_a_product_are_two_per_multiplication() -> None:
    a, b = torch.randn(3, 5), torch.randn(5, 7)
    assert speed.flops(lambda: a @ b) == 2 * 3 * 5 * 7


def test_flops_count_attention_too() -> None:
    q = torch.randn(1, 2, 10, 4)
    products = 2 * (2 * 10 * 10 * 4) * 2  # scores and values, for two heads
    assert speed.flops(lambda: torch.nn.functional.scaled_dot_product_attention(q, q, q)) == products


def test_a_straight_line_is_found_exactly_and_noise_lowers_r2() -> None:
    assert speed.fit([1, 2, 4], [3.0, 5.0, 9.0]) == pytest.approx((2, 1, 1))
    assert speed.fit([1, 2, 3, 4], [1.0, 3.0, 1.0, 3.0])[2] < 0.5


def test_jobs_are_timed_in_turns_after_a_warm_up() -> None:
    order: list[str] = []
    times = speed.timed([lambda: order.append("a"), lambda: order.append("b")], 2)
    assert order == ["a", "b"] * 3
    assert len(times) == 2


def test_the_long_walk_stops_after_the_timed_steps(prior: Prior) -> None:
    calls: list[int] = []

    def denoise(x: np.ndarray, level: int) -> np.ndarray:
        calls.append(level)
        return x

    speed._walk(prior, denoise, np.zeros((1, 4, 12), np.float32), list(range(50, -1, -1)), solver=DDPM, stop=20)
    assert len(calls) == 20


def test_a_real_process_is_timed_and_weighed() -> None:
    used = bench.process(["--help"])
    assert 0 < used.seconds < 60
    assert 5 < used.peak_mb < 100  # its own memory: this process, with torch, holds several times as much


def test_a_process_that_fails_says_why() -> None:
    with pytest.raises(MotionloomError, match="nonsense"):
        bench.process(["--nonsense"])


def test_weights_that_are_not_there_are_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--weights", str(tmp_path / "none.safetensors")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


# Long motion


def long_prior() -> Prior:
    net = PriorNet(
        NetConfig(variant="modulated", features=263, width=16, layers=1, heads=2, hidden=16, text=8, patch=4)
    )
    return Prior(
        prior_session(net), cosine(20), np.zeros(263, np.float32), np.full(263, 0.01, np.float32), Words(), Card("tiny")
    )


TINY = long.Course((4.0, 8.0, 12.0), 4.0, 1, 2)


def test_long_motion_is_measured_at_every_length_with_its_settings() -> None:
    calls: list[Sequence[str]] = []

    def run(arguments: Sequence[str]) -> bench.Process:
        calls.append(arguments)
        return bench.Process(1.0, 500.0 + len(calls), 1.0)

    results = long.long_motion(long_prior(), bench.Sampling(steps=2), TINY, run=run)
    assert len(results.times) == 3
    assert all(seconds > 0 for seconds in results.times)
    assert results.peaks_mb == (501.0, 502.0, 503.0)
    assert [arguments.index("--literal") - 1 for arguments in calls] == [1, 2, 3]
    assert {"prompts": 3, "steps": 2, "together": 16, "published_handshake": 20}.items() <= results.settings.items()


def test_the_published_takes_are_those_of_the_released_code() -> None:
    """Three prompts of 4 s: every frame counted by hand; 0.9 of the levels in the second take."""
    reckoned, _ = long.published_takes(long_prior(), bench.Sampling(), long.prompts(3), seconds=4.0, steps=2)
    first, second = reckoned(1.0, 2.0)
    assert (first.rows, first.frames, first.steps, first.calls) == (3, 80 + 20, 20, 2)
    assert (second.rows, second.frames, second.steps, second.calls) == (2, 2 * (100 - 40) + 20, 18, 2)
    assert first.seconds + second.seconds == 20 * 1.0 + 18 * 2.0


def test_each_timed_step_of_the_published_recipe_calls_the_network_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    prior, calls = long_prior(), []
    monkeypatch.setattr(type(prior.net), "__call__", lambda net, x, level, bound: calls.append(tuple(x.shape[:2])) or x)
    first, second = long.published_takes(prior, bench.Sampling(), long.prompts(3), seconds=4.0, steps=5)[1]
    assert first().shape == (3, 100, 263)
    assert calls == [(3, 100)] * 10
    calls.clear()
    second()
    assert calls == [(2, 140)] * 10


def measured(times: tuple[float, ...], peaks: tuple[float, ...]) -> long.Measured:
    take = long.Take(60, 220, 1000, 2, 4, 1.0)
    return long.Measured((60.0, 120.0, 300.0, 600.0), times, peaks, (take, take), {})


def test_lines_ratios_and_verdicts_of_long_motion() -> None:
    straight = long.entries_of(measured((7.0, 13.0, 31.0, 61.0), (500.0, 540.0, 550.0, 550.0)))
    assert [entry.value for entry in straight] == pytest.approx([0.0, 1.1, 2000 / 61], abs=1e-9)
    assert [entry.passes for entry in straight] == [True, True, False]  # 33 times is not 50
    assert "extrapolated from 4 steps" in straight[2].note
    bent = long.entries_of(measured((7.0, 13.0, 31.0, 90.0), (500.0, 540.0, 550.0, 651.0)))
    assert [entry.passes for entry in bent][:2] == [False, False]
    assert len({entry.name for entry in straight}) == 3


def test_sixty_prompts_are_all_different() -> None:
    assert len(set(long.prompts(60))) == 60
    assert long.prompts(61)[60] == long.prompts(1)[0]


def test_bench_does_what_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "QUICK", TINY)
    results = bench.bench(long_prior(), bench.Sampling(steps=2), what="long", quick=True, run=fake_process)
    assert len(results["entries"]) == 3
    assert len(bench.table(results)) == 4
    assert results["long"]["settings"]["prompts"] == 3
    assert json.loads(json.dumps(results))["long"]["times"] == list(results["long"]["times"])


def test_futures_are_measured_beside_the_published_recipe(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[int, int]] = []

    def recorded(predictor, past, *, count, steps):
        calls.append((sum(values.size for values in predictor.net.weights.values()), steps))
        return past

    monkeypatch.setattr(prediction, "published_futures", recorded)

    def clock(jobs, repeats, *, warm):
        return [float(number) for number, job in enumerate(jobs, 1) if job() is not None]

    monkeypatch.setattr(prediction, "timed", clock)
    entries = prediction.cost_of_futures(small_predictor(), repeats=1, timed_steps=4)
    assert calls[1] == (28_401_712, 4)
    assert [entry.value for entry in entries] == pytest.approx([1.0, 75.0, 50.0])  # 1, 2 and 3 s for 4 of 100 steps
    assert [entry.passes for entry in entries] == [True, True, True]
    assert "reckoned" in entries[0].note
