"""Inpainting on the 263 features: a stretch of a person's motion sampled anew between frames that are known.

The known numbers stay (Lugmayr et al., "RePaint", CVPR 2022, without its repetitions), and where the motion goes on
behind the stretch, every denoised estimate is made to arrive there: features hold velocities of the root, nothing else
would.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.diffusion import Denoiser
from motionloom.edits.boundary import InpaintWindow, arrival, joining
from motionloom.features import humanml
from motionloom.features.layout import LAYOUT
from motionloom.ground import GroundPose
from motionloom.motion import ground_pose
from motionloom.requests.sampling import Sampling
from motionloom.tasks.sampling import Batch, Observed, Progress, Rows, sample
from motionloom.tasks.watching import View
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Inpainted:
    """A whole window with what was sampled in it, in the world of the old one."""

    positions: Array
    """(frames, 22, 3) metres at 20 fps; bones may breathe."""
    contacts: Array
    """(frames, 4) as in the features."""


def inpaint_motion(
    prior: Prior, window: InpaintWindow, text: str, sampling: Sampling, *, seed: int, progress: Progress | None = None
) -> Inpainted:
    """Sample the frames ``first`` to before ``last`` of a window by the text; the others come back to float32.

    An empty text asks for nothing in particular. Frames from 0 on are placed by what follows them.
    """
    place = ground_pose(window.positions[0])
    known = humanml.encode(place.from_world(window.positions))[None]
    mask = np.ones(known.shape, np.bool_)
    mask[:, window.first : window.last] = window.keep
    spread = prior.spread
    meet, reach = joining(known, mask, window.first, window.last), arrival(known, mask, window)

    def bent(denoise: Denoiser, _: Batch) -> Denoiser:
        return lambda state, level: (reach(meet(denoise(state, level) * spread + prior.mean)) - prior.mean) / spread

    def poses(states: np.ndarray) -> Array:
        return _placed(states[0] * spread + prior.mean, known[0], window, place)[None, None]

    observed = Observed((known - prior.mean) / spread, mask, strength=window.strength)
    rows = Rows([text], [known.shape[1]], [seed])
    [(_, state)] = sample(
        prior, rows, sampling, edits=[bent], observed=observed, progress=progress, view=View(poses, begin=window.begin)
    )
    made = state[None] * spread + prior.mean
    made = reach(meet(np.where(mask, known, prior.smoothed(made))))
    contacts = made[0, :, LAYOUT["contacts"]].astype(np.float64)
    return Inpainted(_placed(made[0], known[0], window, place), contacts)


def _placed(features: np.ndarray, known: np.ndarray, window: InpaintWindow, place: GroundPose) -> Array:
    """(frames, 22, 3) in the world, where the frames before the stretch are, or else those behind it."""
    features, known = features.astype(np.float64), known.astype(np.float64)
    positions = humanml.decode_positions(features)
    if window.first == 0 and window.last < len(features):
        there, here = (_standing(f, window.last) for f in (known, features))
        turn = GroundPose(there.x, there.z, there.facing - here.facing)
        positions = turn.to_world(positions - np.array([here.x, 0, here.z]))
    return place.to_world(positions)


def _standing(features: Array, frame: int) -> GroundPose:
    turn, root = humanml.recover_root(features)
    half = np.arctan2(turn[frame, 2], turn[frame, 0])
    return GroundPose(float(root[frame, 0]), float(root[frame, 2]), -2 * float(half))
