"""Which hinge of a robot bends which part of the body: by names, else by the shape of the tree, else as a user says.

A *part* is ``left_hip`` ... ``right_wrist``, ``waist`` or ``neck``, and has the hinges that turn it, upper ones first.
Names are those of Unitree (G1, H1), Booster (T1), Fourier (N1), EngineAI (PM01), Atlas and their relatives.
"""

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_json
from motionloom.retarget.names import tokens_of
from motionloom.robots.engine import posed
from motionloom.robots.model import Hinge, Model

Array = NDArray[np.float64]
LEG, ARM = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")
SIDES = ("left", "right")
PARTS = (*(f"{s}_{p}" for s in SIDES for p in (*LEG, *ARM)), "waist", "neck")
_NEEDED = tuple(f"{s}_{p}" for s in SIDES for p in (*LEG, "shoulder", "elbow"))

_FINGERS = "thumb index middle ring pinky little finger gripper palm hand"
_WORDS = {
    "hip": "hip thigh hpz hpx hpy",
    "knee": "knee shank calf shin kny",
    "ankle": "ankle ank foot aky akx",
    "elbow": "elbow forearm lowerarm ely elx",
    "wrist": "wrist wry wrx wrz",
    "shoulder": "shoulder sho upperarm shz shx shy arm",
    "neck": "neck head aahead",
    "waist": "waist torso abdomen spine trunk chest back lumbar bkz bky bkx",
}


@dataclass(frozen=True, eq=False)
class Parts:
    """The hinges of each part."""

    hinges: dict[str, tuple[Hinge, ...]]
    """Upper ones first; a part that the robot lacks is absent."""
    how: str
    """How they were found: by their names, by the shape of the robot, or as a map says."""

    def summary(self) -> str:
        """One line for a user: how many hinges each part has."""
        names = []
        for part in (*LEG, *ARM):
            both = [len(self.hinges.get(f"{side}_{part}", ())) for side in SIDES]
            names.append(f"{part}s {both[0]}" if both[0] == both[1] else f"{part}s {both[0]} and {both[1]}")
        names += [f"{part} {len(self.hinges.get(part, ()))}" for part in ("waist", "neck")]
        return f"hinges {self.how}: {', '.join(names)}"


def find_parts(model: Model, override: Path | None = None) -> Parts:
    """Find the hinges of each part.

    override: a JSON file of part to the name of a hinge, or a list of names.
    Raises `MotionloomError` for what is no humanoid, naming the parts that were not found.
    """
    overrides = {} if override is None else _read_map(model, override)
    parts, how = _by_name(model), "by their names"
    if any(part not in parts for part in _NEEDED if part not in overrides):
        shaped = _by_shape(model)
        if shaped is not None:
            parts, how = shaped, "by the robot's shape"
    parts = {**parts, **overrides}
    lost = [part for part in _NEEDED if part not in parts]
    if lost:
        _refuse(model, lost)
    for side in SIDES:
        for limb in (LEG, ARM):
            line = [parts[f"{side}_{part}"] for part in limb if f"{side}_{part}" in parts]
            for upper, lower in pairwise(line):
                if upper[0].body not in model.above(lower[-1].body):
                    raise MotionloomError(
                        f"{model.path}: {lower[-1].name} does not hang below {upper[0].name} as a limb's joints do; "
                        "say which joint is which with --robot-map"
                    )
    return Parts(parts, "as the map says" if overrides else how)


# By names


def _by_name(model: Model) -> dict[str, tuple[Hinge, ...]]:
    parts: dict[str, list[Hinge]] = defaultdict(list)
    for hinge in model.hinges:
        names = (hinge.name, model.model.body(hinge.body).name)
        part = next((part for part in map(_read, names) if part is not None), None)
        if part is not None:
            parts[part].append(hinge)
    return {part: tuple(hinges) for part, hinges in parts.items()}


def _read(name: str) -> str | None:
    """The part that a name speaks of: ``J00_HIP_PITCH_L`` -> ``left_hip``."""
    tokens = tokens_of(name)
    side = next((s for s in SIDES if s in tokens or s[0] in tokens), None)
    if not set(tokens).isdisjoint(_FINGERS.split()):
        return None
    joined = {a + b for a, b in pairwise(tokens)}
    for part, words in _WORDS.items():
        if {*tokens, *joined}.intersection(words.split()):
            middle = part in ("waist", "neck")
            return part if middle else (f"{side}_{part}" if side else None)
    return None


# By shape


def _by_shape(model: Model) -> dict[str, tuple[Hinge, ...]] | None:
    """Two chains of hinges that reach lowest are legs, the two longest others are arms; None where there are not."""
    chains = _chains(model)
    ends = {key: _tip(model, chain[-1].body) for key, chain in chains.items()}
    legs = sorted((key for key in chains if len(chains[key]) >= 4), key=lambda key: float(ends[key][2]))[:2]
    others = [key for key in chains if key not in legs and len(chains[key]) >= 3]
    arms = sorted(others, key=lambda key: -_length(chains[key], ends[key]))[:2]
    if len(legs) < 2 or len(arms) < 2:
        return None
    parts: dict[str, tuple[Hinge, ...]] = {}
    shared = set(chains[legs[0]]) & set(chains[legs[1]]) | set(chains[arms[0]]) & set(chains[arms[1]])
    for limb, keys in ((LEG, legs), (ARM, arms)):
        by_side = sorted(keys, key=lambda key: -float(ends[key][1]))
        for side, key in zip(SIDES, by_side):
            chain = [hinge for hinge in chains[key] if hinge not in shared]
            if len(chain) < 3:
                return None
            middle = _middle(chain, ends[key])
            below = chain[middle + 1 :]
            parts[f"{side}_{limb[0]}"] = tuple(chain[:middle])
            parts[f"{side}_{limb[1]}"] = (chain[middle],)
            if below:
                parts[f"{side}_{limb[2]}"] = tuple(below)
    if shared:
        parts["waist"] = tuple(hinge for hinge in model.hinges if hinge in shared)
    return parts


def _chains(model: Model) -> dict[int, list[Hinge]]:
    """The hinges from the root down to each last hinge, by that hinge's body."""
    of = {hinge.body: hinge for hinge in model.hinges}
    chains = {body: [of[other] for other in model.above(body)[::-1] if other in of] for body in of}
    upper = {hinge.body for chain in chains.values() for hinge in chain[:-1]}
    return {body: chain for body, chain in chains.items() if body not in upper}


def _tip(model: Model, body: int) -> Array:
    """(3,) the point of a body, and of what is fixed to it, that is farthest from where it is hinged."""
    points = limb_points(model, body)
    hinge = next(h for h in model.hinges if h.body == body)
    return points[int(np.linalg.norm(points - hinge.anchor, axis=-1).argmax())]


def limb_points(model: Model, body: int) -> Array:
    """(points, 3) metres in the world of ``qpos0``: origins, centres of mass and geoms of a body and what is fixed to
    it."""
    data, points = posed(model.model), []
    for other in range(1, model.model.nbody):
        if int(model.model.body_weldid[other]) == int(model.model.body_weldid[body]):
            points += [data.xpos[other], data.xipos[other]]
            start = int(model.model.body_geomadr[other])
            points += [data.geom_xpos[g] for g in range(start, start + int(model.model.body_geomnum[other]))]
    return np.array(points)


def _length(chain: list[Hinge], end: Array) -> float:
    places = [*(hinge.anchor for hinge in chain), end]
    return float(sum(np.linalg.norm(b - a) for a, b in pairwise(places)))


def _middle(chain: list[Hinge], end: Array) -> int:
    """The hinge that parts a limb into two long bones."""
    ends = np.stack([chain[0].anchor, end])
    apart = [np.linalg.norm(ends - hinge.anchor, axis=-1).min() for hinge in chain[1:]]
    return 1 + int(np.argmax(apart))


# What is no humanoid, and what a user says


def _refuse(model: Model, lost: list[str]) -> None:
    name, chains = model.path, _chains(model)
    limbs = [chain for chain in chains.values() if len(chain) >= 3]
    low = [chain for chain in limbs if _on_ground(model, chain)]
    if len(low) >= 4:
        raise MotionloomError(f"{name} is a robot on {len(low)} legs; a humanoid with two legs and two arms is needed")
    wheels = [h.name for h in model.hinges if not model.model.jnt_limited[h.joint]]
    if not low and wheels:
        raise MotionloomError(
            f"{name} is no humanoid: no legs were found, and {wheels[0]} turns without end as a wheel does; a robot "
            "with two legs and two arms is needed"
        )
    names = ", ".join(model.joint_names()[:12]) + (", ..." if len(model.hinges) > 12 else "")
    raise MotionloomError(
        f"{name}: no hinges were found for {', '.join(lost)} among {names}; name them with --robot-map (part: hinge)"
    )


def _on_ground(model: Model, chain: list[Hinge]) -> bool:
    """Whether a limb's end is as low as anything is."""
    lowest = min(float(_tip(model, other[-1].body)[2]) for other in _chains(model).values())
    top = max(float(hinge.anchor[2]) for hinge in model.hinges)
    return float(_tip(model, chain[-1].body)[2]) < lowest + 0.15 * max(top - lowest, 1e-6)


def _read_map(model: Model, path: Path) -> dict[str, tuple[Hinge, ...]]:
    data = read_json(path, "a map of a robot's joints")
    if not isinstance(data, dict):
        raise MotionloomError(f'{path}: a map of a robot\'s joints is an object such as {{"left_knee": "knee_l"}}')
    of, parts = {hinge.name: hinge for hinge in model.hinges}, {}
    for part, value in data.items():
        names = [value] if isinstance(value, str) else value
        if part not in PARTS:
            raise MotionloomError(f"{path} speaks of {part[:40]!r}; the parts are {', '.join(PARTS)}")
        if not isinstance(names, list) or not names or not all(isinstance(n, str) and n in of for n in names):
            raise MotionloomError(f"{path} gives {part} as {str(value)[:60]}; the hinges are {', '.join(of)[:300]}")
        parts[part] = tuple(sorted((of[name] for name in names), key=lambda hinge: hinge.joint))
    return parts
