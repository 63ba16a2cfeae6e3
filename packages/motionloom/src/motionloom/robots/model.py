"""Robot models: MJCF (and URDF as MuJoCo reads it) to a `Model`, checked before anything is done with it."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.reading import read_bytes
from motionloom.robots.engine import load_mujoco, posed
from motionloom.robots.trial import try_model

Array = NDArray[np.float64]
MAX_BYTES = 50_000_000
MAX_HINGES = 200
MAX_THINGS = 3000
"""Bodies, geoms, sites, or points of what is soft."""


@dataclass(frozen=True, eq=False)
class Hinge:
    """One joint of a robot."""

    name: str
    joint: int
    """Number in MuJoCo's model."""
    body: int
    """The body that it turns."""
    parent: int
    """The body that this one hangs on."""
    anchor: Array
    """(3,) metres, and the axis (3,), in MuJoCo's world in the model's own pose (``qpos0``)."""
    axis: Array


@dataclass(frozen=True, eq=False)
class Coupling:
    """A hinge that another one moves, as gears do: MJCF's ``<equality><joint>``, URDF's ``<mimic>``."""

    hinge: int
    """Row of the hinge that follows, in `Model.hinges`."""
    leader: int
    """Row of the hinge that moves it."""
    factors: Array
    """(5,) of a polynomial, from the leader's radians from its rest to the follower's."""
    rest: Array
    """(2,) radians of the follower and of the leader in ``qpos0``."""

    def angle(self, angles: Array) -> float:
        """Radians of the follower where all hinges are at ``angles`` (hinges,)."""
        return float(self.rest[0] + np.polyval(self.factors[::-1], angles[self.leader] - self.rest[1]))

    def slope(self, angles: Array) -> float:
        """Radians by which the follower goes for one of its leader."""
        return float(np.polyval(np.polyder(self.factors[::-1]), angles[self.leader] - self.rest[1]))


@dataclass(frozen=True, eq=False)
class Model:
    """A robot as MuJoCo knows it: a root that moves freely, and hinges with limits."""

    path: Path
    spec: Any
    """`mujoco.MjSpec`: what the model is compiled from."""
    model: Any
    """`mujoco.MjModel`."""
    hinges: tuple[Hinge, ...]
    """In the model's order, which is that of ``qpos`` behind the root's seven numbers."""
    lower: Array
    """(hinges,) radians."""
    upper: Array
    speed: Array
    """(hinges,) radians per second; infinite where the file states none."""
    couplings: tuple[Coupling, ...]
    notes: tuple[str, ...]
    """What a user should know about the file, a sentence each."""

    @property
    def name(self) -> str:
        """What the model calls itself; the file's name where it does not."""
        return str(self.spec.modelname) or self.path.stem

    def speeds(self, most: float | None) -> Array:
        """(hinges,) radians per second that are kept where none is to exceed ``most`` (None: what the file states)."""
        return self.speed if most is None else np.minimum(self.speed, most)

    def coupled(self, angles: Array) -> Array:
        """The angles (hinges,), with those that follow others where these move them, within their range."""
        angles = angles.copy()
        for one in self.couplings:
            angles[one.hinge] = np.clip(one.angle(angles), self.lower[one.hinge], self.upper[one.hinge])
        return angles

    def above(self, body: int) -> list[int]:
        """A body and those that it hangs on, the world (0) last."""
        line = [body]
        while line[-1]:
            line.append(int(self.model.body_parentid[line[-1]]))
        return line

    def joint_names(self) -> tuple[str, ...]:
        """Names of the hinges in order."""
        return tuple(hinge.name for hinge in self.hinges)


def read_model(path: Path | str, *, meshes: bool = False) -> Model:
    """Read and check a robot's model.

    Args:
        path: MJCF (.xml) or URDF (.urdf).
        meshes: Whether meshes that are only looked at are read; without them a model loads faster.

    Raises:
        MotionloomError: It is missing, damaged, or no robot with one free root and hinges that have limits.
        ModuleNotFoundError: MuJoCo is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in (".xml", ".mjcf", ".urdf"):
        raise MotionloomError(f"a robot's model is MJCF (.xml) or URDF (.urdf); got {path}")
    text = read_bytes(path, max_bytes=MAX_BYTES)
    load_mujoco()
    try_model(path, meshes=meshes)
    spec, model, notes = compiled(path, meshes=meshes)
    hinges = _hinges(model, path)
    if not model.nu:
        notes.append(f"{path} has no actuators; that matters for --physics alone, where no force is limited then")
    joints = [hinge.joint for hinge in hinges]
    limited = model.jnt_limited[joints].astype(bool)
    lower, upper = np.where(limited, model.jnt_range[joints].T, [[-np.inf], [np.inf]])
    couplings, loose = _couplings(model, hinges)
    if loose:
        notes.append(f"{path} has {loose} constraints that close chains of its bodies; they are not kept")
    return Model(path, spec, model, hinges, lower, upper, _speeds(text, hinges), couplings, tuple(notes))


def compiled(path: Path, *, meshes: bool) -> tuple[Any, Any, list[str]]:
    """The `mujoco.MjSpec` of a file, its `mujoco.MjModel`, and notes for a user.

    Raises `MotionloomError` for one that is no model, has several roots, or more bodies than a robot has.
    """
    mujoco = load_mujoco()

    try:
        path.read_bytes().decode("utf-8")
        spec = mujoco.MjSpec.from_file(str(path))
        notes = [*_without_meshes(spec, path, meshes), *_free_root(spec, path)]
        model = spec.compile()
    except MotionloomError:
        raise
    except (ValueError, RuntimeError) as error:
        line = one_line(" ".join(str(error).split()))[:300]
        raise MotionloomError(f"{path} is no model that MuJoCo reads: {line}") from None
    most = max(model.nbody, model.ngeom, model.nsite, model.nflexvert)
    if most > MAX_THINGS:
        raise MotionloomError(
            f"{path} has {most:,} bodies, geoms, sites or points; a robot's model has {MAX_THINGS:,} at most"
        )
    return spec, model, notes


def _couplings(model: Any, hinges: tuple[Hinge, ...]) -> tuple[tuple[Coupling, ...], int]:
    """Hinges that others move, and how many other constraints there are."""
    mujoco, rows = load_mujoco(), {hinge.joint: row for row, hinge in enumerate(hinges)}
    couplings, loose = [], 0
    for number in np.flatnonzero(model.eq_active0):
        follower, leader = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
        if model.eq_type[number] != mujoco.mjtEq.mjEQ_JOINT or follower not in rows:
            loose += 1
            continue
        factors, alone = np.array(model.eq_data[number, :5]), leader not in rows
        leader = follower if alone else leader
        factors[1:] *= not alone  # a hinge without a leader is held where it is
        rest = model.qpos0[model.jnt_qposadr[[follower, leader]]]
        couplings.append(Coupling(rows[follower], rows[leader], factors, rest))
    return tuple(couplings), loose


def _without_meshes(spec: Any, path: Path, meshes: bool) -> list[str]:
    """Take meshes out that are not there and say so, and unless ``meshes`` those that are only looked at."""
    mujoco = load_mujoco()

    folder = path.parent / spec.meshdir
    for mesh in spec.meshes:
        mesh.file = _in_package(mesh.file, path)
    named = [(mesh.name, mesh.file) for mesh in spec.meshes if mesh.file]
    missing = {name: file for name, file in named if not (folder / file).is_file()}
    heavy = all(body.explicitinertial for body in spec.bodies if body.parent is not None)  # without its geoms
    for geom in list(spec.geoms):
        looks = not meshes and heavy and not (geom.contype or geom.conaffinity)
        if geom.meshname and (geom.meshname in missing or looks):
            spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)
    if missing:
        spec.compiler.boundmass, spec.compiler.boundinertia = 1e-3, 1e-6
    for mesh in spec.meshes:  # no robot is refused for one that MuJoCo thinks open
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    if not missing:
        return []
    first = next(iter(missing.values()))
    return [f"{len(missing)} of the meshes of {path} are not there (such as {first}); the robot does without them"]


def _in_package(name: str, path: Path) -> str:
    """The file of a mesh that a URDF names by its ROS package, which is the model's folder or one above; else the
    name."""
    if not name.startswith("package://"):
        return name
    package, _, inside = name.removeprefix("package://").partition("/")
    roots = path.resolve().parents
    candidates = [above / inside for above in roots if above.name == package] + [
        roots[0] / inside,
        roots[0] / package / inside,
    ]
    return next((str(one) for one in candidates if one.is_file()), name)


def _free_root(spec: Any, path: Path) -> list[str]:
    """Give a robot whose base is fixed a root that moves; refuse several things that move freely."""
    mujoco = load_mujoco()

    spec.compiler.fusestatic = False
    free = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if len(free) > 1:
        raise MotionloomError(
            f"{path} has {len(free)} things that move freely; give the model of one robot alone, without objects"
        )
    if free:
        return []
    bases = [body for body in spec.bodies if body.parent is not None and body.parent.name == "world"]
    if not bases:
        raise MotionloomError(f"{path} has no bodies; give the model of a humanoid robot")
    base = max(bases, key=lambda body: len(body.find_all("joint")))
    base.add_freejoint(name="root")
    if path.suffix.lower() == ".urdf":
        return []
    return [f"the base of the robot in {path} is fixed; it was set free"]


def _hinges(model: Any, path: Path) -> tuple[Hinge, ...]:
    mujoco, data, hinges = load_mujoco(), posed(model), []
    for joint in range(model.njnt):
        kind, name = model.jnt_type[joint], model.joint(joint).name
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            if joint:
                raise MotionloomError(f"{path} has its free root behind other joints; put the robot first in the model")
            continue
        if kind != mujoco.mjtJoint.mjJNT_HINGE:
            what = "a ball joint" if kind == mujoco.mjtJoint.mjJNT_BALL else "a joint that slides"
            raise MotionloomError(f"{path} has {what}, {name!r}; a robot whose joints are all hinges is needed")
        body = int(model.jnt_bodyid[joint])
        parent, axis = int(model.body_parentid[body]), (data.xanchor[joint], data.xaxis[joint])
        hinges.append(Hinge(name or f"joint{joint}", joint, body, parent, *axis))
    if not hinges or len(hinges) > MAX_HINGES:
        raise MotionloomError(f"{path} has {len(hinges)} hinges; a humanoid robot has some, and at most {MAX_HINGES}")
    return tuple(hinges)


def check_limits(model: Model, joints: set[int]) -> None:
    """Refuse a robot that has no limits at these joints (numbers in MuJoCo's model)."""
    own = [hinge for hinge in model.hinges if hinge.joint in joints]
    endless = [hinge.name for hinge in own if not model.model.jnt_limited[hinge.joint]]
    if endless:
        more = f" and {len(endless) - 3} more" if len(endless) > 3 else ""
        raise MotionloomError(
            f"{model.path} states no limits for {', '.join(endless[:3])}{more}; give each joint a range in the model"
        )


def _speeds(text: bytes, hinges: tuple[Hinge, ...]) -> Array:
    """(hinges,) rad/s that a URDF states (MuJoCo does not keep them); infinite elsewhere."""
    stated: dict[str, float] = {}
    try:
        for joint in ElementTree.fromstring(text).iter("joint"):
            limit = joint.find("limit")
            if limit is not None and limit.get("velocity"):
                stated[joint.get("name", "")] = float(limit.get("velocity", ""))
    except (ElementTree.ParseError, ValueError):
        return np.full(len(hinges), np.inf)
    speeds = np.array([stated.get(hinge.name, np.inf) for hinge in hinges])
    return np.where(speeds > 0, speeds, np.inf)
