"""Inpainting on the 263 features: a stretch of a person's motion sampled anew between frames that are known.

The known numbers stay (Lugmayr et al., "RePaint", CVPR 2022, without its repetitions), and where the motion goes on
behind the stretch, every denoised estimate is made to arrive there: features hold velocities of the root, nothing else
would.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.diffusion import Denoiser
from motionloom.edits.boundary import InpaintWindow, arrival, joining
from motionloom.features.placed import PlacedMotion
from motionloom.requests.sampling import Sampling
from motionloom.tasks.sampling import Batch, Observed, Progress, Rows, sample
from motionloom.tasks.watching import View
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]


def inpaint_motion(
    prior: Prior, window: InpaintWindow, text: str, sampling: Sampling, *, seed: int, progress: Progress | None = None
) -> PlacedMotion:
    """A whole window with the frames ``first`` to before ``last`` sampled by the text; the others come back to float32.

    An empty text asks for nothing in particular. Frames from 0 on are placed by the next ones.
    """
    whole = PlacedMotion.of(window.positions)
    known = whole.features[None]
    mask = np.ones(known.shape, np.bool_)
    mask[:, window.first : window.last] = window.keep
    spread = prior.spread
    meet, reach = joining(known, mask, window.first, window.last), arrival(known, mask, window)

    def bent(denoise: Denoiser, _: Batch) -> Denoiser:
        return lambda state, level: (reach(meet(denoise(state, level) * spread + prior.mean)) - prior.mean) / spread

    def poses(states: np.ndarray) -> Array:
        return _placed(states[0] * spread + prior.mean, whole, window).positions[None, None]

    observed = Observed((known - prior.mean) / spread, mask, strength=window.strength)
    rows = Rows([text], [known.shape[1]], [seed])
    [(_, state)] = sample(
        prior,
        rows,
        sampling,
        edits=[bent],
        observed=observed,
        corrected=True,
        progress=progress,
        view=View(poses, begin=window.begin),
    )
    return _placed(state * spread + prior.mean, whole, window)


def _placed(features: np.ndarray, whole: PlacedMotion, window: InpaintWindow) -> PlacedMotion:
    """A sampled window in the world, where the frames before the stretch are, or else those behind it."""
    placed = PlacedMotion(features, whole.begin)
    if window.first == 0 and window.last < len(features):
        return placed.moved_to(whole.at(window.last), window.last)
    return placed
