"""What a goal file may hold (docs/control.md): metres, +Y up; seconds; degrees about +Y, 0 faces +Z and 90 faces +X.

Tables of fields by key; kinds that are no plain values are other tables here, or are read in their own way.
"""

from collections.abc import Mapping

from motionloom.requests.fields import Spec

FARTHEST = 1000
"""Metres from the origin."""
FULL_TURN = 36_000
"""Degrees: directions count on beyond a turn, so far."""
MAX_FRAMES = 1_000_000
MAX_PLACES = 100_000
LONGEST_MOTION = MAX_FRAMES / 20
"""Seconds."""
CURVES = ("line", "circle", "figure_eight", "s")

Keys = Mapping[str, Spec]


def _degrees(help: str, *, many: int = 0) -> Spec:
    return Spec("number", help, low=-FULL_TURN, high=FULL_TURN, many=many)


def _ground(help: str, *, many: int = 0, needed: bool = False) -> Spec:
    return Spec("number", help, low=-FARTHEST, high=FARTHEST, size=2, many=many, needed=needed)


def _metres(help: str, *, needed: bool = False) -> Spec:
    return Spec("number", help, low=0.01, high=FARTHEST, needed=needed)


def _times(help: str, *, size: int = 0) -> Spec:
    return Spec("number", help, low=0, high=LONGEST_MOTION, size=size, many=0 if size else MAX_PLACES)


_WALKED = _times("from when to when it is walked, seconds; without it the whole motion", size=2)
_FACING = Spec("facing", "where the person faces on the path: 'along', 'free' or degrees", "along")
_TIME = Spec("number", "seconds from the beginning", low=0, high=LONGEST_MOTION, needed=True)
_FILE = "a motion file of any humanoid, in the goal file's folder or below it"

START: Keys = {
    "position": _ground("x and z of the person at time 0: where the path begins, else 0, 0"),
    "facing": _degrees("where the person faces at time 0: as the path sets out, else 0"),
}
DIRECTIONS = _degrees(
    "one per point (of a drawing or curve: evenly along it), turning evenly in between as written: 0 to 360 is a "
    "whole turn",
    many=MAX_PLACES,
)
PATHS: Mapping[str, Keys] = {
    "points": {
        "points": _ground("x and z of points that the path goes through", many=MAX_PLACES, needed=True),
        "times": _times(
            "seconds at the points, rising; two equal points are a stop; a closed path has one more, when it is back"
        ),
        "closed": Spec("flag", "go back to the first point", False),
        "smooth": Spec("flag", "a curve through the points instead of straight lines", True),
        "facing": _FACING,
    },
    "svg": {
        "svg": Spec("file", "an SVG file, in the goal file's folder or below it", needed=True),
        "width": _metres(
            "metres from the drawing's left to its right; without it and scale as large as is walked in the time"
        ),
        "scale": Spec("number", "metres per unit of the drawing", low=1e-6, high=1e6),
        "times": _WALKED,
        "facing": _FACING,
    },
    "curve": {
        "curve": Spec("word", "a curve that sets out where the person faces", words=CURVES, needed=True),
        "size": _metres("metres: length of a line, diameter of a circle, width of the others", needed=True),
        "turn": Spec("word", "to which side it turns first", "left", words=("left", "right")),
        "times": _WALKED,
        "facing": _FACING,
    },
}
"""The keys of a path by the one that decides which it is."""
JOINT: Keys = {
    "joint": Spec("joint", "a joint of the 22, or a group of them", needed=True),
    "points": Spec("point", "places at times, rising, at least a frame apart", many=MAX_PLACES),
    "every_frame": Spec(
        "place or null", "one place per frame (20 a second) from the first on; null is free", many=MAX_FRAMES
    ),
    "curve": Spec("flag", "move on a curve through the points, so that every frame between them is asked", False),
    "frame": Spec(
        "word", "'root': seen from the person on the path, who faces +Z there", "world", words=("world", "root")
    ),
}
"""A joint has points or every_frame."""
POINT: Keys = {
    "time": _TIME,
    "position": Spec("place", "x, y (height) and z, metres; null is free, x and z go together", needed=True),
}
POSE: Keys = {
    "time": _TIME,
    "from": Spec("file", _FILE, needed=True),
    "at": Spec("number", "seconds in that file", 0, low=0, high=LONGEST_MOTION),
    "position": _ground("where it stands: on the path at that time, else at the start"),
    "facing": _degrees("where it faces: as on the path, else as at the start"),
}
FOLLOW: Keys = {
    "from": Spec("file", _FILE, needed=True),
    "joints": Spec("joint", "joints, or groups of them, that go where those of the file go", many=100, needed=True),
    "from_time": Spec("number", "seconds of that file at which this motion begins", 0, low=0, high=LONGEST_MOTION),
    "times": _times("only at these times of this motion; without it every frame"),
}
MOST_FOLLOWED = 100
GOAL: Keys = {
    "start": Spec("start", "where the person is at time 0"),
    "path": Spec("path", "where the pelvis goes, seen from above"),
    "joints": Spec("joint goal", "places of joints", many=MAX_PLACES),
    "poses": Spec("pose", "whole poses out of motion files", many=MAX_PLACES),
    "follow": Spec("follow", "joints that go where those of another motion go"),
}
"""At least one of these."""
