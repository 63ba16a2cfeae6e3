"""Poses of hands for rigs that have fingers: the prior moves wrists, and what is below them can be given a pose.

The palm is found from where fingers begin: they go on from the wrist, side by side from the little finger to the one
next to the thumb, and on a left hand the palm faces ``along x across``. Each finger is laid straight, then bent by its
joints' angles about the hinge that lies across it; so hands end up alike whatever pose a rig has at rest.
"""

import re
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.retarget.anatomy import Body, read_body
from motionloom.retarget.joint_map import Override

Array = NDArray[np.float64]
HandPose = Literal["relaxed", "fist", "flat", "as-is"]
POSES: tuple[str, ...] = get_args(HandPose)
_WORDS = "thumb index middle ring pinky pinkie little finger mid"
_NO_PHALANX = "metacarpal inhand palm target pole _ik twist slot"
_ORDER = ("index", "mid middle", "ring", "pinky pinkie little")
# Degrees by which knuckle, middle and end joint bend, of the finger next to the thumb and of the little finger.
_BENDS = {
    "relaxed": ((16, 26, 12), (34, 38, 20)),
    "fist": ((80, 98, 60), (86, 100, 62)),
    "flat": ((0, 0, 0), (0, 0, 0)),
}
_THUMB = {"relaxed": (4, 10, 14), "fist": (28, 38, 48), "flat": (0, 0, 0)}
_GATHERED = {"relaxed": 0.4, "fist": 0.85, "flat": 0.0}
"""How far fingers that are spread at rest come together, 0 to 1."""


@dataclass(frozen=True)
class _Hand:
    fingers: tuple[tuple[int, ...], ...]
    """Joints of each finger from the knuckle on, from the one next to the thumb to the little one."""
    thumb: tuple[int, ...]
    along: Array
    """(3,) from the wrist to the fingers, at rest."""
    across: Array
    """(3,) from the little finger to the thumb's side."""
    palm: Array
    """(3,) out of the palm."""


def pose_hands(motion: Motion, pose: HandPose, override: Override | None = None) -> Motion:
    """The motion with its fingers in one pose throughout; everything else is as it was.

    ``pose`` is "relaxed", "fist", "flat" or "as-is", which changes nothing. ``override`` is a joint map's, as of
    `motionloom.retarget.joint_map`. Raises `MotionloomError` for another pose, or where the skeleton is no humanoid or
    has no fingers whose palm can be found.
    """
    if pose not in POSES:
        raise MotionloomError(f"hands are {', '.join(POSES)}; got {pose!r}")
    if pose == "as-is":
        return motion
    hands = _hands(read_body(motion.skeleton, override))
    rotations = motion.rotations.copy()
    for hand in hands:
        for joint, turn in _turns(motion.skeleton, hand, pose).items():
            rotations[:, joint] = turn
    return replace(motion, rotations=rotations)


def check_fingers(body: Body) -> None:
    """Raise `MotionloomError` where a body has no fingers that `pose_hands` could pose."""
    _hands(body)


def _hands(body: Body) -> list[_Hand]:
    hands = [hand for side in (0, 1) if (hand := _read_hand(body, side)) is not None]
    if not hands:
        raise MotionloomError("the skeleton has no fingers that could be posed; leave out --hands")
    return hands


def _read_hand(body: Body, side: int) -> _Hand | None:
    """The left (0) or the right (1) hand; None where it has no fingers."""
    skeleton = body.skeleton
    elbow = body.drivers[18 + side]
    chains = _chains(skeleton, [] if elbow is None else skeleton.below(elbow)[1:])
    thumb = _thumb_of(skeleton, chains, body.rest[20 + side])
    fingers = [chain for chain in chains if chain != thumb]
    if not fingers:
        return None
    rest = skeleton.rest_positions()
    bases = rest[[chain[0] for chain in fingers]]
    along = _unit(bases.mean(axis=0) - body.rest[20 + side])
    across = bases[0] - bases[-1] if len(fingers) > 1 else np.zeros(3)
    if thumb and len(fingers) == 1:
        across = rest[thumb[0]] - bases[0]
    elif thumb and float((rest[thumb[0]] - bases.mean(axis=0)) @ across) < 0:  # named from the other end
        fingers, across = fingers[::-1], -across
    across = across - float(across @ along) * along
    tiny = 1e-6 * max(body.leg, 1e-9)
    if np.linalg.norm(across) < tiny or np.linalg.norm(along) < 0.5:
        return None
    across = _unit(across)
    palm = np.cross(along, across) * (1 - 2 * side)
    return _Hand(tuple(fingers), thumb, along, across, palm)


def _chains(skeleton: Skeleton, below: list[int]) -> list[tuple[int, ...]]:
    """The joints of each finger that can turn, from the index (or the first in number) to the little finger."""
    named = {j for j in below if j not in skeleton.ends and _word(skeleton.names[j])}
    chains: list[tuple[int, ...]] = []
    for top in sorted(named):
        if skeleton.parents[top] in named:
            continue
        chain = [top]
        while on := [j for j in skeleton.children(chain[-1]) if j in named]:
            chain.append(on[0])
        longer = len(chain) > 3 and not skeleton.children(chain[-1])
        chains.append(tuple(chain[:-1] if longer else chain[:3]))  # a fourth joint is the tip
    return sorted(chains, key=lambda chain: (_rank(skeleton.names[chain[0]]), chain))


def _word(name: str) -> str:
    """Which finger a joint's name speaks of; nothing for bones of the palm and helpers."""
    low = name.lower()
    if any(word in low for word in _NO_PHALANX.split()):
        return ""
    return next((word for word in _WORDS.split() if word in low), "")


def _rank(name: str) -> float:
    word = _word(name)
    number = re.search(r"finger\D*(\d)", name.lower())
    if word == "finger":
        return 10 + (int(number.group(1)) if number else 0)
    places = (place for place, words in enumerate(_ORDER, start=1) if word in words.split())
    return float(next(places, 0))


def _thumb_of(skeleton: Skeleton, chains: list[tuple[int, ...]], wrist: Array) -> tuple[int, ...]:
    """The thumb by its name; of five numbered fingers the one that begins next to the wrist."""
    for chain in chains:
        name = skeleton.names[chain[0]].lower()
        if "thumb" in name or re.search(r"finger_?0", name):
            return chain
    rest = skeleton.rest_positions()
    if len(chains) < 5:
        return ()
    return min(chains, key=lambda chain: float(np.linalg.norm(rest[chain[0]] - wrist)))


def _turns(skeleton: Skeleton, hand: _Hand, pose: HandPose) -> dict[int, Array]:
    """(4,) rotations of the fingers' joints in their parents' frames."""
    turns: dict[int, Array] = {}
    first, last = (np.radians(bend) for bend in _BENDS[pose])
    for number, chain in enumerate(hand.fingers):
        share = number / max(len(hand.fingers) - 1, 1)
        own = _bones(skeleton, chain)[0]
        flat = _unit(own - float(own @ hand.palm) * hand.palm)
        straight = _unit(flat + _GATHERED[pose] * (hand.along - flat))
        bends = _shared(first * (1 - share) + last * share, len(chain))
        turns |= _bent(skeleton, chain, straight, hand.palm, bends)
    if hand.thumb:
        own = _bones(skeleton, hand.thumb)[0]
        inwards = 0.6 * hand.palm - 0.8 * hand.across
        bends = _shared(np.radians(_THUMB[pose]), len(hand.thumb))
        turns |= _bent(skeleton, hand.thumb, own, inwards, bends)
    return turns


def _bent(
    skeleton: Skeleton, chain: tuple[int, ...], straight: Array, towards: Array, bends: Array
) -> dict[int, Array]:
    """A finger laid along ``straight`` (3,), each joint bent by so many radians ``towards`` (3,)."""
    hinge = _unit(np.cross(straight, towards))
    turns: dict[int, Array] = {}
    above, angle = rot.IDENTITY, 0.0
    for joint, bone, bend in zip(chain, _bones(skeleton, chain), bends, strict=True):
        angle += float(bend)
        turn = rot.multiply(rot.rotvec_to_quat(hinge * angle), rot.shortest_arc(bone, straight))
        turns[joint] = rot.normalize(rot.multiply(rot.inverse(above), turn))
        above = turn
    return turns


def _bones(skeleton: Skeleton, chain: tuple[int, ...]) -> list[Array]:
    """Where each joint's bone points at rest; a last one without a tip goes on as the one before."""
    rest, bones = skeleton.rest_positions(), []
    for number, joint in enumerate(chain):
        below = skeleton.children(joint)
        nearest = chain[number + 1] if number + 1 < len(chain) else next(iter(below), None)
        bone = np.zeros(3) if nearest is None else rest[nearest] - rest[joint]
        if np.linalg.norm(bone) < 1e-9:
            bone = bones[-1] if bones else rest[joint] - rest[max(skeleton.parents[joint], 0)]
        bones.append(_unit(bone))
    return bones


def _shared(bends: Array, count: int) -> Array:
    """The angles of three joints on a finger that has fewer."""
    if count == 1:
        return np.array([bends[0] + 0.5 * bends[1]])
    return np.array([bends[0], bends[1] + 0.5 * bends[2]]) if count == 2 else bends[:count]


def _unit(v: Array) -> Array:
    return v / max(float(np.linalg.norm(v)), 1e-12)
