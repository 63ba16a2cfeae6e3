"""Recorded numbers of the published implementations, rebuilt from formulas and compared (see `runner`)."""
