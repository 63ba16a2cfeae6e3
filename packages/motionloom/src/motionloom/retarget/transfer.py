"""Carrying a motion from one humanoid to another.

1. *Read*: the source's 22 joint places and the world orientation of its anatomical frames.
2. *Scale*: the root's path, hips and feet by the ratio of leg lengths, feet set on the floor.
3. *Write*: the target's joints take the same anatomical orientation with bones along the same directions.
4. *Legs*: two-bone IK puts the feet where the scaled source has them, so that a planted foot stays planted. So it
   does with hands, where one of the two has no collar bones.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.motion import Motion, local_rotations
from motionloom.core.skeleton import SMPL22, Poses, Skeleton
from motionloom.retarget.anatomy import Body, read_body
from motionloom.retarget.axes import CHEST, CHILD, COLLARS, FEET, HEAD, LEG_JOINTS, SPINE, TOES, beside, trunk, unit
from motionloom.retarget.floor import Stance, read_stance
from motionloom.retarget.joint_map import Override, joint_map
from motionloom.retarget.limbs import aim, bend_limb, placed, reach, read_shrug, shrug
from motionloom.retarget.root import RootMode, place_root
from motionloom.retarget.upright import up_of

Array = NDArray[np.float64]
_LEG = 0.82
_DEEPEST = 0.08
_ROUNDS = 4
_ALIGNED = np.cos(np.radians(0.5))
_LEGS = (0.2, 2.5)
"""Metres of thigh and shin: of the uniform person, and of bodies whose feet are looked at as they are."""


def joints22(motion: Motion, override: Override | None = None) -> Array:
    """(frames, 22, 3) metres: where the 22 SMPL joints are on the source's own body, in its own world.

    Raises `MotionloomError` naming the joints that could not be found; see `joint_map`.
    """
    points = joint_map(motion.skeleton, override).matrix(motion.skeleton)
    places = np.einsum("sj,fjc->fsc", points, motion.positions())
    if (places[:, FEET] == places[:, TOES]).all(axis=(0, 2)).any():
        return read_body(motion.skeleton, override).places(motion.positions(), motion.world_rotations())
    return places


def to_smpl22(motion: Motion, override: Override | None = None) -> Motion:
    """The motion on the uniform 22-joint person, its floor at y = 0."""
    return retarget(motion, SMPL22, source_map=override)


def from_smpl22(
    motion: Motion, target: Skeleton, override: Override | None = None, *, root: RootMode | None = None
) -> Motion:
    """A motion of the uniform person on a user's skeleton: their hierarchy, offsets and rest pose.

    Joints that the uniform person lacks (fingers, eyes, twist bones) keep their rest pose.
    """
    return retarget(motion, target, target_map=override, root=root)


def retarget(
    motion: Motion,
    target: Skeleton,
    *,
    source_map: Override | None = None,
    target_map: Override | None = None,
    root: RootMode | None = None,
) -> Motion:
    """The motion on another humanoid skeleton.

    The world keeps its axes (one that is Z-up is turned to Y-up), the path shrinks or grows with the length of the
    legs, and the floor (where the source's planted toes are) becomes y = 0. Bones keep the target's lengths exactly;
    bones of the source that change length count by where they end. Joints above the hips go along with them rigidly,
    or as ``root`` says (`place_root`), with places that change. Raises `MotionloomError` if either skeleton is no
    humanoid.
    """
    source, body = _read_source(motion, source_map), read_body(target, target_map)
    if not _LEGS[0] < source.leg < _LEGS[1]:  # of another unit, or a giant: what counts here is how it moves
        motion = motion.scaled(_LEG / source.leg)
        source = _read_source(motion, source_map)
    if not _LEGS[0] < body.leg < _LEGS[1]:
        size = _LEG / body.leg
        result = retarget(motion, target.scaled(size), source_map=source_map, target_map=target_map, root=root)
        return replace(result.scaled(1 / size), skeleton=target)
    shrugs = not any(b.drivers[j] is None for b in (source, body) for j in COLLARS)
    pose = _read_pose(_y_up(motion, source), source, shrugs=shrugs)
    stance = read_stance(pose.places, motion.fps)
    characters = [b for b in (source, body) if b.on_floor and b.skeleton != SMPL22]
    if source.on_floor and characters:  # a recording's skeleton knows no floor
        stance = stance.on_floor(source.toe_height, slack=0.08 * source.leg)
    ratio = body.leg / source.leg
    goals = _scale(pose, stance, ratio=ratio, toe_height=body.toe_height)
    if source.broad or body.broad:
        out = body.broad - source.broad * body.leg / source.leg
        left = _smooth(rot.rotate(pose.frames[:, 0], np.eye(3)[1]), max(1, round(0.4 * motion.fps)))
        goals = _spread(goals, out * left)  # so smooth that planted feet hardly slide
    world = _orient(pose, body)
    if not shrugs:
        world = reach(world, pose.shoulders, body)
    elif source.known and body.known:
        moved = pose.shoulders * source.arm / source.breadth
        world = shrug(world, pose.frames[:, CHEST], moved, body)
    result = _place(world, goals, body, motion.fps)
    return result if root is None else place_root(result, body, root)


def _read_source(motion: Motion, override: Override | None) -> Body:
    """The body of a motion, measured from the motion itself where its rest pose is no pose."""
    poses = Poses(motion.root, motion.rotations, motion.translations)
    return read_body(motion.skeleton, override, poses=poses)


# 1. Read -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Pose:
    places: Array
    """(frames, 22, 3) metres."""
    frames: Array
    """(frames, 22, 4) world_from_anatomy."""
    hips: Array
    """(frames, 3) metres: the middle between the hip joints."""
    shoulders: Array
    """(frames, 2, 3) how far they are from their rest on the chest (`read_shrug`)."""
    trunk: Array
    """(frames, 3) from the middle of the hip joints to that of the shoulder joints; where one of the two bodies has no
    collar bones, to where the shoulders belong on the chest."""


def _read_pose(motion: Motion, source: Body, *, shrugs: bool) -> _Pose:
    world = motion.world_rotations()
    places = source.places(motion.positions(), world)
    frames = np.empty((len(motion), 22, 4))
    for j, driver in enumerate(source.drivers):
        above = SMPL22.parents[j]
        if driver is not None:
            frames[:, j] = rot.multiply(world[:, driver], source.frames[j])
        elif CHILD[j] is None:
            frames[:, j] = frames[:, above]
        else:  # no such bone, such as a collar bone: it moves with the one above as on the uniform person
            frames[:, j], bone = _borrowed(frames[:, above], j)
            places[:, j] = places[:, CHILD[j]] - bone
        rests = driver is not None and j in COLLARS and source.known
        if CHILD[j] is not None and not rests and j not in (0, *SPINE, *FEET):  # the places say where a bone points
            bone = places[:, CHILD[j]] - places[:, j]
            frames[:, j] = rot.multiply(_turn(rot.rotate(frames[:, j], np.eye(3)[0]), bone), frames[:, j])
    moved = read_shrug(motion.positions(), world, source)
    line = trunk(places)
    if not shrugs and (chest := source.drivers[CHEST]) is not None:
        turned = rot.multiply(world[:, chest], source.frames[CHEST])
        lifted = rot.rotate(turned[:, None], moved) * source.arm
        line = line - lifted.mean(axis=1)
    return _Pose(places, frames, _hips(places, frames, source), moved, line)


def _hips(places: Array, frames: Array, source: Body) -> Array:
    """(frames, 3) the middle between the hip joints; as it is on the pelvis where legs were pulled out of the hips."""
    middle = places[:, [1, 2]].mean(axis=1)
    turn = rot.multiply(frames[:, 0], rot.inverse(source.frames[0]))
    fixed = places[:, 0] + rot.rotate(turn, (source.rest[[1, 2]].mean(axis=0) - source.rest[0])[None])
    pulled = source.upright and np.linalg.norm(fixed - middle, axis=-1).max() > 0.06 * source.leg
    return fixed if pulled else middle


def _y_up(motion: Motion, source: Body) -> Motion:
    """The motion turned so that +Y is up, where rest pose and poses agree that another axis was."""
    if source.up[1] > 0.9:
        return motion
    places = source.places(motion.positions(), motion.world_rotations())
    tall = (places[:, HEAD] - places[:, FEET].mean(axis=1)).mean(axis=0)
    seen = up_of(places, motion.fps, source.leg, source.up)
    if not seen.sure or seen.axis == "y" or float(tall @ source.up) < 2 * abs(float(tall[1])):
        return motion
    return motion.turned(rot.shortest_arc(source.up, np.eye(3)[1]))


def _borrowed(above: Array, joint: int) -> tuple[Array, Array]:
    """World frame and bone (frames, 3) of a joint that keeps its rest on the uniform person, from the frame above."""
    person, child = read_body(SMPL22), CHILD[joint]
    turned = rot.multiply(above, rot.inverse(person.frames[SMPL22.parents[joint]]))
    bone = rot.rotate(turned, SMPL22.offsets[child if child is not None else joint])
    return rot.multiply(turned, person.frames[joint]), bone


def _turn(a: Array, b: Array) -> Array:
    """Smallest turn from a to b; none where b has no length."""
    length = np.linalg.norm(b, axis=-1, keepdims=True)
    return np.where(length > 1e-6, rot.shortest_arc(a, b), rot.IDENTITY)


# 2. Scale ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Goals:
    """What the target's feet and hips aim at, all scaled, in metres in the target's world."""

    hips: Array
    """(frames, 3) the middle between the hip joints, before the difference of the feet is compensated."""
    ankles: Array
    """(frames, 2, 3) where the source's ankles are, likewise."""
    toes: Array
    """(frames, 2, 3) left and right toe joint: the target's toes go there."""
    flat: NDArray[np.bool_]
    """(frames, 2) whether the foot stands flat."""
    low: Array
    """(frames, 2, 1) 1 where the toe is near the ground and guides the foot, 0 where it is high and the ankle does."""
    forward: Array
    """(frames, 3) where the pelvis faces, level; shorter where it faces up or down."""
    poles: Array
    """(frames, 2, 3) where the knees point."""


def _scale(pose: _Pose, stance: Stance, *, ratio: float, toe_height: float) -> _Goals:
    up = np.array([0.0, 1.0, 0.0])
    lift = toe_height * up
    toes, ankles, hips = pose.places[:, TOES], pose.places[:, FEET], pose.hips
    under = stance.under(toes)[..., None] * up
    middle = stance.ground(hips).mean(axis=-1, keepdims=True) * up
    facing = np.cross(rot.rotate(pose.frames[:, 0], np.eye(3)[1]), rot.rotate(pose.frames[:, 0], np.eye(3)[0]))
    return _Goals(
        hips=(hips - middle) * ratio + lift,
        ankles=(ankles - under) * ratio + lift,
        toes=(toes - under) * ratio + lift,
        flat=stance.flat,
        low=smoothstep((0.12 - (toes[..., 1:2] - under[..., 1:2])) / 0.07),
        forward=facing * np.array([1.0, 0.0, 1.0]),
        poles=_knee_poles(pose),
    )


def _spread(goals: _Goals, left: Array) -> _Goals:
    """The feet moved apart by ``left`` (frames, 3) each, for hips of another breadth than the source's.

    On the ground they move along it, in the air as the pelvis is.
    """
    both = np.stack([left, -left], axis=1)
    both = both * np.concatenate([np.ones_like(goals.low), 1.0 - goals.low, np.ones_like(goals.low)], axis=-1)
    return replace(goals, ankles=goals.ankles + both, toes=goals.toes + both)


def _smooth(values: Array, reach: int) -> Array:
    """(frames, n) with each frame the mean of those up to ``reach`` away, near ones more."""
    kernel = np.hanning(2 * reach + 3)[1:-1]
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    smooth = [np.convolve(one, kernel / kernel.sum(), "valid") for one in padded.T]
    return np.asarray(np.stack(smooth, axis=-1), dtype=np.float64)


def _knee_poles(pose: _Pose) -> Array:
    """Where the knee stands out from the line hip to ankle; on a nearly straight leg, ahead of its hinge."""
    poles = []
    for leg in LEG_JOINTS:
        hip, knee, ankle = (pose.places[:, joint] for joint in leg)
        line = unit(ankle - hip)
        length = np.linalg.norm(ankle - hip, axis=-1, keepdims=True)
        ahead = np.cross(line, rot.rotate(pose.frames[:, leg[0]], np.eye(3)[1]))
        poles.append(beside(knee - hip, line) + 0.03 * length * ahead)
    return np.stack(poles, axis=1)


# 3. Write ------------------------------------------------------------------------------------------------------------


def _orient(pose: _Pose, body: Body) -> Array:
    """(frames, joints, 4) world orientation of the target's joints, before the legs are set."""
    skeleton = body.skeleton
    world = np.tile(rot.IDENTITY, (len(pose.places), len(skeleton), 1))
    backwards = list(enumerate(body.drivers))[::-1]
    first = {driver: j for j, driver in backwards if driver is not None}
    for k in range(len(skeleton)):
        if k not in first:
            world[:, k] = world[:, skeleton.parents[k]] if k else rot.IDENTITY
            continue
        j = first[k]
        world[:, k] = rot.multiply(pose.frames[:, j], rot.inverse(body.frames[j]))
        end = _bone_end(body, j)
        # where the frames are known, flat feet agree in the sole, spines and collars in how they turn
        if end is not None and j not in (0, HEAD) and not (body.known and j in (*SPINE, *FEET, *COLLARS)):
            along = rot.rotate(world[:, k], body.rest[end] - body.rest[j])
            world[:, k] = rot.multiply(_turn(along, pose.places[:, end] - pose.places[:, j]), world[:, k])
    return _straighten(world, body, pose.trunk)


def _straighten(world: Array, body: Body, along: Array) -> Array:
    """World rotations (frames, joints, 4) with the spine turned so that the trunk points along ``along`` (frames, 3).

    The line from the hips to the shoulders says how a trunk leans; single joints of the spine lie elsewhere on every
    skeleton. Pelvis, collar bones, neck and limbs keep their orientations.
    """
    turning = {body.drivers[j]: j for j in reversed(SPINE) if body.drivers[j] not in (None, body.drivers[0])}
    along = unit(along)
    for _ in range(_ROUNDS if turning else 0):
        now = unit(trunk(body.places(placed(body.skeleton, world), world)))
        if float((now * along).sum(axis=-1).min()) > _ALIGNED:
            break
        for joint in turning.values():
            world = aim(world, body, joint, now, along)
    return world


def _bone_end(body: Body, joint: int) -> int | None:
    """The next SMPL joint down the line that another of the target's joints turns (or none does)."""
    end = CHILD[joint]
    while end is not None and body.drivers[end] == body.drivers[joint] and CHILD[end] is not None:
        end = CHILD[end]
    return end


# 4. Legs and root ----------------------------------------------------------------------------------------------------


def _place(world: Array, goals: _Goals, body: Body, fps: float) -> Motion:
    places = body.places(placed(body.skeleton, world), world)
    ankles = goals.toes - (places[:, TOES] - places[:, FEET])
    shift = _make_up(goals, ankles)
    root = goals.hips + shift - places[:, [1, 2]].mean(axis=1)
    places = places + root[:, None]
    ankles = ankles + (1.0 - goals.low) * (goals.ankles + shift[:, None] - ankles)
    if body.skeleton.soles:
        lack = _lack(ankles, goals, body, world=world, places=places - root[:, None])
        ankles, raised = _on_soles(ankles, goals, lack, fps, leg=body.leg)
        lift = np.array([0.0, raised, 0.0])
        root, places = root + lift, places + lift
    drop = _drop(places, ankles, body)
    root, places = root - drop, places - drop[:, None]
    for side, leg in enumerate(LEG_JOINTS):
        world = bend_limb(world, body, leg, places, ankles[:, side], goals.poles[:, side])
    return Motion(body.skeleton, fps, root, local_rotations(body.skeleton, world))


def move_feet(motion: Motion, shift: Array) -> Motion:
    """A motion of any humanoid whose feet go elsewhere while its hips and the directions of its feet stay.

    shift: (frames, 2, 3) metres by which the left and the right ankle go; a leg that is too short goes as far as
    it can.
    """
    body, world = read_body(motion.skeleton), motion.world_rotations()
    places = body.places(motion.positions(), world)
    for side, leg in enumerate(LEG_JOINTS):
        hip, knee, ankle = (places[:, joint] for joint in leg)
        out = beside(knee - hip, unit(ankle - hip))
        lack = (0.01 - np.linalg.norm(out, axis=-1, keepdims=True)).clip(0)
        pole = out + lack * (places[:, TOES[side]] - ankle)
        world = bend_limb(world, body, leg, places, ankle + shift[:, side], pole)
    return replace(motion, rotations=local_rotations(motion.skeleton, world))


def _on_soles(ankles: Array, goals: _Goals, lack: Array, fps: float, *, leg: float) -> tuple[Array, float]:
    """The ankles' goals (frames, 2, 3), and by how many metres the whole body is raised, for feet of another shape.

    What both feet ``lack`` (`_lack`) while one of them stands flat, in the middle over the clip, raises everybody; what
    is left raises a foot. What both lack while neither stands, or by more than `_DEEPEST` lengths of the ``leg``, as
    much as the shapes of feet make, is left: it may as well be a pose in the air with pointed toes, which games play in
    one place.
    """
    common = lack.min(axis=1)
    flat = goals.flat.any(axis=1) & (common < _DEEPEST * leg)
    whole = float(np.median(common[flat])) if flat.sum() >= 3 else 0.0
    reach = max(1, round(0.2 * fps))
    near = np.lib.stride_tricks.sliding_window_view(np.pad(flat, reach), 2 * reach + 1).max(axis=1)
    planted = _smooth(near.astype(np.float64)[:, None], reach)[:, 0]
    lack = np.maximum(lack - whole, 0.0)
    lack = lack - (lack.min(axis=1) * (1.0 - planted))[:, None]
    return ankles + (whole + lack[..., None]) * np.array([0.0, 1.0, 0.0]), whole


def _lack(ankles: Array, goals: _Goals, body: Body, *, world: Array, places: Array) -> Array:
    """(frames, 2) metres by which the feet of a character's own shape would be in the ground.

    ``places`` (frames, 22, 3) are of the body with joint 0 at the origin. The ground is as low as the lowest corner at
    rest. A foot that the source has below it, such as down a stair, may be as low there.
    """
    rest = body.skeleton.rest_positions()
    lowest = [((rest[j] + corners) @ body.up).min() for j, corners in body.skeleton.soles.items()]
    floor = min(0.0, *map(float, lowest))
    joints = placed(body.skeleton, world)
    lack = np.zeros(ankles.shape[:2])
    for side, foot in enumerate(FEET):
        driver = body.drivers[foot]
        own = [j for j in body.skeleton.soles if driver in body.skeleton.ancestors(j)]
        for j in own:
            points = rot.rotate(world[:, None, j], body.skeleton.soles[j][None]) + joints[:, None, j]
            low = (points - places[:, None, foot])[..., 1].min(axis=1)
            ground = floor + np.minimum(goals.toes[:, side, 1] - body.toe_height, 0.0)
            lack[:, side] = np.maximum(lack[:, side], ground - low - ankles[:, side, 1])
    return lack


def _make_up(goals: _Goals, ankles: Array) -> Array:
    """(frames, 3) a shift of the hips for feet of another shape.

    With its toes in the same place a longer or higher foot has its ankle elsewhere. The hips follow it, by one
    height and one way forward for the whole clip, so that straight legs stay straight and the path stays smooth.
    """
    apart = ankles - goals.ankles
    chosen = goals.flat if goals.flat.sum() >= 3 else np.ones_like(goals.flat)
    height = float(np.median(apart[..., 1][chosen]))
    ahead = (apart * goals.forward[:, None]).sum(-1)[chosen]
    return height * np.array([0.0, 1.0, 0.0]) + float(np.median(ahead)) * goals.forward


def _drop(places: Array, ankles: Array, body: Body) -> Array:
    """(frames, 3) how far the hips must come down so that both feet reach their goals, without jerks."""
    need = np.zeros(len(places))
    for side, hip in enumerate((1, 2)):
        reach = (body.bone(hip) + body.bone(CHILD[hip] or hip)) * 0.9995
        flat = np.linalg.norm((places[:, hip] - ankles[:, side])[:, [0, 2]], axis=-1)
        height = places[:, hip, 1] - ankles[:, side, 1]
        allowed = np.sqrt(np.maximum(reach**2 - flat**2, 0.0))
        need = np.maximum(need, np.where(flat < reach, height - allowed, 0.0))
    need = np.clip(need, 0.0, 0.15)
    wide = np.lib.stride_tricks.sliding_window_view(np.pad(need, 3, mode="edge"), 7).max(axis=1)
    return _smooth(wide[:, None], 3) * np.array([0.0, 1.0, 0.0])
