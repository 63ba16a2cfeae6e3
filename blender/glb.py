"""A skeleton, and motion on it, as the binary glTF that the server reads; and motion as the server sends it."""

import io
import json
import struct

import numpy as np

from . import quaternions as quat


def pack(names, parents, places, *, motion=None):
    """The bytes of a .glb: a skin of joints without a mesh, all unturned at rest.

    names, parents: of the joints, those above before those below; -1 where nothing is above.
    places: (joints, 3) metres at rest, +Y up. motion: a `Moves` of these joints, an animation then.
    """
    apart = np.array([place - (places[p] if p >= 0 else 0.0) for place, p in zip(places, parents)])
    nodes = [{"name": name, "translation": offset} for name, offset in zip(names, apart.tolist())]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(joint)
    inverse = np.tile(np.eye(4), (len(names), 1, 1))
    inverse[:, 3, :3] = -places  # columns first, as glTF has them
    data = _Data()
    skin = {"joints": list(range(len(names))), "inverseBindMatrices": data.add(inverse.reshape(-1, 16), "MAT4")}
    document = {
        "asset": {"version": "2.0", "generator": "motionloom for Blender"},
        "scene": 0,
        "scenes": [{"nodes": [j for j, parent in enumerate(parents) if parent < 0]}],
        "nodes": nodes,
        "skins": [skin],
    }
    if motion is not None:
        document["animations"] = [_animation(data, motion, parents, apart)]
    document |= {"accessors": data.accessors, "bufferViews": data.views, "buffers": [{"byteLength": len(data.bytes)}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data.bytes), b"BIN\0") + bytes(data.bytes)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _animation(data, motion, parents, apart):
    """Turns of every joint, and places of those that are not where their rest has them."""
    above = [p if p >= 0 else None for p in parents]
    clock = data.add(np.arange(len(motion))[:, None] / motion.fps, "SCALAR", bounds=True)
    found = {"name": "motion", "channels": [], "samplers": [], "extras": {"fps": motion.fps}}
    for joint, parent in enumerate(above):
        turn, place = motion.turns[:, joint], motion.places[:, joint]
        if parent is not None:
            back = quat.inverse(motion.turns[:, parent])
            turn = quat.multiply(back, turn)
            place = quat.rotate(back, place - motion.places[:, parent])
        keys = [("rotation", np.roll(quat.unroll(quat.normalize(turn)), -1, axis=-1), "VEC4")]
        if parent is None or np.abs(place - apart[joint]).max() > 1e-4:
            keys.append(("translation", place, "VEC3"))
        for path, values, kind in keys:
            found["samplers"].append({"input": clock, "output": data.add(values, kind), "interpolation": "LINEAR"})
            target = {"node": joint, "path": path}
            found["channels"].append({"sampler": len(found["samplers"]) - 1, "target": target})
    return found


class _Data:
    """Accessors over one buffer."""

    def __init__(self):
        self.bytes, self.accessors, self.views = bytearray(), [], []

    def add(self, values, kind, *, bounds=False):
        """The number of the accessor of values (count, width)."""
        array = np.ascontiguousarray(values, dtype="<f4")
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": array.nbytes})
        accessor = {"bufferView": len(self.views) - 1, "componentType": 5126, "count": len(array), "type": kind}
        if bounds:
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.bytes += array.tobytes()
        self.accessors.append(accessor)
        return len(self.accessors) - 1


class Moves:
    """Motion of the joints of a skeleton that is unturned at rest: metres, +Y up, in one world.

    names, parents: of the joints; -1 where nothing is above. fps: frames per second. turns: (frames, joints, 4) world
    rotations from rest, w, x, y, z. places: (frames, joints, 3) metres in the world.
    """

    def __init__(self, names, parents, fps, *, turns, places):
        self.names, self.parents, self.fps = list(names), [int(p) for p in parents], float(fps)
        self.turns, self.places = turns, places

    def __len__(self):
        return len(self.turns)

    def part(self, begin, end):
        """Its frames from ``begin`` to before ``end``."""
        return Moves(self.names, self.parents, self.fps, turns=self.turns[begin:end], places=self.places[begin:end])

    def of(self, fps, frames):
        """The same at another rate: what is between two frames is between their poses.

        fps: of the result. frames: its number; behind the last frame the last pose stays.
        """
        at = np.minimum(np.arange(frames) * self.fps / fps, len(self) - 1)
        at = np.where(np.abs(at - np.rint(at)) < 1e-6, np.rint(at), at)
        low = np.floor(at).astype(int)
        high, share = np.minimum(low + 1, len(self) - 1), at - low
        turns = quat.between(self.turns[low], self.turns[high], share[:, None])
        own = self._inside()  # so that bones keep their lengths
        places = own[low] + (own[high] - own[low]) * share[:, None, None]
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                places[:, joint] = places[:, parent] + quat.rotate(turns[:, parent], places[:, joint])
        return Moves(self.names, self.parents, fps, turns=turns, places=places)

    def _inside(self):
        """(frames, joints, 3) where each joint is in the frame of the one above."""
        found = self.places.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                apart = self.places[:, joint] - self.places[:, parent]
                found[:, joint] = quat.rotate(quat.inverse(self.turns[:, parent]), apart)
        return found


def unpack(data):
    """The `Moves` in the bytes of an .npz that the server sent."""
    with np.load(io.BytesIO(data), allow_pickle=False) as held:
        names, parents = [str(name) for name in held["names"]], held["parents"]
        turns, places, fps = held["rotations"].astype(np.float64), held["positions"], float(held["fps"])
    for joint, parent in enumerate(parents):  # from the frames of the joints above to the world
        if parent >= 0:
            turns[:, joint] = quat.multiply(turns[:, parent], turns[:, joint])
    return Moves(names, parents, fps, turns=turns, places=places.astype(np.float64))
