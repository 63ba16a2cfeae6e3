"""A prior as the plain function that the evaluation runs ask for."""

from collections.abc import Sequence

from motionloom.checkpoint import Prior
from motionloom.evaluation.obey import Generate
from motionloom.metrics.physics import Array
from motionloom.tasks.text import generate


def generator(
    prior: Prior, *, steps: int | None = None, guidance: float | None = None, solver: str | None = None
) -> Generate:
    """Text to motion with `tasks.text.generate`; what is None keeps its default there.

    Feet are not cleaned up: that would hide skating.
    """
    given = {"steps": steps, "guidance": guidance, "solver": solver}
    options = {name: value for name, value in given.items() if value is not None}

    def make(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        motions = generate(prior, list(prompts), seconds=seconds, seed=seed, clean=False, **options)
        return [motion.positions() for motion in motions], motions[0].fps

    return make
