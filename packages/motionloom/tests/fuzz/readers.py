"""Every reader of files from outside: how to make a small good file, and who reads it.

A new reader gets a place in one of the files imported here; their order is that of the readers.
"""

# isort: off
from tests.fuzz import readers_of_jobs, readers_of_motions, readers_of_robots, readers_of_servers, readers_of_weights
from tests.fuzz.reader import READERS, Reader
# isort: on

__all__ = [
    "READERS",
    "Reader",
    "readers_of_jobs",
    "readers_of_motions",
    "readers_of_robots",
    "readers_of_servers",
    "readers_of_weights",
]
