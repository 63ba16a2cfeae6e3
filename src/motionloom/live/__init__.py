"""Somebody who is steered while he moves: short windows drawn ahead, a body that is never changed once it was shown."""
