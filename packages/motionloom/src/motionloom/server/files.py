"""Motions as files and files as motions: what the server sends and takes beside JSON."""

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.formats import readable
from motionloom.goals.fields import Field
from motionloom.io import load, load_scene, save, save_scene
from motionloom.kinematics.deeds import happened
from motionloom.kinematics.gaze import looks
from motionloom.requests.export import Export
from motionloom.retarget import RootMode, retarget, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.hands import HandPose, pose_hands
from motionloom.retarget.named import NAMED, named_skeleton
from motionloom.retarget.stand import HERE, started
from motionloom.retarget.toes import bend_toes
from motionloom.server.characters import loaded
from motionloom.server.limits import Limits
from motionloom.server.project import Project, Stored
from motionloom.server.refusal import Refusal
from motionloom.viz.page import Take, write_page

FORMATS = {
    "bvh": "text/plain; charset=utf-8",
    "glb": "model/gltf-binary",
    "npz": "application/octet-stream",
    "mp4": "video/mp4",
    "png": "image/png",
    "html": "text/html; charset=utf-8",
}
ONE_PERSON = ("bvh", "npz")
UPLOADS = (*(suffix for suffix in readable() if suffix not in (".gltf", ".vrma")), ".json")


def as_json(stored: Stored, encode: Any) -> dict[str, Any]:
    """A motion for a page: everybody as the 22-joint person; ``encode`` makes text of an array of float32."""
    people = []
    for person in stored.people:
        uniform = _uniform(person)
        people.append(
            {
                "positions": encode(uniform.positions()),
                "rotations": encode(uniform.rotations),
                "root": encode(uniform.root),
                "looks": encode(looks(uniform)),
            }
        )
    first = stored.people[0]
    about = {"id": stored.id, "fps": first.fps, "frames": len(first), "seconds": round(first.seconds, 4)}
    return about | {"people": people, "about": stored.about}


def places(stored: Stored, *, seeing: bool = False) -> bytes:
    """Where the 22 joints of everybody are: (people, frames, 22, 3) metres, little-endian float32.

    seeing: behind them the directions in which the heads look, (people, frames, 3) of length 1.
    """
    people = [_uniform(person) for person in stored.people]
    arrays = [person.positions() for person in people] + [looks(person) for person in people if seeing]
    return b"".join(map(float32, arrays))


def deeds_between(stored: Stored, begin: str | None, end: str | None) -> list[dict[str, Any] | None]:
    """What everybody does between two seconds, by default in all of it; raises `Refusal` 400 for no such stretch."""
    length = stored.people[0].seconds
    try:
        since, until = float(begin or 0), length if end is None else float(end)
    except ValueError:
        since = until = -1.0
    if not 0 <= since < until <= length + 1e-3:
        raise Refusal(400, f"'begin' and 'end' are seconds from 0 to {length:g}, the end behind the begin")
    return happened(one.crop(since, min(until, one.seconds)) for one in stored.people)


def _uniform(person: Motion) -> Motion:
    return person if person.skeleton == SMPL22 else to_smpl22(person)


def from_json(part: Path, name: str) -> list[Motion]:
    """Motions of the 22-joint person as `as_json` gives them: ``fps``, ``people``, their ``root`` and ``rotations``."""
    document = Field(parse_json(part.read_bytes(), name), name)
    fields = document.mapping(("fps", "people", "id", "frames", "seconds", "about"), ("fps", "people"))
    fps = fields["fps"].number(1.0, 240.0)
    return [_person(one, fps) for one in fields["people"].items(most=8)]


def _person(field: Field, fps: float) -> Motion:
    fields = field.mapping(("root", "rotations", "positions", "looks"), ("root", "rotations"))
    root, rotations = _decoded(fields["root"], 3), _decoded(fields["rotations"], 4 * len(SMPL22))
    lengths = np.linalg.norm(rotations.reshape(len(rotations), -1, 4), axis=-1, keepdims=True)
    if len(root) != len(rotations):
        field.fail(f"has {len(root)} places of the root and rotations for {len(rotations)} frames; make them as many")
    if not (np.abs(lengths - 1) < 0.01).all():
        fields["rotations"].fail("must be quaternions (w, x, y, z) of length 1")
    return Motion(SMPL22, fps, root, rotations.reshape(len(rotations), -1, 4) / lengths)


def _decoded(field: Field, width: int) -> np.ndarray:
    """(frames, width) numbers out of base64 of little-endian float32."""
    try:
        data = base64.b64decode(field.value, validate=True)
    except (TypeError, ValueError):
        data = b""
    if not data or len(data) % (4 * width):
        field.wrong(f"base64 of float32 in little-endian order, {width} for each frame")
    values = np.frombuffer(data, "<f4").astype(np.float64).reshape(-1, width)
    if not (np.isfinite(values).all() and np.abs(values).max() < 1e5):
        field.fail("holds what is no place or rotation")
    return values


def export(project: Project, options: Export) -> Path:
    """A file of a motion in the project's temporary folder; the caller removes it.

    options: the motion and a character by their ids; a character plays an html. Without a root all joints above the
    hips go along. Raises `Refusal` and `MotionloomError` for what cannot be.
    """
    skeleton, person = options.skeleton, options.person
    for name in ("root", "hands", "at"):
        if getattr(options, name) is not None and skeleton is None:
            raise Refusal(400, f"'{name}' goes with a 'skeleton'; name one")
    stored = project.motion(options.motion)
    people = [_stretch(one, options) for one in stored.people]
    if person is not None and person >= len(people):
        raise Refusal(400, f"the motion has {len(people)} people, counted from 0; there is no person {person}")
    if person is not None or options.format in ONE_PERSON:
        people = [people[person or 0]]
    caption = str(stored.about.get("prompt") or stored.about.get("name") or "")
    if skeleton is not None and skeleton not in NAMED:
        return _on_character(project, people, skeleton, caption, options)
    if skeleton is not None:
        people = [_retarget(one, named_skeleton(skeleton), options) for one in people]
    part = project.part(f".{options.format}")
    if len(people) > 1:
        return save_scene(people, part, names=_names(people), captions=[caption] * len(people))
    return save(people[0], part, captions=[caption])


def _stretch(motion: Motion, options: Export) -> Motion:
    """The part of a motion that the options name, at their rate."""
    from motionloom.server.drawing import cropped  # the page is there before the sampler

    motion = cropped(motion, options)
    motion = motion.mirror() if options.mirror else motion
    return motion if options.fps is None else motion.resample(options.fps)


def _retarget(motion: Motion, skeleton: Skeleton, options: Export) -> Motion:
    moved = retarget(motion, skeleton, root=cast("RootMode | None", options.root))
    return pose_hands(moved, cast("HandPose", options.hands or "as-is"))


def _on_character(project: Project, people: Sequence[Motion], skeleton: str, caption: str, options: Export) -> Path:
    path, _ = project.character(skeleton)
    kind = options.format
    suffix = path.suffix
    if suffix == ".asf":
        raise MotionloomError("an ASF skeleton belongs to AMC files; put motions on a .glb, .vrm, .gltf or .bvh")
    target, character = loaded(path, project.named_joints(skeleton))
    if character is not None and kind == "glb" and len(people) > 1:
        raise MotionloomError("a character's file holds one person; name one with person=0 or person=1")
    body = read_body(target)
    moved = [bend_toes(_retarget(one, target, options), body) for one in people]
    if character is not None and character.stand != HERE and len(moved) == 1 and options.at != "origin":
        moved = [started(moved[0], body, character.stand)]
    if character is not None and kind == "glb":
        return character.save(moved[0], project.part(suffix), name=caption[:80] or None)
    part = project.part(f".{kind}")
    if kind == "html":
        return write_page([Take(caption, moved)], part, character=character)
    return save(moved[0], part, captions=[caption]) if len(moved) == 1 else save_scene(moved, part)


def _names(people: Sequence[Motion]) -> list[str]:
    return ["first", "second"] if len(people) == 2 else [f"person {number + 1}" for number in range(len(people))]


def read_upload(project: Project, part: Path, name: str, *, asf: str | None, limits: Limits) -> Stored:
    """A motion file that arrived as ``part``, into the project."""
    suffix = part.suffix
    if suffix not in UPLOADS:
        raise MotionloomError(f"{name} cannot be read: its name must end in {', '.join((*UPLOADS, '.asf'))}")
    if suffix == ".amc":
        if asf is None:
            raise MotionloomError("an AMC file needs its skeleton: send the .asf first, then the AMC with &asf=ID")
        skeleton, _ = project.character(asf)
        people = [load(part, asf=skeleton)]
    elif suffix == ".json":
        people = from_json(part, name)
    else:
        people = load_scene(part)
    if len(people) > limits.people:
        raise MotionloomError(f"{name} holds {len(people)} people; at most {limits.people} are taken")
    for motion in people:
        if motion.seconds > limits.total_seconds:
            raise MotionloomError(
                f"{name} takes {motion.seconds:.0f} s; at most {limits.total_seconds:g} s are taken, so cut it first"
            )
        to_smpl22(motion.frames(0, 1))  # a body of which the 22 joints are not found helps nobody later
    return project.add(people, {"task": "upload", "name": name})


def read_skeleton(project: Project, part: Path, name: str) -> dict[str, Any]:
    """An ASF skeleton that arrived as ``part``, into the project."""
    from motionloom.io.asf import load_skeleton

    load_skeleton(part)
    return {"id": project.add_character(part, name, ".asf"), "name": name, "skeleton": True}


def float32(values: np.ndarray) -> bytes:
    """The bytes of little-endian float32."""
    return np.ascontiguousarray(values, dtype="<f4").tobytes()
