"""The one training loop: mixed precision, averaged weights, exact resume, several processes.

Everything random in a step follows from (seed, step, rank), and the state file is replaced whole, so a run that was
killed at any moment goes on with the losses it would have had.
"""

import hashlib
import json
import math
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.nn.attention import SDPBackend, sdpa_kernel
from torch.optim.swa_utils import get_ema_multi_avg_fn

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom.core.files.text import plain_json
from motionloom.core.models.prior import read_tensors
from motionloom_train.captured import Captured
from motionloom_train.data.progress import Say, silent
from motionloom_train.objectives import Objective
from motionloom_train.precision import choose
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import find_device

STATE = "state.safetensors"


@dataclass(frozen=True)
class World:
    """This process among those of ``torchrun``; alone by default."""

    rank: int = 0
    size: int = 1
    device: str = "cpu"

    @staticmethod
    def join(device: str | None = None) -> "World":
        """Join the process group that torchrun's environment describes, if there is one."""
        size = int(os.environ.get("WORLD_SIZE", "1"))
        local = int(os.environ.get("LOCAL_RANK", "0"))
        device = device or (f"cuda:{local}" if torch.cuda.is_available() else "cpu")
        if size > 1 and not dist.is_initialized():
            dist.init_process_group("nccl" if device.startswith("cuda") else "gloo")
        if device.startswith("cuda"):
            torch.cuda.set_device(device)
        return World(int(os.environ.get("RANK", "0")), size, device)


@dataclass(frozen=True)
class Training:
    """One run of a recipe, whatever is trained."""

    recipe: Recipe
    folder: Path
    """Holds the state, the weights, and what is logged."""
    device: str | None = None
    """Of PyTorch; None: a GPU where there is one."""
    stop: int | None = None
    """End early after so many steps."""
    say: Say = print
    """Called with a line of progress now and then."""

    @cached_property
    def world(self) -> World:
        """This process; raises MotionloomError for a device that is not there."""
        if self.device:
            find_device(self.device)
        return World.join(self.device)

    @property
    def place(self) -> Path:
        """The weight file that comes out."""
        return self.folder / f"{self.recipe.name}.safetensors"

    def progress(self, line: str) -> None:
        """Report a line, in the first process alone."""
        if self.world.rank == 0:
            self.say(line)

    def run(
        self,
        objective: "Objective",
        export: Callable[["Average", int], None],
        about: str,
        *,
        wrap: Callable[[nn.Module], nn.Module] = lambda net: net,
        capture: bool = False,
    ) -> Path:
        """Train, or go on training; gives `place` back.

        Args:
            objective: what is minimised.
            export: writes the weights of an average at a step, at every save.
            about: what is trained, on what: reported first.
            wrap, capture: as of `train`.
        """
        self.say(about)
        first = self.world.rank == 0
        for line in changed(self.folder, self.recipe) if first else ():
            self.say(f"going on with another recipe than before: {line}")
        log = Log(self.folder, self.recipe, say=self.say) if first else None
        train(
            objective,
            self.recipe,
            self.folder,
            world=self.world,
            wrap=wrap,
            on_save=export,
            on_step=log,
            capture=capture,
            stop=self.stop,
            say=self.say,
        )
        return self.place


def compiled(recipe: Recipe, dynamic: bool | None = None) -> Callable[[nn.Module], nn.Module]:
    """What compiles a network where the recipe has `compile`; ``dynamic``: for shapes that change from step to step."""
    return lambda net: torch.compile(net, dynamic=dynamic) if recipe.compile else net  # type: ignore[return-value]


def rate_at(recipe: Recipe, step: int) -> float:
    """Learning rate of a step: linear warm-up, constant, linear to zero in the cool-down."""
    warm = min(1.0, (step + 1) / max(recipe.warmup, 1))
    left = (recipe.steps - step) / max(recipe.cooldown * recipe.steps, 1e-9)
    return recipe.rate * min(warm, left, 1.0)


class Average:
    """Exponential moving average of a module's weights; early on it forgets faster, so that it starts useful."""

    def __init__(self, net: nn.Module, decay: float) -> None:
        self.decay = decay
        self.weights = {k: v.detach().clone() for k, v in net.state_dict().items()}
        self.smoothed = [key for key, value in self.weights.items() if value.is_floating_point()]

    @torch.no_grad()
    def update(self, net: nn.Module, step: int) -> None:
        """Take in the weights after ``step``."""
        decay = min(self.decay, (step + 1) / (step + 10))
        now = net.state_dict()
        towards = get_ema_multi_avg_fn(decay)
        towards([self.weights[k] for k in self.smoothed], [now[k] for k in self.smoothed], None)
        for key in now.keys() - set(self.smoothed):
            self.weights[key].copy_(now[key])


def make_optimizer(net: nn.Module, recipe: Recipe) -> torch.optim.AdamW:
    """AdamW; weight decay on matrices only."""
    trained = [p for p in net.parameters() if p.requires_grad]
    groups = [
        {"params": [p for p in trained if p.ndim >= 2], "weight_decay": recipe.decay},
        {"params": [p for p in trained if p.ndim < 2], "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=recipe.rate, betas=(0.9, 0.99), fused=trained[0].is_cuda or None)


def save_state(
    folder: Path, net: nn.Module, average: Average, optimizer: torch.optim.Optimizer, *, step: int, recipe: Recipe
) -> None:
    """Everything a run needs to go on, in one file without pickle."""
    tensors = {f"net.{k}": v for k, v in net.state_dict().items()}
    tensors |= {f"average.{k}": v for k, v in average.weights.items()}
    for number, state in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{number}.{k}": torch.as_tensor(v) for k, v in state.items()}
    tensors = {k: v.detach().cpu().contiguous() for k, v in tensors.items()}
    metadata = {"step": str(step), "recipe": json.dumps(asdict(recipe))}
    metadata["checksum"] = _checksum(tensors, metadata)
    save_tensors({k: v.numpy() for k, v in tensors.items()}, folder / STATE, metadata=metadata)


def _checksum(tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> str:
    """Of the whole content of a state file, so that a single wrong bit is noticed."""
    digest = hashlib.blake2b(digest_size=32)
    for key in ("step", "recipe"):
        digest.update(f"{key}={metadata[key]};".encode())
    for name in sorted(tensors):
        value = tensors[name].contiguous()
        digest.update(f"{name} {value.dtype} {tuple(value.shape)};".encode())
        if value.numel():  # an empty one has no bytes, and cannot be seen as such
            digest.update(value.reshape(-1).view(torch.uint8).numpy().data)
    return digest.hexdigest()


def load_state(path: Path, net: nn.Module, average: Average, optimizer: torch.optim.Optimizer) -> int:
    """Fill the run's parts from a state file; returns the number of steps done.

    Raises MotionloomError, and fills nothing, where the file is damaged or of another recipe.
    """
    arrays, metadata = read_tensors(path)
    tensors = {key: torch.from_numpy(np.array(value)) for key, value in arrays.items()}
    if not {"step", "recipe"} <= metadata.keys():
        raise MotionloomError(f"{path} is no state of a training run; train into another folder")
    if "checksum" not in metadata:
        warnings.warn(f"{path} was saved without a checksum by an older version; it is taken as it is", stacklevel=2)
    elif metadata["checksum"] != _checksum(tensors, metadata):
        raise MotionloomError(f"{path} is damaged: its checksum is another; train into another folder")
    try:
        step = metadata["step"]
        if not (step.isascii() and step.isdigit() and len(step) <= 10):
            raise ValueError(f"its step is {step[:20]!r}")
        _check_state(tensors, net, average, optimizer)
        net.load_state_dict(_part(tensors, "net."))
        for key, value in average.weights.items():
            value.copy_(tensors[f"average.{key}"])
        state: dict[int, dict[str, Tensor]] = {}
        for key, value in _part(tensors, "optimizer.").items():
            number, _, name = key.partition(".")
            state.setdefault(int(number), {})[name] = value
        optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})
        return int(step)
    except (KeyError, RuntimeError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise MotionloomError(f"{path} does not belong to this recipe ({reason}); train into another folder") from None


def _part(tensors: Mapping[str, Tensor], beginning: str) -> dict[str, Tensor]:
    return {key.removeprefix(beginning): value for key, value in tensors.items() if key.startswith(beginning)}


def _check_state(
    tensors: Mapping[str, Tensor], net: nn.Module, average: Average, optimizer: torch.optim.Optimizer
) -> None:
    """Raise ValueError unless every tensor is finite, and has the shape and kind of what it is to fill."""
    targets = {f"net.{k}": v for k, v in net.state_dict().items()}
    targets |= {f"average.{k}": v for k, v in average.weights.items()}
    places = [p for group in optimizer.param_groups for p in group["params"]]
    moments = {"exp_avg": places, "exp_avg_sq": places, "step": [torch.tensor(0.0)] * len(places)}
    for key in _part(tensors, "optimizer."):
        number, _, name = key.partition(".")
        if not (number.isascii() and number.isdigit() and int(number) < len(places) and name in moments):
            raise ValueError(f"the optimiser has no {key[:40]}")
        targets |= {f"optimizer.{number}.{each}": values[int(number)] for each, values in moments.items()}
    lacking = sorted(targets.keys() - tensors.keys()) or sorted(tensors.keys() - targets.keys())
    if lacking:
        raise ValueError(f"{lacking[0][:80]} is {'missing' if lacking[0] in targets else 'not needed'}")
    for key, value in tensors.items():
        if value.shape != targets[key].shape or value.dtype != targets[key].dtype:
            raise ValueError(f"{key} is {value.dtype} of the shape {tuple(value.shape)}")
        if value.is_floating_point() and not bool(value.isfinite().all()):
            raise ValueError(f"{key} has numbers that are not finite")


def changed(folder: Path, recipe: Recipe) -> list[str]:
    """What of the recipe differs from the one that the run in ``folder`` was last saved under, one line each."""
    if not (folder / STATE).is_file():
        return []
    try:
        before = plain_json(read_tensors(folder / STATE)[1]["recipe"])
        now = asdict(recipe)
        if recipe.amp == "auto":
            del now["amp"]  # goes on as it was
        return [f"{key} is now {now[key]!r} and was {before.get(key)!r}" for key in now if before.get(key) != now[key]]
    except (KeyError, ValueError, AttributeError, RecursionError):
        return []


def train(
    objective: Objective,
    recipe: Recipe,
    folder: Path | str,
    *,
    world: World | None = None,
    wrap: Callable[[nn.Module], nn.Module] = lambda net: net,
    on_save: Callable[[Average, int], None] | None = None,
    on_step: Callable[[int, float, float], None] | None = None,
    capture: bool = False,
    stop: int | None = None,
    say: Say = silent,
) -> Average:
    """Run a recipe in ``folder``, going on from the state found there; returns the averaged weights.

    ``wrap`` turns the trained module into what is called in a step (binding, compiling). ``on_save(average,
    step)`` and ``on_step(step, loss, seconds)`` run in the first process. ``capture``: launch whole steps as graphs
    (`motionloom_train.captured`), in one process on a CUDA device, of an objective that allows it. ``stop``: end early
    after so many steps.
    ``say`` is called with the number format if the recipe leaves that open, and after the first steps with how long
    the run will take. A run that goes on multiplies in what it did, unless the recipe changes that.
    """
    world, folder = world or World(), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    net = objective.net.to(world.device)
    average = Average(net, recipe.ema)
    optimizer = make_optimizer(net, recipe)
    start = load_state(folder / STATE, net, average, optimizer) if (folder / STATE).is_file() else 0
    recipe = replace(recipe, amp=_precision(recipe, folder, net, world, say=say))
    model = wrap(net)
    if world.size > 1:
        places = [world.device] if world.device.startswith("cuda") else None
        model = nn.parallel.DistributedDataParallel(model, device_ids=places)
    net.train()
    last = min(recipe.steps, stop or recipe.steps)
    if start >= last and world.rank == 0 and on_save:  # stopped between the last state and its weights
        on_save(average, start)
    pace = Pace(start, last, say)
    losses: list[Tensor] = []
    seed, context = recipe.seed * 1_000_003 + world.rank, _context(recipe, world)
    whole = Captured(objective, model, optimizer, clip=recipe.clip, context=context) if capture else None  # type: ignore[arg-type]
    began = time.perf_counter()
    for step in range(start, last):
        if whole:
            losses.append(whole.step(seed, step, recipe.batch, rate_at(recipe, step)))
        else:
            losses.append(_step(objective, model, optimizer, recipe, seed=seed, step=step, context=context))
        average.update(net, step)
        saves = (step + 1) % recipe.save_every == 0 or step + 1 == last
        if len(losses) < (BEHIND if world.device.startswith("cuda") else 1) and not saves:
            continue
        values = _finite(losses, step)
        seconds, began = (time.perf_counter() - began) / len(values), time.perf_counter()
        losses.clear()
        if world.rank == 0:
            for number, value in enumerate(values, step + 1 - len(values)):
                pace(seconds)
                if on_step:
                    on_step(number, value, seconds)
            if saves:
                save_state(folder, net, average, optimizer, step=step + 1, recipe=recipe)
                if on_save:
                    on_save(average, step + 1)
                began = time.perf_counter()
    return average


BEHIND = 16
"""Steps after which losses are read from a GPU, which computes meanwhile; on a CPU they are read at once."""


def _finite(losses: list[Tensor], step: int) -> list[float]:
    """The losses up to ``step``; raises MotionloomError, before anything of them is saved, if one is not finite."""
    values: list[float] = torch.stack(losses).tolist()
    for number, value in enumerate(values, step + 1 - len(values)):
        if not math.isfinite(value):
            raise MotionloomError(
                f"the loss of step {number} is not finite; lower the rate and go on from the saved state"
            )
    return values


def _precision(recipe: Recipe, folder: Path, net: nn.Module, world: World, *, say: Say) -> str:
    """What the run multiplies in, ``bf16`` or ``float32``, the same in all processes."""
    amp = recipe.amp
    if amp == "auto" and (folder / STATE).is_file():
        amp = str(plain_json(read_tensors(folder / STATE)[1]["recipe"])["amp"])
    if amp != "auto":
        return "bf16" if amp == "bf16" else "float32"
    chosen = "float32"
    if world.rank == 0:
        chosen, why = choose(net, world.device)
        say(why)
    if world.size > 1:
        half = torch.tensor(chosen == "bf16", dtype=torch.uint8, device=world.device)
        dist.broadcast(half, 0)
        chosen = "bf16" if half else "float32"
    return chosen


class Pace:
    """Reports once, after the first steps, how long the rest will take."""

    STEPS, SECONDS = 10, 20.0
    """It is reported after so many steps, or earlier once these seconds have gone by."""

    def __init__(self, start: int, last: int, say: Say) -> None:
        self.left, self.say, self.reported = last - start, say, False
        self.times: list[float] = []

    def __call__(self, seconds: float) -> None:
        """Take in how long a step took. The first one counts only while there is no other: much is set up in it."""
        self.left -= 1
        if self.reported:
            return
        self.times.append(seconds)
        if len(self.times) == self.STEPS or sum(self.times) >= self.SECONDS:
            self.reported = True
            usual = self.times[1:] or self.times
            mean = sum(usual) / len(usual)
            self.say(f"{self.left:,} more steps of about {mean:.2g} s: {_span(mean * self.left)}")


def _span(seconds: float) -> str:
    """A length of time in words."""
    minutes = round(seconds / 60)
    if minutes < 2:
        return f"about {max(round(seconds), 1)} s"
    return f"about {minutes} minutes" if minutes < 100 else f"about {minutes // 60} h {minutes % 60} min"


def _step(
    objective: Objective,
    net: nn.Module,
    optimizer: torch.optim.Optimizer,
    recipe: Recipe,
    *,
    seed: int,
    step: int,
    context: Callable[[], AbstractContextManager[object]],
) -> Tensor:
    for group in optimizer.param_groups:
        group["lr"] = rate_at(recipe, step)
    torch.manual_seed(seed * 7919 + step)  # dropout
    with context():
        loss = objective.loss(net, seed, step, recipe.batch)
    optimizer.zero_grad(set_to_none=True)
    loss.backward()
    nn.utils.clip_grad_norm_(net.parameters(), recipe.clip)
    optimizer.step()
    return loss.detach()


def _context(recipe: Recipe, world: World) -> Callable[[], AbstractContextManager[object]]:
    """What the forward pass is computed in."""

    @contextmanager
    def entered() -> Iterator[None]:
        kind = world.device.split(":")[0]
        # on a CPU the plain attention is faster backward than the fused kernel for sequences this short (benchmarks/)
        with (
            # a graph keeps no rounded copies of the weights from one launch to the next
            torch.autocast(kind, torch.bfloat16, cache_enabled=False) if recipe.amp == "bf16" else nullcontext(),
            sdpa_kernel(SDPBackend.MATH) if kind == "cpu" else nullcontext(),
        ):
            yield

    return entered


class Log:
    """A progress line with loss, throughput and remaining time; TensorBoard files where that is installed."""

    def __init__(self, folder: Path, recipe: Recipe, *, every: int = 50, say: Say = print) -> None:
        self.recipe, self.every, self.say = recipe, every, say
        self.losses: list[float] = []
        self.seconds = 0.0
        self.writer: Any = None
        try:
            from torch.utils.tensorboard import SummaryWriter

            self.writer = SummaryWriter(str(folder / "tensorboard"))
        except ImportError:
            pass

    def __call__(self, step: int, loss: float, seconds: float) -> None:
        """Take in one step; see `train`."""
        self.losses.append(loss)
        self.seconds += seconds
        if (step + 1) % self.every and step + 1 != self.recipe.steps:
            return
        count, mean = len(self.losses), sum(self.losses) / len(self.losses)
        pace = count / self.seconds
        left = (self.recipe.steps - step - 1) / pace
        self.say(
            f"step {step + 1}/{self.recipe.steps}  loss {mean:.4f}  {pace * self.recipe.batch:.0f} windows/s  "
            f"{int(left // 3600)}:{int(left % 3600 // 60):02d}:{int(left % 60):02d} left"
        )
        if self.writer:
            self.writer.add_scalar("loss", mean, step + 1)
            self.writer.add_scalar("rate", rate_at(self.recipe, step), step + 1)
            self.writer.add_scalar("windows_per_second", pace * self.recipe.batch, step + 1)
            self.writer.flush()
        self.losses, self.seconds = [], 0.0
