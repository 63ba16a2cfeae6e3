"""What MuJoCo says of a clip: motors that pull the hinges to it with plain gains, no policy; when the robot falls."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.robots.body import Robot
from motionloom.robots.clip import Clip, velocities
from motionloom.robots.engine import load_mujoco

Array = NDArray[np.float64]
STEP = 0.002
"""Seconds of a step of the simulation."""
SOFT = 0.1
"""The gains: a hinge that is so many radians off gets its whole force; damped critically for the inertia it moves."""
FREQUENCY, ARMATURE = 8.0, 0.01
"""Hertz at which a hinge without a limit of force would swing, and inertia (kg m^2) of a motor that states none."""
_FALLEN = 0.6
"""A robot whose pelvis is lower than this share of where the clip has it has fallen."""


@dataclass(frozen=True)
class Tracking:
    """What became of a clip in the simulation."""

    free_seconds: float
    """Until it fell, root free; the clip's length where it did not."""
    fell: bool
    free_error: float
    """Radians: how far hinges were from the clip until then, root mean square."""
    held_error: float
    """The same with the root held to the clip, over all of it."""
    held_saturated: float
    """Share of steps in which a motor needed more than its force, root held."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {name: round(value, 4) if isinstance(value, float) else value for name, value in asdict(self).items()}


def track(clip: Clip, robot: Robot) -> Tracking:
    """Follow a clip in MuJoCo with plain gains, root free and root held.

    Nothing balances: a person's walk falls within a second or two. It compares clips, and shows motors too weak.
    """
    free = _run(clip, robot, held=False)
    held = _run(clip, robot, held=True)
    length = (len(clip) - 1) / clip.fps
    return Tracking(min(free[0], length), free[0] < length - 1e-9, free[1], held[1], held[2])


def _run(clip: Clip, robot: Robot, *, held: bool) -> tuple[float, float, float]:
    """Seconds until the fall, error in radians, share of steps with a motor at its force."""
    mujoco = load_mujoco()

    model = _on_ground(robot)
    if held:  # in the air: feet that push the ground would show the holding alone
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data, speeds = mujoco.MjData(model), velocities(robot, clip)
    most = _forces(robot)
    data.qpos, data.qvel = clip.qpos[0], speeds[0]
    mujoco.mj_forward(model, data)
    stiff, damp = _gains(model, data, most)
    model.dof_damping[6:] = damp  # integrated implicitly there, which is stable
    errors, saturated, steps = [], 0, round((len(clip) - 1) / clip.fps / STEP)
    pelvis = model.site(robot.site("pelvis")).id
    start = float(data.site_xpos[pelvis][2])
    for step in range(steps):
        at = step * STEP * clip.fps
        low = min(int(at), len(clip) - 2)
        share = at - low
        goal = clip.qpos[low] * (1 - share) + clip.qpos[low + 1] * share
        speed = speeds[low] * (1 - share) + speeds[low + 1] * share
        if held:
            data.qpos[:7], data.qvel[:6] = goal[:7], speed[:6]
            data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
        force = stiff * (goal[7:] - data.qpos[7:]) + damp * speed[6:]
        # gravity and what turning costs are known to the motors, as on real robots
        force += data.qfrc_bias[6:] if held else 0.0
        saturated += bool((np.abs(force) > most).any())
        data.qfrc_applied[6:] = np.clip(force, -most, most)
        mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos).all():
            return step * STEP, _rms(errors), saturated / max(step, 1)
        errors.append(float(np.mean((goal[7:] - data.qpos[7:]) ** 2)))
        tilt = np.arccos(np.clip(data.site_xmat[pelvis][8], -1, 1))  # between the pelvis' up and the world's
        if not held and (data.site_xpos[pelvis][2] < _FALLEN * start or tilt > 1.0):
            return step * STEP, _rms(errors), saturated / (step + 1)
    return steps * STEP, _rms(errors), saturated / max(steps, 1)


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(errors))) if errors else 0.0


def _forces(robot: Robot) -> Array:
    """(hinges,) newton metres that each hinge has, as joint or motor say; infinite where neither does."""
    model, most = robot.model, np.full(len(robot.file.hinges), np.inf)
    for row, hinge in enumerate(robot.file.hinges):
        if model.jnt_actfrclimited[hinge.joint]:
            most[row] = float(np.abs(model.jnt_actfrcrange[hinge.joint]).max())
        for motor in np.flatnonzero(model.actuator_trnid[:, 0] == hinge.joint):
            limit = model.actuator_forcerange[motor] if model.actuator_forcelimited[motor] else None
            if limit is None and model.actuator_ctrllimited[motor] and not most[row] < np.inf:
                limit = model.actuator_ctrlrange[motor] * model.actuator_gainprm[motor, 0]
            if limit is not None and np.abs(limit).max() > 0:
                most[row] = min(most[row], float(np.abs(limit).max()))
    return most


def _gains(model: Any, data: Any, most: Array) -> tuple[Array, Array]:
    """Stiffness and damping (hinges,), for the inertia that each hinge moves where the clip begins."""
    mujoco = load_mujoco()

    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    inertia = 1 / np.diag(np.linalg.inv(mass))[6:]  # with all else free to move
    stiff = np.where(np.isfinite(most), most / SOFT, inertia * (2 * np.pi * FREQUENCY) ** 2)
    return stiff, 2 * np.sqrt(stiff * inertia)


def _on_ground(robot: Robot) -> Any:
    """The model with a floor under the robot, small steps, and motors that have inertia."""
    mujoco = load_mujoco()

    spec = robot.file.spec.copy()
    if not any(geom.type == mujoco.mjtGeom.mjGEOM_PLANE for geom in spec.worldbody.geoms):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05])
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model = spec.compile()
    model.dof_armature[6:] = np.maximum(model.dof_armature[6:], ARMATURE)
    return model
