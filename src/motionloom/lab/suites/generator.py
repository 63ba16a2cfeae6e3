"""A prior as the plain function that the evaluation runs ask for."""

from collections.abc import Sequence

import numpy as np

from motionloom.features import humanml
from motionloom.kinematics.physics import Array
from motionloom.lab.suites.harness import Generate
from motionloom.tasks.text import sample_features, to_motion
from motionloom.weights.prior import Prior


def generator(
    prior: Prior,
    *,
    steps: int | None = None,
    guidance: float | None = None,
    solver: str | None = None,
    finished: bool = False,
) -> Generate:
    """Text to joint positions with `tasks.text`; what is None keeps the default of `generate`.

    Positions are measured as the network draws them, whose bones may breathe and whose feet may slide; ``finished``
    measures what is exported: constant bones, planted feet held still.
    """
    said = {"steps": steps, "guidance": guidance, "solver": solver}
    how = {name: value for name, value in said.items() if value is not None}

    def make(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        frames, seeds = [round(seconds * prior.fps)] * len(prompts), range(seed, seed + len(prompts))
        drawn = sample_features(prior, prompts, frames, seeds=list(seeds), **how)  # type: ignore[arg-type]
        features = [one.numpy().astype(np.float64) for one in drawn]
        if finished:
            return [to_motion(one, prior.fps).positions() for one in features], prior.fps
        return [humanml.decode_positions(one) for one in features], prior.fps

    return make
