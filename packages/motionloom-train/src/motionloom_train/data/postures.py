"""Changes of the whole body added to people who stand: kneeling down, lunging, bending to the toes, ducking, swaying.

Recordings under free licences hardly have them. A posture is a few key poses of pelvis, feet, trunk and hands; the
body goes from one to the next by a smooth path, knees and elbows follow in closed form (`limbs.bend`), and what the
recorded person does besides (breathing, small sways) goes on. Such clips are marked (``kind`` is ``made``).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from motionloom.core.blending import smootherstep
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.retarget import limbs

_LEGS = ((1, 4, 7, 10, 1.0), (2, 5, 8, 11, -1.0))
"""Hip, knee, ankle, toes, and the sign of outward along +X: left, right."""
_ARMS = ((16, 18, 20, 1.0), (17, 19, 21, -1.0))
_TRUNK = ((0, 0.58), (3, 0.16), (6, 0.14), (9, 0.12))
"""Joints about which a bend turns what is above them, and their shares of it."""
_CHEST = tuple(range(12, 22))
_ABOVE = {0: (1, 2, 3, 6, 9, *_CHEST), 3: (6, 9, *_CHEST), 6: (9, *_CHEST), 9: _CHEST}
LONG = 60.0
"""Seconds that a last pose stays: until the clip ends."""
_FLOOR_OF_KNEE = 0.06
"""Metres of a knee's joint over the floor on which it rests."""
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Pose:
    """A key pose against standing. Metres, outward left, up, forward, as the person faces at the start."""

    seconds: float
    """Time in which the body gets there from the pose before."""
    pelvis: Vector = (0.0, 0.0, 0.0)
    feet: tuple[Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """Where the ankles go: left, right."""
    tiptoe: tuple[float, float] = (0.0, 0.0)
    """0: the sole is flat; 1: the foot stands on its toes, as under a knee on the floor. Left, right."""
    bend: float = 0.0
    """Degrees that the trunk bends forward."""
    hands: float = 0.0
    """0: the arms stay as they were on the trunk; 1: the hands are at the toes."""
    hang: float = 0.0
    """1: the arms hang down, however the trunk is bent."""
    stay: float = 0.0
    """Seconds that the pose is kept."""

    def numbers(self) -> Array:
        """All but the times in one row."""
        feet = [v for foot in self.feet for v in foot]
        return np.array([*self.pelvis, *feet, *self.tiptoe, self.bend, self.hands, self.hang])


@dataclass(frozen=True)
class Posture:
    """A change of the body, and the action of ``actions.toml`` that it shows."""

    action: str
    poses: tuple[Pose, ...]
    side: str = ""
    """What the words call the side that does it, where they do."""
    arms_out: bool = False
    """Both arms are spread meanwhile."""

    def seconds(self, *, stay: float) -> float:
        """How long it takes; a last pose that stays is kept for at most so long."""
        return sum(pose.seconds + min(pose.stay, stay if pose is self.poses[-1] else pose.stay) for pose in self.poses)


def postures(body: Array, rng: np.random.Generator) -> Iterator[Posture]:
    """Every posture for the standing ``body`` (frames, 22, 3) metres, a little different each time."""
    thigh, shin = _lengths(body)
    down = _FLOOR_OF_KNEE + thigh - float(body[0, 1, 1])
    some, pace = rng.uniform, rng.uniform(0.85, 1.2)
    yield from _kneeling(_one_knee(thigh, shin, down, some(0.22, 0.3), some(0, 12)), pace, rng)
    low = _one_knee(thigh, shin, down + some(0.04, 0.1), some(0.26, 0.34), some(0, 12))
    lunge = (replace(low, seconds=0.9 * pace, stay=0.15), Pose(0.9 * pace, stay=0.2))
    yield Posture("lunge", (*lunge, _mirrored(lunge[0]), lunge[1]) * 2)
    toes = Pose(1.1 * pace, (0.0, some(-0.01, 0.0), some(-0.16, -0.1)), bend=some(132, 150), hands=some(0.85, 1.0))
    yield Posture("touch toes", (replace(toes, hang=1.0, stay=some(0.5, 1.6)), Pose(1.1 * pace, stay=LONG)))
    over = Pose(1.0 * pace, (0.0, 0.0, some(-0.13, -0.06)), bend=some(70, 105), hang=1.0, stay=some(0.4, 1.5))
    yield Posture("bend over", (over, Pose(1.0 * pace, stay=LONG)))
    duck = Pose(0.42 * pace, (0.0, some(-0.4, -0.28), some(-0.12, 0.0)), bend=some(25, 45), stay=some(0.1, 0.4))
    yield Posture("duck", (duck, Pose(0.5 * pace, stay=LONG)))
    side = Pose(some(0.85, 0.95), (some(0.12, 0.16), -0.005, 0.0))
    across = replace(side, seconds=1.7)
    yield Posture("sway", (side, *(_mirrored(across), across) * 4))
    knee = Pose(0.8 * pace, (-0.07, 0.0, 0.0), ((0.0, some(0.36, 0.44), some(0.12, 0.22)), (0.0, 0.0, 0.0)))
    yield Posture("high step", (replace(knee, stay=some(0.4, 2.0)), Pose(0.8 * pace, stay=LONG)), side="left")
    crouch = Pose(0.9 * pace, (0.0, some(-0.52, -0.38), some(-0.14, -0.04)), bend=some(20, 45), stay=LONG)
    yield Posture("crouch", (crouch,))
    squat = (replace(crouch, seconds=0.85 * pace, stay=some(0.0, 0.15)), Pose(0.8 * pace, stay=0.15))
    for times, name in enumerate(("one squat", "two squats", "three squats"), start=1):
        yield Posture(name, (*(squat * times)[:-1], replace(squat[1], stay=LONG)))
    foot = ((0.0, some(0.2, 0.36), some(0.0, 0.15)), (0.0, 0.0, 0.0))
    lifted = Pose(0.8 * pace, (-0.07, 0.0, 0.0), foot, stay=LONG)
    yield Posture("balance with arms out", (lifted,), side="right", arms_out=True)


def _kneeling(knee: Pose, pace: float, rng: np.random.Generator) -> Iterator[Posture]:
    yield Posture("kneel", (replace(knee, seconds=1.25 * pace, stay=LONG),))
    behind, ahead = knee.feet[1], knee.feet[0][2]
    both = Pose(0.9 * pace, knee.pelvis, (behind, behind), (1.0, 1.0), rng.uniform(0, 8), stay=LONG)
    yield Posture("kneel", (replace(knee, seconds=1.1 * pace), both))
    up = Pose(1.2 * pace, (0.0, 0.0, ahead), ((0.0, 0.0, ahead), (0.0, 0.0, ahead)), stay=LONG)
    yield Posture("kneel and rise", (replace(knee, seconds=1.1 * pace, stay=rng.uniform(0.3, 1.2)), up))


def _one_knee(thigh: float, shin: float, down: float, ahead: float, bend: float) -> Pose:
    """On the right knee, the left foot in front of the pelvis by a thigh, the right shin on the floor behind it."""
    return Pose(
        1.0, (0.0, down, ahead), ((0.0, 0.0, ahead + 0.93 * thigh), (0.0, 0.09, ahead - 0.93 * shin)), (0.0, 1.0), bend
    )


def _mirrored(pose: Pose) -> Pose:
    def other(v: Vector) -> Vector:
        return (-v[0], v[1], v[2])

    return replace(
        pose, pelvis=other(pose.pelvis), feet=(other(pose.feet[1]), other(pose.feet[0])), tiptoe=pose.tiptoe[::-1]
    )


def assume(body: Array, posture: Posture, *, fps: float, begin: float) -> Array:
    """``body`` (frames, 22, 3) metres, somebody who stands, with a posture that begins after ``begin`` seconds."""
    faces = float(ph.heading(body)[: max(1, len(body) // 4)].mean())
    origin = body[0, 0] * [1, 0, 1]
    p = ph.turned(body - origin, faces)
    keyed = _keyed(posture.poses, len(body), fps, begin)
    standing = p.copy()
    _bend_trunk(p, keyed[:, 11])
    p[:, [0, *_ABOVE[0]]] += keyed[:, None, 0:3]
    p[:, [0, *_ABOVE[0]], 1] -= _out_of_reach(p, standing, keyed)[:, None]
    for side, leg in enumerate(_LEGS):
        _move_leg(p, standing, leg, keyed[:, 3 + 3 * side : 6 + 3 * side], keyed[:, 9 + side])
    for side, arm in enumerate(_ARMS):
        _move_arm(p, arm, _LEGS[side][3], keyed[:, 12], keyed[:, 13])
    return ph.turned(p, -faces) + origin


def _out_of_reach(p: Array, standing: Array, keyed: Array) -> Array:
    """(frames,) metres that the hips are too high for both feet to stay where they belong."""
    longest = 0.999 * sum(_lengths(standing))
    high = np.zeros(len(p))
    for side, (hip, _, ankle, _, _) in enumerate(_LEGS):
        line = p[:, hip] - standing[:, ankle] - keyed[:, 3 + 3 * side : 6 + 3 * side]
        across = np.linalg.norm(line[:, [0, 2]], axis=-1)
        high = np.maximum(high, line[:, 1] - np.sqrt(np.maximum(longest**2 - across**2, 0.0)))
    return high


def _keyed(poses: tuple[Pose, ...], frames: int, fps: float, begin: float) -> Array:
    """(frames, 14) numbers of the pose at every frame."""
    time = np.arange(frames) / fps
    at, last = begin, Pose(0.0).numbers()
    rows = np.broadcast_to(last, (frames, len(last))).copy()
    for pose in poses:
        share = smootherstep(np.clip((time - at) / pose.seconds, 0, 1))[:, None]
        rows = np.where(time[:, None] >= at, last + share * (pose.numbers() - last), rows)
        at, last = at + pose.seconds + pose.stay, pose.numbers()
    return rows


def _bend_trunk(p: Array, degrees: Array) -> None:
    """Turn the trunk of (frames, 22, 3), which faces +Z, forward about +X."""
    for joint, share in _TRUNK:
        angle = np.radians(degrees) * share
        above = list(_ABOVE[joint])
        offset = p[:, above] - p[:, joint : joint + 1]
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        y, z = offset[..., 1].copy(), offset[..., 2].copy()
        offset[..., 1], offset[..., 2] = cos * y - sin * z, sin * y + cos * z
        p[:, above] = p[:, joint : joint + 1] + offset


def _move_leg(p: Array, standing: Array, leg: tuple[int, int, int, int, float], foot: Array, tiptoe: Array) -> None:
    hip, knee, ankle, toes, outward = leg
    upper, lower = _lengths(standing)
    step = np.linalg.norm(np.diff(foot[:, [0, 2]], axis=0, prepend=foot[:1, [0, 2]]), axis=-1)
    lift = 0.9 * ph.smooth(step, 5)  # a foot that goes somewhere is lifted on its way
    target = standing[:, ankle] + foot
    target[:, 1] += lift
    pole = np.broadcast_to(np.array([0.15 * outward, 0.0, 1.0]), target.shape)
    flat = standing[:, toes] - standing[:, ankle]
    p[:, knee], p[:, ankle] = limbs.bend(p[:, hip], target, pole, upper=upper, lower=lower)
    angle = np.radians(65) * tiptoe
    cos, sin = np.cos(angle), np.sin(angle)
    p[:, toes] = p[:, ankle] + np.stack(
        [flat[:, 0], cos * flat[:, 1] - sin * flat[:, 2], sin * flat[:, 1] + cos * flat[:, 2]], axis=-1
    )


def _move_arm(p: Array, arm: tuple[int, int, int, float], toes: int, hands: Array, hang: Array) -> None:
    shoulder, elbow, wrist, outward = arm
    upper = float(np.linalg.norm(p[0, elbow] - p[0, shoulder]))
    lower = float(np.linalg.norm(p[0, wrist] - p[0, elbow]))
    down = p[:, shoulder] + np.array([0.03 * outward, -0.97 * (upper + lower), 0.05])
    place = p[:, wrist] + hang[:, None] * (down - p[:, wrist])
    place = place + hands[:, None] * (p[:, toes] + [0.02 * outward, 0.1, 0.02] - place)
    middle = (p[:, shoulder] + p[:, wrist]) / 2
    own = (p[:, elbow] - middle) / 0.1
    pole = own + hang[:, None] * (np.array([0.4 * outward, 0.0, -1.0]) - own)
    bent, reached = limbs.bend(p[:, shoulder], place, pole, upper=upper, lower=lower)
    moved = ((hang > 0) | (hands > 0))[:, None]
    p[:, elbow], p[:, wrist] = np.where(moved, bent, p[:, elbow]), np.where(moved, reached, p[:, wrist])


def _lengths(p: Array) -> tuple[float, float]:
    """Metres of thigh and shin."""
    return float(np.linalg.norm(p[0, 4] - p[0, 1])), float(np.linalg.norm(p[0, 7] - p[0, 4]))
