"""Joint angles in files: CSV as data sets of the G1 have it, NPZ as MuJoCo speaks; and back.

A row of a CSV is a frame: root place (3), root quaternion x, y, z, w, then the hinges in the model's order, in metres
and radians. It states no rate. An NPZ has ``qpos`` and ``qvel`` in MuJoCo's order (quaternion w, x, y, z), ``fps``,
``joint_names``, ``contacts`` (frames, 2, 2: heel and toes of the left and right foot), ``robot`` and ``version``.
"""

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.reading import read_bytes
from motionloom.io.npz import read_arrays
from motionloom.robots.body import Robot, read_robot, to_motion
from motionloom.robots.clip import FPS, Clip, velocities
from motionloom.robots.figures import planted_soles

Array = NDArray[np.float64]
WRITES = (".csv", ".npz")
VERSION = 1
MAX_BYTES = 500_000_000
MAX_FRAMES = 1_000_000
_ROOT = ("root_x", "root_y", "root_z", "root_qx", "root_qy", "root_qz", "root_qw")
_TO_XYZW, _TO_WXYZ = [0, 1, 2, 4, 5, 6, 3], [0, 1, 2, 6, 3, 4, 5]


def save_clip(clip: Clip, robot: Robot, path: Path | str, *, header: bool = True) -> Path:
    """Write a clip as .csv or .npz; ``header``: whether a CSV's first line names its columns."""
    path = Path(path)
    if path.suffix.lower() not in WRITES:
        raise MotionloomError(f"joint angles are written as {' or '.join(WRITES)}; got {path}")
    with atomic_path(path) as temporary:
        if path.suffix.lower() == ".csv":
            temporary.write_text(_as_csv(clip, robot, header=header), encoding="utf-8")
            return path
        with temporary.open("wb") as file:
            np.savez_compressed(
                file,
                version=np.array(VERSION),
                robot=np.array(robot.name),
                fps=np.array(float(clip.fps)),
                joint_names=np.array(robot.file.joint_names()),
                qpos=clip.qpos,
                qvel=velocities(robot, clip),
                contacts=clip.planted,
            )
    return path


def _as_csv(clip: Clip, robot: Robot, *, header: bool) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    if header:
        rows.writerow([*_ROOT, *robot.file.joint_names()])
    values = np.concatenate([clip.qpos[:, _TO_XYZW], clip.qpos[:, 7:]], axis=1)
    rows.writerows([f"{value:.6f}" for value in row] for row in values)
    return text.getvalue()


def is_clip(path: Path) -> bool:
    """Whether a file holds a robot's joint angles: a CSV, or an NPZ with ``qpos``."""
    if path.suffix.lower() != ".npz":
        return path.suffix.lower() == ".csv"
    return "qpos" in read_arrays(path, only=("qpos",)) if path.is_file() else False


def load_motion(path: Path | str, robot: Robot | Path | str, *, fps: float | None = None) -> Motion:
    """Read a CSV or an NPZ of a robot's joint angles as motion of its skeleton, in metres, +Y up.

    robot: its model's file, or as it was read. fps, errors: as of `load_clip`, and of `read_robot` for a model's file.
    """
    known = robot if isinstance(robot, Robot) else read_robot(robot)
    clip = load_clip(path, known, fps=fps)
    return to_motion(known, clip.qpos, clip.fps)


def load_clip(path: Path | str, robot: Robot, *, fps: float | None = None) -> Clip:
    """Read a CSV or an NPZ of a robot's joint angles.

    ``fps`` is the rate of the file (None: what an NPZ states; 50 for a CSV, which states none). Where a file says
    nothing of contacts, they are read off the soles.
    Raises `MotionloomError` for a damaged file, one of another robot, or numbers that cannot be.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        poses, rate, contacts = _read_csv(path, robot), None, None
    else:
        poses, rate, contacts = _read_npz(path, robot)
    if not len(poses) or len(poses) > MAX_FRAMES:
        raise MotionloomError(f"{path} has {len(poses)} frames; 1 to {MAX_FRAMES:,} are read")
    if not np.isfinite(poses).all() or np.abs(poses).max() > 1e6:
        raise MotionloomError(f"{path} has numbers that are not finite or beyond all bounds")
    length = np.linalg.norm(poses[:, 3:7], axis=1, keepdims=True)
    if (np.abs(length - 1) > 0.05).any():
        raise MotionloomError(
            f"{path}: the numbers 4 to 7 of a row are to be the root's quaternion, and that of row "
            f"{int(np.abs(length - 1).argmax()) + 1} has the length {float(length[np.abs(length - 1).argmax(), 0]):.2f}"
        )
    poses[:, 3:7] /= length
    rate = fps or rate or FPS
    if not 1 <= rate <= 10_000:
        raise MotionloomError(f"{path} is said to have {rate:g} frames per second; give the true rate (--source-fps)")
    return Clip(rate, poses, planted_soles(robot, poses, rate) if contacts is None else contacts)


def _read_csv(path: Path, robot: Robot) -> Array:
    names, columns = robot.file.joint_names(), 7 + len(robot.file.hinges)
    try:
        text = read_bytes(path, max_bytes=MAX_BYTES).decode("utf-8-sig")
        lines = list(csv.reader(io.StringIO(text)))
    except (UnicodeDecodeError, csv.Error) as error:
        raise MotionloomError(f"{path} cannot be read as a CSV: {error}") from None
    lines = [line for line in lines if line]
    first = lines[0]
    if len(first) != columns:
        raise MotionloomError(
            f"{path} has {len(first)} columns and {robot.name} needs {columns}: place (3), quaternion x, y, z, w, and "
            f"{len(names)} joints"
        )
    if not _is_number(first[0]):
        header = [word.strip() for word in first[7:]]
        if set(header) == set(names) and tuple(header) != names:
            raise MotionloomError(f"{path} has the joints of {robot.name} in another order; put {names[0]} first")
        if tuple(header) != names:
            other = next((word for word in header if word not in names), "one joint twice")
            raise MotionloomError(f"{path} is not of {robot.name}: among its joints is {other[:60]!r}")
        lines = lines[1:]
    try:
        values = np.array(lines, dtype=np.float64).reshape(-1, columns)
    except ValueError:
        wrong = next((i for i, line in enumerate(lines) if len(line) != columns or not all(map(_is_number, line))), 0)
        raise MotionloomError(f"{path}: data row {wrong + 1} is not {columns} numbers") from None
    return np.concatenate([values[:, _TO_WXYZ], values[:, 7:]], axis=1)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _read_npz(path: Path, robot: Robot) -> tuple[Array, float | None, NDArray[np.bool_] | None]:
    arrays = read_arrays(path, max_bytes=MAX_BYTES, only=("qpos", "fps", "joint_names", "contacts"))
    if "qpos" not in arrays:
        raise MotionloomError(f"{path} has no 'qpos'; it holds no joint angles of a robot")
    poses, columns = arrays["qpos"], 7 + len(robot.file.hinges)
    if poses.ndim != 2 or poses.shape[1] != columns or poses.dtype.kind not in "fiu":
        raise MotionloomError(
            f"{path} has qpos of shape {poses.shape} and {robot.name} needs (frames, {columns}): 7 numbers of the root "
            f"and {len(robot.file.hinges)} joints"
        )
    named = arrays.get("joint_names")
    if named is not None and tuple(np.atleast_1d(named).reshape(-1).tolist()) != robot.file.joint_names():
        raise MotionloomError(f"{path} is of a robot with other joints than {robot.name}; give its own model")
    rate = arrays.get("fps")
    contacts = arrays.get("contacts")
    stated = rate is not None and rate.shape == () and rate.dtype.kind in "fiu"
    whole = contacts is not None and contacts.shape == (len(poses), 2, 2)
    planted = contacts.astype(bool) if contacts is not None and whole else None
    return poses.astype(np.float64), float(rate) if rate is not None and stated else None, planted
