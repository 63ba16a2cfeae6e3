"""Manners of moving put on recorded people: the same person who limps, marches, tiptoes, sneaks, is drunk or cold.

A manner is a row of ``manners.toml``: changes of time, footholds, feet, pelvis, trunk and arms, as amounts that grow
with a strength. They are kinematic: stances move as rigid wholes (`data.gait`), knees follow in closed form, what the
person does besides stays. Each row cites what the literature measured, and `data.manner_measures` checks every clip.
"""

from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.body.feet import envelope
from motionloom.core.reading import read_table
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.retarget import limbs
from motionloom_train.data.gait import FEET, LENGTHS, Gait, moved_feet, read_gait, retimed, with_bones

Place = tuple[float, float, float]
_ARMS = ((16, 18, 20, 1.0), (17, 19, 21, -1.0))
_NAMES = ("left", "right")
_TRUNK = (3, 6, 9)
"""Joints about which the trunk bends, a third each."""


@dataclass(frozen=True)
class Manner:
    """One row of ``manners.toml``, which explains each part. Amounts are those of strength 1."""

    name: str
    on: tuple[str, ...]
    says: dict[str, tuple[str, ...]]
    """Verb phrases by what the body does (``walk``, ``run``, ``stand``)."""
    lines: tuple[str, ...]
    """Whole sentences that people type, for those who walk (or whatever comes first in ``on``)."""
    sided: tuple[str, ...] = ()
    """Of walkers, with ``{side}``: the leg that is hurt, the hand that holds."""
    measures: str = ""
    tempo: float = 1.0
    step: float = 1.0
    width: float = 0.0
    clearance: float = 1.0
    rollover: float = 1.0
    heel: float = 0.0
    knee: float = 0.0
    turnout: float = 0.0
    crouch: float = 0.0
    bob: float = 1.0
    sway: float = 0.0
    list: float = 0.0
    wander: float = 0.0
    stray: float = 0.0
    unsteady: float = 0.0
    uneven: float = 0.0
    stamp: float = 0.0
    lean: float = 0.0
    hunch: float = 0.0
    head: float = 0.0
    shoulders: float = 0.0
    lurch: float = 0.0
    twist: float = 0.0
    swing: float = 1.0
    drive: float = 0.0
    hang: float = 0.0
    out: float = 0.0
    straight: float = 0.0
    elbow: float = 0.0
    tremble: float = 0.0
    hurt: float = 0.0
    left: tuple[Place, Place] | None = None
    """Place and elbow of the left hand; None: it swings."""
    right: tuple[Place, Place] | None = None
    hips: bool = False
    one_hand: bool = False
    handed: bool = False

    def at(self, strength: float) -> "Manner":
        """The manner with all its amounts at another strength."""
        new: dict[str, Any] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float):
                usual = float(field.default)  # type: ignore[arg-type]
                new[field.name] = usual * (value / usual) ** strength if usual and value else value * strength
        return replace(self, **new)


def _read() -> dict[str, Manner]:
    rows: dict[str, dict[str, Any]] = read_table("motionloom_train.data", "manners.toml")
    manners = {}
    for name, entry in rows.items():
        row: dict[str, Any] = {k: float(v) if type(v) is int else v for k, v in entry.items() if k != "literature"}
        kept: dict[str, Any] = {
            "says": {on: tuple(row.pop(on)) for on in ("walk", "run", "stand") if on in row},
            **{side: tuple(map(tuple, row.pop(side))) for side in _NAMES if side in row},
            **{key: tuple(row.pop(key, ())) for key in ("lines", "sided")},
        }
        manners[name] = Manner(name, tuple(kept["says"]), **kept, **row)
    return manners


MANNERS: dict[str, Manner] = _read()


def put_on(
    body: Array, manner: Manner, *, fps: float, rng: np.random.Generator, strength: float = 1.0, side: str = "right"
) -> Array:
    """Somebody (frames, 22, 3) in metres who walks, runs or stands, in a manner; other frames, for its time differs.

    Args:
        body: of the uniform person, +Y up, floor at 0.
        manner: one of `MANNERS`.
        fps: frames per second, of the result too.
        rng: for what is irregular.
        strength: 1 is usual.
        side: the leg that is hurt, the hand that holds.
    """
    much = manner.at(strength)
    gait = read_gait(body, fps)
    gait = retimed(gait, _rate(gait, much, side, rng))
    noise = _Noise(len(gait.places), fps, rng)
    p, feet = _stepped(gait, much, side, noise)
    feet = _feet(gait, feet, much, side)
    ahead = np.stack([limbs.unit((f[:, 1] - f[:, 0]) * [1, 0, 1]) for f in feet], axis=1)
    _move_pelvis(p, gait, much, side)
    _move_trunk(p, gait, much, side, noise)
    ankles = np.stack([f[:, 0] for f in feet], axis=1)
    p += [0, _stretch(gait.places, gait.places[:, [7, 8]]) - _stretch(p, ankles) - much.crouch, 0]
    _raise_knees(p, gait, feet, much)
    ankles, toes = (np.stack([f[:, k] for f in feet], axis=1) for k in (0, 1))
    p -= _out_of_reach(p, ankles, gait)[:, None, None] * [0, 1, 0]
    p = with_bones(p, ankles, toes, ahead)
    _move_arms(p, gait, much, side, noise)
    return p[_known_steps(gait)]


def _known_steps(gait: Gait) -> slice:
    """The frames from the first stance of both feet to the last: where a swing goes to beyond is not known."""
    first, last = 0, len(gait.places)
    for spans in gait.spans:
        if spans:
            first, last = max(first, spans[0][0] - 1), min(last, spans[-1][1] + 1)
    return slice(first, last) if last - first > 20 else slice(None)


class _Noise:
    """Smooth random curves of one clip."""

    def __init__(self, frames: int, fps: float, rng: np.random.Generator) -> None:
        self._time, self._rng = np.arange(frames) / fps, rng

    def curve(self, slow: float, fast: float) -> Array:
        """(frames,) of variance about 1, of frequencies from ``slow`` to ``fast`` Hz."""
        rate, phase = self._rng.uniform(slow, fast, 4), self._rng.uniform(0, 2 * np.pi, 4)
        return np.sin(2 * np.pi * self._time[:, None] * rate + phase).sum(axis=1) / np.sqrt(2)

    def step(self) -> Array:
        """(3,) of variance 1, within two of it."""
        return self._rng.normal(size=3).clip(-2, 2)


def _rate(gait: Gait, manner: Manner, side: str, rng: np.random.Generator) -> Array:
    """(frames,) how fast the recording runs."""
    rate = np.full(len(gait.places), manner.tempo)
    if manner.hurt:  # the hurt leg alone carries the body for a shorter time, the sound one for longer
        sign = 1.0 if side == "left" else -1.0
        support = sign * gait.support()
        rate = rate * (1 + 0.9 * manner.hurt * support.clip(0) - 0.22 * manner.hurt * (-support).clip(0))
    if manner.uneven:
        rate = rate * np.exp(manner.uneven * _Noise(len(rate), gait.fps, rng).curve(0.3, 1.1))
    if manner.stamp:  # a stamping foot hangs in the air and comes down fast
        for start, _ in (*gait.spans[0], *gait.spans[1]):
            rate[max(start - 3, 0) : start + 1] *= 1 + 0.5 * manner.stamp
            rate[max(start - 8, 0) : max(start - 4, 0)] *= 1 - 0.25 * manner.stamp
    return rate.clip(0.3, 2.5)


def _stepped(gait: Gait, manner: Manner, side: str, noise: _Noise) -> tuple[Array, list[Array]]:
    """The body along its new way, (frames, 22, 3), and both feet, (frames, 2, 3) ankle and toes."""
    p, fps = gait.places, gait.fps
    ground = np.array([1.0, 0.0, 1.0])
    path = ph.smooth(ph.smooth(p[:, 0] * ground, ph.odd(fps)), ph.odd(fps / 2))
    facing = ph.smooth(ph.heading(p), ph.odd(fps))
    speed = np.linalg.norm(np.gradient(path, axis=0), axis=-1) * fps
    walks = smoothstep(speed / 0.5)
    aside = manner.wander * noise.curve(0.12, 0.3) * ph.smooth(walks, ph.odd(fps))
    aside -= aside[0]
    steps = np.diff(path, axis=0, prepend=path[:1]) * manner.step
    left = np.stack([np.cos(facing), 0 * facing, -np.sin(facing)], axis=-1)
    new = path[:1] + np.cumsum(steps, axis=0) + aside[:, None] * left
    turn = np.arctan2(np.gradient(aside) * fps, np.maximum(manner.step * speed, 0.6)) * walks
    turn = ph.smooth(turn, ph.odd(fps / 2))
    offset = p - path[:, None]
    body = new[:, None] + ph.turned(offset, -turn[:, None])
    body[:, :, 1] = p[:, :, 1]
    feet = []
    for i, (_, _, ankle, toes, outward) in enumerate(FEET):
        spans = gait.spans[i]
        if not spans:
            feet.append(body[:, [ankle, toes]])
            continue
        middle = np.array([(a + b) // 2 for a, b in spans])
        anchor = np.stack([(p[a:b, ankle] + p[a:b, toes]).mean(axis=0) / 2 * ground for a, b in spans])
        place = ph.turned(anchor - path[middle], facing[middle])
        place[:, 2] *= manner.step
        moving = walks[middle]
        place[:, 0] += outward * manner.width * np.maximum(moving, 0.4)
        if manner.hurt:
            place[:, 2] += (0.05 if _NAMES[i] == side else -0.07) * manner.hurt * moving
        place += moving[:, None] * manner.stray * np.stack([noise.step() for _ in spans]) * [0.7, 0, 1.0]
        crossed = outward * place[:, 0] < 0.0
        place[crossed, 0] = 0.0
        to = new[middle] + ph.turned(place, -(facing[middle] + turn[middle]))
        angle = turn[middle] + np.radians(manner.turnout) * outward
        put = np.stack([anchor, to], axis=1)
        feet.append(np.stack([moved_feet(gait, p[:, j], spans, put, angle) for j in (ankle, toes)], axis=1))
    return body, feet


def _feet(gait: Gait, feet: list[Array], manner: Manner, side: str) -> list[Array]:
    """Heels, soles and clearance: (frames, 2, 3) each, as `_stepped` places them, rolling otherwise."""
    result = []
    for i, (foot, (_, _, _, toes, outward)) in enumerate(zip(feet, FEET)):
        hurt = manner.hurt if _NAMES[i] == side else 0.0
        ahead = foot[:, 1] - foot[:, 0]
        level = limbs.unit(ph.smooth(limbs.unit(ahead * [1, 0, 1]), 3))  # a foot on its tip points anywhere
        pitch = np.arctan2(-ahead[:, 1], np.linalg.norm(ahead[:, [0, 2]], axis=-1))
        stands = gait.planted[:, 2 * i] & gait.planted[:, 2 * i + 1]
        flat = float(np.median(pitch[stands])) if stands.any() else np.radians(25)
        rolling = manner.rollover * (1 - 0.55 * min(hurt, 1))
        high = _softly_above(flat + rolling * (pitch - flat), flat + np.radians(manner.heel), manner.heel)
        rest = float(np.percentile(foot[:, 1, 1], 15))
        air = smoothstep(2 * _swing_share(gait, i))
        lifted = (foot[:, 1, 1] - rest).clip(0)
        low = manner.clearance * (1 - 0.5 * min(hurt, 1))
        lifted = lifted * (air * low + (1 - air) * (rolling if not manner.heel else 0.0))
        toe = foot[:, 1].copy()
        toe[:, 1] = rest + lifted
        if hurt:
            toe += 0.1 * hurt * outward * air[:, None] * _left_of(_forward(gait.places))
        high = high.clip(-0.6, 1.45)
        heel = toe + LENGTHS[toes] * (np.sin(high)[:, None] * [0, 1, 0] - np.cos(high)[:, None] * level)
        heel[:, 1] = np.maximum(heel[:, 1], 0.045)
        result.append(np.stack([heel, toe], axis=1))
    return result


def _left_of(level: Array) -> Array:
    return np.stack([level[:, 2], 0 * level[:, 0], -level[:, 0]], axis=-1)


def _softly_above(value: Array, least: float, heel: float) -> Array:
    """The value, raised to ``least`` without a corner, where a manner raises the heel."""
    if not heel:
        return value
    excess = (value - least) / 0.15
    return least + 0.15 * np.log1p(np.exp(excess.clip(-30, 30)))


def _swing_share(gait: Gait, i: int) -> Array:
    """(frames,) 0 while the foot stands, else how near it is to the middle of its swing, linearly up to 1."""
    result = np.zeros(len(gait.places))
    spans = gait.spans[i]
    for (_, first), (last, _) in pairwise(spans):
        count = last - first + 2
        result[first - 1 : last + 1] = 1 - np.abs(np.linspace(-1, 1, count))
    if spans:  # swings at either end, of which a part is seen
        head, tail = spans[0][0], len(result) - spans[-1][1]
        result[:head] = np.minimum(np.arange(head, 0, -1) / 5, 1)
        result[len(result) - tail :] = np.minimum(np.arange(1, tail + 1) / 5, 1)
    return result


def _raise_knees(p: Array, gait: Gait, feet: list[Array], manner: Manner) -> None:
    """Bring swinging feet, in place, under knees that go up before the hips."""
    if not manner.knee:
        return
    for i, (hip, knee, ankle, _, _) in enumerate(FEET):
        amount = manner.knee * np.sin(np.pi / 2 * _swing_share(gait, i))[:, None] ** 1.6
        ahead = _forward(p)
        thigh = np.radians(82)
        high = p[:, hip] + LENGTHS[knee] * (np.sin(thigh) * ahead - np.cos(thigh) * np.array([0, 1, 0]))
        high = high - LENGTHS[ankle] * np.array([0, 0.99, 0]) - 0.06 * ahead
        moved = amount.clip(0, 1) * (high - feet[i][:, 0])
        feet[i] += moved[:, None]


def _forward(p: Array) -> Array:
    facing = ph.heading(p)
    return np.stack([np.sin(facing), 0 * facing, np.cos(facing)], axis=-1)


def _move_pelvis(p: Array, gait: Gait, manner: Manner, side: str) -> None:
    """Heights, sway and list of the pelvis, in place."""
    support = gait.support()
    sign = 1.0 if side == "left" else -1.0
    forward = _forward(p)
    left = _left_of(forward)
    height = ph.smooth(p[:, 0, 1], ph.odd(gait.fps))
    down = (manner.bob - 1) * (p[:, 0, 1] - height)
    # down on the hurt leg, up on the sound one, for the stiff leg to pass
    down = down - manner.hurt * (0.03 * (sign * support).clip(0) - 0.025 * (-sign * support).clip(0))
    aside = manner.sway * support
    p += (aside[:, None] * left + down[:, None] * [0, 1, 0])[:, None]
    # the pelvis drops at the side of the leg that swings
    roll = np.radians(manner.list) * support + np.radians(6) * manner.hurt * sign * np.abs(support)
    _turn(p, 0, roll[:, None] * forward)
    _turn(p, 3, -roll[:, None] * forward)


def _move_trunk(p: Array, gait: Gait, manner: Manner, side: str, noise: _Noise) -> None:
    """Lean, hunch, twist and sway of the trunk, head and shoulders, in place."""
    forward = _forward(p)
    left = _left_of(forward)
    support, stride = gait.support(), ph.smooth(gait.stride(), 3)
    sign = 1.0 if side == "left" else -1.0
    lurch = np.radians(manner.lurch) * support + np.radians(12) * manner.hurt * sign * (sign * support).clip(0)
    spine = ph.in_body(p)
    spine = spine[:, 12] - spine[:, 0]
    usual = float(np.median(np.arctan2(spine[:, 2], spine[:, 1]))) - np.radians(3)
    nod = np.radians(manner.lean) - min(abs(manner.lean) / 8, 1) * usual  # whoever leans back does not do so when old
    if manner.unsteady:
        lurch = lurch + np.radians(manner.unsteady) * noise.curve(0.25, 0.7)
        nod = nod + np.radians(0.7 * manner.unsteady) * noise.curve(0.2, 0.6)
    yaw = -np.radians(manner.twist) * stride
    whole = nod * left.T - lurch * forward.T
    for joint in _TRUNK:
        _turn(p, joint, (whole / 3).T + (yaw / 3)[:, None] * [0, 1, 0])
    _turn(p, 9, np.radians(manner.hunch) * left)
    # who leans or hunches still looks ahead, most of it
    look = np.radians(manner.head) - 0.6 * (nod + np.radians(manner.hunch))
    if manner.unsteady:
        look = look + np.radians(1.2 * manner.unsteady) * noise.curve(0.2, 0.7)
    _turn(
        p,
        12,
        np.broadcast_to(look, (len(p),))[:, None] * left
        - 0.5 * yaw[:, None] * [0, 1, 0]
        + 0.6 * lurch[:, None] * forward,
    )
    if manner.shoulders:
        for collar, shoulder, outward in ((13, 16, 1.0), (14, 17, -1.0)):
            angle = np.radians(manner.shoulders) * outward
            _turn(p, collar, angle * forward)
            _turn(p, shoulder, -angle * forward)


def _turn(p: Array, joint: int, vector: Array) -> None:
    """Turn what hangs on a joint of (frames, 22, 3) about it by rotation vectors (frames, 3), in place."""
    below = [k for k in SMPL22.below(joint) if k != joint]
    quaternion = rot.rotvec_to_quat(np.ascontiguousarray(vector))
    p[:, below] = p[:, joint, None] + rot.rotate(quaternion[:, None], p[:, below] - p[:, joint, None])


def _stretch(p: Array, ankles: Array) -> float:
    """Metres from hip to ankle of the straighter leg, the median over the clip."""
    return float(np.median(np.linalg.norm(p[:, [1, 2]] - ankles, axis=-1).max(axis=1)))


def _out_of_reach(p: Array, ankles: Array, gait: Gait) -> Array:
    """(frames,) metres that the hips are too high for the feet that stand; smooth."""
    high = np.zeros(len(p))
    for i, (hip, knee, ankle, _, _) in enumerate(FEET):
        longest = 0.997 * (LENGTHS[knee] + LENGTHS[ankle])
        line = p[:, hip] - ankles[:, i]
        across = np.linalg.norm(line[:, [0, 2]], axis=-1)
        high = np.maximum(high, line[:, 1] - np.sqrt(np.maximum(longest**2 - across**2, 0.01)))
    return envelope(high.clip(0, 0.3), 2)


def _move_arms(p: Array, gait: Gait, manner: Manner, side: str, noise: _Noise) -> None:
    """Arms of (frames, 22, 3) that swing otherwise or hold, in place."""
    stride = ph.smooth(gait.stride(), 3)
    shake = [manner.tremble * noise.curve(4.5, 7.5) for _ in range(3)]
    for i, (shoulder, elbow, wrist, outward) in enumerate(_ARMS):
        name = _NAMES[i]
        if manner.one_hand and side == "left":
            name = _NAMES[1 - i]
        hold = manner.left if name == "left" else manner.right
        if hold is not None:
            _hold(p, i, hold, manner, np.stack(shake, axis=-1))
            continue
        _swing(p, (shoulder, elbow, wrist, outward), manner, stride, np.stack(shake, axis=-1))


def _swing(p: Array, arm: tuple[int, int, int, float], manner: Manner, stride: Array, shake: Array) -> None:
    """An arm that swings: both its bones seen from the body, about their means."""
    shoulder, elbow, wrist, outward = arm
    facing = ph.heading(p)
    upper = limbs.unit(ph.turned(p[:, elbow] - p[:, shoulder], facing))
    lower = limbs.unit(ph.turned(p[:, wrist] - p[:, elbow], facing))
    lower = limbs.unit(lower + manner.straight * (upper - lower))
    drive = np.radians(manner.drive) * outward * stride
    bent = np.radians(manner.elbow)
    flare = np.radians(manner.out)
    down = np.array([0.08 * outward, -1.0, 0.03])
    parts = []
    for bone, bend in ((upper, 0.0), (lower, bent)):
        mean = bone.mean(axis=0)
        goal = mean + manner.hang * (down - mean)
        way = limbs.unit(goal + manner.swing * (bone - mean))
        way = _tipped(way, drive + bend, flare * outward)
        parts.append(way)
    p[:, elbow] = p[:, shoulder] + LENGTHS[elbow] * ph.turned(parts[0], -facing)
    p[:, wrist] = p[:, elbow] + LENGTHS[wrist] * limbs.unit(ph.turned(parts[1], -facing) + shake / LENGTHS[wrist])


def _tipped(way: Array, ahead: Array, aside: float) -> Array:
    """Directions (frames, 3), left, up and forward, swung forward about the shoulders' line and then out."""
    turn = np.stack([-ahead, 0 * ahead, 0 * ahead], axis=-1)
    out = np.array([0.0, 0.0, aside])
    return rot.rotate(rot.rotvec_to_quat(out), rot.rotate(rot.rotvec_to_quat(turn), way))


def _hold(p: Array, i: int, hold: tuple[Place, Place], manner: Manner, shake: Array) -> None:
    """A hand that is kept at a place, seen from between the shoulders, or from the pelvis."""
    shoulder, elbow, wrist, outward = _ARMS[i]
    sign = np.array([outward, 1.0, 1.0])
    facing = ph.heading(p)
    place, pole = (np.broadcast_to(np.array(each) * sign, (len(p), 3)) for each in hold)
    origin = p[:, 0] if manner.hips else (p[:, 16] + p[:, 17]) / 2
    target = origin + ph.turned(place + shake, -facing)
    upper, lower = float(LENGTHS[elbow]), float(LENGTHS[wrist])
    bent = limbs.bend(p[:, shoulder], target, ph.turned(pole, -facing), upper=upper, lower=lower)
    p[:, elbow], p[:, wrist] = bent
