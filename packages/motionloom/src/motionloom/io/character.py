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
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.ground import GroundPose
from motionloom.io.atomic import atomic_path
from motionloom.io.glb import Document, pack_glb, read_document_chunks
from motionloom.io.gltf_bind import on_floor
from motionloom.io.gltf_mesh import Surface, read_surfaces
from motionloom.io.gltf_nodes import Node, printable, upwards
from motionloom.io.gltf_read import OpenedGlb, open_glb, without_still_armatures
from motionloom.io.gltf_rig import Rig, Worlds, parents_first, read_rig, worlds
from motionloom.motion import Motion
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.joint_map import JointMap, Override
from motionloom.retarget.joint_map import joint_map as find_joints
from motionloom.retarget.stand import stand
from motionloom.retarget.topology import ancestors, below
from motionloom.skeleton import Skeleton

Array = NDArray[np.float64]
_SAME_TURN = 1e-7
"""One minus the cosine of half a turn below which a bone counts as resting."""


@dataclass(frozen=True, eq=False)
class Character:
    """A humanoid in a glTF file."""

    path: Path
    file: OpenedGlb
    nodes: list[Node]
    rig: Rig
    joints: JointMap
    kept: object = None
    """What must stay as long as the character does: a folder with what its file became."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton that motions must have to be written into the file."""
        return self.rig.skeleton

    @property
    def suffixes(self) -> tuple[str, ...]:
        """How the character's own file may end; a .vrm is a .glb of a special kind."""
        own = self.path.suffix.lower()
        return (own, ".glb") if own == ".vrm" else (own,)

    @property
    def stand(self) -> GroundPose:
        """Where the character stands and faces; without a mesh, whose nodes may be in the middle of a walk, where what
        is above its skeleton stands."""
        found = stand(read_body(self.skeleton, self.joints.names()))
        if self.file.document.items("skins"):
            return found
        above = upwards(self.rig.nodes[0], self.file.parents)[:0:-1]
        x, _, z = worlds(self.nodes, self.file.parents, above, {}).places[above[-1]][0] if above else np.zeros(3)
        return GroundPose(float(x), float(z), found.facing)

    def surfaces(self, *, remark: bool = False) -> list[Surface]:
        """The meshes of the file at rest, on `skeleton`; what is left out (compressed) is said with ``remark``."""
        return read_surfaces(self.file.document, self.nodes, self.file.parents, self.rig, remark=remark)

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
        taken = set() if replace else set(self.file.clips)
        keys = [self._keys(motion) for motion, _ in clips]
        moved = {(node, path_) for some in keys for node, path_, _ in some}
        moved |= set() if replace else {key for channels in self.file.channels for key in channels}
        for (motion, name), own in zip(clips, keys, strict=True):
            held = self._held(moved - {(node, path_) for node, path_, _ in own})
            name, numbers = name or "motion", count(2)
            free = name
            while free in taken:
                free = f"{name}_{next(numbers)}"
            animations.append(self._animation(new, motion, own, held) | {"name": free})
            taken.add(free)
            for node, _, _ in own + held:
                entry, rest = document["nodes"][node], self.nodes[node]
                if entry.pop("matrix", None) is not None:  # of an animated node it must not be (glTF 2.0, 3.6.1)
                    turn = np.roll(rest.turn, -1).tolist()
                    entry |= {"translation": rest.place.tolist(), "rotation": turn, "scale": rest.scale.tolist()}
        document["animations"] = animations
        with atomic_path(path) as temporary:
            temporary.write_bytes(new.packed(self.path))
        return path

    def _animation(
        self,
        new: "_Insertion",
        motion: Motion,
        keys: list[tuple[int, str, Array]],
        held: list[tuple[int, str, Array]],
    ) -> dict[str, Any]:
        """The JSON of a motion's channels, and of what is held at rest, whose numbers are added to ``new``."""
        animation: dict[str, Any] = {"name": "", "channels": [], "samplers": [], "extras": {"fps": motion.fps}}
        clock = new.add(np.arange(len(motion))[:, None] / motion.fps, bounds=True)
        start = new.add(np.zeros((1, 1)), bounds=True) if held and len(motion) > 1 else clock
        for node, path, values in keys + held:
            times = clock if len(values) == len(motion) else start
            animation["samplers"].append({"input": times, "output": new.add(values), "interpolation": "LINEAR"})
            channel = {"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}}
            animation["channels"].append(channel)
        return animation

    def _keys(self, motion: Motion) -> list[tuple[int, str, Array]]:
        """Node, path and values (frames, width) of every channel."""
        rig, parents = self.rig, self.file.parents
        driven = {d for d in self.joints.drivers(self.skeleton) if d is not None}
        above_driven = {a for d in driven for a in ancestors(self.skeleton, d)}
        turned = set(np.flatnonzero((1 - np.abs(motion.rotations[..., 0]) > _SAME_TURN).any(axis=0)).tolist())
        slots = {n: k for k, n in enumerate(rig.nodes)}
        above = upwards(rig.nodes[0], parents)[:0:-1]
        wanted = rot.multiply(motion.world_rotations(), rig.turns)
        places, free = motion.positions(), self._free(motion, driven | above_driven)
        now = worlds(self.nodes, parents, above, {})
        keys: list[tuple[int, str, Array]] = []
        for n in parents_first(frozenset(rig.nodes), parents):
            k, node, p = slots[n], self.nodes[n], parents[n]
            turn = wanted[:, k] if p < 0 else rot.multiply(rot.inverse(now.turns[p]), wanted[:, k])
            turn = rot.unroll(rot.normalize(turn))
            still = (1 - np.abs(turn @ node.turn) < _SAME_TURN).all()
            sampled: dict[tuple[int, str], Array] = {}
            if k in driven or k in turned or (k in above_driven and not still):
                sampled[n, "rotation"] = turn
                keys.append((n, "rotation", np.roll(turn, -1, axis=-1)))
            if k in free:
                place = places[:, k] if p < 0 else _inside(now, p, places[:, k])
                if k == 0 or np.abs(place - node.place).max() > 1e-5 * max(1.0, np.abs(node.place).max()):
                    sampled[n, "translation"] = place
                    keys.append((n, "translation", place))
            now = worlds(self.nodes, parents, [n], sampled, above=now)
        return keys

    def _held(self, moved: set[tuple[int, str]]) -> list[tuple[int, str, Array]]:
        """The rest, once, of the channels that other animations move and this one does not.

        Without it Blender and Godot would leave such a node where the animation that was shown before had it.
        """
        inside = set(self.rig.nodes)
        rest = {
            (n, path): {
                "translation": self.nodes[n].place,
                "rotation": np.roll(self.nodes[n].turn, -1),
                "scale": self.nodes[n].scale,
            }[path]
            for n, path in moved
            if n in inside
        }
        return [(n, path, value[None]) for (n, path), value in sorted(rest.items(), key=lambda item: item[0])]

    def _free(self, motion: Motion, body: set[int]) -> set[int]:
        """Joints whose places their nodes do not say: the root, those on a control, those of the ``body`` in a pose."""
        rig, parents = self.rig, self.file.parents
        slots = {n: k for k, n in enumerate(rig.nodes)}
        free = {0, *(rig.shifted & body)}
        free |= {k for k, n in enumerate(rig.nodes) if k and slots[parents[n]] != self.skeleton.parents[k]}
        if motion.translations is not None:
            apart = np.abs(motion.translations - self.skeleton.offsets).max(axis=(0, 2)) > 1e-5
            free |= set(np.flatnonzero(apart).tolist())
        return free


def load_character(path: str | Path, *, joint_map: Override | None = None) -> Character:
    """Read the humanoid of a .glb, .vrm or .gltf file; raises `MotionloomError` if it holds none.

    ``joint_map`` says which joints are which where names do not, as in `motionloom.retarget.joint_map`.
    """
    path = Path(path)
    file = open_glb(path)
    problem: MotionloomError | None = None
    for person in range(len(file.people)):
        nodes, joints, _ = without_still_armatures(file, person, {})
        rig = read_rig(file.document, nodes, file.parents, joints=joints, tips=frozenset())
        try:
            found = find_joints(rig.skeleton, joint_map)
        except MotionloomError as error:
            problem = problem or error
        else:
            character = Character(path, file, nodes, rig, found)
            _remark_on_what_stays(character)
            return _with_soles(character)
    assert problem is not None
    raise MotionloomError(f"{path}: {problem}")


def _remark_on_what_stays(character: Character) -> None:
    """Say which skeletons and meshes of the file do not move with the character."""
    file = character.file
    if len(file.people) > 1:
        warnings.warn(
            f"{character.path} holds {len(file.people)} skeletons; the one of {character.skeleton.names[0]!r} moves, "
            "the others stay as they are",
            stacklevel=3,
        )
    carriers = frozenset().union(*file.people)
    loose = [
        printable(entry.get("name")) or f"node_{number}"
        for number, entry in enumerate(file.document.items("nodes"))
        if entry.get("mesh") is not None
        and entry.get("skin") is None
        and carriers.isdisjoint(upwards(number, file.parents))
    ]
    if loose:
        more = f" and {len(loose) - 5} more" if len(loose) > 5 else ""
        warnings.warn(
            f"{character.path}: {', '.join(map(repr, loose[:5]))}{more} hang on no bone and stay where they are while "
            "the character moves; parent them to a bone in the program that made them",
            stacklevel=3,
        )


_DOWN = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, -0.4, 0) for z in (-1, 0, 1) if x or y or z])
"""Directions in which the corners of a foot are looked for."""


def _with_soles(character: Character) -> Character:
    """The character whose skeleton knows the corners of its feet, where it has a mesh and stands on the floor."""
    skeleton, document = character.skeleton, character.file.document
    up = read_body(skeleton, character.joints.names()).up
    rest, found = skeleton.rest_positions(), {}
    meshes = [mesh for mesh in document.items("meshes") if mesh.get("primitives")]
    if not on_floor(rest @ up):
        if meshes:
            _remark_on_soles(character, "does not stand on the floor at rest")
        return character
    feet = {skeleton.index(name) for j in (7, 8, 10, 11) for name, weight in character.joints.points[j] if weight}
    feet = below(skeleton, feet)
    down = rot.rotate(rot.shortest_arc(np.array([0.0, 1.0, 0.0]), up), _DOWN)
    points = [(s.points, s.joints[np.arange(len(s.points)), s.weights.argmax(axis=1)]) for s in character.surfaces()]
    for j in sorted(feet):
        own = np.concatenate([places[of == j] for places, of in points] or [np.zeros((0, 3))]) - rest[j]
        if len(own):
            found[j] = own[np.unique((own @ down.T).argmax(axis=0))]
    if meshes and not points:
        _remark_on_soles(character, "has meshes that are compressed (Draco, meshopt) or stored in an unusual way")
    return replace(character, rig=replace(character.rig, skeleton=replace(skeleton, soles=found)))


def _remark_on_soles(character: Character, why: str) -> None:
    warnings.warn(f"{character.path} {why}, so that its soles are not known and may dip into the floor", stacklevel=4)


def _inside(now: Worlds, node: int, place: Array) -> Array:
    """(frames, 3) world places in the frame of a node."""
    apart, linear = place - now.places[node], now.linear[node]
    if linear is None:
        return rot.rotate(rot.inverse(now.turns[node]), apart)
    solved = np.linalg.solve(np.broadcast_to(linear, (len(apart), 3, 3)), apart[..., None])
    return np.asarray(solved[..., 0], dtype=np.float64)


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
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        accessor: dict[str, Any] = {
            "bufferView": self.view,
            "byteOffset": len(self.data),
            "componentType": 5126,
            "count": len(array),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.data += array.tobytes()
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def packed(self, path: Path) -> bytes:
        """The whole file."""
        buffers: list[Any] = self.document.setdefault("buffers", [])
        view = {"byteLength": len(self.data)}
        chunks = read_document_chunks(path)
        if chunks is not None and (not buffers or "uri" not in buffers[0]):
            if not buffers:
                buffers.append({"byteLength": 0})
            old = chunks.binary[: buffers[0]["byteLength"]]
            start = len(old) + -len(old) % 4
            binary = old + bytes(start - len(old)) + bytes(self.data)
            buffers[0]["byteLength"] = len(binary)
            self.document["bufferViews"].append({"buffer": 0, "byteOffset": start} | view)
            return pack_glb(self.document, binary, chunks.others)
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        buffers.append({"byteLength": len(self.data), "uri": uri})
        self.document["bufferViews"].append({"buffer": len(buffers) - 1} | view)
        if chunks is not None:
            return pack_glb(self.document, chunks.binary, chunks.others)
        return json.dumps(self.document, allow_nan=False).encode()
