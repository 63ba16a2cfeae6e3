"""The JSON messages of a live connection: those of a client, checked, and the answers (docs/live.md)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from motionloom.core.skeleton import Skeleton
from motionloom.live.clock import Health, first_of
from motionloom.live.commands import FrameCommand, to_json
from motionloom.live.live import Frame
from motionloom.requests import reading
from motionloom.requests.live import Hello
from motionloom.retarget.named import named_skeleton

Array = NDArray[np.float64]
VERSION = 1
LARGEST = 256 * 1024
"""Bytes of one message."""
ROBOT_FPS = 50.0
"""Frames per second of joint angles, unless hello has another rate."""
MOST_JOINTS = 300


def read(text: str | bytes) -> Mapping[str, Any]:
    """A message: a JSON object with a type. `MotionloomError` for anything else."""
    if len(text) > LARGEST:
        raise MotionloomError(f"a message has at most {LARGEST} bytes; this one has {len(text)}")
    message = parse_json(text, "the message")
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise MotionloomError('a message is a JSON object with a "type"')
    return message


def hello(message: Mapping[str, Any]) -> Hello:
    """The first message of a client; `MotionloomError` names what is wrong with it."""
    if message.get("type") != "hello":
        raise MotionloomError('the first message is {"type": "hello"}')
    fields = {key: value for key, value in message.items() if key != "type"}
    keys = reading.read(Hello, fields, "hello")
    if keys.robot and "skeleton" in fields:
        raise MotionloomError("a robot has its own skeleton; leave one of 'robot' and 'skeleton' out of hello")
    if not keys.robot and (keys.max_speed, keys.avoid_collisions) != (None, None):
        raise MotionloomError("'max_speed' and 'avoid_collisions' go with a 'robot'; name one in hello")
    fps = ROBOT_FPS if keys.robot and "fps" not in fields else keys.fps
    return replace(keys, skeleton=skeleton(keys.skeleton), fps=fps)


def skeleton(value: Any) -> Skeleton:
    """A skeleton by its name (`retarget.named`), or of names, parents and offsets in metres."""
    if isinstance(value, str):
        return named_skeleton(value)
    if not isinstance(value, dict) or set(value) != {"names", "parents", "offsets"}:
        raise MotionloomError("a skeleton is a name, or an object with names, parents and offsets")
    names, parents, offsets = value["names"], value["parents"], value["offsets"]
    if not all(isinstance(part, list) and len(part) <= MOST_JOINTS for part in (names, parents, offsets)):
        raise MotionloomError(f"a skeleton has lists of names, parents and offsets, of at most {MOST_JOINTS} joints")
    if not all(isinstance(name, str) for name in names) or any(type(parent) is not int for parent in parents):
        raise MotionloomError("the names of a skeleton are words and its parents whole numbers, -1 for the root")
    try:
        places = np.array(offsets, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):  # whole numbers may have any number of digits
        places = np.empty(0)
    if places.shape != (len(names), 3) or not (np.isfinite(places).all() and np.abs(places).max(initial=0) < 1e4):
        raise MotionloomError(f"the offsets of a skeleton of {len(names)} joints are as many lists of 3 numbers")
    return Skeleton(tuple(names), tuple(parents), places)


def welcome(begun: Hello, key: str, number: int, hinges: Sequence[str] = ()) -> dict[str, Any]:
    """The answer to hello; ``number``: of the frame that comes first; hinges: of a robot, in the order of angles."""
    bones = begun.skeleton
    return {
        "type": "welcome",
        "version": VERSION,
        "session": key,
        "fps": begun.fps,
        "seed": begun.seed,
        "people": begun.people,
        "frame": number,
        "joints": list(bones.names),
        "parents": list(bones.parents),
        "offsets": bones.offsets.round(6).tolist(),
        **({"robot": begun.robot, "joint_names": list(hinges)} if begun.robot else {}),
    }


def frame(frames: Frame | tuple[Frame, Frame], late: float, angles: Sequence[Array] = ()) -> dict[str, Any]:
    """One pose, or those of two people: root in metres, rotations (w, x, y, z) in the parent's frame; late: seconds
    behind its time; angles: (7 + hinges,) of each, of a robot."""
    first = first_of(frames)
    poses = [
        {"root": one.root.round(5).tolist(), "rotations": one.rotations.round(6).tolist(), "words": one.words}
        for one in ((frames,) if isinstance(frames, Frame) else frames)
    ]
    for pose, one in zip(poses, angles):
        pose["qpos"] = one.round(6).tolist()
    about = {"type": "frame", "frame": first.number, "time": round(first.time, 6), "late": round(late, 4)}
    return {**about, **poses[0]} if len(poses) == 1 else {**about, "people": poses}


def health(state: Health) -> dict[str, Any]:
    """How the server keeps up."""
    return {
        "type": "health",
        "late": state.late,
        "worst": round(state.worst, 4),
        "ahead": round(state.ahead, 4),
        "dropped": state.dropped,
        "times": round(state.times, 2),
        "rate": round(state.rate, 3),
        "problem": state.problem,
    }


def recorded(begun: Hello, log: list[FrameCommand], number: int) -> dict[str, Any]:
    """The commands so far, before which frames: the session again, with the same seed and rate."""
    commands = [
        {"frame": one.frame, **to_json(one.command), **({"person": one.person + 1} if begun.people > 1 else {})}
        for one in log[-10_000:]
    ]
    return {
        "type": "recorded",
        "seed": begun.seed,
        "fps": begun.fps,
        "people": begun.people,
        "frames": number,
        "commands": commands,
    }
