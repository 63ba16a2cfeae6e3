"""A character's own clip, put on the uniform person and back onto the character: how far its mesh is from where it was.

Skinning is computed from the file alone (`gltf_skin`).
"""

from pathlib import Path

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.io.character import load_character
from motionloom.io.gltf import load_glb
from motionloom.retarget import joint_map, retarget, to_smpl22
from motionloom.retarget.axes import CHILD
from tests.io.gltf_skin import Scene

LIMBS = (1, 2, 4, 5, 16, 17, 18, 19)


def onto(path: Path, out: Path, *, clip: str | int | None = None) -> tuple[Motion, Path]:
    """A file's clip on the uniform person and back onto the file."""
    motion, character = load_glb(path, clip=clip), load_character(path)
    made = retarget(to_smpl22(motion), character.skeleton)
    return motion, character.save(made, out, name="ours")


def errors(before: Path, after: Path, clip: int, motion: Motion) -> dict[str, float]:
    """Percent of the height between vertices, and degrees of twist between limb bones, of the original and ours."""
    character, a, b = load_character(before), Scene(before), Scene(after)
    frames = np.unique(np.linspace(0, len(motion) - 1, 12).astype(int))
    theirs = a.json["animations"][clip]
    was = a.worlds(theirs, a.span(theirs)[0] + frames / motion.fps)
    now = b.worlds(b.clip("ours"), frames / motion.fps)
    parts, skeleton, nodes = joint_map(character.skeleton), character.skeleton, character.nodes
    drivers = parts.drivers(skeleton)
    found = {"twist": 0.0}
    for j in LIMBS:
        child = skeleton.index(parts.points[CHILD[j] or 0][0][0])
        k = drivers[j]
        assert k is not None
        bone = skeleton.rest_positions()[child] - skeleton.rest_positions()[k]
        axis = rot.rotate(rot.inverse(character.turns[k]), bone / np.linalg.norm(bone))
        found["twist"] = max(found["twist"], _twist(was[:, nodes[k]], now[:, nodes[k]], axis))
    skinned = [i for i, node in enumerate(a.nodes) if "skin" in node and "mesh" in node]
    if not skinned:
        return found
    rest = np.concatenate([v[0] for i, v in a.vertices(a.worlds(None, np.zeros(1))).items() if i in skinned])
    theirs_at, ours_at = a.vertices(was), b.vertices(now)
    apart = np.concatenate([np.linalg.norm(theirs_at[i] - ours_at[i], axis=-1) for i in skinned], axis=1)
    apart = 100 * apart / np.ptp(rest[:, 1])
    found["all"] = float(apart.mean())
    for part, joints in (("head", (15,)), ("hands", (20, 21)), ("feet", (7, 8))):
        below = {skeleton.index(name) for j in joints for name, _ in parts.points[j]}
        for k, p in enumerate(skeleton.parents):
            below |= {k} if p in below else set()
        weight = np.concatenate([a.weight_of(i, {nodes[k] for k in below}) for i in skinned])
        found[part] = float(apart[:, weight > 0.5].mean()) if (weight > 0.5).any() else 0.0
    return found


def _twist(was: np.ndarray, now: np.ndarray, axis: np.ndarray) -> float:
    """Degrees by which bones (frames, 4, 4) are turned about their own axis against each other, the largest."""
    a, b = (rot.matrix_to_quat(m[:, :3, :3] / np.linalg.norm(m[:, :3, :3], axis=1, keepdims=True)) for m in (was, now))
    along = [rot.rotate(q, np.broadcast_to(axis, (len(q), 3))) for q in (a, b)]
    swung = rot.multiply(rot.shortest_arc(*along), a)
    left = rot.multiply(rot.inverse(swung), b)
    angle = np.degrees(2 * np.arctan2((left[:, 1:] * axis).sum(-1), left[:, 0]))
    return float(np.abs((angle + 180) % 360 - 180).max())
