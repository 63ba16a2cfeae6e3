"""Pictures and films of a robot, through MuJoCo's offscreen renderer where it works and our own where it does not."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from motionloom.core import rotations as rot
from motionloom.core.files.atomic import atomic_path
from motionloom.robots.body import Robot, read_robot, to_motion, to_mujoco
from motionloom.robots.engine import load_mujoco
from motionloom.viz.film import film_rate, film_size, write_film

Array = NDArray[np.float64]
SIZE, CELL, COLUMNS = (640, 480), (150, 200), 8
_GREY, _SKY = (0.55, 0.57, 0.6, 1.0), (0.93, 0.94, 0.96)
_THICK = 0.07
"""Radius of a capsule in lengths of a thigh, where a robot has no meshes."""


def draw(robot: Robot, poses: Array, fps: float, path: Path, *, caption: str = "") -> Path:
    """Write a film (.mp4, .gif) or a row of poses (.png) of a robot.

    poses: (frames, nq). Raises `MotionloomError` where the file cannot be written.
    """
    try:
        renderer = _Renderer(robot, CELL if path.suffix.lower() == ".png" else film_size(SIZE))
    except _NoRenderer as error:
        from motionloom import io

        print(f"note: MuJoCo cannot draw here ({error}); the robot's skeleton is drawn", file=sys.stderr)
        return io.save(to_motion(robot, poses, fps), path, captions=[caption])
    with renderer:
        if path.suffix.lower() == ".png":
            return _sheet(renderer, poses, path)
        rate = film_rate(path, fps, None)
        count = max(1, round((len(poses) - 1) / fps * rate) + 1)
        places = np.minimum(np.arange(count) * fps / rate, len(poses) - 1)
        poses = poses[places.round().astype(int)]

        def frames(numbers: Sequence[int]) -> Iterator[Image.Image]:
            return renderer.pictures(poses[list(numbers)])

        return write_film(frames, path, renderer.size, rate=rate, count=count)


def _sheet(renderer: "_Renderer", poses: Array, path: Path) -> Path:
    chosen = poses[np.linspace(0, len(poses) - 1, COLUMNS).round().astype(int)]
    sheet = Image.new("RGB", (CELL[0] * COLUMNS, CELL[1]))
    for column, picture in enumerate(renderer.pictures(chosen)):
        sheet.paste(picture, (CELL[0] * column, 0))
    with atomic_path(path) as temporary:
        sheet.save(temporary, format="PNG", optimize=True)
    return path


class _NoRenderer(Exception):
    """MuJoCo has no way to draw without a screen here."""


class _Renderer:
    """Draws a robot from a camera that goes along."""

    def __init__(self, robot: Robot, size: tuple[int, int]) -> None:
        mujoco = load_mujoco()

        self.size = size
        meshed = read_robot(robot.file.path, meshes=True, override=robot.map)
        self.model = _clothed(meshed)
        self.data, self.camera = mujoco.MjData(self.model), mujoco.MjvCamera()
        self.camera.distance = 2.1 * _tall(robot)
        self.camera.azimuth = 130
        self.camera.elevation = -12
        try:
            self.renderer = mujoco.Renderer(self.model, size[1], size[0])
        except Exception as error:  # each backend of OpenGL has exceptions of its own
            raise _NoRenderer(str(error).split("\n")[0][:80] or type(error).__name__) from None
        self.height = 0.55 * _tall(robot)  # raised hands are seen too

    def __enter__(self) -> "_Renderer":
        return self

    def __exit__(self, *_: object) -> None:
        self.renderer.close()

    def pictures(self, poses: Array) -> Iterator[Image.Image]:
        mujoco = load_mujoco()

        for pose in poses:
            self.data.qpos = pose
            mujoco.mj_forward(self.model, self.data)
            self.camera.lookat = [pose[0], pose[1], self.height]
            self.renderer.update_scene(self.data, self.camera)
            yield Image.fromarray(self.renderer.render())


def _tall(robot: Robot) -> float:
    rest = robot.skeleton.rest_positions()
    return float(rest[:, 1].max()) * 1.1


def _clothed(robot: Robot) -> Any:
    """The model with a floor and light, and a capsule for each bone that has nothing to look at."""
    mujoco = load_mujoco()

    spec, model, skeleton = robot.file.spec, robot.model, robot.skeleton
    visible = [
        g for g in range(model.ngeom) if model.geom_rgba[g][3] > 0 and model.geom_group[g] < 3
    ]  # as MuJoCo draws
    bodies = {int(model.body_weldid[model.geom_bodyid[g]]) for g in visible}
    own = {body.id: body for body in spec.bodies}
    thick = _THICK * float(np.linalg.norm(skeleton.offsets[skeleton.index("left_knee")]))
    few = len(bodies - {0}) < 0.6 * len({hinge.body for hinge in robot.file.hinges})
    for j, parent in enumerate(skeleton.parents):
        if parent < 0 or not few:
            continue
        site = model.site(robot.site(skeleton.names[parent])).id
        body = int(model.site_bodyid[site])
        start = model.site_pos[site]
        turn = model.site_quat[site]
        end = start + rot.rotate(np.array(turn), to_mujoco(skeleton.offsets[j]))
        own[body].add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=np.concatenate([start, end]),
            size=[thick, 0, 0],
            contype=0,
            conaffinity=0,
            mass=0,
            rgba=_GREY,
        )
    if not any(geom.type == mujoco.mjtGeom.mjGEOM_PLANE for geom in spec.worldbody.geoms):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], rgba=[0.86, 0.87, 0.88, 1])
        spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1])
    for light in spec.lights:
        light.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM  # as bright where the robot has gone
    for texture in list(spec.textures):
        if texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX:
            spec.delete(texture)
    spec.add_texture(
        name="motionloom sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=_SKY,
        rgb2=_SKY,
        width=32,
        height=32,
    )
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    return spec.compile()
