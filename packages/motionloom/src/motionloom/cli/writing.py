"""What the commands that write motions share about their files: unit, frame rate, what is there already."""

from argparse import Namespace
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from motionloom.cli.terminal import note
from motionloom.core.errors import MotionloomError

if TYPE_CHECKING:
    from motionloom.core.motion import Motion


def fail(message: str) -> NoReturn:
    """Raise a `MotionloomError`."""
    raise MotionloomError(message)


def check_rate(arguments: Namespace) -> None:
    """Refuse a ``--fps`` that cannot be."""
    if arguments.fps is not None and not 1 <= arguments.fps <= 1000:
        raise MotionloomError(f"--fps must be 1 to 1000; got {arguments.fps:g}")


def check_unit(arguments: Namespace, files: Sequence[Path]) -> None:
    """Refuse an ``--out-unit`` where no BVH is written: the other formats state their unit."""
    if arguments.out_unit is not None and not any(file.suffix.lower() == ".bvh" for file in files):
        raise MotionloomError(f"--out-unit is for BVH files; {', '.join(map(str, files[:3]))} is none")


def at_rate(motions: "Iterable[Motion]", fps: float | None) -> "list[Motion]":
    """Motions at the rate of the line; as they are without one."""
    return [motion if fps is None else motion.resample(fps) for motion in motions]


def check_overwriting(arguments: Namespace, files: Iterable[Path], *, also: Iterable[Path] = ()) -> None:
    """Refuse to write over what is read; note where another file is written over without ``--force``.

    ``also`` are files that are read and not on the line. Raises `MotionloomError` naming the file that is both.
    """
    read = {path.resolve() for path in (*_inputs(arguments), *also)}
    for file in files:
        if not file.exists() or file.is_dir():
            continue
        if file.resolve() in read:
            raise MotionloomError(f"{file} is read and would be written over; give what is made another name")
        if not arguments.force:
            note(f"{file} was there and is written over (--force says nothing)")


def _inputs(arguments: Namespace) -> list[Path]:
    """The files that the line names to be read."""
    values: list[Any] = []
    for name, value in vars(arguments).items():
        if name == "skeleton" and isinstance(value, str):
            values.append(Path(value))
        elif name not in ("out", "output", "json", "blender"):
            values += value if isinstance(value, list | tuple) else [value]
    return [value for value in values if isinstance(value, Path)]
