"""Somebody's own character: a humanoid in a .glb, .vrm or .gltf file, and that file with one more animation in it.

Everything that the file holds stays as it is: what is new is one animation, its accessors, its buffer view and its
bytes behind those that were there.
"""

import base64
import copy
import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.files.text import unique_names
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion
from motionloom.io.glb import Document, add_channel, entry_of, new_animation, pack_glb
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.io.gltf_nodes import upwards
from motionloom.io.gltf_read import read_rigs
from motionloom.io.gltf_rig import Rig, on_floor, parents_first, worlds
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.joint_map import JointMap, Override
from motionloom.retarget.joint_map import joint_map as find_joints
from motionloom.retarget.stand import stand

Array = NDArray[np.float64]
_SAME_TURN = 1e-7
"""One minus the cosine of half a turn below which a bone counts as resting."""


@dataclass(frozen=True, eq=False)
class Character(Rig):
    """A humanoid in a glTF file; motions that are written into the file are on its skeleton."""

    path: Path
    joints: JointMap
    suffixes: tuple[str, ...]
    """How the character's own file may end; a .vrm is a .glb of a special kind."""

    @property
    def stand(self) -> GroundPose:
        """Where the character stands and faces; without a mesh, whose nodes may be in the middle of a walk, where what
        is above its skeleton stands."""
        pose = stand(read_body(self.skeleton, self.joints.names()))
        if self.file.document.items("skins"):
            return pose
        above = upwards(self.nodes[0], self.file.parents)[:0:-1]
        x, _, z = worlds(self.file, above, {}).places[above[-1]][0] if above else np.zeros(3)
        return GroundPose(float(x), float(z), pose.facing)

    def save(self, motion: Motion, path: str | Path, *, name: str | None = None, replace: bool = False) -> Path:
        """Write the character's own file with one more animation: `save_clips` of one."""
        return self.save_clips([(motion, name)], path, replace=replace)

    def save_clips(
        self, clips: Sequence[tuple[Motion, str | None]], path: str | Path, *, replace: bool = False
    ) -> Path:
        """Write the character's own file with these animations behind its own, or with ``replace`` these only.

        Motions are on `skeleton`, in metres and +Y up. Keyed are the joints of its body and those between them, and
        places of those that move against what they hang on; all others keep their rest, those that another animation
        in the file moves by one key of it. A name (``motion`` for None) gets a number where the file has one of that
        name. The new file ends as the old one, a .vrm also in .glb.
        Raises `MotionloomError` for a motion of another skeleton, another suffix, or a place that cannot be written.
        """
        path = Path(path)
        for motion, _ in clips:
            if motion.skeleton.names != self.skeleton.names or motion.skeleton.parents != self.skeleton.parents:
                raise MotionloomError(f"the motion is not on the skeleton of {self.path}; retarget it first")
        if path.suffix.lower() not in self.suffixes:
            raise MotionloomError(
                f"the character of {self.path} is written as such a file; name it *{self.path.suffix}, not {path.name}"
            )
        document = copy.deepcopy(self.file.document.json)
        new = _Insertion(document, self.file.document)
        animations = [] if replace else document.get("animations", [])
        names = unique_names((name or "motion" for _, name in clips), () if replace else self.file.clips)
        keys, inside = [self._keys(motion) for motion, _ in clips], set(self.nodes)
        moved = {(node, kind) for some in keys for node, kind, _ in some}
        if not replace:
            animated = (key for channels in self.file.channels for key in channels)
            moved |= {key for key in animated if key[0] in inside}
        for (motion, _), name, own in zip(clips, names, keys, strict=True):
            # without its rest Blender and Godot leave a node where the animation that was shown before had it
            held = sorted(moved - {(node, kind) for node, kind, _ in own})
            still = [(node, kind, self.file.nodes[node].rest[kind][None]) for node, kind in held]
            animation = new_animation(name, motion.fps)
            clock = new.add(np.arange(len(motion))[:, None] / motion.fps, bounds=True)
            start = new.add(np.zeros((1, 1)), bounds=True) if held and len(motion) > 1 else clock
            for node, kind, values in own + still:
                times = clock if len(values) == len(motion) else start
                add_channel(animation, node, kind, times, new.add(values))
                entry = document["nodes"][node]
                if entry.pop("matrix", None) is not None:  # of an animated node it must not be (glTF 2.0, 3.6.1)
                    entry |= {part: rest.tolist() for part, rest in self.file.nodes[node].rest.items()}
            animations.append(animation)
        document["animations"] = animations
        with atomic_path(path) as temporary:
            temporary.write_bytes(new.packed())
        return path

    def _keys(self, motion: Motion) -> list[tuple[int, str, Array]]:
        """Node, path and values (frames, width) of every channel.

        Places are keyed of joints whose nodes do not say them: the root, those on a control, of the body those that the
        file has in a pose.
        """
        parents, skeleton = self.file.parents, self.skeleton
        slots = {n: k for k, n in enumerate(self.nodes)}
        driven = {d for d in self.joints.drivers(skeleton) if d is not None}
        above_driven = {a for d in driven for a in skeleton.ancestors(d)}
        moving = (1 - np.abs(motion.rotations[..., 0]) > _SAME_TURN).any(axis=0)
        turned = set(np.flatnonzero(moving).tolist())
        free = {0, *(self.shifted & (driven | above_driven))}
        free |= {k for k, n in enumerate(self.nodes) if k and slots[parents[n]] != skeleton.parents[k]}
        if motion.translations is not None:
            off = np.abs(motion.translations - skeleton.offsets).max(axis=(0, 2)) > 1e-5
            free |= set(np.flatnonzero(off).tolist())
        turns = rot.multiply(motion.world_rotations(), self.turns)
        places = motion.positions()
        now = worlds(self.file, upwards(self.nodes[0], parents)[:0:-1], {})
        keys: list[tuple[int, str, Array]] = []
        for n in parents_first(frozenset(self.nodes), parents):
            k, node, p = slots[n], self.file.nodes[n], parents[n]
            turn, place = turns[:, k], places[:, k]
            if p >= 0:
                back = rot.inverse(now.turns[p])
                linear = now.linear[p]
                place = place - now.places[p]
                turn = rot.multiply(back, turn)
                if linear is None:
                    place = rot.rotate(back, place)
                elif k in free:
                    place = np.asarray(np.linalg.solve(linear, place[..., None])[..., 0], dtype=np.float64)
            turn = rot.unroll(rot.normalize(turn))
            sampled: dict[tuple[int, str], Array] = {}
            still = (1 - np.abs(turn @ node.turn) < _SAME_TURN).all()
            if k in driven or k in turned or (k in above_driven and not still):
                sampled[n, "rotation"] = turn
                keys.append((n, "rotation", np.roll(turn, -1, axis=-1)))
            away = 1e-5 * max(1.0, np.abs(node.place).max())
            if k == 0 or (k in free and np.abs(place - node.place).max() > away):
                sampled[n, "translation"] = place
                keys.append((n, "translation", place))
            now = worlds(self.file, [n], sampled, above=now)
        return keys


def load_character(path: str | Path, *, joint_map: Override | None = None) -> Character:
    """Read the humanoid of a .glb, .vrm or .gltf file; raises `MotionloomError` if it holds none.

    ``joint_map`` says which joints are which where names do not, as in `motionloom.retarget.joint_map`.
    """
    path = Path(path)
    own = path.suffix.lower()
    problem: MotionloomError | None = None
    for rig in read_rigs(path):
        try:
            joints = find_joints(rig.skeleton, joint_map)
        except MotionloomError as error:
            problem = problem or error
        else:
            _remark_on_what_stays(path, len(rig.file.people), rig.skeleton.names[0], rig.file.loose)
            suffixes = (own, ".glb") if own == ".vrm" else (own,)
            return _with_soles(Character(**vars(rig), path=path, joints=joints, suffixes=suffixes))
    assert problem is not None
    raise MotionloomError(f"{path}: {problem}")


def _remark_on_what_stays(path: Path, people: int, root: str, loose: list[str]) -> None:
    """Say which skeletons and meshes of the file do not move with the one that has this ``root``."""
    if people > 1:
        warnings.warn(
            f"{path} holds {people} skeletons; the one of {root!r} moves, the others stay as they are", stacklevel=3
        )
    if loose:
        more = f" and {len(loose) - 5} more" if len(loose) > 5 else ""
        warnings.warn(
            f"{path}: {', '.join(map(repr, loose[:5]))}{more} hang on no bone and stay where they are while "
            "the character moves; parent them to a bone in the program that made them",
            stacklevel=3,
        )


_DOWN = np.array([way for way in product((-1, 0, 1), (-1, -0.4, 0), (-1, 0, 1)) if any(way)])
"""Directions in which the corners of a foot are looked for."""


def _with_soles(character: Character) -> Character:
    """The character whose skeleton knows the corners of its feet, where it has a mesh and stands on the floor."""
    skeleton, document = character.skeleton, character.file.document
    up = read_body(skeleton, character.joints.names()).up
    rest, soles = skeleton.rest_positions(), {}
    meshes = [mesh for mesh in document.items("meshes") if mesh.get("primitives")]
    if not on_floor(rest @ up):
        if meshes:
            _remark_on_soles(character, "does not stand on the floor at rest")
        return character
    parts = (character.joints.points[j] for j in (7, 8, 10, 11))
    feet = [skeleton.index(name) for part in parts for name, weight in part if weight]
    down = rot.rotate(rot.shortest_arc(np.array([0.0, 1.0, 0.0]), up), _DOWN)
    meshed = read_surfaces(character)
    points = [(s.points, s.joints[np.arange(len(s.points)), s.weights.argmax(axis=1)]) for s in meshed]
    for j in skeleton.below(*feet):
        below = [places[of == j] for places, of in points]
        own = np.concatenate([np.zeros((0, 3)), *below]) - rest[j]
        if len(own):
            soles[j] = own[np.unique((own @ down.T).argmax(axis=0))]
    if meshes and not points:
        _remark_on_soles(character, "has meshes that are compressed (Draco, meshopt) or stored in an unusual way")
    return replace(character, skeleton=replace(skeleton, soles=soles))


def _remark_on_soles(character: Character, why: str) -> None:
    warnings.warn(f"{character.path} {why}, so that its soles are not known and may dip into the floor", stacklevel=4)


class _Insertion:
    """Data behind that of a file: in its binary part, else in a buffer of their own."""

    def __init__(self, document: dict[str, Any], file: Document) -> None:
        self.document, self.file = document, file
        self.data = bytearray()
        self.view = len(document.setdefault("bufferViews", []))
        self.accessors: list[Any] = document.setdefault("accessors", [])

    def add(self, values: Array, *, bounds: bool = False) -> int:
        """The number of the accessor of values (count, width)."""
        array = np.ascontiguousarray(values, dtype="<f4")
        where = {"bufferView": self.view, "byteOffset": len(self.data)}
        ends = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if bounds else {}
        self.data += array.tobytes()
        self.accessors.append(entry_of(array.dtype, array.shape, where) | ends)
        return len(self.accessors) - 1

    def packed(self) -> bytes:
        """The whole file."""
        buffers: list[Any] = self.document.setdefault("buffers", [])
        size, binary = {"byteLength": len(self.data)}, self.file.binary or b""
        if self.file.packed and (not buffers or "uri" not in buffers[0]):
            if not buffers:
                buffers.append({"byteLength": 0})
            binary = binary[: buffers[0]["byteLength"]]
            binary += bytes(-len(binary) % 4)
            self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary)} | size)
            binary += self.data
            buffers[0]["byteLength"] = len(binary)
        else:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
            buffers.append(size | {"uri": uri})
            self.document["bufferViews"].append({"buffer": len(buffers) - 1} | size)
        if self.file.packed:
            return pack_glb(self.document, binary, self.file.others)
        return json.dumps(self.document, allow_nan=False).encode()
