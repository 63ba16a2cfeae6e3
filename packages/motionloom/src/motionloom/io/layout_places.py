"""Arrays of joint places as prediction networks see them: recordings of Human3.6M, say, cut to a network's joints."""

from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import Layout
from motionloom.core.motion import Motion
from motionloom.io import npz
from motionloom.kinematics.layout_body import body_of_places, layout_skeleton

ARRAYS = ("positions", "positions_3d", "joints", "arr_0")
FARTHEST = 100.0
"""Metres beyond which numbers are no places of a person in metres."""


def is_places(path: Path) -> bool:
    """Whether a file holds bare places: an array, or an archive without rotations."""
    suffix = path.suffix.lower()
    if suffix == ".npz" and path.is_file():
        return "rotations" not in npz.read_arrays(path)
    return suffix == ".npy"


def read_places(path: Path, layout: Layout, fps: float) -> Motion:
    """A motion of a layout's joints out of places (frames, joints, 3), metres, in the axes of the network's data.

    Args:
        path: a .npy array, or a .npz archive with one of `ARRAYS` and, where it is known, ``fps``.
        layout: says the joints, and whether +Z is up in such files.
        fps: frames per second where the file does not say.

    Raises:
        MotionloomError: for other shapes, for places that are not finite or farther than people go, for a damaged file.
    """
    places = npz.read_array(path) if path.suffix.lower() == ".npy" else None
    if places is None:
        arrays = npz.read_arrays(path)
        places = next((arrays[name] for name in ARRAYS if name in arrays), np.empty(0))
        rate = arrays.get("fps", np.array(fps))
        fps = float(rate.reshape(-1)[0]) if rate.size == 1 and rate.dtype.kind in "fiu" else fps
    if places.dtype.kind != "f" or places.ndim != 3 or places.shape[1:] != (layout.joints, 3) or len(places) < 2:
        raise MotionloomError(
            f"{path} holds {places.dtype} of the shape {places.shape}; these weights go on from places (frames, "
            f"{layout.joints}, 3) in metres, of two frames or more, or from a motion file such as .bvh"
        )
    if not 1 <= fps <= 1000 or not (np.abs(places) <= FARTHEST).all():
        raise MotionloomError(
            f"{path} has a frame rate that cannot be, or places that are not finite or over {FARTHEST:g} away; give "
            "metres"
        )
    places = places.astype(np.float64)[..., [1, 2, 0]] if layout.z_up else places.astype(np.float64)
    return body_of_places(places, layout_skeleton(layout, places), fps)
