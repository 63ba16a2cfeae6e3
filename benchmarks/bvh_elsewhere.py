"""Where assimp and three.js put the joints of our BVH files, beside where they are.

python benchmarks/bvh_elsewhere.py FOLDER [--assimp LIBRARY.so] [--three NODE_FOLDER]

FOLDER holds characters and clips; a walk is put on each of them. LIBRARY.so is assimp's C library (Debian: libassimp5;
its structures come from `pip install pyassimp`, of the same version); NODE_FOLDER is where `npm install three` was run.
A line per file: the largest distance of a joint in metres, over all frames.
"""

import argparse
import ctypes
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks import set_threads
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.io.bvh import save_bvh
from motionloom.retarget import retarget
from motionloom.tasks.text import generate

_THREE = """
import fs from "fs"; import * as T from "three"; import {BVHLoader} from "three/examples/jsm/loaders/BVHLoader.js";
const found = process.argv.slice(1).map((file) => {
  const read = new BVHLoader().parse(fs.readFileSync(file, "utf8")), root = read.skeleton.bones[0], all = {};
  const group = new T.Group(); group.add(root);
  const mixer = new T.AnimationMixer(root), action = mixer.clipAction(read.clip);
  action.setLoop(T.LoopOnce); action.clampWhenFinished = true; action.play();
  for (const bone of read.skeleton.bones) if (bone.name !== "ENDSITE") all[bone.name] = [];
  for (const time of read.clip.tracks[0].times) {
    mixer.setTime(Math.min(time, read.clip.duration - 1e-6)); group.updateMatrixWorld(true);
    for (const bone of read.skeleton.bones) if (bone.name !== "ENDSITE")
      all[bone.name].push(new T.Vector3().setFromMatrixPosition(bone.matrixWorld).toArray());
  }
  return all;
});
console.log(JSON.stringify(found));
"""


def three(files: list[Path], folder: Path) -> list[dict[str, np.ndarray]]:
    """(frames, 3) world places of each joint, by name, for each file."""
    ended = subprocess.run(
        ["node", "--input-type=module", "-e", _THREE, *map(str, files)],
        cwd=folder,
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
    )
    if ended.returncode:
        sys.exit(f"three.js does not run: {ended.stderr.strip()[-500:]}")
    return [{k: np.array(v) for k, v in one.items()} for one in json.loads(ended.stdout)]


def assimp(files: list[Path], library: Path) -> list[dict[str, np.ndarray]]:
    """The same from assimp's animation channels, posed along its tree of nodes."""
    from pyassimp import structs  # pyright: ignore[reportMissingImports]

    dll = ctypes.CDLL(str(library))
    dll.aiImportFile.restype = ctypes.POINTER(structs.Scene)
    dll.aiImportFile.argtypes = (ctypes.c_char_p, ctypes.c_uint)
    dll.aiGetErrorString.restype = ctypes.c_char_p

    def one(file: Path) -> dict[str, np.ndarray]:
        scene = dll.aiImportFile(str(file).encode(), 0)
        if not scene:
            sys.exit(f"assimp does not read {file.name}: {dll.aiGetErrorString().decode()}")
        clip = scene.contents.mAnimations[0].contents
        channels = [clip.mChannels[i].contents for i in range(clip.mNumChannels)]
        by_name = {channel.mNodeName.data.decode(): channel for channel in channels}
        frames = max(max(c.mNumPositionKeys, c.mNumRotationKeys) for c in channels)
        found: dict[str, np.ndarray] = {}

        def visit(node: "structs.Node", above: np.ndarray) -> None:
            name = node.mName.data.decode()
            m = node.mTransformation
            local = np.array([[getattr(m, f"{row}{i}") for i in range(1, 5)] for row in "abcd"])
            local = np.tile(local, (frames, 1, 1))
            if name in by_name:
                keys = by_name[name]
                for f in range(frames):
                    p = keys.mPositionKeys[min(f, keys.mNumPositionKeys - 1)].mValue
                    q = keys.mRotationKeys[min(f, keys.mNumRotationKeys - 1)].mValue
                    local[f, :3, :3] = rot.quat_to_matrix(np.array([q.w, q.x, q.y, q.z]))
                    local[f, :3, 3] = p.x, p.y, p.z
            world = above @ local
            found[name] = world[:, :3, 3]
            for i in range(node.mNumChildren):
                visit(node.mChildren[i].contents, world)

        visit(scene.contents.mRootNode.contents, np.tile(np.eye(4), (frames, 1, 1)))
        return found

    return [one(file) for file in files]


def walk() -> Motion:
    """Two seconds of the shipped prior."""
    set_threads(1)
    return generate(Prior.load("default"), "a person walks forward and waves", seconds=2.0, seed=1)[0]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--assimp", type=Path)
    parser.add_argument("--three", type=Path)
    arguments = parser.parse_args()
    motion, made, truth = walk(), [], []
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for path in sorted(arguments.folder.iterdir()):
            try:
                worn = retarget(motion, load(path).skeleton)
            except MotionloomError as error:
                print(f"{path.name:24} {str(error).replace(str(path), path.name)[:90]}")
                continue
            made.append(save_bvh(worn, Path(name) / f"{path.stem}.bvh"))
            truth.append(worn)
        readers = [("assimp", assimp, arguments.assimp), ("three.js", three, arguments.three)]
        found = {label: read(made, where.resolve()) for label, read, where in readers if where}
    for at, (file, worn) in enumerate(zip(made, truth)):
        places = worn.positions()
        far = []
        for label, read in found.items():
            theirs = read[at]
            above = {worn.skeleton.names[p] for p in worn.skeleton.parents if p >= 0}  # the others are End Sites
            missing = [j for j in worn.skeleton.names if j not in theirs and j in above]
            joints = [j for j, n in enumerate(worn.skeleton.names) if n in theirs]
            worst = max(np.linalg.norm(theirs[worn.skeleton.names[j]] - places[:, j], axis=-1).max() for j in joints)
            far.append(f"{label} {worst:.6f} m" + (f" ({len(missing)} joints not found)" if missing else ""))
        print(f"{file.name:24} {', '.join(far)}")


if __name__ == "__main__":
    main()
