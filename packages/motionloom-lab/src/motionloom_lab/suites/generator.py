"""A prior as the plain function that the evaluation runs ask for."""

from collections.abc import Sequence

import numpy as np

from motionloom.features import humanml
from motionloom.features.layout import FPS, WIDTH
from motionloom.goals.sequence import split_actions
from motionloom.goals.timeline import timeline_of
from motionloom.kinematics.physics import Array
from motionloom.tasks.long import compose
from motionloom.tasks.splice import concatenate
from motionloom.tasks.text import sample_features, to_motion
from motionloom.weights.prior import Prior
from motionloom_lab.suites.harness import Generate


def generator(
    prior: Prior,
    *,
    steps: int | None = None,
    guidance: float | None = None,
    solver: str | None = None,
    finished: bool = False,
    best_of: int = 1,
) -> Generate:
    """Text to joint positions as `motionloom generate` makes them; what is None keeps the default of `generate`.

    Positions are measured as the network samples them, whose bones may breathe and whose feet may slide; ``finished``
    measures what is exported: constant bones, planted feet held still. A sentence of several actions that follow each
    other is a long motion (`goals.sequence`), which is measured as exported and keeps the usual solver; ``best_of``
    says nothing of it either.
    """
    said = {"steps": steps, "guidance": guidance, "solver": solver}
    how = {name: value for name, value in said.items() if value is not None}
    long = (len(prior.mean), prior.fps) == (WIDTH, FPS)

    def one_action(prompts: Sequence[str], seconds: float, seeds: Sequence[int]) -> list[Array]:
        frames = [round(seconds * prior.fps)] * len(prompts)
        if not frames:
            return []
        drawn = sample_features(prior, prompts, frames, seeds=list(seeds), best_of=best_of, **how)  # type: ignore[arg-type]
        features = [one.astype(np.float64) for one in drawn]
        if finished:
            return [to_motion(one, prior.fps).positions() for one in features]
        return [humanml.decode_positions(one) for one in features]

    def several(prompt: str, seconds: float, seed: int) -> Array:
        segments = timeline_of(prompt, seconds).segments
        settings = {name: value for name, value in how.items() if name != "solver"}
        return concatenate(*compose(prior, segments, seed=seed, **settings)).positions()  # type: ignore[arg-type]

    def make(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        whole = [not long or len(split_actions(prompt)) == 1 for prompt in prompts]
        single = [i for i, alone in enumerate(whole) if alone]
        made = dict(zip(single, one_action([prompts[i] for i in single], seconds, [seed + i for i in single])))
        for i in set(range(len(prompts))) - set(single):
            made[i] = several(prompts[i], seconds, seed + i)
        return [made[i] for i in range(len(prompts))], prior.fps

    return make
