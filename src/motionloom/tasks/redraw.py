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

from motionloom.diffusion import SOLVERS, guide, inpaint, levels, observe, restart, row_draw, sample
from motionloom.diffusion.sampling import Snapshot
from motionloom.edits.boundary import Stretch, arrival, joining
from motionloom.features import humanml
from motionloom.features.layout import LAYOUT
from motionloom.goals.goal import Placement
from motionloom.kinematics.physics import heading
from motionloom.tasks.text import GUIDANCE, SOLVER, SPACING, STEPS, smooth
from motionloom.tasks.watching import reported
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]


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

    def placed(snapshot: Snapshot) -> Array:
        features = (snapshot.clean[0] * spread + prior.mean).cpu().double()
        return _placed(features, known[0].cpu().double(), stretch, place)[None, None]

    walk = sample(
        denoise, state, levels=way, solver=SOLVERS[SOLVER], schedule=prior.schedule, draw=draw, constrain=hold
    )
    for snapshot in reported(walk, len(way) - 1, [0], placed):
        state = snapshot.state
        progress()
    made = state * spread + prior.mean
    made = reach(meet(torch.where(mask, known, smooth(made) if prior.net.config.patch > 1 else made)))
    features = made[0].cpu().double()
    return Drawn(_placed(features, known[0].cpu().double(), stretch, place), features[:, LAYOUT["contacts"]].numpy())


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
