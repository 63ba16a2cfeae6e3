"""FBX files, by way of the GLB that Blender makes of them (`blender`)."""

import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.io.blender import fbx_to_glb, glb_to_fbx
from motionloom.io.character import Character, load_character
from motionloom.io.gltf import load_glb, save_glb
from motionloom.retarget.joint_map import Override


def load_fbx(path: Path, *, clip: int | str | None = None) -> Motion:
    """Read one animation of an FBX, chosen as in `load_glb`.

    Raises `MotionloomError` as that does, and where there is no Blender or it cannot read the file.
    """
    with _glb_of(path) as glb:
        return load_glb(glb, clip=clip)


def load_fbx_character(path: Path, *, joint_map: Override | None = None) -> Character:
    """Read the humanoid of an FBX; errors as of `load_fbx`."""
    with _glb_of(path) as glb:
        return load_character(glb, joint_map=joint_map)


@contextmanager
def _glb_of(path: Path) -> Iterator[Path]:
    """The GLB that Blender makes of an FBX; errors and warnings of the block name the FBX."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as remarks:
        warnings.simplefilter("always")
        glb = fbx_to_glb(path, Path(folder))
        try:
            yield glb
        except MotionloomError as error:
            raise MotionloomError(str(error).replace(str(glb), str(path))) from None
    for one in remarks:
        if issubclass(one.category, UserWarning):
            warnings.warn(str(one.message).replace(str(glb), str(path)), stacklevel=4)


def save_fbx(motions: Sequence[Motion], path: Path, *, names: Sequence[str] | None = None) -> Path:
    """Write people with simple bodies as FBX, keyed at the first one's rate.

    Raises `MotionloomError` as `save_glb` does, and where there is no Blender or it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        glb = save_glb(motions, Path(folder) / "motion.glb", names=names)
        return glb_to_fbx(glb, path, fps=motions[0].fps)
