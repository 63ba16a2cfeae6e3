"""Reading joint names: which part of the body, which side. Names from Mixamo, CMU conversions, Biped, Unreal,
Rokoko, Perception Neuron, Xsens, VRM, SMPL and their relatives; plain spelling differences are ignored.
"""

import re

import numpy as np

from motionloom.core.skeleton import Skeleton

Parts = dict[str, int]
"""Body part, such as ``left_knee`` or ``pelvis``, to joint number."""

_TOKEN = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_MARKS = {"left": "left lft lt l", "right": "right rgt rt r"}
_NOISE = """bip bip001 biped mixamorig cc rl base armature character skeleton skel
robot jnt joint bone bn def org rig valve sim avg c j m f"""
_HELPERS = "twist roll ik pole end nub tip site target effector share corrective"

# Words of each part in order of preference: an earlier word wins where a skeleton has several.
_SIDED = {
    "hip": "upleg upperleg thigh femur hip",
    "knee": "lowerleg lowleg loleg shin calf tibia knee leg",
    "ankle": "ankle foot",
    "foot": "toebase toe toes ball foot",
    "collar": "clavicle collar collarbone innershoulder shoulder",
    "shoulder": "upperarm uparm humerus shldr arm shoulder",
    "elbow": "lowerarm lowarm loarm forearm elbow radius",
    "wrist": "wrist hand",
}
_MIDDLE = {"pelvis": "pelvis hips hip lowertorso", "neck": "neck lowerneck neckbase", "head": "head"}
_WORDS = set(" ".join((*_SIDED.values(), *_MIDDLE.values())).split())


def tokens_of(name: str) -> list[str]:
    """The words and numbers of a name in small letters: ``LeftUpLeg1`` has left, up, leg and 1."""
    return [token.lower() for token in _TOKEN.findall(name)]


def _side(name: str) -> tuple[str, list[str]]:
    """``left``, ``right`` or ``middle`` and the tokens that remain."""
    tokens = tokens_of(re.split(r"[:|]", name)[-1])
    for side, marks in _MARKS.items():
        if any(t in marks.split() for t in tokens):
            return side, [t for t in tokens if t not in marks.split()]
    for i, token in enumerate(tokens):  # run together, as in lfemur or rightupleg
        for side, marks in _MARKS.items():
            for mark in marks.split():  # the longest first
                if token.startswith(mark) and token[len(mark) :] in _WORDS:
                    return side, [*tokens[:i], token[len(mark) :], *tokens[i + 1 :]]
    return "middle", tokens


def _plain(tokens: list[str]) -> str:
    return "".join(t for t in tokens if not t.isdigit() and t not in _NOISE.split())


def read_name(name: str) -> tuple[str, str]:
    """Side and word of one joint name: ``mixamorig:LeftUpLeg`` -> ``("left", "upleg")``; helpers give ``""``."""
    side, tokens = _side(name)
    if not set(tokens).isdisjoint(_HELPERS.split()):
        return side, ""
    numbers = [t for t in tokens if t.isdigit() and t not in ("0", "00", "1", "01")]
    return side, "" if numbers else _plain(tokens)


def read_word(name: str) -> str:
    """The word of a joint's name without side and number: ``DEF-spine.003`` -> ``spine``."""
    _, tokens = _side(name)
    return _plain(tokens)


def parts_by_name(skeleton: Skeleton) -> Parts:
    """The parts whose joints the names give, sided ones as ``left_knee``; what is not named is left out."""
    joints: dict[tuple[str, str], int] = {}
    for j in range(len(skeleton)):
        if j not in skeleton.ends:
            joints.setdefault(read_name(skeleton.names[j]), j)  # parents come first: the upper of two wins
    parts: Parts = {}
    for part, words in _MIDDLE.items():
        joint = next((joints["middle", w] for w in words.split() if ("middle", w) in joints), None)
        if joint is not None:
            parts[part] = joint
    for side in ("left", "right"):
        parts.update(_sided(skeleton, side, joints))
    return _apart(skeleton, parts)


def _apart(skeleton: Skeleton, parts: Parts) -> Parts:
    """The parts with hips that are two: where both begin in one place, the next joint of that name is the hip."""
    hips = [parts.get(f"{side}_hip") for side in ("left", "right")]
    rest = skeleton.rest_positions()
    if None in hips or np.abs(rest[hips[0]] - rest[hips[1]]).max() > 1e-6:
        return parts
    for part, joint in zip(("left_hip", "right_hip"), hips):
        assert joint is not None
        own = read_name(skeleton.names[joint])
        alike = [j for j in skeleton.children(joint) if read_name(skeleton.names[j]) == own]
        parts[part] = alike[0] if alike else joint
    return parts


def _sided(skeleton: Skeleton, side: str, joints: dict[tuple[str, str], int]) -> Parts:
    here = {word: j for (s, word), j in joints.items() if s == side}
    limb = {part: next((here[w] for w in words.split() if w in here), None) for part, words in _SIDED.items()}
    if limb["foot"] is not None and limb["foot"] == limb["ankle"]:
        limb["foot"] = None  # "foot" is the toe joint only where an "ankle" is above it
    if limb["collar"] is not None and limb["collar"] == limb["shoulder"]:
        limb["collar"] = None  # "shoulder" is the collar bone only where an upper arm hangs on it
    wrist, hand = here.get("wrist"), here.get("hand")
    carries = hand is not None and not skeleton.ends.issuperset(skeleton.children(hand))
    if wrist is not None and hand is not None and skeleton.parents[hand] == wrist and carries:
        limb["wrist"] = hand  # a wrist that only ends the forearm: the hand turns
    if limb["hip"] is None and "leg" in here and "knee" in here:
        limb["hip"], limb["knee"] = here["leg"], here["knee"]
    return {f"{side}_{part}": j for part, j in limb.items() if j is not None}
