"""3DPW sequence files as their owners distribute them: the sequences with two people, as pairs.

von Marcard et al., Recovering Accurate 3D Human Pose in the Wild, ECCV 2018. A sequence is a Python 2 pickle of lists
and numpy arrays at 30 frames per second, read by `lab.papers.plain_pickle`, which runs nothing of it. The published
data of ComMDM (Shafir et al., 2023) was computed from these files by code that is not released; this is ours:

* *Upright.* The axis along which heads are over ankles becomes +Y.
* *Drift.* According to the paper the root "is often drifting which was partially fixable by reducing the drift of the
  camera from the drift of the root". The camera's path on the ground (smoothed over a second) is subtracted from both
  people alike, times the share of it that their planted feet go along with (least squares, 0 to 1). So a camera that
  follows two walkers takes nothing away, and the distance between the two never changes.
* *HumanML3D.* Each person's floor to y = 0 by planted feet, uniform bones, 20 frames per second; one common scale on
  the ground (`data.pairs`).

`read_processed` reads the published data themselves, where somebody has them.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.features.pair import PlaceCode, decode
from motionloom.core.files.atomic import finished
from motionloom.core.files.text import read_utf8
from motionloom.io import npz
from motionloom.kinematics.physics import ANKLES, TOES, Array, J, smooth, velocity
from motionloom.kinematics.shared_world import checked, one_world
from motionloom.retarget.floor import level
from motionloom_lab.papers.plain_pickle import read_plain_file
from motionloom_train.data.pairs import Pair
from motionloom_train.data.progress import Say, silent

LICENCE = (
    "3DPW: non-commercial scientific research only, under the licence of its owners (virtualhumans.mpi-inf.mpg.de)"
)
RATE = 30.0
"""Frames per second of the image-aligned poses."""
SPLITS = {"train": "train", "validation": "val", "test": "test"}
MAX_BYTES = 512 << 20
FIRST, SECOND = "_p0", "_p1"
"""Ends of the names of the two people's files in ComMDM's processed data."""
_PLANTED_SPEED, _PLANTED_HEIGHT = 0.4, 0.06


def is_3dpw(folder: Path) -> bool:
    """Whether ``folder`` (or its ``sequenceFiles``) has sequences in train, validation or test."""
    return any(finished(_root(folder) / split, "*.pkl") for split in SPLITS)


def read_3dpw(
    folder: Path | str,
    *,
    texts: Path | str | None = None,
    splits: Sequence[str] = ("train", "validation"),
    say: Say = silent,
) -> list[Pair]:
    """The sequences with two people.

    Args:
        folder: What the archive ``sequenceFiles.zip`` unpacks to.
        texts: The folder ``text`` of ComMDM's published data, with ``train/NAME.txt`` (or ``NAME_p0.txt``), a caption
            on each line, words after a # ignored; None: ``folder/text`` where it is there. No text, no captions.
        splits: Of train, validation and test. The published work leaves test out as noisy and without interaction.
        say: Called with what is left out and why.

    Raises:
        MotionloomError: No such files, a damaged or foreign one (named), or none with two people.
    """
    folder = Path(folder)
    unknown = sorted(set(splits) - set(SPLITS))
    if unknown:
        raise MotionloomError(f"3DPW has no split {unknown[0]!r}; it has {', '.join(SPLITS)}")
    if not is_3dpw(folder):
        raise MotionloomError(f"{folder} has no sequenceFiles/train/*.pkl; name the folder that 3DPW unpacks to")
    spoken = folder / "text" if texts is None else Path(texts)
    pairs = []
    for split in splits:
        for path in finished(_root(folder) / split, "*.pkl"):
            sequence = read_sequence(path)
            if len(sequence) != 2:
                say(f"left out {path.name}: {len(sequence)} person")
                continue
            captions = _captions(spoken / split, path.stem)
            pairs.append(Pair(path.stem, SPLITS[split], captions, "3dpw", LICENCE, as_pair(sequence, name=str(path))))
    if not pairs:
        raise MotionloomError(f"{folder} has no sequence with two people in {', '.join(splits)}")
    return pairs


def is_processed(folder: Path) -> bool:
    """Whether ``folder`` is ComMDM's processed 3DPW: ``new_joint_vecs/SPLIT/NAME_p0.npy`` and so on."""
    return any(finished(folder / "new_joint_vecs" / split, f"*{FIRST}.npy") for split in SPLITS)


def read_processed(
    folder: Path | str, *, splits: Sequence[str] = ("train", "validation"), say: Say = silent
) -> list[Pair]:
    """The pairs of ComMDM's processed 3DPW (Shafir et al. 2023).

    ``new_joint_vecs/SPLIT/NAME_p0.npy`` and ``NAME_p1.npy`` are HumanML3D features (frames, 263) of both people;
    ``canon_data/SPLIT`` has under the same names nine numbers that say where each is at frame 0 (two rows of the
    rotation from the world to the person, a translation); ``text/SPLIT/NAME_p0.txt`` or ``NAME.txt`` has captions. The
    mirrored copies (``NAME_p0_M.npy``), which keep the words left and right, are left out: pairs are mirrored in
    training. The second person is placed by the whole ground pose of the first, and not as published with a
    translation that is not turned.

    Args:
        folder: ``dataset/3dpw`` of the published layout.
        splits: of train, validation and test.
        say: called with what is left out and why.

    Raises:
        MotionloomError: no such files, one of another form (named), a person or a place that is missing.
    """
    folder, pairs = Path(folder), []
    for split in splits:
        for path in finished(folder / "new_joint_vecs" / split, f"*{FIRST}.npy"):
            name = path.name.removesuffix(f"{FIRST}.npy")
            captions = _captions(folder / "text" / split, name)
            if not captions:
                say(f"{split}/{name} has no captions")
            pairs.append(Pair(name, SPLITS[split], captions, "3dpw", LICENCE, _processed_pair(folder, split, name)))
    if not pairs:
        raise MotionloomError(f"{folder} has no new_joint_vecs/SPLIT/NAME{FIRST}.npy for {', '.join(splits)}")
    return pairs


def _processed_pair(folder: Path, split: str, name: str) -> Array:
    """(2, frames, 22, 3) metres at 20 frames per second."""
    features, places = [], []
    for end in (FIRST, SECOND):
        path, place = (folder / part / split / f"{name}{end}.npy" for part in ("new_joint_vecs", "canon_data"))
        features.append(_whole_array(path))
        places.append(_whole_array(place).reshape(-1))
        if features[-1].ndim != 2 or features[-1].shape[1] != WIDTH or len(features[-1]) < 2:
            raise MotionloomError(
                f"{path} has the shape {features[-1].shape}; HumanML3D features are (frames, {WIDTH})"
            )
        if places[-1].shape != (9,):
            raise MotionloomError(f"{place} has {places[-1].size} numbers; where somebody is at frame 0 are nine")
    if len(features[0]) != len(features[1]):
        raise MotionloomError(
            f"{folder}: {name} has {len(features[0])} frames of one and {len(features[1])} of another"
        )
    poses = PlaceCode("world").decode(np.stack(places)[:, [0, 2, 6, 8]])
    return checked(decode(np.stack(features), poses), FPS, name=f"{folder}: {name}")


def _whole_array(path: Path) -> Array:
    array = npz.read_array(path)
    if array.dtype.kind not in "fiu" or not np.isfinite(array).all() or not (np.abs(array) < 1e4).all():
        raise MotionloomError(f"{path} holds no finite numbers of a person's motion")
    return array.astype(np.float64)


def as_pair(people: np.ndarray, *, name: str) -> Array:
    """(2, frames, 22, 3) metres at 30 frames per second, upright, to the same of a `Pair`."""
    people = np.stack([level(_lowered(person), RATE) for person in people])
    legs = [float(np.linalg.norm(person[0, [5, 8]] - person[0, [2, 5]], axis=-1).sum()) for person in people]
    return checked(one_world([hml.uniform(person) for person in people], legs), RATE, name=name)


def _lowered(person: np.ndarray) -> Array:
    """(frames, 22, 3) with the lowest toes near y = 0: the height of the world's origin means nothing, and `level`
    takes people far above it for climbers."""
    return person - float(np.percentile(person[:, TOES, 1].min(axis=1), 5)) * np.array([0.0, 1.0, 0.0])


def read_sequence(path: Path | str) -> Array:
    """(people, frames, 22, 3) metres, +Y up, 30 frames per second: the people of one file, drift reduced."""
    path = Path(path)
    content = read_plain_file(path, limit=MAX_BYTES)
    if not isinstance(content, dict) or not isinstance(content.get("jointPositions"), list):
        raise MotionloomError(f"{path} is no 3DPW sequence: it has no jointPositions")
    people = [_numbers(joints, (72,), path) for joints in content["jointPositions"]]
    if not 1 <= len(people) <= 8 or len({len(person) for person in people}) != 1 or len(people[0]) < 2:
        raise MotionloomError(f"{path} is no 3DPW sequence: its people have no common number of frames")
    positions = np.stack(people).reshape(len(people), -1, 24, 3)[:, :, :22]
    camera = _camera(content, positions.shape[1], path)
    turn = _upright(positions, path)
    positions = rot.rotate(turn, positions)
    return positions if camera is None else without_drift(positions, rot.rotate(turn, camera))


def without_drift(positions: np.ndarray, camera: np.ndarray) -> Array:
    """(people, frames, 22, 3) less what planted feet share with the camera's path (frames, 3), all metres, +Y up."""
    ground = np.array([1.0, 0.0, 1.0])
    path = smooth(camera * ground, 2 * round(RATE / 2) + 1)
    camera_speed = velocity(path, RATE)
    together = square = 0.0
    for person in positions:
        toes = person[:, TOES]
        speed = velocity(toes, RATE) * ground
        low = toes[..., 1] < np.percentile(toes[..., 1].min(axis=1), 5) + _PLANTED_HEIGHT
        planted = low & (np.linalg.norm(speed, axis=-1) < _PLANTED_SPEED)
        together += float((speed * camera_speed[:, None]).sum(-1)[planted].sum())
        square += float(np.broadcast_to((camera_speed**2).sum(-1)[:, None], planted.shape)[planted].sum())
    share = float(np.clip(together / square, 0.0, 1.0)) if square > 0 else 0.0
    return positions - share * (path - path[0])[None, :, None]


def _root(folder: Path) -> Path:
    return folder / "sequenceFiles" if (folder / "sequenceFiles").is_dir() else folder


def _numbers(values: object, shape: tuple[int, ...], path: Path) -> Array:
    if isinstance(values, np.ndarray) and values.dtype.kind in "fiu" and values.shape[1:] == shape:
        numbers = values.astype(np.float64)
        if np.isfinite(numbers).all():
            return numbers
    raise MotionloomError(f"{path} is no 3DPW sequence: an array does not hold finite numbers of {shape} per frame")


def _camera(content: dict, frames: int, path: Path) -> Array | None:
    """(frames, 3) where the camera is, from extrinsics that take the world to the camera; between valid frames linear.

    None without camera poses, or where none was aligned to the image.
    """
    if "cam_poses" not in content:
        return None
    poses = _numbers(content["cam_poses"], (4, 4), path)
    valid = content.get("campose_valid", [])
    try:
        flags = [np.asarray(one) for one in (valid if isinstance(valid, list) else [valid])]
    except ValueError:  # lists of several lengths
        flags = [np.empty(0)]
    if len(poses) != frames or any(flag.shape != (frames,) or flag.dtype.kind not in "biuf" for flag in flags):
        raise MotionloomError(f"{path} is no 3DPW sequence: its camera has not one pose for each of {frames} frames")
    places = -np.einsum("fji,fj->fi", poses[:, :3, :3], poses[:, :3, 3])
    good = np.flatnonzero(np.all([flag.astype(bool) for flag in flags], axis=0)) if flags else np.arange(frames)
    if len(good) < 2:
        return None
    return np.stack([np.interp(np.arange(frames), good, places[good, k]) for k in range(3)], axis=-1)


def _upright(positions: np.ndarray, path: Path) -> Array:
    """The quaternion that makes the axis along which people stand +Y."""
    tall = (positions[:, :, J["head"]] - positions[:, :, list(ANKLES)].mean(axis=2)).mean(axis=(0, 1))
    axis = int(np.argmax(np.abs(tall)))
    if abs(tall[axis]) < 0.7 * np.linalg.norm(tall) or abs(tall[axis]) < 0.3:
        raise MotionloomError(f"{path}: nobody stands along an axis of its world, so that up is unknown")
    return rot.shortest_arc(np.sign(tall[axis]) * np.eye(3)[axis], np.eye(3)[1])


def _captions(folder: Path, name: str) -> tuple[str, ...]:
    path = next((p for p in (folder / f"{name}.txt", folder / f"{name}_p0.txt") if p.is_file()), None)
    if path is None:
        return ()
    try:
        lines = read_utf8(path, max_bytes=1 << 16, empty=True).splitlines()
    except MotionloomError as error:
        reason = str(error)[:200]
        raise MotionloomError(f"{path} holds no captions ({reason}); it has one on each line") from None
    texts = (" ".join(line.partition("#")[0].split()) for line in lines)
    return tuple(text for text in texts if text and text.isprintable())
