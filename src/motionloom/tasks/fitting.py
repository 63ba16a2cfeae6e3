"""Fitting: a drawn motion is bent until it meets a goal (being written)."""

from motionloom.motion import Motion
from motionloom.tasks.goals import Goal


def fit(motion: Motion, goal: Goal) -> Motion:
    """The motion as it is."""
    del goal
    return motion
