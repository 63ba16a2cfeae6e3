"""Characters of the project: read as they arrive, with joints that the user names where their own names are unknown."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.formats import characters
from motionloom.io.bvh import read_bvh
from motionloom.io.character import Character, load_character
from motionloom.io.gltf_read import read_rigs
from motionloom.retarget import joint_map
from motionloom.retarget.names import parts_by_name
from motionloom.retarget.topology import parts_by_shape
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal

SUFFIXES = (*characters(alone=True), ".bvh")
Named = Mapping[str, str]
"""Of the 22 joints by name the character's joints, as far as somebody named them."""


def read_character(project: Project, part: Path, name: str, joints_json: str | None = None) -> dict[str, Any]:
    """A character's file that arrived as ``part``, into the project: its id and which of its joints are which.

    joints_json: the joints that somebody named. Raises `Refusal` 400 with the skeleton's ``joints`` and ``guesses``
    where the 22 joints are not found on it, and `MotionloomError` for a file that holds none.
    """
    suffix = part.suffix
    if suffix not in SUFFIXES:
        raise MotionloomError(f"{name} is no character: its name must end in {', '.join(SUFFIXES)}")
    named = named_joints(joints_json)
    try:
        skeleton, character = loaded(part, named)
        joints = joint_map(skeleton) if character is None else character.joints
    except MotionloomError as error:
        sentence = str(error).replace(str(part), name)
        try:
            details = question(_skeleton(part))
        except MotionloomError:
            raise error from None
        raise Refusal(400, sentence, more=details) from None
    matches = {joint: list(names) for joint, names in joints.names().items()}
    return {"id": project.add_character(part, name, suffix, named), "name": name, "joints": matches}


def named_joints(text: str | None) -> dict[str, str]:
    """The joints that somebody named, out of JSON; raises `MotionloomError` for what is no such mapping."""
    names = {} if not text else parse_json(text, "the character's joints")
    if not isinstance(names, dict) or not all(isinstance(one, str) for one in names.values()):
        raise MotionloomError('the character\'s \'joints\' are an object such as {"left_knee": "Shin_L"}')
    return names


def loaded(path: Path, named: Named) -> tuple[Skeleton, Character | None]:
    """The skeleton of a character's file, which knows the named joints, and what a glTF holds beside it."""
    if path.suffix == ".bvh":
        skeleton = _skeleton(path)
        joint_map(skeleton, named or None)
        return _knowing(skeleton, named), None
    character = load_character(path, joint_map=named or None)
    skeleton = _knowing(character.skeleton, named)
    return skeleton, replace(character, skeleton=skeleton)


def question(skeleton: Skeleton) -> dict[str, Any]:
    """What somebody who names the joints is shown: where each is at rest, and what is guessed of them."""
    rest = skeleton.rest_positions()
    guesses = (parts_by_shape(skeleton) or {}) | parts_by_name(skeleton)
    return {
        "joints": [
            {"name": name, "parent": parent, "place": [round(float(x), 4) for x in place]}
            for name, parent, place in zip(skeleton.names, skeleton.parents, rest)
        ],
        "guesses": {part: skeleton.names[j] for part, j in guesses.items() if part in SMPL22.names},
    }


def _skeleton(path: Path) -> Skeleton:
    if path.suffix == ".bvh":
        return read_bvh(path).motion.skeleton
    return next(read_rigs(path)).skeleton


def _knowing(skeleton: Skeleton, named: Named) -> Skeleton:
    """The skeleton whose named joints are found wherever it is used."""
    return replace(skeleton, humanoid={**skeleton.humanoid, **named}) if named else skeleton
