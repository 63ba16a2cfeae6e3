"""Targets of a motion: places, paths, drawings, masks and timelines, out of files or from Python."""
