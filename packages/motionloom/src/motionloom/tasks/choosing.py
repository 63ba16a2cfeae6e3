"""Best of several by what the words say: the sampler's choice (`tasks.best`) with the house's checks of language."""

from functools import partial

from motionloom.goals import expected
from motionloom.tasks.best import best_candidate

best_in_words = partial(best_candidate, judge=expected)
"""A `tasks.best.Chooser` that looks first for what the words say plainly (`motionloom.goals.expected`)."""
