"""Drawing a stretch of a person's motion anew between frames that are known: inpainting on the 263 features.

The known numbers stay (Lugmayr et al., "RePaint", CVPR 2022, without its repetitions), and where the motion goes on
behind the stretch, every guess is made to arrive there: the features tell velocities of the root, nothing else would.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from motionloom.checkpoint import Prior
from motionloom.diffusion import SOLVERS, guide, inpaint, levels, observe, restart, row_draw, sample
from motionloom.features import humanml
from motionloom.features.layout import LAYOUT
from motionloom.metrics.physics import heading
from motionloom.tasks.goals import Placement
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS, smooth

Array = NDArray[np.float64]

JOIN = 10
"""Frames over which what the network draws is led from the known frames' course to its own."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """What is to be drawn: the frames ``first`` to before ``last`` of a person's motion, in the world."""

    positions: Array
    """(frames + 1, 22, 3) metres at 20 fps, floor at y = 0; the last frame only tells how the one before it moves."""
    first: int
    last: int
    keep: NDArray[np.bool_]
    """(263,) numbers that stay inside of the stretch too."""
    strength: float = 1.0
    """Share of the noise levels the old frames are taken to; 1 draws from noise alone."""
    facing: bool = True
    """Whether the drawn person must face at frame ``last`` as the known one does there."""
    place: bool = True
    """Whether it must also stand there."""

    def __len__(self) -> int:
        return len(self.positions) - 1


@dataclass(frozen=True, eq=False)
class Drawn:
    """A whole window with its new stretch, in the world of the old one."""

    positions: Array
    """(frames, 22, 3) metres at 20 fps; bones may breathe."""
    contacts: Array
    """(frames, 4) as in the features."""


@torch.inference_mode()
def redraw(
    prior: Prior,
    stretch: Stretch,
    text: str,
    *,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    progress: Callable[[], None] = lambda: None,
) -> Drawn:
    """Draw the stretch by the text; frames outside come back as they were (to float32), placed with the frames before.

    An empty text asks for nothing in particular. A stretch that begins with frame 0 is placed by what follows it.
    """
    place = _placement(stretch.positions)
    known = torch.from_numpy(humanml.encode(place.from_world(stretch.positions))).to(prior.mean)[None]
    mask = torch.ones_like(known, dtype=torch.bool)
    mask[:, stretch.first : stretch.last] = torch.from_numpy(stretch.keep).to(mask.device)
    spread = torch.where(prior.std > 0, prior.std, 1.0)
    data = (known - prior.mean) / spread
    meet, reach = joining(known, mask, stretch.first, stretch.last), arrival(known, mask, stretch)
    cond = prior.condition([text])
    free = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)

    def denoise(state: Tensor, level: int) -> Tensor:
        guess = inpaint(free, data, mask)(state, level) * spread + prior.mean
        return (reach(meet(guess)) - prior.mean) / spread

    draw = row_draw([seed])
    way = _levels(prior, steps, stretch.strength)
    hold = observe(data, mask, prior.schedule, draw)
    state = draw(data) if stretch.strength == 1.0 else restart(data, prior.schedule, way[0], draw)
    state = hold(state, way[0])
    for snapshot in sample(
        denoise, state, levels=way, solver=SOLVERS[SOLVER], schedule=prior.schedule, draw=draw, constrain=hold
    ):
        state = snapshot.state
        progress()
    made = state * spread + prior.mean
    made = reach(meet(torch.where(mask, known, smooth(made) if prior.net.config.patch > 1 else made)))
    features = made[0].cpu().double()
    return Drawn(_placed(features, known[0].cpu().double(), stretch, place), features[:, LAYOUT["contacts"]].numpy())


def arrival(known: Tensor, mask: Tensor, stretch: Stretch) -> Callable[[Tensor], Tensor]:
    """A function that bends the root's free velocities so that facing and place at frame ``last`` are the known ones.

    On features (rows, frames, 263), not standardised. What is missing is spread over the stretch as sin², so that
    velocities at its borders stay; full turns are nobody's fault and stay too.
    """
    first, last = stretch.first, stretch.last
    tied = (stretch.facing or stretch.place) and first > 0 and last < known.shape[1]
    if not tied or bool(mask[:, first:last, :3].any()):
        return lambda features: features
    share = torch.sin(torch.pi * (torch.arange(last - first, device=known.device) + 0.5) / (last - first)) ** 2
    share = share / share.sum()
    goal = humanml.recover_root(known)[1][:, last]

    def arrive(features: Tensor) -> Tensor:
        bent = features.clone()
        if stretch.facing:
            lacking = (known - features)[:, first:last, 0].sum(1)
            lacking = lacking - torch.pi * (lacking / torch.pi).round()
            bent[:, first:last, 0] += share * lacking[:, None]
        if stretch.place:
            turn, root = humanml.recover_root(bent)
            lacking = goal - root[:, last]
            # velocities are told in the heading of the frame they lead to
            w, y = turn[:, first + 1 : last + 1, 0], turn[:, first + 1 : last + 1, 2]
            c, s = 1 - 2 * y * y, 2 * w * y
            x, z = lacking[:, None, 0], lacking[:, None, 2]
            bent[:, first:last, 1] += share * (c * x + s * z)
            bent[:, first:last, 2] += share * (c * z - s * x)
        return bent

    return arrive


def joining(known: Tensor, mask: Tensor, first: int, last: int) -> Callable[[Tensor], Tensor]:
    """A function that bends the free numbers so that they leave the known ones, and come to them, without a jump.

    On features (rows, frames, 263), not standardised; ``mask`` is True at known ones, the stretch is ``first`` to
    before ``last``. At each border its first frame becomes what the two known frames beside it lead to, in value and
    in change; the difference fades over `JOIN` frames as a cubic.
    """
    frames = known.shape[1]
    reach = min(JOIN, (last - first) // 2)
    u = torch.arange(reach, device=known.device, dtype=known.dtype)[:, None] / max(reach, 1)
    value, change = (1 - u) ** 2 * (1 + 2 * u), (1 - u) ** 2 * u * reach
    free = ~mask
    free[..., LAYOUT["contacts"]] = False
    borders = [(first - 1, 1)] * (first >= 2) + [(last, -1)] * (last <= frames - 2)

    def join(features: Tensor) -> Tensor:
        bent = features.clone()
        for border, step in borders if reach >= 2 else ():
            pace = known[:, border] - known[:, border - step]
            start = border + step
            lack = known[:, border] + pace - features[:, start]
            slope = pace - (features[:, start + step] - features[:, start])
            at = start + step * torch.arange(reach, device=known.device)
            bent[:, at] += value * lack[:, None] + change * slope[:, None]
        return torch.where(free, bent, features)

    return join


def _levels(prior: Prior, steps: int, strength: float) -> list[int]:
    """As many steps over the levels up to ``strength`` of all, as far as there are so many levels."""
    way = levels(prior.schedule, steps, spacing=SPACING)
    return sorted({round(level * strength) for level in way} | {0, max(1, round(way[0] * strength))}, reverse=True)


def _placement(positions: Array) -> Placement:
    return Placement(float(positions[0, 0, 0]), float(positions[0, 0, 2]), float(heading(positions[:1])[0]))


def _placed(features: Tensor, known: Tensor, stretch: Stretch, place: Placement) -> Array:
    """(frames, 22, 3) in the world, where the frames before the stretch are, or else those behind it."""
    positions = humanml.decode_positions(features).numpy()
    if stretch.first == 0 and stretch.last < len(features):
        there, here = (_standing(f, stretch.last) for f in (known, features))
        turn = Placement(there.x, there.z, there.facing - here.facing)
        positions = turn.to_world(positions - np.array([here.x, 0, here.z]))
    return place.to_world(positions)


def _standing(features: Tensor, frame: int) -> Placement:
    turn, root = humanml.recover_root(features)
    half = torch.atan2(turn[frame, 2], turn[frame, 0])
    return Placement(float(root[frame, 0]), float(root[frame, 2]), -2 * float(half))
