"""Robots on the command line: ``--robot`` of the commands that read and write motions, and ``robot-check``."""

import json
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from motionloom.cli.skeletons import OF_SKELETON, Target, refuse
from motionloom.cli.terminal import note
from motionloom.cli.writing import fail
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.retarget import to_smpl22

if TYPE_CHECKING:
    from motionloom.robots.body import Robot
    from motionloom.robots.clip import Clip

OUTS = (".csv", ".npz")
PICTURES = (".png", ".mp4", ".gif")
_READ: "WeakKeyDictionary[Motion, Clip]" = WeakKeyDictionary()
"""The clips that motions were read from: what nobody changed is written exactly as it was."""


@dataclass(frozen=True, kw_only=True)
class RobotTarget(Target):
    """A robot whose joint angles are written. Motions reach `save` as they are; the robot's own rate is set there."""

    robot: "Robot"
    fps: float
    max_speed: float | None = None
    avoid: bool = False
    header: bool = True
    figures: bool = False
    last: "list[tuple[Motion, Clip]]" = field(default_factory=list)
    """The last clip and its motion, for a second file of the same motion."""

    @property
    def suffix(self) -> str | None:
        """The suffix of joint angles that no other motion has."""
        return ".csv"

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Files that hold one robot."""
        return OUTS

    @property
    def metre(self) -> float:
        """Goals are in the robot's metres."""
        return self.robot.metre

    def writes(self, path: Path) -> bool:
        """No file of a robot is a character's with one more animation."""
        return False

    def retarget(self, motion: Motion, *, source: str = "the motion", source_map: Path | None = None) -> Motion:
        """The motion as it is, or on the uniform person where a map names its joints."""
        return motion if source_map is None else to_smpl22(motion, source_map)

    def retarget_all(self, motions: Sequence[Motion]) -> list[Motion]:
        """Motions of one world, as they are."""
        return list(motions)

    def save(self, motion: Motion, path: Path, *, caption: str | None = None) -> Path:
        """Write the robot's clip, or a picture or a film of it; any other format gets the motion of its skeleton."""
        from motionloom.robots.files import save_clip
        from motionloom.robots.film import draw

        if path.suffix.lower() not in (*OUTS, *PICTURES):
            return super().save(self.motion_for(motion, path), path, caption=caption)
        clip = self._clip_of(motion, path)
        if path.suffix.lower() in OUTS:
            return save_clip(clip, self.robot, path, header=self.header)
        return draw(self.robot, clip.qpos, clip.fps, path, caption=caption or "")

    def motion_for(self, motion: Motion, path: Path) -> Motion:
        """The robot's clip as motion of its skeleton; one that was read keeps its rate."""
        from motionloom.robots.body import to_motion

        known = _READ.get(motion)
        if known is not None and self.max_speed is None and not self.avoid:
            self.last[:] = [(motion, known)]
            return motion
        clip = self._clip_of(motion, path)
        return to_motion(self.robot, clip.qpos, clip.fps)

    def _clip_of(self, motion: Motion, path: Path) -> "Clip":
        if not self.last or self.last[0][0] is not motion:
            self.last[:] = [(motion, self.clip(motion, path))]
        return self.last[0][1]

    def summary(self) -> str:
        """How long the robot's clip is, at its own rate."""
        clip = self.last[0][1]
        length, hinges = len(clip) / clip.fps, len(self.robot.file.hinges)
        return f"{len(clip)} frames, {length:.2f} s at {clip.fps:g} frames per second, {hinges} joints of a robot"

    def takes(self, clip: "Clip") -> bool:
        """Whether a clip that was read is written as it is."""
        return clip.fps == self.fps and self.max_speed is None and not self.avoid

    def clip(self, motion: Motion, path: Path) -> "Clip":
        """The motion as the robot does it, with a line on stderr about what became of it."""
        from motionloom.robots.clip import put_on_robot
        from motionloom.robots.figures import measure

        known = _READ.get(motion)
        try:
            clip = (
                known
                if known is not None and self.takes(known)
                else put_on_robot(
                    motion, self.robot, fps=self.fps, max_speed=self.max_speed, avoid_collisions=self.avoid
                )
            )
        except MotionloomError as error:
            raise MotionloomError(f"{path} for {self.robot.name}: {error}") from None
        figures = measure(clip, self.robot, max_speed=self.max_speed)
        if clip.slowed:
            note(f"{path} is {clip.slowed:.2f} s longer than the motion, so that no joint is too fast")
        for fault in figures.faults():
            note(f"{path}: {fault}")
        if self.figures:
            print(json.dumps({"file": str(path), **figures.as_dict()}))
        return clip


def note_on_metres(metre: float) -> str:
    """What goals on a robot are, of which ``metre`` is one of the generated person's, for stderr."""
    units = "goals are in the robot's metres"
    return f"{units}; for the person that is generated, distances and speeds are {1 / metre:.2f} times as large"


def read_robot_target(arguments: Namespace) -> RobotTarget:
    """The robot of ``--robot`` and its options."""
    from motionloom.robots.clip import FPS, check_settings

    refuse(arguments, ("skeleton", *OF_SKELETON), "is for characters; leave it out with --robot")
    fps = arguments.fps or FPS
    check_settings(fps, arguments.max_speed)
    robot = opened(arguments)
    note(robot.remarks()[-1])
    return RobotTarget(
        name=str(arguments.robot),
        skeleton=robot.skeleton,
        robot=robot,
        unit=getattr(arguments, "out_unit", None) or 1.0,
        fps=fps,
        max_speed=arguments.max_speed,
        avoid=arguments.avoid_collisions,
        header=not arguments.no_header,
        figures=arguments.figures,
    )


def opened(arguments: Namespace) -> "Robot":
    """The robot of the line; what its file lacks is printed."""
    from motionloom.robots.body import read_robot

    robot = read_robot(arguments.robot, arguments.robot_map)
    for remark in robot.notes:
        note(remark)
    return robot


def reads_as_clip(arguments: Namespace, path: Path) -> bool:
    """Whether a file holds joint angles of a robot; refuses one where the line names no robot."""
    if path.suffix.lower() not in OUTS:
        return False
    from motionloom.robots.files import is_clip

    if not is_clip(path):
        return False
    if getattr(arguments, "robot", None) is None:
        fail(f"{path} holds joint angles of a robot; name its model with --robot")
    return True


def read_motion(arguments: Namespace, path: Path, robot: "Robot | None" = None) -> Motion:
    """A robot's file as motion of its skeleton; robot: that of the line, where it was read."""
    from motionloom.robots.body import to_motion
    from motionloom.robots.files import load_clip

    robot = robot or opened(arguments)
    rate = getattr(arguments, "source_fps", None)
    clip = load_clip(path, robot, fps=rate)
    if path.suffix.lower() == ".csv" and rate is None:
        note(f"{path} states no rate; {clip.fps:g} frames per second are assumed (--source-fps)")
    motion = to_motion(robot, clip.qpos, clip.fps)
    _READ[motion] = clip
    return motion


def run_check(arguments: Namespace) -> int:
    """``motionloom robot-check FILE --robot MODEL``; 0 where every figure is within its limit, else 1."""
    from motionloom.cli.reading import crop, read_clip
    from motionloom.robots.clip import FPS, check_settings, put_on_robot
    from motionloom.robots.figures import measure
    from motionloom.robots.physics import track

    if arguments.robot is None:
        fail("robot-check needs the robot's model; name it with --robot")
    robot = opened(arguments)
    fps = arguments.fps or FPS
    check_settings(fps, arguments.max_speed)
    if reads_as_clip(arguments, arguments.input):
        whole = read_motion(arguments, arguments.input, robot)
        first = round((arguments.start or 0.0) * whole.fps)
        clip = _READ[whole].frames(first, first + len(crop(whole, arguments)))
    else:
        motion = crop(read_clip(arguments, arguments.input)[0], arguments)
        clip = put_on_robot(
            motion,
            robot,
            fps=fps,
            max_speed=arguments.max_speed,
            avoid_collisions=arguments.avoid_collisions,
            source_map=arguments.source_map,
        )
    figures = measure(clip, robot, max_speed=arguments.max_speed)
    report = figures.as_dict() | {"faults": figures.faults()}
    if arguments.physics:
        if len(clip) < 2:
            fail(f"{arguments.input} has one frame; --physics follows a clip of at least two")
        report["physics"] = track(clip, robot).as_dict()
    if arguments.json:
        print(json.dumps({"file": str(arguments.input), **report}, indent=2))
    else:
        _print(report)
    return 1 if report["faults"] else 0


def check_inputs(arguments: Namespace) -> int:
    """``motionloom export FILE --robot MODEL --check``: as `run_check`, in JSON; nothing is written."""
    if arguments.robot is None or len(arguments.inputs) != 1 or arguments.out is not None or arguments.mirror:
        fail("--check says how good a robot's clip is; give one file, its --robot, and no OUT")
    arguments.input, arguments.json, arguments.physics = arguments.inputs[0], True, False
    return run_check(arguments)


def _print(report: dict) -> None:
    for name, value in report.items():
        if name == "physics":
            fell = f"falls after {value['free_seconds']:.2f} s" if value["fell"] else "does not fall"
            print(f"  {'root free':24} {fell}, {value['free_error']:.3f} rad off until then")
            full = 100 * value["held_saturated"]
            print(f"  {'root held':24} {value['held_error']:.3f} rad off, {full:.0f} % of the time at full force")
        elif name != "faults":
            print(f"  {name.replace('_', ' '):24} {'-' if value is None else value}")
    for fault in report["faults"]:
        print(f"  {'fault':24} {fault}")
