"""`batch`: rows in, a folder of motions out, each exactly once; the same call goes on with what is missing."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from motionloom.bulk.claim import claim, refuse_beside
from motionloom.bulk.crew import alone, cores, gpus
from motionloom.bulk.folder import Head, Store, check_settings, digest, open_folder, read_manifest
from motionloom.bulk.jobs import MOST, Jobs, parquet, shard_size
from motionloom.bulk.maker import FORMATS, Made, Maker, Options
from motionloom.bulk.measures import Filter
from motionloom.bulk.metadata import Result, damaged_table, read_batch, result, write_table
from motionloom.bulk.on_robot import check_format
from motionloom.bulk.row import parse
from motionloom.bulk.shard import Batch, Report, Task, problems
from motionloom.core.errors import MotionloomError
from motionloom.goals.adapters import parse_adapter
from motionloom.requests.fields import specs
from motionloom.requests.sampling import PairSampling
from motionloom.robots.clip import FPS
from motionloom.robots.clip import check_settings as check_rate

Source = Jobs | Path | str | Mapping[str, Any] | Iterable[Mapping[str, Any]]
LOCAL = "local"
"""Ray's address for a cluster of this machine."""
LOOKED_AT = 8
"""Shards of a folder that are looked at to see whether it is another job's."""


@dataclass(frozen=True)
class Where:
    """Where a batch runs; what comes out does not depend on it."""

    workers: int | None = None
    """Processes, or actors on Ray; None: one per core, with CUDA one per GPU."""
    shard: tuple[int, int] | None = None
    """(i, n): make shards i, i + n, i + 2n ... alone, beside others who make theirs; 0 <= i < n."""
    ray: str | None = None
    """Address of a Ray cluster; `LOCAL`: RAY_ADDRESS, else one on this machine; None: without Ray."""


def batch(
    jobs: Source,
    out: Path | str | None = None,
    *,
    options: Options = Options(),  # noqa: B008
    where: Where = Where(),
    force: bool = False,
) -> Iterator[Result]:
    """Generate a motion of every row; yields what became of each, in the job's order.

    jobs: a file (JSON lines, CSV, Parquet), or mappings with the columns of docs/batch.md. out: the folder for the
    motions; rows that are already in it are not generated again, and processes beside this one do the work. Without
    ``out`` this process generates the motions one after the other and keeps none: each `Result` has its motion. force:
    take a folder that holds another job's motions, which then go. Raises `MotionloomError` for jobs, options and
    folders that cannot be; what is wrong with a row is in its result.
    """
    if out is None:
        check_options(options)
        yield from _here(Jobs.of(jobs), options)
        return
    for _ in run(Jobs.of(jobs), Path(out), options=options, where=where, force=force):
        pass
    yield from read_batch(out, motions=False)


def run(
    jobs: Jobs,
    out: Path,
    *,
    options: Options,
    where: Where,
    moved: Callable[[int], None] = lambda rows: None,
    rows: int | None = None,
    force: bool = False,
) -> Iterator[Report]:
    """Generate what is missing of a batch's folder; a report of each shard when it is whole, those that were at once.

    moved: called with how many more rows are finished. rows: how many the job has, where that is known. force: as of
    `batch`.
    """
    check_options(options)
    count = jobs.count() if rows is None else rows
    check_jobs(jobs, count)
    shard_rows = options.shard_rows or shard_size(count)
    refuse_beside(out, where.shard or (0, 1))  # who works there may have got no further than to say so
    check_settings(out, options, rows=count, shard_rows=shard_rows, force=force)  # before anything is generated
    with claim(out, where.shard or (0, 1)) as claimed:
        if not force:
            _check_same_job(jobs, out, options)
        manifest = open_folder(out, options, rows=count, shard_rows=shard_rows, force=force)
        size = int(manifest["shard_rows"])
        store, shards = Store(out, options.format), -(-count // size)
        if store.record(shards).exists():
            raise MotionloomError(
                f"{out} holds more shards than the job has, of rows that it no longer asks for; name another folder"
            )
        work = Batch(
            str(out.resolve()),
            str(jobs.folder.resolve()),
            manifest["weights"]["sha256"],
            manifest["duets"],
            _with_whole_paths(options),
            claimed.driver.name,
        )
        new_rows = 0
        for report in _reports(_items(jobs, size, store, where.shard or (0, 1)), work, where, moved):
            claimed.check()
            new_rows += report.new_rows
            yield report
        whole = all(store.record(shard).exists() for shard in range(shards))  # of all drivers
        if whole and (new_rows or damaged_table(store) is not None):
            write_table(store, shards)


def _reports(
    items: Iterator[Task | Report], work: Batch, where: Where, moved: Callable[[int], None]
) -> Iterator[Report]:
    if where.ray is None:
        return alone(items, work, workers=where.workers or processes(work.options), moved=moved)
    from motionloom.bulk.on_ray import on_ray

    address = None if where.ray == LOCAL else where.ray
    return on_ray(items, work, address=address, workers=where.workers, moved=moved)


def check_options(options: Options) -> None:
    """Raise `MotionloomError` for options that can be refused without reading anything."""
    if options.format not in FORMATS:
        raise MotionloomError(f"no format {options.format!r}; there are {', '.join(FORMATS)}")
    if options.format == "parquet":
        parquet()
    if options.filter is not None:
        names = Filter(options.filter).names
        if "obeys" in names and options.judge is None:
            raise MotionloomError(
                "the filter asks whether motions obey, and there is no judge; name one in the options"
            )
    check_robot(options)
    specs(PairSampling)["pair_guidance"].check(options.pair_guidance, "pair_guidance")
    if options.shard_rows is not None and not 1 <= options.shard_rows <= MOST:
        raise MotionloomError(f"a shard has 1 to {MOST:,} rows; got {options.shard_rows:,}")
    if options.unit != 1.0 and options.format != "bvh":
        raise MotionloomError(f"--out-unit is for BVH files; the format is {options.format}, which states its unit")
    if options.fps is not None and not 1 <= options.fps <= 1000:
        raise MotionloomError(f"the frame rate must be 1 to 1000; got {options.fps:g}")
    if options.skeleton is not None and options.skeleton != "smpl22" and not Path(options.skeleton).is_file():
        raise MotionloomError(f"there is no file {options.skeleton}; name a skeleton (.bvh, .glb, .asf) or smpl22")


def check_robot(options: Options) -> None:
    """Raise `MotionloomError` for a robot that cannot be, or does not go with the other options."""
    check_rate(options.fps or FPS, options.max_speed)
    if options.robot is None and options.robot_map is not None:
        raise MotionloomError("--robot-map goes with a --robot; name its model")
    if options.robot is None:
        return
    check_format(options.format, robot=True)
    if options.skeleton is not None or options.hands != "as-is":
        raise MotionloomError("--skeleton and --hands are for characters; leave them out with --robot")
    options.on_robot()


def check_jobs(jobs: Jobs, rows: int) -> None:
    """Raise `MotionloomError` for a job without rows, and for columns that none of its rows may have."""
    if not rows:
        raise MotionloomError(f"there is no row in {jobs.path or 'the job'}; give one row per motion")
    try:
        parse(next(jobs.read()))
    except MotionloomError as error:
        if "the row has no '" in str(error):  # so will it be in all others
            raise MotionloomError(f"{jobs.path or 'the job'}: {error}") from None


def array_task(environment: Mapping[str, str] = os.environ) -> tuple[int, int] | None:
    """(i, n) of a Slurm array's task; None outside of one. Raises `MotionloomError` for an array that is no range."""
    try:
        task, count = int(environment["SLURM_ARRAY_TASK_ID"]), int(environment["SLURM_ARRAY_TASK_COUNT"])
        first = int(environment.get("SLURM_ARRAY_TASK_MIN", 0))
        step = int(environment.get("SLURM_ARRAY_TASK_STEP", 1)) or 1
    except KeyError:
        return None
    except ValueError:
        raise MotionloomError("SLURM_ARRAY_TASK_ID and _COUNT must be whole numbers; give --shard i/n") from None
    number = (task - first) // step
    if not 0 <= number < count:
        raise MotionloomError(f"task {task} of an array of {count} has no place in it; give --shard i/n")
    return number, count


def _here(jobs: Jobs, options: Options) -> Iterator[Result]:
    """Every row generated in this process, a few at a time."""
    maker = Maker(options, folder=jobs.folder)
    passes = Filter(options.filter) if options.filter else None
    number = 0
    for rows in jobs.shards(4 * maker.together):
        results: dict[int, Result] = {}
        orders = {}
        for offset, raw in enumerate(rows):
            try:
                orders[number + offset] = maker.sources.ask(parse(raw))
            except MotionloomError as error:
                results[number + offset] = result({"row": number + offset, "state": "failed", "error": str(error)})
        places = {id(one): place for place, one in orders.items()}
        for one, take in maker.make(list(orders.values())):
            place = places[id(one)]
            known = {"row": place, "id": one.id, "key": one.key, "text": one.text, "seed": one.seed}
            if not isinstance(take, Made):
                results[place] = result({**known, "state": "failed", "error": take})
            elif take.passes(passes):
                results[place] = result({**known, "state": "made", **take.measures}, take.people)
            else:
                results[place] = result({**known, "state": "dropped", **take.measures})
        yield from (results[place] for place in sorted(results))
        number += len(rows)


def _items(jobs: Jobs, size: int, store: Store, share: tuple[int, int]) -> Iterator[Task | Report]:
    """What is missing of a driver's share, and reports of what is there already."""
    number, of = share
    for shard, rows in enumerate(jobs.shards(size)):
        if shard % of != number:
            continue
        head = store.head(shard)
        if head is not None and _is_done(head, rows) and not store.damage(shard):
            listed = problems(store.entries(shard)) if "failed" in head.counts else []
            yield Report(shard, len(rows), head.counts, 0, listed)
        else:
            yield Task(shard, shard * size, rows)


def _is_done(head: Head, rows: list[bytes]) -> bool:
    """Whether a shard holds these rows' motions, as far as the rows alone show; what failed is to be tried again."""
    return not head.names_files and head.counts.get("failed", 0) == head.refused and head.digest == digest(rows)


def _with_whole_paths(options: Options) -> Options:
    """The options with whole paths: other processes may be elsewhere."""

    def whole(name: str | None) -> str | None:
        return str(Path(name).resolve()) if name is not None and Path(name).is_file() else name

    parsed = map(parse_adapter, options.adapters)
    adapters = [f"{path.resolve()}" if factor is None else f"{path.resolve()}:{factor!r}" for path, factor in parsed]
    files = {name: whole(getattr(options, name)) for name in ("skeleton", "robot", "robot_map")}
    weights = whole(options.weights) or "default"
    pair = whole(options.pair_weights) or "duet"
    return replace(options, weights=weights, pair_weights=pair, adapters=adapters, **files)


def processes(options: Options) -> int:
    """How many processes this machine has room for: one per core, with CUDA one per GPU."""
    return gpus() if options.device == "cuda" else cores()


def _check_same_job(jobs: Jobs, out: Path, options: Options) -> None:
    """Raise `MotionloomError` where the first shards of a folder hold motions, and this job has none of them."""
    manifest = read_manifest(out)
    if manifest is None:
        return
    store, size = Store(out, manifest["files"]), int(manifest["shard_rows"])
    there, old, new = set(sorted(store.shards())[:LOOKED_AT]), set(), set()
    for shard, rows in zip(range(max(there, default=-1) + 1), jobs.shards(size)):
        if shard not in there or (head := store.head(shard)) is None:
            continue
        if head.digest == digest(rows):
            return
        old |= {(one["text"], one["seed"]) for one in store.entries(shard) if one["state"] == "made"}
        new |= {_words(raw, options.seed) for raw in rows}
    if old and None not in new and not old & new:
        raise MotionloomError(
            f"{out} holds motions of another job: none of the first {len(old):,} is in this job; "
            "name another folder, or replace them with --force"
        )


def _words(raw: bytes, seed: int) -> tuple[str, int] | None:
    """The words and the seed of a row; None where a timeline, which is not read here, has them."""
    try:
        row = parse(raw)
    except MotionloomError:
        return "", -1
    words = row.prompt or row.motion or ""
    return None if row.timeline is not None else (words, seed if row.seed is None else row.seed)
