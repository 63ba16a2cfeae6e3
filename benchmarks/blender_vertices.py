"""How far the skinned vertices that Blender shows are from those of the glTF specification, for a folder's characters.

MOTIONLOOM_BLENDER_PYTHON=PYTHON python benchmarks/blender_vertices.py FOLDER [--out FILE]     # such as ../shared/rigs

A walk with waving limbs is written into each character's file; vertices of three frames are compared, and the joints of
the same motion as BVH. Distances are the largest, in millimetres.
"""

import argparse
import shutil
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "packages/motionloom"))

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import save
from motionloom.io.character import Character, load_character
from motionloom.retarget import retarget
from tests.io.in_blender import Job, Shown, apart, python_with_bpy, shown
from tests.io.rigged import wave

FRAMES = (0, 17, 39)
FPS = 30.0
SUFFIXES = (".glb", ".vrm")


def waving_walk() -> Motion:
    """Somebody who goes ahead and waves with everything."""
    way = np.arange(40)[:, None] * [0.002, 0.0, 0.02]
    return Motion(SMPL22, FPS, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave()))


def prepared(path: Path, folder: Path) -> tuple[Character, Motion, Path]:
    """A character, the walk on its skeleton, and its own file with the walk in it, ending as .glb."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        character = load_character(path)
        made = retarget(waving_walk(), character.skeleton)
        out = character.save(made, folder / path.name, name="ours")
    return character, made, out.rename(folder / f"{path.stem}_ours.glb")


def measured(paths: list[Path], folder: Path) -> list[str]:
    """A line for each file."""
    ready, lines = [], []
    for path in paths:
        try:
            ready.append((path, *prepared(path, folder)))
        except MotionloomError as error:
            lines.append(f"{path.name:24} {str(error).replace(str(path), path.name)[:110]}")
    jobs = []
    for path, _, made, out in ready:
        bvh = save(made, folder / f"{path.stem}.bvh")
        jobs += [Job(out, FRAMES, FPS, "ours"), Job(bvh, tuple(f + 1 for f in FRAMES), FPS)]
    seen = shown(jobs)
    for (path, _, made, out), of_glb, of_bvh in zip(ready, seen[::2], seen[1::2]):
        lines.append(f"{path.name:24} {in_mesh(out, of_glb):34} {in_bvh(made, of_bvh)}")
    return sorted(lines)


def in_mesh(out: Path, seen: Shown) -> str:
    """Cells of a glTF file."""
    if seen.error:
        return "Blender: " + " ".join(seen.error.split())[:80]
    if not seen.meshes:
        return "no mesh"
    largest, count = apart(out, "ours", FRAMES, FPS, seen)
    return f"{1000 * largest:9.4f} mm of {count} vertices" if count else "no mesh"


def in_bvh(motion: Motion, seen: Shown) -> str:
    """Cells of a BVH."""
    if seen.error:
        return "Blender: " + " ".join(seen.error.split())[:80]
    places = motion.positions()[list(FRAMES)]
    far = [
        np.linalg.norm(seen.bones[name] - places[:, j], axis=-1).max()
        for j, name in enumerate(motion.skeleton.names)
        if name in seen.bones
    ]
    return f"{1000 * max(far):9.4f} mm of {len(far)} joints"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    if python_with_bpy() is None:
        sys.exit("there is no bpy; name a Python that has it in MOTIONLOOM_BLENDER_PYTHON")
    folder = Path(tempfile.mkdtemp())
    try:
        lines = measured(sorted(p for p in arguments.folder.iterdir() if p.suffix in SUFFIXES), folder)
    finally:
        shutil.rmtree(folder)
    print("\n".join(lines))
    if arguments.out:
        arguments.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
