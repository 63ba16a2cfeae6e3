"""Readers of training and the laboratory, beside those of the product in the same list."""

from tests.fuzz.reader import READERS, Reader
from tests_lab.fuzz import readers_of_checkpoints, readers_of_measurements, readers_of_recordings

__all__ = ["OWN", "readers_of_checkpoints", "readers_of_measurements", "readers_of_recordings"]
OWN: list[Reader] = [one for one in READERS if one.read.__module__.startswith(__package__ or "")]
"""Those that are defined here."""
