"""Somebody who is steered while he moves: windows sampled ahead, a body that is never changed once it was shown."""
