"""Two controls in one motion: networks that see a path and a wrist, blended with weights that depend on the level.

DiffusionBlending (Shafir et al. 2024, section 4.3). Without shipped adapters the prior's own network does the work.

    python examples/09_blend_controls.py
"""

from pathlib import Path

from motionloom import Prior, control, save
from motionloom.core.models.adapter import Adapter, adapters
from motionloom.goals.goal_file import read_goal

prior = Prior.load()
goal = read_goal(
    {
        "path": {"points": [[0, 0], [0.5, 2.5]], "facing": 0},
        "joints": [
            {
                "joint": "right_wrist",
                "frame": "root",
                "curve": True,
                "points": [
                    {"time": 1.0, "position": [-0.3, 1.2, 0.3]},
                    {"time": 2.0, "position": [-0.2, 1.6, 0.3]},
                ],
            }
        ],
    },
    frames=60,
    folder=Path(),
)


def of_the_path(level: int) -> float:
    """The path is decided while there is much noise, the hand at the end: from 1 down to 0."""
    return level / prior.schedule.steps


def of_the_wrist(level: int) -> float:
    """What is left: the weights are used as they are and should add up to 1."""
    return 1.0 - of_the_path(level)


shipped = adapters()
chosen = [Adapter.load(name, prior) for name in ("trajectory", "any") if name in shipped]
weighted = list(zip(chosen, [of_the_path, of_the_wrist])) if len(chosen) == 2 else chosen
[made] = control(prior, "a person walks", goal, adapters=weighted, seed=1, steps=8)
save(made.motion, "blended.bvh")
print(
    f"blended.bvh: {len(chosen)} adapters, {100 * made.error:.2f} cm from the goals, {100 * made.worst:.2f} cm at most"
)
assert made.error < 0.01
