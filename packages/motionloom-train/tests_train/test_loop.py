"""The training loop: it learns, averages and schedules as written down, and goes on exactly where it was killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from torch import nn

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom_train import loop
from motionloom_train.loop import Average, load_state, make_optimizer, rate_at, save_state
from motionloom_train.objectives import masked_error
from tests_train import runs

ROOT = Path(__file__).parents[3]
SOURCES = [*(ROOT / "packages").glob("*/src"), ROOT / "packages" / "motionloom", ROOT / "packages" / "motionloom-train"]
"""The packages, and the folders in which their tests are packages."""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return runs.write_set(tmp_path_factory.mktemp("train") / "set")


@pytest.fixture(scope="module")
def whole(data: Path) -> list[float]:
    """The losses of an uninterrupted run of 40 steps, made in this process."""
    torch.set_num_threads(1)
    return runs.losses(data, data.parent / "whole", runs.recipe(steps=40), say=lambda *a, **k: None)


def start(data: Path, out: Path, steps: int, *, processes: int = 1) -> subprocess.Popen:
    program = [sys.executable, "-m"]
    if processes > 1:
        program += ["torch.distributed.run", "--standalone", f"--nproc-per-node={processes}", "-m"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(map(str, SOURCES))}
    return subprocess.Popen(
        [*program, "tests_train.runs", str(data), str(out), str(steps)],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def read(running: subprocess.Popen, count: int) -> dict[int, str]:
    """At most so many `step loss` lines."""
    values: dict[int, str] = {}
    while len(values) < count and (line := running.stdout.readline()):
        if line[:1].isdigit():
            step, loss = line.split()
            values[int(step)] = loss
    return values


def test_the_loss_falls(whole: list[float]) -> None:
    assert sum(whole[-8:]) < 0.8 * sum(whole[:8])


@pytest.mark.parametrize("after", [17])
def test_a_killed_run_goes_on_with_the_same_losses(data: Path, tmp_path: Path, whole: list[float], after: int) -> None:
    """kill -9 after a step that is no checkpoint; what follows equals the uninterrupted run in every bit."""
    running = start(data, tmp_path, 40)
    before = read(running, after)
    os.kill(running.pid, signal.SIGKILL)
    running.wait()
    assert [before[i] for i in range(after)] == [repr(loss) for loss in whole[:after]]
    resumed = runs.losses(data, tmp_path, runs.recipe(steps=40), say=lambda *a, **k: None)
    assert 20 <= len(resumed) <= 40 - 14
    assert resumed == whole[-len(resumed) :]


@pytest.mark.slow
def test_two_processes_go_on_with_the_same_losses(data: Path, tmp_path: Path) -> None:
    """torchrun with gloo: all processes killed, then resumed; the next losses equal those of an uninterrupted run."""
    straight = start(data, tmp_path / "straight", 30, processes=2)
    expected = read(straight, 30)
    straight.wait()
    assert len(expected) == 30
    running = start(data, tmp_path / "killed", 30, processes=2)
    read(running, 9)
    running.terminate()  # torchrun ends its children
    running.wait()
    resumed = start(data, tmp_path / "killed", 30, processes=2)
    again = read(resumed, 30)
    resumed.wait()
    assert 0 < len(again) < 30
    assert again == {step: expected[step] for step in again}


def test_the_averaged_weights_have_their_closed_form() -> None:
    """Weights that are k after step k: the average is the weighted sum with decay min(d, (k+1)/(k+10))."""
    net = nn.Linear(1, 1, bias=False)
    nn.init.zeros_(net.weight)
    average, expected = Average(net, 0.9), 0.0
    for step in range(120):
        nn.init.constant_(net.weight, step + 1)
        average.update(net, step)
        decay = min(0.9, (step + 1) / (step + 10))
        expected = decay * expected + (1 - decay) * (step + 1)
    assert average.weights["weight"].item() == pytest.approx(expected, rel=1e-5)
    assert average.weights["weight"].item() == pytest.approx(120 - 0.9 / 0.1, rel=1e-2)  # it lags by d / (1 - d)


def test_the_rate_rises_stays_and_falls_to_nothing() -> None:
    plan = runs.recipe(steps=1000, warmup=100, cooldown=0.2, rate=0.5)
    assert rate_at(plan, 0) == pytest.approx(0.005)
    assert rate_at(plan, 49) == pytest.approx(0.25)
    assert rate_at(plan, 99) == rate_at(plan, 500) == rate_at(plan, 799) == pytest.approx(0.5)
    assert rate_at(plan, 900) == pytest.approx(0.25)
    assert rate_at(plan, 999) == pytest.approx(0.5 / 200)


def test_padding_does_not_count_and_rows_weigh_alike() -> None:
    """Row 0 is wrong by 2 in its single valid frame, row 1 by 1 in all three: (4 + 1) / 2."""
    clean, guess = torch.zeros(2, 3, 2), torch.ones(2, 3, 2)
    guess[0, 0], guess[0, 1:] = 2.0, 99.0
    assert masked_error(guess, clean, torch.tensor([1, 3]), torch.ones(2)).item() == pytest.approx(2.5)
    assert masked_error(guess, clean, torch.tensor([1, 3]), torch.tensor([2.0, 0.0])).item() == pytest.approx(2.5)


def parts() -> tuple[nn.Module, Average, torch.optim.Optimizer]:
    net = nn.Linear(3, 2)
    return net, Average(net, 0.9), make_optimizer(net, runs.recipe())


def test_a_crash_while_writing_leaves_the_old_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    net, average, optimizer = parts()
    save_state(tmp_path, net, average, optimizer, step=7, recipe=runs.recipe())

    def half(place: Path, content: bytes) -> None:
        with place.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(KeyboardInterrupt):
        save_state(tmp_path, net, average, optimizer, step=8, recipe=runs.recipe())
    assert [p.name for p in tmp_path.iterdir()] == [loop.STATE]
    assert load_state(tmp_path / loop.STATE, net, average, optimizer) == 7


def test_a_state_of_another_network_or_no_state_is_refused(tmp_path: Path) -> None:
    save_state(tmp_path, *parts(), step=1, recipe=runs.recipe())
    other = nn.Linear(4, 2)
    with pytest.raises(MotionloomError, match="another folder"):
        load_state(tmp_path / loop.STATE, other, Average(other, 0.9), make_optimizer(other, runs.recipe()))
    (tmp_path / loop.STATE).write_bytes((tmp_path / loop.STATE).read_bytes()[:-9])
    with pytest.raises(MotionloomError):
        load_state(tmp_path / loop.STATE, *parts())


class Broken:
    """An objective whose loss is not a number."""

    net = nn.Linear(1, 1)

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> torch.Tensor:
        return net.weight.sum() * float("nan")


def test_a_loss_that_is_not_finite_ends_the_run_and_leaves_the_state(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="not finite"):
        loop.train(Broken(), runs.recipe(), tmp_path)
    assert not list(tmp_path.iterdir())


class Sum:
    """An objective that needs no data."""

    def __init__(self) -> None:
        self.net = nn.Linear(2, 1)

    def loss(self, net: nn.Module, seed: int, step: int, rows: int) -> torch.Tensor:
        return (net.weight**2).sum()


def test_weights_are_written_though_the_run_was_stopped_just_before(tmp_path: Path) -> None:
    """A finished state whose weights were never written: starting again writes them and takes no step."""
    loop.train(Sum(), runs.recipe(steps=5), tmp_path)
    saved: list[int] = []
    steps: list[int] = []
    loop.train(
        Sum(),
        runs.recipe(steps=5),
        tmp_path,
        on_save=lambda average, step: saved.append(step),
        on_step=lambda step, loss, s: steps.append(step),
    )
    assert saved == [5]
    assert steps == []


def spoiled_states(path: Path) -> dict[str, tuple[dict, dict]]:
    """What a state file says, changed: tensors and metadata by what is wrong."""
    with safe_open(path, framework="pt") as file:
        about = file.metadata()
        tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    bare = {key: value for key, value in about.items() if key != "checksum"}
    moment = next(key for key in tensors if key.endswith("exp_avg"))
    return {
        "an optimiser's entry is missing": ({k: v for k, v in tensors.items() if k != moment}, about),
        "a byte turned over": (tensors | {"net.weight": -tensors["net.weight"]}, about),
        "step 10^30": (tensors, bare | {"step": "1" + "0" * 30}),
        "another step": (tensors, about | {"step": "8"}),
        "broadcast averages": (tensors | {"average.weight": torch.zeros(1, 1)}, bare),
        "a moment of another shape": (tensors | {moment: torch.zeros(1)}, bare),
        "a moment without its others": ({k: v for k, v in tensors.items() if k != moment}, bare),
        "not finite": (tensors | {"net.weight": tensors["net.weight"] * float("nan")}, bare),
        "a tensor too many": (tensors | {"optimizer.99.exp_avg": torch.zeros(1)}, bare),
        "no step": (tensors, {key: value for key, value in about.items() if key != "step"}),
    }


@pytest.mark.filterwarnings("ignore:.*without a checksum")
def test_a_damaged_state_is_refused_and_fills_nothing(tmp_path: Path) -> None:
    net, average, optimizer = parts()
    net(torch.ones(3)).sum().backward()
    optimizer.step()
    save_state(tmp_path, net, average, optimizer, step=7, recipe=runs.recipe())
    path = tmp_path / loop.STATE
    assert load_state(path, *parts()) == 7
    for what, (tensors, about) in spoiled_states(path).items():
        save_tensors(tensors, path, metadata=about)
        fresh = parts()
        before = {key: value.clone() for key, value in fresh[0].state_dict().items()}
        with pytest.raises(MotionloomError):
            load_state(path, *fresh)
        assert all(torch.equal(value, before[key]) for key, value in fresh[0].state_dict().items()), what
