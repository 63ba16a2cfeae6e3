"""Ways of completing what two people did, for `lab.suites.duet`: from the first second of crops to the rest.

``way(crops, sample)``: `Crops` to (crops, 2, 80, 22, 3) metres in their world, the given frames first.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import nn

from motionloom.core.diffusion import row_seed
from motionloom.core.errors import MotionloomError
from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior, save_prior
from motionloom.kinematics.physics import Array
from motionloom.tasks.history import holding_correction
from motionloom.tasks.pair import PairEdits, pair_features, person_seeds
from motionloom.tasks.people import known_state
from motionloom.tasks.text import STEPS
from motionloom_lab.metrics.pair import PREFIX
from motionloom_lab.metrics.prediction import constant_velocity, zero_velocity
from motionloom_lab.papers.mrt import Mrt, completed
from motionloom_lab.suites.protocol import GUIDANCES, SEEDS, check_ranges
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays, prior_module, prior_session
from motionloom_train.nets.pair import Talk, fitting
from motionloom_train.nets.prior import ModulatedBlock, PublishedBlock


@dataclass(frozen=True, eq=False)
class Crops:
    """What two people did, to be completed."""

    positions: Array
    """(crops, 2, 81, 22, 3) metres in a world, +Y up, the floor at 0; the last frame is there for velocities alone."""
    numbers: tuple[int, ...]
    """Which crop of the run each is: its noise goes by that, whatever crops are beside it."""

    def part(self, some: slice) -> "Crops":
        """Some of them."""
        return Crops(self.positions[some], self.numbers[some])


def random_crop(motions: Sequence[Array], frames: int, rng: np.random.Generator) -> Array:
    """So many frames of one of several (2, frames, 22, 3), either person first."""
    positions = motions[int(rng.integers(len(motions)))]
    start = int(rng.integers(positions.shape[1] - frames + 1))
    return positions[:: 1 if rng.random() < 0.5 else -1, start : start + frames]


Way = Callable[[Crops, int], Array]
Features = Callable[..., PairMotion]
"""`tasks.pair.pair_features`, or what takes its place."""
FRAMES = 80
"""Frames of a completion, the given ones included."""
GIVEN: dict[str, tuple[int, bool]] = {"past": (PREFIX, False), "tool": (PREFIX, True), "published": (PREFIX - 1, True)}
"""Feature frames known beside D, and whether the velocity out of the last one is the true one, a frame ahead."""
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class CompletionSettings:
    """How completions are measured."""

    crops: int = 200
    samples: int = 5
    """Completions of each crop; their mean is a row of its own."""
    steps: int = STEPS
    guidance: float = 1.0
    prompt: str = ""
    """The prompt of the networks; published: none."""
    given: str = "past"
    """What of the first second is known, see `GIVEN`."""
    seed: int = 0

    def __post_init__(self) -> None:
        check_ranges(
            self, {"crops": (1, 10_000), "samples": (1, 100), "steps": (1, 1000), "guidance": GUIDANCES, "seed": SEEDS}
        )
        if self.given not in GIVEN:
            raise MotionloomError(f"what is given is one of {', '.join(GIVEN)}; got {self.given[:40]!r}")


def by_rule(rule: Callable[[np.ndarray, int], Array]) -> Way:
    """A baseline of `lab.metrics.prediction` for each person."""

    def way(crops: Crops, sample: int) -> Array:
        past = crops.positions[:, :, :PREFIX]
        ahead = [[rule(person, FRAMES - PREFIX)[0] for person in crop] for crop in past]
        return np.concatenate([past, np.array(ahead)], axis=2)

    return way


def standing() -> Way:
    """Both stay in their last given pose."""
    return by_rule(zero_velocity)


def gliding() -> Way:
    """Every joint goes on as between the last two given frames."""
    return by_rule(constant_velocity)


def by_mrt(net: Mrt) -> Way:
    """The multi-range transformer; every sample is the same."""

    def way(crops: Crops, sample: int) -> Array:
        past = crops.positions[:, :, :PREFIX].astype(np.float32)
        return completed(net, past, FRAMES - PREFIX).astype(np.float64)

    return way


def visible_part(crop: np.ndarray, kind: str) -> np.ndarray:
    """The part of a crop (2, 81, 22, 3) that features are computed from: (2, known frames + 1, 22, 3)."""
    frames, true = GIVEN[kind]
    if true:
        return crop[:, : frames + 1]
    past = crop[:, :frames]
    return np.concatenate([past, 2 * past[:, -1:] - past[:, -2:-1]], axis=1)


def sampled(prior: Prior, net: PairSession, how: CompletionSettings, make: Features = pair_features) -> Way:
    """Two people from a prior and a block, with noise of (seed, sample, number of the crop).

    With "past" given everything is as `tasks.pair.complete_pair` has it, and nothing after the given frames is looked
    at; "tool" and "published" are the published tool and evaluation, which know the velocity out of the last given
    frame, and have no smooth way out of the past.
    """

    def way(crops: Crops, sample: int) -> Array:
        worlds = [visible_part(crop, how.given) for crop in crops.positions]
        known = PairMotion.stack([two.encode(world) for world in worlds])
        people = [person for one in known.features for person in one]
        leaving = [holding_correction(person, prior, FRAMES) for person in people]
        sampled = make(
            prior,
            net,
            [how.prompt] * len(people),
            FRAMES,
            seeds=[s for number in crops.numbers for s in person_seeds(row_seed(how.seed, sample), number)],
            edits=PairEdits(
                known_state(net, known, FRAMES), leaving if how.given == "past" else None, frozen=[False] * len(people)
            ),
            guidance=how.guidance,
            steps=how.steps,
        )
        floors = np.stack([two.floors(world) for world in worlds])
        return (
            PairMotion(sampled.features.astype(np.float64), known.poses).places() + floors[..., None, None, None] * _UP
        )

    return way


def no_communication_net(prior: Prior) -> PairSession:
    """The prior without communication: a block that changes nothing, and two independent motions."""
    silent = Talk(fitting(prior.net.config), prior.net.config)
    graph = pair_graph(silent.config, prior.net.config)
    return PairSession(silent.config, arrays(silent), graph, prior.net, prior.schedule, prior.mean, prior.std)


def bare(prior: Prior) -> Prior:
    """The prior with layers that do nothing: what stays is how motion, level and words come in and motion goes out.

    A block trained over it (`motionloom train duet`) is "communication only": the paper's table 3 has such a row and
    no text describes it; here it is the communication block in place of the prior's layers.
    """
    net = prior_module(prior)
    with torch.no_grad():
        for block in net.blocks:
            for layer in _outs(block):
                layer.weight.zero_()
                layer.bias.zero_()
    return replace(prior, net=prior_session(net))


def _outs(block: nn.Module) -> Sequence[nn.Linear]:
    """What each part of a layer adds to the sum comes out of."""
    assert isinstance(block, (ModulatedBlock, PublishedBlock))
    outs = [block.heard] if isinstance(block, ModulatedBlock) else []
    return [block.attention.out, block.linear2, *outs]


def write_bare(prior: Prior, path: Path | str) -> Path:
    """`bare` as a weight file, exact, for `motionloom train duet`."""
    return save_prior(bare(prior), path, half=False)


def only_communication(prior: Prior, block: PairBlock | Path | str) -> tuple[Prior, PairSession]:
    """The bare prior and the network of a block that was trained over it; raises MotionloomError for another block."""
    silent = bare(prior)
    own = block if isinstance(block, PairBlock) else PairBlock.load(block, silent)
    return silent, own.net(silent)
