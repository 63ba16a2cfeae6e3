"""How truly a body shows a recording: directions of limbs and trunk, and places of joints, frame by frame.

Two bodies differ in size, in where they start and in which way they face at first; none of that counts. The recording
is turned about the vertical by one angle for all frames, and places are seen from the middle between the hip joints,
in centimetres on a person with legs of `LEG` metres. Three things are no error either, for no body could avoid them:

- Proportions. Places are compared with the recording scaled by the length of its legs, and with its thighs, shins,
  hips, trunk, shoulders, arms and neck made as long as the body's one by one (medians over the clip). On wider hips
  feet may stand where they stood, or legs point where they pointed: the better of the two counts.
- How high over the sole a skeleton has its ankle. The recording's foot may point up or down by a constant, of at most
  `ANKLE` degrees.
- Where a skeleton has the joint it calls pelvis: above the hips, behind them or below. The line from the hips to it is
  turned about the hips by a constant, so that its motion is compared and not where it is at rest. The constant has
  bounds: the body's own pelvis lies between hips and trunk.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]

DIRECTIONS, DIRECTION = (5.0, 15.0), (10.0, 30.0)
"""Degrees that the median and the 95th percentile stay under: of all lines together, and of each by itself.

One line in fifteen that is wrong all the time is more than 5 % of all. Legs are where a true copy comes nearest: feet
stand where the recording's do, and on hips of another breadth the thighs then lie otherwise.
"""
PLACES_CM, PLACE_CM = 4.0, 10.0
"""Centimetres that the median stays under: of all places together, and of each."""
LEG = 0.82
"""Metres of thigh and shin of the person on whom places are compared: the uniform one."""
ANKLE = 20.0
"""Degrees."""
PELVIS, STRAIGHT = 25.0, 30.0
"""Degrees by which a pelvis may be off the trunk of somebody whose trunk and thighs are in line within so many."""
_SHORT = 0.03
"""Lengths of the leg: a shorter line has no direction worth a comparison."""
_ASTRAY = 45.0
"""Degrees off (median) from which on up is another axis."""

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
_PELVIS = [*_OF["thigh"], *(_OF[name][0] for name in ("hip line", "trunk", "pelvis"))]
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
    together but the pelvis, whose line is short."""
    places: dict[str, Spread]
    """Centimetres by name of `PLACES`, and ``all``: the recording has the body's proportions."""
    by_leg: dict[str, Spread]
    """The same: the recording is scaled by the length of its legs alone."""

    def faults(self) -> list[str]:
        """What is over the limits above, the worst first, in words; empty for a true copy."""
        over: list[tuple[float, str]] = []
        for name, error in self.directions.items():
            median, high = DIRECTIONS if name == "all" else DIRECTION
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
    theirs[:, _PELVIS[-1]] = _sloped_alike(theirs[:, _PELVIS], ours[:, _PELVIS])
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
    axis = _unit(np.cross(shin, foot))
    return np.asarray(foot * np.cos(turn) + np.cross(axis, foot) * np.sin(turn), dtype=np.float64)


def _sloped_alike(theirs: Array, ours: Array) -> Array:
    """Their pelvis (frames, 3) turned about the line of the hips by a constant, to slope as ours does.

    theirs, ours: (frames, 5, 3) the lines of `_PELVIS`. The turn may put the pelvis of somebody who is straight at most
    `PELVIS` degrees off the trunk; of somebody who never is, no further off than it was.
    """
    slope, bend = _slope(theirs), _angle(theirs[:, :2], -theirs[:, 3:4]).max(axis=1)
    straight = bend <= max(float(np.percentile(bend, 10)), 10.0)
    gap = np.median((_slope(ours) - slope + 180) % 360 - 180)
    if np.median(bend[straight]) < STRAIGHT:
        near = far = -float(np.median(slope[straight]))
    else:
        near, far = min(-float(slope.max()), 0.0), max(-float(slope.min()), 0.0)
    turn = np.radians(np.clip(gap, near - PELVIS, far + PELVIS))
    axis, pelvis = _unit(theirs[:, 2]), theirs[:, 4]
    along = axis * (axis * pelvis).sum(axis=-1, keepdims=True)
    return np.asarray(along + (pelvis - along) * np.cos(turn) + np.cross(axis, pelvis) * np.sin(turn))


def _slope(lines: Array) -> Array:
    """Degrees (frames,) from the trunk to the pelvis about the hips, of the lines of `_PELVIS` (frames, 5, 3)."""
    axis, trunk, pelvis = _unit(lines[:, 2]), lines[:, 3], lines[:, 4]
    across = (axis * np.cross(trunk, pelvis)).sum(axis=-1)
    along = (trunk * pelvis).sum(axis=-1) - (axis * trunk).sum(axis=-1) * (axis * pelvis).sum(axis=-1)
    return np.degrees(np.arctan2(across, along))


def _unit(lines: Array) -> Array:
    return lines / np.linalg.norm(lines, axis=-1, keepdims=True).clip(1e-9)


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
