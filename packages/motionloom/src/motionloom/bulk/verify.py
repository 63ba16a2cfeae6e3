"""Whether a batch's folder still holds what was written: every byte of every file against the hashes in its records."""

from dataclasses import dataclass
from pathlib import Path

from motionloom.bulk.claim import living
from motionloom.bulk.folder import find_batch
from motionloom.bulk.metadata import damaged_table, table_shards
from motionloom.core.errors import MotionloomError

MOST_LOST = 100_000
"""Lost shards that are listed, whatever a damaged file counts."""


@dataclass(frozen=True)
class Verified:
    """What was found in a batch's folder."""

    shards: int
    """That are there, damaged ones included."""
    of: int
    """Shards of the whole job."""
    files: int
    """That were compared with their hashes."""
    sizes_only: int
    """Shards of before there were hashes, of which only the files' sizes are known."""
    damaged: tuple[Path, ...]
    """Files that are lost, foreign, or not as they were written."""


def verify(out: Path | str) -> Verified:
    """Compare all files of a batch with its records; nothing is changed.

    Raises `MotionloomError` for a folder that is no batch, whose manifest is damaged, or in which somebody works.
    """
    folder = Path(out)
    store, of = find_batch(folder)
    if (driver := living(folder)) is not None:
        raise MotionloomError(f"{folder} is being made by {driver}; verify it when that ended")
    there = set(store.shards())
    counted = min(table_shards(store), of, len(there) + MOST_LOST)
    expected = there | set(range(counted))  # a shard that the table counts and that is not there was lost
    damaged = [path for shard in sorted(expected) for path in store.damage(shard)]
    heads = [head for shard in there if (head := store.head(shard)) is not None]
    if all(shard in there for shard in range(of)) and (table := damaged_table(store)) is not None:
        damaged.append(table)
    files = sum(len(head.sha256) for head in heads) + len(there)
    unknown = sum(not head.record for head in heads)
    return Verified(len(there), of, files, unknown, tuple(damaged))
