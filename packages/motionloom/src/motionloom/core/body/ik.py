"""Joint positions to true rotations: an analytic body for export, with constant bones and without twist pops.

Positions leave two things open: bones of a network's positions change length by centimetres, and the turn of a limb
about its own length is visible only while its hinge (elbow, knee) is bent. Lengths are those of the skeleton;
the turn of a limb is the solution of one smoothing problem over the whole clip, see `hinge_axes`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.features.humanml import checked
from motionloom.core.motion import Motion, local_rotations
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Limb:
    """Two bones and a hinge: joints ``start - middle - end`` hanging on the frame of joint ``base``."""

    base: int
    start: int
    middle: int
    end: int
    hinge: tuple[float, float, float]
    """Axis of the bend at rest: the lower bone turns by a positive angle about it."""
    tip: int | None = None
    """The joint beyond the end (the toes), whose direction shows the turn of a straight leg."""


def _limb(base: str, names: tuple[str, str, str], hinge: tuple[float, float, float], tip: str | None = None) -> Limb:
    joints = map(SMPL22.index, (base, *names))
    return Limb(*joints, hinge=hinge, tip=None if tip is None else SMPL22.index(tip))


LIMBS: tuple[Limb, ...] = (
    _limb("pelvis", ("left_hip", "left_knee", "left_ankle"), (1, 0, 0), "left_foot"),
    _limb("pelvis", ("right_hip", "right_knee", "right_ankle"), (1, 0, 0), "right_foot"),
    _limb("spine3", ("left_shoulder", "left_elbow", "left_wrist"), (0, -1, 0)),
    _limb("spine3", ("right_shoulder", "right_elbow", "right_wrist"), (0, 1, 0)),
)
"""Left leg, right leg, left arm, right arm."""

_REST = SMPL22.offsets
_LENGTHS = SMPL22.bone_lengths()
_BENT = (np.sin(np.radians(6)), np.sin(np.radians(25)))
"""Sines of the bends at which a hinge begins to show the turn of its limb, and shows it fully."""
_STIFFNESS = 1.0
"""How strongly the turn of a limb is kept from frame to frame at 20 fps, against 1 for a well bent hinge."""
_NEARLY_STRAIGHT = (0.95, 0.995)
"""Shares of full reach between which the observed bend takes over from the observed distance."""

_ASIDE = (0.01, 0.03)
"""Square metres: the product of leg and hips below which a leg along the line of the hips has no front, and has one."""
_TOLERANCE = 0.12
"""Relative error of sampled lengths at which a rotation counts as much as its change from frame to frame."""


def motion_from_positions(positions: np.ndarray, fps: float) -> Motion:
    """The 22-joint person who takes the given places as well as constant bones can.

    ``positions`` (frames, 22, 3) in metres, of a person of about the size of `SMPL22` (pass others through
    `features.humanml.uniform` first); bones may breathe. Wrists and ankles reach their places when the limb is long
    enough; rotations are continuous in time, signs too. Raises `MotionloomError` for other shapes and numbers that are
    not finite.
    """
    positions = _with_knees_ahead(checked(positions))
    places = np.zeros_like(positions)
    world = np.tile(rot.IDENTITY, (len(positions), 22, 1))
    _solve_trunk(positions, places, world)
    solve_limbs(positions, places, world, fps)
    for ankle, toe in ((7, 10), (8, 11)):
        places[:, toe] = places[:, ankle] + rot.rotate(world[:, ankle], _REST[toe])
    rotations = _smooth_limbs(positions, local_rotations(SMPL22, world))
    return Motion(SMPL22, fps, places[:, 0], rotations)


def _with_knees_ahead(positions: Array) -> Array:
    """The places, knees that bend the wrong way mirrored at the plane through hip, ankle and the line of the hips.

    A person's knees lie in front of that plane, whatever the hips do (recorded ones are more than 1 cm behind it in one
    frame of 2,400); a knee that comes to it from behind is in it, so mirrored motion is continuous.
    """
    result, hips = positions.copy(), positions[:, 1] - positions[:, 2]
    for limb in LIMBS[:2]:
        leg = positions[:, limb.end] - positions[:, limb.start]
        ahead = np.cross(leg, hips)
        length = np.linalg.norm(ahead, axis=-1, keepdims=True)
        ahead = ahead / length.clip(1e-9)
        depth = ((positions[:, limb.middle] - positions[:, limb.start]) * ahead).sum(-1, keepdims=True)
        result[:, limb.middle] -= 2 * _between(length, _ASIDE) * np.minimum(depth, 0) * ahead
    return result


# Trunk


def _solve_trunk(goal: Array, places: Array, world: Array) -> None:
    """Fill in places and world orientations of pelvis, spine, neck, head and collars."""
    world[:, 0] = _smooth_by_confidence(_pelvis(goal), _length_error(goal[:, 1] - goal[:, 2], _REST[1] - _REST[2]))
    chest = [12, 13, 14]
    spare = (_REST[13] - _REST[14], goal[:, 13] - goal[:, 14])
    turned = fit_rotation(_REST[chest], goal[:, chest] - goal[:, 9:10], spare=spare)
    world[:, 9] = _smooth_by_confidence(turned, _length_error(spare[1], spare[0]))
    for joint, share in ((3, 1 / 3), (6, 2 / 3)):
        child = SMPL22.children(joint)[0]
        expected = rot.slerp(world[:, 0], world[:, 9], np.full(len(goal), share))
        world[:, joint] = aim(expected, _REST[child], _smooth_bones(goal[:, child] - goal[:, joint], expected, child))
    trunk = (3, 6, 9, 12, 13, 14, 1, 2)
    for joint in trunk:
        places[:, joint] = _end_of(joint, places, world)
    # The trunk's joints need not lie to each other as the skeleton's do: share the error out instead of leaving it all
    # to those far from the pelvis.
    weights = np.array([1.0, 1, 1, 1, 2, 0, 0, 2, 2])
    shift = np.einsum("j,fjk->fk", weights / weights.sum(), (goal - places)[:, (0, *trunk)])
    places[:, (0, *trunk)] += shift[:, None]
    for joint, child in ((12, 15), (13, 16), (14, 17)):
        sampled = goal[:, child] - places[:, joint]
        error = _length_error(sampled, _REST[child])
        usual = rot.rotate(world[:, 9], np.broadcast_to(_REST[child], sampled.shape))
        turned = aim(world[:, 9], _REST[child], sampled + 2 * error[:, None] * usual)
        local = _smooth_by_confidence(rot.multiply(rot.inverse(world[:, 9]), turned), error)
        world[:, joint] = rot.multiply(world[:, 9], local)
        places[:, child] = _end_of(child, places, world)
    world[:, 15] = rot.multiply(world[:, 12], _level_head(world[:, 9], world[:, 12]))


def _level_head(chest: Array, neck: Array) -> Array:
    """(4,) turn of the head on the neck, the same for all frames.

    The head nods with the neck's bone, but how steep that bone is in a person who looks ahead depends on where a body
    model has its joints: a bone that leans back all the time (up to 50 degrees) means a level head.
    """
    up = rot.rotate(rot.multiply(rot.inverse(chest), neck), np.array([0.0, 1.0, 0.0]))
    lean = float(np.clip(np.median(np.arctan2(up[:, 2], up[:, 1])), -np.radians(50), 0))
    return rot.rotvec_to_quat(np.array([-lean, 0, 0]))


def _smooth_bones(bone: Array, expected: Array, child: int) -> Array:
    """The sampled bone (frames, 3), mixed with the expected one as far as its breathing length shows noise."""
    length = np.linalg.norm(bone, axis=-1)
    noise = float(np.std(length) / _LENGTHS[child])
    return bone + min(2.0, 6.0 * noise) * rot.rotate(expected, np.broadcast_to(_REST[child], bone.shape))


def _length_error(bone: Array, rest: Array) -> Array:
    """(frames, ...): by how much a sampled bone (frames, ..., 3) is shorter than its own, in units of that."""
    return (1 - np.linalg.norm(bone, axis=-1) / np.linalg.norm(rest, axis=-1)).clip(0)


def _smooth_by_confidence(turns: Array, error: Array) -> Array:
    """Rotations (frames, ..., 4), smoothed in time as far as what they were read off is too short (frames, ...).

    Where a network is not sure it samples in between: somebody who spins has both hips, or a limb its two ends, in one
    place, and what is read off that turns by half a circle within a frame. Minimises the squared distance to each
    rotation, weighted by the inverse square of the relative error, plus the squared change per frame: what is sampled
    long enough stays as it is. A bone that is too long shows its direction well: arms that wave are sampled up to a
    half too long, and to smooth them for it would halve the wave.
    """
    weight = (_TOLERANCE / error.clip(1e-6))[..., None] ** 2
    return rot.normalize(_tridiagonal(weight, 1.0, weight * rot.unroll(turns)))


def _pelvis(goal: Array) -> Array:
    bones = [1, 2, 3]
    spare = (_REST[16] + _REST[13] - _REST[17] - _REST[14], goal[:, 16] - goal[:, 17])
    return fit_rotation(_REST[bones], goal[:, bones] - goal[:, :1], spare=spare)


def _end_of(joint: int, places: Array, world: Array) -> Array:
    parent = SMPL22.parents[joint]
    return places[:, parent] + rot.rotate(world[:, parent], _REST[joint])


def fit_rotation(rest: np.ndarray, places: np.ndarray, *, spare: tuple[np.ndarray, np.ndarray]) -> Array:
    """World quaternions (frames, 4) that best turn ``rest`` (points, 3) into ``places`` (frames, points, 3).

    Kabsch, *Acta Cryst.* A32 (1976). Where the points lie on a line (left and right hip coincide), the ``spare`` pair
    of vectors, at rest (3,) and now (frames, 3), gives the remainder; elsewhere it has no effect.
    """
    full = np.linalg.svd(rest.T @ rest)[1][1]
    correlation = places.swapaxes(-1, -2) @ rest
    weakness = 1 - 2 * np.linalg.svd(correlation)[1][:, 1] / full
    extra = spare[1][:, :, None] * spare[0]
    extra /= np.linalg.norm(extra, axis=(-2, -1), keepdims=True).clip(1e-9)
    u, _, vt = np.linalg.svd(correlation + 0.5 * full * weakness.clip(0)[:, None, None] * extra)
    signs = np.ones((len(places), 3))
    signs[:, 2] = np.linalg.det(u @ vt)
    return rot.matrix_to_quat((u * signs[:, None]) @ vt)


def aim(orientation: np.ndarray, rest: np.ndarray, direction: np.ndarray) -> Array:
    """Turn world orientations (frames, 4) the shortest way so that ``rest`` (3,) points along ``direction``."""
    now = rot.rotate(orientation, np.broadcast_to(rest, direction.shape))
    short = np.linalg.norm(direction, axis=-1, keepdims=True) < 1e-6
    return rot.normalize(rot.multiply(rot.shortest_arc(now, np.where(short, now, direction)), orientation))


# Limbs


def solve_limbs(goal: np.ndarray, places: np.ndarray, world: np.ndarray, fps: float) -> None:
    """Fill in places and world orientations of the arms and legs, feet included.

    ``goal`` (frames, 22, 3) are the places to reach; ``places`` and ``world`` (frames, 22, ...) hold the solved trunk
    with hips and shoulders and receive the rest.
    """
    axes = hinge_axes(goal, world, fps)
    for limb, axis in zip(LIMBS, axes):
        a, b, c = limb.start, limb.middle, limb.end
        places[:, b], places[:, c] = two_bones(places[:, a], goal[:, [a, b, c]], axis, (_LENGTHS[b], _LENGTHS[c]))
        world[:, a] = hinge_frame(limb, b, places[:, b] - places[:, a], axis)
        world[:, b] = hinge_frame(limb, c, places[:, c] - places[:, b], axis)
        world[:, c] = world[:, b]
        if limb.tip is not None:
            world[:, c] = aim(world[:, b], _REST[limb.tip], goal[:, limb.tip] - goal[:, c])
            world[:, limb.tip] = world[:, c]  # places do not show how toes are bent: they go with the foot


def _smooth_limbs(seen: Array, local: Array) -> Array:
    """Local rotations (frames, 22, 4), smooth at hips, knees, shoulders and elbows: a limb sampled too short would have
    to fold up, or open, within a frame to reach its end."""
    ends = [[limb.start, limb.middle, limb.end] for limb in LIMBS]
    joints = [[limb.start, limb.middle] for limb in LIMBS]
    bones = _REST[[[limb.middle, limb.end] for limb in LIMBS]]
    error = _length_error(np.diff(seen[:, ends], axis=2), bones).mean(-1)
    result = local.copy()
    result[:, joints] = _smooth_by_confidence(
        local[:, joints], error[..., None]
    )  # all at once: its loop is over frames
    return result


def hinge_frame(limb: Limb, child: int, bone: np.ndarray, axis: np.ndarray) -> Array:
    """World orientations (frames, 4) with the bone to ``child`` along ``bone``, the hinge nearest ``axis``."""

    def frame(y: np.ndarray, x: np.ndarray) -> Array:
        y = y / np.linalg.norm(y, axis=-1, keepdims=True).clip(1e-9)
        x = _perpendicular(x, y)
        return np.stack([x, y, np.cross(x, y)], axis=-1)

    rest = frame(_REST[child], np.array(limb.hinge, dtype=np.float64))
    return rot.matrix_to_quat(frame(bone, axis) @ rest.T)


def two_bones(
    start: np.ndarray, goal: np.ndarray, axis: np.ndarray, lengths: tuple[float, float]
) -> tuple[Array, Array]:
    """Places of the middle and the end (frames, 3) of a limb that begins at ``start`` and has bones of given lengths.

    ``goal`` (frames, 3, 3) are the places to reach of start, middle and end, ``axis`` (frames, 3) the hinge. The end
    reaches its place; near full reach the observed bend decides how far it gets instead (exactly the same for bones of
    the right length), since there a millimetre of distance is many degrees of bend.
    """
    first, second = lengths
    upper, lower = _unit(goal[:, 1] - goal[:, 0]), _unit(goal[:, 2] - goal[:, 1])
    bend = (upper * lower).sum(-1).clip(-1, 1)
    by_bend = np.sqrt((first**2 + second**2 + 2 * first * second * bend).clip(0))
    line = goal[:, 2] - start
    distance = np.linalg.norm(line, axis=-1)
    near = _between(distance / (first + second), _NEARLY_STRAIGHT)
    return reach(start, start + _unit(line) * (distance + near * (by_bend - distance))[:, None], goal, axis, lengths)


def reach(
    start: np.ndarray, target: np.ndarray, pose: np.ndarray, axis: np.ndarray, lengths: tuple[float, float]
) -> tuple[Array, Array]:
    """Places of middle and end of a limb from ``start`` to ``target``, or as near as the bones allow.

    The middle lies on the side of the line, and in the plane, where ``pose`` (frames, 3, 3), places of start, middle
    and end, has it; as far as it must leave the line more than there, it does so about the hinge ``axis``.
    """
    first, second = lengths
    line = _unit(target - start)
    distance = np.linalg.norm(target - start, axis=-1).clip(abs(first - second) + 1e-6, first + second)
    along = (first**2 + distance**2 - second**2) / (2 * distance)
    off = np.sqrt((first**2 - along**2).clip(0))
    middle = start + along[:, None] * line + off[:, None] * _side(pose, line, axis, off)
    return middle, start + distance[:, None] * line


def _side(pose: Array, line: Array, axis: Array, off: Array) -> Array:
    """Unit vectors (frames, 3) across ``line`` towards the middle joint."""
    chord = _unit(pose[:, 2] - pose[:, 0])
    across = pose[:, 1] - pose[:, 0]
    across = across - (across * chord).sum(-1, keepdims=True) * chord
    across = rot.rotate(rot.shortest_arc(chord, line), across)
    missing = (off - np.linalg.norm(across, axis=-1)).clip(0) + 2e-4
    return _perpendicular(across + missing[:, None] * _unit(np.cross(line, axis)), line)


def hinge_axes(goal: np.ndarray, world: np.ndarray, fps: float) -> Array:
    """World hinge axes (limbs, frames, 3) of the four limbs, across their upper bones and smooth in time.

    In the frame of the limb's base (pelvis, chest) a vector is carried along the upper bone without twist (parallel
    transport); the hinge is an angle about the bone from there. That angle minimises: squared distance to the observed
    bend plane, weighted by how much the hinge is bent; weakly, to the anatomical rest axis and the foot's own lateral
    axis; plus the squared change per frame. So a straight limb turns evenly from one bent pose to the next and
    cannot pop.
    """
    bases = [limb.base for limb in LIMBS]
    local = rot.inverse(world[:, bases])

    def bones(a: str, b: str) -> Array:
        ends = [getattr(limb, b) for limb in LIMBS]
        return _unit(rot.rotate(local, goal[:, ends] - goal[:, [getattr(limb, a) for limb in LIMBS]]))

    upper, lower = bones("start", "middle"), bones("middle", "end")
    first = transport(upper)
    second = np.cross(upper, first)

    def plane(v: Array) -> NDArray[np.complex128]:
        return (v * first).sum(-1) + 1j * (v * second).sum(-1)

    bend = plane(np.cross(upper, lower))
    usual = plane(_usual_axes(goal, upper, lower, local))
    strength = _between(np.abs(bend), _BENT)
    angle = _smooth_angles(bend, strength, usual, _STIFFNESS * (fps / 20) ** 2)
    axes = np.cos(angle)[..., None] * first + np.sin(angle)[..., None] * second
    return rot.rotate(world[:, bases], axes).swapaxes(0, 1)


def _usual_axes(goal: Array, upper: Array, lower: Array, local: Array) -> Array:
    """Where hinges point when no bend is seen (frames, limbs, 3): rest axis carried by the shortest arc; the foot."""
    axes = np.empty_like(upper)
    for i, limb in enumerate(LIMBS):
        rest = np.broadcast_to(_REST[limb.middle], upper[:, i].shape)
        axes[:, i] = rot.rotate(rot.shortest_arc(rest, upper[:, i]), np.array(limb.hinge, dtype=np.float64))
        # the shortest arc has no answer for a limb that points against its rest direction
        axes[:, i] *= (1.1 + (_unit(rest) * upper[:, i]).sum(-1, keepdims=True)).clip(0, 1)
        if limb.tip is not None:
            foot = rot.rotate(local[:, i], _unit(goal[:, limb.tip] - goal[:, limb.end]))
            along, aside = _across(_unit(_REST[limb.tip]), _unit(_REST[limb.end]))
            hinge = np.array(limb.hinge, dtype=np.float64)
            forward, lateral = _across(foot, lower[:, i])
            axes[:, i] = 0.15 * axes[:, i] + (hinge @ along) * forward + (hinge @ aside) * lateral
    return axes


def _across(foot: Array, shin: Array) -> tuple[Array, Array]:
    """The part of unit vectors ``foot`` across the shin, and the same a right angle further round the shin."""
    return foot - (foot * shin).sum(-1, keepdims=True) * shin, np.cross(foot, shin)


def transport(directions: np.ndarray) -> Array:
    """Unit vectors across ``directions`` (frames, ..., 3), carried from frame to frame by the shortest arc."""
    start = np.where(np.abs(directions[0, ..., :1]) < 0.9, [1, 0, 0], [0, 1, 0])
    result = np.empty_like(directions)
    result[0] = _perpendicular(start, directions[0])
    steps = rot.quat_to_matrix(rot.shortest_arc(directions[:-1], directions[1:])) if len(directions) > 1 else []
    for t, step in enumerate(steps):
        result[t + 1] = (step @ result[t][..., None])[..., 0]
    return _perpendicular(result, directions)


def _smooth_angles(bend: np.ndarray, strength: Array, usual: np.ndarray, stiffness: float) -> Array:
    """Angles (frames, limbs) that follow ``bend`` where ``strength`` says so and hold elsewhere.

    First on the circle as complex numbers, which needs no unwrapping, then refined as angles (Gauss-Newton), which
    bounds the change per frame.
    """
    weight, weak = strength, 0.02 * np.abs(usual).clip(0, 1)
    goal, hint = _on_circle(bend), _on_circle(usual)
    angle = np.unwrap(np.angle(_tridiagonal(weight + weak + 1e-6, stiffness, weight * goal + weak * hint)), axis=0)
    for _ in range(4):
        pull = weight * np.angle(goal * np.exp(-1j * angle)) + weak * np.angle(hint * np.exp(-1j * angle))
        angle = _tridiagonal(weight + weak + 1e-6, stiffness, (weight + weak + 1e-6) * angle + pull)
    return angle


def _tridiagonal(diagonal: Array, stiffness: float, right: np.ndarray) -> np.ndarray:
    """Solve (diag + stiffness * path Laplacian) x = right along axis 0 (Thomas)."""
    frames = len(right)
    diagonal = diagonal + stiffness * (2.0 if frames > 1 else 0.0)
    if frames > 1:
        diagonal[[0, -1]] -= stiffness
    x, ratio = np.array(right), np.zeros_like(diagonal)
    x[0] = x[0] / diagonal[0]
    for t in range(1, frames):
        ratio[t - 1] = -stiffness / diagonal[t - 1]
        diagonal[t] += stiffness * ratio[t - 1]
        x[t] = (x[t] + stiffness * x[t - 1]) / diagonal[t]
    for t in range(frames - 2, -1, -1):
        x[t] = x[t] - ratio[t] * x[t + 1]
    return x


def _on_circle(z: np.ndarray) -> np.ndarray:
    return z / np.abs(z).clip(1e-9)


def _unit(v: np.ndarray) -> Array:
    return v / np.linalg.norm(v, axis=-1, keepdims=True).clip(1e-9)


def _perpendicular(v: np.ndarray, to: np.ndarray) -> Array:
    """Unit part of ``v`` across the unit vectors ``to``; any one where there is none."""
    part = v - (v * to).sum(-1, keepdims=True) * to
    other = np.cross(to, np.where(np.abs(to[..., :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    return _unit(np.where(np.linalg.norm(part, axis=-1, keepdims=True) > 1e-9, part, other))


def _between(x: np.ndarray, ends: tuple[float, float]) -> Array:
    """0 below, 1 above, smooth between."""
    low, high = ends
    return smoothstep((x - low) / (high - low))
