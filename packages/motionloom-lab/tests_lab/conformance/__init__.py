"""Recorded numbers of the published implementations that the laboratory computes (see `tests.conformance.runner`)."""
