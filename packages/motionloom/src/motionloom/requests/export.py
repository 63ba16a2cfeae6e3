"""`export`: a motion as a file, of another format, on another skeleton, or a part of it."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare
from motionloom.requests.shared import LONGEST_LINE

FORMATS = ("bvh", "glb", "npz", "mp4", "png", "html")
"""What the server and assistants write; the command line goes by the file's name."""
ROOTS = ("motion", "hips", "in-place")
HANDS = ("relaxed", "fist", "flat", "as-is")
PLACES = ("character", "origin")
UPS = ("y", "z", "x", "y-down", "z-down", "x-down")
RATE = "frames per second"


@dataclass(frozen=True, kw_only=True)
class OnSkeleton(Checked):
    """A skeleton that motions are put on, and how."""

    skeleton: str | None = declare("text", "smpl22, mixamo, unreal, vrm, rigify or a character", high=LONGEST_LINE)
    root: str | None = declare(
        "word",
        "what carries the way over the ground on a skeleton with a root bone: that bone (motion), the hips, or nothing",
        words=ROOTS,
    )
    hands: str | None = declare(
        "word", "pose of the hands on a skeleton with fingers; without it as-is, its rest pose", words=HANDS
    )
    at: str | None = declare(
        "word",
        "where motions of a character start: where it stands and faces (character), or at the origin, facing +Z; "
        "without it the former where it stands elsewhere",
        words=PLACES,
    )


@dataclass(frozen=True, kw_only=True)
class Stretch(Checked):
    """A part of a motion, and its rate."""

    start: float | None = declare("number", "begin at this second", low=0, unit="seconds")
    end: float | None = declare("number", "end at this second", low=0, unit="seconds")
    fps: float | None = declare("number", "resample to this many frames per second", low=0.1, high=1000, unit=RATE)
    mirror: bool = declare("flag", "exchange left and right", False)


@dataclass(frozen=True, kw_only=True)
class Source(Checked):
    """How a file is read."""

    up: str | None = declare("word", "the axis that is up in the file; without it as people move", words=UPS)
    source_fps: float | None = declare(
        "number", "take this many frames per second for the file's (AMC: 120)", low=0.1, high=1000, unit=RATE
    )


@dataclass(frozen=True, kw_only=True)
class Export(Stretch, OnSkeleton):
    """Write a motion to a file in the project folder and give its path."""

    motion: Any = declare("motion", "the motion", needed=True)
    format: str = declare("word", "of the file; html is a page that plays it", "bvh", words=FORMATS)
    person: int | None = declare("whole", "one of several people, counted from 0; without it all", low=0, high=7)
    name: str | None = declare(
        "text", "of the file, letters, digits, - and _ only; without it the motion's own", high=80
    )
