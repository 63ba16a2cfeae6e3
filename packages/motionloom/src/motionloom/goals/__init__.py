"""Targets of a motion: places, paths, drawings, masks and timelines, out of files or made in Python."""
