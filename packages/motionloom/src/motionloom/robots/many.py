"""Many motions on one robot: a folder of clips and one manifest, in several processes; what is there stays."""

import json
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from motionloom import io
from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path
from motionloom.motion import Motion
from motionloom.reading import read_bytes
from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import FPS, put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.files import WRITES, save_clip

MANIFEST = "manifest.jsonl"


@dataclass(frozen=True)
class Settings:
    """How all of them are made."""

    robot: str
    """The model's file."""
    robot_map: str | None = None
    format: str = "npz"
    fps: float = FPS
    max_speed: float | None = None
    avoid_collisions: bool = False


@dataclass(frozen=True, eq=False)
class Job:
    """A motion, or the file of one; ``name`` is that of its clip."""

    name: str
    source: Motion | Path
    about: dict[str, Any] = field(default_factory=dict)
    """What its line in the manifest says besides."""


def make_many(jobs: Iterable[Job], out: Path, settings: Settings, *, workers: int = 1) -> Iterator[dict[str, Any]]:
    """Put every job on the robot; gives its line of the manifest as soon as it is written.

    A clip that is in the folder and in its manifest is not made again. A motion that cannot be made has ``error`` in
    its line, and the others go on. Raises `MotionloomError` for a folder that was made with other settings.
    """
    if f".{settings.format}" not in WRITES:
        raise MotionloomError(f"clips are written as npz or csv; got {settings.format}")
    robot = read_robot(settings.robot, _map(settings))
    out.mkdir(parents=True, exist_ok=True)
    done = _begun(out, settings, robot)
    waiting = (job for job in jobs if not (job.name in done and (out / f"{job.name}.{settings.format}").is_file()))
    with (out / MANIFEST).open("a", encoding="utf-8") as manifest:
        for line in _made(waiting, out, settings, robot, workers):
            manifest.write(json.dumps(line) + "\n")
            manifest.flush()
            yield line


def _map(settings: Settings) -> Path | None:
    return None if settings.robot_map is None else Path(settings.robot_map)


def _begun(out: Path, settings: Settings, robot: Robot) -> set[str]:
    """Names that the manifest has; its first line, which says how they are made, is written where there is none."""
    head = {"robot_name": robot.name, "joint_names": list(robot.file.joint_names()), **asdict(settings)}
    path = out / MANIFEST
    if not path.exists():
        with atomic_path(path) as temporary:
            temporary.write_text(json.dumps(head) + "\n", encoding="utf-8")
        return set()
    lines = [json.loads(line) for line in read_bytes(path).decode("utf-8").splitlines() if line.endswith("}")]
    if not lines or lines[0] != head:
        raise MotionloomError(f"{out} holds clips that were made otherwise; name another folder")
    return {line["name"] for line in lines[1:] if "error" not in line}


def _made(jobs: Iterator[Job], out: Path, settings: Settings, robot: Robot, workers: int) -> Iterator[dict[str, Any]]:
    if workers <= 1:
        for job in jobs:
            yield _one(job, out, settings, robot)
        return
    flying: deque[Future[dict[str, Any]]] = deque()
    with ProcessPoolExecutor(workers, get_context("spawn"), _begin, (settings,)) as pool:
        try:
            for job in jobs:
                flying.append(pool.submit(_in_process, job, out, settings))
                if len(flying) > 2 * workers:
                    yield flying.popleft().result()
            while flying:
                yield flying.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


_OWN: list[Robot] = []
"""The robot of this process, read once."""


def _begin(settings: Settings) -> None:
    _OWN[:] = [read_robot(settings.robot, _map(settings))]


def _in_process(job: Job, out: Path, settings: Settings) -> dict[str, Any]:
    return _one(job, out, settings, _OWN[0])


def _one(job: Job, out: Path, settings: Settings, robot: Robot) -> dict[str, Any]:
    """Make one clip; its line of the manifest."""
    line = {"name": job.name, **job.about}
    try:
        motion = io.load(job.source) if isinstance(job.source, Path) else job.source
        clip = put_on_robot(
            motion,
            robot,
            fps=settings.fps,
            max_speed=settings.max_speed,
            avoid_collisions=settings.avoid_collisions,
        )
        save_clip(clip, robot, out / f"{job.name}.{settings.format}")
    except MotionloomError as error:
        return {**line, "error": str(error)}
    figures = measure(clip, robot)
    return {**line, **figures.as_dict(), "faults": figures.faults()}
