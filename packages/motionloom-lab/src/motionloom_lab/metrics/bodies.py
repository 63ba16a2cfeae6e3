"""How bodies are held, beside recorded people on their own skeletons: bends, the height of a standing head, bones.

The other numbers of realism compare generated motions with clips of a built set, and what was wrong with the bodies
of a set would be wrong on both sides. These compare with recordings before anything was retargeted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import HUMANML_BONE_LENGTHS, SMPL22
from motionloom.kinematics.physics import Array, J
from motionloom.kinematics.wholeness import angles

LEVELS = (0.5, 5.0, 50.0, 95.0, 99.5)
"""Percentiles of recorded people that are kept of each number."""
OUTSIDE = 0.03
"""Share of frames that may lie outside of 99 % of what people do; of recordings it is 0.01."""
STRETCHED = 0.1
"""By how much the median length of a bone may differ from the person's, in its own lengths."""
ASTRAY = 40.0
"""Degrees: where a recording's median bend of pelvis or spine is more, its skeleton has those joints elsewhere."""
SLACK_CM = 6.0
"""How far a head may be out of reach: generated backs are curved, and recorded ones are measured as if straight."""
STRAIGHT = 35.0
"""Degrees: knees that are bent less are those of somebody who stands (or lies; then hips are not high)."""

Reach = dict[str, tuple[float, ...]]
"""Percentiles `LEVELS` of recorded people, by the name of `MEANING`."""

MEANING = {
    "pelvis": "degrees between pelvis and trunk",
    "spine": "degrees between the lower and the upper half of the back",
    "neck": "degrees between trunk and head",
    "knees": "degrees that knees are bent; minus to the front",
    "elbows": "degrees that elbows are bent",
    "head": "cm from ankles to head of somebody who stands on straight legs",
}


@dataclass(frozen=True)
class BodyNumber:
    """One number of generated bodies beside recorded ones."""

    name: str
    median: float
    outside: float
    """Share of frames beyond the first and the last of `LEVELS`."""
    reach: tuple[float, ...]

    @property
    def passes(self) -> bool:
        """The median is within 90 % of people's frames, and few frames beyond 99 %."""
        slack = _slack(self.name)
        return self.reach[1] - slack <= self.median <= self.reach[3] + slack and self.outside <= OUTSIDE


def signals(positions: Array, *, own: bool = False) -> dict[str, Array]:
    """The numbers of `MEANING` of one motion (frames, 22, 3) metres, one per frame and side; ``head`` may be empty.

    own: whether the skeleton is the recording's own; the height of the head is then that of the uniform person in the
    same pose.
    """
    bend, middles = angles(positions), _middles(positions)
    legs = middles[1] - middles[0]
    upright = (np.abs(bend.knees).max(axis=1) < STRAIGHT) & (legs[:, 1] > 0.95 * np.linalg.norm(legs, axis=-1))
    return {
        "pelvis": bend.pelvis,
        "spine": bend.spine,
        "neck": bend.neck,
        "knees": bend.knees.ravel(),
        "elbows": bend.elbows.ravel(),
        "head": 100 * _head(middles, own=own)[upright],
    }


def reach_of(recordings: Iterable[Array]) -> Reach:
    """Percentiles of recorded people; recordings are (frames, 22, 3) metres on their own skeletons.

    Raises `MotionloomError` where none of them shows one of the numbers.
    """
    pooled: dict[str, list[Array]] = {name: [] for name in MEANING}
    for positions in recordings:
        for name, values in signals(positions, own=True).items():
            if len(values) and not (name in ("pelvis", "spine") and np.median(values) > ASTRAY):
                pooled[name].append(values)
    lacking = [name for name, parts in pooled.items() if not parts]
    if lacking:
        raise MotionloomError(
            f"none of the recordings shows {', '.join(lacking)}; name more of people who stand and move"
        )
    return {
        name: tuple(round(float(v), 2) for v in np.percentile(np.concatenate(parts), LEVELS))
        for name, parts in pooled.items()
    }


def compare_bodies(clips: Sequence[Array], reach: Reach) -> list[BodyNumber]:
    """The numbers of generated motions, (frames, 22, 3) metres each; ``head`` is left out where nobody stands."""
    parts = [signals(clip) for clip in clips]
    rows = []
    for name in MEANING:
        values = np.concatenate([one[name] for one in parts] or [np.zeros(0)])
        if len(values):
            low, high = reach[name][0] - _slack(name), reach[name][-1] + _slack(name)
            outside = float(((values < low) | (values > high)).mean())
            rows.append(BodyNumber(name, round(float(np.median(values)), 2), round(outside, 4), reach[name]))
    return rows


def _slack(name: str) -> float:
    return SLACK_CM if name == "head" else 0.0


def stretched(clips: Sequence[Array]) -> float:
    """How far the bone that differs most is from the person's, in its lengths; of medians over each clip."""
    person, parents = np.array(HUMANML_BONE_LENGTHS), list(SMPL22.parents[1:])
    bones = [np.median(np.linalg.norm(p[:, 1:] - p[:, parents], axis=-1), axis=0) for p in clips]
    return float(np.abs(np.array(bones) / person - 1).max()) if bones else 0.0


def _middles(positions: Array) -> tuple[Array, Array, Array, Array]:
    """(frames, 3) each: the middle of the ankles, of the hips and of the shoulders, and the head."""
    p = np.asarray(positions, dtype=np.float64)
    joints = (("left_ankle", "right_ankle"), ("left_hip", "right_hip"), ("left_shoulder", "right_shoulder"), ("head",))
    ankles, hips, shoulders, head = (p[:, [J[name] for name in names]].mean(axis=1) for names in joints)
    return ankles, hips, shoulders, head


def _head(middles: tuple[Array, Array, Array, Array], *, own: bool) -> Array:
    """(frames,) metres from the ankles up to the head; own: of the uniform person in the same pose."""
    if not own:
        return middles[3][:, 1] - middles[0][:, 1]
    lines = [end - start for start, end in pairwise(middles)]
    directions = [line[:, 1] / np.linalg.norm(line, axis=-1).clip(1e-9) for line in lines]
    sizes = [np.linalg.norm(end - start) for start, end in pairwise(_middles(SMPL22.rest_positions()[None]))]
    return np.asarray(sum(up * size for up, size in zip(directions, sizes, strict=True)), dtype=np.float64)
