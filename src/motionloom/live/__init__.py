"""A character that is steered while it moves: short windows drawn ahead of the clock, a body that is never changed behind it."""
