"""Measuring a prior against words and against real people: what `motionloom evaluate` runs."""
