"""Commands about motion files: export, view, info."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from motionloom.motion import Motion
    from motionloom.skeleton import Skeleton

_RATE_ASSUMED = "an AMC file does not state its rate; 120 frames per second are assumed (--source-fps says otherwise)"
_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}


def add(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Register ``export``, ``view`` and ``info``."""
    export = subparsers.add_parser(
        "export",
        help="turn a motion file into another format",
        description="Turn a motion (.bvh, .amc with its .asf, .glb, .npz) into .bvh, .glb, .npz, .mp4, .gif or .png; "
        "the name of OUT picks the format.",
    )
    export.add_argument("input", metavar="IN", type=Path)
    export.add_argument("output", metavar="OUT", type=Path)
    _add_reading(export)
    export.add_argument("--fps", type=_rate, metavar="N", help="resample to this frame rate")
    export.add_argument("--skeleton", metavar="FILE|smpl22", help="put the motion on this skeleton")
    for side, whose in (("source", "of IN"), ("target", "of the --skeleton")):
        export.add_argument(f"--{side}-map", type=Path, metavar="JSON", help=f"which joints are which, {whose}")
    export.add_argument("--mirror", action="store_true", help="exchange left and right")
    export.add_argument("--out-unit", type=_unit, metavar="UNIT", help="unit of a BVH written (as read, else m)")
    export.add_argument("--order", metavar="XYZ", help="order of rotations of a BVH written (as read, else ZXY)")
    export.set_defaults(run=run_export)

    view = subparsers.add_parser(
        "view", help="draw a motion file", description="Draw motions as a contact sheet (.png) or a film (.mp4, .gif)."
    )
    view.add_argument("inputs", metavar="FILE", type=Path, nargs="+")
    _add_reading(view)
    view.add_argument("--out", metavar="PICTURE", type=Path, help="(default: FILE's name with .png, in this folder)")
    view.set_defaults(run=run_view)

    info = subparsers.add_parser(
        "info", help="say what a motion file holds", description="Say what a motion file holds and what looks wrong."
    )
    info.add_argument("input", metavar="FILE", type=Path)
    _add_reading(info)
    info.add_argument("--json", action="store_true", help="print JSON, with all joint names")
    info.set_defaults(run=run_info)


def _add_reading(command: argparse.ArgumentParser) -> None:
    command.add_argument("--unit", type=_unit, metavar="UNIT", help="unit of a BVH or ASF read: m, cm, inch, or metres")
    command.add_argument("--up", choices=("y", "z"), default="y", help="the axis that is up in the file (default y)")
    command.add_argument(
        "--asf", type=Path, metavar="FILE", help="skeleton of an AMC file (default: the one beside it)"
    )
    command.add_argument("--source-fps", type=_rate, metavar="N", help="take this rate for the file's (AMC: 120)")
    command.add_argument("--start", type=_seconds, metavar="S", help="begin at this second")
    command.add_argument("--end", type=_seconds, metavar="S", help="end at this second")


def _number(text: str) -> float:
    value = float(text)
    if not abs(value) < 1e9:
        raise ValueError
    return value


def _rate(text: str) -> float:
    try:
        value = _number(text)
    except ValueError:
        value = 0.0
    if not 0.1 <= value <= 1000:
        raise argparse.ArgumentTypeError(f"a number of 0.1 to 1000 frames per second is needed; got {text!r}")
    return value


def _seconds(text: str) -> float:
    try:
        value = _number(text)
    except ValueError:
        value = -1.0
    if value < 0:
        raise argparse.ArgumentTypeError(f"a number of seconds, 0 or more, is needed; got {text!r}")
    return value


def _unit(text: str) -> float:
    try:
        value = _UNITS[text.lower()] if text.lower() in _UNITS else _number(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        units = ", ".join(_UNITS)
        raise argparse.ArgumentTypeError(f"a unit is {units} or a number of metres above 0; got {text!r}")
    return value


def run_export(arguments: argparse.Namespace) -> None:
    """``motionloom export IN OUT``."""
    from motionloom import io
    from motionloom.errors import MotionloomError

    target = io.check_output(arguments.output)
    motion, unit, orders = _read(arguments, arguments.input)
    motion = _crop(motion, arguments)
    if arguments.mirror:
        motion = motion.mirror()
    if (arguments.source_map or arguments.target_map) and not arguments.skeleton:
        raise MotionloomError("--source-map and --target-map say which joints are which for a --skeleton; name one")
    if arguments.skeleton:
        skeleton, unit, orders = _skeleton(arguments.skeleton)
        motion = _put_on(motion, skeleton, arguments)
    if arguments.fps:
        motion = motion.resample(arguments.fps)
    if target.suffix.lower() == ".bvh":
        from motionloom.io.bvh import save_bvh

        save_bvh(motion, target, order=arguments.order or orders, unit=arguments.out_unit or unit or 1.0)
    else:
        _only_bvh(arguments)
        io.save(motion, target)
    print(f"wrote {target}: {_summary(motion)}")
    _note_rate(arguments, [arguments.input])


def run_view(arguments: argparse.Namespace) -> None:
    """``motionloom view FILE ...``."""
    from motionloom import io
    from motionloom.errors import MotionloomError

    target = arguments.out or Path(f"{arguments.inputs[0].stem}.png")
    if target.suffix.lower() not in (".png", ".mp4", ".gif"):
        raise MotionloomError(f"a picture ends in .png and a film in .mp4 or .gif; got {target}")
    io.check_output(target)
    motions = [_crop(_read(arguments, path)[0], arguments) for path in arguments.inputs]
    io.save(motions, target, captions=[path.stem for path in arguments.inputs])
    print(f"wrote {target}")
    _note_rate(arguments, arguments.inputs)


def run_info(arguments: argparse.Namespace) -> None:
    """``motionloom info FILE``."""
    import json
    from dataclasses import asdict

    from motionloom.io.info import describe

    motion, unit, _ = _read(arguments, arguments.input)
    info = describe(_crop(motion, arguments))
    problems = [*info.problems, *([_RATE_ASSUMED] if _rate_assumed(arguments, [arguments.input]) else [])]
    if arguments.json:
        print(json.dumps({"file": str(arguments.input), "unit": unit, **asdict(info), "problems": problems}, indent=2))
        return
    low, high = info.lowest, info.highest
    box = " x ".join(f"{h - l:.2f}" for l, h in zip(low, high))
    print(f"{arguments.input}")
    print(f"  skeleton  {info.skeleton}, {info.joints} joints, {info.ends} of them bone ends")
    print(f"  time      {info.frames} frames, {info.seconds:.2f} s at {info.fps:g} frames per second")
    print(f"  body      {info.height:.2f} m tall; the feet are at {info.floor:+.2f} m")
    print(f"  way       {info.path:.2f} m along the floor, ends {info.travel:.2f} m from the start")
    print(f"  space     {box} m (x, y up, z)")
    if unit is not None:
        print(f"  unit      {unit:g} m in the file{'' if arguments.unit else ', by the length of its bones'}")
    for problem in problems:
        print(f"  problem   {problem}")


def _rate_assumed(arguments: argparse.Namespace, paths: list[Path]) -> bool:
    return arguments.source_fps is None and any(path.suffix.lower() == ".amc" for path in paths)


def _note_rate(arguments: argparse.Namespace, paths: list[Path]) -> None:
    if _rate_assumed(arguments, paths):
        print(f"note: {_RATE_ASSUMED}", file=sys.stderr)


def _summary(motion: "Motion") -> str:
    frames = "1 frame" if len(motion) == 1 else f"{len(motion)} frames"
    return f"{frames}, {motion.seconds:.2f} s at {motion.fps:g} frames per second, {len(motion.skeleton)} joints"


def _read(arguments: argparse.Namespace, path: Path) -> "tuple[Motion, float | None, dict[str, str]]":
    """The motion and, of a BVH, the unit of its file and the orders of its rotations."""
    from motionloom import io

    unit, orders = None, {}
    if path.suffix.lower() == ".bvh" and not path.is_dir() and arguments.asf is None:
        from motionloom.io.bvh import read_bvh

        file = read_bvh(path, fps=arguments.source_fps, unit=arguments.unit)
        motion, unit, orders = file.motion, file.unit, dict(file.orders)
    else:
        motion = io.load(path, fps=arguments.source_fps, asf=arguments.asf, unit=arguments.unit)
    return (_stand_up(motion) if arguments.up == "z" else motion), unit, orders


def _stand_up(motion: "Motion") -> "Motion":
    """From Z up to Y up: a quarter turn of everything about X."""
    from dataclasses import replace

    import numpy as np

    from motionloom import rotations as rot

    turn = rot.rotvec_to_quat(np.array([-np.pi / 2, 0.0, 0.0]))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
    return replace(motion, root=rot.rotate(turn, motion.root), rotations=rotations)


def _crop(motion: "Motion", arguments: argparse.Namespace) -> "Motion":
    if arguments.start is None and arguments.end is None:
        return motion
    return motion.crop(arguments.start or 0.0, motion.seconds if arguments.end is None else arguments.end)


def _skeleton(name: str) -> "tuple[Skeleton, float, dict[str, str]]":
    """A skeleton to put motions on, with the unit and orders of its file."""
    from motionloom import io
    from motionloom.errors import MotionloomError
    from motionloom.skeleton import SMPL22

    path = Path(name)
    if name.lower() == "smpl22":
        return SMPL22, 1.0, {}
    if path.suffix.lower() == ".bvh":
        from motionloom.io.bvh import read_bvh

        file = read_bvh(path)
        return file.motion.skeleton, file.unit, dict(file.orders)
    if path.suffix.lower() == ".asf":
        from motionloom.io.asf import load_skeleton

        return load_skeleton(path), 1.0, {}
    if path.suffix.lower() not in io.READS:
        raise MotionloomError(f"--skeleton needs smpl22 or a file (.asf, {', '.join(io.READS)}); got {name!r}")
    return io.load(path).skeleton, 1.0, {}


def _put_on(motion: "Motion", skeleton: "Skeleton", arguments: argparse.Namespace) -> "Motion":
    from motionloom.errors import MotionloomError
    from motionloom.retarget import retarget

    try:
        return retarget(motion, skeleton, source_map=arguments.source_map, target_map=arguments.target_map)
    except MotionloomError as error:
        hint = "--source-map or --target-map"
        raise MotionloomError(f"{arguments.input} onto {arguments.skeleton}: {error} ({hint})") from None


def _only_bvh(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError

    if arguments.out_unit or arguments.order:
        raise MotionloomError(f"--out-unit and --order are for BVH files; {arguments.output} is none")
