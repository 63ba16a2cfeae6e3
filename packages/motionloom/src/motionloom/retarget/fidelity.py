"""How truly a body shows a recording: directions of limbs and trunk, and places of joints, frame by frame.

Two bodies differ in size, in where they start and in which way they face at first; none of that counts. The recording
is turned about the vertical by one angle for all frames, and places are seen from the middle between the hip joints,
in centimetres on a person with legs of `LEG` metres. Three things are no error either, for no body could avoid them:

- Proportions. Places are compared with the recording scaled by the length of its legs, and with its thighs, shins,
  hips, trunk, shoulders, arms and neck made as long as the body's one by one (medians over the clip). On wider hips
  feet may stand where they stood, or legs point where they pointed: the better of the two counts.
- How high over the sole a skeleton has its ankle. The recording's foot may point up or down by a constant, of at most
  `ANKLE` degrees.
- Where a skeleton has the joint it calls pelvis. Where that is not between hips and trunk, the trunk takes its place.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.errors import MotionloomError
from motionloom.skeleton import SMPL22

Array = NDArray[np.float64]

DIRECTIONS, DIRECTION = (5.0, 15.0), (10.0, 30.0)
"""Degrees that the median and the 95th percentile stay under: of all lines together, and of each by itself.

One line in fifteen that is wrong all the time is more than 5 % of all. Legs are where a true copy comes nearest: feet
stand where the recording's do, and on hips of another breadth the thighs then lie otherwise.
"""
PELVIS = (35.0, 60.0)
"""The same of the short line from the hips up to the pelvis, whose slope is 26 degrees on one sound skeleton."""
PLACES_CM, PLACE_CM = 4.0, 10.0
"""Centimetres that the median stays under: of all places together, and of each."""
LEG = 0.82
"""Metres of thigh and shin of the person on whom places are compared: the uniform one."""
ANKLE = 20.0
"""Degrees."""
_SHORT = 0.03
"""Lengths of the leg: a shorter line has no direction worth a comparison."""
_ASTRAY = 45.0
"""Degrees off (median) from which on a joint is not where its name says, or up is another axis."""

_J = {name: number for number, name in enumerate(SMPL22.names)}
_HIPS, _SHOULDERS = ("left_hip", "right_hip"), ("left_shoulder", "right_shoulder")
_LEG_JOINTS, _ARM_JOINTS = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")
_LIMBS = {
    "thigh": ("hip", "knee"),
    "shin": ("knee", "ankle"),
    "foot": ("ankle", "foot"),
    "upper arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
}
_SIDES = ("left", "right")
_LINES: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    *((part, (f"{side}_{upper}",), (f"{side}_{lower}",)) for part, (upper, lower) in _LIMBS.items() for side in _SIDES),
    ("hip line", _HIPS[1:], _HIPS[:1]),
    ("shoulder line", _SHOULDERS[1:], _SHOULDERS[:1]),
    ("trunk", _HIPS, _SHOULDERS),
    ("pelvis", _HIPS, ("pelvis",)),
    ("neck", ("neck",), ("head",)),
)
"""What a line is called, and the joints between whose middles it runs."""
_OF = {name: [k for k, line in enumerate(_LINES) if line[0] == name] for name, _, _ in _LINES}
LINES = tuple(_OF)
PLACES = (*_LEG_JOINTS, *_ARM_JOINTS, "head")


@dataclass(frozen=True)
class Spread:
    """An error over the frames of a clip and over both sides."""

    median: float
    high: float
    """The 95th percentile."""


@dataclass(frozen=True)
class Fidelity:
    """How far a body is from its recording."""

    directions: dict[str, Spread]
    """Degrees by name of `LINES`; one that the recording's skeleton does not have is absent. ``all`` is all of them
    together but the pelvis, which has a limit of its own."""
    places: dict[str, Spread]
    """Centimetres by name of `PLACES`, and ``all``: the recording has the body's proportions."""
    by_leg: dict[str, Spread]
    """The same: the recording is scaled by the length of its legs alone."""

    def faults(self) -> list[str]:
        """What is over the limits above, the worst first, in words; empty for a true copy."""
        over: list[tuple[float, str]] = []
        for name, error in self.directions.items():
            median, high = {"all": DIRECTIONS, "pelvis": PELVIS}.get(name, DIRECTION)
            worst = max(error.median / median, error.high / high)
            what = "all directions" if name == "all" else name
            off = f"{error.median:.1f} degrees off (95 %: {error.high:.0f})"
            over.append((worst, f"{what} {off}"))
        for name, error in self.places.items():
            cm = min(error.median, self.by_leg[name].median)
            what, cap = ("all places", PLACES_CM) if name == "all" else (name, PLACE_CM)
            over.append((cm / cap, f"{what} {cm:.1f} cm off"))
        return [text for worst, text in sorted(over, reverse=True) if worst >= 1]


def compare(recording: Array, body: Array) -> Fidelity:
    """How far ``body`` is from ``recording``, at the same moments.

    Args:
        recording: (frames, 22, 3) in any unit: the recording's joints on its own skeleton (`joints22`).
        body: (frames, 22, 3) in any unit, +Y up: the same motion on another body, at any place and heading.

    Raises `MotionloomError` if the two have not the same number of frames, or no legs.
    """
    if recording.shape != body.shape or recording.shape[1:] != (22, 3) or not len(recording):
        raise MotionloomError(
            "a body is compared with its recording at the same moments, 22 joints each; "
            f"these are {recording.shape} and {body.shape}"
        )
    theirs, ours = _in_legs(recording), _in_legs(body)
    theirs = _facing_alike(theirs, ours)
    return Fidelity(
        directions=_direction_errors(_lines(theirs), _lines(ours)),
        places=_place_errors(_chains(theirs, ours), _chains(ours, ours)),
        by_leg=_place_errors(_chains(theirs, theirs), _chains(ours, ours)),
    )


def _direction_errors(theirs: Array, ours: Array) -> dict[str, Spread]:
    """Of lines (frames, lines, 3)."""
    theirs = theirs.copy()
    trunk, pelvis = _OF["trunk"][0], _OF["pelvis"][0]
    if np.median(_angle(theirs[:, pelvis], theirs[:, trunk])) > _ASTRAY:
        theirs[:, pelvis] = theirs[:, trunk]
    for shin, foot in zip(_OF["shin"], _OF["foot"], strict=True):
        theirs[:, foot] = _bent_alike(theirs[:, [shin, foot]], ours[:, [shin, foot]])
    errors = _angle(theirs, ours)
    long = np.median(np.linalg.norm(theirs, axis=-1), axis=0) > _SHORT
    lines = {name: [k for k in of if long[k]] for name, of in _OF.items() if any(long[k] for k in of)}
    together = [k for name, of in lines.items() if name != "pelvis" for k in of]
    return {name: _spread(errors[:, of]) for name, of in (lines | {"all": together}).items()}


def _place_errors(theirs: Array, ours: Array) -> dict[str, Spread]:
    errors = 100 * LEG * np.linalg.norm(theirs - ours, axis=-1)
    of = {name: [j for key, j in _J.items() if key.endswith(name)] for name in PLACES}
    of["all"] = [j for joints in of.values() for j in joints]
    return {name: _spread(errors[:, joints]) for name, joints in of.items()}


def _spread(errors: Array) -> Spread:
    median, high = np.percentile(errors, [50, 95])
    return Spread(round(float(median), 2), round(float(high), 2))


def _middle(places: Array, joints: tuple[str, ...]) -> Array:
    return places[:, [_J[joint] for joint in joints]].mean(axis=1)


def _lines(places: Array) -> Array:
    return np.stack([_middle(places, ends) - _middle(places, starts) for _, starts, ends in _LINES], axis=1)


def _in_legs(places: Array) -> Array:
    """In lengths of the leg (thigh and shin, median over the frames)."""
    places = np.asarray(places, dtype=np.float64)
    bones = np.linalg.norm(places[:, [4, 5, 7, 8]] - places[:, [1, 2, 4, 5]], axis=-1)
    leg = float(np.median(bones.sum(axis=-1))) / 2
    if not leg > 0:
        raise MotionloomError("the legs have no length; these are not 22 joints of a person")
    return places / leg


def _facing_alike(theirs: Array, ours: Array) -> Array:
    """The recording turned about the vertical to face as the body does, and first set upright if it is not y up."""
    ways, misfits = [], []
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        there, here = _lines(theirs[..., axes]), _lines(ours)
        cross = there[..., 2] * here[..., 0] - there[..., 0] * here[..., 2]
        dot = there[..., 0] * here[..., 0] + there[..., 2] * here[..., 2]
        angle = np.arctan2(cross.sum(), dot.sum())  # least squares
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        ways.append(theirs[..., axes] @ turn)
        misfits.append(float(np.median(_angle(there @ turn, here))))
        if misfits[0] < _ASTRAY:
            return ways[0]
    return ways[int(np.argmin(misfits))]


def _angle(a: Array, b: Array) -> Array:
    """Degrees between vectors (..., 3)."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def _bent_alike(theirs: Array, ours: Array) -> Array:
    """Their foot (frames, 3) bent at the ankle by a constant, to be as ours is.

    theirs, ours: (frames, 2, 3) shin and foot.
    """
    gap = np.median(_angle(ours[:, 0], ours[:, 1]) - _angle(theirs[:, 0], theirs[:, 1]))
    turn = np.radians(np.clip(gap, -ANKLE, ANKLE))
    shin, foot = theirs[:, 0], theirs[:, 1]
    axis = np.cross(shin, foot)
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True).clip(1e-9)
    return np.asarray(foot * np.cos(turn) + np.cross(axis, foot) * np.sin(turn), dtype=np.float64)


def _chains(places: Array, sizes: Array) -> Array:
    """(frames, 22, 3) the joints of `PLACES` from the middle of the hips, with parts as long as those of ``sizes``.

    Parts are thighs, shins, half the hips, trunk, half the shoulders, upper arms, forearms, and from the shoulders to
    the head: where on that way a skeleton has its neck is its own affair.
    """
    result = np.zeros_like(places)

    def part(start: tuple[str, ...], end: tuple[str, ...]) -> Array:
        own, other = (_middle(p, end) - _middle(p, start) for p in (places, sizes))
        lengths = [np.median(np.linalg.norm(line, axis=-1)) for line in (own, other)]
        return own * (lengths[1] / max(lengths[0], 1e-9))

    chest = part(_HIPS, _SHOULDERS)
    result[:, _J["head"]] = chest + part(_SHOULDERS, ("head",))
    for side in _SIDES:
        for root, place, joints in ((_HIPS, np.zeros_like(chest), _LEG_JOINTS), (_SHOULDERS, chest, _ARM_JOINTS)):
            above = root
            for joint in joints:
                here = (f"{side}_{joint}",)
                place = place + part(above, here)
                result[:, _J[here[0]]] = place
                above = here
    return result
