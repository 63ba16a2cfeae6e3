"""What the commands that read motion files share: options, reading, cutting, notes."""

from argparse import Namespace
from pathlib import Path

from motionloom import io
from motionloom.cli.terminal import note
from motionloom.cli.writing import fail
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.formats import with_clips
from motionloom.io.bvh import read_bvh
from motionloom.retarget.anatomy import HUMAN_LEGS, read_body
from motionloom.retarget.upright import set_upright

RATE_ASSUMED = "an AMC file does not state its rate; 120 frames per second are assumed (--source-fps says otherwise)"


def read_clip(arguments: Namespace, path: Path) -> tuple[Motion, float | None, dict[str, str]]:
    """The motion and, of a BVH, the unit of its file and the orders of its rotations."""
    from motionloom.cli.robots import read_motion, reads_as_clip

    if reads_as_clip(arguments, path):
        return read_motion(arguments, path), None, {}
    if arguments.animation is not None and path.suffix.lower() not in with_clips():
        fail(
            f"--clip picks one of several animations of a {', '.join(with_clips())}, and {path} is none; leave it out "
            "(--clip-name names the one that is written)"
        )
    unit, orders, up = None, {}, arguments.up
    if path.suffix.lower() == ".bvh" and not path.is_dir() and arguments.asf is None:
        file = read_bvh(path, fps=arguments.source_fps, unit=arguments.unit)
        source_map = getattr(arguments, "source_map", None)
        motion, unit, orders = set_upright(file.motion, path, up, override=source_map), file.unit, dict(file.orders)
    else:
        options = {"fps": arguments.source_fps, "asf": arguments.asf, "unit": arguments.unit, "up": up}
        motion = io.load(path, clip=arguments.animation, **options)
    return motion, unit, orders


def load_motion(arguments: Namespace, path: Path) -> Motion:
    """A motion whose file needs no options; a robot's joint angles with the robot of the line."""
    from motionloom.cli.robots import read_motion, reads_as_clip

    return read_motion(arguments, path) if reads_as_clip(arguments, path) else io.load(path)


def legs_of(skeleton: Skeleton) -> float | None:
    """Metres of thigh and shin; None for what is no person, of which no length is known."""
    try:
        return read_body(skeleton).leg
    except MotionloomError:
        return None


def check_size(arguments: Namespace, path: Path, motion: Motion) -> None:
    """Refuse bones of no human length without a unit; a file of our own (.npz) or with a unit is believed."""
    if arguments.unit is not None or path.suffix.lower() in (".npz", ".csv", ".amc"):
        return
    leg = legs_of(motion.skeleton)
    low, high = HUMAN_LEGS if path.suffix.lower() == ".bvh" else (0.2, 3.0)  # characters are dwarfs and giants
    if leg is not None and not low <= leg <= high:
        fail(
            f"the legs of the person in {path} would be {leg:.3g} m long; say which unit the file is in with --unit "
            "(m, dm, cm, mm, inch, or metres; --unit m takes it as it is)"
        )


def crop(motion: Motion, arguments: Namespace) -> Motion:
    """The part between ``--start`` and ``--end``."""
    if arguments.start is None and arguments.end is None:
        return motion
    return motion.crop(arguments.start or 0.0, motion.seconds if arguments.end is None else arguments.end)


def rate_assumed(arguments: Namespace, paths: list[Path]) -> bool:
    """Whether a file's rate was neither in it nor given."""
    return arguments.source_fps is None and any(path.suffix.lower() == ".amc" for path in paths)


def note_rate(arguments: Namespace, paths: list[Path]) -> None:
    """Note a rate that is assumed."""
    if rate_assumed(arguments, paths):
        note(RATE_ASSUMED)
